//! What the test tiers and the measuring programs share. Sees every package, is seen by none.

pub mod held_out;
pub mod malformed;
pub mod overload;
pub mod stated_errors;
pub mod stream_client;
pub mod tolerance;
