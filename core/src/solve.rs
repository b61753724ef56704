//! Linear and nonlinear solution: the sparse Cholesky factorisation (the one place that names faer's sparse code) and Newton's
//! method on top of it.

mod border;
mod condensed;
pub mod globalization;
mod held;
pub mod newton;
pub mod sparse;
