//! What the networks and the baselines err by, on every split: the tables of `REPORT.md`.
//!
//! Read `errors` (how an error is measured) → `predictors` (who answers) → `baselines/*` → `tables` → `report`.

pub mod ablation;
pub mod baselines;
pub mod coverage;
pub mod errors;
pub mod onnx;
pub mod predictors;
pub mod report;
pub mod runtime;
pub mod tables;
