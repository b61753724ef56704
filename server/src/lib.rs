//! The service: needle pose and force in, deformed retina surface and normals out, over HTTP or from a file.
//!
//! Read in this order: `routes` (every URL), `handlers`, `requests` (what each sets in motion), [`wire`] (every message), `understand` (from
//! the wire to the core), `answer` (one request from bytes to bytes), `simulate` (one sequence, line by line), `batch` (many poses at once),
//! [`stream`] (poses over a WebSocket), [`igtl`] (over OpenIGTLink), `kserve` (tensors), `admission` (who is let in), [`pool`] and [`scenes`] (where it runs and what is kept),
//! [`library`] (scenes of one's own), [`page`] (what a browser sees). [`config`] is what the program can be told, [`problem`] how it says no, [`access`] who may ask,
//! [`metrics`] what is counted, [`audit`] whether the promised accuracy is kept, `log` what is told of it all.
//! [`recording`] is a guest that looks on, `review` compares levels for the eye.
//!
//! Not here: numerics, which are `retina_core`'s; this crate only brings questions to it and answers back.

pub mod access;
mod admission;
mod answer;
pub mod audit;
mod batch;
mod body;
mod catalog;
pub mod cli;
pub mod config;
mod date;
mod handlers;
pub mod igtl;
mod kserve;
pub mod library;
mod log;
pub mod metrics;
pub mod page;
pub mod pool;
pub mod problem;
pub mod read;
pub mod recording;
mod requests;
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
pub mod understand;
mod upload;
mod warm_up;
pub mod wire;
pub mod write;

pub use config::Config;
pub use routes::app;
pub use run::run;
pub use state::{App, AppState};
