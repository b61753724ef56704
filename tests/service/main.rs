//! The service as its callers see it: in process, over real sockets and on the command line.
//!
//! Contract: every test can fail, and asserts what a caller relies on: status, media type, the field that a problem names.
//!
//! Not here: whether the physics is right, which the other tiers say.

mod access;
mod answers;
mod audit;
mod batch;
mod behind_nginx;
mod budgets;
mod catalog;
mod clients;
mod clock;
mod export;
mod faults;
mod fuzzed;
mod harness;
mod igtl;
mod kserve;
mod load;
mod malformed;
mod operations;
mod overload;
mod page;
mod peers;
mod program;
mod properties;
mod recording;
mod refusals;
mod schema;
mod sequences;
mod sockets;
mod stored;
mod stream;
