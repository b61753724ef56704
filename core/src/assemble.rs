//! The sum of effects over their groups: energy, gradient and Hessian of the whole system, written once.
//!
//! The unknowns are the free degrees of freedom of the vertices (numbered by [`Dofs`]) and, as a border, the three coordinates
//! of at most one driven vertex (the needle). The Hessian of the free part is sparse and symmetric (its lower triangle is kept,
//! compressed by columns); the border is dense. All of it lies in one flat array of values, and [`Pattern`] knows for each entry of each
//! local Hessian where it goes, so that assembly is a loop of additions.
//! Not here: what the energies are, how the system is solved. Read on in `tail` (the same for a few unknowns).

pub(crate) mod tail;

use crate::effect::{Local, Stencils, Term};

/// Marks a fixed degree of freedom.
const FIXED: u32 = u32::MAX;

/// Entries of the corner.
const CORNER: usize = 9;

/// Numbering of the degrees of freedom.
#[derive(Clone, Debug)]
pub struct Dofs {
    /// For each vertex and component: its index, the border's after the free unknowns, or `FIXED`.
    of: Vec<u32>,
    /// For each unknown of the longest tail, then of the border: its place among the positions.
    tail_positions: Vec<usize>,
    /// Number of free unknowns.
    pub free: usize,
    /// Of them, how many at the end can be condensed to, shorter tails first ([`Dofs::condensed_to`]).
    pub tails: Vec<usize>,
}

impl Dofs {
    /// Numbers the free components in the order of `vertex_order`; `fixed` tells which (vertex, component) do not move, and
    /// `border` which vertex is driven.
    pub fn new(
        vertices: usize,
        vertex_order: impl IntoIterator<Item = usize>,
        fixed: impl Fn(usize, usize) -> bool,
        border: Option<usize>,
    ) -> Self {
        let mut of = vec![FIXED; 3 * vertices];
        let mut free = 0;
        for vertex in vertex_order {
            for component in 0..3 {
                if Some(vertex) != border && !fixed(vertex, component) {
                    of[3 * vertex + component] = free;
                    free += 1;
                }
            }
        }
        if let Some(vertex) = border {
            for component in 0..3 {
                of[3 * vertex + component] = free + component as u32;
            }
        }
        Dofs { of, tail_positions: Vec::new(), free: free as usize, tails: Vec::new() }
    }

    /// The same with the last of the free unknowns apart, as many as one of `tails` (ascending) says: effects on vertices whose unknowns are all among them are a small
    /// problem of their own once the others are eliminated (`solve::condensed`).
    pub fn condensed_to(self, tails: Vec<usize>) -> Self {
        let longest = tails.last().copied().unwrap_or(0);
        let mut tail_positions = vec![usize::MAX; longest + 3];
        for at in 0..self.of.len() {
            if let Some(index) = self.index(at / 3, at % 3).and_then(|index| index.checked_sub(self.free - longest)) {
                tail_positions[index] = at;
            }
        }
        Dofs { tails, tail_positions, ..self }
    }

    /// Adds `step` (unknowns of a tail, then of the border) to the positions.
    pub(crate) fn advance_tail(&self, positions: &mut [f64], step: &[f64]) {
        for (&at, step) in self.tail_positions.iter().rev().zip(step.iter().rev()) {
            positions[at] += step;
        }
    }

    /// Number of an unknown of the last `tail` or of the border within the tail; `None` for any other and for what is fixed.
    pub(crate) fn in_tail(&self, tail: usize, vertex: usize, component: usize) -> Option<usize> {
        self.index(vertex, component)?.checked_sub(self.free - tail)
    }

    /// Index of a (vertex, component) in a vector of free unknowns followed by the three of the border; `None` if fixed.
    pub fn index(&self, vertex: usize, component: usize) -> Option<usize> {
        match self.of[3 * vertex + component] {
            FIXED => None,
            index => Some(index as usize),
        }
    }

    /// Adds `scale` × `step` (free unknowns, then the border) to the positions.
    pub fn advance(&self, positions: &mut [f64], step: &[f64], scale: f64) {
        for (at, position) in positions.iter_mut().enumerate() {
            if let Some(index) = self.index(at / 3, at % 3) {
                *position += scale * step[index];
            }
        }
    }
}

/// Where an entry of a group's Hessian goes.
#[derive(Clone, Copy, Debug)]
struct Destination {
    /// Its place in the group's own matrix, row by row.
    local: u32,
    /// Its place among the values.
    value: u32,
}

/// Sparsity of the Hessian and the destination of every local entry.
#[derive(Clone, Debug)]
pub struct Pattern {
    /// Number of free unknowns.
    pub free: usize,
    /// Column starts of the lower triangle.
    pub column_starts: Vec<u32>,
    /// Row indices, ascending in each column.
    pub rows: Vec<u32>,
    /// For each stencil set: where the entries of each group's Hessian go.
    destinations: Vec<Vec<Vec<Destination>>>,
    /// For each tail and stencil set: the groups whose unknowns are all in the tail or the border.
    tail_groups: Vec<Vec<Vec<usize>>>,
}

impl Pattern {
    /// The pattern for effects on these stencil sets, which [`Term::set`] counts in this order.
    pub fn new(dofs: &Dofs, stencils: &[&Stencils]) -> Self {
        let free = dofs.free;
        let border = free as u32;
        let mut columns: Vec<Vec<u32>> = vec![Vec::new(); free];
        let locals = |set: &Stencils, group: usize| -> Vec<u32> {
            let vertices = set.group(group);
            (0..3).flat_map(|k| vertices.iter().map(move |&v| dofs.of[3 * v as usize + k])).collect()
        };
        for set in stencils {
            for group in 0..set.len() {
                let mut dofs: Vec<u32> = locals(set, group).into_iter().filter(|&d| d < border).collect();
                dofs.sort_unstable();
                for (at, &column) in dofs.iter().enumerate() {
                    columns[column as usize].extend_from_slice(&dofs[at..]);
                }
            }
            for column in &mut columns {
                column.sort_unstable();
                column.dedup();
            }
        }
        let mut column_starts = vec![0u32];
        let mut rows = Vec::new();
        for column in &columns {
            rows.extend_from_slice(column);
            column_starts.push(rows.len() as u32);
        }
        let stored = rows.len() as u32;
        let destination = |a: u32, b: u32| -> Option<u32> {
            let (low, high) = (a.min(b), a.max(b));
            if high == FIXED {
                None
            } else if low >= border {
                Some(stored + 3 * border + 3 * (high - border) + (low - border))
            } else if high >= border {
                Some(stored + (high - border) * border + low)
            } else {
                let at = columns[low as usize].binary_search(&high).ok()?;
                Some(column_starts[low as usize] + at as u32)
            }
        };
        let of_group = |set: &Stencils, group: usize| {
            let dofs = locals(set, group);
            let lower = (0..dofs.len()).flat_map(|row| (0..=row).map(move |column| (row, column)));
            let mut list: Vec<Destination> = lower
                .filter_map(|(row, column)| {
                    let value = destination(dofs[row], dofs[column])?;
                    Some(Destination { local: (row * dofs.len() + column) as u32, value })
                })
                .collect();
            // The values are too many for the first cache, the group's matrix is not: they are gone through in their order.
            list.sort_unstable_by_key(|entry| entry.value);
            list
        };
        let destinations =
            stencils.iter().map(|set| (0..set.len()).map(|group| of_group(set, group)).collect()).collect();
        let groups_in = |tail: &usize| {
            let in_tail = |&dof: &u32| dof as usize >= free - tail;
            let within = |set: &&Stencils| {
                (0..set.len()).filter(|&group| locals(set, group).iter().all(in_tail)).collect::<Vec<usize>>()
            };
            stencils.iter().map(within).collect()
        };
        let tail_groups = dofs.tails.iter().map(groups_in).collect();
        Pattern { free, column_starts, rows, destinations, tail_groups }
    }

    /// Number of stored entries of the sparse lower triangle.
    pub fn stored(&self) -> usize {
        self.rows.len()
    }

    /// Length of the array of values: sparse part, border (3 × free), corner (3 × 3, lower triangle).
    pub fn len(&self) -> usize {
        self.rows.len() + 3 * self.free + CORNER
    }

    /// Whether there is no unknown.
    pub fn is_empty(&self) -> bool {
        self.free == 0
    }
}

/// Memory for assembly, reused between evaluations.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    positions: Vec<f64>,
    other: Vec<f64>,
    hessian: Vec<f64>,
}

impl Scratch {
    /// Two vectors of this length.
    pub(crate) fn pair(&mut self, len: usize) -> [&mut [f64]; 2] {
        self.positions.resize(len, 0.0);
        self.other.resize(len, 0.0);
        [&mut self.positions, &mut self.other]
    }
}

/// Predicted stresses of every group of every term; [`Predicted::default`] stands for those of the current positions.
#[derive(Clone, Debug, Default)]
pub struct Predicted {
    /// One vector per term, group after group.
    terms: Vec<Vec<f64>>,
}

impl Predicted {
    /// No stress anywhere.
    pub fn zero(terms: &[Term]) -> Self {
        Predicted { terms: terms.iter().map(|t| vec![0.0; t.effect.predicted_len() * t.stencils.len()]).collect() }
    }

    /// Multiplies every stress.
    pub fn scale(&mut self, factor: f64) {
        for stress in self.terms.iter_mut().flatten() {
            *stress *= factor;
        }
    }

    /// Forgets every stress.
    pub fn clear(&mut self) {
        for stresses in &mut self.terms {
            stresses.fill(0.0);
        }
    }

    fn of(&self, term: usize, group: usize, len: usize) -> &[f64] {
        self.terms.get(term).map_or(&[], |stresses| &stresses[group * len..(group + 1) * len])
    }
}

/// Fills `out` with the stresses at the end of the linear step `step` (layout of positions) from `positions`.
pub fn predict_stress(terms: &[Term], positions: &[f64], step: &[f64], scratch: &mut Scratch, out: &mut Predicted) {
    out.clear();
    for_each_active(terms, positions, &Predicted::default(), scratch, |index, term, local, moved, _| {
        let len = term.effect.predicted_len();
        moved.resize(3 * term.stencils.group_size, 0.0);
        term.stencils.gather(local.group, step, moved);
        term.effect.predict_stress(local, moved, &mut out.terms[index][local.group * len..(local.group + 1) * len]);
    });
}

/// Calls `visit(term index, term, local, scratch)` for each active group of each term.
fn for_each_active(
    terms: &[Term],
    positions: &[f64],
    predicted: &Predicted,
    scratch: &mut Scratch,
    mut visit: impl FnMut(usize, &Term, &Local, &mut Vec<f64>, &mut Vec<f64>),
) {
    let Scratch { positions: current, other, hessian } = scratch;
    for (index, term) in terms.iter().enumerate() {
        current.resize(3 * term.stencils.group_size, 0.0);
        for group in 0..term.stencils.len() {
            term.stencils.gather(group, positions, current);
            let local = Local { current, group, predicted: predicted.of(index, group, term.effect.predicted_len()) };
            if term.effect.is_active(&local) {
                visit(index, term, &local, other, hessian);
            }
        }
    }
}

/// Total energy (µJ) at `positions` (x, y, z of each vertex); infinite if any effect vetoes them.
pub fn energy(terms: &[Term], positions: &[f64], scratch: &mut Scratch) -> f64 {
    let mut total = 0.0;
    for_each_active(terms, positions, &Predicted::default(), scratch, |_, term, local, _, _| {
        total += term.effect.energy(local)
    });
    total
}

/// The gradient (mN) with respect to the free unknowns, then to the three border coordinates (`out`: free + 3 entries).
pub fn gradient(terms: &[Term], positions: &[f64], dofs: &Dofs, scratch: &mut Scratch, out: &mut [f64]) {
    out.fill(0.0);
    for_each_active(terms, positions, &Predicted::default(), scratch, |_, term, local, forces, _| {
        let n = term.stencils.group_size;
        forces.clear();
        forces.resize(3 * n, 0.0);
        term.effect.add_gradient(local, forces);
        for (a, &vertex) in term.stencils.group(local.group).iter().enumerate() {
            for (component, &index) in dofs.of[3 * vertex as usize..][..3].iter().enumerate() {
                // What is fixed lies beyond the end.
                if let Some(out) = out.get_mut(index as usize) {
                    *out += forces[component * n + a];
                }
            }
        }
    });
}

/// The Hessian (mN/mm) in the layout of `pattern` (`values`: `pattern.len()` entries).
pub fn hessian(
    terms: &[Term],
    positions: &[f64],
    predicted: &Predicted,
    pattern: &Pattern,
    scratch: &mut Scratch,
    values: &mut [f64],
) {
    values.fill(0.0);
    for_each_active(terms, positions, predicted, scratch, |_, term, local, _, matrix| {
        let n = 3 * term.stencils.group_size;
        matrix.resize(n * n, 0.0);
        // What lies above the diagonal is not read.
        for row in 0..n {
            matrix[row * n..=row * n + row].fill(0.0);
        }
        term.effect.add_hessian(local, matrix);
        for &Destination { local: entry, value } in &pattern.destinations[term.set][local.group] {
            values[value as usize] += matrix[entry as usize];
        }
    });
}

/// The largest fraction of `step` (same layout as positions) that every effect accepts.
pub fn max_step(terms: &[Term], positions: &[f64], step: &[f64], scratch: &mut Scratch) -> f64 {
    let mut largest = 1.0_f64;
    for_each_active(terms, positions, &Predicted::default(), scratch, |_, term, local, moved, _| {
        moved.resize(3 * term.stencils.group_size, 0.0);
        term.stencils.gather(local.group, step, moved);
        largest = largest.min(term.effect.max_step(local, moved));
    });
    largest
}
