//! Laws of friction: the coefficient mu over the slip speed |s|; and laws of springs: the force over the stretch.

use std::sync::Arc;

use crate::error::input::Error;
use crate::numerics::bracket::Bracket;
use crate::numerics::interval::Jet;
use crate::scene::friction::decay::{Decay, LEVEL};
use crate::scene::friction::formula::{Formula, GivenOperation};

/// mu over |s|.
#[derive(Debug, Clone, PartialEq)]
pub enum FrictionLaw {
    /// `mu = at_rest + slope |s|`
    Linear {
        /// mu at rest, -, not negative.
        at_rest: f64,
        /// d mu / d |s|, s/m, of either sign.
        slope: f64,
    },
    /// `mu = kinetic + (at_rest - kinetic) g(|s| / speed) + viscous |s|`
    Decaying {
        /// mu at rest, -, not negative.
        at_rest: f64,
        /// mu at large speeds, without the viscous part, -, not negative.
        kinetic: f64,
        /// Scale of the speed over which mu passes from one to the other, m/s, positive.
        speed: f64,
        /// Growth of mu with speed, s/m, not negative.
        viscous: f64,
        /// g
        decay: Decay,
    },
    /// Cubic pieces between measured speeds, constant beyond the last one.
    Tabulated(Arc<Table>),
    /// Elementary operations; see [`FrictionLaw::formula`].
    Formula(Arc<Formula>),
    /// Of springs alone; see [`FrictionLaw::power`].
    Pieces(Arc<Pieces>),
}

/// Laws that hold one from each knot to the next and have the same value there, 0 at 0; none of them is a table.
#[derive(Debug, Clone, PartialEq)]
pub struct Pieces {
    /// Ascending; the first law holds before its knot as well.
    pub knots: Vec<f64>,
    /// One from each knot on.
    pub laws: Vec<FrictionLaw>,
}

/// `mu = c_0 + c_1 d + c_2 d^2 + c_3 d^3` with `d = |s| - speeds[i]` between two speeds.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// Ascending from 0, m/s.
    pub speeds: Vec<f64>,
    /// One piece more than there are intervals: the last one holds beyond the last speed.
    pub pieces: Vec<[f64; 4]>,
}

/// Difference of two pieces where they meet that is the rounding of their coefficients, relative to their terms.
const JOINED: f64 = 1e-12;
/// Halvings after which no interval of numbers is left.
const STEPS: usize = 200;

/// A number of a law: its name, its value, what it has to be, and whether it is.
type Check = (&'static str, f64, &'static str, bool);

/// The error of the first number that is not what it has to be.
fn refused(checks: Vec<Check>, named: impl Fn(&str) -> String) -> Result<(), Error> {
    match checks.into_iter().find(|&(_, value, _, holds)| !(holds && value.is_finite())) {
        None => Ok(()),
        Some((name, value, requirement, _)) => Err(Error::Range {
            argument: named(name),
            requirement: if value.is_finite() { requirement } else { "finite" },
            value,
        }),
    }
}

impl Table {
    /// The slip speed from which on its last piece is level; None if it falls or is level before.
    fn rises_until(&self) -> Option<f64> {
        let (&last, rising) = self.speeds.split_last()?;
        let mut end = last;
        for (place, &speed) in rising.iter().enumerate() {
            let [_, b, c, d] = self.pieces[place];
            let width = self.speeds[place + 1] - speed;
            let slope = |x: f64| b + x * (2.0 * c + 3.0 * x * d);
            let turn = (-c / (3.0 * d)).clamp(0.0, width);
            let least = if d == 0.0 { b } else { b.min(slope(turn)) };
            if place + 1 < rising.len() {
                if !(least.min(slope(width)) > 0.0) {
                    return None;
                }
            } else if !(b > 0.0) {
                return None;
            } else {
                // The slope falls to that of the level part; it is a parabola.
                let (mut low, mut high) = (0.0, width);
                for _ in 0..STEPS {
                    let middle = 0.5 * (low + high);
                    if slope(middle) > LEVEL * b { low = middle } else { high = middle }
                }
                if !(slope(turn.min(low)) > 0.0) {
                    return None;
                }
                end = speed + low;
            }
        }
        Some(end)
    }

    /// A bound of |d mu / d |s|| between two slip speeds, over all pieces there.
    pub(crate) fn steepest(&self, from: f64, to: f64) -> f64 {
        let steepest = |place: usize| {
            let [_, b, c, d] = self.pieces[place];
            let end = self.speeds.get(place + 1).map_or(to, |&next| next.min(to));
            let x = (end - self.speeds[place]).max(0.0);
            b.abs() + x * (2.0 * c.abs() + 3.0 * x * d.abs())
        };
        (self.piece(from)..=self.piece(to)).map(steepest).fold(0.0, f64::max)
    }

    /// The first speed at which two pieces do not join, beyond rounding.
    fn gap(&self) -> Option<f64> {
        let pairs = self.pieces.windows(2).zip(self.speeds.windows(2));
        let mut gaps = pairs.filter(|(pieces, speeds)| {
            let x = speeds[1] - speeds[0];
            let [a, b, c, d] = pieces[0];
            let terms = [a, b * x, c * x * x, d * x * x * x];
            let size: f64 = terms.iter().map(|term| term.abs()).sum();
            (terms.iter().sum::<f64>() - pieces[1][0]).abs() > JOINED * size
        });
        gaps.next().map(|(_, speeds)| speeds[1])
    }

    /// What has to hold of every table: its knots ascend, and its pieces join.
    fn checks(&self) -> Vec<Check> {
        let ascends = |pair: &[f64]| pair[0] < pair[1];
        let last = self.speeds.last().copied().unwrap_or(f64::NAN);
        let whole = self.speeds.len() == self.pieces.len();
        let mut checks =
            vec![("speeds", last, "ascending", whole && self.speeds.windows(2).all(ascends))];
        let coefficients = self.pieces.iter().flatten();
        checks.extend(coefficients.map(|&c| ("pieces", c, "finite", true)));
        if let Some(speed) = self.gap().filter(|_| whole) {
            checks.push(("pieces", speed, "joined at every speed", false));
        }
        checks
    }

    /// The piece that holds at a speed; at the border of two the one above it.
    pub fn piece(&self, speed: f64) -> usize {
        piece_at(&self.speeds, speed)
    }
}

pub(crate) fn piece_at(knots: &[f64], at: f64) -> usize {
    knots.partition_point(|&knot| knot <= at).max(1) - 1
}

impl Pieces {
    /// The parts of a range, each with the law that holds there.
    fn within(&self, from: f64, to: f64) -> impl Iterator<Item = (&FrictionLaw, [f64; 2])> {
        let range = piece_at(&self.knots, from)..=piece_at(&self.knots, to);
        range.map(move |place| {
            let low = if place == 0 { from } else { self.knots[place].max(from) };
            let high = self.knots.get(place + 1).map_or(to, |&next| next.min(to));
            (&self.laws[place], [low, high])
        })
    }
}

impl FrictionLaw {
    /// A law by the operations that give mu, in the last slot, from the slip speed, in slot 0: `constant` (the number), `add`,
    /// `subtract`, `multiply`, `divide` (of two slots), `exp`, `log`, `tanh` (of the first slot) and `power` (the first slot to
    /// the number).
    pub fn formula(given: &[GivenOperation]) -> Result<Self, Error> {
        let formula = Formula::new(given)?;
        Ok(match formula.line() {
            Some([at_rest, slope]) => Self::Linear { at_rest, slope },
            None => Self::Formula(Arc::new(formula)),
        })
    }

    /// `K u^p` of a stretch `u > 0`, 0 below, with K > 0 and p > 1. It has no Taylor series at `u = 0`. Up to the stretch delta
    /// of a small force `K delta^p`, a straight line takes its place, so that the force is off by less than this one and
    /// the energy of every larger stretch u by a part `|p - 1| / 2 (delta / u)^(p + 1)`.
    pub fn power(stiffness: f64, exponent: f64, straight_below: f64) -> Result<Self, Error> {
        let checks = vec![
            ("stiffness", stiffness, "> 0", stiffness > 0.0),
            ("exponent", exponent, "> 1", exponent > 1.0),
            ("straight_below", straight_below, "> 0", straight_below > 0.0),
        ];
        refused(checks, |name| format!("law: {name}"))?;
        let border = (straight_below / stiffness).powf(exponent.recip());
        let slope = straight_below / border;
        let all = [stiffness, exponent, border, slope];
        if !all.iter().all(|x| x.is_normal()) {
            let argument = "law: straight_below".to_owned();
            let requirement = "such that the stretch of this force is within the range of numbers";
            return Err(Error::Range { argument, requirement, value: straight_below });
        }
        let step = |name: &str, of: [usize; 2], number| (name.to_owned(), of[0], of[1], number);
        let operations = [
            step("power", [0, 0], exponent),
            step("constant", [0, 0], stiffness),
            step("multiply", [1, 2], 0.0),
        ];
        let line = |slope: f64| Self::Linear { at_rest: 0.0, slope };
        Ok(Self::Pieces(Arc::new(Pieces {
            knots: vec![-border, 0.0, border],
            laws: vec![line(0.0), line(slope), Self::formula(&operations)?],
        })))
    }

    /// Where its pieces begin; empty where one formula holds everywhere.
    pub(crate) fn knots(&self) -> &[f64] {
        match self {
            Self::Tabulated(table) => &table.speeds,
            Self::Pieces(pieces) => &pieces.knots,
            _ => &[],
        }
    }

    /// The piece that holds at an argument; at the border of two the one above it.
    pub(crate) fn piece(&self, at: f64) -> usize {
        piece_at(self.knots(), at)
    }

    /// The law that holds on a piece; a table is one law.
    pub(crate) fn on(&self, piece: usize) -> &Self {
        match self {
            Self::Pieces(pieces) => &pieces.laws[piece],
            law => law,
        }
    }

    fn at(&self, argument: f64) -> &Self {
        self.on(self.piece(argument))
    }

    /// The same from an argument of zero on, without the pieces that end before.
    pub(crate) fn beyond_zero(&self) -> Self {
        let first = self.piece(0.0);
        match self {
            Self::Tabulated(table) => Self::Tabulated(Arc::new(Table {
                speeds: table.speeds[first..].to_vec(),
                pieces: table.pieces[first..].to_vec(),
            })),
            Self::Pieces(pieces) => Self::Pieces(Arc::new(Pieces {
                knots: pieces.knots[first..].to_vec(),
                laws: pieces.laws[first..].to_vec(),
            })),
            law => law.clone(),
        }
    }

    /// The same function less a straight line, from its value and slope at zero.
    pub(crate) fn less_line(&self, [value, slope]: [f64; 2]) -> Self {
        match self {
            Self::Tabulated(table) => {
                let Table { speeds, pieces } = &**table;
                let pieces = speeds
                    .iter()
                    .zip(pieces)
                    .map(|(&knot, &[a, b, c, d])| [a - value - slope * knot, b - slope, c, d]);
                let pieces = pieces.collect();
                Self::Tabulated(Arc::new(Table { speeds: speeds.clone(), pieces }))
            }
            Self::Formula(formula) => Self::Formula(Arc::new(formula.less_line(value, slope))),
            Self::Linear { at_rest, slope: own } => {
                Self::Linear { at_rest: at_rest - value, slope: own - slope }
            }
            Self::Pieces(pieces) => Self::Pieces(Arc::new(Pieces {
                knots: pieces.knots.clone(),
                laws: pieces.laws.iter().map(|law| law.less_line([value, slope])).collect(),
            })),
            Self::Decaying { .. } => self.clone(),
        }
    }

    /// Refuses numbers for which mu would be negative or not a function of speed.
    pub(crate) fn validate(&self, contact: usize) -> Result<(), Error> {
        let checks: Vec<Check> = match self {
            &Self::Linear { at_rest, slope } => {
                vec![
                    ("mu0", at_rest, ">= 0", at_rest >= 0.0),
                    ("slope", slope, ">= 0 where mu0 is 0", at_rest != 0.0 || slope >= 0.0),
                ]
            }
            &Self::Decaying { at_rest, kinetic, speed, viscous, .. } => vec![
                ("static", at_rest, ">= 0", at_rest >= 0.0),
                ("kinetic", kinetic, ">= 0", kinetic >= 0.0),
                ("speed", speed, "> 0", speed > 0.0),
                ("viscous", viscous, ">= 0", viscous >= 0.0),
            ],
            Self::Tabulated(table) => {
                let first = table.speeds.first().copied().unwrap_or(f64::NAN);
                let mut checks = vec![("speeds", first, "0 at first", first == 0.0)];
                let values = table.pieces.iter().map(|piece| piece[0]);
                checks.extend(values.map(|value| ("values", value, ">= 0", value >= 0.0)));
                checks.extend(table.checks());
                checks
            }
            Self::Pieces(pieces) => {
                vec![("pieces", pieces.knots[0], "those of a law of springs", false)]
            }
            Self::Formula(formula) => {
                let Jet { value, first, second } = formula.jet(0.0);
                vec![
                    ("formula: mu at rest", value, ">= 0", value >= 0.0),
                    ("formula: its slope at rest", first, "finite", true),
                    ("formula: its curvature at rest", second, "finite", true),
                    (
                        "formula: its slope at rest",
                        first,
                        ">= 0 where mu is 0",
                        value != 0.0 || first >= 0.0,
                    ),
                    (
                        "formula: its curvature at rest",
                        second,
                        ">= 0 where mu and its slope are 0",
                        value != 0.0 || first != 0.0 || second >= 0.0,
                    ),
                ]
            }
        };
        refused(checks, |name| format!("contact {contact}: friction: {name}"))
    }

    /// Refuses a table that is no function of the argument of an element.
    pub(crate) fn validate_force(&self, argument: &str) -> Result<(), Error> {
        let Self::Tabulated(table) = self else { return Ok(()) };
        refused(table.checks(), |name| format!("{argument}: {name}"))
    }

    /// mu at a slip speed >= 0.
    pub fn value(&self, speed: f64) -> f64 {
        match self {
            Self::Linear { at_rest, slope } => at_rest + slope * speed,
            Self::Decaying { at_rest, kinetic, speed: scale, viscous, decay } => {
                kinetic + (at_rest - kinetic) * decay.value(speed / scale) + viscous * speed
            }
            Self::Tabulated(table) => {
                let place = table.piece(speed);
                let [a, b, c, d] = table.pieces[place];
                let x = speed - table.speeds[place];
                a + x * (b + x * (c + x * d))
            }
            Self::Formula(formula) => formula.jet(speed).value,
            Self::Pieces(_) => self.at(speed).value(speed),
        }
    }

    /// Its slope, s/m, where it is the same at every slip speed.
    pub(crate) fn linear(&self) -> Option<f64> {
        match self {
            Self::Linear { slope, .. } => Some(*slope),
            Self::Decaying { at_rest, kinetic, viscous, .. } => {
                (at_rest == kinetic).then_some(*viscous)
            }
            Self::Tabulated(_) | Self::Formula(_) | Self::Pieces(_) => None,
        }
    }

    /// Whether it falls with the slip speed somewhere.
    pub(crate) fn falls(&self) -> bool {
        match self {
            Self::Linear { slope, .. } => *slope < 0.0,
            // Its slope is least at rest if it is negative anywhere.
            Self::Decaying { .. } => self.slope(0.0) < 0.0,
            Self::Tabulated(table) => table.pieces.windows(2).any(|pair| pair[1][0] < pair[0][0]),
            Self::Formula(formula) => formula.falls(),
            Self::Pieces(pieces) => pieces.laws.iter().any(Self::falls),
        }
    }

    /// The slip speed up to which mu rises: its slope is positive from rest on, and beyond that speed less than about `LEVEL`
    /// of its rise is left. Infinite where it rises without end; None if it falls or is level before.
    pub(crate) fn rises_until(&self) -> Option<f64> {
        let end = match self {
            Self::Linear { .. } => f64::INFINITY,
            // Its slope lies between that at rest and the viscous one.
            Self::Decaying { viscous, .. } if *viscous > 0.0 => f64::INFINITY,
            Self::Decaying { speed, decay, .. } => speed * decay.level(),
            Self::Tabulated(table) => table.rises_until()?,
            Self::Formula(formula) => formula.rises_until()?,
            Self::Pieces(_) => return None,
        };
        (self.slope(0.0) > 0.0).then_some(end)
    }

    /// `mu(|s|) - mu(0)`
    pub(crate) fn excess(&self, speed: f64) -> f64 {
        match self {
            Self::Linear { slope, .. } => slope * speed,
            Self::Decaying { at_rest, kinetic, speed: scale, viscous, decay } => {
                (kinetic - at_rest) * decay.loss(speed / scale) + viscous * speed
            }
            Self::Tabulated(table) => match table.pieces[0] {
                [_, b, c, d] if table.piece(speed) == 0 => speed * (b + speed * (c + speed * d)),
                [at_rest, ..] => self.value(speed) - at_rest,
            },
            Self::Formula(_) | Self::Pieces(_) => self.value(speed) - self.value(0.0),
        }
    }

    /// The slip speed at which a law that rises has this `mu(|s|) - mu(0)`, at most the one up to which it rises; somewhat below
    /// 0 where the excess is.
    pub(crate) fn speed_at(&self, excess: f64) -> f64 {
        // A law that does not rise from rest on has no other speed.
        let end = self.rises_until().unwrap_or(0.0);
        let guess = excess / self.slope(0.0);
        if let Self::Linear { .. } = self {
            return guess;
        }
        if !(excess > 0.0) {
            // Rounding: the law goes on as it begins.
            return guess;
        }
        let (mut low, mut high) = (0.0, guess.min(end));
        while self.excess(high) < excess {
            if high >= end {
                return end;
            }
            (low, high) = (high, (2.0 * high).min(end));
        }
        let off = |speed: f64| (self.excess(speed) - excess, self.slope(speed));
        Bracket { low, high }.root([low, high].map(|speed| off(speed).0), 0.0, off)
    }

    /// Bounds of |d mu / d |s||, s/m, and of its own slope, s^2/m^2, from a slip speed >= 0 to another.
    pub(crate) fn steepness(&self, speed: f64, to: f64) -> [f64; 2] {
        match self {
            Self::Linear { slope, .. } => [slope.abs(), 0.0],
            Self::Decaying { at_rest, kinetic, speed: scale, viscous, decay } => {
                let falling = (at_rest - kinetic).abs() / scale;
                let [rate, curvature] = decay.rates(decay.value(speed / scale));
                [viscous + falling * rate, falling * curvature / scale]
            }
            Self::Tabulated(table) => {
                let mut widths = table.speeds.windows(2).map(|pair| pair[1] - pair[0]);
                let pieces = table.pieces.iter().map(|[_, b, c, d]| {
                    let width = widths.next().unwrap_or(0.0);
                    let curved = 2.0 * c.abs() + 6.0 * d.abs() * width;
                    [b.abs() + width * curved, curved]
                });
                pieces.fold([0.0; 2], |[a, b], [slope, curvature]| [a.max(slope), b.max(curvature)])
            }
            Self::Formula(formula) => {
                let Jet { first, second, .. } = formula.between(speed, to);
                [first.largest(), second.largest()]
            }
            Self::Pieces(pieces) => {
                let parts =
                    pieces.within(speed, to).map(|(law, [low, high])| law.steepness(low, high));
                parts.fold([0.0; 2], |[a, b], [slope, curvature]| [a.max(slope), b.max(curvature)])
            }
        }
    }

    /// d mu / d |s| at a slip speed >= 0, s/m.
    pub fn slope(&self, speed: f64) -> f64 {
        match self {
            Self::Linear { slope, .. } => *slope,
            Self::Decaying { at_rest, kinetic, speed: scale, viscous, decay } => {
                let [rate, _] = decay.rates(decay.value(speed / scale));
                viscous - (at_rest - kinetic) / scale * rate
            }
            Self::Tabulated(table) => {
                let place = table.piece(speed);
                let [_, b, c, d] = table.pieces[place];
                let x = speed - table.speeds[place];
                b + x * (2.0 * c + 3.0 * x * d)
            }
            Self::Formula(formula) => formula.jet(speed).first,
            Self::Pieces(_) => self.at(speed).slope(speed),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Cubic pieces through rising values with these slopes, level beyond the last.
    fn table(widths: &[f64], secants: &[f64], slopes: &[f64]) -> FrictionLaw {
        let (mut speeds, mut pieces, mut value) = (vec![0.0], Vec::new(), 0.5);
        for (k, (&width, &secant)) in widths.iter().zip(secants).enumerate() {
            let [from, to] = [slopes[k], slopes.get(k + 1).copied().unwrap_or(0.0)];
            let c = (3.0 * secant - 2.0 * from - to) / width;
            pieces.push([value, from, c, (from + to - 2.0 * secant) / width.powi(2)]);
            speeds.push(speeds[k] + width);
            value += secant * width;
        }
        pieces.push([value, 0.0, 0.0, 0.0]);
        FrictionLaw::Tabulated(Arc::new(Table { speeds, pieces }))
    }

    /// A table is a function of speed: its pieces are numbers, and each ends where the next one begins.
    #[test]
    fn pieces_that_do_not_join_are_refused() {
        let joined = table(&[0.1, 0.3], &[0.4, 0.2], &[0.3, 0.2]);
        assert!(joined.validate(0).is_ok());
        for (piece, of, value) in
            [(0, 1, f64::NAN), (1, 3, f64::INFINITY), (0, 2, 1.0), (2, 0, 0.7)]
        {
            let FrictionLaw::Tabulated(table) = &joined else { continue };
            let mut other = Table::clone(table);
            other.pieces[piece][of] = value;
            let law = FrictionLaw::Tabulated(Arc::new(other));
            assert!(law.validate(0).is_err(), "{law:?}");
        }
    }

    /// Between its flat and its steep pieces Newton's method alternates, and has to be kept from it.
    #[test]
    fn a_speed_belongs_to_its_friction() {
        let (widths, secants) = ([2.83, 0.63, 0.23, 2.33], [0.0958, 0.0714, 0.213, 0.0378]);
        let law = table(&widths, &secants, &[0.1157, 0.0794, 0.1159, 0.0793]);
        let end = law.rises_until().expect("a law that rises");
        for k in 1..=1000 {
            let speed = f64::from(k) * 1e-3 * end;
            let excess = law.excess(speed);
            assert!((law.excess(law.speed_at(excess)) - excess).abs() <= 1e-15);
        }
    }
}
