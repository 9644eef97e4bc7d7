//! Floquet multipliers of a periodic orbit.
//!
//! Floquet multipliers are the eigenvalues of the product of the `S_k Phi_k`. Sticking and contact leave fewer
//! coordinates free, and the product has no larger rank than its narrowest place: it is formed
//! there, and the rest of the multipliers at the section are zero exactly.

use nalgebra::DMatrix;
use num_complex::Complex64;

use crate::contact::event_kind::EventKind;
use crate::cycles::linearization::flow::Flow;
use crate::cycles::linearization::saltation::{Linearised, Passage};
use crate::cycles::orbits::orbit::{Orbit, OrbitFailure};
use crate::cycles::orbits::shooting::Pass;
use crate::linalg::eigen;

/// Two contacts strike at the same instant if the flight between their impacts takes less than this part of the rest of
/// the series.
const FLIGHT: f64 = 1e-6;

/// The multipliers at the section and how many of them are zero by structure.
#[derive(Debug, Clone)]
pub struct Multipliers {
    /// Descending in modulus, conjugates adjacent. NaN at a corner of the return map (see [`Orbit::corner`]).
    pub values: Vec<Complex64>,
    /// The multipliers of the return map: all but the one of a shift along the orbit, which is 1. At a fold, where that one is
    /// defective, they keep their digits. Under loads in time, which set the phase, all multipliers count.
    pub transverse: Vec<Complex64>,
    /// How many of `values` are zero because contact and sticking leave fewer coordinates free.
    pub structural_zeros: usize,
    /// Dimension of the admissible space of every phase.
    pub dimensions: Vec<usize>,
    /// Directions that the event at the end of every phase forgets.
    pub losses: Vec<usize>,
}

impl Multipliers {
    /// Largest modulus across the flow, NaN if one of them is not known.
    pub fn largest(&self) -> f64 {
        let larger = |a: f64, b: f64| if a.is_nan() || a >= b { a } else { b };
        self.transverse.iter().map(|m| m.norm()).fold(0.0, larger)
    }
}

impl Orbit {
    /// Derivative of the flow over one period between equal times, over all of (q, q') at the section:
    /// columns outside the admissible space are zero.
    pub fn monodromy(&self) -> Result<DMatrix<f64>, OrbitFailure> {
        let flows = self.flows()?;
        let pass = self.pass(&flows)?;
        Ok(chained(&self.fundamental_maps(&flows, &pass), 0))
    }

    fn fundamental_maps(&self, flows: &[Flow<'_>], pass: &Pass) -> Vec<DMatrix<f64>> {
        let count = self.steps.len();
        (0..count)
            .map(|k| {
                let next = (k + 1) % count;
                pass.linearised[k].fundamental(&flows[next].field(&pass.arrived[k]))
            })
            .collect()
    }

    /// The Floquet multipliers.
    ///
    /// The product over a period has the rank of its narrowest factor at most, wherever it starts; the other
    /// multipliers are zero. It is formed from the narrowest admissible space on.
    pub fn multipliers(&self, is_over: &dyn Fn() -> bool) -> Result<Multipliers, OrbitFailure> {
        let flows = self.flows()?;
        let pass = self.pass_until(&flows, is_over)?;
        let count = self.steps.len();
        let dimensions: Vec<usize> = flows.iter().map(|flow| flow.section.len()).collect();
        let losses: Vec<usize> = (0..count)
            .map(|k| {
                let next_field = flows[(k + 1) % count].field(&pass.arrived[k]);
                let jump = &pass.linearised[k].jump;
                self.steps[k].passage.loss(&flows[k].section, jump, &next_field)
            })
            .collect();
        let rank = dimensions.iter().zip(&losses).map(|(d, lost)| d.saturating_sub(*lost)).min();
        let rank = rank.unwrap_or_default();
        let section = dimensions.first().copied().unwrap_or_default();
        let narrowest = (0..count).min_by_key(|&k| dimensions[k]).unwrap_or_default();
        let free = &flows[narrowest].section;
        let corner = self.corner().is_some();
        let eigenvalues = |maps: &[DMatrix<f64>], nonzero: usize, dimension: usize| {
            if corner {
                let mut values = vec![Complex64::new(f64::NAN, f64::NAN); nonzero];
                values.resize(dimension, Complex64::default());
                return values;
            }
            let mut values = spectrum_within(&chained(maps, narrowest), free);
            values.truncate(nonzero);
            values.resize(dimension, Complex64::default());
            values
        };
        let values = eigenvalues(&self.fundamental_maps(&flows, &pass), rank, section);
        let transverse = match self.load_periods {
            0 => {
                let return_maps: Vec<DMatrix<f64>> =
                    pass.linearised.iter().map(Linearised::return_map).collect();
                eigenvalues(&return_maps, rank.saturating_sub(1), section.saturating_sub(1))
            }
            _ => values.clone(),
        };
        Ok(Multipliers {
            values,
            transverse,
            structural_zeros: section.saturating_sub(rank),
            dimensions,
            losses,
        })
    }

    /// Two contacts whose events coincide and whose order matters to their neighbours: the return map has one
    /// derivative on either side, and no multipliers.
    ///
    /// Slip and its end change the acceleration of their own contact alone and leave velocities as they are, so that
    /// their saltation matrices commute, unless mass couples contacts. An impact changes the forces of others.
    pub fn corner(&self) -> Option<(usize, usize)> {
        let count = self.steps.len();
        let coupled = self.scene().coordinates.delassus.is_some();
        let impact = |passage: &Passage| {
            matches!(passage.trigger, EventKind::Impact | EventKind::Accumulation)
        };
        let jump = |k: usize| self.steps[k % count].kind == EventKind::Jump;
        (0..count).filter(|&k| !self.lasts(k) && !self.is_within_series(k)).find_map(|k| {
            let (first, second) =
                (&self.steps[(k + count - 1) % count].passage, &self.steps[k].passage);
            let timed =
                |passage: &Passage| matches!(passage.trigger, EventKind::Load | EventKind::Turn);
            if timed(first) || timed(second) {
                return None;
            }
            let jump = jump(k) || jump(k + count - 1);
            (first.contact != second.contact
                && (coupled || jump || impact(first) || impact(second)))
            .then_some((first.contact.min(second.contact), first.contact.max(second.contact)))
        })
    }

    /// Whether a step is one of the ever shorter flights of a series of impacts up to its limit, in which several
    /// contacts may strike in turn. They follow each other in an order of their own, also in neighbouring motions,
    /// unless one of them takes no part of the time that the rest of the series takes.
    fn is_within_series(&self, step: usize) -> bool {
        let count = self.steps.len();
        let at = |k: usize| &self.steps[k % count];
        let is_impact = |k: usize| at(k).passage.trigger == EventKind::Impact;
        if !is_impact(step + count - 1) {
            return false;
        }
        let limit = (step..step + count).find(|&k| !is_impact(k));
        limit.filter(|&limit| at(limit).passage.trigger == EventKind::Accumulation).is_some_and(
            |limit| {
                let rest: f64 = (step..=limit).map(|k| at(k).duration).sum();
                at(step).duration > FLIGHT * rest
            },
        )
    }
}

/// Eigenvalues of a matrix on some of its coordinates, descending in modulus.
fn spectrum_within(matrix: &DMatrix<f64>, free: &[usize]) -> Vec<Complex64> {
    let within = matrix.select_rows(free).select_columns(free);
    let mut values: Vec<Complex64> = eigen::real_matrix(&within)
        .into_iter()
        .flat_map(|pair| match pair.value.im == 0.0 {
            true => vec![pair.value],
            false => vec![pair.value, pair.value.conj()],
        })
        .collect();
    values.sort_by(|a, b| b.norm().total_cmp(&a.norm()).then(b.im.total_cmp(&a.im)));
    values
}

/// The product of all maps, the one of `first` applied first.
pub(crate) fn chained(maps: &[DMatrix<f64>], first: usize) -> DMatrix<f64> {
    let others = maps.iter().cycle().skip(first + 1).take(maps.len() - 1);
    others.fold(maps[first].clone(), |whole, map| map * whole)
}
