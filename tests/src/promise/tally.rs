//! How often promises held, by level.

use std::fmt::Write as _;

use retina_core::comparison::quantile;
use retina_core::predict::Level;

use super::reply::Audited;

/// A share in percent; NaN of none.
pub fn percent(part: usize, whole: usize) -> f64 {
    100.0 * part as f64 / whole as f64
}

/// The table, a row a level and one for all.
pub fn table(all: &[Audited]) -> String {
    let mut text = String::from(
        "| level | answers | called calibrated | of these beyond their 95 % bound, % | bound µm: median | error µm: median | p95 | largest | \
         error asked for and not warned: exceeded, % | deadline asked for and not warned: kept, % | by the client's clock, % |\n|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    let levels = Level::ALL.map(|level| (level.name(), Some(level.name())));
    for (name, level) in levels.into_iter().chain([("all", None)]) {
        let of: Vec<&Audited> = all.iter().filter(|audited| level.is_none_or(|level| audited.level == level)).collect();
        if of.is_empty() {
            continue;
        }
        let calibrated: Vec<&&Audited> = of.iter().filter(|audited| audited.calibrated).collect();
        let beyond = calibrated.iter().filter(|audited| audited.error_um > audited.p95_um).count();
        let bounds: Vec<f64> = calibrated.iter().map(|audited| audited.p95_um).collect();
        let errors: Vec<f64> = calibrated.iter().map(|audited| audited.error_um).collect();
        let promised: Vec<(f64, f64)> = of
            .iter()
            .filter(|audited| !audited.warned && audited.calibrated)
            .filter_map(|audited| Some((audited.error_um, audited.asked.max_error_um?)))
            .collect();
        let exceeded = promised.iter().filter(|(error, asked)| error > asked).count();
        let timed: Vec<(f64, f64, f64)> = of
            .iter()
            .filter(|audited| !audited.warned)
            .filter_map(|audited| Some((audited.ms, audited.client_ms, audited.asked.max_time_ms?)))
            .collect();
        let kept = timed.iter().filter(|(ms, _, asked)| ms <= asked).count();
        let kept_there = timed.iter().filter(|(_, client_ms, asked)| client_ms <= asked).count();
        // A String takes whatever is written.
        let _ = writeln!(
            text,
            "| `{name}` | {} | {} | {:.1} | {:.2} | {:.2} | {:.2} | {:.1} | {:.1} of {} | {:.1} of {} | {:.1} |",
            of.len(),
            calibrated.len(),
            percent(beyond, calibrated.len()),
            quantile(&bounds, 0.5),
            quantile(&errors, 0.5),
            quantile(&errors, 0.95),
            quantile(&errors, 1.0),
            percent(exceeded, promised.len()),
            promised.len(),
            percent(kept, timed.len()),
            timed.len(),
            percent(kept_there, timed.len()),
        );
    }
    text
}
