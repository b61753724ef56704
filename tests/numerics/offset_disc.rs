//! Discs whose circles do not share a centre: cells that fill them, circles where they were asked for.

use std::f64::consts::PI;

use retina_core::mesh::disc::{DiscGeometry, DiscTopology};
use retina_tests::tolerance::ROUNDOFF;

const TOPOLOGY: DiscTopology = DiscTopology { core_cells: 2, rings: 4 };

/// A core of 0.1 mm around the origin, circles that move off until the second, of 0.5 mm, stands at `shift`, and stay there.
fn disc(shift: [f64; 2]) -> Vec<[f64; 2]> {
    let half = shift.map(|s| 0.5 * s);
    let geometry = DiscGeometry {
        center: [0.0; 2],
        radii: vec![0.1, 0.3, 0.5, 0.9, 1.5],
        offsets: vec![half, shift, shift, shift],
    };
    TOPOLOGY.positions(&geometry)
}

/// Area of a cell from its eight outer points, counter-clockwise.
fn area(cell: &[usize], at: &[[f64; 2]]) -> f64 {
    let outline = [0, 1, 2, 5, 8, 7, 6, 3].map(|k| at[cell[k]]);
    let pairs = outline.iter().zip(outline.iter().cycle().skip(1));
    0.5 * pairs.map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum::<f64>()
}

#[test]
fn circles_stand_where_they_were_asked_for_and_cells_fill_them() {
    for shift in [[0.0, 0.0], [0.2, 0.0], [-0.15, 0.25]] {
        let at = disc(shift);
        let areas: Vec<f64> = TOPOLOGY.cells().iter().map(|cell| area(cell, &at)).collect();
        assert!(areas.iter().all(|&area| area > 0.0), "{shift:?}: {areas:?}");
        // Sixteen points a circle.
        let polygon = 8.0 * (PI / 8.0).sin() * 1.5 * 1.5;
        assert!((areas.iter().sum::<f64>() - polygon).abs() < 1e3 * ROUNDOFF, "{shift:?}");
        let on = |radius: f64, center: [f64; 2]| {
            at.iter().filter(|p| ((p[0] - center[0]).hypot(p[1] - center[1]) - radius).abs() < ROUNDOFF).count()
        };
        assert_eq!((on(0.5, shift), on(1.5, shift)), (16, 16), "{shift:?}");
        assert!(shift == [0.0; 2] || on(0.5, [0.0; 2]) < 3, "{shift:?}: where it was not asked for");
    }
}

#[test]
fn circles_that_cross_have_cells_without_area() {
    let at = disc([0.5, 0.0]);
    assert!(TOPOLOGY.cells().iter().any(|cell| area(cell, &at) <= 0.0));
}
