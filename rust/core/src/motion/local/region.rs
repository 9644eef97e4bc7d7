//! Taylor series of a few coordinates of a scene whose neighbours are known.
//!
//! The recursion is that of `taylor/motion.rs` over the coordinates within; a rim of their neighbours enters it by the
//! coefficients of its own series.

use crate::contact::event_function::EventFunction;
use crate::contact::functional::Functional;
use crate::motion::local::locality::{Course, Locality};
use crate::motion::local::rows::{Balance, Fill, Rows, Rubbed};
use crate::motion::panel::{Panel, rounding};
use crate::motion::series::{Largest, Sizes};
use crate::numerics::double_double::Doubled;
use crate::numerics::first_root::polynomial::{COEFFICIENTS, DEGREE};
use crate::numerics::simd::{GROUP, VectorUnit};
use crate::scene::model::Scene;
use crate::scene::status::Status;

/// What the series may leave out, relative to the state.
const TRUNCATION: f64 = 0.1 * f64::EPSILON;
/// Coefficients of a coordinate: its velocity has one less.
pub(super) const TERMS: usize = DEGREE + 2;
/// Those of sparse products and of Horner's rule over the degree, twice where a series was moved to another time.
const OPERATIONS: usize = 56 + 8 * DEGREE;
/// Those of a coefficient beside the sum of its row, where its neighbours were moved to another time.
const IN_ROW: usize = 2 * TERMS;

/// The coordinates within and their rim, with buffers that serve one region after the other.
#[derive(Debug, Default)]
pub(super) struct Region {
    /// Those within first.
    pub members: Vec<usize>,
    pub within: usize,
    /// The place of each coordinate of the scene among the members.
    place: Vec<Option<u32>>,
    courses: Vec<Course>,
    /// Of `[q + beta q', q']` of all members: of those within that move freely, or whose contact rubs on one that does.
    rows: Rows,
    rubbed: Vec<Rubbed>,
    /// Of those within; 0 of what does not move freely.
    inverse_mass: Vec<f64>,
    /// Square roots of their masses, the weights of the norm.
    weight: Vec<f64>,
    /// The weights of all members in the rounding of rows, see `TaylorOperator`.
    row_weight: Vec<f64>,
    force: Vec<f64>,
    /// s
    pub width: f64,
    /// q of each member at the start, from which displacements count.
    pub origin: Vec<f64>,
    /// Displacements in the unit of the width, all members of one order after the other.
    pub terms: Vec<f64>,
    /// Of places and then of speeds.
    moved: Vec<f64>,
    products: Vec<f64>,
    sums: Vec<Doubled>,
    /// Absolute values of coefficients, of place and speed: constant, linear, and the sum of the others.
    sizes: [[Vec<f64>; 2]; 3],
    /// A bound of the norm of what rounding of the rows leaves in the state of those within: a coefficient is rounded by a part
    /// of the terms that its row sums up, also where these cancel.
    rounded: f64,
    unit: VectorUnit,
}

impl Region {
    /// Takes these coordinates and the neighbours of all their rows as rim; series and origins are to be set.
    pub fn enclose(
        &mut self,
        scene: &Scene,
        locality: &Locality,
        statuses: &[Status],
        within: impl Iterator<Item = usize>,
    ) {
        let Self { members, place, .. } = self;
        place.resize(scene.size, None);
        members.drain(..).for_each(|k| place[k] = None);
        let mut meet = |k: usize| {
            if place[k].is_none() {
                place[k] = Some(members.len() as u32);
                members.push(k);
            }
        };
        within.for_each(&mut meet);
        self.within = self.members.len();
        for i in 0..self.within {
            let k = self.members[i];
            for matrix in [&scene.stiffness, &scene.damping] {
                for (j, _) in matrix.row(k) {
                    if self.place[j].is_none() {
                        self.place[j] = Some(self.members.len() as u32);
                        self.members.push(j);
                    }
                }
            }
        }
        let count = self.members.len();
        self.courses.clear();
        self.courses.extend(self.members.iter().map(|&k| locality.course(scene, statuses, k)));
        self.weight.clear();
        self.weight.extend(self.members[..self.within].iter().map(|&k| locality.weight[k]));
        self.row_weight.clear();
        self.row_weight.extend(self.members.iter().map(|&k| {
            let spring = scene.stiffness.get(k, k).abs().sqrt() / locality.omega;
            locality.weight[k].max(spring)
        }));
        self.origin.resize(count, 0.0);
        self.terms.resize(count * TERMS, 0.0);
        self.moved.resize(2 * count, 0.0);
        self.products.resize(self.within.next_multiple_of(GROUP), 0.0);
        self.sizes.iter_mut().flatten().for_each(|sizes| sizes.resize(count, 0.0));
        self.collect_rows(scene);
    }

    fn collect_rows(&mut self, scene: &Scene) {
        let Self { rows, rubbed, inverse_mass, members, place, courses, .. } = self;
        rubbed.clear();
        inverse_mass.clear();
        for (row, (&k, course)) in members[..self.within].iter().zip(&*courses).enumerate() {
            let is_free = matches!(course, Course::Free(_));
            inverse_mass.push(if is_free { 1.0 / scene.mass.get(k, k) } else { 0.0 });
            if let Course::Free(Some((normal, factor))) = *course {
                let normal = place[normal].expect("both coordinates of a contact") as usize;
                rubbed.push(Rubbed { row, normal, factor });
            }
        }
        let mut is_needed: Vec<bool> = inverse_mass.iter().map(|&inverse| inverse > 0.0).collect();
        rubbed.iter().for_each(|rubbed| is_needed[rubbed.normal] = true);
        let (alpha, _) = scene.proportional.unwrap_or_default();
        let speeds = members.len() as u32;
        rows.clear();
        for (row, &k) in members[..self.within].iter().enumerate() {
            let entry = |(j, value): (usize, f64)| {
                let place = place[j]?;
                (courses[place as usize] != Course::Closed).then_some((place, value))
            };
            let springs = scene.stiffness.row(k).filter_map(entry);
            let general = scene.proportional.is_none().then(|| scene.damping.row(k));
            let drag = (alpha != 0.0).then(|| (k, alpha * scene.mass.get(k, k)));
            let dampers = general.into_iter().flatten().chain(drag).filter_map(entry);
            let dampers = dampers.map(|(place, value)| (speeds + place, value));
            rows.push(springs.chain(dampers).filter(|_| is_needed[row]));
        }
    }

    pub fn place(&self, coordinate: usize) -> Option<usize> {
        self.place[coordinate].map(|place| place as usize)
    }

    /// The place of a coordinate of an event function, whose contact the region encloses.
    fn place_within(&self, coordinate: usize) -> usize {
        self.place(coordinate).unwrap_or_else(|| unreachable!("{coordinate} is not in the region"))
    }

    pub fn course(&self, member: usize) -> Course {
        self.courses[member]
    }

    /// Fills the series of those within from their places and speeds, which the first two orders hold.
    pub fn fill(&mut self, scene: &Scene) {
        self.balance(scene);
        let (_, beta) = scene.proportional.unwrap_or_default();
        let Self { rows, rubbed, inverse_mass, force, width, terms, moved, products, .. } = self;
        let (width, count) = (*width, self.members.len());
        self.unit.run(Fill {
            rows,
            rubbed,
            inverse_mass,
            force,
            beta,
            width,
            count,
            terms,
            moved,
            products,
        });
    }

    /// `L' (F - K q)` at the origin, in doubled precision.
    fn balance(&mut self, scene: &Scene) {
        let Self { rows, rubbed, origin, force, members, moved, sums, unit, .. } = self;
        let (places, speeds) = moved.split_at_mut(origin.len());
        places.copy_from_slice(origin);
        speeds.fill(0.0);
        sums.clear();
        sums.extend(members[..self.within].iter().map(|&k| Doubled::from(scene.force[k])));
        unit.run(Balance { rows, x: moved, sums });
        for &Rubbed { row, normal, factor } in &*rubbed {
            sums[row] = sums[row].add(sums[normal].times(factor));
        }
        force.clear();
        force.extend(sums.iter().map(|sum| sum.value()));
    }

    /// Norm of the k-th term of the state over those within; infinite beyond the range of numbers.
    pub fn term_norm(&self, locality: &Locality, k: usize) -> f64 {
        let count = self.members.len();
        let (q, u) = self.terms[k * count..(k + 2) * count].split_at(count);
        let rate = (k + 1) as f64 / self.width;
        self.unit.run(Largest { weight: &self.weight, q, u, factors: [locality.omega, rate] })
    }

    /// Norm of the state at the start and of what it changes by at first.
    pub fn scale(&self, locality: &Locality) -> f64 {
        let origins = self.weight.iter().zip(&self.origin);
        let origin = origins.map(|(weight, q)| locality.omega * weight * q.abs());
        (0..2).map(|k| self.term_norm(locality, k)).fold(origin.fold(0.0, f64::max), f64::max)
    }

    /// Shortens the series until they leave out at most rounding of a motion of this scale; the bound of what they do.
    pub fn shorten(&mut self, locality: &Locality, scale: f64) -> f64 {
        let left_out = |region: &Self| {
            locality.tail(region.width, COEFFICIENTS) * region.term_norm(locality, DEGREE)
        };
        let tail = left_out(self);
        if tail <= TRUNCATION * scale || !tail.is_finite() {
            return tail;
        }
        let factor = (TRUNCATION * scale / tail).powf(1.0 / COEFFICIENTS as f64);
        self.width *= factor;
        let mut power = 1.0;
        for terms in self.terms.chunks_exact_mut(self.members.len()) {
            terms.iter_mut().for_each(|term| *term *= power);
            power *= factor;
        }
        left_out(self)
    }

    /// Absolute values of the coefficients of every member, and what rounding of the rows leaves in the state.
    pub fn measure(&mut self, locality: &Locality) {
        let Self { terms, sizes, width, unit, row_weight, .. } = self;
        let rates = std::array::from_fn(|k| (k + 1) as f64 / *width);
        unit.run(Sizes { terms, n: self.members.len(), rates, sizes });
        let size = |[q, u]: &[Vec<f64>; 2]| {
            unit.run(Largest { weight: row_weight, q, u, factors: [locality.omega, 1.0] })
        };
        let reach = locality.sigma * *width;
        let operations = 2 * self.rows.longest() + IN_ROW;
        self.rounded = rounding(operations, 0) * reach * sizes.iter().map(size).sum::<f64>();
    }

    /// Fills a panel with event functions of contacts within; `left_out` bounds the norm of what the motion leaves out.
    pub fn expand(
        &self,
        locality: &Locality,
        functions: &[EventFunction],
        left_out: f64,
        panel: &mut Panel,
    ) {
        panel.reset(self.width, functions.len());
        let off = left_out + self.rounded;
        let rounding = rounding(OPERATIONS, 0);
        let place = |k: usize| self.place_within(k);
        let sum = |functional: &Functional, [of_q, of_u]: &[Vec<f64>; 2]| -> f64 {
            let of = |terms: &[(usize, f64)], sizes: &[f64]| -> f64 {
                terms.iter().map(|&(k, weight)| weight.abs() * sizes[place(k)]).sum()
            };
            of(&functional.position, of_q) + of(&functional.velocity, of_u)
        };
        let [first, second, others] = &self.sizes;
        for (index, EventFunction { functional, .. }) in functions.iter().enumerate() {
            let terms =
                functional.position.iter().map(|&(k, weight)| weight * self.origin[place(k)]);
            let constant = [functional.constant, functional.constant.abs()];
            let [at_origin, size] =
                terms.fold(constant, |[sum, size], term| [sum + term, size + term.abs()]);
            let (higher, linear) = (sum(functional, others), sum(functional, second));
            let curvature = rounding * higher + off * locality.functional_norm(functional);
            let error = rounding * (size + sum(functional, first) + linear) + curvature;
            panel.error[index] = error;
            panel.curvature_error[index] = curvature;
            let start = at_origin + self.coefficient(functional, 0);
            panel.excluded[index] = start - linear - higher > error;
            if panel.excluded[index] {
                continue;
            }
            let mut lowest = start;
            for k in 1..COEFFICIENTS {
                let coefficient = self.coefficient(functional, k);
                panel.row(index)[k] = coefficient;
                lowest += coefficient.min(0.0);
            }
            panel.row(index)[0] = start;
            panel.excluded[index] = lowest > error;
        }
    }

    /// The coefficient of order k of a functional, without its value at the origin.
    fn coefficient(&self, functional: &Functional, k: usize) -> f64 {
        let count = self.members.len();
        let (q, dq) = self.terms[k * count..(k + 2) * count].split_at(count);
        let rate = (k + 1) as f64 / self.width;
        let place = |k: usize| self.place_within(k);
        let position: f64 =
            functional.position.iter().map(|&(k, weight)| weight * q[place(k)]).sum();
        let velocity: f64 =
            functional.velocity.iter().map(|&(k, weight)| weight * dq[place(k)]).sum();
        position + rate * velocity
    }
}
