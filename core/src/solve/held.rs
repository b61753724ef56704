//! The constraint of a system: what one of its effects holds at a value, and the multiplier that holds it there.
//!
//! Sought is a stationary point of Π(x) − p (h(x) − h₀) in the positions x and in p. With K the Hessian for the present p, g = ∂h/∂x, r the residual for the present p and K⁻¹ at hand, a step obeys
//!
//! ```text
//! K Δx − g Δp = −r,   g · Δx = h₀ − h,
//! ```
//!
//! so that Δx = a + b Δp with a = −K⁻¹ r, b = K⁻¹ g and Δp = (h₀ − h − g · a)/(g · b): one right-hand side more (the bordering method, Keller 1977). What the driven vertex couples to is kept
//! from changing h in the same way. Positions take the step that the globalization leaves of Δx, and the multiplier all of Δp: the new residual does not depend on the old one.
//! Not here: what is held (the effect).

use super::newton::{System, Workspace};
use crate::assemble::Scratch;
use crate::effect::{Local, Multiplier, Term};

/// What is held at the positions of the last residual.
#[derive(Clone, Debug, Default)]
pub(super) struct Held {
    /// Its slope over the free unknowns; empty without a multiplier.
    pub slope: Vec<f64>,
    /// What is missing of it.
    pub missing: f64,
}

/// The change of the multiplier that makes columns keep what is held.
pub(super) struct Border<'a> {
    held: &'a Held,
    /// K⁻¹ g.
    response: &'a [f64],
    /// g · K⁻¹ g.
    compliance: f64,
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

impl<'a> Border<'a> {
    /// The border, from the response to the slope.
    pub fn new(held: &'a Held, response: &'a [f64]) -> Self {
        Border { held, response, compliance: dot(&held.slope, response) }
    }

    /// Changes `column` so that it adds `added` to what is held; returns the change of the multiplier.
    pub fn bend(&self, column: &mut [f64], added: f64) -> f64 {
        let change = (added - dot(&self.held.slope, column)) / self.compliance;
        column.iter_mut().zip(self.response).for_each(|(entry, response)| *entry += change * response);
        change
    }
}

impl System<'_> {
    /// The multiplier of the system and the term that has it.
    pub(super) fn multiplier(&self) -> Option<(&Multiplier, &Term<'_>)> {
        self.terms.iter().find_map(|term| term.effect.multiplier().map(|multiplier| (multiplier, term)))
    }

    /// Fills `workspace.held`; returns what is missing, as a force (mN).
    pub(super) fn hold(&self, positions: &[f64], workspace: &mut Workspace) -> Option<f64> {
        let Some((multiplier, term)) = self.multiplier() else {
            workspace.held.slope.clear();
            return None;
        };
        let Workspace { held, scratch, .. } = workspace;
        held.slope.clear();
        held.slope.resize(self.dofs.free, 0.0);
        let measure = sum(term, positions, scratch, |vertex, component, slope| {
            if let Some(index) = self.dofs.index(vertex, component).filter(|&index| index < self.dofs.free) {
                held.slope[index] += slope;
            }
        });
        held.missing = multiplier.wanted - measure;
        Some(multiplier.missing_mn(measure))
    }

    /// Adds `change` to the multiplier.
    pub(super) fn change_multiplier(&self, change: f64) {
        if let Some((multiplier, _)) = self.multiplier() {
            multiplier.set(multiplier.value() + change);
        }
    }
}

/// What `term` holds at `positions`; `visit(vertex, component, slope)` sees its slope.
fn sum(term: &Term, positions: &[f64], scratch: &mut Scratch, mut visit: impl FnMut(usize, usize, f64)) -> f64 {
    let n = term.stencils.group_size;
    let [current, slopes] = scratch.pair(3 * n);
    let mut total = 0.0;
    for group in 0..term.stencils.len() {
        term.stencils.gather(group, positions, current);
        let local = Local { current, group, predicted: &[] };
        total += term.effect.held(&local);
        slopes.fill(0.0);
        term.effect.add_held_slope(&local, slopes);
        for (a, &vertex) in term.stencils.group(group).iter().enumerate() {
            for k in 0..3 {
                if slopes[k * n + a] != 0.0 {
                    visit(vertex as usize, k, slopes[k * n + a]);
                }
            }
        }
    }
    total
}
