//! Friction of bristles: contacts with a state of their own (LuGre, Dahl and Bouc-Wen).
//!
//! Under a given normal force N the bristles of a contact have a mean deflection z, and with the slip velocity
//! `s = t . x' - v` (Canudas de Wit, Olsson, Astrom and Lischinsky, IEEE Trans. Automatic Control 40 (1995) 419, per unit
//! normal force; Dahl, AIAA Journal 14 (1976) 1675, where g is constant and sigma_1 and sigma_2 are zero)
//!
//! ```text
//! z' = s - sigma_0 h(|s|) z,   h(|s|) = |s| / g(|s|),   g = kinetic + (static - kinetic) e^{-(s / speed)^2}
//! T = -N (sigma_0 z + sigma_1 z' + sigma_2 s)
//! ```
//!
//! Bouc-Wen (Bouc, 4th Conference on Nonlinear Oscillation, Prague 1967; Wen, J. Eng. Mech. 102 (1976) 249) lets the loop turn in
//! another shape, with an exponent n from 1 to 3 and a part beta of the loss that is undone as slip turns:
//!
//! ```text
//! z' = s - |s| f(z),   f = (sigma_0 |z| / kinetic)^n (beta sgn z + (1 - beta) sgn s)
//! ```
//!
//! For each sign of s, f is a table of two cubic pieces. Both are `z' = s - y` with a product y of a law and a functional of the
//! state, `sigma_0 h(|s|)` and z, or f(z) and |s|.
//!
//! The deflection is the velocity of a hidden coordinate p, `p' = c z`, with the mass `N sigma_0 / c^2`. The kinetic energy of
//! p is then the energy `N sigma_0 z^2 / 2` that the bristles store, and all but one product of the equations is linear:
//!
//! ```text
//! row t:   + N (sigma_1 + sigma_2) (t . x' - v) + N sigma_0 z        = ... + N sigma_1 y
//! row p:   N sigma_0 / c^2 p'' - N sigma_0 / c (t . x' - v)          =     - N sigma_0 / c y
//! ```
//!
//! The coupling of t and p is skew-symmetric, and c is such that p has the mass that the contact feels along t. |s| is not
//! analytic at s = 0, which is an event; the place of p means nothing.

use std::sync::Arc;

use crate::error::input::Error;
use crate::scene::friction::law::{FrictionLaw, Table};
use crate::scene::status::Status;

/// The numbers of the bristles of a contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bristles {
    /// sigma_0, friction force per normal force and deflection, 1/m, positive.
    pub stiffness: f64,
    /// sigma_1, friction force per normal force and rate of the deflection, s/m, not negative.
    pub damping: f64,
    /// sigma_2, friction force per normal force and slip velocity, s/m, not negative.
    pub viscous: f64,
    /// Coefficient of friction of steady slip at large speeds without its viscous part, -, positive.
    pub kinetic: f64,
    /// The same at vanishing speed, -, positive.
    pub at_rest: f64,
    /// Scale of the speed over which it passes from one to the other, m/s, positive.
    pub speed: f64,
    /// The loop of Bouc-Wen, where it is that one; `at_rest` is then `kinetic`.
    pub hysteresis: Option<Hysteresis>,
}

/// The shape of a loop of Bouc-Wen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hysteresis {
    /// n, 1, 2 or 3.
    pub exponent: usize,
    /// beta, -, from 0 to 1: 1 unloads along the slope at z = 0, 0.5 elastically.
    pub share: f64,
}

impl Bristles {
    pub(crate) fn validate(&self, contact: usize) -> Result<(), Error> {
        let checks = [
            ("stiffness", self.stiffness, "> 0", self.stiffness > 0.0),
            ("damping", self.damping, ">= 0", self.damping >= 0.0),
            ("viscous", self.viscous, ">= 0", self.viscous >= 0.0),
            ("kinetic", self.kinetic, "> 0", self.kinetic > 0.0),
            ("static", self.at_rest, "> 0", self.at_rest > 0.0),
            ("speed", self.speed, "> 0", self.speed > 0.0),
        ];
        let shape = self.hysteresis.map(|Hysteresis { exponent, share }| {
            let exponent = exponent as f64;
            [
                ("exponent", exponent, "1, 2 or 3", (1.0..=3.0).contains(&exponent)),
                ("share", share, "in [0, 1]", (0.0..=1.0).contains(&share)),
            ]
        });
        let checks = checks.into_iter().chain(shape.into_iter().flatten());
        for (name, value, requirement, holds) in checks {
            if !(holds && value.is_finite()) {
                return Err(Error::Range {
                    argument: format!("contact {contact}: friction: {name}"),
                    requirement: if value.is_finite() { requirement } else { "finite" },
                    value,
                });
            }
        }
        Ok(())
    }

    /// f over z in a status, `sum c_k (z - z_i)^k` from `z_i = -kinetic / sigma_0` and from 0 on.
    pub(crate) fn loop_in(
        &self,
        status: Status,
        Hysteresis { exponent, share }: Hysteresis,
    ) -> FrictionLaw {
        let extent = self.kinetic / self.stiffness;
        // (beta sgn z + (1 - beta) sgn s) |z / extent|^n on either side of 0; a status has the sign of -s.
        let turned = (1.0 - share) * -status.friction_sign();
        let [below, above] = [turned - share, turned + share];
        let mut far = [0.0; 4];
        let mut near = [0.0; 4];
        near[exponent] = above / extent.powi(exponent as i32);
        // |z| = extent - (z - z_i)
        let binomial = [[1.0, 1.0, 0.0, 0.0], [1.0, 2.0, 1.0, 0.0], [1.0, 3.0, 3.0, 1.0]];
        for (k, far) in far.iter_mut().enumerate() {
            *far = below * binomial[exponent - 1][k] * (-1.0 / extent).powi(k as i32);
        }
        let speeds = vec![-extent, 0.0];
        FrictionLaw::Tabulated(Arc::new(Table { speeds, pieces: vec![far, near] }))
    }

    /// `sigma_0 h` over |s|.
    pub(crate) fn law(&self) -> Result<FrictionLaw, Error> {
        if self.at_rest == self.kinetic {
            let slope = self.stiffness / self.kinetic;
            return Ok(FrictionLaw::Linear { at_rest: 0.0, slope });
        }
        let operation =
            |name: &str, first, second, number| (name.to_owned(), first, second, number);
        FrictionLaw::formula(&[
            operation("constant", 0, 0, -1.0 / (self.speed * self.speed)),
            operation("multiply", 0, 0, 0.0),
            operation("multiply", 1, 2, 0.0),
            operation("exp", 3, 0, 0.0),
            operation("constant", 0, 0, (self.at_rest - self.kinetic) / self.stiffness),
            operation("multiply", 4, 5, 0.0),
            operation("constant", 0, 0, self.kinetic / self.stiffness),
            operation("add", 6, 7, 0.0),
            operation("divide", 0, 8, 0.0),
        ])
    }

    /// g
    pub(crate) fn of_steady_slip(&self, speed: f64) -> f64 {
        let part = (-(speed / self.speed).powi(2)).exp();
        self.kinetic + (self.at_rest - self.kinetic) * part
    }
}

/// The bristles of one contact of a scene, in contact coordinates.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct BristleContact {
    pub numbers: Bristles,
    pub normal_force: f64,
    /// p
    pub coordinate: usize,
    /// c
    pub scale: f64,
    /// t
    pub tangential: usize,
}

impl BristleContact {
    /// The velocity that is z, with its weight.
    pub fn deflection(&self) -> (usize, f64) {
        (self.coordinate, 1.0 / self.scale)
    }

    pub fn deflection_in(&self, u: &[f64]) -> f64 {
        u[self.coordinate] / self.scale
    }

    /// The force over contact coordinates per unit of y.
    pub fn direction(&self) -> [(usize, f64); 2] {
        let Bristles { stiffness, damping, .. } = self.numbers;
        [
            (self.tangential, self.normal_force * damping),
            (self.coordinate, -self.normal_force * stiffness / self.scale),
        ]
    }

    /// The force of the springs of the bristles on the structure, `-N sigma_0 z`.
    pub fn spring_force(&self, u: &[f64]) -> f64 {
        -self.normal_force * self.numbers.stiffness * self.deflection_in(u)
    }

    /// |z| in steady slip at a speed.
    pub fn steady_deflection(&self, speed: f64) -> f64 {
        self.numbers.of_steady_slip(speed) / self.numbers.stiffness
    }

    /// z less what it is in steady sliding with a status.
    pub fn deviation(&self, status: Status, slider_speed: f64, u: &[f64]) -> f64 {
        self.deflection_in(u) + status.friction_sign() * self.steady_deflection(slider_speed.abs())
    }

    /// The force per unit of y in small motions, in which the deflection itself is the displacement of its coordinate.
    pub fn direction_in_small_motions(&self) -> [(usize, f64); 2] {
        let [along, (hidden, force)] = self.direction();
        [along, (hidden, force * self.scale)]
    }

    /// This force in steady slip.
    pub fn steady_spring_force(&self, slip: f64) -> f64 {
        -self.normal_force * self.numbers.of_steady_slip(slip).copysign(slip)
    }

    /// p' where this force is given.
    pub fn rate_of(&self, spring_force: f64) -> f64 {
        -spring_force * self.scale / (self.normal_force * self.numbers.stiffness)
    }

    /// T and the rate of the stored energy in a state, and y as `factor u_k + constant` there, as (k, factor, constant).
    pub fn in_state(
        &self,
        law: &FrictionLaw,
        slider_speed: f64,
        u: &[f64],
    ) -> ([f64; 2], (usize, f64, f64)) {
        let Bristles { stiffness, damping, viscous, hysteresis, .. } = self.numbers;
        let slip = u[self.tangential] - slider_speed;
        let z = self.deflection_in(u);
        let linear = match hysteresis {
            None => (self.coordinate, law.value(slip.abs()) / self.scale, 0.0),
            Some(hysteresis) => {
                let status = if slip > 0.0 { Status::Negative } else { Status::Positive };
                let law = self.numbers.loop_in(status, hysteresis);
                let factor = -status.friction_sign() * law.value(z);
                (self.tangential, factor, -factor * slider_speed)
            }
        };
        let rate = slip - (linear.1 * u[linear.0] + linear.2);
        let friction = -self.normal_force * (stiffness * z + damping * rate + viscous * slip);
        ([friction, self.normal_force * stiffness * z * rate], linear)
    }

    /// The linear terms that bristles add to C, as (row, column, entry).
    pub fn linear_terms(&self) -> [(usize, usize, f64); 3] {
        let Bristles { stiffness, damping, viscous, .. } = self.numbers;
        let (t, p) = (self.tangential, self.coordinate);
        let coupling = self.normal_force * stiffness / self.scale;
        [(t, t, self.normal_force * (damping + viscous)), (t, p, coupling), (p, t, -coupling)]
    }

    /// What small motions about steady slip at a speed add to C and to K, as (row, column, entry), where the deflection itself is
    /// the displacement of its coordinate, which has no mass then. With the perturbations s and z, and `y = a z + b s`,
    ///
    /// ```text
    /// row t:   N (sigma_0 z + sigma_1 z' + sigma_2 s)
    /// row p:   N sigma_0 (z' - s + a z + b s)
    /// ```
    ///
    /// `a = sigma_0 h, b = g h'` or, as f(z) is sgn s there, `a = n sigma_0 |s| / kinetic, b = 1`.
    pub fn tangents(&self, law: &FrictionLaw, speed: f64) -> [Vec<(usize, usize, f64)>; 2] {
        let Bristles { stiffness, damping, viscous, kinetic, hysteresis, .. } = self.numbers;
        let (t, p) = (self.tangential, self.coordinate);
        let force = self.normal_force * stiffness;
        let [a, b] = match hysteresis {
            None => [law.value(speed), self.steady_deflection(speed) * law.slope(speed)],
            Some(Hysteresis { exponent, .. }) => {
                [exponent as f64 * stiffness * speed / kinetic, 1.0]
            }
        };
        // A slider at rest bends no bristles.
        let b = if speed == 0.0 { 0.0 } else { b };
        let rates = vec![
            (t, t, self.normal_force * viscous),
            (t, p, self.normal_force * damping),
            (p, p, force),
            (p, t, force * (b - 1.0)),
        ];
        [rates, vec![(t, p, force), (p, p, force * a)]]
    }
}
