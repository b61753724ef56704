//! The memory of a session: one motion of the needle, of which every pose is a step.
//!
//! Contract: what a pose is answered with is what `POST /v1/simulate` answers to the same steps; a pose that has no answer, because it cannot be, because no
//! equilibrium is found or because the time is up, leaves everything as the last good one left it. It ends with its session.

use std::sync::Arc;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use retina_core::predict::{Level, PreparedScene};
use retina_core::sequence::{Sequence, Simulation, StepOutcome};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use crate::problem::{Kind, Problem, of_pose, of_rehearsal, of_step};
use crate::stopwatch::Stopwatch;
use crate::understand::{self, REHEARSAL};
use crate::wire::response::EffectAnswer;
use crate::wire::stream::{MemoryOpened, StreamPose};

/// What bounds the sessions with memory.
#[derive(Clone)]
pub struct Memories {
    places: Arc<Semaphore>,
    /// Steps of a rehearsal.
    pub most_steps: usize,
}

impl Memories {
    /// So many, planned from so many steps each.
    pub fn new(places: usize, most_steps: usize) -> Self {
        Self { places: Arc::new(Semaphore::new(places)), most_steps }
    }
}

/// What a session remembers.
pub struct Memory {
    motion: Mutex<Simulation>,
    level: Level,
    /// When the session was asked for: time 0 of poses that bring none.
    asked: Instant,
    /// What the last step took, ns; 0 before the first.
    last_ns: AtomicU64,
    _place: OwnedSemaphorePermit,
}

impl Memory {
    /// Plans the motions that `rehearsal` spans, if there is room for one more session. Nothing is simulated.
    ///
    /// # Errors
    /// The problem of a step that cannot be, or of there being no place.
    pub fn plan(
        scene: &Arc<PreparedScene>,
        rehearsal: &Sequence,
        memories: &Memories,
        asked: Instant,
        stopwatch: &mut Stopwatch,
    ) -> Result<Self, Problem> {
        let place = Arc::clone(&memories.places).try_acquire_owned().map_err(|_| {
            Problem::new(
                Kind::Busy,
                "As many sessions with memory as the service keeps are open; try again in a second.",
            )
        })?;
        let motion = Simulation::new(scene, rehearsal, stopwatch).map_err(of_rehearsal)?;
        if !motion.loads() {
            let allowed = "a step that presses the tissue, or a scene with fluid under it";
            let detail =
                format!("no step of {REHEARSAL} loads the tissue, so nothing is known of what a load calls for");
            return Err(Problem::field(Kind::InvalidRequest, REHEARSAL, None, allowed, detail));
        }
        Ok(Self {
            motion: Mutex::new(motion),
            level: rehearsal.level,
            asked,
            last_ns: AtomicU64::new(0),
            _place: place,
        })
    }

    /// Tells `told` of what was planned.
    pub fn tell<T>(&self, told: impl FnOnce(MemoryOpened) -> T) -> Result<T, Problem> {
        let motion = self.motion.lock().map_err(lost)?;
        let effects = motion.effects().iter().map(EffectAnswer::from).collect();
        Ok(told(MemoryOpened { level: self.level.name(), effects }))
    }

    /// The step of a pose that arrived so.
    ///
    /// # Errors
    /// The problem that the client is told of; nothing has changed then.
    pub fn step(&self, pose: &StreamPose, arrived: Instant, stopwatch: &mut Stopwatch) -> Result<StepOutcome, Problem> {
        let mut motion = self.motion.lock().map_err(lost)?;
        let time_s = pose.time_s.unwrap_or_else(|| (arrived - self.asked).as_secs_f64());
        let step = understand::step(pose, time_s).map_err(of_pose)?;
        let began = Instant::now();
        let outcome = motion.advance_to(&step, stopwatch).map_err(|error| of_step(error, time_s))?;
        self.last_ns.store(began.elapsed().as_nanos() as u64, Ordering::Relaxed);
        Ok(outcome)
    }

    /// The level of every step.
    pub fn level(&self) -> Level {
        self.level
    }

    /// What the next step is expected to take: what the last one took.
    pub fn expected(&self) -> Option<Duration> {
        Some(self.last_ns.load(Ordering::Relaxed)).filter(|ns| *ns > 0).map(Duration::from_nanos)
    }
}

/// A step panicked half-way, so nobody knows what the session remembers.
fn lost<T>(_: T) -> Problem {
    Problem::internal("a session lost its memory in a panic; another must be opened")
}
