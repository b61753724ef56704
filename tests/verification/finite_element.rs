//! The element, the solid energies, the assembly and the solver against closed forms and other people's tables.

mod bleb;
pub mod block;
mod closed_forms;
mod homogeneous;
mod incline;
mod inflation;
mod manufactured;
mod peel;
mod pressed_needle;
mod pressed_slab;
mod stick_slip;
