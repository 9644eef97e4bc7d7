//! The coordinates that carry the loads of a scene through time; nothing acts back on them.
//!
//! Each frequency and phase of a scene has an oscillator `h'' = -w^2 h` with `h = c cos(w t + p)`, so that a harmonic load is
//! the force `(a / c) h`; c is such that h is about as large as what the load moves. Coordinates without mass follow h as they
//! follow any other place.
//!
//! Each switched load has a coordinate that is held at its factor, less the first one. The motion of a scene with loads
//! is thus that of a larger scene without: phases, event functions and their derivatives see time as a part of the state.
//!
//! A slider that vibrates carries its tangential coordinate along: q_t is the displacement less that of the vibration,
//! `y = (a / w) cos(w t + p - pi / 2)`, so that the slip velocity stays `q_t' - v`, and sticking `q_t' = v`. What `M y''`,
//! `C y'` and `K y` load is part of the coupling to (h, h').

use std::borrow::Cow;

use crate::error::input::Error;

/// The coordinates that carry the loads of a scene, after those of the structure.
#[derive(Debug, Clone, Default)]
pub(crate) struct Drive {
    /// Coordinates of the structure.
    pub structure: usize,
    pub oscillators: Vec<Oscillator>,
    pub switches: Vec<Switch>,
    pub carried: Vec<Carried>,
    pub forces: Vec<Force>,
}

/// `h = scale cos(rate t + phase)`
#[derive(Debug, Clone)]
pub(crate) struct Oscillator {
    pub coordinate: usize,
    /// 2 pi f, 1/s.
    pub rate: f64,
    /// p, rad.
    pub phase: f64,
    /// c, m.
    pub scale: f64,
}

/// A factor that is held between the times.
#[derive(Debug, Clone)]
pub(crate) struct Switch {
    pub coordinate: usize,
    pub times: Vec<f64>,
    /// The factors less the first one, which is part of the constant force.
    pub values: Vec<f64>,
}

/// The displacement of a vibrating slider, `factor h`.
#[derive(Debug, Clone)]
pub(crate) struct Carried {
    pub tangential: usize,
    pub oscillator: Oscillator,
    pub factor: f64,
}

/// `factor h` on a coordinate of the structure, of a stated load.
#[derive(Debug, Clone)]
pub(crate) struct Force {
    pub row: usize,
    pub coordinate: usize,
    pub factor: f64,
}

/// Periods of each load up to which a common one is looked for; a message names it.
const COMMON: u64 = 1000;
/// Distance of the ratio of two frequencies from a fraction, relative to it, that is rounding of the frequencies.
const SAME: f64 = 1e-12;

impl Oscillator {
    /// (h, h') at a time.
    pub fn at(&self, time: f64) -> (f64, f64) {
        let (sine, cosine) = (self.rate * time + self.phase).sin_cos();
        (self.scale * cosine, -self.scale * self.rate * sine)
    }
}

impl Switch {
    /// The factor from a time on, less the first one.
    pub fn at(&self, time: f64) -> f64 {
        self.values[self.times.partition_point(|&step| step <= time)]
    }
}

impl Drive {
    /// The shortest period of all oscillators, s; None where there is none.
    pub fn period(&self) -> Option<Result<f64, Error>> {
        let first = self.oscillators.first()?;
        let hertz = |rate: f64| rate / std::f64::consts::TAU;
        // All rates in terms of that of the first, as fractions.
        let fractions: Result<Vec<(u64, u64)>, Error> = self
            .oscillators
            .iter()
            .map(|one| {
                fraction(one.rate / first.rate).ok_or(Error::Incommensurate {
                    first: hertz(first.rate),
                    second: hertz(one.rate),
                })
            })
            .collect();
        Some(fractions.and_then(|fractions| {
            let whole = fractions.iter().fold(1, |whole, &(_, q)| whole / divisor(whole, q) * q);
            let common =
                fractions.iter().fold(0, |common, &(p, q)| divisor(common, p * (whole / q)));
            let periods = whole / common.max(1);
            match periods <= COMMON {
                true => Ok(periods as f64 / hertz(first.rate)),
                false => Err(Error::Incommensurate {
                    first: hertz(first.rate),
                    second: hertz(self.oscillators[self.oscillators.len() - 1].rate),
                }),
            }
        }))
    }

    /// The first time after `time` at which a load is switched.
    pub fn next_switch(&self, time: f64) -> Option<f64> {
        let of = |switch: &Switch| {
            switch.times.get(switch.times.partition_point(|&step| step <= time)).copied()
        };
        self.switches.iter().filter_map(of).min_by(f64::total_cmp)
    }

    /// Sets the factors that hold from a time on.
    pub fn switch(&self, time: f64, q: &mut [f64]) {
        self.switches.iter().for_each(|switch| q[switch.coordinate] = switch.at(time));
    }

    /// The state of a structure at a time, with what carries the loads.
    pub fn extended(&self, q: Vec<f64>, u: Vec<f64>, time: f64) -> (Vec<f64>, Vec<f64>) {
        let count = self.oscillators.len() + self.switches.len();
        let (mut q, mut u) = (q, u);
        q.resize(self.structure + count, 0.0);
        u.resize(self.structure + count, 0.0);
        for oscillator in &self.oscillators {
            (q[oscillator.coordinate], u[oscillator.coordinate]) = oscillator.at(time);
        }
        self.switch(time, &mut q);
        for carried in &self.carried {
            let [y, dy] = carried.at(&q, &u);
            q[carried.tangential] -= y;
            u[carried.tangential] -= dy;
        }
        (q, u)
    }

    /// (q, q') of the structure in contact coordinates that no slider carries.
    pub fn at_rest<'a>(&self, q: &'a [f64], u: &'a [f64]) -> (Cow<'a, [f64]>, Cow<'a, [f64]>) {
        let (mut own_q, mut own_u) =
            (Cow::Borrowed(&q[..self.structure]), Cow::Borrowed(&u[..self.structure]));
        for carried in &self.carried {
            let [y, dy] = carried.at(q, u);
            own_q.to_mut()[carried.tangential] += y;
            own_u.to_mut()[carried.tangential] += dy;
        }
        (own_q, own_u)
    }

    /// The part of the drive that belongs to some of the coordinates, which ascend.
    pub fn restricted(&self, coordinates: &[usize]) -> Self {
        let place = |coordinate: usize| coordinates.binary_search(&coordinate).ok();
        let moves = |k: &mut usize| place(*k).map(|place| *k = place).is_some();
        let mut part = self.clone();
        part.structure = coordinates.partition_point(|&k| k < self.structure);
        part.oscillators.retain_mut(|one| moves(&mut one.coordinate));
        part.switches.retain_mut(|one| moves(&mut one.coordinate));
        part.carried
            .retain_mut(|one| moves(&mut one.tangential) && moves(&mut one.oscillator.coordinate));
        part.forces.retain_mut(|one| moves(&mut one.row) && moves(&mut one.coordinate));
        part
    }

    /// Lets an oscillator move by another scale.
    pub fn rescale(&mut self, coordinate: usize, scale: f64) {
        let of = |one: &mut Oscillator| {
            if one.coordinate == coordinate {
                one.scale = scale;
            }
        };
        self.oscillators.iter_mut().for_each(of);
        for carried in &mut self.carried {
            of(&mut carried.oscillator);
            if carried.oscillator.coordinate == coordinate {
                carried.factor /= scale;
            }
        }
        for force in self.forces.iter_mut().filter(|force| force.coordinate == coordinate) {
            force.factor /= scale;
        }
    }

    /// Adds the stated loads of a state to forces on contact coordinates; switched ones alone, or oscillating ones.
    pub fn add_forces(&self, oscillating: bool, q: &[f64], forces: &mut [f64]) {
        let oscillates =
            |force: &&Force| force.coordinate < self.structure + self.oscillators.len();
        for force in self.forces.iter().filter(|force| oscillates(force) == oscillating) {
            forces[force.row] += force.factor * q[force.coordinate];
        }
    }
}

impl Carried {
    /// (y, y') of the slider's vibration.
    pub fn at(&self, q: &[f64], u: &[f64]) -> [f64; 2] {
        let h = self.oscillator.coordinate;
        [self.factor * q[h], self.factor * u[h]]
    }
}

/// A positive number as a fraction of small numbers, by its continued fraction.
fn fraction(value: f64) -> Option<(u64, u64)> {
    let (mut before, mut now) = ((0, 1), (1, 0));
    let mut rest = value;
    loop {
        let digit = rest.floor();
        if !(digit < COMMON as f64 * COMMON as f64) {
            return None;
        }
        let digit = digit as u64;
        (before, now) = (now, (digit * now.0 + before.0, digit * now.1 + before.1));
        let (p, q) = now;
        if q > COMMON || p > COMMON * COMMON {
            return None;
        }
        if p > 0 && (p as f64 / q as f64 - value).abs() <= SAME * value {
            return Some((p, q));
        }
        rest = 1.0 / (rest - digit as f64);
    }
}

fn divisor(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { divisor(b, a % b) }
}
