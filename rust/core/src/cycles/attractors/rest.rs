//! Whether a motion comes to rest: the proof is not to wait, but to bound the motion that can follow its end.
//!
//! With modal deviations z from the equilibrium of the last combination, an event function never falls below its value there
//! less `sum |h_r| |z_r|`. Linear modes that decay keep `|z_r|` below its first value. A law of friction drives the modes by
//! the nonlinear part of its force. With S and P bounds of the deviations of slip speed and normal force, this is at most
//!
//! ```text
//! |rest| <= 1/2 max|mu''| S^2 N_0 + max|mu'| S P
//! ```
//!
//! A motion never leaves a box `|z_r| <= rho_r` in which this force feeds no mode faster than the mode decays. The same holds
//! for every smaller box of this shape, so the motion comes to the equilibrium.
//!
//! Where slip has no mass, the modes hold its place, and its velocity follows from them and from this force, with the
//! damper of the law: `S <= sum |s_r| |z_r| + |rest| / (N_0 mu')`. As the deviations grow from zero, S grows with them and
//! never passes a value that satisfies this.

use nalgebra::DMatrix;
use num_complex::Complex64;

use crate::contact::contact_forces::{contact_forces, contact_forces_in, reaction, response};
use crate::contact::event_function::{ConePart, EventFunction, event_functions, slip_velocity};
use crate::contact::functional::Functional;
use crate::contact::linear_friction::exhaustions;
use crate::linalg::dense::{max_distance, max_norm, solve};
use crate::linalg::sparse::SparseMatrix;
use crate::modes::complex_modes::Modes;
use crate::motion::friction::series::law_series::LawSeries;
use crate::scene::contact_law::Contact;
use crate::scene::elements::element::ElementKind;
use crate::scene::friction::law::FrictionLaw;
use crate::scene::massless::condensation::Condensed;
use crate::scene::model::Scene;
use crate::scene::reduction::reduced_system::Reduced;
use crate::scene::status::{Combination, Status};
use crate::transient::trajectory::model::Trajectory;
use crate::transient::trajectory::sampling::Cursor;

/// Steps of Newton's method to where elements let the motion rest, and the change of places that ends them.
const STEPS: usize = 60;
const NEAR: f64 = 1e-12;
/// Part of the largest damping by which a least one may be negative.
const ROUNDING: f64 = 1e-12;
/// Number of times that a box is made larger.
const TRIALS: usize = 20;

/// Whether loads oscillate.
pub(super) fn is_forced(run: &Trajectory) -> bool {
    run.scene().drive.as_ref().is_some_and(|drive| !drive.oscillators.is_empty())
}

/// Where a combination rests whose sticking contacts are in their places of `q`, and its matrices.
fn place_at_rest(
    scene: &Scene,
    combination: &Combination,
    q: &[f64],
) -> Option<(Vec<f64>, Reduced)> {
    let reduced = Reduced::new(scene, combination).ok()?;
    let mut force = reduced.force_constant.clone();
    for (loads, &(k, _)) in reduced.sticking_loads.iter().zip(&reduced.reduction.sticking) {
        force.iter_mut().zip(loads).for_each(|(f, load)| *f += load * q[k]);
    }
    let mut rest = q.to_vec();
    let solved = solve(reduced.stiffness.clone(), &force);
    reduced.reduction.kept.iter().zip(solved).for_each(|(&k, x)| rest[k] = x);
    Some((rest, reduced))
}

/// Whether no event can follow.
pub(super) fn comes_to_rest(run: &Trajectory) -> bool {
    let moving = run.scene();
    // Loads that oscillate go on, and those that are yet to be switched come.
    let load_time = run.load_time();
    if is_forced(run) || moving.next_switch(load_time + run.end).is_some() {
        return false;
    }
    // A loop, and a formula with a state, is no law of the slip speed, for which the box is.
    if moving.state_contacts().any(|(_, own)| !own.has_plain_bristles()) {
        return false;
    }
    let Some(last) = run.phases.len().checked_sub(1) else { return false };
    let Ok(basis) = run.basis_of(last) else { return false };
    let combination = &basis.combination;
    let carried = moving
        .contacts
        .iter()
        .zip(combination.statuses())
        .any(|(law, &status)| status == Status::Sticking && law.slider_speed != 0.0);
    if carried {
        return false;
    }
    // Deflections of bristles are states of first order in small motions, too.
    let flows = moving.creeping(combination).next().is_some();
    let first_order = flows || moving.has_states();
    let mut cursor = Cursor::new(run);
    if cursor.seek("time", run.end).is_err() {
        return false;
    }
    let (mut q, mut u) = (cursor.q, cursor.u);
    // Where the motion would rest if elements were linear about where it is, and so on.
    let mut about = q.clone();
    for _ in 0..STEPS {
        if moving.nonlinear_elements_in(combination).next().is_none() {
            break;
        }
        let linear = moving.linear_about(&about);
        let Some((rest, _)) = place_at_rest(&linear.at_steady_sliding(), combination, &q) else {
            return false;
        };
        let moved = max_distance(&about, &rest);
        let size = max_norm(&rest);
        about = rest;
        if !(moved > NEAR * size) {
            break;
        }
    }
    if moving.slipping_in_planes(combination).next().is_some() {
        return slips_on_in_planes(moving, combination, [&q, &u]);
    }
    let linear = &*moving.linear_about(&about);
    let scene = &*linear.at_steady_sliding();
    let Some((mut rest, reduced)) = place_at_rest(scene, combination, &q) else { return false };
    let mut still = vec![0.0; scene.size];
    // About rest the places of slip without mass follow from the others.
    let condensed = if flows { Condensed::new(scene, combination) } else { Ok(None) };
    let Ok(condensed) = condensed else { return false };
    match condensed {
        Some(condensed) => condensed.complete(&mut rest, &mut still),
        None => basis.complete(&mut rest, &mut still),
    }
    let pressed: Vec<f64> = match moving.has_friction_laws() {
        true => contact_forces_in(scene, combination, &rest, &still),
        false => Vec::new(),
    }
    .iter()
    .map(|force| force.0)
    .collect();
    let Ok(modes) = Modes::new(&linear.bare().about(combination, &pressed), combination) else {
        return false;
    };
    if modes.defective.contains(&true) || modes.eigenvalues.iter().any(|l| l.re >= 0.0) {
        return false;
    }
    let reduced = if first_order { &modes.reduced } else { &reduced };
    let kept = &reduced.reduction.kept;
    for (contact, own) in moving.state_contacts() {
        // In small motions the deflection is the displacement of its coordinate.
        q[own.coordinate] = own.deviation(
            combination.statuses()[*contact],
            moving.contacts[*contact].slider_speed,
            &u,
        );
        rest[own.coordinate] = 0.0;
        u[own.coordinate] = 0.0;
    }
    let deviation: Vec<f64> =
        kept.iter().map(|&k| q[k] - rest[k]).chain(kept.iter().map(|&k| u[k])).collect();
    let z: Vec<f64> = modes.coordinates(&deviation).iter().map(|z| z.norm()).collect();
    let over_own = |functional: Functional| match (&basis.condensed, &basis.fitted) {
        (Some(condensed), _) => functional.pulled_back(&condensed.slaved),
        (_, Some(fitted)) => functional.pulled_back(&fitted.dependents),
        _ => functional,
    };
    let laws = Laws::new(moving, scene, combination, reduced, &modes, [&pressed, &rest], &over_own);
    let Some((z, beyond)) = laws.kept_within(&modes, z) else { return false };
    let functions = match laws.contacts.is_empty() || flows {
        true => Ok(basis.functions.clone()),
        false => event_functions(&linear.about(combination, &pressed), combination),
    }
    .map(|mut functions| {
        if !laws.contacts.is_empty() {
            functions.extend(exhaustions(linear, combination));
        }
        functions
    });
    functions.is_ok_and(|functions| {
        let at_rest_and_reach = |function: &EventFunction| {
            let functional = over_own(function.functional.clone());
            let forces: f64 = function.forces.iter().map(|part| part.1.abs()).sum();
            let reach = reach(&functional, reduced, &modes, &z) + forces * beyond;
            (functional.value(&rest, &still), reach)
        };
        let largest = |function: &EventFunction| {
            let (at_rest, reach) = at_rest_and_reach(function);
            at_rest.abs() + reach
        };
        functions.iter().all(|function| match function.cone {
            None => {
                let (at_rest, reach) = at_rest_and_reach(function);
                at_rest > reach
            }
            Some(ConePart::Force) => true,
            Some(ConePart::Limit) => {
                let beside = scene.contacts[function.contact].plane.map(|plane| plane.beside);
                let own = |one: &&EventFunction| {
                    one.contact == function.contact || Some(one.contact) == beside
                };
                let forces = functions.iter().filter(|one| one.cone == Some(ConePart::Force));
                let square: f64 = forces.filter(own).map(|force| largest(force).powi(2)).sum();
                let (at_rest, reach) = at_rest_and_reach(function);
                square.sqrt() < at_rest - reach
            }
        })
    })
}

/// Whether all contacts slip steadily in planes in the end, and none of them stops before: friction takes energy from the deviation
/// from steady sliding, as `(w_1 - w_2) . (e_1 - e_2) >= 0`, so that this bounds its velocities for good. Where friction falls with the
/// slip speed, at most at the rate f, dampers of `f N` at the contacts have to leave C positive.
fn slips_on_in_planes(moving: &Scene, combination: &Combination, [q, u]: [&[f64]; 2]) -> bool {
    let statuses = combination.statuses();
    if statuses.iter().any(|&status| status != Status::Slipping)
        || moving.contacts.iter().any(Contact::opens)
        || moving.energy_parts.is_some()
        || moving.has_elements()
    {
        return false;
    }
    let steady = moving.at_steady_sliding();
    let Some((rest, _)) = place_at_rest(&steady, combination, q) else { return false };
    let away: Vec<f64> = q.iter().zip(&rest).map(|(q, rest)| q - rest).collect();
    let form = |matrix: &SparseMatrix, x: &[f64]| {
        matrix.apply(x).iter().zip(x).map(|(a, b)| a * b).sum::<f64>()
    };
    let energy = form(&moving.stiffness, &away) + form(&moving.mass, u);
    let still = vec![0.0; moving.size];
    let mut dampers = Vec::new();
    for contacts in moving.planes() {
        let laws = contacts.map(|contact| &moving.contacts[contact]);
        let mass = laws.map(|law| moving.mass.get(law.tangential, law.tangential));
        let speed = laws[0].slip_speed(&still);
        let apart = (energy / mass[0].min(mass[1])).sqrt();
        if !(apart < speed) {
            return false;
        }
        let Some(law) = moving.friction_law(contacts[0]) else { continue };
        let falls = match law {
            FrictionLaw::Tabulated(table) => table.steepest(speed - apart, speed + apart),
            _ => (-LawSeries::along(law, &[speed]).0.least_slope(law, apart)).max(0.0),
        };
        if !(law.value(speed) >= falls * apart) {
            return false;
        }
        let pressed = -moving.force[laws[0].normal];
        dampers.extend(laws.map(|law| (-falls * pressed, vec![(law.tangential, 1.0)])));
    }
    let added = SparseMatrix::of_springs(moving.size, &dampers);
    let damping = steady.damping.combined(1.0, &added, 1.0);
    let damped = Scene { damping, proportional: None, ..steady.into_owned() };
    let Some((_, reduced)) = place_at_rest(&damped, combination, q) else { return false };
    // Where K or C feeds energy, it bounds nothing; a motion that does not decay never comes to rest.
    let positive = |matrix: &DMatrix<f64>, least: f64| {
        let values = matrix.clone().symmetric_eigenvalues();
        values.iter().all(|&value| value >= least * values.amax())
    };
    let Ok(about) = moving.bare().linearised(combination) else { return false };
    let decays = Modes::new(&about, combination)
        .is_ok_and(|modes| modes.eigenvalues.iter().all(|lambda| lambda.re < 0.0));
    decays && positive(&reduced.stiffness, 0.0) && positive(&reduced.damping, -ROUNDING)
}

/// The largest change of a functional within a box.
fn reach(functional: &Functional, reduced: &Reduced, modes: &Modes, z: &[f64]) -> f64 {
    z.iter()
        .zip(modes.right.chunks_exact(reduced.size().max(1)))
        .zip(&modes.eigenvalues)
        .map(|((z, right), lambda)| {
            let part = |terms: &[(usize, f64)]| -> Complex64 {
                let place = |k| reduced.reduction.place(k);
                terms.iter().filter_map(|&(k, weight)| Some(weight * right[place(k)?])).sum()
            };
            (part(&functional.position) + lambda * part(&functional.velocity)).norm() * z
        })
        .sum()
}

/// The contacts that slide by a law about the equilibrium, and the elements of the scene.
struct Laws<'a> {
    contacts: Vec<Law<'a>>,
    reduced: &'a Reduced,
    /// Largest sum of the changes of a normal force by friction, per newton against each slip.
    response: f64,
}

struct Law<'a> {
    law: &'a FrictionLaw,
    speed: f64,
    pressed: f64,
    slip: Functional,
    normal: Functional,
    /// How fast a newton along the slip drives each mode.
    drive: Vec<f64>,
    /// Where slip has no mass: how fast it slips per newton, and the slip speed at which the law levels off.
    yields: f64,
    until: f64,
    /// Whether it is an element: its argument stands for the slip speed, its normal force is 1.
    element: bool,
}

impl<'a> Laws<'a> {
    fn new(
        moving: &'a Scene,
        steady: &Scene,
        combination: &'a Combination,
        reduced: &'a Reduced,
        modes: &Modes,
        [pressed, rest]: [&[f64]; 2],
        over_own: &dyn Fn(Functional) -> Functional,
    ) -> Self {
        let forces = steady.contacts_coupled().then(|| contact_forces(steady, combination));
        let own = reduced.scene(steady);
        let driven = |terms: &[(usize, f64)]| -> Vec<f64> {
            let mut along = vec![0.0; steady.size];
            terms.iter().for_each(|&(k, weight)| along[k] += weight);
            let along = reduced.reduction.force(&along);
            let drive = |r: usize| {
                let left = &modes.left[along.len() * r..along.len() * (r + 1)];
                let sum: Complex64 = left.iter().zip(&along).map(|(l, f)| l * f).sum();
                (sum / modes.a[r]).norm()
            };
            (0..modes.eigenvalues.len()).map(drive).collect()
        };
        let contacts = moving.sliding_by_law(combination).map(|(contact, law)| {
            let sliding = &steady.contacts[contact];
            let normal = match &forces {
                Some(forces) => forces[contact].1.clone(),
                None => reaction(steady, sliding.normal),
            };
            let speed = sliding.slider_speed.abs();
            let slip = over_own(slip_velocity(steady, contact));
            if let Some(own) = moving.state_of(contact) {
                return Law {
                    law,
                    speed,
                    pressed: own.law.steady(speed),
                    slip,
                    normal: Functional {
                        position: vec![(own.coordinate, 1.0)],
                        ..Functional::default()
                    },
                    drive: driven(&own.directions_in_small_motions()),
                    yields: 0.0,
                    until: f64::INFINITY,
                    element: false,
                };
            }
            let (yields, until) = match moving.creeps(contact) {
                true => (
                    1.0 / (pressed[contact].abs() * law.slope(speed)),
                    law.rises_until().unwrap_or(0.0),
                ),
                false => (0.0, f64::INFINITY),
            };
            Law {
                law,
                speed,
                pressed: pressed[contact].abs(),
                slip,
                normal: over_own(normal),
                drive: driven(&own.terms_of(sliding.tangential)),
                yields,
                until,
                element: false,
            }
        });
        let still = vec![0.0; steady.size];
        let elements = moving.nonlinear_elements_in(combination).map(|(_, one)| {
            let mut slip = Functional { constant: -one.offset, ..Functional::default() };
            match one.kind {
                ElementKind::Spring => slip.position.clone_from(&one.direction),
                ElementKind::Damper => slip.velocity.clone_from(&one.direction),
            }
            Law {
                law: &one.excess,
                speed: one.argument(rest, &still),
                pressed: 1.0,
                slip,
                normal: Functional::default(),
                drive: driven(&one.direction),
                yields: 0.0,
                until: f64::INFINITY,
                element: true,
            }
        });
        let contacts: Vec<Law<'a>> = contacts.chain(elements).collect();
        let sum = |all: DMatrix<f64>| {
            all.row_iter().map(|row| row.iter().map(|x| x.abs()).sum()).fold(0.0, f64::max)
        };
        let response = match contacts.is_empty() {
            true => 0.0,
            false => response(moving, combination).map_or(0.0, sum),
        };
        Self { contacts, reduced, response }
    }

    /// A box around the modal deviations that the motion never leaves, and bounds of the nonlinear parts of forces in it.
    fn kept_within(&self, modes: &Modes, z: Vec<f64>) -> Option<(Vec<f64>, f64)> {
        if self.contacts.is_empty() {
            return Some((z, 0.0));
        }
        let mut within = z;
        for _ in 0..TRIALS {
            let rests = self.rests(modes, &within)?;
            let fed = |r: usize| -> f64 {
                self.contacts.iter().zip(&rests).map(|(one, rest)| one.drive[r] * rest).sum()
            };
            let needed: Vec<f64> =
                modes.eigenvalues.iter().enumerate().map(|(r, l)| fed(r) / -l.re).collect();
            if within.iter().zip(&needed).all(|(size, needed)| needed <= size) {
                return Some((within, self.response * rests.iter().sum::<f64>()));
            }
            within
                .iter_mut()
                .zip(&needed)
                .for_each(|(size, needed)| *size = size.max(2.0 * needed));
        }
        None
    }

    /// Bounds of the nonlinear parts of the forces.
    fn rests(&self, modes: &Modes, z: &[f64]) -> Option<Vec<f64>> {
        let slips = self.contacts.iter().map(|one| {
            let of = |functional| reach(functional, self.reduced, modes, z);
            one.slip_within(of(&one.slip), &|| of(&one.normal))
        });
        let slips: Vec<f64> = slips.collect::<Option<_>>()?;
        let steepness: Vec<[f64; 2]> = self
            .contacts
            .iter()
            .zip(&slips)
            .map(|(one, &slip)| {
                let (from, to) = (one.speed - slip, one.speed + slip);
                let holds = if one.element { one.is_smooth(from, to) } else { slip < one.speed };
                holds.then(|| one.law.steepness(from, to))
            })
            .collect::<Option<_>>()?;
        let pushed = self.contacts.iter().zip(slips.iter().zip(&steepness));
        let pushed = pushed.map(|(one, (slip, [slope, curvature]))| match one.element {
            true => 0.5 * curvature * slip * slip,
            false => slope * slip * one.pressed,
        });
        let pushed: f64 = pushed.sum();
        let laws = self.contacts.iter().zip(slips.iter().zip(&steepness));
        let laws = laws.filter(|(one, _)| !one.element);
        let moved = laws.map(|(_, (slip, [slope, _]))| slope * slip);
        let gain = 1.0 - self.response * moved.sum::<f64>();
        let all = self.contacts.iter().zip(slips.iter().zip(&steepness));
        let rests = all.map(|(one, (slip, [slope, curvature]))| {
            let given = reach(&one.normal, self.reduced, modes, z);
            let pressed = if one.element { 0.0 } else { (given + self.response * pushed) / gain };
            0.5 * curvature * slip * slip * one.pressed + slope * slip * pressed
        });
        (gain > 0.0).then(|| rests.collect())
    }
}

impl Law<'_> {
    /// Whether the law of an element has one curvature everywhere between two arguments.
    fn is_smooth(&self, from: f64, to: f64) -> bool {
        self.law.piece(from) == self.law.piece(to)
    }

    /// A bound of the deviation of the slip speed, from that of the modes and from that of the normal force.
    fn slip_within(&self, of_modes: f64, of_normal: &dyn Fn() -> f64) -> Option<f64> {
        if self.yields == 0.0 {
            return Some(of_modes);
        }
        let of_normal = of_normal();
        let mut slip = of_modes;
        for _ in 0..TRIALS {
            if !(slip < self.speed && self.speed + slip < self.until) {
                return None;
            }
            let [slope, curvature] = self.law.steepness(self.speed - slip, self.speed + slip);
            let rest = 0.5 * curvature * slip * slip * self.pressed + slope * slip * of_normal;
            if of_modes + self.yields * rest <= slip {
                return Some(slip);
            }
            slip = of_modes + 2.0 * self.yields * rest;
        }
        None
    }
}
