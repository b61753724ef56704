//! The commands: arguments in, files and tables out.

pub mod dataset;
pub mod deformcontact;
pub mod truth_error;
