//! The effects, one file each. A new one is one file here, one line below and one row in the derivative check.

pub mod adhesion;
pub mod bleb;
pub mod contact;
pub mod elasticity;
pub mod finite_strain;
pub mod friction;
pub mod inertia;
pub mod pressure;
pub mod puncture;
pub mod solid;
pub mod tool_flex;
pub mod viscoelasticity;

/// Effects without an energy: they judge an equilibrium and move nothing.
pub const WITHOUT_ENERGY: [&str; 1] = [puncture::NAME];

/// Names of every effect, in the order in which reports list them.
pub const EFFECT_NAMES: [&str; 11] = [
    elasticity::NAME,
    finite_strain::NAME,
    contact::NAME,
    friction::NAME,
    pressure::NAME,
    adhesion::NAME,
    bleb::NAME,
    viscoelasticity::NAME,
    inertia::NAME,
    tool_flex::NAME,
    puncture::NAME,
];
