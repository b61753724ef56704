//! The service: needle pose and force in, deformed retina surface and normals out, over HTTP or from a file.
//!
//! Read in this order: `routes` (every URL), `handlers`, [`wire`] (every message), `understand` (from the wire to the core),
//! `answer` (one request from bytes to bytes), `simulate` (one sequence, line by line), [`stream`] (poses over a WebSocket), `pool` and `scenes` (where it runs and what
//! is kept), [`page`] (what a browser sees). [`config`] is what the program can be told, [`problem`] how it says no. [`recording`] is a
//! guest that looks on, `review` compares levels for the eye.
//!
//! Not here: numerics, which are `retina_core`'s; this crate only brings questions to it and answers back.

mod answer;
mod body;
mod catalog;
pub mod cli;
pub mod config;
mod handlers;
pub mod page;
pub mod pool;
pub mod problem;
mod read;
pub mod recording;
#[cfg(feature = "rerun")]
pub mod review;
mod routes;
mod run;
pub mod scenes;
mod simulate;
mod state;
mod stopwatch;
pub mod stream;
mod times;
mod understand;
pub mod wire;
pub mod write;

pub use config::Config;
pub use routes::app;
pub use run::run;
pub use state::{App, AppState};
