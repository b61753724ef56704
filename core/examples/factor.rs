//! factor
use retina_core::mesh::wall::WallTopology;
use retina_core::predict::finite_element::{COARSE, REFERENCE};
use retina_core::scene::Scene;
use retina_core::solve::sparse::{Factor, SymbolicFactor};
use std::time::Instant;
fn main() {
    let scene = Scene::built_in("macula").unwrap();
    for (name, r) in [("coarse", COARSE), ("reference", REFERENCE)] {
        let top = WallTopology::new(r.division(&scene.tissue, false)).unwrap();
        let p = &top.pattern;
        let n = p.free;
        // elimination tree column counts by brute symbolic
        let mut children: Vec<Vec<usize>> = vec![vec![]; n];
        let mut flops = 0.0;
        let mut nnz = 0usize;
        let mut structs: Vec<Vec<u32>> = vec![vec![]; n];
        for c in 0..n {
            let mut s: Vec<u32> = p.rows[p.column_starts[c] as usize..p.column_starts[c + 1] as usize].to_vec();
            for &k in &children[c] {
                s.extend(structs[k].iter().filter(|&&r| r as usize >= c));
                structs[k] = vec![];
            }
            s.sort_unstable();
            s.dedup();
            if s.len() > 1 {
                children[s[1] as usize].push(c);
            }
            nnz += s.len();
            flops += (s.len() as f64).powi(2);
            structs[c] = s;
        }
        let mut values = vec![0.0; p.len()];
        for c in 0..n {
            for k in p.column_starts[c]..p.column_starts[c + 1] {
                values[k as usize] = if p.rows[k as usize] as usize == c { 1000.0 } else { -0.5 };
            }
        }
        let s = SymbolicFactor::new(p).unwrap();
        let mut f = Factor::new(&s);
        let mut best = f64::INFINITY;
        for _ in 0..10 {
            let t = Instant::now();
            f.factorize(&s, p, &values).unwrap();
            best = best.min(t.elapsed().as_secs_f64());
        }
        let mut rhs = vec![1.0; 2 * n];
        let t = Instant::now();
        f.solve(&s, p, &values, &mut rhs).unwrap();
        let solve = t.elapsed().as_secs_f64();
        println!(
            "{name} n {n} elements {} nnzA {} nnzL {nnz} stored {} Mflop {:.1} factor {:.3} ms  {:.1} GF/s solve2 {:.3} ms",
            top.elements.len(),
            p.stored(),
            s.stored(),
            flops / 1e6,
            best * 1e3,
            flops / 1e9 / best,
            solve * 1e3
        );
    }
}
