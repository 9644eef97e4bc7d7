//! Taylor series of a few coordinates of a scene whose neighbours are known.
//!
//! The recursion is that of `taylor/motion.rs` over the coordinates within; a rim of their neighbours enters it by the
//! coefficients of its own series.

use crate::contact::event_function::EventFunction;
use crate::contact::functional::Functional;
use crate::motion::local::locality::{Course, Locality};
use crate::motion::panel::Panel;
use crate::numerics::double_double::Doubled;
use crate::numerics::first_root::polynomial::{COEFFICIENTS, DEGREE};
use crate::scene::model::Scene;
use crate::scene::status::Status;

/// What the series may leave out, relative to the state.
const TRUNCATION: f64 = 0.1 * f64::EPSILON;
/// Coefficients of a coordinate: its velocity has one less.
pub(super) const TERMS: usize = DEGREE + 2;
/// Rounding of sparse products and of Horner's rule over the degree, twice where a series was moved to another time, in
/// halves of an ulp.
const ROUNDING: f64 = (56 + 8 * DEGREE) as f64;

/// A compressed sparse row after the other.
#[derive(Debug, Default)]
struct Rows {
    ends: Vec<usize>,
    entries: Vec<(u32, f64)>,
}

impl Rows {
    fn clear(&mut self) {
        self.ends.clear();
        self.entries.clear();
    }

    fn rows(&self) -> impl Iterator<Item = &[(u32, f64)]> {
        let mut first = 0;
        self.ends.iter().map(move |&end| &self.entries[std::mem::replace(&mut first, end)..end])
    }
}

/// The coordinates within and their rim, with buffers that serve one region after the other.
#[derive(Debug, Default)]
pub(super) struct Region {
    /// Those within first.
    pub members: Vec<usize>,
    pub within: usize,
    /// The place of each coordinate of the scene among the members.
    place: Vec<Option<u32>>,
    courses: Vec<Course>,
    springs: Rows,
    /// Where damping is not proportional; else its rows are empty.
    dampers: Rows,
    inverse_mass: Vec<f64>,
    /// Force per speed by damping proportional to mass, kg/s.
    drag: Vec<f64>,
    force: Vec<f64>,
    /// s
    pub width: f64,
    /// q of each member at the start, from which displacements count.
    pub origin: Vec<f64>,
    /// Displacements in the unit of the width, all members of one order after the other.
    pub terms: Vec<f64>,
    moved: Vec<f64>,
    speed: Vec<f64>,
    /// Absolute values of coefficients, of place and speed: constant, linear, and the sum of the others.
    sizes: [[Vec<f64>; 2]; 3],
}

impl Region {
    /// Takes these coordinates, the neighbours of all their rows as rim, and zeros for every series.
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
        self.origin.clear();
        self.origin.resize(count, 0.0);
        self.terms.clear();
        self.terms.resize(count * TERMS, 0.0);
        self.collect_rows(scene);
    }

    /// The rows of the coordinates that move freely.
    fn collect_rows(&mut self, scene: &Scene) {
        self.springs.clear();
        self.dampers.clear();
        self.inverse_mass.clear();
        self.drag.clear();
        let (alpha, _) = scene.proportional.unwrap_or_default();
        for i in 0..self.within {
            let k = self.members[i];
            let (mass, rubbed) = match self.courses[i] {
                Course::Free(rubbed) => (scene.mass.get(k, k), Some(rubbed)),
                _ => (f64::INFINITY, None),
            };
            self.inverse_mass.push(1.0 / mass);
            self.drag.push(if mass.is_finite() { alpha * mass } else { 0.0 });
            let sources =
                rubbed.into_iter().flat_map(|rubbed| std::iter::once((k, 1.0)).chain(rubbed));
            let general = scene.proportional.is_none();
            for (source, factor) in sources {
                let Self { place, courses, springs, dampers, .. } = self;
                let matrices =
                    [(&scene.stiffness, springs, true), (&scene.damping, dampers, general)];
                for (matrix, rows, _) in matrices.into_iter().filter(|matrix| matrix.2) {
                    let entries = matrix.row(source).filter_map(|(j, value)| {
                        let place = place[j]?;
                        (courses[place as usize] != Course::Closed)
                            .then_some((place, factor * value))
                    });
                    rows.entries.extend(entries);
                }
            }
            self.springs.ends.push(self.springs.entries.len());
            self.dampers.ends.push(self.dampers.entries.len());
        }
    }

    pub fn place(&self, coordinate: usize) -> Option<usize> {
        self.place[coordinate].map(|place| place as usize)
    }

    pub fn course(&self, member: usize) -> Course {
        self.courses[member]
    }

    /// Fills the series of those within from their places and speeds, which the first two orders hold.
    pub fn fill(&mut self, scene: &Scene) {
        let count = self.members.len();
        let h = self.width;
        self.balance(scene);
        self.moved.resize(count, 0.0);
        self.speed.resize(count, 0.0);
        let (_, beta) = scene.proportional.unwrap_or_default();
        for k in 0..DEGREE {
            let (known, next) = self.terms.split_at_mut((k + 2) * count);
            let (q, dq) = (&known[k * count..(k + 1) * count], &known[(k + 1) * count..]);
            let rate = (k + 1) as f64 / h;
            let factor = h * h / ((k + 1) * (k + 2)) as f64;
            for ((speed, moved), (q, dq)) in
                self.speed.iter_mut().zip(&mut self.moved).zip(q.iter().zip(dq))
            {
                *speed = rate * dq;
                *moved = q + beta * *speed;
            }
            let forced = if k == 0 { 1.0 } else { 0.0 };
            let product = |row: &[(u32, f64)], x: &[f64]| -> f64 {
                row.iter().map(|&(j, value)| value * x[j as usize]).sum()
            };
            let rows = self.springs.rows().zip(self.dampers.rows());
            let own = self.force.iter().zip(self.drag.iter().zip(&self.speed));
            let free = next.iter_mut().zip(&self.inverse_mass).zip(rows.zip(own));
            for ((next, inverse), ((springs, dampers), (force, (drag, speed)))) in free {
                if *inverse == 0.0 {
                    continue;
                }
                let damping = drag * speed + product(dampers, &self.speed);
                let force = forced * force - product(springs, &self.moved) - damping;
                *next = factor * inverse * force;
            }
        }
    }

    /// `L' (F - K q)` at the origin, in doubled precision.
    fn balance(&mut self, scene: &Scene) {
        let Self { place, origin, courses, force, members, .. } = self;
        let at = |k: usize| place[k].map_or(0.0, |place| origin[place as usize]);
        let of_row = |row: usize| {
            let terms = scene.stiffness.row(row).map(|(k, value)| Doubled::product(-value, at(k)));
            terms.fold(Doubled::from(scene.force[row]), Doubled::add)
        };
        force.clear();
        force.extend(members[..self.within].iter().zip(courses).map(
            |(&k, course)| match *course {
                Course::Free(None) => of_row(k).value(),
                Course::Free(Some((normal, factor))) => {
                    of_row(k).add(of_row(normal).times(factor)).value()
                }
                _ => 0.0,
            },
        ));
    }

    /// Norm of the k-th term of the state over those within; infinite beyond the range of numbers.
    pub fn term_norm(&self, locality: &Locality, k: usize) -> f64 {
        let count = self.members.len();
        let rate = (k + 1) as f64 / self.width;
        let of = |i: usize| {
            let place = locality.omega * self.terms[k * count + i].abs();
            let speed = rate * self.terms[(k + 1) * count + i].abs();
            if (place + speed).is_finite() {
                locality.weight[self.members[i]] * place.max(speed)
            } else {
                f64::INFINITY
            }
        };
        (0..self.within).map(of).fold(0.0, f64::max)
    }

    /// Norm of the state at the start and of what it changes by at first.
    pub fn scale(&self, locality: &Locality) -> f64 {
        let origins = self.members[..self.within].iter().zip(&self.origin);
        let origin = origins.map(|(&k, q)| locality.omega * locality.weight[k] * q.abs());
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

    /// Absolute values of the coefficients of every member.
    pub fn measure(&mut self) {
        let count = self.members.len();
        for sizes in self.sizes.iter_mut().flatten() {
            sizes.clear();
            sizes.resize(count, 0.0);
        }
        for k in 0..COEFFICIENTS {
            let (q, dq) = self.terms[k * count..(k + 2) * count].split_at(count);
            let rate = (k + 1) as f64 / self.width;
            let [of_q, of_u] = &mut self.sizes[k.min(2)];
            of_q.iter_mut().zip(q).for_each(|(size, q)| *size += q.abs());
            of_u.iter_mut().zip(dq).for_each(|(size, dq)| *size += rate * dq.abs());
        }
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
        let rounding = 0.5 * f64::EPSILON * ROUNDING;
        let place = |k: usize| self.place[k].map_or(0, |place| place as usize);
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
            let curvature = rounding * higher + left_out * locality.functional_norm(functional);
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
        let place = |k: usize| self.place[k].map_or(0, |place| place as usize);
        let position: f64 =
            functional.position.iter().map(|&(k, weight)| weight * q[place(k)]).sum();
        let velocity: f64 =
            functional.velocity.iter().map(|&(k, weight)| weight * dq[place(k)]).sum();
        position + rate * velocity
    }
}
