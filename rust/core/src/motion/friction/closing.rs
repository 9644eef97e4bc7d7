//! The first panel after a contact has closed whose slip has no mass.
//!
//! R and N begin at zero and `mu(|s|) N = R` says nothing of the first slip speed. On the panel, N = s n(s) and R = s r(s), and
//! with the spring k of the coordinate, at which R changes as `R' = a - k |s|`, the orders of `mu(S) n = r` are
//!
//! ```text
//! n_0 mu(S_0) + k h S_0 = h a_0                               n_0 = N'(0) h,  h the width
//! (mu'(S_0) n_0 + k h / (j + 1)) S_j = known from lower orders
//! ```
//!
//! These factors are positive, so that one motion alone begins there with a finite slip speed. It does if `a > mu(0) N'`. This needs
//! that the coordinate itself does not change N.
//!
//! Its error. Let e be the error of all other coordinates, D that of this one in the direction of R, and n, r the changes of N and
//! R with the others. With the defect `mu(S) N - R = s c(s)` of the polynomials, and d that of `q' = v - |s|`,
//!
//! ```text
//! D' = -(k / (mu' N)) (D - D*) + d,     k D* = (mu n - r) . e + s c,     D(0) = 0
//! ```
//!
//! mu' taken somewhere between the two slip speeds. The factor of D - D* is negative and infinite at the start: so
//! `|D| <= sup |D*| + int |d|`, whatever mu' and N are. With `|e| <= E s` and `k beta = |mu n - r| E + |c|` also
//! `|D| <= (beta + d) s`, and slip speeds differ by at most `k (2 beta + d) / (least mu' least N / s)`.

use crate::contact::functional::Functional;
use crate::motion::friction::motion::Sliding;
use crate::motion::friction::operator::LawOperator;
use crate::motion::friction::series::law_contact::{Flow, LawContact};
use crate::motion::friction::series::law_series::{UNIT, size};
use crate::motion::friction::series::panel_bound::{ContactBounds, PanelBound};
use crate::motion::friction::series::rows::Sizes;
use crate::motion::taylor::motion::TaylorMotion;
use crate::numerics::first_root::polynomial::COEFFICIENTS;

/// Part of a panel within which N and R at the start may have grown, so that they are the rounding of zero at a closing.
const AT_CLOSING: f64 = 1e-12;

impl LawOperator {
    /// Whether the place of a coordinate without mass does not change the normal force of its contact, nor others of them its
    /// friction force.
    pub(super) fn is_apart(&self, one: &LawContact, flow: &Flow) -> bool {
        let flows = self.taylor.equation.flowing();
        let alone = |&(k, _): &(usize, f64)| k == flow.coordinate || !flows.contains(&k);
        let of_others = |&(k, _): &(usize, f64)| !flows.contains(&k);
        let still = |of: &Functional| of.velocity.iter().all(|term| term.1 == 0.0);
        let of_places = still(&one.normal) && still(&flow.friction);
        of_places
            && one.normal.position.iter().all(of_others)
            && flow.friction.position.iter().all(alone)
    }

    /// Sets the velocities of contacts that have just closed.
    pub fn begin_flows(&self, q: &[f64], u: &mut [f64]) {
        for one in &self.contacts {
            if let (Some(flow), Some(speed)) = (&one.flow, self.speed_from_closing(one, q, u)) {
                u[flow.coordinate] = flow.slider_speed - one.sign * speed;
            }
        }
    }

    /// The slip speed of a contact that has just closed in this state, where its slip has no mass: `mu(|s|) N' = R'`.
    pub(super) fn speed_from_closing(&self, one: &LawContact, q: &[f64], u: &[f64]) -> Option<f64> {
        let flow = one.flow.as_ref()?;
        if !self.is_apart(one, flow) {
            return None;
        }
        let pressing = one.normal.rate(u, u);
        let rate = |&(k, weight): &(usize, f64)| match k == flow.coordinate {
            true => weight * flow.slider_speed,
            false => weight * u[k],
        };
        let pulling: f64 = flow.friction.position.iter().map(rate).sum();
        let [pressed, friction] = [&one.normal, &flow.friction].map(|of| of.value(q, u).abs());
        let at_rest = one.law.value(0.0);
        let time = AT_CLOSING * self.taylor.width();
        let begins = pressing > 0.0
            && pressed <= time * pressing
            && friction <= time * (pulling.abs() + at_rest * pressing);
        let load = pulling - at_rest * pressing;
        begins.then(|| one.law.speed_beside(pressing, flow.spring, load))
    }
}

/// What the coordinates of contacts that have just closed add to the error of a panel, in the norm of the operator.
#[derive(Debug, Clone, Copy)]
pub(super) struct NodeBound {
    /// Their errors, by truncation and by rounding.
    pub cut: f64,
    pub round: f64,
    /// Their errors per error of all other coordinates, if above 1.
    pub gain: f64,
    /// Whether slip speeds stay within the neighbourhood of their polynomials.
    pub follows: bool,
}

impl NodeBound {
    pub fn worse(self, other: Self) -> Self {
        Self {
            cut: self.cut.max(other.cut),
            round: self.round.max(other.round),
            gain: self.gain.max(other.gain),
            follows: self.follows && other.follows,
        }
    }

    /// The bound of the whole state, from that of the others: `|e|' <= L max(|e|, gain |e| + cut + round) + ..`
    pub fn beside(self, others: PanelBound) -> PanelBound {
        let Self { cut, round, gain, .. } = self;
        let PanelBound { truncated, rounded, beyond, exponent, holds } = others;
        PanelBound {
            truncated: gain * (truncated + exponent * cut),
            rounded: gain * (rounded + exponent * round) + round,
            beyond: beyond + cut,
            exponent: gain * exponent,
            holds,
        }
    }
}

impl Sliding {
    /// The order k of the slip speed and of the law. Gives the factors of its products, of which N is that per s.
    pub(super) fn order_after_closing(
        &mut self,
        taylor: &mut TaylorMotion,
        one: &LawContact,
        flow: &Flow,
        k: usize,
        middle: [f64; 2],
    ) -> [f64; 4] {
        let Self { series, normal, force, .. } = self;
        let still = if k == 0 { flow.slider_speed } else { 0.0 };
        taylor.flow(flow.coordinate, k, still);
        let spring = flow.spring * taylor.width / (k + 1) as f64;
        let of_order = |taylor: &TaylorMotion, of| taylor.displacement(of, k + 1);
        normal[k] = of_order(taylor, &one.normal);
        let load = of_order(taylor, &flow.friction) - one.law.value(0.0) * normal[k];
        let (slip, of_lower) = if !(normal[0] > 0.0) {
            (0.0, middle[0])
        } else if k == 0 {
            (one.law.speed_beside(normal[0], spring, load), 0.0)
        } else {
            let known = series.excess[0].mul_add(normal[k], middle[1]);
            let (without, _) = series.extend(&one.law, k, 0.0, middle[0]);
            let factor = series.slope(&one.law).mul_add(normal[0], spring);
            ((load - known - without * normal[0]) / factor, middle[0])
        };
        force[k] = load - spring * slip;
        let (excess, [left, right]) = series.extend(&one.law, k, slip, of_lower);
        taylor.flow(flow.coordinate, k, still - one.sign * slip);
        [left, right, excess, normal[k]]
    }

    /// The error of the coordinate. `fastest` bounds the error of all others per s, and the units count rounding of a row and of
    /// a product.
    pub(super) fn bound_from_closing(
        &mut self,
        taylor: &TaylorMotion,
        one: &LawContact,
        sizes: &Sizes,
        [fastest, in_row, in_product]: [f64; 3],
    ) -> NodeBound {
        let none = NodeBound { cut: f64::INFINITY, round: 0.0, gain: 1.0, follows: false };
        let Some(flow) = &one.flow else { return none };
        let ContactBounds { law, excess, pressed, products, .. } = self.bounds;
        let at_rest = one.law.value(0.0);
        let largest = at_rest + excess + law.truncation + law.rounding;
        // The orders from 1 to COEFFICIENTS: displacements begin at zero.
        let of = |functional| {
            let last = taylor.sizes_of_displacement(functional, COEFFICIENTS);
            Sizes::of(&sizes.all, functional) + last
        };
        let [of_friction, of_normal] = [&flow.friction, &one.normal].map(of);
        let cut = products + law.truncation * pressed;
        let spring = flow.spring * taylor.width;
        let left = (self.series.excess[0] * self.normal[0] - self.force[0]).abs();
        let slip = size(&self.series.slip);
        let terms = in_row * (of_friction + at_rest * of_normal)
            + in_product * ((at_rest + excess + law.slope * slip) * pressed + spring * slip);
        let round = left + law.rounding * pressed + UNIT * terms;
        let drift = UNIT * in_product * taylor.width * (flow.slider_speed.abs() + slip);
        let moving: f64 = self.normal[1..].iter().map(|c| c.abs()).sum();
        let off = one.normal_norm * fastest + UNIT * in_row * of_normal;
        let least_pressed = self.normal[0] - moving - off;
        let tube = self.series.tube(&one.law);
        let slope = self.series.least_slope(&one.law, tube);
        if !(least_pressed > 0.0 && slope > 0.0 && flow.spring > 0.0) {
            return none;
        }
        // Of the others alone.
        let of_others = flow.friction_norm - flow.spring / flow.weight + largest * one.normal_norm;
        let by_others = of_others.max(0.0);
        let pulled = 2.0 * (by_others * fastest + cut + round) + flow.spring * drift;
        let divisor = slope * least_pressed;
        self.bounds = ContactBounds {
            cut,
            round,
            gain: flow.friction_norm + largest * one.normal_norm,
            by_force: 1.0 / divisor,
            ..self.bounds
        };
        let by_force = flow.weight / flow.spring;
        NodeBound {
            cut: by_force * cut,
            round: by_force * round + flow.weight * drift,
            gain: (by_force * by_others).max(1.0),
            follows: pulled <= tube * divisor,
        }
    }
}
