//! Poses in, surfaces out, over one connection, as fast as the server computes and the client reads: the WebSocket of `GET /v1/stream`, and what
//! other protocols share with it.
//!
//! Contract: a session holds for the poses after it, and a later one takes its place; a pose that comes while another waits takes its place, and
//! the next answer counts those overtaken; one computation at a time for each connection, and none while the client has not read the
//! answer before, so nothing piles up; a session with memory answers every pose that is not overtaken as the next step of one motion; what is wrong with a message is said by a problem and the stream goes on. A client that is not heard
//! of for the idle time is taken for gone. When the service stops, what is at work is answered and the client told.
//!
//! Read [`protocol`] (what a protocol has to say), `connection` (the loop), `session` (what runs on the numerical threads), `memory` (what some sessions remember), `websocket` (the
//! protocol of `GET /v1/stream`), [`binary`] (its layout). The text messages are `wire::stream`.

pub mod binary;
mod connection;
mod memory;
pub mod protocol;
mod session;
mod websocket;

pub use connection::serve;
pub use memory::Memories;
pub use websocket::{LONGEST_MESSAGE, WebSockets};
