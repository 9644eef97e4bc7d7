//! States of a computed motion between its events, computed on demand.

use std::sync::Arc;

use num_complex::Complex64;

use crate::contact::contact_forces::ContactForces;
use crate::error::input::Error;
use crate::modes::complex_modes::Modes;
use crate::motion::phase_motion::Motion;
use crate::scene::model::State;
use crate::scene::status::{Combination, Status};
use crate::transient::trajectory::events::Event;
use crate::transient::trajectory::kept_states::PhaseState;
use crate::transient::trajectory::model::Trajectory;
use crate::transient::trajectory::used_bases::HeldBases;

/// Positions and velocities over dofs, contact forces and statuses at a series of instants; row-major.
#[derive(Debug, Clone, Default)]
pub struct Sample {
    /// m, n per instant.
    pub position: Vec<f64>,
    /// m/s, n per instant.
    pub velocity: Vec<f64>,
    /// N >= 0 of every contact, N.
    pub normal_force: Vec<f64>,
    /// T of every contact, N.
    pub friction_force: Vec<f64>,
    /// Of every contact.
    pub status: Vec<Status>,
}

/// Modal coordinates at successive instants within one combination.
#[derive(Debug, Clone)]
pub struct ModalRun {
    /// Status of every contact at these instants.
    pub combination: Combination,
    /// Indices into the times asked for.
    pub indices: Vec<usize>,
    /// One row of 2m per instant.
    pub coordinates: Vec<Complex64>,
}

impl Trajectory {
    /// (q, q') at the start of a phase, contact coordinates.
    pub(crate) fn phase_state(&self, phase: usize) -> PhaseState<'_> {
        if self.local.is_some() || !self.parts.is_empty() {
            let mut cursor = Cursor::new(self);
            cursor.seek_local(phase, 0.0);
            let state = [cursor.q, cursor.u].concat();
            let all = 0..state.len();
            return PhaseState::Repeated(Arc::new(state), all);
        }
        self.states.state(phase, |first, count| {
            let states = self.repetition.map(|run| (run.again)(self, run, first, count));
            states.map_or_else(Vec::new, |states| {
                states.unwrap_or_else(|failure| panic!("a run cannot be repeated: {failure}"))
            })
        })
    }

    /// (position, velocity) over dofs just after an event.
    pub fn event_state(&self, event: &Event) -> (Vec<f64>, Vec<f64>) {
        let state = self.phase_state(event.phase);
        let (q, u) = state.parts();
        self.scene().dof_state(q, u)
    }

    /// The state at a time within the motion; at an event time the state after it.
    pub fn state(&self, time: f64) -> Result<State, Error> {
        let mut cursor = Cursor::new(self);
        cursor.seek("time", time)?;
        let combination = self.combination_of(cursor.phase);
        Ok(self.scene().state(&cursor.q, &cursor.u, &combination))
    }

    /// (q, q') at a time within the motion; at an event time those after it.
    pub(crate) fn coordinates(&self, time: f64) -> Result<(Vec<f64>, Vec<f64>), Error> {
        let mut cursor = Cursor::new(self);
        cursor.seek("time", time)?;
        Ok((cursor.q, cursor.u))
    }

    /// States and contact forces at `times`, in any order.
    pub fn sample(&self, times: &[f64]) -> Result<Sample, Error> {
        let mut sample = Sample::default();
        let mut known: Option<ContactForces> = None;
        let mut cursor = Cursor::new(self);
        for &time in times {
            cursor.seek("times", time)?;
            let (position, velocity) = self.scene().dof_state(&cursor.q, &cursor.u);
            sample.position.extend(position);
            sample.velocity.extend(velocity);
            let combination = &*self.combination_of(cursor.phase);
            let forces = match &mut known {
                Some(known) if known.combination == *combination => known,
                known => known.insert(ContactForces::new(self.scene(), combination)),
            };
            for (normal, friction) in forces.values(self.scene(), &cursor.q, &cursor.u) {
                sample.normal_force.push(normal);
                sample.friction_force.push(friction);
            }
            sample.status.extend(combination.statuses());
        }
        Ok(sample)
    }

    /// Coordinates `left' (A y) / a` in the modes of the combination of each instant, in the order and
    /// normalisation of [`Modes`]; NaN for defective ones. With steady forces z follows
    /// `z' = lambda z + left' Q / a`.
    pub fn modal_coordinates(&self, times: &[f64]) -> Result<Vec<ModalRun>, Error> {
        let mut cursor = Cursor::new(self);
        let mut runs: Vec<ModalRun> = Vec::new();
        let mut known: Vec<(Combination, Modes)> = Vec::new();
        for (index, &time) in times.iter().enumerate() {
            cursor.seek("times", time)?;
            let combination = &*self.combination_of(cursor.phase);
            let position = match known.iter().position(|entry| entry.0 == *combination) {
                Some(position) => position,
                None => {
                    known
                        .push((combination.clone(), Modes::new(self.scene().bare(), combination)?));
                    known.len() - 1
                }
            };
            let (_, modes) = &known[position];
            let kept = &modes.reduced.reduction.kept;
            let (q, u) = self.scene().at_rest(&cursor.q, &cursor.u);
            let y: Vec<f64> =
                kept.iter().map(|&k| q[k]).chain(kept.iter().map(|&k| u[k])).collect();
            if runs.last().is_none_or(|run| run.combination != *combination) {
                runs.push(ModalRun {
                    combination: combination.clone(),
                    indices: Vec::new(),
                    coordinates: Vec::new(),
                });
            }
            if let Some(run) = runs.last_mut() {
                run.indices.push(index);
                run.coordinates.extend(modes.coordinates(&y));
            }
        }
        Ok(runs)
    }
}

/// Walks through a trajectory, reusing the phase in progress for times that go on from it.
pub(crate) struct Cursor<'a> {
    trajectory: &'a Trajectory,
    pub phase: usize,
    /// The phase that `motion` follows.
    in_motion: usize,
    motion: Option<Motion>,
    held: HeldBases,
    /// One for each part of a scene in parts.
    parts: Vec<Cursor<'a>>,
    pub q: Vec<f64>,
    pub u: Vec<f64>,
}

impl<'a> Cursor<'a> {
    pub fn new(trajectory: &'a Trajectory) -> Self {
        let n = trajectory.scene().size;
        Self {
            trajectory,
            phase: usize::MAX,
            in_motion: usize::MAX,
            motion: None,
            held: HeldBases::default(),
            parts: trajectory.parts.iter().map(|part| Self::new(&part.motion)).collect(),
            q: vec![0.0; n],
            u: vec![0.0; n],
        }
    }

    /// Brings phase, q and q' to `time`; at an event time to the state after it.
    pub fn seek(&mut self, argument: &'static str, time: f64) -> Result<(), Error> {
        let trajectory = self.trajectory;
        if !(time >= 0.0 && time <= trajectory.end) {
            return Err(Error::TimeOutside { argument, value: time, end: trajectory.end });
        }
        let phase = trajectory.phases.partition_point(|phase| phase.start <= time).max(1) - 1;
        let local = time - trajectory.phases[phase].start;
        self.seek_local(phase, local);
        Ok(())
    }

    /// Brings q and q' to a time counted from the start of a phase, which may lie at its very end.
    pub fn seek_local(&mut self, phase: usize, local: f64) {
        let trajectory = self.trajectory;
        if let Some(motion) = &trajectory.local {
            self.phase = phase;
            motion.state(phase, local, &mut self.q, &mut self.u);
            return;
        }
        if !self.parts.is_empty() {
            self.phase = phase;
            for (part, cursor) in trajectory.parts.iter().zip(&mut self.parts) {
                let (own, since) = part.place(phase, &trajectory.phases[phase]);
                cursor.seek_local(own, since + local);
                part.block.scatter(&cursor.q, &mut self.q);
                part.block.scatter(&cursor.u, &mut self.u);
            }
            return;
        }
        let state = trajectory.phase_state(phase);
        let (q, u) = state.parts();
        let usable = phase == self.in_motion
            && self.motion.as_ref().is_some_and(|motion| motion.start() <= local);
        // Coordinates held at zero are not written by the motion.
        if phase != self.phase || local == 0.0 {
            self.q.copy_from_slice(q);
            self.u.copy_from_slice(u);
        }
        self.phase = phase;
        if local == 0.0 {
            return;
        }
        if !usable {
            let basis = self.held.get(
                &trajectory.bases,
                &trajectory.propagators,
                trajectory.phases[phase].basis,
            );
            match &mut self.motion {
                Some(motion) => motion.restart(basis, q, u),
                None => self.motion = Some(Motion::new(trajectory.scene(), basis, q, u)),
            }
            self.in_motion = phase;
        }
        if let Some(motion) = &mut self.motion {
            motion.seek(local, &mut self.q, &mut self.u);
        }
    }

    /// Local time up to which the motion of a phase is one series from a local time on, where it is not smooth everywhere.
    pub fn smooth_until(&mut self, phase: usize, local: f64) -> Option<f64> {
        let trajectory = self.trajectory;
        let of_parts = trajectory.parts.iter().zip(&mut self.parts).filter_map(|(part, cursor)| {
            let (own, since) = part.place(phase, &trajectory.phases[phase]);
            let until = cursor.smooth_until(own, since + local)? - since;
            // The sum can round to just before the end of a series.
            match until > local {
                true => Some(until),
                false => Some(cursor.smooth_until(own, (since + local).next_up())? - since),
            }
        });
        if let Some(first) = of_parts.reduce(f64::min) {
            return Some(first);
        }
        self.seek_local(phase, local.max(f64::MIN_POSITIVE));
        self.motion.as_mut()?.smooth_until(local)
    }

    /// A rate such that the motion of a phase grows by at most `e^{rate |z|}` around a local time, off the real axis too; modes
    /// that have decayed below rounding do not count. 1/s.
    pub fn growth_rate(&mut self, phase: usize, local: f64) -> f64 {
        if let Some(motion) = &self.trajectory.local {
            return motion.growth_rate();
        }
        let trajectory = self.trajectory;
        let of_parts = trajectory.parts.iter().zip(&mut self.parts).map(|(part, cursor)| {
            let (own, since) = part.place(phase, &trajectory.phases[phase]);
            cursor.growth_rate(own, since + local)
        });
        if let Some(largest) = of_parts.reduce(f64::max) {
            return largest;
        }
        // Local time 0 is known without a motion.
        self.seek_local(phase, local.max(f64::MIN_POSITIVE));
        let own = self.motion.as_ref().map_or(0.0, |motion| motion.growth_rate(local));
        // A slider that vibrates carries the contacts that stick to it, which have no motion of their own.
        let drive = self.trajectory.scene().drive.iter();
        drive.flat_map(|drive| &drive.oscillators).fold(own, |rate, one| rate.max(one.rate))
    }
}
