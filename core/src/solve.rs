//! Linear and nonlinear solution: the sparse and the dense Cholesky factorisation (the two places that name faer, and `columns`, which takes what is too small for it) and
//! Newton's method on top of them.

mod border;
mod columns;
mod condensed;
mod dense;
pub mod globalization;
mod held;
pub mod newton;
mod number;
pub mod sparse;
mod step;
