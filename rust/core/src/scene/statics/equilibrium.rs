//! The equilibrium of a scene: which contacts are open in steady sliding, and the displacements there.

use nalgebra::{DMatrix, DVector};

use crate::error::input::Error;
use crate::linalg::dense::{Factors, smallest_relative_pivot, solve};
use crate::linalg::sparse_factors::NoFactors;
use crate::linalg::sparse_solver::SparseSolver;
use crate::numerics::complementarity::{self, Complementarity, ENUMERATED};
use crate::numerics::double_double::Doubled;
use crate::scene::contact_law::Directions;
use crate::scene::model::{Scene, State};
use crate::scene::reduction::bases::Reduction;
use crate::scene::reduction::reduced_system::Reduced;
use crate::scene::statics::margins::{ROUNDING, Statics, Steady};
use crate::scene::status::{Combination, Status};

/// Reciprocal condition (of the scaled matrix) below which an equilibrium is not unique.
const SINGULAR: f64 = 1e-13;
/// Coordinates up to which an equilibrium takes dense factors.
const DENSE: usize = 100;
/// Number of exchanges of open and closed stops after which the search is given up; as a rule two or three suffice.
const EXCHANGES: usize = 40;
/// Steps of refinement of an equilibrium; the second one leaves only the rounding of the result.
const REFINEMENTS: usize = 2;

impl Scene {
    /// Every contact sliding as its slider drives it: `+` for a positive slider speed, because the mass at rest slips by
    /// `-slider_speed`; stops open or closed as the equilibrium has them, and closed where there is none. It is the default
    /// wherever a combination is asked for.
    pub fn sliding_combination(&self) -> Result<Combination, Error> {
        let statuses = self
            .contacts
            .iter()
            .enumerate()
            .map(|(contact, law)| law.driven().ok_or(Error::NoSlidingDirection { contact }));
        let closed = Combination::new(statuses.collect::<Result<Vec<_>, _>>()?);
        let stops = self.contacts_with(|directions| directions == Directions::Normal);
        if stops.is_empty() {
            return Ok(closed);
        }
        let settled = self.settled(&closed, &stops, |next| Ok(self.steady(next)?.margins))?;
        Ok(settled.unwrap_or(closed))
    }

    fn contacts_with(&self, directions: impl Fn(Directions) -> bool) -> Vec<usize> {
        let contacts = 0..self.contacts.len();
        contacts.filter(|&contact| directions(self.contacts[contact].directions)).collect()
    }

    /// The combination with one contact closed if it is open, and open if it is closed.
    fn exchanged(&self, combination: &Combination, contact: usize) -> Combination {
        let closed = self.contacts[contact].driven();
        let open = combination.statuses()[contact].is_closed();
        let other = if open { Status::Detached } else { closed.unwrap_or(Status::Positive) };
        self.with_status(combination, contact, other)
    }

    /// The combination that is left once no contact that may open has a negative margin: those that have change sides. None if
    /// [`EXCHANGES`] do not suffice.
    fn settled(
        &self,
        first: &Combination,
        opening: &[usize],
        margins: impl Fn(&Combination) -> Result<Vec<f64>, Error>,
    ) -> Result<Option<Combination>, Error> {
        let mut settled = first.clone();
        for _ in 0..EXCHANGES {
            let margins = margins(&settled)?;
            let mut wrong = opening.iter().filter(|&&contact| margins[contact] < 0.0).peekable();
            if wrong.peek().is_none() {
                return Ok(Some(settled));
            }
            settled = wrong.fold(settled.clone(), |next, &contact| self.exchanged(&next, contact));
        }
        Ok(None)
    }

    /// The equilibrium of steady sliding; contacts that would pull are open.
    pub fn sliding_equilibrium(&self) -> Result<State, Error> {
        if self.has_elements() {
            return Ok(self.rest_with_elements()?.state);
        }
        if self.has_dependent_directions() {
            return Ok(self.dependent_equilibrium()?.state);
        }
        let scene = self.at_steady_sliding();
        let contacts = StaticContacts::new(&scene)?;
        Ok(contacts.equilibrium(&contacts.open()?).state)
    }

    /// Where directions of contacts depend on each other: contacts of the wrong sign change sides; if that finds no
    /// equilibrium, every choice of open contacts is tried where there are at most [`ENUMERATED`], fewest open ones first.
    fn dependent_equilibrium(&self) -> Result<Equilibrium, Error> {
        let scene = &*self.at_steady_sliding();
        let preferred = scene.sliding_combination()?;
        let unilateral = scene.contacts_with(|directions| directions != Directions::Tangential);
        let holds = |rest: &(Equilibrium, Vec<f64>)| rest.1.iter().all(|&margin| margin >= 0.0);
        let margins = |next: &Combination| Ok(scene.rest_of(next)?.1);
        if let Ok(Some(settled)) = scene.settled(&preferred, &unilateral, margins)
            && let Some((equilibrium, _)) = scene.rest_of(&settled).ok().filter(holds)
        {
            return Ok(equilibrium);
        }
        let closed = unilateral.iter().fold(preferred.clone(), |all, &contact| {
            if all.statuses()[contact].is_closed() { all } else { scene.exchanged(&all, contact) }
        });
        let count = unilateral.len();
        let mut choices: Vec<usize> =
            (0..if count <= ENUMERATED { 1 << count } else { 0 }).collect();
        choices.sort_by_key(|choice| choice.count_ones());
        let choice = |choice: usize| {
            let open = (0..count).filter(|place| choice >> place & 1 == 1);
            open.fold(closed.clone(), |next, place| scene.exchanged(&next, unilateral[place]))
        };
        let rests = choices.into_iter().filter_map(|open| scene.rest_of(&choice(open)).ok());
        if let Some((equilibrium, _)) = { rests }.find(holds) {
            return Ok(equilibrium);
        }
        let (_, margins) = scene.rest_of(&closed)?;
        let (contact, &normal_force) =
            margins.iter().enumerate().min_by(|a, b| a.1.total_cmp(b.1)).unwrap_or((0, &f64::NAN));
        Err(Error::TensileEquilibrium { contact, normal_force })
    }

    /// The structure at rest in a combination without sticking contacts, and the margins of all contacts.
    pub(super) fn rest_of(
        &self,
        combination: &Combination,
    ) -> Result<(Equilibrium, Vec<f64>), Error> {
        let reduced = Reduced::new(self, combination)?;
        let mut equilibrated = reduced.stiffness.clone();
        let mut load = reduced.force_constant.clone();
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
        let margins = Statics::new(self, &reduced).margins(&kept);
        let mut q = vec![0.0; self.size];
        reduced.reduction.place_closed(&mut q);
        for (&k, &value) in reduced.reduction.kept.iter().zip(&kept) {
            q[k] = value;
        }
        let fitted = reduced.scene(self);
        fitted.follow(&mut q, &mut vec![0.0; self.size]);
        let statuses = combination.statuses().iter();
        let normal_forces =
            statuses.zip(&margins).map(|(s, &n)| if s.is_closed() { n } else { 0.0 }).collect();
        let state = State {
            position: self.positions(&q),
            velocity: vec![0.0; self.dofs],
            combination: combination.clone(),
            friction_force: Vec::new(),
            internal: Vec::new(),
        };
        Ok((Equilibrium { state, normal_forces }, margins))
    }

    /// The same with its normal forces, and whether it is the only one.
    pub fn steady_equilibrium(&self) -> Result<(Equilibrium, Uniqueness), Error> {
        if self.has_elements() {
            return Ok((self.rest_with_elements()?, Uniqueness::Unknown));
        }
        if self.has_dependent_directions() {
            return Ok((self.dependent_equilibrium()?, Uniqueness::Unknown));
        }
        let scene = self.at_steady_sliding();
        let contacts = StaticContacts::new(&scene)?;
        let open = contacts.open()?;
        let uniqueness = match contacts.problem().uniqueness(&open) {
            complementarity::Uniqueness::Proved => Uniqueness::Proved,
            complementarity::Uniqueness::Unknown => Uniqueness::Unknown,
            complementarity::Uniqueness::Another(other) => {
                Uniqueness::Another(Box::new(contacts.equilibrium(&other)))
            }
        };
        Ok((contacts.equilibrium(&open), uniqueness))
    }

    /// Whether steady sliding of a combination exists.
    pub fn steady(&self, combination: &Combination) -> Result<Steady, Error> {
        if self.has_elements() {
            return self.about_rest(combination)?.steady(combination);
        }
        let scene = &*self.at_steady_sliding();
        if scene.size <= DENSE {
            let reduced = Reduced::new(scene, combination)?;
            return Ok(Statics::new(scene, &reduced).steady(combination, &reduced.stiffness));
        }
        let (moving, reduction) = scene.in_motion(combination)?;
        let statics = Statics::in_bases(&moving, combination, &reduction);
        let rest = || {
            let solver = reduction.solver(&moving.stiffness, SINGULAR).ok()?;
            Some(DVector::from_vec(solver.solve_one(&statics.load)))
        };
        Ok(statics.steady_at(combination, rest))
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
                admissible: self
                    .sliding_equilibrium()
                    .ok()
                    .map(|state| state.combination.to_string()),
                combination: combination.to_string(),
            }),
        }
    }
}

/// Steady sliding with open contacts: the normal forces N that gaps g leave, `N = S g + N_0`.
///
/// With every contact held at its gap, `K_s q = F_s - (L' K)_n g` has one solution where K_s is regular, even if the
/// structure is held by its contacts alone. The equilibrium is the linear complementarity problem `N >= 0, g >= 0,
/// N g = 0`: one factorization of K_s, a solution with it for each contact, and a problem as small as the contacts are
/// few. Friction makes S unsymmetric, so there may be no solution, or several.
struct StaticContacts<'a> {
    scene: &'a Scene,
    /// Contacts that may open; the others have a given normal force.
    unilateral: Vec<usize>,
    /// All of them closed, and the choice that is tried first.
    closed: Combination,
    preferred: Combination,
    reduction: Reduction,
    solver: SparseSolver,
    /// Kept coordinates with all contacts closed, and what one unit of each gap adds.
    rest: Vec<f64>,
    responses: DMatrix<f64>,
    matrix: DMatrix<f64>,
    offsets: DVector<f64>,
}

/// A state of steady sliding with the normal force of every contact, N; 0 of open ones.
#[derive(Debug, Clone)]
pub struct Equilibrium {
    /// At rest.
    pub state: State,
    /// One entry per contact.
    pub normal_forces: Vec<f64>,
}

/// Whether an equilibrium is the only one.
#[derive(Debug, Clone)]
pub enum Uniqueness {
    /// There is no other.
    Proved,
    /// There is this one, too.
    Another(Box<Equilibrium>),
    /// Nothing cheap enough decides it.
    Unknown,
}

impl<'a> StaticContacts<'a> {
    fn new(scene: &'a Scene) -> Result<Self, Error> {
        let preferred = scene.sliding_combination()?;
        let unilateral = scene.contacts_with(|directions| directions != Directions::Tangential);
        let stop = |&&contact: &&usize| scene.contacts[contact].directions == Directions::Normal;
        let closed = unilateral
            .iter()
            .filter(stop)
            .fold(preferred.clone(), |all, &stop| all.with(stop, Status::Positive));
        let reduction = Reduction::with_massless(scene, &closed);
        let solver = reduction.solver(&scene.stiffness, SINGULAR).map_err(|why| match why {
            NoFactors::Singular(reciprocal_condition) => {
                Error::SingularStiffness { combination: closed.to_string(), reciprocal_condition }
            }
            NoFactors::Memory => Error::Memory {
                what: "scene: the factors of its stiffness",
                size: reduction.size(),
                remedy: "mesh it more coarsely, or reduce its bodies first",
            },
        })?;
        let rest = solver.solve_one(&reduction.force_constant(scene));
        let mut places = vec![0.0; scene.size];
        reduction.place_closed(&mut places);
        let normals = || unilateral.iter().map(|&contact| scene.contacts[contact].normal);
        let mut loads = DMatrix::zeros(reduction.size(), unilateral.len());
        for (mut column, normal) in loads.column_iter_mut().zip(normals()) {
            column.copy_from_slice(&reduction.force(&scene.held_load(normal)));
        }
        let responses = solver.solve(loads);
        let reaction = |normal: usize, moved: &[f64]| -> Vec<f64> {
            let entries = scene.stiffness.row(normal);
            entries.filter_map(|(k, value)| Some(value * moved[reduction.place(k)?])).collect()
        };
        let count = unilateral.len();
        let mut matrix = DMatrix::zeros(count, count);
        for (i, normal) in normals().enumerate() {
            for (j, other) in normals().enumerate() {
                matrix[(i, j)] = scene.stiffness.get(normal, other)
                    + reaction(normal, responses.column(j).as_slice()).iter().sum::<f64>();
            }
        }
        let offset = |normal: usize| {
            let terms = reaction(normal, &rest);
            let force = scene.force[normal] - scene.stiffness.row_dot(normal, &places);
            let sum = terms.iter().sum::<f64>() - force;
            let size = terms.iter().map(|term| term.abs()).sum::<f64>() + force.abs();
            if sum.abs() <= ROUNDING * size { 0.0 } else { sum }
        };
        let offsets = DVector::from_iterator(count, normals().map(offset));
        Ok(Self {
            scene,
            unilateral,
            closed,
            preferred,
            reduction,
            solver,
            rest,
            responses,
            matrix,
            offsets,
        })
    }

    fn problem(&self) -> Complementarity {
        Complementarity::new(&self.matrix, &self.offsets)
    }

    /// Which contacts are open; if no choice is an equilibrium, an error that names the first contact that would pull.
    fn open(&self) -> Result<Vec<bool>, Error> {
        let statuses = self.preferred.statuses();
        let open = self.unilateral.iter().map(|&contact| !statuses[contact].is_closed());
        self.problem().support(open.collect()).ok_or_else(|| {
            let pulls = self.offsets.iter().position(|&normal_force| normal_force < 0.0);
            let first = pulls.unwrap_or_default();
            let (contact, normal_force) = (self.unilateral[first], self.offsets[first]);
            Error::TensileEquilibrium { contact, normal_force }
        })
    }

    /// The equilibrium with some contacts open, refined by its residuals in doubled precision.
    fn equilibrium(&self, open: &[bool]) -> Equilibrium {
        let Self { scene, reduction, .. } = self;
        // Places among the contacts that may open.
        let opened: Vec<usize> = (0..open.len()).filter(|&place| open[place]).collect();
        let normal = |place: usize| scene.contacts[self.unilateral[place]].normal;
        let factors = Factors::new(self.matrix.select_rows(&opened).select_columns(&opened));
        let mut q = vec![0.0; scene.size];
        reduction.place_closed(&mut q);
        let mut add = |still: &[f64], normal_forces: DVector<f64>| {
            let gaps = factors.solve(-normal_forces);
            for (i, &k) in reduction.kept.iter().enumerate() {
                let follow = opened.iter().zip(&gaps).map(|(&j, gap)| self.responses[(i, j)] * gap);
                q[k] += still[i] + follow.sum::<f64>();
            }
            opened.iter().zip(&gaps).for_each(|(&j, gap)| q[normal(j)] += gap);
            q.clone()
        };
        let mut q = add(&self.rest, self.offsets.select_rows(&opened));
        for _ in 0..REFINEMENTS {
            // F - K q
            let of_row = |row: usize| {
                let terms =
                    scene.stiffness.row(row).map(|(k, value)| Doubled::product(-value, q[k]));
                terms.fold(Doubled::from(scene.force[row]), Doubled::add)
            };
            let mut residual: Vec<f64> =
                reduction.kept.iter().map(|&k| of_row(k).value()).collect();
            for merge in &reduction.merges {
                let row = of_row(reduction.kept[merge.position]);
                residual[merge.position] =
                    row.add(of_row(merge.normal).times(merge.factor)).value();
            }
            let still = self.solver.solve_one(&residual);
            let normal_force = |&place: &usize| {
                let entries = scene.stiffness.row(normal(place));
                let moved =
                    entries.filter_map(|(k, value)| Some(value * still[reduction.place(k)?]));
                moved.sum::<f64>() - of_row(normal(place)).value()
            };
            let forces = DVector::from_iterator(opened.len(), opened.iter().map(normal_force));
            q = add(&still, forces);
        }
        let mut combination = self.closed.clone();
        for &place in &opened {
            let law = &scene.contacts[self.unilateral[place]];
            q[law.normal] = q[law.normal].max(law.closed());
            if law.gap_at(&q) > 0.0 {
                combination =
                    scene.with_status(&combination, self.unilateral[place], Status::Detached);
            }
        }
        let forces = scene.contacts.iter().zip(combination.statuses()).map(|(law, status)| {
            let pressed = scene.stiffness.row_dot(law.normal, &q) - scene.force[law.normal];
            if status.is_closed() { pressed.max(0.0) } else { 0.0 }
        });
        let normal_forces = forces.collect();
        let (position, velocity) = (scene.positions(&q), vec![0.0; scene.dofs]);
        Equilibrium {
            state: State {
                position,
                velocity,
                combination,
                friction_force: Vec::new(),
                internal: Vec::new(),
            },
            normal_forces,
        }
    }
}
