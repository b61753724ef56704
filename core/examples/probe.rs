//! probe
use retina_core::needle::NeedleShape;
use retina_core::predict::{Level, PreparedScene, Workspace};
use retina_core::progress::Silent;
use retina_core::scene::Scene;
use retina_core::working_range::WorkingRange;
use std::time::Instant;
fn main() {
    let mut args = std::env::args().skip(1);
    let level = match args.next().as_deref() {
        Some("reference") => Level::Reference,
        _ => Level::Coarse,
    };
    let count: usize = args.next().and_then(|a| a.parse().ok()).unwrap_or(20);
    let repeats: usize = args.next().and_then(|a| a.parse().ok()).unwrap_or(5);
    let only = args.next();
    let scene = PreparedScene::new(Scene::built_in("macula").unwrap()).unwrap();
    let mut range = WorkingRange::new(&scene.scene().tissue, 1);
    let mut ws = Workspace::default();
    let mut times = vec![];
    let mut its = vec![];
    let mut sum = 0.0;
    for _ in 0..count {
        let req = match only {
            Some(_) => {
                let r = range.radius_mm();
                range.request_with(NeedleShape::hemispherical(r), level)
            }
            None => range.request(level),
        };
        let mut best = f64::INFINITY;
        let mut it = 0;
        for _ in 0..repeats {
            let t = Instant::now();
            if let Ok(p) = scene.predict(&req, &mut ws, &mut Silent) {
                best = best.min(t.elapsed().as_secs_f64() * 1e3);
                it = p.solver.iterations;
                sum += p.displacement_um.iter().sum::<f64>();
            } else {
                best = f64::NAN;
                break;
            }
        }
        if best.is_finite() {
            times.push(best);
            its.push(it as f64);
        }
    }
    let pi: f64 = times.iter().zip(&its).map(|(t, i)| t / i.max(1.0)).sum::<f64>() / times.len() as f64;
    times.sort_by(f64::total_cmp);
    its.sort_by(f64::total_cmp);
    println!(
        "n {} ms median {:.3} max {:.3} | its median {} max {} | ms/it {:.4} | sum {:.9}",
        times.len(),
        times[times.len() / 2],
        times[times.len() - 1],
        its[its.len() / 2],
        its[its.len() - 1],
        pi,
        sum
    );
}
