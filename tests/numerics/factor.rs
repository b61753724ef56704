//! Sparse factors: what they solve, and what they refuse.

use nalgebra::{DMatrix, DVector};
use retina_core::assemble::{Dofs, Pattern, Predicted, Scratch, hessian};
use retina_core::effect::{Stencils, Term};
use retina_core::solve::sparse::{Factor, LinearSolveError, MAX_RELATIVE_RESIDUAL, SymbolicFactor};

use crate::mesh::{Springs, small};
use crate::meshes::noise;

/// A factor's largest relative residual for two right-hand sides on the small system with `shift`, told its least and largest eigenvalue, added to its diagonal.
fn solved(shift: impl Fn(f64, f64) -> f64) -> Result<f64, LinearSolveError> {
    let (dofs, stencils) = small();
    let pattern = Pattern::new(&dofs, &[&stencils[0], &stencils[1]]);
    let effects = [Springs { size: 3 }, Springs { size: 2 }];
    let terms = [0, 1].map(|t| Term { effect: &effects[t], stencils: &stencils[t], set: t });
    let mut values = vec![0.0; pattern.len()];
    hessian(&terms, &[0.0; 27], &Predicted::default(), &pattern, &mut Scratch::default(), &mut values);
    let n = dofs.free;
    let mut dense = dense(&pattern, &values);
    let eigenvalues = dense.symmetric_eigenvalues();
    let shift = shift(eigenvalues.min(), eigenvalues.max());
    for column in 0..n {
        values[pattern.column_starts[column] as usize] += shift;
        dense[(column, column)] += shift;
    }
    largest_residual(&pattern, &values, &dense)
}

/// The whole matrix.
fn dense(pattern: &Pattern, values: &[f64]) -> DMatrix<f64> {
    let mut dense = DMatrix::zeros(pattern.free, pattern.free);
    for column in 0..pattern.free {
        for at in pattern.column_starts[column] as usize..pattern.column_starts[column + 1] as usize {
            let row = pattern.rows[at] as usize;
            dense[(row, column)] = values[at];
            dense[(column, row)] = values[at];
        }
    }
    dense
}

/// A factor's largest relative residual for two right-hand sides; `dense` is the same matrix.
fn largest_residual(pattern: &Pattern, values: &[f64], dense: &DMatrix<f64>) -> Result<f64, LinearSolveError> {
    let n = pattern.free;
    let symbolic = SymbolicFactor::new(pattern)?;
    let mut factor = Factor::new(&symbolic);
    factor.factorize(&symbolic, pattern, values)?;
    let mut random = noise(19);
    let target: Vec<f64> = (0..2 * n).map(|_| random()).collect();
    let mut rhs = target.clone();
    factor.solve(&symbolic, pattern, values, &mut rhs)?;
    let residual = |c: usize| {
        let b = DVector::from_column_slice(&target[c * n..(c + 1) * n]);
        (dense * DVector::from_column_slice(&rhs[c * n..(c + 1) * n]) - &b).norm() / b.norm()
    };
    Ok(residual(0).max(residual(1)))
}

#[test]
fn a_factor_solves_and_an_indefinite_matrix_is_refused() {
    let residual = solved(|_, _| 0.0).unwrap();
    assert!(residual < MAX_RELATIVE_RESIDUAL, "{residual:e}");
    assert_eq!(solved(|_, _| -60.0), Err(LinearSolveError::Indefinite));
    assert_eq!(solved(|_, _| f64::NAN).unwrap_err(), LinearSolveError::Indefinite);
}

/// Where an eigenvalue is too small for single precision, a factor in double precision takes its place; an eigenvalue below zero is found as near to it.
#[test]
fn a_matrix_that_is_nearly_singular_is_solved_as_well() {
    for share in [1e-3, 1e-5, 1e-7, 1e-9] {
        let residual = solved(|least, largest| share * largest - least).unwrap();
        assert!(residual < MAX_RELATIVE_RESIDUAL, "{share:e}: {residual:e}");
        let below = solved(|least, largest| -share * largest - least);
        assert_eq!(below, Err(LinearSolveError::Indefinite), "{share:e}");
    }
}

/// Blocks of every width, columns of unknowns that are no whole vertices, and one so wide that it is factorised otherwise.
#[test]
fn matrices_of_every_size_are_solved_and_refused() {
    for (vertices, group, groups) in
        [(1, 1, 1), (2, 2, 1), (5, 2, 9), (17, 3, 30), (40, 5, 30), (90, 12, 40), (250, 250, 1)]
    {
        let mut random = noise(vertices as u64);
        let mut pick = || ((0.5 + 0.5 * random()) * vertices as f64).min(vertices as f64 - 1.0) as u32;
        let mut stencils = Stencils { group_size: group, vertices: Vec::new() };
        for _ in 0..groups {
            let first = pick();
            stencils.vertices.extend((0..group as u32).map(|next| (first + next) % vertices as u32));
        }
        let fixed = |vertex: usize, component: usize| (vertex + component) % 7 == 6;
        let dofs = Dofs::new(vertices, 0..vertices, fixed, None);
        let all = Stencils { group_size: 1, vertices: (0..vertices as u32).collect() };
        let pattern = Pattern::new(&dofs, &[&stencils, &all]);
        let mut values = vec![0.0; pattern.len()];
        values[..pattern.stored()].iter_mut().for_each(|value| *value = random());
        let mut whole = dense(&pattern, &values);
        // Each diagonal entry above the sum of its row: definite (Gershgorin).
        for column in 0..pattern.free {
            let sum: f64 = (0..pattern.free).map(|row| whole[(row, column)].abs()).sum();
            whole[(column, column)] = 1.0 + sum;
            values[pattern.column_starts[column] as usize] = 1.0 + sum;
        }
        let residual = largest_residual(&pattern, &values, &whole).unwrap();
        assert!(residual < MAX_RELATIVE_RESIDUAL, "{} unknowns: {residual:e}", pattern.free);
        // One diagonal entry below zero anywhere: indefinite.
        let column = pattern.free / 2;
        values[pattern.column_starts[column] as usize] *= -1.0;
        assert_eq!(largest_residual(&pattern, &values, &whole), Err(LinearSolveError::Indefinite), "{}", pattern.free);
    }
}
