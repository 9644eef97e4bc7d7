//! A contact that slips in a plane: its slip, its friction force, and its masses.

use crate::contact::functional::Functional;
use crate::scene::friction::law::FrictionLaw;
use crate::scene::friction::plane::beyond_limit;

/// A contact that slips in a plane.
#[derive(Debug)]
pub(crate) struct PlaneContact {
    /// The contacts along both directions, and their tangential coordinates.
    pub contacts: [usize; 2],
    pub coordinates: [usize; 2],
    /// Speeds of the slider, m/s.
    pub slider: [f64; 2],
    /// mu N, and mu, where the normal force is one of the outputs of dense rows, with its place there; both at rest, where mu depends
    /// on the slip speed by a law.
    pub limit: Functional,
    pub friction: f64,
    pub law: Option<FrictionLaw>,
    /// What forces of elements add to `mu N`, by their places among the laws, per newton.
    pub pressed_by: Vec<(usize, f64)>,
    pub output: Option<usize>,
    pub mass: [f64; 2],
    /// The norm of the operator per unit of force.
    pub force_norm: f64,
    /// What an error of the state leaves in w along the first direction, in w along the lighter one, and in `mu N`.
    pub slip_norm: f64,
    pub speed_norm: f64,
    pub limit_norm: f64,
}

pub(super) fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

impl PlaneContact {
    /// w
    pub(super) fn slip_at(&self, u: &[f64]) -> [f64; 2] {
        [0, 1].map(|i| u[self.coordinates[i]] - self.slider[i])
    }

    /// |w|
    pub fn speed(&self, u: &[f64]) -> f64 {
        let [x, y] = self.slip_at(u);
        x.hypot(y)
    }

    /// w along and across a direction.
    pub(super) fn turned(direction: [f64; 2], w: [f64; 2]) -> [f64; 2] {
        let [x, y] = direction;
        [x * w[0] + y * w[1], x * w[1] - y * w[0]]
    }

    pub(super) fn turned_back(direction: [f64; 2], w: [f64; 2]) -> [f64; 2] {
        let [x, y] = direction;
        [x * w[0] - y * w[1], y * w[0] + x * w[1]]
    }

    /// What forces of laws add to `mu N`.
    #[inline(always)]
    pub fn pressing(&self, force: impl Fn(usize) -> f64) -> f64 {
        self.pressed_by.iter().map(|&(place, weight)| weight * force(place)).sum()
    }

    /// The friction force under a limit `mu(0) N` at slip velocities; where slip begins, by the forces R on the contact.
    pub fn friction(&self, at_rest: f64, u: &[f64], reaction: [f64; 2]) -> [f64; 2] {
        let w = self.slip_at(u);
        let speed = w[0].hypot(w[1]);
        let limit = at_rest * self.ratio_at(speed);
        let direction = match speed == 0.0 {
            true => self.departs(limit, reaction),
            false => w.map(|w| w / speed),
        };
        direction.map(|e| -limit * e)
    }

    /// How it changes along rates of the limit and of the slip velocities; not at all where slip begins.
    pub fn friction_rate(&self, [at_rest, rate]: [f64; 2], [u, du]: [&[f64]; 2]) -> [f64; 2] {
        let w = self.slip_at(u);
        let speed = w[0].hypot(w[1]);
        if speed == 0.0 {
            return [0.0; 2];
        }
        let direction = w.map(|w| w / speed);
        let [along, across] = Self::turned(direction, self.coordinates.map(|row| du[row]));
        let ratio = self.ratio_at(speed);
        let by_speed =
            self.law.as_ref().map_or(0.0, |law| along * law.slope(speed) / law.value(0.0));
        let pressing = ratio * rate + by_speed * at_rest;
        let turning = ratio * at_rest * across / speed;
        Self::turned_back(direction, [-pressing, -turning])
    }

    /// `mu / mu(0)` at a slip speed.
    pub(super) fn ratio_at(&self, speed: f64) -> f64 {
        self.law.as_ref().map_or(1.0, |law| law.value(speed) / law.value(0.0))
    }

    /// Whether its friction is below zero at the slip velocities of a state.
    pub fn is_negative_at(&self, u: &[f64]) -> bool {
        self.ratio_at(self.speed(u)) < 0.0
    }

    /// The force across a direction that accelerations along and across it take.
    pub(super) fn force_across(&self, direction: [f64; 2], [along, across]: [f64; 2]) -> f64 {
        let [_, of_across, of_both] = self.masses(direction);
        of_across * across + of_both * along
    }

    /// Masses along, across, and between both, in the frame of a direction.
    pub(super) fn masses(&self, [x, y]: [f64; 2]) -> [f64; 3] {
        let [m, n] = self.mass;
        [m * x * x + n * y * y, m * y * y + n * x * x, (n - m) * x * y]
    }

    /// The direction in which slip begins under forces R on the contact that its friction does not hold; that of R where they are at
    /// the limit.
    pub(super) fn departs(&self, limit: f64, reaction: [f64; 2]) -> [f64; 2] {
        let length = reaction[0].hypot(reaction[1]);
        let found = beyond_limit(self.mass, limit, reaction);
        found.map_or(reaction.map(|part| part / length), |(_, direction)| direction)
    }
}
