//! The chart: error against time, a panel beside the other, both axes logarithmic.
//!
//! A dot is a contestant's median; the line to the right of it ends at the 99th percentile of its error, the tick at its largest, the line above at the
//! 99th percentile of its time. A ring with a dotted line to a level's dot is where an earlier program stood. Plain SVG, so that any browser and any page shows it.

use std::fmt::Write;

use super::before::levels_twice;
use super::measure::{Measured, Standing};
use super::pareto::undominated;

const PANEL_WIDTH: f64 = 460.0;
const PANEL_HEIGHT: f64 = 420.0;
const LEFT: f64 = 70.0;
const TOP: f64 = 60.0;
const GAP: f64 = 30.0;
const BOTTOM: f64 = 90.0;

/// Error axis (µm).
const ERRORS_UM: (f64, f64) = (0.05, 300.0);
/// Time axis (ms).
const TIMES_MS: (f64, f64) = (0.01, 30_000.0);

/// Lines across: what an error or a time means to somebody.
const ERROR_MARKS: [(f64, &str); 2] = [(3.3, "OCT pixel 3.3 µm"), (9.0, "tool-to-layer 9 µm")];
const TIME_MARKS: [(f64, &str); 2] = [(1.0, "haptics 1 ms"), (33.0, "display 33 ms")];

/// Colours of the knobs.
const COLOURS: [(&str, &str); 6] = [
    ("level", "#c02942"),
    ("width", "#d98c00"),
    ("mesh", "#2a6f97"),
    ("tolerance", "#6a994e"),
    ("contact", "#9c6644"),
    ("effects", "#7b2cbf"),
];

fn share(value: f64, (low, high): (f64, f64)) -> f64 {
    ((value.clamp(low, high) / low).ln() / (high / low).ln()).clamp(0.0, 1.0)
}

struct Frame {
    left: f64,
}

impl Frame {
    fn x(&self, error_um: f64) -> f64 {
        self.left + PANEL_WIDTH * share(error_um, ERRORS_UM)
    }

    fn y(&self, ms: f64) -> f64 {
        TOP + PANEL_HEIGHT * (1.0 - share(ms, TIMES_MS))
    }
}

/// The whole chart as SVG text; `before` are the panels of an earlier program, or none.
pub fn svg(panels: &[Measured], before: &[Measured], title: &str) -> String {
    let width = LEFT + panels.len() as f64 * (PANEL_WIDTH + GAP);
    let height = TOP + PANEL_HEIGHT + BOTTOM;
    let mut out = String::new();
    // Writing to a string does not fail.
    let _ = writeln!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" font-size=\"12\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n<text x=\"{LEFT}\" y=\"24\" font-size=\"16\">{title}</text>"
    );
    for (index, panel) in panels.iter().enumerate() {
        let frame = Frame { left: LEFT + index as f64 * (PANEL_WIDTH + GAP) };
        axes(&mut out, &frame, panel, index == 0);
        let everybody: Vec<&Standing> = panel.standings.iter().chain([&panel.reference]).collect();
        let best = undominated(&everybody);
        for (earlier, now) in levels_twice(panel, before) {
            ring(&mut out, &frame, earlier, now);
        }
        pareto_line(&mut out, &frame, &everybody, &best);
        for (standing, best) in everybody.into_iter().zip(best) {
            dot(&mut out, &frame, standing, best);
        }
    }
    legend(&mut out, height - 18.0);
    out.push_str("</svg>\n");
    out
}

fn axes(out: &mut String, frame: &Frame, panel: &Measured, first: bool) {
    let (left, right, bottom) = (frame.left, frame.left + PANEL_WIDTH, TOP + PANEL_HEIGHT);
    let _ = writeln!(
        out,
        "<text x=\"{left}\" y=\"46\">{}: {} ({} requests, motion to {:.0} µm)</text>\n\
         <rect x=\"{left}\" y=\"{TOP}\" width=\"{PANEL_WIDTH}\" height=\"{PANEL_HEIGHT}\" fill=\"none\" stroke=\"#888\"/>",
        panel.panel, panel.caption, panel.requests, panel.motion_max_um
    );
    let floor = frame.x(panel.floor_um);
    let _ = writeln!(
        out,
        "<rect x=\"{left}\" y=\"{TOP}\" width=\"{:.1}\" height=\"{PANEL_HEIGHT}\" fill=\"#eee\"/>\n\
         <text x=\"{:.1}\" y=\"{:.1}\" fill=\"#888\" font-size=\"10\" transform=\"rotate(-90 {:.1} {:.1})\">the truth's own error</text>",
        floor - left,
        floor - 4.0,
        bottom - 6.0,
        floor - 4.0,
        bottom - 6.0
    );
    for power in -1..=2 {
        let (error, x) = (10f64.powi(power), frame.x(10f64.powi(power)));
        let _ = writeln!(
            out,
            "<line x1=\"{x:.1}\" y1=\"{TOP}\" x2=\"{x:.1}\" y2=\"{bottom}\" stroke=\"#ddd\"/><text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{error}</text>",
            bottom + 16.0
        );
    }
    for power in -2..=4 {
        let (ms, y) = (10f64.powi(power), frame.y(10f64.powi(power)));
        let _ = writeln!(out, "<line x1=\"{left}\" y1=\"{y:.1}\" x2=\"{right}\" y2=\"{y:.1}\" stroke=\"#ddd\"/>");
        if first {
            let _ = writeln!(out, "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{ms}</text>", left - 6.0, y + 4.0);
        }
    }
    for (error, label) in ERROR_MARKS {
        let x = frame.x(error);
        let _ = writeln!(
            out,
            "<line x1=\"{x:.1}\" y1=\"{TOP}\" x2=\"{x:.1}\" y2=\"{bottom}\" stroke=\"#c77\" stroke-dasharray=\"5 4\"/>\
             <text x=\"{:.1}\" y=\"{:.1}\" fill=\"#a55\" font-size=\"10\" transform=\"rotate(-90 {:.1} {:.1})\">{label}</text>",
            x + 11.0,
            TOP + 110.0,
            x + 11.0,
            TOP + 110.0
        );
    }
    for (ms, label) in TIME_MARKS {
        let y = frame.y(ms);
        let _ = writeln!(
            out,
            "<line x1=\"{left}\" y1=\"{y:.1}\" x2=\"{right}\" y2=\"{y:.1}\" stroke=\"#c77\" stroke-dasharray=\"5 4\"/>\
             <text x=\"{:.1}\" y=\"{:.1}\" fill=\"#a55\" font-size=\"10\" text-anchor=\"end\">{label}</text>",
            right - 4.0,
            y - 4.0
        );
    }
    let _ = writeln!(
        out,
        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">error of the worst node, µm</text>",
        left + 0.5 * PANEL_WIDTH,
        bottom + 34.0
    );
    if first {
        let middle = TOP + 0.5 * PANEL_HEIGHT;
        let _ = writeln!(
            out,
            "<text x=\"18\" y=\"{middle}\" text-anchor=\"middle\" transform=\"rotate(-90 18 {middle})\">time of an answer, ms</text>"
        );
    }
}

fn pareto_line(out: &mut String, frame: &Frame, everybody: &[&Standing], best: &[bool]) {
    let mut line: Vec<&Standing> = everybody.iter().zip(best).filter(|&(_, &best)| best).map(|(&s, _)| s).collect();
    line.sort_by(|a, b| a.median_um.total_cmp(&b.median_um));
    let points: Vec<String> =
        line.iter().map(|s| format!("{:.1},{:.1}", frame.x(s.median_um), frame.y(s.median_ms))).collect();
    let _ =
        writeln!(out, "<polyline points=\"{}\" fill=\"none\" stroke=\"#444\" stroke-width=\"1.2\"/>", points.join(" "));
}

fn ring(out: &mut String, frame: &Frame, earlier: &Standing, now: &Standing) {
    let (x, y) = (frame.x(earlier.median_um), frame.y(earlier.median_ms));
    let (to_x, to_y) = (frame.x(now.median_um), frame.y(now.median_ms));
    let colour = colour(&earlier.knob);
    let _ = writeln!(
        out,
        "<g stroke=\"{colour}\" fill=\"white\" opacity=\"0.7\"><line x1=\"{x:.1}\" y1=\"{y:.1}\" x2=\"{to_x:.1}\" y2=\"{to_y:.1}\" stroke-dasharray=\"2 3\"/>\
         <circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"5\"><title>{} before: {:.2} µm, {:.3} ms</title></circle></g>",
        earlier.name, earlier.median_um, earlier.median_ms
    );
}

fn colour(knob: &str) -> &'static str {
    COLOURS.iter().find(|(name, _)| *name == knob).map_or("#000", |(_, colour)| colour)
}

fn dot(out: &mut String, frame: &Frame, standing: &Standing, best: bool) {
    if standing.answered == 0 && standing.knob != "level" {
        return;
    }
    let colour = colour(&standing.knob);
    let (x, y) = (frame.x(standing.median_um), frame.y(standing.median_ms));
    let (x99, x_max, y99) = (frame.x(standing.p99_um), frame.x(standing.max_um), frame.y(standing.p99_ms));
    let opacity = if best { 1.0 } else { 0.45 };
    let radius = if standing.knob == "level" { 5.0 } else { 3.0 };
    let failures = if standing.failed > 0 { format!(" ({} failed)", standing.failed) } else { String::new() };
    let _ = writeln!(
        out,
        "<g stroke=\"{colour}\" fill=\"{colour}\" opacity=\"{opacity}\"><line x1=\"{x:.1}\" y1=\"{y:.1}\" x2=\"{x99:.1}\" y2=\"{y:.1}\"/>\
         <line x1=\"{x_max:.1}\" y1=\"{:.1}\" x2=\"{x_max:.1}\" y2=\"{:.1}\"/><line x1=\"{x:.1}\" y1=\"{y:.1}\" x2=\"{x:.1}\" y2=\"{y99:.1}\"/>\
         <circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\"><title>{}{failures}: {:.2} µm (p99 {:.2}, max {:.2}), {:.3} ms (p99 {:.3})</title></circle></g>",
        y - 3.0,
        y + 3.0,
        standing.name,
        standing.median_um,
        standing.p99_um,
        standing.max_um,
        standing.median_ms,
        standing.p99_ms
    );
    if standing.knob == "level" || best {
        let _ = writeln!(
            out,
            "<text x=\"{:.1}\" y=\"{:.1}\" fill=\"{colour}\" font-size=\"11\">{}{failures}</text>",
            x + 7.0,
            y - 6.0,
            standing.name
        );
    }
}

fn legend(out: &mut String, y: f64) {
    for (index, (knob, colour)) in COLOURS.iter().enumerate() {
        let x = LEFT + 130.0 * index as f64;
        let _ = writeln!(
            out,
            "<circle cx=\"{x}\" cy=\"{:.1}\" r=\"4\" fill=\"{colour}\"/><text x=\"{:.1}\" y=\"{y}\">{knob}</text>",
            y - 4.0,
            x + 9.0
        );
    }
    let _ = writeln!(
        out,
        "<text x=\"{}\" y=\"{y}\" fill=\"#555\">dot: medians; lines: to the 99th percentiles; tick: largest error; full colour: nobody is both faster and nearer; ring: before</text>",
        LEFT + 130.0 * COLOURS.len() as f64
    );
}
