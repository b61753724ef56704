//! Tables in Markdown, from errors.

use std::fmt::Write as _;

use super::errors::{Errors, quantile};

/// A row: who answered, its errors, and the samples without an answer.
pub struct Row {
    /// Its name.
    pub name: String,
    /// Its errors.
    pub errors: Errors,
    /// Samples that it did not answer.
    pub missing: usize,
}

/// Errors of all rows over the same samples.
pub fn errors(rows: &[Row]) -> String {
    let mut text = String::from(
        "| | MAE µm | RMSE µm | p95 µm | p99 µm | max µm | % of RMS displacement | worst node: median / p95 µm | normals ° | edges µm | variance µm² | no answer |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for Row { name, errors, missing } in rows {
        let worst = errors.worst_um();
        // A String takes whatever is written.
        let _ = writeln!(
            text,
            "| {name} | {:.2} | {:.2} | {:.2} | {:.2} | {:.1} | {:.1} | {:.2} / {:.2} | {:.2} | {:.2} | {:.1} | {missing} |",
            errors.mae_um(),
            errors.rmse_um(),
            errors.node_quantile_um(0.95),
            errors.node_quantile_um(0.99),
            errors.node_quantile_um(1.0),
            errors.percent(),
            quantile(worst, 0.5),
            quantile(worst, 0.95),
            errors.normals_deg(),
            errors.edges_um(),
            errors.variance_um2(),
        );
    }
    text
}

/// Mean errors by group: a line a group, a column a predictor.
pub fn by_group(names: &[String], groups: &[(String, usize, f64, Vec<Errors>)]) -> String {
    let mut text = format!("| | samples | RMS motion µm | {} |\n|---|---|---|", names.join(" | "));
    text.push_str(&"---|".repeat(names.len()));
    text.push('\n');
    for (group, samples, motion_um, errors) in groups {
        let cells: Vec<String> = errors
            .iter()
            .map(|e| format!("{:.2} / {:.1} / {:.1}", e.mae_um(), e.node_quantile_um(0.99), e.percent()))
            .collect();
        let _ = writeln!(text, "| {group} | {samples} | {motion_um:.1} | {} |", cells.join(" | "));
    }
    text
}
