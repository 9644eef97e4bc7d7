//! The first event on one panel: certified roots of its event functions, touches, and the limits of bounces.

use crate::contact::event_function::EventFunction;
use crate::contact::event_kind::EventKind;
use crate::motion::panel::Panel;
use crate::numerics::first_root::polynomial::{ROW, ValueAndSlope};
use crate::numerics::first_root::search::{FirstRoot, Touch, Verdict};
use crate::numerics::simd::VectorUnit;
use crate::scene::model::Scene;
use crate::transient::trajectory::events::{Counters, Grazing};

/// A bounce slower than this, relative to the fastest coordinate, is rounding of the impact before it.
const BOUNCE_ROUNDING: f64 = 64.0 * f64::EPSILON;
/// A flight is searched for within this many times its parabola first.
const FLIGHT: f64 = 4.0;
/// Newton steps to a root that lies shortly before a panel.
const NEWTON: usize = 6;
/// Rounding of a gap from its own polynomial, relative to the gap and to what its speed adds: Horner's rule.
const GAP_ROUNDING: f64 = 64.0 * f64::EPSILON;

/// Where a series of bounces ends, in the unit of the panel.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Limit {
    pub function: usize,
    pub contact: usize,
    pub at: f64,
    pub bounces: usize,
    pub error: f64,
}

/// A panel of event functions, and the data of the search that pass from one panel to the next.
#[derive(Debug, Default)]
pub(crate) struct PanelSearch {
    pub panel: Panel,
    /// Multiplicity of the zero at the start of the first panel, per event function.
    pub multiplicity: Vec<usize>,
    /// Touches at the end of a panel wait for the next one to say whether they were crossings.
    pub pending: Vec<Option<Grazing>>,
    /// Whether any touch waits.
    pub waiting: bool,
    pub touches: Vec<Grazing>,
    pub unit: VectorUnit,
    /// On the first panel of a phase: its gaps are exact at its start.
    pub exact: bool,
    /// How far before its start polynomials hold as well, in the unit of the panel: those of linear motions do back to the start of
    /// the phase, at most as far as the panel is wide; others hold a small part of it.
    pub before: f64,
}

impl PanelSearch {
    /// Begins a phase whose event functions leave zero with these multiplicities.
    pub fn begin(&mut self, multiplicities: impl Iterator<Item = usize>) {
        self.multiplicity.clear();
        self.multiplicity.extend(multiplicities);
        if self.waiting || self.pending.len() != self.multiplicity.len() {
            self.pending.clear();
            self.pending.resize(self.multiplicity.len(), None);
            self.waiting = false;
        }
    }

    /// The first crossing of any event function up to `end` of the panel, which begins at a time: its function and
    /// place. Gaps whose series end in the limits `skipped` are not searched.
    pub fn first_crossing(
        &mut self,
        counters: &mut Counters,
        begin: f64,
        functions: &[EventFunction],
        end: f64,
        skipped: &[Limit],
    ) -> Option<(usize, f64)> {
        self.touches.clear();
        if self.waiting {
            self.end_waiting(skipped);
        }
        let mut found = None;
        let mut first = end;
        for index in 0..functions.len() {
            if self.panel.excluded[index] || skips(skipped, index) {
                continue;
            }
            counters.refinements += 1;
            if let Some(root) = self.crossing(index, begin, &functions[index], first)
                && found.is_none_or(|(_, earlier)| root <= earlier)
            {
                first = root.max(0.0);
                found = Some((index, root));
            }
        }
        found
    }

    /// The touches that wait of event functions that are positive on this panel, or not searched, were no crossings.
    #[cold]
    fn end_waiting(&mut self, skipped: &[Limit]) {
        for (index, pending) in self.pending.iter_mut().enumerate() {
            if self.panel.excluded[index] || skips(skipped, index) {
                self.touches.extend(pending.take());
            }
        }
    }

    /// The place of the first crossing of one event function up to `end` of the panel. Inlined, it would have the loop over
    /// all functions, most of which are excluded, keep its variables on the stack.
    #[inline(never)]
    fn crossing(
        &mut self,
        index: usize,
        begin: f64,
        function: &EventFunction,
        end: f64,
    ) -> Option<f64> {
        let impact = function.trigger == EventKind::Impact;
        let departing = self.multiplicity[index];
        let bounce = departing == 1 && impact;
        if (bounce || self.exact && impact && departing == 0)
            && let Some(root) = self.short_flight(index, end)
        {
            return Some(root);
        }
        let p = self.panel.polynomial(index, departing);
        let error = if departing >= 2 || bounce {
            self.panel.curvature_error[index]
        } else {
            self.panel.error[index]
        };
        let grazing = |touch: Touch| Grazing {
            time: begin + touch.at * self.panel.width,
            contact: function.contact,
            alternative: function.trigger,
            value: touch.value,
            uncertainty: error,
        };
        match self.unit.run(FirstRoot { polynomial: p, error, end }) {
            Verdict::Clear { touch: None, in_band: None } if !self.waiting => None,
            Verdict::Clear { touch, in_band } => {
                let before = self.pending[index].take().filter(|_| in_band.is_none());
                self.touches.extend(touch.map(grazing).or(before));
                self.pending[index] = in_band.map(grazing);
                self.waiting |= in_band.is_some();
                None
            }
            Verdict::Crossing { root, touch } => {
                self.touches.extend(touch.map(grazing));
                let waited = self.waiting && self.pending[index].take().is_some();
                Some(if waited && root == 0.0 { self.root_before(index) } else { root })
            }
        }
    }

    /// The root of an event function that was within its error of zero at the end of the last panel and has passed through zero
    /// before this one begins: by Newton's method from the start of the panel.
    #[cold]
    fn root_before(&self, index: usize) -> f64 {
        let p = self.panel.polynomial(index, 0);
        let mut root = 0.0;
        for _ in 0..NEWTON {
            let (value, slope) = self.unit.run(ValueAndSlope(p, root));
            if slope >= 0.0 {
                break;
            }
            root = (root - value / slope).clamp(-self.before, 0.0);
        }
        root
    }

    /// The end of a flight that is short beside the panel, found in the scale of the flight itself: there the
    /// errors of the higher coefficients are small beside the gap and its speed, which are known exactly.
    pub fn short_flight(&self, function: usize, end: f64) -> Option<f64> {
        let multiplicity = self.multiplicity[function];
        let p = self.panel.polynomial(function, multiplicity);
        let parabola = match multiplicity {
            0 => {
                // The later root of a gap that is positive now, without cancellation.
                let root = (p[1] * p[1] - 4.0 * p[0] * p[2]).sqrt();
                if p[1] > 0.0 { -0.5 * (p[1] + root) / p[2] } else { 2.0 * p[0] / (root - p[1]) }
            }
            _ => -p[0] / p[1],
        };
        let scale = FLIGHT * parabola;
        if !(scale > 0.0 && scale < 1.0) {
            return None;
        }
        let mut scaled = [0.0; ROW];
        let mut power = 1.0;
        for (target, c) in scaled.iter_mut().zip(p) {
            *target = c * power;
            power *= scale;
        }
        let error = match multiplicity {
            0 => self.gap_error(function, scale),
            _ => self.panel.curvature_error[function] * scale,
        };
        let end = (end / scale).min(1.0);
        match self.unit.run(FirstRoot { polynomial: &scaled[..p.len()], error, end }) {
            Verdict::Crossing { root, .. } => Some(root * scale),
            Verdict::Clear { .. } => None,
        }
    }

    /// Bound of the error of a gap on `[0, s]` of the panel; 0 where the gap is certain not to close on the panel, which has no
    /// errors of it then.
    pub fn gap_error(&self, function: usize, s: f64) -> f64 {
        if self.panel.excluded[function] {
            return 0.0;
        }
        if !self.exact {
            return self.panel.error[function];
        }
        let c = self.panel.polynomial(function, 0);
        GAP_ROUNDING * (c[0].abs() + c[1].abs() * s) + self.panel.curvature_error[function] * s * s
    }

    /// Whether an event function is within its error of zero, and falling, at `s` of the panel.
    #[inline]
    pub fn vanishes(&self, function: usize, trigger: EventKind, s: f64) -> bool {
        !self.panel.excluded[function] && self.is_zero(function, trigger, s)
    }

    fn is_zero(&self, function: usize, trigger: EventKind, s: f64) -> bool {
        let multiplicity = self.multiplicity[function];
        let p = self.panel.polynomial(function, multiplicity);
        let (value, slope) = self.unit.run(ValueAndSlope(p, s));
        // After a departure gap / s^m is asked, which is not zero at the start: a gap that has just opened does not close.
        let error = match (self.exact && trigger == EventKind::Impact, multiplicity) {
            (false, _) => self.panel.error[function],
            (true, 0) => self.gap_error(function, s),
            (true, 1) => GAP_ROUNDING * p[0].abs() + self.panel.curvature_error[function] * s,
            (true, _) => self.panel.curvature_error[function],
        };
        value <= error && slope < 0.0
    }

    /// Distance from the zero at `s` up to which an event function stays within its error, in the unit of the panel.
    pub fn spread(&self, function: usize, s: f64) -> f64 {
        let p = self.panel.polynomial(function, self.multiplicity[function]);
        let (_, slope) = self.unit.run(ValueAndSlope(p, s));
        self.panel.error[function] / slope.abs()
    }

    /// The nearest limit of a series of bounces in this panel whose rest is negligible. After a bounce the gap
    /// is `c1 s + c2 s^2 + c3 s^3 ..`; with constant acceleration the flight lasts `-c1 / c2`, the whole series
    /// that over `1 - e`, and the neglected c3 changes the flight by about its square times c3 / c2. `clock`: the time of the
    /// panel, s; `tolerance`: the rest that is negligible, s; `speed`: of the fastest coordinate.
    pub fn bounces(
        &mut self,
        scene: &Scene,
        functions: &[EventFunction],
        u: &[f64],
        clock: f64,
        tolerance: f64,
        speed: impl Fn() -> f64,
    ) -> Option<Limit> {
        let mut nearest: Option<Limit> = None;
        for (function, event) in functions.iter().enumerate() {
            let bounces = self.multiplicity[function] == 1 && event.trigger == EventKind::Impact;
            if self.panel.excluded[function] || !bounces {
                continue;
            }
            let law = &scene.contacts[event.contact];
            let width = self.panel.width;
            let c = &mut self.panel.coefficients[function * ROW..];
            c[1] = u[law.normal] * width;
            let (c1, c2, c3) = (c[1], c[2], c[3]);
            if !(c2 < 0.0 && law.restitution < 1.0) {
                continue;
            }
            let at = -c1 / c2 / (1.0 - law.restitution);
            let rest = at * width;
            let ulp = clock.next_up() - clock;
            let negligible =
                rest <= tolerance.max(ulp) || u[law.normal] <= BOUNCE_ROUNDING * speed();
            if negligible && at <= 1.0 && nearest.as_ref().is_none_or(|limit| at < limit.at) {
                nearest = Some(Limit {
                    function,
                    contact: event.contact,
                    at,
                    bounces: bounces_left(rest, ulp, law.restitution),
                    error: rest
                        * (2.0 * at * (c3 / c2).abs() + self.panel.curvature_error[function]),
                });
            }
        }
        nearest
    }

    /// The series of bounces of other contacts that end with `limit`, since their rests are `negligible`, too. A gap that
    /// is `c0 + c1 s + c2 s^2 ..` now closes with the slope `-d`, `d^2 = c1^2 - 4 c0 c2`, after `(c1 + d) / (-2 c2)`, and its
    /// series lasts `e / (1 - e) d / -c2` from there on. Negligible, s; `ulp` of the clock, s.
    pub fn ending_with(
        &self,
        limit: &Limit,
        scene: &Scene,
        functions: &[EventFunction],
        negligible: f64,
        ulp: f64,
    ) -> Vec<Limit> {
        let others = functions.iter().enumerate().filter(|&(function, event)| {
            event.trigger == EventKind::Impact
                && function != limit.function
                && !self.panel.excluded[function]
        });
        let width = self.panel.width;
        let ending = others.filter_map(|(function, event)| {
            let restitution = scene.contacts[event.contact].restitution;
            let [c0, c1, c2] = [0, 1, 2].map(|k| self.panel.coefficients[function * ROW + k]);
            if !(c2 < 0.0 && restitution < 1.0) {
                return None;
            }
            let slope = (c1 * c1 - 4.0 * c0.max(0.0) * c2).sqrt();
            let at = (0.5 * (c1 + slope) + restitution / (1.0 - restitution) * slope) / -c2;
            let rest = at * width;
            (rest <= negligible).then(|| Limit {
                function,
                contact: event.contact,
                at,
                bounces: bounces_left(rest, ulp, restitution),
                error: (at - limit.at).abs() * width,
            })
        });
        ending.collect()
    }
}

fn skips(skipped: &[Limit], function: usize) -> bool {
    skipped.iter().any(|limit| limit.function == function)
}

/// Number of bounces of a series with this rest, s, until the rest is an ulp of the clock.
fn bounces_left(rest: f64, ulp: f64, restitution: f64) -> usize {
    ((rest / ulp).ln() / -restitution.ln()).ceil().max(1.0) as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::functional::Functional;

    /// Within the error of zero at the end of a panel, and below it at the start of the next one.
    #[test]
    fn a_root_that_lies_before_a_panel_is_found_there() {
        let trigger = EventKind::Release;
        let functions = [EventFunction::kinematic(0, trigger, Functional::default())];
        let root = |before: f64| {
            let mut search = PanelSearch { before, ..PanelSearch::default() };
            search.begin(std::iter::once(0));
            search.panel.excluded = vec![false];
            search.panel.coefficients = [vec![-0.5e-9, -1e-6], vec![0.0; ROW - 2]].concat();
            search.panel.error = vec![1e-9];
            search.panel.curvature_error = vec![1e-9];
            let (time, value, uncertainty) = (10.0, 0.0, 1e-9);
            let entry = Grazing { time, contact: 0, alternative: trigger, value, uncertainty };
            search.pending = vec![Some(entry)];
            search.waiting = true;
            search.first_crossing(&mut Counters::default(), 10.0, &functions, 1.0, &[])
        };
        assert!((root(1.0).expect("a crossing").1 + 0.5e-3).abs() < 1e-15);
        assert_eq!(root(1e-4), Some((0, -1e-4)));
        assert_eq!(root(0.0), Some((0, 0.0)));
    }

    /// After a bounce its speed opens a gap, after a release its third derivative; the next coefficient closes it later.
    #[test]
    fn a_gap_that_has_just_opened_is_not_zero() {
        for multiplicity in 1..=3 {
            let mut search = PanelSearch { exact: true, ..PanelSearch::default() };
            search.begin(std::iter::once(multiplicity));
            search.panel.excluded = vec![false];
            let zeros = |count| vec![0.0; count];
            let opening = [zeros(multiplicity), vec![1e-3, -2e-3], zeros(ROW - multiplicity - 2)];
            search.panel.coefficients = opening.concat();
            search.panel.error = vec![1e-12];
            search.panel.curvature_error = vec![1e-12];
            for s in [0.0, 1e-12, 1e-9, 1e-3, 0.4] {
                assert!(!search.vanishes(0, EventKind::Impact, s), "{multiplicity}, {s}");
            }
            assert!(search.vanishes(0, EventKind::Impact, 0.5));
        }
    }

    /// The coefficients of a function that is excluded are those of an earlier panel.
    #[test]
    fn what_an_envelope_excludes_has_no_coefficients_that_count() {
        let trigger = EventKind::SlipPositive;
        let functions = [EventFunction::kinematic(0, trigger, Functional::default())];
        let mut search = PanelSearch::default();
        search.panel.excluded = vec![true];
        search.panel.coefficients = [vec![1.0, -2.0], vec![0.0; ROW - 2]].concat();
        search.panel.error = vec![1e-12];
        search.panel.curvature_error = vec![1e-12];
        for multiplicity in 0..3 {
            search.begin(std::iter::once(multiplicity));
            let mut counters = Counters::default();
            let found = search.first_crossing(&mut counters, 0.0, &functions, 1.0, &[]);
            assert_eq!((found, counters.refinements), (None, 0));
            assert!(!search.vanishes(0, trigger, 1.0));
            assert_eq!(search.gap_error(0, 1.0), 0.0);
        }
    }
}
