//! What verification targets state of their own error, and what a finite-element solution of them leaves; each with its reason.

/// Solutions that lie in the finite-element space (homogeneous strain): what Newton's tolerance and rounding leave, with stresses up to
/// 1e4 times the shear modulus.
pub const IN_THE_SPACE: f64 = 1e-9;
/// Closed forms on a modest mesh of quadratic elements.
pub const MODEST_MESH: f64 = 5e-3;
/// Tables of the linear layer: what their README gives for a finite-element code on a finite slab, of the largest displacement.
pub const LINEAR_TABLE: f64 = 1.4e-2;
/// The same at the edge of a uniform load, where the slope is infinite.
pub const LINEAR_TABLE_EDGE: f64 = 2.4e-2;
/// Tables of the neo-Hookean slab: what their README gives for two codes with the same energy, of the largest displacement.
pub const NEO_HOOKEAN_TABLE: f64 = 1e-2;
/// What the penalty of the contact moves the needle in the neo-Hookean tables, of its depth, as their README says.
pub const PENALTY: f64 = 1.5e-2;
