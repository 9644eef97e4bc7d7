//! Where steady sliding exists: the equilibrium of a combination, and what presses every contact there.
//!
//! In steady sliding the structure is at rest, `K_s q = F_s`, and the friction forces are in `K_s` and `F_s`. The
//! *margin* of a closed contact is its normal force `N = (K q)_n - F_n`, that of an open one its gap `q_n`. Steady
//! sliding of a combination exists where no margin is negative and every sliding contact slips as its slider drives it.

use nalgebra::{DMatrix, DVector};

use crate::error::Error;
use crate::linalg::dense::{regular_solution, smallest_relative_pivot, solve};
use crate::scene::contact_law::{Contact, Directions};
use crate::scene::massless::condensation::Condensed;
use crate::scene::model::{Scene, State};
use crate::scene::reduction::Reduced;
use crate::scene::status::{Combination, Status};

/// Reciprocal condition (of the equilibrated matrix) below which an equilibrium is not unique.
const SINGULAR: f64 = 1e-13;
/// Exchanges of open and closed contacts after which the search for an equilibrium is given up; as a rule two or three
/// of them find it.
const EXCHANGES: usize = 40;
/// Number of contacts up to which every choice of open contacts is tried after that.
const ENUMERATED: usize = 6;

/// `K_s q = load`, and `margin_i = rows_i . q - offsets_i` of every contact.
#[derive(Debug, Clone)]
pub struct Statics {
    /// m entries, N.
    pub load: Vec<f64>,
    /// One row of m entries for each contact.
    pub rows: DMatrix<f64>,
    /// One entry per contact: the normal entry of F, N, of closed contacts, 0 of open ones.
    pub offsets: Vec<f64>,
    /// Of the sliders, m/s; 1 of stops, which have none.
    pub speeds: Vec<f64>,
}

/// Whether steady sliding of a combination exists, and its margins: N of closed contacts in N, gaps of open ones in m;
/// NaN where a contact sticks (its place is free) or the stiffness is singular.
#[derive(Debug, Clone, PartialEq)]
pub struct Steady {
    /// Whether no margin is negative and every sliding contact slips as its slider drives it.
    pub exists: bool,
    /// One margin per contact, N or m.
    pub margins: Vec<f64>,
}

impl Steady {
    pub(crate) fn new(combination: &Combination, speeds: &[f64], margins: Vec<f64>) -> Self {
        let driven = combination.statuses().iter().zip(speeds).all(|(&status, &speed)| {
            status == Status::Detached || Status::driven_by(speed) == Some(status)
        });
        Self { exists: driven && margins.iter().all(|&margin| margin >= 0.0), margins }
    }
}

impl Statics {
    /// Of a scene and one of its combinations.
    pub fn new(scene: &Scene, reduced: &Reduced) -> Result<Self, Error> {
        let condensed = Condensed::new(scene, &reduced.combination)?;
        let moving = condensed.as_ref().map_or(scene, |condensed| &condensed.scene);
        let (m, statuses) = (reduced.size(), reduced.combination.statuses());
        let mut rows = DMatrix::zeros(statuses.len(), m);
        let mut offsets = vec![0.0; statuses.len()];
        for (i, (law, status)) in scene.contacts.iter().zip(statuses).enumerate() {
            let position = |k: usize| reduced.reduction.place(k);
            if status.is_closed() {
                offsets[i] = moving.force[law.normal];
                for (k, value) in moving.stiffness.row(law.normal) {
                    if let Some(j) = position(k) {
                        rows[(i, j)] = value;
                    }
                }
            } else if let Some(j) = position(law.normal) {
                rows[(i, j)] = 1.0;
            } else if let Some(condensed) = &condensed {
                let (terms, constant) = condensed.replaced(&[(law.normal, 1.0)]);
                offsets[i] = -constant;
                for (k, value) in terms {
                    if let Some(j) = position(k) {
                        rows[(i, j)] = value;
                    }
                }
            }
        }
        Ok(Self {
            load: reduced.force_constant.clone(),
            rows,
            offsets,
            speeds: scene.contacts.iter().map(Contact::drive).collect(),
        })
    }

    pub(crate) fn steady(&self, combination: &Combination, stiffness: DMatrix<f64>) -> Steady {
        let stuck = combination.statuses().contains(&Status::Sticking);
        let margins = match regular_solution(stiffness, &self.load).filter(|_| !stuck) {
            Some(q) => margins(&self.rows, &self.offsets, &q),
            None => vec![f64::NAN; self.offsets.len()],
        };
        Steady::new(combination, &self.speeds, margins)
    }
}

/// `rows . q - offsets`, zero where it is lost in the rounding of its terms: no verdict hangs on that.
fn margins(rows: &DMatrix<f64>, offsets: &[f64], q: &DVector<f64>) -> Vec<f64> {
    let margin = |(i, &offset): (usize, &f64)| {
        let (mut sum, mut size) = (-offset, offset.abs());
        for (a, x) in rows.row(i).iter().zip(q) {
            sum += a * x;
            size += (a * x).abs();
        }
        if sum.abs() <= 64.0 * f64::EPSILON * size { 0.0 } else { sum }
    };
    offsets.iter().enumerate().map(margin).collect()
}

impl Scene {
    /// Every contact sliding as its slider drives it: `+` for a positive slider speed, because the mass at rest slips by
    /// `-slider_speed`; stops open or closed as the equilibrium has them, and closed where there is none. It is the default
    /// wherever a combination is asked for.
    pub fn sliding_combination(&self) -> Result<Combination, Error> {
        let statuses = self.contacts.iter().enumerate().map(|(contact, law)| {
            Status::driven_by(law.drive()).ok_or(Error::NoSlidingDirection { contact })
        });
        let closed = Combination::new(statuses.collect::<Result<Vec<_>, _>>()?);
        let stops = (0..self.contacts.len())
            .filter(|&contact| self.contacts[contact].directions == Directions::Normal);
        let stops: Vec<usize> = stops.collect();
        let mut settled = closed.clone();
        for _ in 0..EXCHANGES {
            let margins = match stops.is_empty() {
                true => return Ok(closed),
                false => self.steady(&settled)?.margins,
            };
            let mut violated = stops.iter().filter(|&&stop| margins[stop] < 0.0).peekable();
            if violated.peek().is_none() {
                return Ok(settled);
            }
            settled = violated.fold(settled.clone(), |next, &stop| {
                let open = settled.statuses()[stop].is_closed();
                next.with(stop, if open { Status::Detached } else { Status::Positive })
            });
        }
        Ok(closed)
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
        if let Some(condensed) = Condensed::new(self, &combination)? {
            condensed.complete(&mut q, &mut vec![0.0; self.size]);
        }
        for (contact, (law, status)) in self.contacts.iter().zip(combination.statuses()).enumerate()
        {
            if !status.is_closed() {
                if !(q[law.normal] >= 0.0) {
                    return Err(Error::Penetration { contact, gap: q[law.normal] });
                }
                continue;
            }
            let normal_force = self.stiffness.row_dot(law.normal, &q) - self.force[law.normal];
            if !(normal_force > 0.0) {
                return Err(Error::TensileEquilibrium { contact, normal_force });
            }
        }
        Ok(self.state(&q, &vec![0.0; self.size], &combination))
    }

    /// Whether steady sliding of a combination exists.
    pub fn steady(&self, combination: &Combination) -> Result<Steady, Error> {
        let reduced = Reduced::new(self, combination)?;
        let statics = Statics::new(self, &reduced)?;
        Ok(statics.steady(combination, reduced.stiffness))
    }

    /// The sliding combination, refused where a contact would pull. A stiffness that is singular refuses nothing: it
    /// does not say which contact is lost.
    pub fn steady_sliding(&self) -> Result<Combination, Error> {
        let combination = self.sliding_combination()?;
        let margins = self.steady(&combination)?.margins;
        match margins.iter().position(|&margin| margin < 0.0) {
            None => Ok(combination),
            Some(contact) => Err(Error::NoSteadySliding {
                contact,
                margin: margins[contact],
                open: !combination.statuses()[contact].is_closed(),
                admissible: self.admissible(&combination, &margins)?.map(|open| open.to_string()),
                combination: combination.to_string(),
            }),
        }
    }

    /// An equilibrium of steady sliding with other contacts open, given the margins of the sliding combination: contacts
    /// that pull are opened and those that penetrate closed, until none does.
    fn admissible(
        &self,
        sliding: &Combination,
        margins: &[f64],
    ) -> Result<Option<Combination>, Error> {
        let count = margins.len();
        let with_open = |open: &[bool]| {
            let laws = self.contacts.iter().zip(open);
            let status = |(law, &open): (&Contact, &bool)| match open {
                true if law.directions.admit(Status::Detached) => Status::Detached,
                _ => Status::driven_by(law.drive()).unwrap_or(Status::Positive),
            };
            Combination::new(laws.map(status).collect())
        };
        let mut open: Vec<bool> =
            sliding.statuses().iter().map(|status| !status.is_closed()).collect();
        let mut margins = margins.to_vec();
        for _ in 0..EXCHANGES {
            open.iter_mut().zip(&margins).for_each(|(open, &margin)| *open ^= margin < 0.0);
            let combination = with_open(&open);
            let found = self.steady(&combination)?;
            if found.exists {
                return Ok(Some(combination));
            }
            margins = found.margins;
        }
        if count <= ENUMERATED {
            for choice in 0..1_usize << count {
                open.iter_mut().enumerate().for_each(|(k, open)| *open = choice >> k & 1 == 1);
                let combination = with_open(&open);
                if self.steady(&combination)?.exists {
                    return Ok(Some(combination));
                }
            }
        }
        Ok(None)
    }
}
