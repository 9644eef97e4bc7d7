//! The last panel before a contact opens whose slip has no mass.
//!
//! With N = N' t, t the time left, the ratio rho = R / N obeys `t d rho / dt = -(rho + (a - k s(rho)) / N')`, so that R has a part
//! that goes with a power of t which is no integer: no series holds to the end, and panels shrink with t. Once what is left of R no
//! longer moves the other coordinates by more than rounding, R is held, and N falls to zero with the others. This needs that the
//! coordinate itself does not change N.
//!
//! Its error. Slip goes on to the end if `a - mu(0) N' > 0`. Then R of the motion is between zero and `R_0 + int max(a, 0)`, and
//! below `mu(S) N` for a slip speed S above the first one if `k S >= a - mu(S) N'`. The coordinate is off by no more than the
//! difference over k, beside what the error of the others makes of it. Its own event function and the friction
//! coefficient belong to the motion and not to the panel.

use crate::contact::event_function::EventFunction;
use crate::contact::event_kind::EventKind;
use crate::motion::friction::motion::{LawMotion, Sliding, TRUNCATION, lowest};
use crate::motion::friction::operator::LawOperator;
use crate::motion::friction::series::law_contact::{Flow, LawContact};
use crate::motion::friction::series::law_series::UNIT;
use crate::motion::friction::series::panel_bound::PanelBound;
use crate::motion::friction::series::rows::Sizes;
use crate::motion::panel::Panel;
use crate::motion::taylor::motion::TaylorMotion;
use crate::numerics::first_root::polynomial::COEFFICIENTS;
use crate::scene::friction::law::FrictionLaw;

/// Width of the panel over the time after which N is zero at its present rate.
pub(super) const BEYOND: f64 = 2.0;
/// The slip speed over the first one that slip is shown to stay below, where the spring takes R back fast enough.
const FASTER: f64 = 2.0;

impl LawMotion {
    /// Holds the friction force of contacts that are about to open, on a panel that is to be filled.
    pub(super) fn hold(&mut self, operator: &LawOperator) {
        for (one, sliding) in operator.contacts.iter().zip(&mut self.contacts) {
            sliding.held = false;
            let Some(flow) = one.flow.as_ref().filter(|_| !sliding.closes) else { continue };
            if !operator.is_apart(one, flow) {
                continue;
            }
            let taylor = &mut self.taylor;
            let pressed = sliding.at_origin + taylor.displacement(&one.normal, 0);
            let friction = sliding.friction_at_origin[0] + taylor.displacement(&flow.friction, 0);
            let opening = -taylor.displacement(&one.normal, 1);
            let left = BEYOND * pressed / opening;
            // The panels before were shorter than the time left.
            let fits = left * taylor.width < operator.taylor.width();
            if !(pressed > 0.0 && friction > 0.0 && opening > 0.0 && fits) {
                continue;
            }
            // A velocity that follows from forces is no part of the size of the motion.
            taylor.place(flow.coordinate, 1, 0.0);
            let pulling = taylor.displacement(&flow.friction, 1) + flow.free(one, taylor, 1);
            let [pulling, opening] = [pulling, opening].map(|rate| left * rate);
            let spring = flow.spring * left * taylor.width;
            let Some(most) = most(&one.law, spring, [friction, pressed], [pulling, opening]) else {
                continue;
            };
            let force = friction.max(most - friction);
            let reach = operator.taylor.norm() * taylor.width * left;
            let scale = taylor.scale(&operator.taylor);
            if reach * flow.weight * force / flow.spring <= TRUNCATION * scale {
                sliding.held = true;
                taylor.begin_within(left);
            }
        }
    }

    /// A panel that holds a friction force says nothing of slip, which goes on, and little of the place of its coordinate.
    pub(super) fn expand_held(
        &self,
        operator: &LawOperator,
        functions: &[EventFunction],
        panel: &mut Panel,
    ) {
        for (one, sliding) in operator.contacts.iter().zip(&self.contacts) {
            let Some(flow) = one.flow.as_ref().filter(|_| sliding.held) else { continue };
            for (index, function) in functions.iter().enumerate() {
                if (function.contact, function.trigger) == (one.contact, EventKind::Velocity) {
                    panel.row(index).fill(0.0);
                    panel.row(index)[0] = 1.0;
                    (panel.error[index], panel.curvature_error[index]) = (0.0, 0.0);
                    panel.excluded[index] = true;
                    continue;
                }
                let terms = function.functional.position.iter();
                let own = terms.filter(|term| term.0 == flow.coordinate);
                let added = own.map(|term| term.1.abs() * sliding.off_place).sum::<f64>();
                if added > 0.0 {
                    panel.error[index] += added;
                    panel.curvature_error[index] += added;
                    let row = panel.row(index);
                    for (k, c) in row.iter_mut().enumerate() {
                        *c = self.taylor.coefficient(&function.functional, k);
                    }
                    row[0] += self.taylor.constant(index)[0];
                    panel.excluded[index] = lowest(row) > panel.error[index];
                }
            }
        }
    }
}

impl Flow {
    /// What R lacks in the order k of its rate without slip: the coordinate then moves with the slider.
    fn free(&self, one: &LawContact, taylor: &TaylorMotion, k: usize) -> f64 {
        let [q, _] = taylor.orders(k);
        let still = if k == 1 { self.slider_speed * taylor.width } else { 0.0 };
        one.sign * self.spring * (still - q[self.coordinate])
    }
}

impl Sliding {
    /// The order k of the coordinate, with which R stays what it is.
    pub(super) fn hold_force(
        &mut self,
        taylor: &mut TaylorMotion,
        one: &LawContact,
        flow: &Flow,
        k: usize,
    ) -> [f64; 4] {
        let Self { series, normal, force, at_origin, friction_at_origin, .. } = self;
        normal[k] = taylor.displacement(&one.normal, k);
        let speed = if k == 0 {
            normal[0] += *at_origin;
            force[0] = friction_at_origin[0] + taylor.displacement(&flow.friction, 0);
            one.law.speed_at(force[0] / normal[0] - one.law.value(0.0))
        } else {
            // R as if it moved with the slider, and what slip takes of it.
            force[k] = taylor.displacement(&flow.friction, k) + flow.free(one, taylor, k);
            let still = if k == 1 { flow.slider_speed * taylor.width } else { 0.0 };
            taylor.place(flow.coordinate, k, still - one.sign * force[k] / flow.spring);
            0.0
        };
        if k + 1 == COEFFICIENTS {
            taylor.place(flow.coordinate, COEFFICIENTS, 0.0);
        }
        series.extend(&one.law, k, speed, 0.0);
        [0.0; 4]
    }

    /// The bound of the other coordinates, with that of its own beside it. `fastest` bounds the error of all others per s.
    /// None if slip may end, or come to where the law is level.
    pub(super) fn bound_held(
        &mut self,
        taylor: &TaylorMotion,
        one: &LawContact,
        sizes: &Sizes,
        [fastest, in_row]: [f64; 2],
        others: PanelBound,
    ) -> Option<PanelBound> {
        let flow = one.flow.as_ref()?;
        let Self { normal, force, friction_at_origin, .. } = self;
        let at_rest = one.law.value(0.0);
        let rate =
            |c: &dyn Fn(usize) -> f64| (2..COEFFICIENTS).map(|k| k as f64 * c(k).abs()).sum();
        let by_others = (flow.friction_norm - flow.spring / flow.weight).max(0.0);
        let off = (by_others + at_rest * one.normal_norm) * fastest;
        // Without slip, R - mu(0) N grows.
        let beyond: f64 = rate(&|k| force[k] - at_rest * normal[k]);
        if !(force[1] - at_rest * normal[1] > beyond + off) {
            return None;
        }
        let pulling = force[1] + rate(&|k| force[k]) + off;
        let opening = normal[1].abs() + rate(&|k| normal[k]) + one.normal_norm * fastest;
        let spring = flow.spring * taylor.width;
        let most = most(&one.law, spring, [force[0], normal[0]], [pulling, opening])?;
        let last = taylor.sizes_of_displacement(&flow.friction, COEFFICIENTS);
        let sizes = friction_at_origin[1] + Sizes::of(&sizes.all, &flow.friction);
        let largest = force[0].max(most - force[0]) + last + UNIT * in_row * sizes;
        self.off_place = largest / flow.spring;
        let gain = (flow.weight / flow.spring * by_others).max(1.0);
        let PanelBound { truncated, rounded, beyond, exponent, holds } = others;
        Some(PanelBound {
            truncated: gain * truncated,
            rounded: gain * (rounded + exponent * flow.weight * self.off_place),
            beyond,
            exponent: gain * exponent,
            holds,
        })
    }
}

/// The largest friction force until N is zero, from R and N, how much R at most grows without slip and N falls on the panel, and k
/// times its width. None if slip may come to where the law is level.
fn most(
    law: &FrictionLaw,
    spring: f64,
    [friction, pressed]: [f64; 2],
    [pulling, opening]: [f64; 2],
) -> Option<f64> {
    let slip = law.speed_at(friction / pressed - law.value(0.0));
    let level = law.rises_until()?;
    let stays_below = |speed: f64| spring * speed >= pulling + law.value(speed) * opening;
    let faster = level.min(FASTER * slip);
    if stays_below(faster) {
        return Some(law.value(faster) * pressed);
    }
    (!level.is_finite() || stays_below(level)).then_some(friction + pulling.max(0.0))
}
