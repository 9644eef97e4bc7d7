//! Balances from which the directions of slow slips, and the deflections of bristles, follow on wide panels, and the last panel of a slip
//! in a plane.

use crate::motion::friction::motion::{GROWTH, LawMotion, Sliding, worse};
use crate::motion::friction::operator::LawOperator;
use crate::motion::friction::plane::series::PlaneSeries;
use crate::motion::friction::plane::widths::STIFF;
use crate::motion::friction::series::coefficients::UNIT;
use crate::motion::friction::series::followed_state::FollowedState;
use crate::motion::friction::state_norm::{StateNorm, StateRow};
use crate::motion::taylor::motion::TaylorMotion;
use crate::scene::model::Scene;

/// Times that a balance of forces is improved, each time by at least this factor.
pub(super) const BALANCES: usize = 24;
const SETTLES: f64 = 0.5;
/// Part of the time in which a direction relaxes after which its balance is tried again, and how much wider than the panel before one is tried.
const RELAXES: f64 = 0.2;
const WIDENS: f64 = 4.0;
/// How much wider than that of series in time a panel has to be that costs several of their recurrences.
const WORTH: f64 = 4.0;
/// Panels on which such a balance is tried, each narrower than the one before.
const NARROWINGS: usize = 8;
const NARROWER: f64 = 0.25;
/// Least size of a deflection, relative to the state, to which truncation is.
const SMALLEST: f64 = 1e-6;
/// Times that the fastest bristles relax over the first panel that is tried, and usual panels until the next one is.
const FIRST: f64 = 200.0;
const WAITS: f64 = 8.0;
/// Times that a deflection relaxes over a panel up to which it has a series in time, and how much wider than follows from `STIFF` a
/// panel is on which one has to follow.
const SERIES: f64 = 10.0;
const BEYOND: f64 = 1.25;
/// Units of rounding of a state below which a slip in a plane is at rest.
const UNRESOLVED: f64 = 8.0;
/// Units of rounding of the velocities below which a slip in a plane has ended: the coefficients and the width of a panel that is
/// shortened a dozen times have rounded twice each, and no panel takes a faster slip through rest.
const AT_REST: f64 = 512.0;
/// Difference of the times to the ends of two slips, relative to them, below which both end with the same panel.
const SAME_END: f64 = 1e-6;

impl LawMotion {
    /// Lets the directions of slow slips, and deflections of bristles, follow from their balances, on a wider panel, where they have
    /// come to that: the widest one, in steps, on which the balances settle beside the others. Whether any follows; where none does, the
    /// series in time is again as it was, if it was `formed`.
    pub(super) fn follow_balances(
        &mut self,
        scene: &Scene,
        operator: &LawOperator,
        formed: bool,
    ) -> bool {
        let [start, width] = [self.taylor.start(), self.taylor.width];
        if self.stopping.is_some() || start < self.untried_until {
            return false;
        }
        let full = operator.taylor.width();
        let widest = full * operator.widest();
        // A deflection comes near its balance soon after slip has begun, a direction only with the end of slip.
        let [widens, waits] = match operator.planes.is_empty() {
            true => [GROWTH, WAITS * width],
            false => [WIDENS, f64::INFINITY],
        };
        let mut wide = widest.min(widens * self.followed);
        let mut rates = self.rates(operator);
        if self.followed.is_infinite() {
            wide = rates.iter().fold(wide, |wide, (rate, _)| wide.min(FIRST / rate));
        }
        wide = wide.max(beyond_series(&rates, wide)).min(widest);
        let mut tried = None;
        for _ in 0..NARROWINGS {
            let planes = operator.planes.iter().zip(&self.planes);
            wide =
                planes.fold(wide, |w, (one, series)| series.widest(one, [w, full], start).min(w));
            wide = widest_of_states(&rates, wide);
            if wide <= WORTH * width || !self.let_follow(operator, wide) {
                break;
            }
            tried = Some(wide);
            self.taylor.begin_within(wide / self.taylor.width);
            if self.settle(scene, operator) {
                self.followed = wide;
                return true;
            }
            self.wait_for_slowest(operator);
            rates = self.rates(operator);
            wide *= NARROWER;
        }
        if let Some(wide) = tried {
            // A deflection is known to relax until some time, and is tried then.
            let known = self.contacts.iter().any(|one| one.followed.relaxed_at > start);
            let waits = if known { 0.0 } else { wide.min(waits) };
            (self.followed, self.untried_until) = (f64::INFINITY, start + waits);
            self.let_follow(operator, 0.0);
            self.taylor.begin_within(width / self.taylor.width);
            if formed {
                self.recur_in_range(scene, operator);
            }
        }
        false
    }

    /// Forms the panel again for neighbours of the motion, which have not come to the balances that it has come to: a direction
    /// follows after that, and no deflection does in the phase.
    pub(super) fn follow_later(&mut self, scene: &Scene, operator: &LawOperator) {
        let start = self.taylor.start();
        let follows = self.has_followed_state() || self.planes.iter().any(PlaneSeries::follows);
        for (one, series) in operator.planes.iter().zip(&mut self.planes) {
            if !series.begins() {
                let relaxed = start + STIFF / series.relaxation(one);
                series.relaxed_at = series.relaxed_at.max(relaxed);
            }
        }
        if operator.states.is_some() {
            self.untried_until = f64::INFINITY;
        }
        if follows {
            self.begin_at_deflections(operator);
            self.let_follow(operator, 0.0);
            self.followed = f64::INFINITY;
            self.taylor.begin_within(operator.taylor.width() / self.taylor.width);
            self.fill(scene, operator);
        }
    }

    /// Takes the panel back from balances to the deflections with which the motion comes to it.
    fn begin_at_deflections(&mut self, operator: &LawOperator) {
        for (row, sliding) in followed(operator, &self.contacts) {
            self.taylor.set_rate(row.coordinate, sliding.followed.began);
        }
    }

    /// What truncation is relative to: the smallest of the deflections that follow, as the friction force is a small difference of
    /// what slip and they make of it; the state where none does.
    pub(super) fn size_of_followed(&self, operator: &LawOperator, scale: f64) -> f64 {
        let all = followed(operator, &self.contacts);
        let sizes = all.map(|(row, sliding)| row.weight * sliding.followed.first().abs());
        sizes.fold(scale, f64::min).max(SMALLEST * scale)
    }

    /// Whether the deflection of a contact follows on the panel.
    pub(super) fn has_followed_state(&self) -> bool {
        self.contacts.iter().any(|one| one.followed.follows)
    }

    /// How fast the deflections relax, 1/s, and whether each of them has.
    fn rates(&mut self, operator: &LawOperator) -> Vec<(f64, bool)> {
        let start = self.taylor.start();
        let all = relaxing(operator, &self.taylor, &mut self.contacts);
        all.map(|(_, rate, followed)| (rate, start >= followed.relaxed_at)).collect()
    }

    /// Lets the slowest of several deflections that did not follow together relax before that is tried again.
    fn wait_for_slowest(&mut self, operator: &LawOperator) {
        let start = self.taylor.start();
        let all = relaxing(operator, &self.taylor, &mut self.contacts);
        let mut following: Vec<_> = all.filter(|(.., one)| one.follows).collect();
        following.sort_by(|a, b| a.1.total_cmp(&b.1));
        if let [(_, rate, slowest), _, ..] = &mut following[..] {
            slowest.relaxed_at = slowest.relaxed_at.max(start + STIFF / *rate);
        }
    }

    /// Lets the directions and deflections follow that relax many times over a panel; whether any does.
    fn let_follow(&mut self, operator: &LawOperator, width: f64) -> bool {
        let start = self.taylor.start();
        let planes = operator.planes.iter().zip(&mut self.planes);
        let follows = planes.map(|(one, series)| series.let_follow(one, width, start));
        let planes = follows.filter(|follows| *follows).count();
        let is_dense = operator.taylor.dense.is_some();
        for (row, rate, followed) in relaxing(operator, &self.taylor, &mut self.contacts) {
            followed.follows = is_dense && rate * width > STIFF && start >= followed.relaxed_at;
            followed.begin(self.taylor.rate_of(row.coordinate, 0));
        }
        planes > 0 || self.has_followed_state()
    }

    /// Whether the balances of slow slips settle on the panel as wide as it is, near the slips that it begins with. Those that begin
    /// elsewhere have to come to them first.
    fn settle(&mut self, scene: &Scene, operator: &LawOperator) -> bool {
        let rounding = UNRESOLVED * UNIT * self.taylor.scale(&operator.taylor);
        let (start, width) = (self.taylor.start(), self.taylor.width);
        let mut before = f64::INFINITY;
        for left in (0..BALANCES).rev() {
            self.recur(scene, operator);
            let Self { taylor, contacts, planes, .. } = self;
            let following = operator.planes.iter().zip(planes);
            let following = following.filter(|(_, series)| series.follows());
            let mut largest = 0.0f64;
            let mut away = Vec::new();
            for (one, series) in following {
                let [change, apart] = series.improve(one, width);
                largest = worse(largest, change / series.limit[0]);
                let off = apart / (rounding * one.slip_norm);
                if !(off <= 1.0) {
                    let time = RELAXES * off.ln() / series.relaxation(one);
                    away.push((&mut series.relaxed_at, start + time));
                }
            }
            let mut begins = Vec::new();
            for (row, rate, followed) in relaxing(operator, taylor, contacts) {
                if followed.follows {
                    largest = worse(largest, followed.improve());
                    begins.push((row.coordinate, followed.first()));
                    let off = row.weight * followed.apart / rounding;
                    if !(off <= 1.0) {
                        away.push((&mut followed.relaxed_at, start + off.ln() / rate));
                    }
                }
            }
            begins.into_iter().for_each(|(place, rate)| taylor.set_rate(place, rate));
            if largest <= UNRESOLVED * UNIT {
                let settles = away.is_empty();
                away.into_iter().for_each(|(relaxed_at, time)| *relaxed_at = time);
                if settles {
                    return true;
                }
                break;
            }
            let gain = largest / before;
            if !(gain < SETTLES && largest * gain.powi(left as i32) <= UNRESOLVED * UNIT) {
                break;
            }
            before = largest;
        }
        self.begin_at_deflections(operator);
        false
    }

    /// Makes the panel the last one of a slip in a plane that ends within it.
    pub(super) fn end_slip(&mut self, scene: &Scene, operator: &LawOperator) {
        self.stopping = None;
        let (rate, width, constant) =
            (operator.taylor.norm(), operator.taylor.width(), self.constant);
        let unresolved = AT_REST * UNIT * self.taylor.scale(&operator.taylor);
        let panel = self.taylor.width;
        let all = operator.planes.iter().zip(&mut self.planes).enumerate();
        let ends = all.filter_map(|(place, (one, series))| {
            let end = series.end(one, [width, panel], rate, [constant, unresolved]);
            end.map(|(time, rests)| (place, time, rests))
        });
        let ends: Vec<(usize, f64, bool)> = ends.collect();
        let first = ends.iter().min_by(|a, b| a.1.total_cmp(&b.1));
        let Some(&(place, time, rests)) = first else { return };
        for &(other, at, also) in &ends {
            if at > time * (1.0 + SAME_END) && !(rests && also) {
                self.planes[other].end_later();
            }
        }
        self.taylor.begin_within(time / self.taylor.width);
        self.recur(scene, operator);
        self.stopping = Some(place);
    }
}

/// The panel on which the deflections follow that neither follow nor have a series on one of a width on which faster deflections follow;
/// 0 where there are none.
fn beyond_series(rates: &[(f64, bool)], wide: f64) -> f64 {
    let relaxed = || rates.iter().filter(|one| one.1).map(|one| one.0);
    if !relaxed().any(|rate| rate * wide > STIFF) {
        return 0.0;
    }
    let between = relaxed().filter(|rate| (SERIES..=STIFF).contains(&(rate * wide)));
    between.fold(0.0, |widest, rate| widest.max(BEYOND * STIFF / rate))
}

/// The widest panel up to a width, on which each deflection follows or has a series.
fn widest_of_states(rates: &[(f64, bool)], mut wide: f64) -> f64 {
    let is_between = |rate: f64, relaxed: bool, wide: f64| {
        rate * wide > SERIES && !(relaxed && rate * wide > STIFF)
    };
    for _ in rates {
        let between = rates.iter().filter(|one| is_between(one.0, one.1, wide));
        wide = between.fold(wide, |narrowest, one| narrowest.min(SERIES / one.0));
    }
    wide
}

/// Contacts with bristles, how fast these relax where the panel begins, 1/s, and their balances.
fn relaxing<'a>(
    operator: &'a LawOperator,
    taylor: &TaylorMotion,
    contacts: &'a mut [Sliding],
) -> impl Iterator<Item = (&'a StateRow, f64, &'a mut FollowedState)> {
    let all = operator.contacts.iter().zip(contacts).enumerate();
    all.filter_map(|(place, (one, sliding))| {
        let row = operator.states.as_ref()?.state(place)?;
        let slip = taylor.coefficient(&one.slip, 0) + sliding.slip_at_origin[0];
        let mu = one.law.value((-one.sign * slip).max(0.0)) - one.law.value(0.0);
        Some((row, row.rate(mu), &mut sliding.followed))
    })
}

/// Contacts whose deflection follows.
pub(super) fn followed<'a>(
    operator: &'a LawOperator,
    contacts: &'a [Sliding],
) -> impl Iterator<Item = (&'a StateRow, &'a Sliding)> {
    let rows = operator.states.iter().flat_map(StateNorm::rows).zip(contacts);
    rows.filter_map(|(row, sliding)| Some((row.filter(|_| sliding.followed.follows)?, sliding)))
}
