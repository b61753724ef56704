//! What a protocol of poses and surfaces has to say, so that all share one loop, one pacing and one session.

use retina_core::predict::Prediction;

use super::binary::Head;
use crate::problem::Problem;
use crate::wire::stream::{MemoryOpened, OpenSpec, StreamPose};

/// Reads what opens a session, on a numerical thread: it may be long.
pub type Opening<F> = Box<dyn FnOnce() -> Result<(OpenSpec, F), Problem> + Send>;

/// How a session writes its answers.
pub trait Form: Send + Sync + Sized + 'static {
    /// A message of the server.
    type Message: Send + 'static;
    /// What a pose brings that its answer repeats, beside its number and time.
    type Tag: Clone + Send + 'static;

    /// The session has begun, its surfaces all with these triangles, none for a mesh; with what was planned where it has memory.
    ///
    /// # Errors
    /// The problem that the client is told of.
    fn opened(&self, triangles: &[[usize; 3]], memory: Option<MemoryOpened>) -> Result<Self::Message, Problem>;

    /// The answer to a pose.
    ///
    /// # Errors
    /// The problem that the client is told of.
    fn answer(&self, head: &Head, tag: &Self::Tag, prediction: &Prediction) -> Result<Self::Message, Problem>;
}

/// What a message of the client asks for.
pub enum Taken<F: Form> {
    /// Nothing.
    Nothing,
    /// To open a session.
    Open(Opening<F>),
    /// To answer a pose.
    Pose(StreamPose, F::Tag),
    /// To be told this.
    Say(F::Message),
    /// What cannot be.
    Refused(Problem),
    /// To be let go.
    Leave,
}

/// Why a connection ends.
pub enum Farewell<E> {
    /// The service stops.
    Stopping,
    /// The client was not heard of for the idle time.
    Silent,
    /// The transport, or what it brings, is broken.
    Broken(E),
}

/// One end of a conversation.
pub trait Protocol: Send + 'static {
    /// How its sessions write.
    type Form: Form;
    /// A message as the transport brings it.
    type Incoming: Send;
    /// What the transport fails with.
    type Fault;

    /// The session that a client has without asking for one.
    fn begin(&mut self) -> Option<Opening<Self::Form>>;

    /// What a message asks for.
    fn take(&mut self, message: Self::Incoming) -> Taken<Self::Form>;

    /// A problem, that of a pose where it is one.
    fn problem(
        &self,
        about: Option<(&StreamPose, &<Self::Form as Form>::Tag)>,
        dropped: u32,
        problem: &Problem,
    ) -> <Self::Form as Form>::Message;

    /// What a client is sent now and then so that it shows that it is there.
    fn knock(&self) -> Option<<Self::Form as Form>::Message>;

    /// The last message, if the client is to have one.
    fn farewell(&self, why: Farewell<Self::Fault>) -> Option<<Self::Form as Form>::Message>;
}
