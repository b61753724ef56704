//! A bond that holds more the faster it is opened.
//!
//! While the effective opening λ grows with the speed v, the traction is that of the bond without haste, t(λ; κ), times (1 + v/v₀)ⁿ: strength and fracture energy
//! rise together as a power of the speed far above v₀, and a slow opening is the quasi-static bond. The form is that of viscoelastic peeling (Maugis &
//! Barquins, *J. Phys. D* 11, 1978, where rubber on glass has n = 0.6). A bond that is held or closes has no such surplus, so what it bore more for its speed relaxes at once.
//!
//! Over a step h that begins at the opening λ₀ the speed is (λ − λ₀)/h, so with a = h v₀ the traction t(λ; κ) F(λ)ⁿ, F = 1 + ⟨λ − λ₀⟩/a, depends on λ alone and has
//! a potential; t is linear between its turns, and each part's integral a closed form, written so that nothing cancels for slow openings.
//!
//! Law: the surplus never gives energy back: it acts only while the bond opens, and against it.

use super::Bond;

/// How a bond is opened during one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Opened<'a> {
    /// The power n.
    pub exponent: f64,
    /// Opening within the step at the reference speed, h v₀ (mm).
    pub reference_mm: f64,
    /// Effective opening of every point at the start of the step, face by face (mm).
    pub start_mm: &'a [f64],
}

/// Opening over [`Opened::reference_mm`] below which a series replaces a difference that would cancel.
const SMALL: f64 = 1e-4;

impl Opened<'_> {
    /// As [`Bond::potential`], for point `at` during this step.
    pub fn potential(&self, bond: &Bond, o: f64, largest: f64, at: usize) -> (f64, f64, f64) {
        let (n, a, start) = (self.exponent, self.reference_mm, self.start_mm[at]);
        let slow = bond.potential(o, largest);
        if o <= start {
            return slow;
        }
        let speed = 1.0 + (o - start) / a;
        let factor = speed.powf(n);
        let turn = largest.max(bond.onset_mm());
        let mut energy = bond.potential(start, largest).0;
        let mut from = start;
        for end in [turn, bond.parted_mm(), f64::INFINITY] {
            let to = end.min(o);
            if to > from {
                // The slope of the part is that of its middle: at its ends the law turns.
                let slope = bond.potential(0.5 * (from + to), largest).2;
                energy += self.swept(bond.potential(from, largest).1, slope, from - start, to - from);
                from = to;
            }
        }
        (energy, slow.1 * factor, slow.2 * factor + slow.1 * n * factor / speed / a)
    }

    /// ∫ (t + slope x) Fⁿ dx over 0 to `width` (mm), where the step has opened by `before` (mm) at x = 0.
    fn swept(&self, t: f64, slope: f64, before: f64, width: f64) -> f64 {
        let n = self.exponent;
        let reach = self.reference_mm + before;
        let r = width / reach;
        let grown = |power: f64| (power * r.ln_1p()).exp_m1() / power;
        let first = if r < SMALL {
            r * r * (0.5 + r * n * (1.0 / 3.0 + r * (n - 1.0) / 8.0))
        } else {
            grown(n + 2.0) - grown(n + 1.0)
        };
        (reach / self.reference_mm).powf(n) * reach * (t * grown(n + 1.0) + slope * reach * first)
    }
}
