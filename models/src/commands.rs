//! The commands: arguments in, files and tables out.

pub mod train;
