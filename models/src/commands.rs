//! The commands: arguments in, files and tables out.

pub mod evaluate;
pub mod train;
