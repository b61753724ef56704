//! What accuracy costs in time: contestants on panels of requests against the reference, in one run, and the report of it.
//!
//! Read on in `panel` (which requests), `contestant` (levels and settings), `measure` (errors and times), `pareto` (who is beaten by none), `chart` and
//! `report` (what a reader sees), `before` (where the levels of an earlier program stood), `small` (the run of the accuracy tier). Times are of one thread, medians of repeats with everything warm. Used by the `accuracy` program and by the
//! accuracy tier, which holds a small run against the committed one.

pub mod before;
pub mod chart;
pub mod contestant;
pub mod measure;
pub mod panel;
pub mod pareto;
pub mod report;
pub mod small;
