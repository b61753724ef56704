//! Small-strain elasticity of a horizontally layered bed under a frictionless rigid tool: the `linear` level.
//!
//! Every contact is a growing one: while a tool sinks in, each small step of force acts like a flat-ended punch of the present
//! contact radius. So the answer is a sum of **flat punches** of fixed, graded radii with non-negative forces. Preparing a bed
//! solves one flat punch for each radius exactly for the layered bed; a query marches outwards through the radii (forward
//! substitution) and adds up the punches' tables.
//!
//! How a punch is solved: the layers enter through the surface compliance at each wave number ([`kernel`]); a pressure p(r) is
//! written as p̂(k) = ∫₀ᵃ φ(t) cos(kt) dt, which turns the mixed boundary value problem of the axisymmetric punch into an integral
//! equation of the second kind on a line ([`mod@line`], [`punch`]; Sneddon 1951, *Fourier Transforms*, ch. 10; Lebedev & Ufliand 1958,
//! PMM 22:320), and Abel transforms in closed form lead back to the surface ([`abel`]).
//!
//! Units: mm, mN, kPa. Axisymmetric about the z axis; z is up, out of the tissue. Surface displacements: u_z < 0 is into the
//! bed, u_r > 0 is outward. Depths and pressures count positive into the bed.

pub mod abel;
pub mod bed;
pub mod contact;
pub mod error;
pub mod grid;
pub mod indentation;
pub mod kernel;
pub mod line;
mod operators;
pub mod prepared;
pub mod profile;
pub mod punch;
pub mod response;
mod stretch;
mod tables;

pub use bed::{BedBase, BedLayer, LayeredBed};

pub use error::LayeredError;
pub use indentation::{Indentation, PartialPunch};
pub use prepared::LinearBed;
pub use profile::{ProfileEdge, RigidProfile};
pub use response::SurfaceResponse;
