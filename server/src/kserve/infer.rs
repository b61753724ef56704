//! The rows of a request on the numerical threads.
//!
//! Contract: a small batch is one job from bytes to bytes; a large one is computed in pieces as `batch` computes its own, so others are served
//! between two pieces. The work stops when the client goes.

use std::ops::Range;
use std::sync::Arc;
use std::time::Instant;

use futures_util::stream::{self, StreamExt as _};
use retina_core::predict::budget::Budget;
use retina_core::predict::{Level, Workspace};
use retina_core::progress::Progress as _;

use super::refusal::Refusal;
use super::request::{Asked, read};
use super::respond::{Columns, Written, write};
use crate::admission::of_budget;
use crate::answer::{Computed, Question, compute};
use crate::batch::piece_size;
use crate::body::Received;
use crate::pool::Ticket;
use crate::problem::Problem;
use crate::state::App;
use crate::stopwatch::Stopwatch;

/// Bodies up to this long are read by the thread that talks, bytes.
const SHORT: usize = 16 << 10;

/// Answers the request in `body`.
pub async fn infer(
    app: &Arc<App>,
    (model, level): (&str, Level),
    body: Received,
    json_bytes: Option<usize>,
) -> Result<Written, Refusal> {
    let arrived = Instant::now();
    let most = app.batch_limits.poses;
    let asked = match body.as_ref().len() <= SHORT {
        true => read(body.as_ref(), json_bytes, level, most)?,
        false => {
            let job = move |_: &mut Workspace, _: &dyn Fn() -> bool| read(body.as_ref(), json_bytes, level, most);
            app.pool.run(app.usual_ticket(), job).await??
        }
    };
    let (asked, model) = (Arc::new(asked), model.to_owned());
    let (count, size) = (asked.rows.len(), piece_size(app.times.mean(level)));
    let budget = Budget { level: Some(level), ..Budget::default() };
    if count <= size {
        let (app, ticket) = (Arc::clone(app), of_budget(&budget, &app.times, app.longest_wait));
        let pool = Arc::clone(&app.pool);
        let ticket = Ticket { cost: ticket.cost * count as u32, ..ticket };
        let job = move |workspace: &mut Workspace, abandoned: &dyn Fn() -> bool| {
            let columns = piece(&app, &asked, 0..count, arrived, workspace, abandoned)?;
            write(&model, &asked, &columns).map_err(Refusal::from)
        };
        return pool.run(ticket, job).await?;
    }
    let pieces = stream::iter((0..count).step_by(size)).map(|first| {
        let range = first..count.min(first + size);
        let ticket = Ticket { cost: app.times.mean(level) * range.len() as u32, longest_wait: None };
        let (app, asked) = (Arc::clone(app), Arc::clone(&asked));
        async move {
            let job = || {
                let (app, asked, range) = (Arc::clone(&app), Arc::clone(&asked), range.clone());
                move |workspace: &mut Workspace, abandoned: &dyn Fn() -> bool| {
                    piece(&app, &asked, range, arrived, workspace, abandoned)
                }
            };
            app.pool.run_patiently(ticket, job).await?
        }
    });
    let mut pieces = pieces.buffered(app.batch_limits.pieces);
    let mut columns = Columns::default();
    while let Some(next) = pieces.next().await {
        columns.append(next?);
    }
    drop(pieces);
    let job = move |_: &mut Workspace, _: &dyn Fn() -> bool| write(&model, &asked, &columns);
    Ok(app.pool.run(app.usual_ticket(), job).await??)
}

/// Computes these rows.
fn piece(
    app: &App,
    asked: &Asked,
    rows: Range<usize>,
    arrived: Instant,
    workspace: &mut Workspace,
    abandoned: &dyn Fn() -> bool,
) -> Result<Columns, Refusal> {
    let limits = &app.batch_limits;
    let mut columns = Columns::default();
    for row in rows {
        let left = limits.whole.saturating_sub(arrived.elapsed()).min(limits.each);
        let mut stopwatch = Stopwatch::start(Instant::now(), left, abandoned);
        stopwatch.stage("prepare");
        let (request, choice) = &asked.rows[row];
        let mut answer = || {
            let scene = app.scenes.get(Some(choice))?;
            let budget = Budget { level: Some(request.level), ..Budget::default() };
            let question = Question { request: request.clone(), budget, times: &app.times };
            let Computed { request, prediction, .. } = compute(&scene, question, workspace, &mut stopwatch)?;
            Ok::<_, Problem>((scene, request, prediction))
        };
        let (scene, request, prediction) = answer().map_err(|problem| Refusal::from(problem).of_row(row))?;
        app.metrics.predicted(&scene, &request, &prediction, stopwatch.finish());
        columns.push(&asked.outputs, &prediction)?;
    }
    Ok(columns)
}
