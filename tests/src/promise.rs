//! Whether the service keeps what it promises: errors against a truth computed beside it, deadlines against its own clock.
//!
//! Read `question` (what is asked) → `reply` (what came back) → `tally` (how often promises held). The program `promises` runs them.

pub mod question;
pub mod reply;
pub mod tally;
