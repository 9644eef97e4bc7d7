//! Contacts with a state z of their own, under a normal force N: bristles, or two formulas of a user,
//!
//! ```text
//! T = -N force(s, z),   z' = rate(s, z),   s = t . x' - v
//! ```
//!
//! z is the velocity of a hidden coordinate p, `p' = c z`, with a mass m, so that z is integrated, bounded and followed as every
//! velocity is; the place of p means nothing. The factor c makes z as large as a velocity: where `f = N |d force / d z|` and
//! `g = |d rate / d s|`, at rest or in steady slip, small motions of t and p feel each other alike with `c^2 = f / (m g)`. Bristles have `f = N sigma_0`,
//! `g = 1`, and the kinetic energy of p is then what they store. A formula may jump as slip turns neither in force nor in rate;
//! where it has a kink there, as `abs(s)` has, the phase ends, so that both are analytic within a phase. Loops have pieces over z:
//! where z comes to the border of two, a panel ends.
//!
//! The normal force of a contact with a normal direction is a reaction, affine in the state: `force(s, z) N` is a product of two series
//! then, and T depends on N in every transition and mode as a sliding friction force does, with `mu = force sgn s`. The contact
//! opens where N = 0. While it is open its state is zero, as that of a new contact is: unloaded bristles are straight (Cundall and
//! Strack, Geotechnique 29 (1979) 47; Canudas de Wit and others, Vehicle System Dynamics 39 (2003) 189, where they enter the patch). An impact
//! takes no time and leaves the state alone.

use std::sync::Arc;

use crate::error::input::Error;
use crate::numerics::bracket::Bracket;
use crate::scene::friction::bristles::{Bristles, Hysteresis};
use crate::scene::friction::formula::{Formula, GivenOperation};
use crate::scene::friction::law::{FrictionLaw, Pieces, piece_at};
use crate::scene::status::Status;

/// What the friction of a contact with a state follows.
#[derive(Debug, Clone, PartialEq)]
pub enum ContactState {
    /// Bristles with their numbers.
    Bristles(Bristles),
    /// Force and rate as formulas.
    Formulas(Arc<StateFormulas>),
}

/// The friction force per normal force over slip velocity and state, and the rate of the state, for slip in the positive and in
/// the negative direction.
#[derive(Debug, PartialEq)]
pub struct StateFormulas([InDirection; 2]);

/// Force and rate for slip in one direction.
#[derive(Debug, PartialEq)]
pub(crate) struct InDirection {
    /// States from which pieces hold, ascending, the first one also below; empty where one piece holds everywhere. Force and rate
    /// do not jump from one to the next.
    pub knots: Vec<f64>,
    /// Force and rate by piece.
    pub pieces: Vec<[Arc<Formula>; 2]>,
}

impl InDirection {
    /// From the operations of force and rate by piece.
    fn new(
        knots: Vec<f64>,
        given: &[[Vec<GivenOperation>; 2]],
        direction: f64,
    ) -> Result<Self, Error> {
        let of = |given: &[GivenOperation]| Formula::in_direction(given, direction).map(Arc::new);
        let both = |[force, rate]: &[Vec<GivenOperation>; 2]| Ok([of(force)?, of(rate)?]);
        Ok(Self { knots, pieces: given.iter().map(both).collect::<Result<_, Error>>()? })
    }

    /// Force and rate at a state.
    pub(crate) fn at(&self, state: f64) -> &[Arc<Formula>; 2] {
        &self.pieces[piece_at(&self.knots, state)]
    }

    /// Force and rate as laws of the slip speed and the state.
    pub(crate) fn laws(&self) -> [FrictionLaw; 2] {
        [0, 1].map(|place| {
            let mut laws =
                self.pieces.iter().map(|both| FrictionLaw::Formula(both[place].clone())).collect();
            match self.knots.is_empty() {
                true => Vec::swap_remove(&mut laws, 0),
                false => FrictionLaw::Pieces(Arc::new(Pieces { knots: self.knots.clone(), laws })),
            }
        })
    }
}

/// Powers of ten, up and down, between which the state of steady slip is sought.
const DECADES: i32 = 30;
/// Difference of the two directions, relative to the values, that is no jump where slip turns.
const JOINED: f64 = 1e-12;
/// Part of its values at the ends of a bracket that the rate may have at its root: a pole has none.
const VANISHES: f64 = 1e-6;

impl StateFormulas {
    /// From the operations of both, as for [`FrictionLaw::formula`]; `state` is z, and `direction` the sign of s.
    pub fn new(force: &[GivenOperation], rate: &[GivenOperation]) -> Result<Self, Error> {
        let given = [[force.to_vec(), rate.to_vec()]];
        let of = |direction| InDirection::new(Vec::new(), &given, direction);
        Ok(Self([of(1.0)?, of(-1.0)?]))
    }

    /// Those of bristles.
    fn of_bristles(numbers: &Bristles) -> Result<Self, Error> {
        let of = |direction| {
            let (knots, given) = numbers.as_formulas(direction);
            InDirection::new(knots, &given, direction)
        };
        Ok(Self([of(1.0)?, of(-1.0)?]))
    }

    /// Force and rate in a status.
    pub(crate) fn in_status(&self, status: Status) -> &InDirection {
        self.along(-status.friction_sign())
    }

    /// The same for slip in a direction.
    fn along(&self, slip: f64) -> &InDirection {
        &self.0[usize::from(slip < 0.0)]
    }

    /// Force and rate at a slip velocity and a state, each with its slopes over s and z.
    fn at(&self, slip: f64, state: f64) -> [(f64, [f64; 2]); 2] {
        self.along(slip).at(state).each_ref().map(|formula| {
            let (value, [by_speed, by_state]) = formula.with_slopes(slip.abs(), state);
            (value, [by_speed * 1.0_f64.copysign(slip), by_state])
        })
    }

    /// The state of steady slip: the one at which the rate falls through zero. None where there is none, or more than one.
    pub(crate) fn steady(&self, slip: f64) -> Option<f64> {
        let rate = |state: f64| {
            let (value, [_, slope]) = self.at(slip, state)[1];
            (value, slope)
        };
        let above = (-DECADES..=DECADES).map(|power| 10.0_f64.powi(power));
        let below = above.clone().rev().map(|state| -state);
        let states: Vec<(f64, f64)> =
            below.chain([0.0]).chain(above).map(|state| (state, rate(state).0)).collect();
        let falls = states.windows(2).filter(|pair| pair[0].1 > 0.0 && pair[1].1 <= 0.0);
        let mut roots = falls.filter_map(|pair| {
            let [(low, first), (high, second)] = [pair[0], pair[1]];
            let root = Bracket { low, high }.root([first, second], 0.0, rate);
            (rate(root).0.abs() <= VANISHES * first.max(-second)).then_some(root)
        });
        let root = roots.next()?;
        roots.next().is_none().then_some(root)
    }

    /// Refuses formulas that jump as slip turns, and a slider speed at which there is no steady slip.
    fn validate(&self, contact: usize, slider_speed: f64) -> Result<(), Error> {
        let refused = |reason: String| Err(Error::StateFormulas { contact, reason });
        let steady = match slider_speed {
            0.0 => 0.0,
            speed => match self.steady(-speed) {
                Some(state) => state,
                None => {
                    return refused(format!(
                        "the rate must fall through zero at one state z at the slip velocity {:e} m/s",
                        -speed
                    ));
                }
            },
        };
        for state in [0.0, steady, -steady] {
            let [of_forth, of_back] = self.0.each_ref().map(|of| of.at(state));
            for (name, place) in [("force", 0), ("rate", 1)] {
                let [forth, back] =
                    [of_forth, of_back].map(|both| both[place].with_slopes(0.0, state).0);
                if (forth - back).abs() > JOINED * (forth.abs() + back.abs()) {
                    return refused(format!(
                        "the {name} must not jump as slip turns, got {forth:e} and {back:e} at z = {state:e}"
                    ));
                }
            }
        }
        Ok(())
    }
}

impl ContactState {
    /// Whether it is that of a spring in a plane, see [`crate::scene::friction::elastic_plane`].
    pub(crate) const fn is_spring(&self) -> bool {
        matches!(self, Self::Bristles(Bristles { hysteresis: Some(Hysteresis::Plane), .. }))
    }

    /// The law where the normal force changes: force and rate as formulas, but of a spring.
    pub(crate) fn pressed(&self) -> Result<Self, Error> {
        Ok(match self {
            spring if spring.is_spring() => spring.clone(),
            Self::Bristles(numbers) => {
                Self::Formulas(Arc::new(StateFormulas::of_bristles(numbers)?))
            }
            Self::Formulas(_) => self.clone(),
        })
    }

    pub(crate) fn validate(&self, contact: usize, slider_speed: f64) -> Result<(), Error> {
        match self {
            Self::Bristles(numbers) => numbers.validate(contact),
            Self::Formulas(formulas) => formulas.validate(contact, slider_speed),
        }
    }

    /// What stands for a law of the slip speed: `sigma_0 h`, or the force.
    pub(crate) fn law(&self) -> Result<FrictionLaw, Error> {
        match self {
            Self::Bristles(numbers) => numbers.law(),
            Self::Formulas(formulas) => {
                Ok(FrictionLaw::Formula(formulas.0[0].pieces[0][0].clone()))
            }
        }
    }

    /// The state of steady slip at a slip velocity; NaN where there is none.
    pub(crate) fn steady(&self, slip: f64) -> f64 {
        match self {
            Self::Bristles(numbers) => {
                (numbers.of_steady_slip(slip) / numbers.stiffness).copysign(slip)
            }
            Self::Formulas(formulas) => formulas.steady(slip).unwrap_or(f64::NAN),
        }
    }

    /// c, beside a mass that the contact feels along its slip.
    pub(crate) fn scale(&self, normal_force: f64, felt: f64, slider_speed: f64) -> f64 {
        let formulas = match self {
            Self::Bristles(numbers) => return (normal_force * numbers.stiffness / felt).sqrt(),
            Self::Formulas(formulas) => formulas,
        };
        let of = |slip: f64, state: f64| {
            let [(_, [_, by_state]), (_, [by_slip, _])] = formulas.at(slip, state);
            (normal_force / felt * (by_state / by_slip).abs()).sqrt()
        };
        // Slip bends what holds it most at rest; in steady slip a state may not depend on the speed.
        let candidates = [of(0.0, 0.0), of(-slider_speed, self.steady(-slider_speed))];
        let usable = |scale: &f64| *scale > 0.0 && scale.is_finite();
        candidates.into_iter().find(usable).unwrap_or(1.0)
    }
}

/// The state of one contact of a scene, in contact coordinates.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct StateContact {
    pub law: ContactState,
    /// The given one, N; where it changes, one of its size, or of a spring in a plane 1 N.
    pub normal_force: f64,
    /// The coordinate whose reaction it is, where it changes.
    pub normal: Option<usize>,
    /// p
    pub coordinate: usize,
    /// m
    pub mass: f64,
    /// c
    pub scale: f64,
    /// t
    pub tangential: usize,
}

/// What a contact with a state does in a state of its scene.
pub(crate) struct InState {
    /// T, N, and the rate of the energy that bristles store, W.
    pub friction: f64,
    pub stored: f64,
    /// What is linear in the velocities, as (row, column, entry of C), and what is constant, as (row, force).
    pub damping: Vec<(usize, usize, f64)>,
    pub force: Vec<(usize, f64)>,
    /// N times the slip speed, W, where this is not that of the body.
    pub wear: Option<f64>,
}

impl StateContact {
    /// That of a contact with a tangential coordinate and a slider, from p and its mass, and from the coordinate whose reaction is
    /// the normal force, where this changes, and the normal force at x = 0, whose size makes the scale.
    pub fn new(
        state: &ContactState,
        (tangential, slider_speed): (usize, f64),
        (coordinate, mass): (usize, f64),
        (normal, normal_force): (Option<usize>, f64),
    ) -> Result<Self, Error> {
        let scale = state.scale(normal_force, mass, slider_speed);
        let scale = if scale > 0.0 { scale } else { 1.0 };
        let law = if normal.is_some() { state.pressed()? } else { state.clone() };
        Ok(Self { law, normal_force, normal, coordinate, mass, scale, tangential })
    }

    /// The velocity that is z, with its weight.
    pub fn as_velocity(&self) -> (usize, f64) {
        (self.coordinate, 1.0 / self.scale)
    }

    pub fn state_in(&self, u: &[f64]) -> f64 {
        u[self.coordinate] / self.scale
    }

    /// Whether small motions about steady slip are known by a law of the slip speed or of the deflection alone.
    pub fn has_plain_bristles(&self) -> bool {
        matches!(&self.law, ContactState::Bristles(numbers) if numbers.hysteresis.is_none())
    }

    /// The number of forces that its law gives.
    pub const fn forces(&self) -> usize {
        match self.law {
            ref law if law.is_spring() => 3 + self.normal.is_some() as usize,
            ContactState::Bristles(_) => 1,
            ContactState::Formulas(_) => 2,
        }
    }

    /// The forces over contact coordinates per unit of what the law gives: of bristles both of y, else of force and of rate.
    pub fn directions(&self) -> [(usize, f64); 2] {
        let [along, hidden] = match &self.law {
            ContactState::Bristles(Bristles { stiffness, damping, .. }) => {
                [damping * self.normal_force, -self.normal_force * stiffness / self.scale]
            }
            ContactState::Formulas(_) => {
                let per_newton = if self.normal.is_some() { 1.0 } else { self.normal_force };
                [-per_newton, self.mass * self.scale]
            }
        };
        [(self.tangential, along), (self.coordinate, hidden)]
    }

    /// The stiffness of bristles, or of the spring of a contact in a plane, N/m; a formula has none.
    pub fn spring(&self) -> f64 {
        match &self.law {
            ContactState::Bristles(numbers) => self.normal_force * numbers.stiffness,
            ContactState::Formulas(_) => 0.0,
        }
    }

    /// p' where z is given.
    pub fn rate_of(&self, state: f64) -> f64 {
        state * self.scale
    }

    /// `mu` of `T = sigma mu N`, where N changes, in a status; 0 of an open contact.
    pub fn friction_in(&self, status: Status, slider_speed: f64, u: &[f64]) -> f64 {
        let ContactState::Formulas(formulas) = &self.law else { return 0.0 };
        if !status.is_sliding() {
            return 0.0;
        }
        let speed = (u[self.tangential] - slider_speed).abs();
        let state = self.state_in(u);
        let [force, _] = formulas.in_status(status).at(state);
        -status.friction_sign() * force.with_slopes(speed, state).0
    }

    /// p' of steady slip.
    pub fn steady_rate(&self, slip: f64) -> f64 {
        self.law.steady(slip) * self.scale
    }

    /// z less what it is in steady sliding with a status.
    pub fn deviation(&self, status: Status, slider_speed: f64, u: &[f64]) -> f64 {
        self.state_in(u) + status.friction_sign() * self.law.steady(slider_speed.abs())
    }

    /// The force per unit of y in small motions, in which the deflection itself is the displacement of its coordinate.
    pub fn directions_in_small_motions(&self) -> [(usize, f64); 2] {
        let [along, (hidden, force)] = self.directions();
        [along, (hidden, force * self.scale)]
    }

    /// The coefficient of friction of steady slip, `g + sigma_2 |s|` or the force.
    pub fn steady_friction(&self, slip: f64) -> f64 {
        match &self.law {
            ContactState::Bristles(numbers) => {
                numbers.of_steady_slip(slip) + numbers.viscous * slip.abs()
            }
            ContactState::Formulas(formulas) => {
                let state = if slip == 0.0 { 0.0 } else { self.law.steady(slip) };
                formulas.at(slip, state)[0].0 * 1.0_f64.copysign(slip)
            }
        }
    }

    pub fn in_state(&self, law: &FrictionLaw, slider_speed: f64, u: &[f64]) -> InState {
        let slip = u[self.tangential] - slider_speed;
        let z = self.state_in(u);
        match &self.law {
            ContactState::Bristles(numbers) => {
                self.of_bristles(numbers, law, slider_speed, slip, z)
            }
            ContactState::Formulas(formulas) => {
                let [force, rate] = formulas.at(slip, z).map(|of| of.0);
                let [(t, along), (p, hidden)] = self.directions();
                // Where N changes, the friction force is that of a coefficient.
                let friction = if self.normal.is_some() { 0.0 } else { along * force };
                InState {
                    friction,
                    stored: 0.0,
                    damping: Vec::new(),
                    force: vec![(t, friction), (p, hidden * rate)],
                    wear: None,
                }
            }
        }
    }

    /// y is `factor u_k + constant` in one state.
    fn of_bristles(
        &self,
        numbers: &Bristles,
        law: &FrictionLaw,
        slider_speed: f64,
        slip: f64,
        z: f64,
    ) -> InState {
        let &Bristles { stiffness, damping, viscous, hysteresis, .. } = numbers;
        let (k, factor, constant, y) = match hysteresis {
            None => {
                let factor = law.value(slip.abs());
                (self.coordinate, factor / self.scale, 0.0, factor * z)
            }
            Some(hysteresis) => {
                let status = if slip > 0.0 { Status::Negative } else { Status::Positive };
                let law = numbers.loop_in(status, hysteresis);
                let factor = -status.friction_sign() * law.value(z);
                (self.tangential, factor, -factor * slider_speed, factor * slip)
            }
        };
        let rate = slip - y;
        let along = stiffness * z + damping * rate + viscous * slip;
        let directions = self.directions();
        InState {
            friction: -self.normal_force * along,
            stored: self.normal_force * stiffness * z * rate,
            damping: directions.map(|(row, weight)| (row, k, -weight * factor)).to_vec(),
            force: directions.map(|(row, weight)| (row, weight * constant)).to_vec(),
            wear: None,
        }
    }

    /// The linear terms that bristles add to C, as (row, column, entry).
    pub fn linear_terms(&self) -> Vec<(usize, usize, f64)> {
        let ContactState::Bristles(Bristles { stiffness, damping, viscous, .. }) = self.law else {
            return Vec::new();
        };
        let (t, p) = (self.tangential, self.coordinate);
        let coupling = self.normal_force * stiffness / self.scale;
        vec![(t, t, self.normal_force * (damping + viscous)), (t, p, coupling), (p, t, -coupling)]
    }

    /// What small motions about steady slip add to C and to K, as (row, column, entry), where the state itself is the displacement
    /// of its coordinate, which has no mass then. With the perturbations s and z, and `y = a z + b s` of bristles,
    ///
    /// ```text
    /// row t:   N (sigma_0 z + sigma_1 z' + sigma_2 s)      N (force_s s + force_z z)
    /// row p:   N sigma_0 (z' - s + a z + b s)              N (z' - rate_s s - rate_z z)
    /// ```
    ///
    /// `a = sigma_0 h, b = g h'` or, as f(z) is sgn s there, `a = n sigma_0 |s| / kinetic, b = 1`.
    ///
    /// A change of N adds `force_0 dN` to the row t, as that of a constant coefficient.
    pub fn tangents(
        &self,
        law: &FrictionLaw,
        slip: f64,
        pressed: f64,
    ) -> [Vec<(usize, usize, f64)>; 2] {
        let (t, p) = (self.tangential, self.coordinate);
        let numbers = match &self.law {
            ContactState::Bristles(numbers) => numbers,
            ContactState::Formulas(formulas) => {
                let state = if slip == 0.0 { 0.0 } else { self.law.steady(slip) };
                let [force, rate] = formulas.at(slip, state).map(|of| of.1);
                return [
                    vec![(t, t, pressed * force[0]), (p, p, pressed), (p, t, -pressed * rate[0])],
                    vec![(t, p, pressed * force[1]), (p, p, -pressed * rate[1])],
                ];
            }
        };
        let Bristles { stiffness, damping, viscous, kinetic, hysteresis, .. } = *numbers;
        let (force, speed) = (pressed * stiffness, slip.abs());
        let [a, b] = match hysteresis {
            None => {
                let deflection = numbers.of_steady_slip(speed) / stiffness;
                [law.value(speed), deflection * law.slope(speed)]
            }
            Some(shape) => [shape.exponent() * stiffness * speed / kinetic, 1.0],
        };
        // A slider at rest bends no bristles.
        let b = if speed == 0.0 { 0.0 } else { b };
        let rates = vec![
            (t, t, pressed * viscous),
            (t, p, pressed * damping),
            (p, p, force),
            (p, t, force * (b - 1.0)),
        ];
        [rates, vec![(t, p, force), (p, p, force * a)]]
    }
}
