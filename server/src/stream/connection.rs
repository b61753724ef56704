//! One connection: what has come, what is at work and what is being sent.
//!
//! Contract: at most one message of each kind is held: an opening, the newest pose, a job, a message being sent; and some remarks. While
//! those remarks fill their room nothing more is read, so a client that sends nonsense and reads nothing waits.

use std::collections::VecDeque;
use std::future::{Future, pending};
use std::pin::Pin;
use std::sync::Arc;
use std::time::{Duration, Instant};

use futures_util::stream::{SplitSink, SplitStream};
use futures_util::{Sink, SinkExt as _, Stream, StreamExt as _};
use tokio::time::{interval_at, timeout};

use super::protocol::{Farewell, Form, Opening, Protocol, Taken};
use super::session::{Posed, Session, open};
use crate::problem::{Kind, Problem};
use crate::state::AppState;
use crate::stopwatch::Stopwatch;
use crate::wire::stream::StreamPose;

/// Remarks (problems, mostly) that may wait to be sent.
const MOST_REMARKS: usize = 16;

/// How long a farewell may take.
const FAREWELL: Duration = Duration::from_secs(1);

type FormOf<P> = <P as Protocol>::Form;
type MessageOf<P> = <FormOf<P> as Form>::Message;
type TagOf<P> = <FormOf<P> as Form>::Tag;
type PosedOf<P> = Posed<TagOf<P>>;
type Sending<S> = Pin<Box<dyn Future<Output = Result<S, ()>> + Send>>;
type Work<F> = Pin<Box<dyn Future<Output = Done<F>> + Send>>;

/// A transport: messages in and out, of one protocol.
pub trait Transport<P: Protocol>:
    Stream<Item = Result<P::Incoming, P::Fault>> + Sink<MessageOf<P>> + Send + 'static
{
}

impl<P: Protocol, T> Transport<P> for T where
    T: Stream<Item = Result<P::Incoming, P::Fault>> + Sink<MessageOf<P>> + Send + 'static
{
}

/// What came of a job.
enum Done<F: Form> {
    Opened(Result<(Session<F>, F::Message), Problem>),
    Answered(F::Message),
    /// A pose has no answer.
    Refused(Posed<F::Tag>, u32, Problem),
}

/// The way out.
enum Outbox<S> {
    Idle(S),
    Sending(Sending<S>),
    Broken,
}

struct Connection<P: Protocol, T: Transport<P>> {
    protocol: P,
    app: AppState,
    began: Instant,
    heard: Instant,
    session: Option<Arc<Session<FormOf<P>>>>,
    opening: Option<Opening<FormOf<P>>>,
    /// When that was asked for.
    asked: Instant,
    newest: Option<PosedOf<P>>,
    last_sequence: Option<u64>,
    dropped: u32,
    remarks: VecDeque<MessageOf<P>>,
    ready: Option<MessageOf<P>>,
    work: Option<Work<FormOf<P>>>,
    outbox: Outbox<SplitSink<T, MessageOf<P>>>,
}

/// Serves one client until it goes or the service stops.
pub async fn serve<P: Protocol, T: Transport<P>>(transport: T, mut protocol: P, app: AppState) {
    let (sink, stream) = transport.split();
    let now = Instant::now();
    let connection = Connection::<P, T> {
        began: now,
        heard: now,
        session: None,
        opening: protocol.begin(),
        asked: now,
        newest: None,
        last_sequence: None,
        dropped: 0,
        remarks: VecDeque::new(),
        ready: None,
        work: None,
        outbox: Outbox::Idle(sink),
        protocol,
        app,
    };
    connection.run(stream).await;
}

impl<P: Protocol, T: Transport<P>> Connection<P, T> {
    async fn run(mut self, mut stream: SplitStream<T>) {
        let idle = self.app.streams.idle;
        // A third of the time leaves a client two more occasions to show that it is there.
        let mut tick = interval_at(tokio::time::Instant::now() + idle / 3, idle / 3);
        let stop = self.app.streams.stopping.clone();
        let mut stopping = false;
        let farewell = loop {
            self.go_on(stopping);
            if stopping && self.work.is_none() && matches!(self.outbox, Outbox::Idle(_)) {
                break Some(Farewell::Stopping);
            }
            tokio::select! {
                message = stream.next(), if self.remarks.len() < MOST_REMARKS && !stopping => match message {
                    Some(Ok(message)) => {
                        if !self.take(message) {
                            break None;
                        }
                    }
                    Some(Err(fault)) => break Some(Farewell::Broken(fault)),
                    None => break None,
                },
                done = finished(&mut self.work) => self.finish(done),
                sent = sent(&mut self.outbox) => match sent {
                    Ok(sink) => self.outbox = Outbox::Idle(sink),
                    Err(()) => break None,
                },
                _ = tick.tick() => {
                    if self.heard.elapsed() >= idle {
                        tracing::debug!("a stream whose client is not heard of is closed");
                        break Some(Farewell::Silent);
                    }
                    if let (Outbox::Idle(_), Some(knock)) = (&self.outbox, self.protocol.knock()) {
                        self.send(knock);
                    }
                }
                () = stop.cancelled(), if !stopping => stopping = true,
            }
        };
        let last = farewell.and_then(|why| self.protocol.farewell(why));
        if let (Some(last), Outbox::Idle(mut sink)) = (last, self.outbox) {
            // The client may be gone already.
            let _ = timeout(FAREWELL, sink.send(last)).await;
        }
    }

    /// Sends and begins what can be.
    fn go_on(&mut self, stopping: bool) {
        if !matches!(self.outbox, Outbox::Idle(_)) {
            return;
        }
        if let Some(message) = self.ready.take().or_else(|| self.remarks.pop_front()) {
            return self.send(message);
        }
        if self.work.is_some() || stopping {
            return;
        }
        if let Some(opening) = self.opening.take() {
            self.work = Some(open_on(self.app.clone(), opening, self.asked));
        } else if let Some(posed) = self.newest.take() {
            let dropped = std::mem::take(&mut self.dropped);
            match &self.session {
                Some(session) => {
                    self.work = Some(answer_on(self.app.clone(), Arc::clone(session), posed, dropped));
                }
                None => {
                    let problem = Problem::new(Kind::InvalidRequest, "There is no session; send {\"open\": {}} first.");
                    self.refuse(Some((&posed.pose, &posed.tag)), dropped, &problem);
                    self.go_on(stopping);
                }
            }
        }
    }

    fn send(&mut self, message: MessageOf<P>) {
        self.outbox = match std::mem::replace(&mut self.outbox, Outbox::Broken) {
            Outbox::Idle(mut sink) => Outbox::Sending(Box::pin(async move {
                let sent = sink.send(message).await;
                sent.map(|()| sink).map_err(drop)
            })),
            busy => busy,
        };
    }

    /// Takes in a message of the client; false if it leaves.
    fn take(&mut self, message: P::Incoming) -> bool {
        self.heard = Instant::now();
        match self.protocol.take(message) {
            Taken::Nothing => {}
            Taken::Open(opening) => {
                // What the session before had not yet answered has no answer.
                (self.session, self.newest, self.last_sequence, self.dropped) = (None, None, None, 0);
                (self.opening, self.asked) = (Some(opening), self.heard);
            }
            Taken::Pose(pose, tag) => self.take_pose(pose, tag),
            Taken::Say(message) => self.remarks.push_back(message),
            Taken::Refused(problem) => self.refuse(None, 0, &problem),
            Taken::Leave => return false,
        }
        true
    }

    fn take_pose(&mut self, pose: StreamPose, tag: TagOf<P>) {
        if let Some(last) = self.last_sequence.filter(|last| pose.sequence <= *last) {
            let detail = format!("pose.sequence is {}, and that of the pose before was {last}", pose.sequence);
            let allowed = format!("more than {last}");
            let given = Some(pose.sequence.into());
            let problem = Problem::field(Kind::OutOfRange, "pose.sequence", given, allowed, detail);
            return self.refuse(Some((&pose, &tag)), 0, &problem);
        }
        self.last_sequence = Some(pose.sequence);
        let posed = Posed { pose, tag, arrived: self.heard, received: self.heard - self.began };
        if self.newest.replace(posed).is_some() {
            self.dropped += 1;
        }
    }

    fn finish(&mut self, done: Done<FormOf<P>>) {
        self.work = None;
        match done {
            // Another opening has come meanwhile, and takes its place.
            Done::Opened(_) if self.opening.is_some() => {}
            Done::Opened(Ok((session, message))) => {
                self.session = Some(Arc::new(session));
                self.ready = Some(message);
            }
            Done::Opened(Err(problem)) => self.refuse(None, 0, &problem),
            Done::Answered(message) => self.ready = Some(message),
            Done::Refused(posed, dropped, problem) => self.refuse(Some((&posed.pose, &posed.tag)), dropped, &problem),
        }
    }

    fn refuse(&mut self, about: Option<(&StreamPose, &TagOf<P>)>, dropped: u32, problem: &Problem) {
        self.app.metrics.pose_refused(problem.kind, dropped);
        self.remarks.push_back(self.protocol.problem(about, dropped, problem));
    }
}

/// The end of the job, if there is one.
async fn finished<F: Form>(work: &mut Option<Work<F>>) -> Done<F> {
    match work {
        Some(work) => work.await,
        None => pending().await,
    }
}

/// The end of the sending, if something is sent.
async fn sent<S>(outbox: &mut Outbox<S>) -> Result<S, ()> {
    match outbox {
        Outbox::Sending(sending) => sending.await,
        Outbox::Idle(_) | Outbox::Broken => pending().await,
    }
}

fn open_on<F: Form>(app: AppState, opening: Opening<F>, asked: Instant) -> Work<F> {
    Box::pin(async move {
        let (scenes, memories, limit) = (Arc::clone(&app.scenes), app.streams.memories.clone(), app.time_limit);
        let job = move |_: &mut _, abandoned: &dyn Fn() -> bool| {
            let mut stopwatch = Stopwatch::start(asked, limit, abandoned);
            open(opening, (&scenes, &memories), asked, &mut stopwatch)
        };
        let opened = app.pool.run(app.usual_ticket(), job).await;
        Done::Opened(opened.unwrap_or_else(|error| Err(error.into())))
    })
}

fn answer_on<F: Form>(app: AppState, session: Arc<Session<F>>, posed: Posed<F::Tag>, dropped: u32) -> Work<F> {
    Box::pin(async move {
        let (times, metrics, asked) = (Arc::clone(&app.times), Arc::clone(&app.metrics), posed.clone());
        let (limit, ticket) = (app.time_limit, session.ticket(&times, app.longest_wait));
        let job = move |workspace: &mut _, abandoned: &dyn Fn() -> bool| {
            let mut stopwatch = Stopwatch::start(asked.arrived, limit, abandoned);
            session.answer(&asked, dropped, (&times, &metrics), workspace, &mut stopwatch)
        };
        match app.pool.run(ticket, job).await.unwrap_or_else(|error| Err(error.into())) {
            Ok(message) => {
                app.metrics.pose_answered(dropped);
                Done::Answered(message)
            }
            Err(problem) => Done::Refused(posed, dropped, problem),
        }
    })
}
