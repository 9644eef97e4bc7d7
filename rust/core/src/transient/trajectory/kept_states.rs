//! The states at the starts of the phases of a motion: all of them or, of a long motion of many dofs, every k-th.
//!
//! A run from the same state gives the same motion, so that the states between are restored to the last bit.

use std::num::NonZeroUsize;
use std::ops::{Deref, Range};
use std::sync::{Arc, Mutex, PoisonError};

use lru::LruCache;

use crate::contact::settlement::Departure;

/// Numbers that a motion keeps by default: 256 MB.
pub(crate) const KEPT: usize = 1 << 25;
/// Numbers that there is room for at first: with room for one state, a short motion of few dofs spends a fiftieth of its run on
/// growth.
const FIRST: usize = 1024;
/// Number of intervals between two kept states that are remembered once they have been run again.
const REMEMBERED: NonZeroUsize = NonZeroUsize::new(4).expect("not zero");

/// The kept states, one after the other.
#[derive(Debug)]
pub(crate) struct KeptStates {
    /// Numbers of a state, and contacts of the scene.
    width: usize,
    contacts: usize,
    /// Numbers that may be kept.
    most: usize,
    /// A state is kept every `stride` phases; the stride doubles whenever there is no room or no memory
    /// for another state.
    stride: usize,
    /// Phases so far.
    count: usize,
    values: Vec<f64>,
    /// With which multiplicities the event functions leave zero in the phases of the kept states, by contact.
    departures: Vec<Departure>,
    repeated: Mutex<Option<LruCache<usize, Arc<Vec<f64>>>>>,
}

/// (q, q') at the start of a phase, contact coordinates.
#[derive(Debug)]
pub(crate) enum PhaseState<'a> {
    Kept(&'a [f64]),
    Repeated(Arc<Vec<f64>>, Range<usize>),
}

impl Deref for PhaseState<'_> {
    type Target = [f64];

    fn deref(&self) -> &[f64] {
        match self {
            Self::Kept(state) => state,
            Self::Repeated(states, range) => &states[range.clone()],
        }
    }
}

impl PhaseState<'_> {
    /// (q, q')
    pub fn parts(&self) -> (&[f64], &[f64]) {
        self.split_at(self.len() / 2)
    }
}

impl KeptStates {
    /// Of a scene of n coordinates and some contacts; at least one state is kept, whatever room there is.
    pub fn new(n: usize, contacts: usize, most: usize) -> Self {
        Self {
            width: 2 * n,
            contacts,
            most,
            stride: 1,
            count: 0,
            values: Vec::new(),
            departures: Vec::new(),
            repeated: Mutex::default(),
        }
    }

    /// All states of a motion whose run is not repeated.
    pub fn all(n: usize, values: Vec<f64>) -> Self {
        Self::every(n, 1, values.len() / (2 * n), values)
    }

    /// Of `count` states every `stride`-th, without departures.
    pub fn every(n: usize, stride: usize, count: usize, values: Vec<f64>) -> Self {
        Self { stride, count, values, ..Self::new(n, 0, usize::MAX) }
    }

    pub fn stride(&self) -> usize {
        self.stride
    }

    /// (q, q') of the states that are kept.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Adds the state at the start of the next phase, with its departures where the run may be repeated from there.
    pub fn push(&mut self, q: &[f64], u: &[f64], departures: &[Departure]) {
        let phase = self.count;
        self.count += 1;
        // Most motions keep every state, and need no division for it.
        if self.stride > 1 && !phase.is_multiple_of(self.stride) {
            return;
        }
        let length = self.values.len() + self.width;
        if length > self.values.capacity() && !self.grow() && phase > 0 {
            self.thin();
            if !phase.is_multiple_of(self.stride) {
                return;
            }
        }
        self.values.extend_from_slice(q);
        self.values.extend_from_slice(u);
        self.departures.extend_from_slice(departures);
    }

    /// Makes room for more states, at most twice as many; false if no further one may be kept or there is no memory.
    #[cold]
    fn grow(&mut self) -> bool {
        // Doubling the capacity could exceed what may be kept.
        let room = self.most.saturating_sub(self.values.len()) / self.width;
        let wanted = self.values.len().max(FIRST).div_ceil(self.width).min(room);
        wanted > 0
            && self.departures.try_reserve_exact(wanted * self.contacts).is_ok()
            && self.values.try_reserve_exact(wanted * self.width).is_ok()
    }

    /// Keeps every other one of the kept states.
    fn thin(&mut self) {
        fn halve<T: Copy>(all: &mut Vec<T>, width: usize) {
            if width == 0 {
                return;
            }
            let left = (all.len() / width).div_ceil(2);
            (0..left).for_each(|k| all.copy_within(2 * k * width..(2 * k + 1) * width, k * width));
            all.truncate(left * width);
        }
        halve(&mut self.values, self.width);
        halve(&mut self.departures, self.contacts);
        self.stride *= 2;
        *self.repeated.get_mut().unwrap_or_else(PoisonError::into_inner) = None;
    }

    /// The state at the start of a phase; `again` runs from a phase whose state is kept through some phases.
    pub fn state(
        &self,
        phase: usize,
        again: impl FnOnce(usize, usize) -> Vec<f64>,
    ) -> PhaseState<'_> {
        let (place, beyond) = (phase / self.stride, phase % self.stride);
        if beyond == 0 {
            return PhaseState::Kept(&self.values[self.width * place..self.width * (place + 1)]);
        }
        let first = phase - beyond;
        let mut repeated = self.repeated.lock().unwrap_or_else(PoisonError::into_inner);
        let states = repeated
            .get_or_insert_with(|| LruCache::new(REMEMBERED))
            .get_or_insert(first, || Arc::new(again(first, self.stride.min(self.count - first))));
        PhaseState::Repeated(Arc::clone(states), self.width * beyond..self.width * (beyond + 1))
    }

    /// Departures of a phase whose state is kept.
    pub fn departures(&self, phase: usize) -> &[Departure] {
        let place = phase / self.stride;
        &self.departures[self.contacts * place..self.contacts * (place + 1)]
    }

    /// Bytes of the kept states.
    pub fn bytes(&self) -> usize {
        size_of::<f64>() * self.values.capacity()
            + size_of::<Departure>() * self.departures.capacity()
    }
}
