//! The motions about which modes may move: the origin, and the equilibrium of a phase.

use nalgebra::DVector;
use num_complex::Complex64;

use crate::contact::event_function::EventFunction;
use crate::linalg::dense::{Factors, apply};
use crate::modes::mode::Mode;
use crate::numerics::double_double::Doubled;
use crate::numerics::simd::{ComplexGroup, complex_groups};
use crate::scene::model::Scene;
use crate::scene::reduction::reduced_system::Reduced;

/// `position + velocity t`, a motion of the whole scene, and the forces that act on the modes that move about it.
#[derive(Debug)]
pub(super) struct Reference {
    /// Of the kept coordinates at local time 0 with every sticking contact at 0, and the velocity.
    pub at: Vec<[f64; 2]>,
    /// The largest entries of `at`, in modulus.
    pub size: [f64; 2],
    /// What each sticking contact adds to the position per unit of its own.
    pub sticking: Vec<Sticking>,
    /// For each group of modes.
    pub force: Vec<ModalForce>,
    /// Whether it rests: then no force grows with time.
    pub is_steady: bool,
    /// For each event function.
    pub functions: Vec<AffineFunction>,
}

/// Kept coordinates per unit of a sticking one.
#[derive(Debug)]
pub(super) struct Sticking {
    pub of: Vec<f64>,
    /// The largest of them, in modulus.
    pub size: f64,
}

/// `z' = lambda z + constant + linear t`: forces that do not hold the reference in balance.
#[derive(Debug)]
pub(super) struct ModalForce {
    pub constant: ComplexGroup,
    pub linear: ComplexGroup,
    /// Added to the constant per unit of the position of each sticking contact.
    pub sticking: Vec<ComplexGroup>,
}

/// An event function along the reference, `constant + slope t`; the modes add `Re sum_r weights_r z_r`.
#[derive(Debug)]
pub(super) struct AffineFunction {
    pub constant: f64,
    pub slope: f64,
    /// Added to the constant per unit of the position of each sticking contact.
    pub sticking: Vec<f64>,
}

/// The largest modulus. Phases ask for it: a comparison costs a third of `f64::max`, which looks for NaN.
pub(super) fn largest(x: &[f64]) -> f64 {
    x.iter().map(|x| x.abs()).fold(0.0, |size, x| if x > size { x } else { size })
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
        let position = spread(&self.position, &|_| 0.0);
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
        let constant = modal(&scene.force, &position, &velocity);
        let linear = modal(&zeros, &velocity, &zeros);
        let of_sticks: Vec<_> = sticking.iter().map(|q| modal(&zeros, q, &zeros)).collect();
        let force = constant.into_iter().zip(linear).enumerate().map(|(g, (constant, linear))| {
            ModalForce { constant, linear, sticking: of_sticks.iter().map(|of| of[g]).collect() }
        });
        let affine = |EventFunction { functional, .. }: &EventFunction| {
            let of_position = |q: &[f64]| dot(&mut functional.position.iter().copied(), q);
            let of_velocity = dot(&mut functional.velocity.iter().copied(), &velocity);
            let constant = Doubled::from(functional.constant).add(of_position(&position));
            AffineFunction {
                constant: constant.add(of_velocity).value(),
                slope: of_position(&velocity).value(),
                sticking: sticking.iter().map(|q| of_position(q).value()).collect(),
            }
        };
        Reference {
            force: force.collect(),
            is_steady: velocity.iter().all(|&speed| speed == 0.0),
            functions: functions.iter().map(affine).collect(),
            size: [largest(&self.position), largest(&self.velocity)],
            at: self.position.into_iter().zip(self.velocity).map(|(q, u)| [q, u]).collect(),
            sticking: self
                .sticking
                .into_iter()
                .map(|of| Sticking { size: largest(&of), of })
                .collect(),
        }
    }
}
