//! The commands: arguments in, files and tables out.

pub mod ablation;
pub mod calibrate;
pub mod dataset;
pub mod deformcontact;
pub mod evaluate;
pub mod parity;
pub mod reference_error;
pub mod runtime;
pub mod train;
pub mod truth_error;
