//! Where a panel ends because a law does: at a speed of a table, or where friction falls to 0.

use crate::motion::friction::motion::{LawMotion, Sliding};
use crate::motion::friction::operator::LawOperator;
use crate::motion::friction::series::law_end::LawEnd;
use crate::motion::friction::series::law_series::UNIT;
use crate::numerics::first_root::polynomial::ROW;
use crate::numerics::first_root::search::{FirstRoot, Verdict};
use crate::scene::friction::law::FrictionLaw;

/// Distance from a speed of a table, relative to it, that is rounding of the motion to it.
const AT_KNOT: f64 = 1e-12;
/// A crossing of a speed of a table nearer than this part of the panel is taken at its start.
const AT_START: f64 = 1e-9;

/// Part of the sizes of its terms below which the normal force of a contact whose slip has no mass counts as zero: as it
/// vanishes, the node relaxes ever faster, and panels would shrink without end.
const PRESSED: f64 = 1e-13;
/// The same where already no panel is short enough for a bound: its node then relaxes too fast for the rounding of places.
const HARDLY_PRESSED: f64 = 1e-2;
/// Part of the time in which its node relaxes that a panel covers at least before it opens: slip then runs away from the series.
const CRAWLING: f64 = 1e-3;

impl LawMotion {
    /// A contact whose slip has no mass and whose slip speed or normal force ends the phase at the start of the panel.
    pub(super) fn end_of_flow(&self, operator: &LawOperator) -> Option<(usize, LawEnd)> {
        let pressed = if self.left_out.is_finite() { PRESSED } else { HARDLY_PRESSED };
        let mut contacts = operator.contacts.iter().zip(&self.contacts).enumerate();
        contacts.find_map(|(place, (one, sliding))| {
            let flow = one.flow.as_ref()?;
            let Sliding { series, normal, at_origin_size, closes, held, .. } = sliding;
            let passes = *closes || *held;
            // What it loses over a usual panel counts as well: its terms are small after a closing.
            let lost = normal[1].abs() * operator.taylor.width() / self.taylor.width;
            let usual = at_origin_size.max(lost);
            let least = match passes {
                true if self.left_out.is_finite() => 0.0,
                true => f64::INFINITY,
                false => pressed * usual,
            };
            let damper = series.slope(&one.law) * normal[0];
            let crawls = !passes
                && normal[0] < HARDLY_PRESSED * usual
                && flow.spring * self.taylor.width < CRAWLING * damper;
            if !(normal[0] > least) || crawls {
                return Some((place, LawEnd::Opening));
            }
            let level = !(series.slip[0] < one.law.rises_until()?);
            level.then_some((place, LawEnd::Level))
        })
    }

    /// Takes the pieces of tables by the direction in which a slip speed leaves a border of two; whether some changed.
    pub(super) fn change_pieces(&mut self, operator: &LawOperator) -> bool {
        let mut changed = false;
        for (one, Sliding { series, .. }) in operator.contacts.iter().zip(&mut self.contacts) {
            let FrictionLaw::Tabulated(table) = &one.law else { continue };
            for (border, beyond) in borders(&table.speeds, series.piece) {
                let outwards = if beyond > series.piece { series.slip[1] } else { -series.slip[1] };
                if (series.slip[0] - border).abs() <= AT_KNOT * border && outwards > 0.0 {
                    series.piece = beyond;
                    changed = true;
                    break;
                }
            }
        }
        changed
    }

    /// Ends the panel where the first slip speed comes to the border of a piece, or the first law to 0.
    pub(super) fn cut(&mut self, operator: &LawOperator) {
        (self.next, self.ends) = (None, None);
        let mut first = 1.0;
        for (place, (one, Sliding { series, .. })) in
            operator.contacts.iter().zip(&self.contacts).enumerate()
        {
            let root = |border: f64, above: bool, end: f64| {
                if series.range() < (series.slip[0] - border).abs() {
                    return None;
                }
                let side = if above { -1.0 } else { 1.0 };
                let mut p = [0.0; ROW];
                p.iter_mut().zip(&series.slip).for_each(|(p, c)| *p = side * c);
                p[0] -= side * border;
                // A panel that begins at the border leaves it.
                let departs = p[0].abs() <= AT_KNOT * border;
                if departs {
                    p.copy_within(1.., 0);
                    p[ROW - 1] = 0.0;
                }
                let error = UNIT * (border.abs() + series.range());
                match self.unit.run(FirstRoot { polynomial: &p, error, end }) {
                    Verdict::Crossing { root, .. } if root > AT_START => Some(root),
                    _ => None,
                }
            };
            let level = one.flow.as_ref().and_then(|_| one.law.rises_until());
            if let Some(border) = level.filter(|border| border.is_finite())
                && let Some(at) = root(border, true, first)
            {
                first = at;
                (self.next, self.ends) = (None, Some((place, LawEnd::Level)));
            }
            match &one.law {
                FrictionLaw::Tabulated(table) => {
                    for (border, beyond) in borders(&table.speeds, series.piece) {
                        if let Some(at) = root(border, beyond > series.piece, first) {
                            first = at;
                            (self.next, self.ends) = (Some((place, beyond)), None);
                        }
                    }
                }
                FrictionLaw::Linear { at_rest, slope } if *slope < 0.0 => {
                    if let Some(at) = root(-at_rest / slope, true, first) {
                        first = at;
                        (self.next, self.ends) = (None, Some((place, LawEnd::Negative)));
                    }
                }
                _ => {}
            }
        }
        if first < 1.0 {
            self.shorten(first);
        }
    }
}

/// The borders of a piece of a table, each with the piece beyond it; rest is none, and the last piece has no end.
fn borders(speeds: &[f64], piece: usize) -> impl Iterator<Item = (f64, usize)> {
    let below = (piece > 0).then(|| (speeds[piece], piece - 1));
    let above = speeds.get(piece + 1).map(|&speed| (speed, piece + 1));
    below.into_iter().chain(above)
}
