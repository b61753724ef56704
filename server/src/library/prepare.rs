//! What the background does with a stored scene: read it, touch it, say how far it is.

use std::sync::Arc;

use retina_core::predict::{Level, Workspace};

use super::entry::{STEPS, State, summary};
use super::touch::{Touch, first_answered};
use super::{Id, Library};
use crate::pool::{PoolError, Ticket};
use crate::problem::{Kind, Problem};
use crate::times::Times;

/// Where each of [`STEPS`] stands among them.
const READ: usize = 0;
const LINEAR: usize = READ + 1;
const COARSE: usize = STEPS.len() - 1;

/// Prepares a scene, step by step; each waits for a numerical thread.
pub async fn prepare(library: &Library, id: Id) {
    let state = match steps(library, id).await {
        Ok(touch) => State::Ready(touch),
        Err(problem) if problem.kind == Kind::CorruptScene => {
            tracing::error!(%id, detail = %problem.detail, "a stored scene is corrupt and is not used");
            State::Corrupt(problem.detail)
        }
        Err(problem) => {
            tracing::warn!(%id, detail = %problem.detail, "a stored scene has no answer");
            State::Failed(problem.detail)
        }
    };
    library.tell(id, |entry| entry.state = state);
}

async fn steps(library: &Library, id: Id) -> Result<Touch, Problem> {
    let at = |step| library.tell(id, |entry| entry.state = State::At(step));
    at(READ);
    let scenes = Arc::clone(&library.scenes);
    let scene = run(library, Level::Linear, move |_, _| scenes.stored(id)).await??;
    library.tell(id, |entry| entry.surface = Some(summary(scene.scene())));
    at(LINEAR);
    let here = Arc::clone(&scene);
    let touch = run(library, Level::Linear, move |times, workspace| first_answered(&here, times, workspace)).await??;
    at(COARSE);
    // A scene that has no answer at this level here may have one elsewhere, and has others.
    let coarse =
        run(library, Level::Coarse, move |times, workspace| touch.ask(&scene, Level::Coarse, times, workspace));
    if let Err(problem) = coarse.await? {
        tracing::info!(%id, detail = %problem.detail, "a stored scene has no answer at level coarse in its middle");
    }
    Ok(touch)
}

async fn run<T: Send + 'static>(
    library: &Library,
    like: Level,
    job: impl Fn(&Times, &mut Workspace) -> T + Clone + Send + 'static,
) -> Result<T, PoolError> {
    let ticket = Ticket { cost: library.times.mean(like), longest_wait: None };
    let job = || {
        let (job, times) = (job.clone(), Arc::clone(&library.times));
        move |workspace: &mut Workspace, _: &dyn Fn() -> bool| job(&times, workspace)
    };
    library.pool.run_patiently(ticket, job).await
}
