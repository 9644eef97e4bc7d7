//! Works over an interval, phase by phase and impact by impact.
//!
//! The powers of `power.rs` are integrated by the rule of `gauss.rs` on panels that are as short as the motion requires. The
//! work of a constant force is `F . (x1 - x0)`, also that of a switched one within a phase. At an impact the velocities jump,
//! and the impulses `p = M (u+ - u-)` of the contacts change the kinetic energy by exactly
//! `sum p_n (g'+ + g'-) / 2 + p_t (t.u+ + t.u-) / 2`:
//!
//! ```text
//! lost in the normal direction    -p_n (g'+ + g'-) / 2  = 1/2 m (1 - e^2) g'-^2,  p_n = (1 + e) m |g'-|
//! work of the slider               p_t v
//! friction heat                   -p_t (s+ + s-) / 2    >= 0 for a Coulomb impulse
//! ```
//!
//! The limit of a series of bounces takes the energy of the relative motion after the last bounce, `1/2 m g'^2`. If several
//! contacts close together, their gaps g of some rounding close too, and the work of the load `F - K x` on these gaps is
//! part of the energy that the impacts take.

use crate::contact::contact_forces::ContactForces;
use crate::energy::impacts::{ImpactWork, add_impacts};
use crate::energy::power::{
    antisymmetric, bilinear, circulatory_force, contact_powers, damper_groups, damping_powers,
    energy_change,
};
use crate::error::input::Error;
use crate::numerics::double_double::Doubled;
use crate::numerics::gauss::{NODES, REACH, gauss_rule};
use crate::scene::model::Scene;
use crate::scene::status::Combination;
use crate::transient::trajectory::model::Trajectory;
use crate::transient::trajectory::sampling::Cursor;

/// Works over the part of one phase inside the interval, J.
#[derive(Debug, Clone)]
pub struct PhaseWork {
    /// Start of that part, s.
    pub start: f64,
    /// Length of that part, s.
    pub duration: f64,
    /// Status of every contact in the phase.
    pub combination: Combination,
    /// Work on the structure through each contact: `slider` less friction heat.
    pub contact: Vec<f64>,
    /// `integral of T_i v_i dt` for each contact.
    pub slider: Vec<f64>,
    /// `integral of N_i |s_i| dt` for each contact; impacts do not count.
    pub wear: Vec<f64>,
    /// Work of the force F and the loads in time on the structure.
    pub external: f64,
    /// Work of the circulatory forces on the structure, the integral of `-u' H_a x`; 0 without them.
    pub circulatory: f64,
    /// Dissipated energy by damper group; see [`damper_groups`].
    pub damping: Vec<f64>,
}

/// Everything that changes the energy between two times.
#[derive(Debug, Clone, Default)]
pub struct Works {
    /// One entry for each phase that the interval touches, in order of time.
    pub phases: Vec<PhaseWork>,
    /// Energies that impacts, and the limits of bounces, take inside the interval.
    pub impacts: Vec<ImpactWork>,
    /// Changes of kinetic and elastic energy.
    pub kinetic: f64,
    /// Change of elastic energy, J; positive where it grows.
    pub elastic: f64,
    /// States evaluated for it.
    pub states: usize,
}

/// The works over (t0, t1]: with the impacts at t1, without those at t0.
pub fn works(trajectory: &Trajectory, t0: f64, t1: f64) -> Result<Works, Error> {
    for (argument, value) in [("t0", t0), ("t1", t1)] {
        if !(value >= 0.0 && value <= trajectory.end) {
            return Err(Error::TimeOutside { argument, value, end: trajectory.end });
        }
    }
    if t0 > t1 {
        return Err(Error::Range { argument: "t0".into(), requirement: "at most t1", value: t0 });
    }
    let mut walk = Walk::new(trajectory);
    let first = trajectory.phase_at(t0);
    let last = trajectory.phase_at(t1);
    for phase in first..=last {
        let start = trajectory.phases[phase].start;
        let from = if phase == first { walk.local(phase, t0) } else { 0.0 };
        let to =
            if phase == last { walk.local(phase, t1) } else { trajectory.phase_duration(phase) };
        walk.cursor.seek_local(phase, from);
        let begun = walk.at_rest();
        walk.force = walk.constant_force();
        if phase == first {
            walk.first = begun.clone();
        }
        walk.follow(phase, from, to);
        // A reset of the position at an impact is part of what the constant forces work.
        let reached = match phase < last {
            true => {
                let next = trajectory.phase_state(phase + 1);
                let (q, u) = next.parts();
                walk.moving.at_rest(q, u).0.into_owned()
            }
            false => walk.at_rest().0,
        };
        let mut external = dot_change(&walk.force, &reached, &begun.0) + walk.oscillating.value();
        if phase < last && !walk.scene.massless.is_empty() {
            external += walk.reset_by_loads(phase + 1, &reached);
        }
        let circulatory = walk.circulatory(&reached, &begun.0);
        let [contact, slider, wear, damping] =
            walk.sums.each_ref().map(|sums| sums.iter().map(|sum| sum.value()).collect());
        walk.works.phases.push(PhaseWork {
            start: start + from,
            duration: to - from,
            combination: trajectory.combination_of(phase).into_owned(),
            contact,
            slider,
            wear,
            external,
            circulatory,
            damping,
        });
        if phase < last {
            let at_end = (&walk.cursor.q[..], &walk.cursor.u[..]);
            add_impacts(trajectory, phase + 1, at_end, &mut walk.works.impacts);
        }
    }
    let last = walk.at_rest();
    let Walk { scene, first, mut works, .. } = walk;
    (works.kinetic, works.elastic) = energy_change(scene, (&first.0, &first.1), (&last.0, &last.1));
    Ok(works)
}

fn dot_change(force: &[f64], to: &[f64], from: &[f64]) -> f64 {
    let terms = force.iter().zip(to.iter().zip(from)).map(|(f, (b, a))| f * (b - a));
    terms.fold(Doubled::default(), added).value()
}

fn added(sum: Doubled, term: f64) -> Doubled {
    sum.add(Doubled { high: term, low: 0.0 })
}

/// The walk through the phases of an interval.
struct Walk<'a> {
    trajectory: &'a Trajectory,
    /// With the coordinates that carry loads, and without.
    moving: &'a Scene,
    scene: &'a Scene,
    cursor: Cursor<'a>,
    /// The part of the force that is constant in the phase in progress.
    force: Vec<f64>,
    forces: Option<ContactForces>,
    first: (Vec<f64>, Vec<f64>),
    /// Integrals over the phase in progress: work, work of the slider and wear by contact, and damping by its groups.
    sums: [Vec<Doubled>; 4],
    /// Work of the loads that oscillate.
    oscillating: Doubled,
    circulatory: Doubled,
    /// q at the start of the phase in progress.
    origin: Vec<f64>,
    works: Works,
}

impl<'a> Walk<'a> {
    fn new(trajectory: &'a Trajectory) -> Self {
        let moving = &**trajectory.scene();
        let scene = moving.bare();
        let contacts = scene.contacts.len();
        Self {
            trajectory,
            moving,
            scene,
            cursor: Cursor::new(trajectory),
            force: Vec::new(),
            forces: None,
            first: Default::default(),
            sums: [contacts, contacts, contacts, damper_groups(scene).len()]
                .map(|count| vec![Doubled::default(); count]),
            oscillating: Doubled::default(),
            circulatory: Doubled::default(),
            origin: Vec::new(),
            works: Works::default(),
        }
    }

    /// (q, q') of the structure where the cursor stands.
    fn at_rest(&self) -> (Vec<f64>, Vec<f64>) {
        let (q, u) = self.moving.at_rest(&self.cursor.q, &self.cursor.u);
        (q.into_owned(), u.into_owned())
    }

    /// The force F with the switched loads that hold where the cursor stands.
    fn constant_force(&self) -> Vec<f64> {
        let mut force = self.scene.external_force().into_owned();
        if let Some(drive) = &self.moving.drive {
            drive.add_forces(false, &self.cursor.q, &mut force);
        }
        force
    }

    /// The work of loads in time when dofs without mass jump to their places at the start of `phase`: that of the mean of the
    /// forces before and after, as if these grew while the dofs move. The part of F is counted already.
    fn reset_by_loads(&self, phase: usize, reached: &[f64]) -> f64 {
        let Some(drive) = &self.moving.drive else { return 0.0 };
        let next = self.trajectory.phase_state(phase);
        let mut force = vec![0.0; reached.len()];
        drive.add_forces(false, &self.cursor.q, &mut force);
        force.iter_mut().for_each(|f| *f = -*f);
        for q in [&self.cursor.q[..], next.parts().0] {
            let mut of = vec![0.0; reached.len()];
            drive.add_forces(false, q, &mut of);
            drive.add_forces(true, q, &mut of);
            force.iter_mut().zip(of).for_each(|(f, of)| *f += 0.5 * of);
        }
        dot_change(&force, reached, &self.at_rest().0)
    }

    /// The local time of `time` within a phase.
    fn local(&self, phase: usize, time: f64) -> f64 {
        let start = self.trajectory.phases[phase].start;
        if time == start {
            return 0.0;
        }
        (time - start - self.trajectory.phases[phase].rest)
            .clamp(0.0, self.trajectory.phase_duration(phase))
    }

    /// Integrates the powers over local times of one phase and leaves the cursor at `to`.
    fn follow(&mut self, phase: usize, from: f64, to: f64) {
        self.sums.iter_mut().for_each(|sums| sums.fill(Doubled::default()));
        (self.circulatory, self.oscillating) = Default::default();
        self.origin = self.at_rest().0;
        let combination = &*self.trajectory.combination_of(phase);
        let forces = match self.forces.take() {
            Some(known) if known.combination == *combination => known,
            _ => ContactForces::new(self.moving, combination),
        };
        let rule = gauss_rule();
        let mut at = from;
        while at < to {
            let rate = self.cursor.growth_rate(phase, at);
            let remaining = to - at;
            // Equal panels where the rate stays, so that none is a sliver.
            let panels = (rate * remaining / REACH).ceil().max(1.0);
            let mut width = remaining / panels;
            let mut end = if panels == 1.0 { to } else { at + width };
            let kink = self.cursor.smooth_until(phase, at);
            if let Some(kink) = kink.filter(|&kink| kink > at && kink < end) {
                (width, end) = (kink - at, kink);
            }
            for (node, weight) in rule.nodes.iter().zip(&rule.weights) {
                self.cursor.seek_local(phase, at + width * node);
                self.accumulate(&forces, width * weight);
            }
            self.works.states += NODES;
            at = end;
        }
        self.cursor.seek_local(phase, to);
        self.forces = Some(forces);
    }

    fn accumulate(&mut self, forces: &ContactForces, weight: f64) {
        let (moved, velocities) = (&self.cursor.q, &self.cursor.u);
        let (q, u) = &self.moving.at_rest(moved, velocities);
        let [contact, slider, wear, damping] = &mut self.sums;
        let powers = contact_powers(forces, self.moving, moved, velocities, u);
        for (i, power) in powers.enumerate() {
            contact[i] = added(contact[i], weight * power.structure);
            slider[i] = added(slider[i], weight * power.slider);
            wear[i] = added(wear[i], weight * power.wear);
        }
        if let Some(drive) = &self.moving.drive {
            let mut force = vec![0.0; u.len()];
            drive.add_forces(true, moved, &mut force);
            for (f, u) in force.iter().zip(&u[..]) {
                self.oscillating = added(self.oscillating, weight * f * u);
            }
        }
        for (sum, power) in damping.iter_mut().zip(damping_powers(self.scene, q, u)) {
            *sum = added(*sum, weight * power);
        }
        if let Some(matrix) = antisymmetric(self.scene) {
            let moved: Vec<f64> =
                q.iter().zip(&self.origin).map(|(q, origin)| q - origin).collect();
            self.circulatory = added(self.circulatory, -weight * bilinear(matrix, u, &moved));
        }
    }

    /// `-integral of u' H_a x` over the phase, which began at `from`, ended where the cursor stands, and was reset to `to`: by
    /// quadrature for the motion from the start, and in closed form for the force at the start and for the reset.
    fn circulatory(&self, to: &[f64], from: &[f64]) -> f64 {
        let Some(force) = circulatory_force(self.scene, from) else { return 0.0 };
        let end = &self.at_rest().0[..];
        let middle: Vec<f64> = end.iter().zip(to).map(|(a, b)| 0.5 * (a + b)).collect();
        let reset = circulatory_force(self.scene, &middle).unwrap_or_default();
        self.circulatory.value() + dot_change(&force, end, from) + dot_change(&reset, to, end)
    }
}
