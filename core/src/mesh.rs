//! The finite-element mesh of the eye wall under the patch.
//!
//! [`disc`] lays quadrilaterals over a disc around the contact, graded from the contact's size to the rim; [`wall`] extrudes
//! them through the tissue layers along the columns of the surface; [`ordering`] numbers the unknowns; [`element`] holds the
//! reference elements; [`sample`] reads displacements back at points of the surface.

pub mod disc;
pub mod element;
pub mod ordering;
pub mod sample;
pub mod wall;
