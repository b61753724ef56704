//! Who is beaten by none: contestants that nobody is both faster and nearer than.

use super::measure::Standing;

/// For each of `standings`, whether no other one that failed no more often has both a smaller median error and a smaller median time.
pub fn undominated(standings: &[&Standing]) -> Vec<bool> {
    let beats = |a: &Standing, b: &Standing| {
        a.failed <= b.failed
            && a.median_um <= b.median_um
            && a.median_ms <= b.median_ms
            && (a.median_um < b.median_um || a.median_ms < b.median_ms)
    };
    standings.iter().map(|&mine| !standings.iter().any(|&other| beats(other, mine))).collect()
}
