//! A law as a list of elementary operations on its argument, the tape.
//!
//! The tape alone defines the law: its value, its derivatives, bounds of both over intervals, its Taylor series along a motion
//! and the error of that series ([`crate::motion::friction::series::formula_series`]) all follow operation by operation.

use std::sync::OnceLock;

use crate::error::input::Error;
use crate::numerics::interval::{Interval, Jet, Number};
use crate::scene::friction::decay::LEVEL;

/// One operation on slots before its own; slot 0 holds the argument, and the k-th operation fills slot k + 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Operation {
    Constant(f64),
    /// The state of a contact, beside its slip speed.
    State,
    /// `factor x + shift`
    Affine {
        of: usize,
        factor: f64,
        shift: f64,
    },
    Sum(usize, usize),
    Product(usize, usize),
    Quotient(usize, usize),
    Exponential(usize),
    Logarithm(usize),
    /// Of a positive number to an exponent that is no small whole number.
    Power(usize, f64),
    /// The slot that follows holds the square of this one.
    Tangent(usize),
    /// The second slot holds `1 + x^2`.
    Arctangent(usize, usize),
    /// The slot that follows holds the cosine.
    Sine(usize),
    /// The slot before holds the sine.
    Cosine(usize),
}

/// An operation as it is given: its name, one or two slots, and a number.
pub type GivenOperation = (String, usize, usize, f64);

/// A law of friction by its tape; the last slot holds mu.
#[derive(Debug, Clone)]
pub struct Formula {
    operations: Vec<Operation>,
    /// The speed up to which it rises, once it was asked for.
    rises_until: OnceLock<Option<f64>>,
}

/// Operations that a formula may have.
const LONGEST: usize = 256;
/// Whole exponents up to which a power is made of products.
const PRODUCTS: f64 = 64.0;
/// Speeds from one at which its slope is looked at to the next, relative to it.
const STRIDE: f64 = 1.25;
/// Such speeds until a law that rises counts as one that rises without end.
const STRIDES: usize = 150;
/// How often a part in which the slope may vanish is halved.
const HALVINGS: usize = 10;

impl PartialEq for Formula {
    fn eq(&self, other: &Self) -> bool {
        self.operations == other.operations
    }
}

/// Gives each operation its slot: what is constant or affine is one operation, whatever its parts were.
#[derive(Default)]
struct Builder {
    operations: Vec<Operation>,
    /// The sign of the slip velocity.
    direction: f64,
}

impl Builder {
    fn push(&mut self, operation: Operation) -> usize {
        self.operations.push(operation);
        self.operations.len()
    }

    fn constant(&self, slot: usize) -> Option<f64> {
        match self.operations.get(slot.checked_sub(1)?)? {
            Operation::Constant(value) => Some(*value),
            _ => None,
        }
    }

    fn affine(&mut self, slot: usize, factor: f64, shift: f64) -> usize {
        let inner = slot.checked_sub(1).map(|place| self.operations[place]);
        self.push(match inner {
            _ if factor == 0.0 => Operation::Constant(shift),
            Some(Operation::Constant(value)) => Operation::Constant(factor * value + shift),
            Some(Operation::Affine { of, factor: first, shift: inner }) => {
                Operation::Affine { of, factor: factor * first, shift: factor * inner + shift }
            }
            _ => Operation::Affine { of: slot, factor, shift },
        })
    }

    /// `a + sign b`
    fn sum(&mut self, a: usize, b: usize, sign: f64) -> usize {
        match (self.constant(a), self.constant(b)) {
            (Some(a), _) => self.affine(b, sign, a),
            (_, Some(b)) => self.affine(a, 1.0, sign * b),
            _ if sign < 0.0 => {
                let b = self.affine(b, sign, 0.0);
                self.push(Operation::Sum(a, b))
            }
            _ => self.push(Operation::Sum(a, b)),
        }
    }

    fn product(&mut self, a: usize, b: usize) -> usize {
        match (self.constant(a), self.constant(b)) {
            (Some(a), _) => self.affine(b, a, 0.0),
            (_, Some(b)) => self.affine(a, b, 0.0),
            _ => self.push(Operation::Product(a, b)),
        }
    }

    fn quotient(&mut self, a: usize, b: usize) -> usize {
        match self.constant(b) {
            Some(b) => match self.constant(a) {
                Some(a) => self.push(Operation::Constant(a / b)),
                None => self.affine(a, 1.0 / b, 0.0),
            },
            None => self.push(Operation::Quotient(a, b)),
        }
    }

    fn power(&mut self, slot: usize, exponent: f64) -> usize {
        if let Some(value) = self.constant(slot) {
            return self.push(Operation::Constant(value.powf(exponent)));
        }
        if exponent.fract() != 0.0 || exponent.abs() > PRODUCTS {
            return self.push(Operation::Power(slot, exponent));
        }
        let (mut power, mut left, mut square) = (None, exponent.abs() as u32, slot);
        while left > 0 {
            if left % 2 == 1 {
                power = Some(power.map_or(square, |power| self.product(power, square)));
            }
            left /= 2;
            if left > 0 {
                square = self.product(square, square);
            }
        }
        match power {
            None => self.push(Operation::Constant(1.0)),
            Some(power) if exponent < 0.0 => {
                let one = self.push(Operation::Constant(1.0));
                self.push(Operation::Quotient(one, power))
            }
            Some(power) => power,
        }
    }

    /// A function of one slot, by its value where that is constant.
    fn function(&mut self, slot: usize, of: fn(f64) -> f64, operation: Operation) -> usize {
        match self.constant(slot) {
            Some(value) => self.push(Operation::Constant(of(value))),
            None => self.push(operation),
        }
    }

    /// The slots of both.
    fn sine_and_cosine(&mut self, slot: usize) -> [usize; 2] {
        if let Some(value) = self.constant(slot) {
            return [value.sin(), value.cos()].map(|part| self.push(Operation::Constant(part)));
        }
        let known = self.operations.iter().position(|one| *one == Operation::Sine(slot));
        let sine = known.map_or_else(
            || {
                self.push(Operation::Sine(slot));
                self.push(Operation::Cosine(slot)) - 1
            },
            |place| place + 1,
        );
        [sine, sine + 1]
    }

    fn given(&mut self, slots: &[usize], given: &GivenOperation) -> Result<usize, Error> {
        let (name, first, second, number) = given;
        let of = |place: usize| {
            let slot = slots.get(place).copied();
            slot.ok_or_else(|| refused("operations", format!("{name} of slot {place}")))
        };
        Ok(match &name[..] {
            "constant" => self.push(Operation::Constant(*number)),
            "direction" => self.push(Operation::Constant(self.direction)),
            "state" => self.push(Operation::State),
            "add" => self.sum(of(*first)?, of(*second)?, 1.0),
            "subtract" => self.sum(of(*first)?, of(*second)?, -1.0),
            "multiply" => self.product(of(*first)?, of(*second)?),
            "divide" => self.quotient(of(*first)?, of(*second)?),
            "exp" => self.function(of(*first)?, f64::exp, Operation::Exponential(of(*first)?)),
            "log" => self.function(of(*first)?, f64::ln, Operation::Logarithm(of(*first)?)),
            "power" => self.power(of(*first)?, *number),
            "tanh" => {
                let slot = of(*first)?;
                let tangent = self.function(slot, f64::tanh, Operation::Tangent(slot));
                if let Some(Operation::Tangent(_)) = self.operations.last() {
                    self.push(Operation::Product(tangent, tangent));
                }
                tangent
            }
            "arctan" => {
                let slot = of(*first)?;
                let square = self.product(slot, slot);
                let more = self.affine(square, 1.0, 1.0);
                self.function(slot, f64::atan, Operation::Arctangent(slot, more))
            }
            "sin" => self.sine_and_cosine(of(*first)?)[0],
            "cos" => self.sine_and_cosine(of(*first)?)[1],
            _ => return Err(refused("operations", name.clone())),
        })
    }

    /// The operations that a slot needs, which comes last.
    fn needed(&self, last: usize) -> Vec<Operation> {
        let mut needed = vec![false; self.operations.len() + 1];
        needed[last] = true;
        for slot in (1..=last).rev().filter(|&slot| slot > 0) {
            if !needed[slot] {
                continue;
            }
            match self.operations[slot - 1] {
                Operation::Constant(_) | Operation::State => {}
                Operation::Affine { of, .. }
                | Operation::Exponential(of)
                | Operation::Logarithm(of)
                | Operation::Power(of, _) => needed[of] = true,
                Operation::Tangent(of) | Operation::Sine(of) => {
                    (needed[of], needed[slot + 1]) = (true, true);
                }
                Operation::Cosine(of) => (needed[of], needed[slot - 1]) = (true, true),
                Operation::Sum(a, b)
                | Operation::Product(a, b)
                | Operation::Quotient(a, b)
                | Operation::Arctangent(a, b) => {
                    (needed[a], needed[b]) = (true, true);
                }
            }
        }
        let mut slots = vec![0; self.operations.len() + 1];
        let mut kept = Vec::new();
        for slot in (1..needed.len()).filter(|&slot| needed[slot]) {
            let moved = self.operations[slot - 1].moved(&slots);
            kept.push(moved);
            slots[slot] = kept.len();
        }
        // The square of a hyperbolic tangent follows it, and the cosine its sine.
        if slots[last] != kept.len() {
            kept.push(Operation::Affine { of: slots[last], factor: 1.0, shift: 0.0 });
        }
        kept
    }
}

impl Operation {
    fn moved(self, slots: &[usize]) -> Self {
        match self {
            Self::Constant(_) | Self::State => self,
            Self::Affine { of, factor, shift } => Self::Affine { of: slots[of], factor, shift },
            Self::Sum(a, b) => Self::Sum(slots[a], slots[b]),
            Self::Product(a, b) => Self::Product(slots[a], slots[b]),
            Self::Quotient(a, b) => Self::Quotient(slots[a], slots[b]),
            Self::Exponential(of) => Self::Exponential(slots[of]),
            Self::Logarithm(of) => Self::Logarithm(slots[of]),
            Self::Power(of, exponent) => Self::Power(slots[of], exponent),
            Self::Tangent(of) => Self::Tangent(slots[of]),
            Self::Arctangent(of, more) => Self::Arctangent(slots[of], slots[more]),
            Self::Sine(of) => Self::Sine(slots[of]),
            Self::Cosine(of) => Self::Cosine(slots[of]),
        }
    }

    fn apply<T: Number>(self, slots: &[Jet<T>], state: Jet<T>) -> Jet<T> {
        match self {
            Self::Constant(value) => Jet::constant(value),
            Self::State => state,
            Self::Affine { of, factor, shift } => slots[of].affine(factor, shift),
            Self::Sum(a, b) => slots[a].sum(slots[b]),
            Self::Product(a, b) => slots[a].product(slots[b]),
            Self::Quotient(a, b) => slots[a].quotient(slots[b]),
            Self::Exponential(of) => slots[of].exp(),
            Self::Logarithm(of) => slots[of].ln(),
            Self::Power(of, exponent) => slots[of].powf(exponent),
            Self::Tangent(of) => slots[of].tanh(),
            Self::Arctangent(of, _) => slots[of].atan(),
            Self::Sine(of) => slots[of].sin(),
            Self::Cosine(of) => slots[of].cos(),
        }
    }

    /// How far the argument may move from where the slots are on one panel: to half of the distance at which a divisor, or what a
    /// logarithm or a power is taken of, would vanish, or an arctangent is infinite, and until an exponential has changed by a factor
    /// of e; further, where it is small, as the factors by which it grows and falls make of its bound at most e^2.
    fn reach(self, slots: &[Jet<f64>]) -> f64 {
        let change = |of: usize, size: f64| match slots[of].first {
            0.0 => f64::INFINITY,
            slope => size / slope.abs(),
        };
        match self {
            Self::Constant(_)
            | Self::State
            | Self::Affine { .. }
            | Self::Sum(..)
            | Self::Product(..) => f64::INFINITY,
            Self::Exponential(of) => change(of, 1.0 + (-slots[of].value).max(0.0) / 3.0),
            Self::Tangent(of) | Self::Sine(of) | Self::Cosine(of) => change(of, 1.0),
            Self::Arctangent(of, more) => change(of, 0.5 * slots[more].value.sqrt()),
            Self::Quotient(_, of) | Self::Logarithm(of) | Self::Power(of, _) => {
                change(of, 0.5 * slots[of].value.abs())
            }
        }
    }
}

/// A slip speed and a state of which one is what derivatives are taken over.
pub(crate) fn seeds<T: Number>(speed: T, state: T) -> [[Jet<T>; 2]; 2] {
    let held = |value| Jet { value, ..Jet::constant(0.0) };
    [[Jet::argument(speed), held(state)], [held(speed), Jet::argument(state)]]
}

fn refused(argument: &str, found: String) -> Error {
    Error::shape(&format!("formula: {argument}"), "operations on slots before them", found)
}

impl Formula {
    /// From the operations as they are given, in order.
    pub(crate) fn new(given: &[GivenOperation]) -> Result<Self, Error> {
        let formula = Self::in_direction(given, 1.0)?;
        match formula.has_state() {
            true => Err(refused("operations", "state".to_owned())),
            false => Ok(formula),
        }
    }

    /// The same with a state, for slip in a direction.
    pub(crate) fn in_direction(given: &[GivenOperation], direction: f64) -> Result<Self, Error> {
        if given.is_empty() || given.len() > LONGEST {
            return Err(refused("operations", format!("{} of 1 to {LONGEST}", given.len())));
        }
        let mut builder = Builder { direction, ..Builder::default() };
        let mut slots = vec![0];
        for operation in given {
            slots.push(builder.given(&slots, operation)?);
        }
        let operations = builder.needed(slots[slots.len() - 1]);
        Ok(Self { operations, rises_until: OnceLock::new() })
    }

    /// The same less `value + slope x`.
    pub(crate) fn less_line(&self, value: f64, slope: f64) -> Self {
        let mut builder = Builder { operations: self.operations.clone(), direction: 1.0 };
        let last = builder.operations.len();
        let line = builder.affine(0, slope, value);
        let left = builder.sum(last, line, -1.0);
        Self { operations: builder.needed(left), rises_until: OnceLock::new() }
    }

    /// Value at 0 and slope, where it is a straight line.
    pub(crate) fn line(&self) -> Option<[f64; 2]> {
        match self.operations[..] {
            [] => Some([0.0, 1.0]),
            [Operation::Constant(value)] => Some([value, 0.0]),
            [Operation::Affine { of: 0, factor, shift }] => Some([shift, factor]),
            _ => None,
        }
    }

    pub(crate) fn operations(&self) -> &[Operation] {
        &self.operations
    }

    pub(crate) fn has_state(&self) -> bool {
        self.operations.contains(&Operation::State)
    }

    /// All slots at an argument and a state.
    pub(crate) fn slots<T: Number>(&self, [argument, state]: [Jet<T>; 2]) -> Vec<Jet<T>> {
        let mut slots = Vec::with_capacity(self.operations.len() + 1);
        slots.push(argument);
        for operation in &self.operations {
            slots.push(operation.apply(&slots, state));
        }
        slots
    }

    /// mu and its derivatives over the slip speed.
    pub(crate) fn jet<T: Number>(&self, argument: T) -> Jet<T> {
        let slots = self.slots([Jet::argument(argument), Jet::constant(0.0)]);
        slots[slots.len() - 1]
    }

    /// The value at a slip speed and a state, and its slopes over the two.
    pub(crate) fn with_slopes(&self, speed: f64, state: f64) -> (f64, [f64; 2]) {
        let [by_speed, by_state] = seeds(speed, state).map(|inputs| {
            let slots = self.slots(inputs);
            slots[slots.len() - 1]
        });
        (by_speed.value, [by_speed.first, by_state.first])
    }

    /// The same over all slip speeds from one to another.
    pub(crate) fn between(&self, low: f64, high: f64) -> Jet<Interval> {
        self.jet(Interval { low, high })
    }

    /// How far the slip speed and the state may move on one panel, each to a half of what it may alone where both may move.
    pub(crate) fn reaches(&self, speed: f64, state: f64) -> [f64; 2] {
        let reach = |inputs| {
            let slots = self.slots(inputs);
            self.operations.iter().map(|one| one.reach(&slots)).fold(f64::INFINITY, f64::min)
        };
        let [by_speed, by_state] = seeds(speed, state);
        match self.has_state() {
            true => [by_speed, by_state].map(|inputs| 0.5 * reach(inputs)),
            false => [reach(by_speed), f64::INFINITY],
        }
    }

    /// How far the slip speed may move on one panel.
    pub(crate) fn reach(&self, speed: f64) -> f64 {
        self.reaches(speed, 0.0)[0]
    }

    /// Its slope is positive everywhere from one slip speed to another.
    fn rises(&self, low: f64, high: f64, halvings: usize) -> bool {
        let middle = 0.5 * (low + high);
        self.between(low, high).first.low > 0.0
            || (halvings > 0
                && self.jet(middle).first > 0.0
                && self.rises(low, middle, halvings - 1)
                && self.rises(middle, high, halvings - 1))
    }

    /// Speeds at which its slope is looked at.
    fn strides(&self) -> impl Iterator<Item = f64> {
        let first = Some(self.reach(0.0)).filter(|reach| reach.is_finite());
        let scale = first.unwrap_or(1.0) / 8.0;
        std::iter::successors(Some(scale), |speed| Some(speed * STRIDE)).take(STRIDES)
    }

    /// The slip speed up to which mu rises, proved by intervals; beyond it, doubling the speed would add less than about
    /// `LEVEL` of what mu has risen by.
    pub(crate) fn rises_until(&self) -> Option<f64> {
        *self.rises_until.get_or_init(|| {
            let at_rest = self.jet(0.0);
            let mut until = 0.0;
            for speed in self.strides() {
                let Jet { value, first, .. } = self.jet(speed);
                let level = first * speed <= LEVEL * (value - at_rest.value);
                if level || !self.rises(until, speed, HALVINGS) {
                    return (until > 0.0 && at_rest.first > 0.0).then_some(until);
                }
                until = speed;
            }
            (at_rest.first > 0.0).then_some(f64::INFINITY)
        })
    }

    pub(crate) fn falls(&self) -> bool {
        self.jet(0.0).first < 0.0 || self.strides().any(|speed| self.jet(speed).first < 0.0)
    }
}
