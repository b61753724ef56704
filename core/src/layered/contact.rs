//! The contact law: a rigid profile pressed into a prepared bed, without friction, by force or to a depth.
//!
//! A contact of radius a that grows under a rising force moves, at each instant, like a flat punch of radius a. With the profile
//! sampled at radii t₀ = 0 < t₁ < …, growth from tₙ to tₙ₊₁ is one load ([`super::grid`]: two punches between them), whose force qₙ is
//! what closes the gap at tₙ₊₁: a lower triangular system, solved outwards by substitution. The last, unfinished stretch ends at the
//! present contact radius c instead of tₙ₊₁ and takes the part (c³ − tₙ³)/(tₙ₊₁³ − tₙ³) of qₙ, which makes depth a continuous and increasing
//! function of force, with a continuous slope but for terms of second order.
//!
//! If an outer stop closes first (a profile that is not monotone, as an averaged bevel), the contact jumps there, and the
//! hollow it leaves inside counts as filled. So no increment of force is negative and no stop is penetrated, whatever the profile; for a
//! hollow that would in truth fill only partly the answer errs on the stiff side. Source: Mossakovskii 1963 (PMM 27:418), Jäger 1995
//! (Arch. Appl. Mech. 65:478), superposition of incremental flat punches. Units: mm, mN, kPa.

use super::error::LayeredError;
use super::grid::stretch_punches;
use super::indentation::{Indentation, push_punches};
use super::prepared::LinearBed;
use super::profile::{RigidProfile, Stops};
use super::stretch::Stretch;

/// What is prescribed.
#[derive(Clone, Copy)]
enum Target {
    Force(f64),
    Depth(f64),
}

impl LinearBed {
    /// Presses the tool with a normal force, mN.
    ///
    /// # Errors
    /// A negative or non-finite force, a bad profile, or a contact wider than the largest sample radius.
    pub fn indent_by_force(&self, profile: &RigidProfile, normal_force_mn: f64) -> Result<Indentation, LayeredError> {
        self.indent(profile, Target::Force(checked("normal_force_mn", normal_force_mn)?))
    }

    /// Presses the tool to a depth, mm, measured from first touch.
    ///
    /// # Errors
    /// A negative or non-finite depth, a bad profile, or a contact wider than the largest sample radius.
    pub fn indent_by_depth(&self, profile: &RigidProfile, depth_mm: f64) -> Result<Indentation, LayeredError> {
        self.indent(profile, Target::Depth(checked("depth_mm", depth_mm)?))
    }

    fn indent(&self, profile: &RigidProfile, target: Target) -> Result<Indentation, LayeredError> {
        let stops = profile.stops(self)?;
        let mut result = Indentation::default();
        if matches!(target, Target::Force(0.0) | Target::Depth(0.0)) {
            return Ok(result);
        }
        let rim = self.rim_closing(&stops);
        let mut gaps = stops.heights.clone();
        let mut front = stops.first;
        loop {
            let stretch = self.stretch(&stops, &rim, &gaps, front, result.normal_force_mn)?;
            let (done, whole) = match target {
                Target::Force(force) => (force - result.normal_force_mn, stretch.force),
                Target::Depth(depth) => (depth - result.depth_mm, stretch.force * stretch.depth),
            };
            if done <= whole {
                self.finish(&mut result, &stretch, target);
                return Ok(result);
            }
            commit(&mut result, &stops, &stretch, front);
            self.close(&mut gaps, &rim, &stops, &stretch, front);
            front = stretch.next;
        }
    }

    /// Lets the gaps shrink by a whole stretch.
    fn close(&self, gaps: &mut [f64], rim: &[f64], stops: &Stops, stretch: &Stretch, front: usize) {
        let last = gaps.len() - 1;
        if stops.ends_at_edge {
            if front + 1 < last {
                gaps[last] -= stretch.force * rim[front];
            } else {
                gaps[last] = 0.0;
                return;
            }
        }
        let samples = if stops.ends_at_edge { last } else { last + 1 };
        let closing = &self.stretches[front].closing[..samples];
        gaps[..samples].iter_mut().zip(closing).skip(front + 1).for_each(|(gap, rate)| *gap -= stretch.force * rate);
    }

    /// Ends the march inside a stretch, where the target is met.
    fn finish(&self, result: &mut Indentation, stretch: &Stretch, target: Target) {
        let [start, end] = stretch.radii;
        let radius_at = |force: f64| {
            let part = if stretch.force.is_infinite() { 1.0 } else { force / stretch.force };
            // Force grows about as the cube of the radius: exactly so for a paraboloid on a half-space.
            let cube = start.powi(3) + part * (end.powi(3) - start.powi(3));
            cube.cbrt()
        };
        let depth_of = |force: f64| {
            if force <= 0.0 {
                return 0.0;
            }
            let punches = stretch_punches(start, radius_at(force));
            let depth: f64 = punches.iter().map(|&(radius, part)| part * self.blend(radius).depth).sum();
            force * depth
        };
        let force = match target {
            Target::Force(force) => force - result.normal_force_mn,
            Target::Depth(depth) if stretch.force.is_infinite() => (depth - result.depth_mm) / stretch.depth,
            Target::Depth(depth) => increasing_root(depth_of, depth - result.depth_mm, stretch.force),
        };
        match target {
            Target::Force(total) => {
                result.normal_force_mn = total;
                result.depth_mm += depth_of(force);
            }
            Target::Depth(depth) => {
                result.normal_force_mn += force;
                result.depth_mm = depth;
            }
        }
        result.contact_radius_mm = radius_at(force);
        push_punches(&mut result.partial_punches, start, result.contact_radius_mm, force);
    }
}

/// Adds a whole stretch to the result.
fn commit(result: &mut Indentation, stops: &Stops, stretch: &Stretch, front: usize) {
    result.normal_force_mn += stretch.force;
    result.depth_mm += stretch.force * stretch.depth;
    if stops.ends_at_edge && front + 2 == stops.radii.len() {
        push_punches(&mut result.partial_punches, stretch.radii[0], stretch.radii[1], stretch.force);
    } else {
        result.stretch_forces_mn.resize(front + 1, 0.0);
        result.stretch_forces_mn[front] = stretch.force;
    }
}

/// Solves f(x) = `target` for an increasing f with f(0) = 0 on [0, `end`] by the Illinois method, to 1e-12 of the target.
fn increasing_root(f: impl Fn(f64) -> f64, target: f64, end: f64) -> f64 {
    let (mut low, mut low_error, mut high, mut high_error) = (0.0, -target, end, f(end) - target);
    for _ in 0..60 {
        if high_error <= 0.0 {
            return high;
        }
        let x = (low * high_error - high * low_error) / (high_error - low_error);
        let error = f(x) - target;
        if error.abs() <= 1e-12 * target {
            return x;
        }
        if error < 0.0 {
            (low, low_error, high_error) = (x, error, 0.5 * high_error);
        } else {
            (high, high_error, low_error) = (x, error, 0.5 * low_error);
        }
    }
    0.5 * (low + high)
}

/// A load that is finite and not negative.
fn checked(field: &'static str, value: f64) -> Result<f64, LayeredError> {
    if value.is_finite() && value >= 0.0 { Ok(value) } else { Err(LayeredError::InvalidLoad { field, value }) }
}
