//! The layered bed against closed forms, independent tables and its own laws. Every tolerance is named with its reason.

mod closed_forms;
mod laws;
mod support;
mod tables;
