//! The motions about which modes may move: the origin, and the equilibrium of a phase.

use nalgebra::DVector;
use num_complex::Complex64;

use crate::contact::event_function::EventFunction;
use crate::linalg::dense::{Factors, apply, max_norm};
use crate::modes::mode::Mode;
use crate::numerics::double_double::Doubled;
use crate::numerics::simd::{ComplexGroup, Group, complex_groups, in_groups};
use crate::scene::model::Scene;
use crate::scene::reduction::reduced_system::Reduced;

/// `position + velocity t`, a motion of the whole scene, and the forces that act on the modes that move about it:
/// `z' = lambda z + force + linear t`.
#[derive(Debug)]
pub(super) struct Reference {
    /// At local time 0, in groups: positions of the kept coordinates, real and imaginary parts of the force on each group
    /// of modes, and the constant parts of the event functions. First with every sticking contact at 0, then what each
    /// sticking contact adds per unit of its own position.
    pub parts: Vec<Group>,
    /// Of the kept coordinates.
    pub velocity: Vec<Group>,
    /// The largest velocity, in modulus.
    pub speed: f64,
    /// Whether it rests: then no force grows with time.
    pub is_steady: bool,
    /// For each group of modes.
    pub linear: Vec<ComplexGroup>,
    /// Of each event function, whose modes add `Re sum_r weights_r z_r`.
    pub slopes: Vec<f64>,
}

/// The kept coordinates along a reference.
pub(super) struct At {
    position: Vec<f64>,
    velocity: Vec<f64>,
    sticking: Vec<Vec<f64>>,
}

impl At {
    pub fn origin(reduced: &Reduced) -> Self {
        let zero = vec![0.0; reduced.size()];
        Self {
            position: zero.clone(),
            velocity: zero.clone(),
            sticking: vec![zero; reduced.sticking_loads.len()],
        }
    }

    /// `K q1 = F1` and `K q0 = F0 - C q1`, solved in working precision; the residual stays as a force. None if the stiffness
    /// is singular.
    pub fn equilibrium(reduced: &Reduced) -> Option<Self> {
        let factors = Factors::new(reduced.stiffness.clone());
        let solve = |force: &[f64]| -> Vec<f64> {
            factors.solve(DVector::from_column_slice(force)).data.into()
        };
        let velocity = solve(&reduced.force_linear);
        let damped = apply(&reduced.damping, &velocity);
        let force: Vec<f64> =
            reduced.force_constant.iter().zip(damped).map(|(f, c)| f - c).collect();
        let position = solve(&force);
        let sticking: Vec<_> = reduced.sticking_loads.iter().map(|load| solve(load)).collect();
        let all = position.iter().chain(&velocity).chain(sticking.iter().flatten());
        all.copied().all(f64::is_finite).then_some(Self { position, velocity, sticking })
    }

    /// Forces `L' (F - C q' - K q)` and event functions, in doubled precision: in a stiff scene they are a small part of
    /// their terms.
    pub fn reference(
        self,
        scene: &Scene,
        reduced: &Reduced,
        functions: &[EventFunction],
        modes: &[Mode],
    ) -> Reference {
        let reduction = &reduced.reduction;
        let spread = |kept: &[f64], stuck: &dyn Fn(usize) -> f64| -> Vec<f64> {
            let mut all = vec![0.0; scene.size];
            reduction.kept.iter().zip(kept).for_each(|(&k, x)| all[k] = *x);
            let sticks = reduction.sticking.iter().enumerate();
            sticks.for_each(|(index, stick)| all[stick.0] = stuck(index));
            all
        };
        let mut position = spread(&self.position, &|_| 0.0);
        reduction.place_closed(&mut position);
        let velocity = spread(&self.velocity, &|index| reduction.sticking[index].1);
        let sticking: Vec<Vec<f64>> = self
            .sticking
            .iter()
            .enumerate()
            .map(|(own, kept)| spread(kept, &|index| f64::from(index == own)))
            .collect();
        let dot = |terms: &mut dyn Iterator<Item = (usize, f64)>, x: &[f64]| -> Doubled {
            terms.fold(Doubled::default(), |sum, (k, a)| sum.add(Doubled::product(a, x[k])))
        };
        let zeros = vec![0.0; scene.size];
        let modal = |load: &[f64], q: &[f64], u: &[f64]| -> Vec<ComplexGroup> {
            let of_row = |row: usize| -> Doubled {
                let force =
                    dot(&mut scene.stiffness.row(row), q).add(dot(&mut scene.damping.row(row), u));
                Doubled::from(load[row]).add(force.times(-1.0))
            };
            let combined = |i: usize| {
                let sources = reduction.sources(i);
                sources.fold(Doubled::default(), |sum, (row, factor)| {
                    sum.add(of_row(row).times(factor))
                })
            };
            let force: Vec<Doubled> = (0..reduction.size()).map(combined).collect();
            let of_mode = |mode: &Mode| {
                let terms = mode.left.iter().zip(&force).map(|(v, f)| v * f.value());
                terms.sum::<Complex64>() / mode.a
            };
            complex_groups(&modes.iter().map(of_mode).collect::<Vec<_>>()).collect()
        };
        let parts = |kept: &[f64], load: &[f64], q: &[f64], u: &[f64], constants: &[f64]| {
            let forces = modal(load, q, u).into_iter().flat_map(|force| [force.re, force.im]);
            let groups = in_groups(kept).into_iter().chain(forces).chain(in_groups(constants));
            groups.collect::<Vec<Group>>()
        };
        let along = |function: &EventFunction, q: &[f64]| {
            dot(&mut function.functional.position.iter().copied(), q)
        };
        let constant = |function: &EventFunction| {
            let functional = &function.functional;
            let of_velocity = dot(&mut functional.velocity.iter().copied(), &velocity);
            let constant = Doubled::from(functional.constant).add(along(function, &position));
            constant.add(of_velocity).value()
        };
        let constants: Vec<f64> = functions.iter().map(constant).collect();
        let fixed = parts(&self.position, &scene.force, &position, &velocity, &constants);
        let of_sticks = self.sticking.iter().zip(&sticking).flat_map(|(kept, q)| {
            let constants = functions.iter().map(|function| along(function, q).value());
            parts(kept, &zeros, q, &zeros, &constants.collect::<Vec<f64>>())
        });
        Reference {
            parts: fixed.into_iter().chain(of_sticks).collect(),
            is_steady: velocity.iter().all(|&speed| speed == 0.0),
            linear: modal(&zeros, &velocity, &zeros),
            slopes: functions.iter().map(|function| along(function, &velocity).value()).collect(),
            speed: max_norm(&self.velocity),
            velocity: in_groups(&self.velocity),
        }
    }
}
