//! Friction of bristles: contacts with a deflection (LuGre, Dahl, Bouc-Wen and elasto-plastic).
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
//! and elasto-plastic bristles (Dupont, Hayward, Armstrong and Altpeter, IEEE Trans. Automatic Control 47 (2002) 787) are elastic
//! up to a part of the deflection `z_1 = kinetic / sigma_0` of steady slip, from which `f = z / z_1` on; between, f is the cubic
//! that joins both with its slope. For each sign of s, f is a table of cubic pieces. All are `z' = s - y` with a product y of a law
//! and a functional of the state, `sigma_0 h(|s|)` and z, or f(z) and |s|.
//!
//! The deflection is the velocity of a hidden coordinate p, `p' = c z`, with the mass `N sigma_0 / c^2`
//! ([`crate::scene::friction::contact_state`]). The kinetic energy of p is then the energy `N sigma_0 z^2 / 2` that the bristles
//! store, and all but one product of the equations is linear:
//!
//! ```text
//! row t:   + N (sigma_1 + sigma_2) (t . x' - v) + N sigma_0 z        = ... + N sigma_1 y
//! row p:   N sigma_0 / c^2 p'' - N sigma_0 / c (t . x' - v)          =     - N sigma_0 / c y
//! ```
//!
//! The coupling of t and p is skew-symmetric, and c is such that p has the mass that the contact feels along t. |s| is not
//! analytic at s = 0, which is an event.

use std::sync::Arc;

use crate::error::input::Error;
use crate::scene::friction::formula::GivenOperation;
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
    /// Where the law depends on the deflection; `at_rest` is then `kinetic`.
    pub hysteresis: Option<Hysteresis>,
}

/// The shape of a loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Hysteresis {
    /// That of Bouc and Wen.
    BoucWen {
        /// n, 1, 2 or 3.
        exponent: usize,
        /// beta, -, from 0 to 1: 1 unloads along the slope at z = 0, 0.5 elastically.
        share: f64,
    },
    /// That of Dupont and others.
    ElastoPlastic {
        /// Part of the deflection of steady slip up to which bristles are elastic, -, between 0 and 1.
        break_away: f64,
    },
    /// That of a spring in a plane, see `elastic_plane`.
    Plane,
}

impl Hysteresis {
    /// n of `f = (z / z_1)^n`, whose slope f has at the deflection z_1 of steady slip.
    pub(crate) const fn exponent(self) -> f64 {
        match self {
            Self::BoucWen { exponent, .. } => exponent as f64,
            Self::ElastoPlastic { .. } | Self::Plane => 1.0,
        }
    }
}

/// The square of a deflection, of either sign.
pub(crate) fn square() -> FrictionLaw {
    FrictionLaw::Tabulated(Arc::new(squares()))
}

fn squares() -> Table {
    Table { speeds: vec![0.0], pieces: vec![[0.0, 0.0, 1.0, 0.0]] }
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
        let shape = self.hysteresis.map(|shape| match shape {
            Hysteresis::BoucWen { exponent, share } => {
                let exponent = exponent as f64;
                vec![
                    ("exponent", exponent, "1, 2 or 3", (1.0..=3.0).contains(&exponent)),
                    ("share", share, "in [0, 1]", (0.0..=1.0).contains(&share)),
                ]
            }
            Hysteresis::ElastoPlastic { break_away } => {
                let inside = 0.0 < break_away && break_away < 1.0;
                vec![("break_away", break_away, "between 0 and 1", inside)]
            }
            Hysteresis::Plane => Vec::new(),
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

    /// f over z in a status, as a law.
    pub(crate) fn loop_in(&self, status: Status, shape: Hysteresis) -> FrictionLaw {
        FrictionLaw::Tabulated(Arc::new(self.pieces_in(status, shape)))
    }

    /// The same in pieces `sum c_k (z - z_i)^k` from z_i on.
    fn pieces_in(&self, status: Status, shape: Hysteresis) -> Table {
        let extent = self.kinetic / self.stiffness;
        match shape {
            Hysteresis::BoucWen { exponent, share } => {
                Self::bouc_wen(status, extent, exponent, share)
            }
            Hysteresis::ElastoPlastic { break_away } => {
                Self::elasto_plastic(status, extent, break_away)
            }
            Hysteresis::Plane => squares(),
        }
    }

    fn elasto_plastic(status: Status, extent: f64, break_away: f64) -> Table {
        let width = (1.0 - break_away) * extent;
        let sloped = 1.0 / extent;
        // From 0 with slope 0 to 1 with the slope of z / z_1, over the distance from the elastic part.
        let quadratic = (3.0 - sloped * width) / (width * width);
        let cubic = (sloped * width - 2.0) / (width * width * width);
        match status.friction_sign() < 0.0 {
            true => Table {
                speeds: vec![-extent, break_away * extent, extent],
                pieces: vec![[0.0; 4], [0.0, 0.0, quadratic, cubic], [1.0, sloped, 0.0, 0.0]],
            },
            // -f(-z), about z = -z_1.
            false => Table {
                speeds: vec![-2.0 * extent, -extent, -break_away * extent],
                pieces: vec![
                    [-2.0, sloped, 0.0, 0.0],
                    [-1.0, sloped, -quadratic - 3.0 * cubic * width, cubic],
                    [0.0; 4],
                ],
            },
        }
    }

    fn bouc_wen(status: Status, extent: f64, exponent: usize, share: f64) -> Table {
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
        Table { speeds: vec![-extent, 0.0], pieces: vec![far, near] }
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

    /// Force per normal force and rate of the deflection for slip in a direction, by piece, and the deflections from which pieces
    /// hold.
    pub(crate) fn as_formulas(&self, direction: f64) -> (Vec<f64>, Vec<[Vec<GivenOperation>; 2]>) {
        let Some(shape) = self.hysteresis else {
            return (Vec::new(), vec![self.as_formula(None)]);
        };
        let status = if direction > 0.0 { Status::Negative } else { Status::Positive };
        let Table { speeds: knots, pieces } = self.pieces_in(status, shape);
        let given = knots.iter().copied().zip(pieces);
        let given = given.map(|piece| self.as_formula(Some(piece))).collect();
        (knots, given)
    }

    /// The same without a loop, or on a piece of one, from its knot and its coefficients.
    fn as_formula(&self, piece: Option<(f64, [f64; 4])>) -> [Vec<GivenOperation>; 2] {
        // Slot 0 is |s|, 1 is z, and 2 the sign of s.
        let mut told: Vec<GivenOperation> = Vec::new();
        let mut add = |name: &str, first: usize, second: usize, number: f64| {
            told.push((name.to_owned(), first, second, number));
            told.len()
        };
        let z = add("state", 0, 0, 0.0);
        let sign = add("direction", 0, 0, 0.0);
        let slip = add("multiply", sign, 0, 0.0);
        let lost = if let Some((knot, [a, b, c, d])) = piece {
            let start = add("constant", 0, 0, knot);
            let beyond = add("subtract", z, start, 0.0);
            let mut sum = add("constant", 0, 0, d);
            for coefficient in [c, b, a] {
                let higher = add("multiply", sum, beyond, 0.0);
                let own = add("constant", 0, 0, coefficient);
                sum = add("add", higher, own, 0.0);
            }
            add("multiply", 0, sum, 0.0)
        } else {
            let narrow = add("constant", 0, 0, -1.0 / (self.speed * self.speed));
            let square = add("multiply", 0, 0, 0.0);
            let exponent = add("multiply", narrow, square, 0.0);
            let part = add("exp", exponent, 0, 0.0);
            let falling = add("constant", 0, 0, (self.at_rest - self.kinetic) / self.stiffness);
            let more = add("multiply", part, falling, 0.0);
            let least = add("constant", 0, 0, self.kinetic / self.stiffness);
            let largest = add("add", least, more, 0.0);
            let bent = add("multiply", 0, z, 0.0);
            add("divide", bent, largest, 0.0)
        };
        let rate = add("subtract", slip, lost, 0.0);
        let damping = add("constant", 0, 0, self.damping);
        let damped = add("multiply", rate, damping, 0.0);
        let stiffness = add("constant", 0, 0, self.stiffness);
        let spring = add("multiply", z, stiffness, 0.0);
        let held = add("add", spring, damped, 0.0);
        let viscous = add("constant", 0, 0, self.viscous);
        let dragged = add("multiply", slip, viscous, 0.0);
        add("add", held, dragged, 0.0);
        let of_rate = told[..rate].to_vec();
        [told, of_rate]
    }

    /// g
    pub(crate) fn of_steady_slip(&self, speed: f64) -> f64 {
        let part = (-(speed / self.speed).powi(2)).exp();
        self.kinetic + (self.at_rest - self.kinetic) * part
    }
}
