//! The audit as a picture: how far `auto` is from `all`, cumulated, and what each costs by class of scene. Plain SVG.

use std::fmt::Write as _;

use super::Summary;

/// Size of the picture and of its left panel (pixels).
const SIZE: (f64, f64) = (960.0, 430.0);
/// Left panel: x from, x to; both panels: y from, y to.
const LEFT: (f64, f64) = (60.0, 430.0);
/// Right panel: x from, x to.
const RIGHT: (f64, f64) = (640.0, 930.0);
/// See [`LEFT`].
const HEIGHT: (f64, f64) = (50.0, 370.0);
/// Ends of the axis of errors, in powers of ten of the tolerance.
const DECADES: (f64, f64) = (-4.0, 2.0);
/// Colours of `auto` and `all`.
const COLOURS: [&str; 2] = ["#1b6ca8", "#c9c9c9"];

/// The picture of worst-node errors in multiples of the tolerance, and of the mean costs of each class (name, `auto` ms, `all` ms).
pub fn svg(multiples: &[f64], classes: &[Summary]) -> String {
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" font-family=\"sans-serif\" font-size=\"13\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
        SIZE.0, SIZE.1
    );
    errors(&mut out, multiples);
    costs(&mut out, classes);
    out.push_str("</svg>\n");
    out
}

fn text(out: &mut String, x: f64, y: f64, anchor: &str, words: &str) {
    let _ = writeln!(out, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{words}</text>");
}

fn line(out: &mut String, from: (f64, f64), to: (f64, f64), colour: &str) {
    let _ = writeln!(
        out,
        "<line x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" stroke=\"{colour}\"/>",
        from.0, from.1, to.0, to.1
    );
}

fn errors(out: &mut String, multiples: &[f64]) {
    let x = |multiple: f64| {
        let decade = multiple.max(1e-300).log10().clamp(DECADES.0, DECADES.1);
        LEFT.0 + (decade - DECADES.0) / (DECADES.1 - DECADES.0) * (LEFT.1 - LEFT.0)
    };
    let y = |share: f64| HEIGHT.1 - share * (HEIGHT.1 - HEIGHT.0);
    text(out, LEFT.0, 28.0, "start", "Worst node, auto against all: share of scenes below");
    for decade in DECADES.0 as i32..=DECADES.1 as i32 {
        let at = x(10.0_f64.powi(decade));
        line(out, (at, HEIGHT.0), (at, HEIGHT.1), "#eeeeee");
        text(out, at, HEIGHT.1 + 18.0, "middle", &format!("{}", 10.0_f64.powi(decade)));
    }
    for percent in [0.0, 50.0, 95.0, 100.0] {
        line(out, (LEFT.0, y(percent / 100.0)), (LEFT.1, y(percent / 100.0)), "#eeeeee");
        text(out, LEFT.0 - 6.0, y(percent / 100.0) + 4.0, "end", &format!("{percent} %"));
    }
    for (multiple, name) in [(1.0, "tolerance"), (3.0, "3 ×")] {
        line(out, (x(multiple), HEIGHT.0), (x(multiple), HEIGHT.1), "#d04040");
        text(out, x(multiple), HEIGHT.0 - 5.0, if multiple > 1.0 { "start" } else { "end" }, name);
    }
    text(out, 0.5 * (LEFT.0 + LEFT.1), HEIGHT.1 + 40.0, "middle", "error in multiples of the tolerance");
    let mut sorted = multiples.to_vec();
    sorted.sort_by(f64::total_cmp);
    let mut path = format!("M{:.1},{:.1}", LEFT.0, HEIGHT.1);
    for (index, multiple) in sorted.iter().enumerate() {
        let _ = write!(path, " H{:.1} V{:.1}", x(*multiple), y((index + 1) as f64 / sorted.len() as f64));
    }
    let _ =
        writeln!(out, "<path d=\"{path} H{:.1}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\"/>", LEFT.1, COLOURS[0]);
}

fn costs(out: &mut String, classes: &[Summary]) {
    text(out, RIGHT.0, 28.0, "start", "Mean time of a prediction (ms): auto, all");
    let most = classes.iter().flat_map(|class| class.milliseconds).fold(1e-9, f64::max);
    let row = (HEIGHT.1 - HEIGHT.0) / classes.len().max(1) as f64;
    for (index, class) in classes.iter().enumerate() {
        let top = HEIGHT.0 + row * index as f64;
        text(out, RIGHT.0 - 8.0, top + 0.6 * row, "end", &class.name);
        for (bar, (ms, colour)) in class.milliseconds.iter().zip(COLOURS).enumerate() {
            let width = ms / most * (RIGHT.1 - RIGHT.0 - 60.0);
            let (y, height) = (top + row * (0.12 + 0.38 * bar as f64), 0.34 * row);
            let _ = writeln!(
                out,
                "<rect x=\"{:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" fill=\"{colour}\"/>",
                RIGHT.0
            );
            text(out, RIGHT.0 + width + 5.0, y + 0.85 * height, "start", &format!("{ms:.1}"));
        }
    }
}
