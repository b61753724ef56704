//! How the driven vertex moves, and the border of the linear system that its freedom is.
//!
//! The driven vertex moves along up to three directions bᵢ, its coordinates q along them being unknowns besides the free ones, under a force along the first. With K the
//! Hessian of the free part, C = (∂²Π/∂x∂t) b the coupling columns and S₀ = bᵀ (∂²Π/∂t²) b, the bordering method eliminates the free part: one factor, a right-hand side more
//! for each direction, and the small system S Δq = g with S = S₀ − Cᵀ K⁻¹ C and g the out-of-balance force less what the free part answers.
//!
//! Along a direction without stiffness (no contact yet, or past a limit point) only the sign of g is known, and the vertex moves as far as it may.
//! Not here: the factorisation (`sparse`), the iteration (`newton`).

use nalgebra::{DMatrix, DVector, Vector3};

/// How the driven vertex moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Drive {
    /// It stays where it is.
    Held,
    /// It moves along the unit vector `direction` until the resisting force along it equals `force_mn`.
    Force {
        /// Unit direction of travel.
        direction: Vector3<f64>,
        /// Force along it (mN).
        force_mn: f64,
    },
    /// It moves freely along both directions `aside`, held by the energies alone, and along `advance` as under a force.
    Guided {
        /// Unit direction of travel and the force along it (mN); `None`: it does not travel.
        advance: Option<(Vector3<f64>, f64)>,
        /// Two unit vectors at right angles to each other, neither along the travel.
        aside: [Vector3<f64>; 2],
    },
}

impl Drive {
    /// The directions and the force along each (mN).
    pub(super) fn directions(&self) -> Vec<(Vector3<f64>, f64)> {
        match *self {
            Drive::Held => Vec::new(),
            Drive::Force { direction, force_mn } => vec![(direction, force_mn)],
            Drive::Guided { advance, aside } => advance.into_iter().chain(aside.map(|side| (side, 0.0))).collect(),
        }
    }

    /// Work of the force (µJ) over the way `moved` of the vertex (mm).
    pub(super) fn work(&self, moved: &Vector3<f64>) -> f64 {
        match *self {
            Drive::Held | Drive::Guided { advance: None, .. } => 0.0,
            Drive::Force { direction, force_mn } => force_mn * moved.dot(&direction),
            Drive::Guided { advance: Some((direction, force_mn)), aside } => {
                // The coordinate along the travel: what remains when the way aside is taken off.
                let across = aside[0].cross(&aside[1]);
                force_mn * moved.dot(&across) / direction.dot(&across)
            }
        }
    }

    /// Out-of-balance force along each direction (mN), from the raw force on the vertex.
    pub(super) fn out_of_balance(&self, raw: &Vector3<f64>) -> Vec<f64> {
        self.directions().iter().map(|(direction, force_mn)| raw.dot(direction) - force_mn).collect()
    }
}

/// The system with its free part solved for each right-hand side, columns of as many entries as that has unknowns one after the other.
pub(super) struct Bordered<'a> {
    /// The directions.
    pub directions: &'a [Vector3<f64>],
    /// The coupling columns C, one for each direction (mN/mm).
    pub couplings: &'a [f64],
    /// K⁻¹ of the free part's forces, then K⁻¹ C.
    pub columns: &'a [f64],
    /// Out-of-balance force along each direction (mN).
    pub out_of_balance: &'a [f64],
}

impl Bordered<'_> {
    /// The step of the free part, then of the driven vertex, which moves by no more than `most_mm`; and its travel along each direction (mm). `corner` is the driven vertex's own
    /// stiffness (row, column ≤ row).
    pub fn step(&self, corner: impl Fn(usize, usize) -> f64, most_mm: f64) -> (Vec<f64>, Vec<f64>) {
        let size = self.columns.len() / (1 + self.directions.len());
        let (alone, responses) = self.columns.split_at(size);
        let part = |direction: usize| direction * size..(direction + 1) * size;
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
        let coupling = |direction: usize| &self.couplings[part(direction)];
        let response = |direction: usize| &responses[part(direction)];
        let mut reduced = Reduced { directions: self.directions, stiffness: Vec::new(), drive: Vec::new() };
        for (row, along) in self.directions.iter().enumerate() {
            for (column, other) in self.directions.iter().enumerate() {
                let own: f64 = (0..3)
                    .flat_map(|i| (0..3).map(move |j| (i, j)))
                    .map(|(i, j)| along[i] * other[j] * corner(i.max(j), i.min(j)))
                    .sum();
                reduced.stiffness.push(own - dot(coupling(row), response(column)));
            }
            reduced.drive.push(-self.out_of_balance[row] - dot(coupling(row), alone));
        }
        let travels = reduced.solve(most_mm);
        let mut step = alone.to_vec();
        for (direction, travel) in travels.iter().enumerate() {
            step.iter_mut().zip(response(direction)).for_each(|(s, r)| *s -= travel * r);
        }
        let moved: Vector3<f64> =
            self.directions.iter().zip(&travels).map(|(direction, travel)| direction * *travel).sum();
        step.extend(moved.iter());
        (step, travels)
    }
}

/// What is left of the system for the coordinates of the driven vertex when the free part is eliminated.
struct Reduced<'a> {
    directions: &'a [Vector3<f64>],
    /// The small matrix S, row by row (mN/mm).
    stiffness: Vec<f64>,
    /// The small right-hand side g (mN).
    drive: Vec<f64>,
}

/// Stiffness over the largest one from which on a direction counts as stiff.
const STIFF_ABOVE: f64 = 1e-12;

impl Reduced<'_> {
    /// The steps along the directions (mm), which move the vertex by no more than `most_mm`.
    pub fn solve(&self, most_mm: f64) -> Vec<f64> {
        match (&self.drive[..], &self.stiffness[..]) {
            ([], _) => Vec::new(),
            ([drive], [stiffness]) => {
                let travel = if *stiffness > 0.0 { drive / stiffness } else { drive.signum() * most_mm };
                vec![travel.clamp(-most_mm, most_mm)]
            }
            _ => self.solve_several(most_mm),
        }
    }

    fn solve_several(&self, most_mm: f64) -> Vec<f64> {
        let count = self.drive.len();
        let eigen = DMatrix::from_row_slice(count, count, &self.stiffness).symmetric_eigen();
        let largest = eigen.eigenvalues.amax();
        let mut steps = DVector::zeros(count);
        let mut unknown = DVector::zeros(count);
        for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
            let drive = vector.dot(&DVector::from_column_slice(&self.drive));
            if *value > STIFF_ABOVE * largest {
                steps += vector * (drive / value);
            } else {
                unknown += vector * drive.signum();
            }
        }
        let moved = |steps: &DVector<f64>| {
            self.directions.iter().zip(steps.iter()).map(|(direction, step)| direction * *step).sum::<Vector3<f64>>()
        };
        let free = moved(&unknown).norm();
        if free > 0.0 {
            steps += unknown * (most_mm / free);
        }
        let length = moved(&steps).norm();
        if length > most_mm {
            steps *= most_mm / length;
        }
        steps.as_slice().to_vec()
    }
}
