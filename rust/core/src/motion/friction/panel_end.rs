//! Where a panel ends because a law does: at a speed of a table, or where friction falls to 0.

use crate::error::run::LawEnd;
use crate::motion::friction::motion::{LawMotion, Sliding, moved};
use crate::motion::friction::operator::LawOperator;
use crate::motion::friction::plane::contact::PlaneContact;
use crate::motion::friction::series::coefficients::{LawBounds, UNIT, size};
use crate::motion::friction::series::law_contact::{LawContact, LawOf};
use crate::motion::friction::series::law_series::{LawSeries, borders};
use crate::motion::taylor::motion::TaylorMotion;
use crate::numerics::first_root::polynomial::{COEFFICIENTS, ROW};
use crate::numerics::first_root::search::{FirstRoot, Verdict};
use crate::numerics::simd::VectorUnit;
use crate::scene::friction::law::FrictionLaw;

/// Units of rounding within which a slip speed is at a border of its piece: few operations give the state and S from it.
const AT_BORDER: f64 = 16.0;
/// The same, relative to the border, where slip has no mass: S is solved for, with the rounding of forces.
const AT_BORDER_OF_FLOW: f64 = 1e-12;

/// How far below a slip speed a law is looked at to tell a zero of its own there from the rounding of one at rest.
const BELOW: f64 = 1e-3;

/// The same at most, relative to the border, where pieces are formulas: the next border is at zero, where one has no series.
const NEAR: f64 = 0.25;

/// Speeds over which a law changes, relative to the motion, below which a panel without a bound lacks it for them.
const NARROW: f64 = 1e-9;

/// The size of a motion beyond which a panel may lack a bound because it leaves the range of numbers.
const FAR: f64 = 1e30;

/// Part of the sizes of its terms below which the normal force of a contact whose slip has no mass counts as zero: as it
/// vanishes, the node relaxes ever faster, and panels would shrink without end.
const PRESSED: f64 = 1e-13;
/// The same where already no panel is short enough for a bound: its node then relaxes too fast for the rounding of places.
const HARDLY_PRESSED: f64 = 1e-2;
/// Part of the time in which its node relaxes that a panel covers at least before it opens: slip then runs away from the series.
const CRAWLING: f64 = 1e-3;

impl LawMotion {
    /// A contact whose slip has no mass and whose slip speed or normal force ends the phase at the start of the panel.
    pub(super) fn end_of_flow(&self, operator: &LawOperator) -> Option<(LawOf, LawEnd)> {
        let pressed = if self.left_out.is_finite() { PRESSED } else { HARDLY_PRESSED };
        let mut contacts = operator.contacts.iter().zip(&self.contacts);
        contacts.find_map(|(one, sliding)| {
            let flow = one.flow.as_ref()?;
            let Sliding { series, normal, at_origin_size, .. } = sliding;
            // What it loses over a usual panel counts as well: its terms are small after a closing.
            let lost = normal[1].abs() * operator.taylor.width() / self.taylor.width;
            let usual = at_origin_size.max(lost);
            let damper = series.slope(&one.law) * normal[0];
            let crawls = normal[0] < HARDLY_PRESSED * usual
                && flow.spring * self.taylor.width < CRAWLING * damper;
            if !(normal[0] > pressed * usual) || crawls {
                return Some((one.of, LawEnd::Opening));
            }
            let level = !(series.slip[0] < one.law.rises_until()?);
            level.then_some((one.of, LawEnd::Level))
        })
    }

    /// An element or a contact with a state whose law leaves a panel without a bound, where the motion is within the range of numbers.
    pub(super) fn undefined(&self, operator: &LawOperator, scale: f64) -> Option<(LawOf, LawEnd)> {
        let mut elements = operator.contacts.iter().zip(&self.contacts);
        let ends = |(one, sliding): (&LawContact, &Sliding)| {
            let Sliding { series, fades, .. } = sliding;
            if *fades {
                return false;
            }
            let of_slip = series.resolution(&one.law) > NARROW * scale * one.slip_norm;
            let of_state = one
                .state
                .as_ref()
                .map(|state| series.reach_of_state() > NARROW * scale * state.norm);
            one.is_element() && !of_slip || of_state.is_some_and(|of_state| !(of_slip && of_state))
        };
        let found = if scale.is_finite() { elements.find(|of| ends(*of)) } else { None };
        found.map(|(one, _)| (one.of, LawEnd::Undefined))
    }

    /// A law that leaves every panel without a bound, for no other reason, where the motion is far from the end of the range of numbers.
    pub(super) fn without_bound(&self, operator: &LawOperator) -> Option<(LawOf, LawEnd)> {
        let has_none = |one: &Sliding| !(one.bounds.cut + one.bounds.round).is_finite();
        if self.left_out.is_finite() || self.taylor.scale_at_start(&operator.taylor) > FAR {
            return None;
        }
        let turning = operator.planes.iter().find(|one| one.law.is_some());
        let contact = self.contacts.iter().position(has_none);
        let of = contact.map(|place| operator.contacts[place].of);
        Some((of.or(turning.map(|one| LawOf::Contact(one.contacts[0])))?, LawEnd::Undefined))
    }

    /// A contact whose law changes over slip speeds that are lost in rounding: beside a motion so large that no panel has a bound;
    /// that pass within the rounding of time; or over which a falling friction drives slip apart that begins from rest.
    pub(super) fn unresolved(&self, operator: &LawOperator, scale: f64) -> Option<(LawOf, LawEnd)> {
        let TaylorMotion { width, .. } = self.taylor;
        let start = self.start();
        let too_large = |law: &FrictionLaw, series: &LawSeries, norm: f64| {
            let large = NARROW * scale * norm;
            large.is_finite() && series.resolution(law) < large
        };
        let too_fast = |law: &FrictionLaw, series: &LawSeries| {
            series.slip[1].abs() * (start.next_up() - start) > width * series.resolution(law)
        };
        // Slip that begins with S_1 and S_2 is, where it grows by e^(r s), as one of S_1 / r or 2 S_2 / r^2.
        let in_rounding = |slip: &[f64; COEFFICIENTS], fall: f64, rounding: f64| {
            let r = (fall * width).max(0.0);
            slip[0].abs() <= rounding
                && f64::max(slip[1].abs() * r, 2.0 * slip[2].abs()) < rounding * r * r
        };
        let is_bounded = self.left_out.is_finite();
        let mut contacts = operator.contacts.iter().zip(&self.contacts);
        let found = contacts.find(|(one, sliding)| {
            let Sliding { series, normal, fades, .. } = sliding;
            if *fades {
                return false;
            }
            if !is_bounded {
                return too_large(&one.law, series, one.slip_norm);
            }
            let rounding = AT_BORDER * UNIT * one.slip.constant.abs();
            if let Some((formula, _)) = one.with_state(series.piece) {
                // Slip under rate and state may creep below the rounding of the slider speed, where the law has a value at rest.
                let at_rest = || formula.with_slopes(0.0, sliding.state[0]).0;
                return series.reach(&one.law) < rounding && at_rest().is_finite();
            }
            if one.flow.is_some() || one.state.is_some() {
                return false;
            }
            let fall = -series.slope(&one.law) * normal[0] * one.force_norm * one.slip_norm;
            too_fast(&one.law, series)
                || !one.has_sign() && in_rounding(&series.slip, fall, rounding)
        });
        if let Some((one, _)) = found {
            return Some(match one.of {
                of @ LawOf::Element(_) => (of, LawEnd::Undefined),
                of => (of, LawEnd::Unresolved),
            });
        }
        let mut planes = operator.planes.iter().zip(&self.planes);
        let found = planes.find(|(one, series)| {
            let Some((law, own)) = series.law_of_speed(one) else { return false };
            if !is_bounded {
                return too_large(law, own, one.speed_norm);
            }
            let [x, y] = one.slider;
            let rounding = AT_BORDER * UNIT * x.hypot(y);
            let pressed = series.limit[0] / law.value(own.slip[0]);
            let fall = -own.slope(law) * pressed * one.force_norm * one.speed_norm;
            too_fast(law, own) || in_rounding(&own.slip, fall, rounding)
        });
        found.map(|(one, _)| (LawOf::Contact(one.contacts[0]), LawEnd::Unresolved))
    }

    /// Takes the pieces of tables by the direction in which a slip speed leaves a border of two; whether some changed.
    pub(super) fn change_pieces(&mut self, operator: &LawOperator) -> bool {
        let mut changed = false;
        for (one, sliding) in operator.contacts.iter().zip(&mut self.contacts) {
            if one.law.knots().is_empty() {
                continue;
            }
            let scale = self.taylor.scale(&operator.taylor);
            let (argument, piece) = (sliding.argument_of_pieces(one), sliding.series.piece);
            if let Some(beyond) = left(&one.law, argument, piece, |b| at(one, b, scale)) {
                sliding.series.piece = beyond;
                changed = true;
            }
        }
        for (one, series) in operator.planes.iter().zip(&mut self.planes) {
            let Some((law, own)) = series.law_of_speed(one) else { continue };
            if law.knots().is_empty() {
                continue;
            }
            let scale = self.taylor.scale(&operator.taylor);
            if let Some(beyond) = left(law, &own.slip, own.piece, |b| at_in_plane(one, b, scale)) {
                series.take_piece(beyond);
                changed = true;
            }
        }
        changed
    }

    /// Ends the panel where the first slip speed comes to the border of a piece, or the first law to 0.
    pub(super) fn cut(&mut self, operator: &LawOperator, scale: f64) {
        (self.next, self.ends) = (None, None);
        let unit = self.unit;
        let mut first = 1.0;
        for (place, (one, sliding)) in operator.contacts.iter().zip(&self.contacts).enumerate() {
            let Sliding { series, bounds, .. } = sliding;
            let argument = sliding.argument_of_pieces(one);
            let root = |border: f64, above: bool, end: f64| {
                comes_to(unit, argument, (border, above), at(one, border, scale), end)
            };
            let level = one.flow.as_ref().and_then(|_| one.law.rises_until());
            if let Some(border) = level.filter(|border| border.is_finite())
                && let Some(at) = root(border, true, first)
            {
                first = at;
                (self.next, self.ends) = (None, Some((one.of, LawEnd::Level)));
            }
            for (border, beyond) in borders(one.law.knots(), series.piece) {
                if let Some(at) = root(border, beyond > series.piece, first) {
                    first = at;
                    (self.next, self.ends) = (Some((place, beyond)), None);
                }
            }
            match &one.law {
                _ if one.is_element() || one.state.is_some() => {}
                FrictionLaw::Linear { at_rest, slope } if *slope < 0.0 => {
                    if let Some(at) = root(-at_rest / slope, true, first) {
                        first = at;
                        (self.next, self.ends) = (None, Some((one.of, LawEnd::Negative)));
                    }
                }
                FrictionLaw::Formula(_) => {
                    let mut mu = [0.0; ROW];
                    mu[..COEFFICIENTS].copy_from_slice(&series.excess);
                    let mu_at_rest = one.law.value(0.0);
                    mu[0] += mu_at_rest;
                    // Where mu vanishes with slip, the event of the slip ends the phase.
                    let comes_to_rest = |root: f64| {
                        let slip = slip_at(&series.slip, root);
                        let below = (slip * (1.0 - BELOW)).max(0.0);
                        let falls = slip < slip_at(&series.slip, root * (1.0 - BELOW));
                        mu_at_rest == 0.0 && falls && one.law.value(below) >= 0.0
                    };
                    let LawBounds { truncation, rounding, .. } = bounds.law;
                    let error = truncation + rounding;
                    if mu[0] - (size(&series.excess) - series.excess[0].abs()) > error {
                        continue;
                    }
                    let search = FirstRoot { polynomial: &mu, error, end: first };
                    if let Verdict::Crossing { root, .. } = unit.run(search)
                        && root > 0.0
                        && !comes_to_rest(root)
                    {
                        first = root;
                        (self.next, self.ends) = (None, Some((one.of, LawEnd::Negative)));
                    }
                }
                _ => {}
            }
        }
        for (place, (one, series)) in operator.planes.iter().zip(&self.planes).enumerate() {
            let Some((law, own)) = series.law_of_speed(one) else { continue };
            for (border, beyond) in borders(law.knots(), own.piece) {
                let (to, at) = ((border, beyond > own.piece), at_in_plane(one, border, scale));
                if let Some(at) = comes_to(unit, &own.slip, to, at, first) {
                    first = at;
                    (self.next, self.ends) =
                        (Some((operator.contacts.len() + place, beyond)), None);
                }
            }
            let mut mu = [0.0; ROW];
            mu[..COEFFICIENTS].copy_from_slice(&own.excess);
            mu[0] += law.value(0.0);
            if mu[0] - moved(&own.excess) > 0.0 {
                continue;
            }
            let error = UNIT * ROW as f64 * (mu[0].abs() + moved(&own.excess));
            let search = FirstRoot { polynomial: &mu, error, end: first };
            if let Verdict::Crossing { root, .. } = unit.run(search)
                && root > 0.0
            {
                first = root;
                let of = LawOf::Contact(one.contacts[0]);
                (self.next, self.ends) = (None, Some((of, LawEnd::Negative)));
            }
        }
        if first < 1.0 {
            self.shorten(first);
        }
    }
}

/// The slip speed at a part of the panel.
fn slip_at(slip: &[f64; COEFFICIENTS], at: f64) -> f64 {
    slip.iter().rev().fold(0.0, |sum, c| sum * at + c)
}

/// The part of the panel at which a slip speed or a state comes to a border, before `end`; `at` the border within that distance.
fn comes_to(
    unit: VectorUnit,
    argument: &[f64; COEFFICIENTS],
    (border, above): (f64, bool),
    at: f64,
    end: f64,
) -> Option<f64> {
    let range = moved(argument);
    if range < (argument[0] - border).abs() {
        return None;
    }
    let p = distance(argument, border, above, at)?;
    let error = UNIT * (border.abs() + range);
    match unit.run(FirstRoot { polynomial: &p, error, end }) {
        Verdict::Crossing { root, .. } if root > 0.0 => Some(root),
        _ => None,
    }
}

/// The piece into which a slip speed or a state leaves its own one, where it begins within `at` of a border of both.
fn left(
    law: &FrictionLaw,
    argument: &[f64; COEFFICIENTS],
    piece: usize,
    at: impl Fn(f64) -> f64,
) -> Option<usize> {
    let mut borders = borders(law.knots(), piece);
    let found = borders.find(|&(border, beyond)| {
        distance(argument, border, beyond > piece, at(border)).is_some_and(|p| p[0] < 0.0)
    });
    found.map(|(_, beyond)| beyond)
}

/// The distance from a border within which a slip speed in a plane is at it.
fn at_in_plane(one: &PlaneContact, border: f64, scale: f64) -> f64 {
    AT_BORDER * UNIT * (border.abs() + scale * one.speed_norm)
}

/// The distance from a border within which a slip speed or a state is at it.
fn at(one: &LawContact, border: f64, scale: f64) -> f64 {
    match one.flow {
        Some(_) => AT_BORDER_OF_FLOW * border,
        None => {
            let norm = one.state.as_ref().map_or(one.slip_norm, |state| state.norm);
            let rounding = AT_BORDER * UNIT * (border.abs() + scale * norm);
            match one.law {
                FrictionLaw::Pieces(_) if border != 0.0 => rounding.min(NEAR * border.abs()),
                _ => rounding,
            }
        }
    }
}

/// The distance of a slip speed S from a border that is `above` or below it, negative beyond. Where S begins at the border, the
/// orders that do not take it away from there are left out and the power of the first other one is divided out, so that the
/// first coefficient shows the side to which S leaves. None if it stays at the border.
fn distance(slip: &[f64; COEFFICIENTS], border: f64, above: bool, at: f64) -> Option<[f64; ROW]> {
    let side = if above { -1.0 } else { 1.0 };
    let mut p = [0.0; ROW];
    p.iter_mut().zip(slip).for_each(|(p, c)| *p = side * c);
    p[0] -= side * border;
    let order = p.iter().position(|c| c.abs() > at)?;
    p.copy_within(order.., 0);
    p[ROW - order..].fill(0.0);
    Some(p)
}
