//! What the test tiers and the measuring programs share. Sees every package, is seen by none.

pub mod cost;
pub mod held_out;
pub mod stated_errors;
pub mod tolerance;
