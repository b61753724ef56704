//! `GET /v1/stream`: poses in, surfaces out, over one WebSocket, as fast as the server computes and the client reads.
//!
//! Contract: the first message opens a session, and a later one may open another; a pose that comes while another waits takes its place, and
//! the next answer counts those overtaken; one computation at a time for each connection, and none while the client has not read the
//! answer before, so nothing piles up; what is wrong with a message is said by a problem and the stream goes on. A client that is not heard
//! of for the idle time is taken for gone. When the service stops, what is at work is answered and the connection closed with 1001.
//!
//! Read `connection` (the loop), `session` (what runs on the numerical threads), [`binary`] (the layout). The text messages are
//! `wire::stream`.

pub mod binary;
mod connection;
mod session;

pub use connection::{LONGEST_MESSAGE, serve};
