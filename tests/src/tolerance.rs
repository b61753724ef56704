//! The tolerance classes of every tier, each with its reason. At most six; a test multiplies one by a scale of its own problem.

/// No difference at all: zeros that are exact, answers repeated bit by bit.
pub const EXACT: f64 = 0.0;

/// Relative. Sums of some thousand f64 terms without cancellation: far above 1e-16, far below any error of method.
pub const ROUNDOFF: f64 = 1e-12;

/// Relative to the largest entry. Central differences with a step of 1e-5 of the size leave 1e-10 of truncation and 1e-11 of
/// rounding, times the curvature of a near-singular energy; a wrong term is wrong by far more.
pub const DERIVATIVE: f64 = 1e-6;

/// Relative. What a mesh or a stated approximation leaves where no finer bound is known; a test says which share of it it uses.
pub const DISCRETISATION: f64 = 0.15;

/// Millimetres. The same problem in another frame takes another path of rounding to a residual of 1e-7 of the force, which moves
/// 0.1 mm of indentation by up to 1e-8 mm.
pub const RIGID_MOTION: f64 = 1e-7;

/// Relative to the force. Reaction against applied force: ten times the residual at which the solver stops.
pub const BALANCE: f64 = 1e-6;
