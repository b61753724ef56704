//! One connection: what has come, what is at work and what is being sent.
//!
//! Contract: at most one message of each kind is held: an opening, the newest pose, a job, a message being sent; and some problems. While
//! those problems fill their room nothing more is read, so a client that sends nonsense and reads nothing waits.

use std::collections::VecDeque;
use std::future::{Future, pending};
use std::pin::Pin;
use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::extract::ws::{CloseFrame, Message, WebSocket, close_code};
use futures_util::stream::{SplitSink, SplitStream};
use futures_util::{SinkExt as _, StreamExt as _};
use tokio::time::{interval_at, timeout};

use super::binary;
use super::session::{Open, Posed, Session, open, problem_text};
use crate::admission;
use crate::problem::{Kind, Problem};
use crate::read::read;
use crate::state::AppState;
use crate::stopwatch::Stopwatch;
use crate::wire::stream::{ProblemMessage, StreamCommand, StreamMessage, StreamPose};

/// Longest message, bytes: a mesh of about ten thousand vertices.
pub const LONGEST_MESSAGE: usize = 1 << 20;

/// Texts up to this long are read by the thread that talks, bytes; longer ones can only open a session.
const SHORT: usize = 4 << 10;

/// Problems that may wait to be sent.
const MOST_PROBLEMS: usize = 16;

/// How long a farewell may take.
const FAREWELL: Duration = Duration::from_secs(1);

type Sink = SplitSink<WebSocket, Message>;
type Sending = Pin<Box<dyn Future<Output = Result<Sink, axum::Error>> + Send>>;
type Work = Pin<Box<dyn Future<Output = Done> + Send>>;

/// What came of a job.
enum Done {
    Opened(Result<(Session, Message), Problem>),
    Answered(Message),
    /// A pose has no answer.
    Refused(Posed, u32, Problem),
}

/// The way out.
enum Outbox {
    Idle(Sink),
    Sending(Sending),
    Broken,
}

struct Connection {
    app: AppState,
    began: Instant,
    heard: Instant,
    session: Option<Arc<Session>>,
    opening: Option<Open>,
    newest: Option<Posed>,
    last_sequence: Option<u64>,
    dropped: u32,
    problems: VecDeque<Message>,
    ready: Option<Message>,
    work: Option<Work>,
    outbox: Outbox,
}

/// Serves one stream until its client goes or the service stops.
pub async fn serve(socket: WebSocket, app: AppState) {
    let (sink, stream) = socket.split();
    let now = Instant::now();
    let connection = Connection {
        began: now,
        heard: now,
        session: None,
        opening: None,
        newest: None,
        last_sequence: None,
        dropped: 0,
        problems: VecDeque::new(),
        ready: None,
        work: None,
        outbox: Outbox::Idle(sink),
        app,
    };
    connection.run(stream).await;
}

impl Connection {
    async fn run(mut self, mut stream: SplitStream<WebSocket>) {
        let idle = self.app.streams.idle;
        // A third of the time leaves a client two more occasions to show that it is there.
        let mut tick = interval_at(tokio::time::Instant::now() + idle / 3, idle / 3);
        let stop = self.app.streams.stopping.clone();
        let mut stopping = false;
        let farewell = loop {
            self.go_on(stopping);
            if stopping && self.work.is_none() && matches!(self.outbox, Outbox::Idle(_)) {
                break Some((close_code::AWAY, "the service stops"));
            }
            tokio::select! {
                message = stream.next(), if self.problems.len() < MOST_PROBLEMS && !stopping => match message {
                    Some(Ok(Message::Close(_))) | None => break None,
                    Some(Ok(message)) => self.take(message),
                    Some(Err(error)) => break too_long(&error),
                },
                done = finished(&mut self.work) => self.finish(done),
                sent = sent(&mut self.outbox) => match sent {
                    Ok(sink) => self.outbox = Outbox::Idle(sink),
                    Err(_) => break None,
                },
                _ = tick.tick() => {
                    if self.heard.elapsed() >= idle {
                        tracing::debug!("a stream whose client is not heard of is closed");
                        break None;
                    }
                    if matches!(self.outbox, Outbox::Idle(_)) {
                        self.send(Message::Ping(Default::default()));
                    }
                }
                () = stop.cancelled(), if !stopping => stopping = true,
            }
        };
        if let (Some((code, reason)), Outbox::Idle(mut sink)) = (farewell, self.outbox) {
            let close = Message::Close(Some(CloseFrame { code, reason: reason.into() }));
            // The client may be gone already.
            let _ = timeout(FAREWELL, sink.send(close)).await;
        }
    }

    /// Sends and begins what can be.
    fn go_on(&mut self, stopping: bool) {
        if !matches!(self.outbox, Outbox::Idle(_)) {
            return;
        }
        if let Some(message) = self.ready.take().or_else(|| self.problems.pop_front()) {
            return self.send(message);
        }
        if self.work.is_some() || stopping {
            return;
        }
        if let Some(opening) = self.opening.take() {
            self.work = Some(open_on(self.app.clone(), opening));
        } else if let Some(posed) = self.newest.take() {
            let dropped = std::mem::take(&mut self.dropped);
            match &self.session {
                Some(session) => {
                    self.work = Some(answer_on(self.app.clone(), Arc::clone(session), posed, dropped));
                }
                None => {
                    let problem = Problem::new(Kind::InvalidRequest, "There is no session; send {\"open\": {}} first.");
                    self.refuse(Some(&posed.pose), dropped, &problem);
                    self.go_on(stopping);
                }
            }
        }
    }

    fn send(&mut self, message: Message) {
        self.outbox = match std::mem::replace(&mut self.outbox, Outbox::Broken) {
            Outbox::Idle(mut sink) => Outbox::Sending(Box::pin(async move { sink.send(message).await.map(|()| sink) })),
            busy => busy,
        };
    }

    /// Takes in a message of the client.
    fn take(&mut self, message: Message) {
        self.heard = Instant::now();
        let command = match &message {
            Message::Text(text) if text.len() > SHORT => {
                self.begin_opening(Open::Text(text.clone()));
                return;
            }
            Message::Text(text) => read::<StreamCommand>(text.as_bytes()),
            Message::Binary(bytes) => binary::pose(bytes).map(|pose| StreamCommand { open: None, pose: Some(pose) }),
            Message::Ping(_) | Message::Pong(_) | Message::Close(_) => return,
        };
        match command {
            Ok(StreamCommand { open: Some(spec), pose: None }) => self.begin_opening(Open::Read(Box::new(spec))),
            Ok(StreamCommand { open: None, pose: Some(pose) }) => self.take_pose(pose),
            Ok(_) => {
                let allowed = "exactly one of open, pose";
                let detail = "a message has exactly one of the fields open and pose";
                self.refuse(None, 0, &Problem::field(Kind::InvalidRequest, "", None, allowed, detail));
            }
            Err(problem) => self.refuse(None, 0, &problem),
        }
    }

    fn begin_opening(&mut self, opening: Open) {
        // What the session before had not yet answered has no answer.
        (self.session, self.newest, self.last_sequence, self.dropped) = (None, None, None, 0);
        self.opening = Some(opening);
    }

    fn take_pose(&mut self, pose: StreamPose) {
        if let Some(last) = self.last_sequence.filter(|last| pose.sequence <= *last) {
            let detail = format!("pose.sequence is {}, and that of the pose before was {last}", pose.sequence);
            let allowed = format!("more than {last}");
            let given = Some(pose.sequence.into());
            let problem = Problem::field(Kind::OutOfRange, "pose.sequence", given, allowed, detail);
            return self.refuse(Some(&pose), 0, &problem);
        }
        self.last_sequence = Some(pose.sequence);
        let posed = Posed { pose, arrived: self.heard, received: self.heard - self.began };
        if self.newest.replace(posed).is_some() {
            self.dropped += 1;
        }
    }

    fn finish(&mut self, done: Done) {
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
            Done::Refused(posed, dropped, problem) => self.refuse(Some(&posed.pose), dropped, &problem),
        }
    }

    fn refuse(&mut self, pose: Option<&StreamPose>, dropped: u32, problem: &Problem) {
        self.app.metrics.pose_refused(problem.kind, dropped);
        let message = StreamMessage::Problem(ProblemMessage {
            sequence: pose.map(|pose| pose.sequence),
            client_time_us: pose.and_then(|pose| pose.client_time_us),
            dropped,
            problem: problem.document(),
        });
        self.problems.push_back(problem_text(&message));
    }
}

/// The end of the job, if there is one.
async fn finished(work: &mut Option<Work>) -> Done {
    match work {
        Some(work) => work.await,
        None => pending().await,
    }
}

/// The end of the sending, if something is sent.
async fn sent(outbox: &mut Outbox) -> Result<Sink, axum::Error> {
    match outbox {
        Outbox::Sending(sending) => sending.await,
        Outbox::Idle(_) | Outbox::Broken => pending().await,
    }
}

/// The farewell to a client whose message is too long; one that broke off hears none.
fn too_long(error: &axum::Error) -> Option<(u16, &'static str)> {
    let is_capacity = error.to_string().to_ascii_lowercase().contains("too long");
    is_capacity.then_some((close_code::SIZE, "a message may have 1 MiB"))
}

fn open_on(app: AppState, opening: Open) -> Work {
    Box::pin(async move {
        let scenes = Arc::clone(&app.scenes);
        let job = move |_: &mut _, _: &dyn Fn() -> bool| open(opening, &scenes);
        let opened = app.pool.run(app.usual_ticket(), job).await;
        Done::Opened(opened.unwrap_or_else(|error| Err(error.into())))
    })
}

fn answer_on(app: AppState, session: Arc<Session>, posed: Posed, dropped: u32) -> Work {
    Box::pin(async move {
        let (times, metrics, asked) = (Arc::clone(&app.times), Arc::clone(&app.metrics), posed.clone());
        let (limit, ticket) = (app.time_limit, admission::of_budget(session.budget(), &times, app.longest_wait));
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
