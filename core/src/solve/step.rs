//! One Newton step with the factor at hand: the free unknowns, the driven vertex by the bordering method, what is held by its multiplier.
//!
//! Not here: what is done with it (`newton`, `globalization`).

use nalgebra::Vector3;

use super::border::{Bordered, Drive};
use super::held::Border;
use super::newton::{NewtonError, System, Workspace};

impl System<'_> {
    /// The Newton step (free unknowns, the border, and the change of the multiplier where there is one), the travel limited, and the slope of the potential along it; the
    /// linear solution checked.
    pub(super) fn step(
        &self,
        drive: Drive,
        max_travel_mm: f64,
        workspace: &mut Workspace,
    ) -> Result<(Vec<f64>, f64), NewtonError> {
        self.step_with(drive, max_travel_mm, true, workspace)
    }

    /// The same step with a factor that has solved before: the linear solution is not checked, for the step is judged by the residual that it leaves.
    pub(super) fn step_again(
        &self,
        drive: Drive,
        max_travel_mm: f64,
        workspace: &mut Workspace,
    ) -> Result<Vec<f64>, NewtonError> {
        Ok(self.step_with(drive, max_travel_mm, false, workspace)?.0)
    }

    fn step_with(
        &self,
        drive: Drive,
        max_travel_mm: f64,
        checked: bool,
        workspace: &mut Workspace,
    ) -> Result<(Vec<f64>, f64), NewtonError> {
        let free = self.dofs.free;
        let directions: Vec<Vector3<f64>> = drive.directions().into_iter().map(|(direction, _)| direction).collect();
        let out_of_balance = drive.out_of_balance(&Vector3::from_row_slice(&workspace.residual[free..]));
        let border = &workspace.values[self.pattern.stored()..];
        let couplings: Vec<f64> = directions
            .iter()
            .flat_map(|direction| (0..free).map(|i| (0..3).map(|k| border[k * free + i] * direction[k]).sum::<f64>()))
            .collect();
        let mut columns: Vec<f64> = workspace.residual[..free].iter().map(|r| -r).collect();
        let mut changes = Vec::new();
        if workspace.held.slope.is_empty() {
            self.respond(drive, &couplings, &mut columns, workspace);
        } else {
            columns.extend_from_slice(&couplings);
            columns.extend_from_slice(&workspace.held.slope);
            workspace.factor.solve(self.symbolic, self.pattern, &workspace.values, &mut columns)?;
            let (bent, response) = columns.split_at_mut((1 + directions.len()) * free);
            let border = Border::new(&workspace.held, response);
            let missing = workspace.held.missing;
            let columns = bent.chunks_exact_mut(free).enumerate();
            changes.extend(columns.map(|(index, column)| border.bend(column, if index == 0 { missing } else { 0.0 })));
        }
        let bordered = Bordered {
            directions: &directions,
            couplings: &couplings,
            columns: &columns[..(1 + directions.len()) * free],
            out_of_balance: &out_of_balance,
        };
        let corner = &workspace.values[self.pattern.stored() + 3 * free..];
        let (mut step, travels) = bordered.step(|row, column| corner[3 * row + column], max_travel_mm);
        if changes.is_empty() && checked {
            let mut forces: Vec<f64> = workspace.residual[..free].iter().map(|r| -r).collect();
            for (travel, coupling) in travels.iter().zip(couplings.chunks_exact(free)) {
                forces.iter_mut().zip(coupling).for_each(|(force, coupling)| *force -= travel * coupling);
            }
            workspace.factor.check(self.symbolic, self.pattern, &workspace.values, &mut step[..free], &forces)?;
        }
        let residual = &workspace.residual;
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
        let mut slope = dot(&step[..free], &residual[..free]) + dot(&travels, &out_of_balance);
        if let [alone, with_travel @ ..] = &changes[..] {
            let change = alone - dot(&travels, with_travel);
            slope -= change * workspace.held.missing;
            step.push(change);
        }
        Ok((step, slope.min(0.0)))
    }

    /// Solves for the forces in `columns` and puts the answers to the `couplings` behind them, which the factor at hand gives once for each drive.
    fn respond(&self, drive: Drive, couplings: &[f64], columns: &mut Vec<f64>, workspace: &mut Workspace) {
        let forces = columns.len();
        match workspace.responses.take_if(|(of, _)| *of == drive) {
            Some(at_hand) => {
                workspace.factor.substitute(self.symbolic, columns);
                columns.extend_from_slice(&at_hand.1);
                workspace.responses = Some(at_hand);
            }
            None => {
                columns.extend_from_slice(couplings);
                workspace.factor.substitute(self.symbolic, columns);
                workspace.responses = Some((drive, columns[forces..].to_vec()));
            }
        }
    }
}
