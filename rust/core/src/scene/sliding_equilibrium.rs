//! Steady sliding: the static equilibrium with every contact closed and sliding as its slider drives it.

use crate::error::Error;
use crate::linalg::dense::{smallest_relative_pivot, solve};
use crate::scene::model::{Scene, State};
use crate::scene::reduction::Reduced;
use crate::scene::status::{Combination, Status};

/// Reciprocal condition (of the equilibrated matrix) below which an equilibrium is not unique.
const SINGULAR: f64 = 1e-13;

impl Scene {
    /// Every contact sliding as its slider drives it: `+` for a positive slider speed, because the mass at rest slips by
    /// `-slider_speed`. It is the default wherever a combination is asked for.
    pub fn sliding_combination(&self) -> Result<Combination, Error> {
        let statuses = self.contacts.iter().enumerate().map(|(contact, law)| {
            Status::driven_by(law.slider_speed).ok_or(Error::NoSlidingDirection { contact })
        });
        Ok(Combination::new(statuses.collect::<Result<Vec<_>, _>>()?))
    }

    /// `K_s q = F0` of the sliding combination.
    pub fn sliding_equilibrium(&self) -> Result<State, Error> {
        let combination = self.sliding_combination()?;
        let reduced = Reduced::new(self, &combination)?;
        let mut equilibrated = reduced.stiffness;
        let mut load = reduced.force_constant;
        for (mut row, load) in equilibrated.row_iter_mut().zip(&mut load) {
            let scale = Some(row.amax()).filter(|&largest| largest > 0.0).unwrap_or(1.0);
            row /= scale;
            *load /= scale;
        }
        let reciprocal_condition = smallest_relative_pivot(&equilibrated);
        if reciprocal_condition < SINGULAR {
            return Err(Error::SingularStiffness {
                combination: combination.to_string(),
                reciprocal_condition,
            });
        }
        let kept = solve(equilibrated, &load);
        let mut q = vec![0.0; self.size];
        for (&k, value) in reduced.reduction.kept.iter().zip(kept) {
            q[k] = value;
        }
        for (contact, law) in self.contacts.iter().enumerate() {
            let normal_force = self.stiffness.row_dot(law.normal, &q) - self.force[law.normal];
            if !(normal_force > 0.0) {
                return Err(Error::TensileEquilibrium { contact, normal_force });
            }
        }
        Ok(State { position: self.positions(&q), velocity: vec![0.0; self.size], combination })
    }
}
