//! The modes of one combination, laid out for propagation: everything that does not depend on the state.

use std::sync::OnceLock;

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use crate::contact::event_function::EventFunction;
use crate::linalg::dense::{Factors, apply};
use crate::modes::mode::Mode;
use crate::motion::panel::REACH;
use crate::numerics::double_double::Doubled;
use crate::numerics::first_root::COEFFICIENTS;
use crate::numerics::phi::{exponential_and_phi, inverse, phi2_bound};
use crate::numerics::simd::{ComplexGroup, GROUP, Group, group, in_groups};
use crate::scene::model::Scene;
use crate::scene::reduction::Reduced;

/// Widths grow by powers of two from the one that the fastest mode allows: enough for forty orders
/// of magnitude between the fastest mode and the duration.
pub(super) const LEVELS: usize = 128;
/// The coefficients from the second power on come in groups.
pub(super) const TAIL_GROUPS: usize = (COEFFICIENTS - 2) / GROUP;
const _: () = assert!(TAIL_GROUPS * GROUP == COEFFICIENTS - 2);

/// Complex numbers in groups.
#[derive(Debug, Clone, Default)]
pub(super) struct ComplexVector(pub Vec<ComplexGroup>);

impl ComplexVector {
    pub(super) fn of(values: &[Complex64]) -> Self {
        Self(complex_groups(values).collect())
    }

    #[inline(always)]
    pub fn get(&self, r: usize) -> Complex64 {
        self.0[r / GROUP].get(r % GROUP)
    }
}

/// Complex numbers in groups, the last filled up with zeros.
fn complex_groups(values: &[Complex64]) -> impl Iterator<Item = ComplexGroup> {
    values.chunks(GROUP).map(|chunk| {
        let mut lanes = [Complex64::default(); GROUP];
        lanes[..chunk.len()].copy_from_slice(chunk);
        ComplexGroup::of(lanes)
    })
}

/// Modes ascending in modulus, one of each conjugate pair, in groups filled up with zeros.
#[derive(Debug)]
pub(crate) struct ModalBasis {
    pub(super) kept: Vec<usize>,
    pub(super) count: usize,
    pub(super) groups: usize,
    pub(super) lambda: ComplexVector,
    /// 1 / lambda, 0 where lambda is.
    pub(super) inverse: ComplexVector,
    /// Right vectors with the weight of the conjugate, `q_k = Re sum_r shape_r[k] z_r`: for each group of kept
    /// coordinates, of all modes.
    pub(super) shape: Vec<ComplexGroup>,
    /// For each kept coordinate, of all groups of modes.
    pub(super) projection: Vec<Projection>,
    /// (coordinate, speed) of the contacts that stick.
    pub(super) sticking: Vec<(usize, f64)>,
    /// Weights of the modes in each event function.
    pub(super) functions: Vec<Vec<Weight>>,
    /// The motions about which the modes may move: the origin, and the equilibrium where there is one.
    pub(super) references: Vec<Reference>,
    base_width: f64,
    levels: [OnceLock<Box<Level>>; LEVELS],
}

/// `z_r = sum_k position_rk q_k + velocity_rk q'_k`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Projection {
    pub position: ComplexGroup,
    pub velocity: ComplexGroup,
}

/// `position + velocity t`, a motion of the whole scene, and what is left to the modes that move about it.
#[derive(Debug)]
pub(super) struct Reference {
    /// Of the kept coordinates at local time 0 with every sticking contact at 0, and the velocity.
    pub at: Vec<[f64; 2]>,
    /// What each sticking contact adds to the position per unit of its own.
    pub sticking: Vec<Vec<f64>>,
    /// For each group of modes.
    pub force: Vec<ModalForce>,
    /// For each event function.
    pub functions: Vec<AffineFunction>,
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

/// Of a group of modes in an event function.
#[derive(Debug, Clone, Copy)]
pub(super) struct Weight {
    pub of: ComplexGroup,
    /// |of|
    pub magnitude: Group,
}

/// What depends on the width of a panel alone.
#[derive(Debug)]
pub(super) struct Level {
    pub width: f64,
    /// Modes slow enough for the polynomials: a prefix.
    pub slow: usize,
    /// Of each slow mode.
    pub powers: Vec<Powers>,
    /// What the polynomials leave out, relative to `reach` of the slow modes.
    pub truncation: f64,
    pub modes: Vec<LevelModes>,
}

/// A group of modes on a panel.
#[derive(Debug, Clone, Copy)]
pub(super) struct LevelModes {
    /// From the start to the middle of the panel; zero for fast modes, which stay affine there.
    pub half: Step,
    /// From the start to the end of the panel.
    pub whole: Step,
    /// Bound of `|t^2 phi2(lambda t)|` on the panel: by the series, for decaying modes also by
    /// `min(h^2 / 2, (2 + |x|) / |lambda|^2)`; infinite for growing modes too fast for the series.
    pub reach: Group,
    /// The same for fast modes alone, zero for slow ones.
    pub fast_reach: Group,
    /// Bound of what a mode adds, per w at the start, to its quadratic part about the middle:
    /// `|x|^3 / 48 |lambda|^2` for slow modes that decay, `reach` for fast ones.
    pub middle_reach: Group,
    /// 1 / lambda of the modes that turn within the width, `|lambda| h > 1`, else zero; and the bound of
    /// `|e^{lambda t} / lambda^2|` of these, of `|t^2 phi2|` of the others.
    pub turning: ComplexGroup,
    pub envelope: Group,
}

/// What moves a group of modes by a step h.
#[derive(Debug, Clone, Copy)]
pub(super) struct Step {
    pub exponential: ComplexGroup,
    /// `h phi1`, `h^2 phi2`
    pub phi1: ComplexGroup,
    pub phi2: ComplexGroup,
}

/// `x^j h^2 / (j + 2)!` for x = lambda h; zero where below rounding of the first.
#[derive(Debug, Clone)]
pub(super) struct Powers(pub [ComplexGroup; TAIL_GROUPS]);

impl ModalBasis {
    pub fn new(
        scene: &Scene,
        reduced: &Reduced,
        functions: &[EventFunction],
        mut modes: Vec<Mode>,
    ) -> Self {
        modes.sort_by(|p, q| p.eigenvalue.norm_sqr().total_cmp(&q.eigenvalue.norm_sqr()));
        let m = reduced.size();
        let count = modes.len();
        let groups = count.div_ceil(GROUP);
        let stride = groups * GROUP;
        let mut lambda = vec![Complex64::default(); stride];
        let mut shape = vec![Complex64::default(); m * stride];
        let mut from_position = shape.clone();
        let mut from_velocity = shape.clone();
        for (r, mode) in modes.iter().enumerate() {
            lambda[r] = mode.eigenvalue;
            let weight = if mode.is_real() { 1.0 } else { 2.0 };
            for k in 0..m {
                shape[k * stride + r] = weight * mode.right[k];
                // left' ((C + lambda M) q + M q') / a
                let product = |matrix: &DMatrix<f64>| -> Complex64 {
                    let column = matrix.column(k);
                    let terms = mode.left.iter().zip(&column);
                    terms.map(|(v, a)| v * a).sum::<Complex64>() / mode.a
                };
                from_velocity[k * stride + r] = product(&reduced.mass);
                from_position[k * stride + r] =
                    product(&reduced.damping) + mode.eigenvalue * from_velocity[k * stride + r];
            }
        }
        let references: Vec<Reference> = [Some(At::origin(reduced)), At::equilibrium(reduced)]
            .into_iter()
            .flatten()
            .map(|at| at.reference(scene, reduced, functions, &modes))
            .collect();
        let reduction = &reduced.reduction;
        let kept = |&(k, weight): &(usize, f64)| Some((reduction.place(k)?, weight));
        let functions = functions
            .iter()
            .map(|function| {
                let functional = &function.functional;
                let mut weights = vec![Complex64::default(); stride];
                for (j, weight) in functional.position.iter().filter_map(kept) {
                    for r in 0..count {
                        weights[r] += weight * shape[j * stride + r];
                    }
                }
                for (j, weight) in functional.velocity.iter().filter_map(kept) {
                    for r in 0..count {
                        weights[r] += weight * lambda[r] * shape[j * stride + r];
                    }
                }
                let magnitudes: Vec<f64> = weights.iter().map(|weight| weight.norm()).collect();
                let weights = complex_groups(&weights).zip(in_groups(&magnitudes));
                weights.map(|(of, magnitude)| Weight { of, magnitude }).collect()
            })
            .collect();
        let fastest = modes.last().map_or(0.0, |mode| mode.eigenvalue.norm());
        let inverse: Vec<Complex64> = lambda
            .iter()
            .map(|lambda| if lambda.norm_sqr() > 0.0 { lambda.inv() } else { Complex64::default() })
            .collect();
        let by_coordinate = (0..m.div_ceil(GROUP)).flat_map(|first| {
            let shape = &shape;
            (0..count).map(move |r| {
                let mut lanes = [Complex64::default(); GROUP];
                for (lane, value) in lanes.iter_mut().enumerate() {
                    *value =
                        shape.get((first * GROUP + lane) * stride + r).copied().unwrap_or_default();
                }
                ComplexGroup::of(lanes)
            })
        });
        let lambda = ComplexVector::of(&lambda);
        Self {
            kept: reduction.kept.clone(),
            count,
            groups,
            shape: by_coordinate.collect(),
            projection: complex_groups(&from_position)
                .zip(complex_groups(&from_velocity))
                .map(|(position, velocity)| Projection { position, velocity })
                .collect(),
            sticking: reduction.sticking.clone(),
            functions,
            references,
            // Without modes every motion is prescribed and linear: the width grows to that of the phase.
            base_width: if fastest > 0.0 { REACH / fastest } else { 1e-12 },
            levels: [const { OnceLock::new() }; LEVELS],
            lambda,
            inverse: ComplexVector::of(&inverse),
        }
    }

    /// About how many numbers it holds: shapes and projections of every mode over every coordinate.
    pub fn numbers(&self) -> usize {
        6 * self.groups * GROUP * self.kept.len()
    }

    pub(super) fn level(&self, level: usize) -> &Level {
        self.levels[level]
            .get_or_init(|| Box::new(Level::new(self, self.base_width * (level as f64).exp2())))
    }
}

/// The kept coordinates along a reference.
struct At {
    position: Vec<f64>,
    velocity: Vec<f64>,
    sticking: Vec<Vec<f64>>,
}

impl At {
    fn origin(reduced: &Reduced) -> Self {
        let zero = vec![0.0; reduced.size()];
        Self {
            position: zero.clone(),
            velocity: zero.clone(),
            sticking: vec![zero; reduced.sticking_loads.len()],
        }
    }

    /// `K q1 = F1` and `K q0 = F0 - C q1`, solved in working precision: what that leaves stays as a force. Nothing
    /// where the stiffness is singular.
    fn equilibrium(reduced: &Reduced) -> Option<Self> {
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

    /// Forces `L' (F - C q' - K q)` and event functions, in doubled precision: what a stiff scene leaves of them is
    /// a small part of their terms.
    fn reference(
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
            functions: functions.iter().map(affine).collect(),
            at: self.position.into_iter().zip(self.velocity).map(|(q, u)| [q, u]).collect(),
            sticking: self.sticking,
        }
    }
}

impl Level {
    fn new(basis: &ModalBasis, width: f64) -> Self {
        // Ulps above the reach, so that the fastest mode itself belongs to level 0.
        let longest = REACH * (1.0 + 1e-12);
        let is_slow = |lambda: Complex64| (lambda * width).norm_sqr() <= longest * longest;
        let slow = (0..basis.count).take_while(|&r| is_slow(basis.lambda.get(r))).count();
        let leading = 0.5 * width * width;
        let modes = (0..basis.groups).map(|g| {
            let mut modes = [Mover::default(); GROUP];
            for (lane, mode) in modes.iter_mut().enumerate() {
                let r = g * GROUP + lane;
                if r < basis.count {
                    *mode = Mover::new(basis.lambda.get(r), width, r < slow);
                }
            }
            LevelModes::of(&modes)
        });
        Self {
            width,
            slow,
            powers: (0..slow).map(|r| Powers::new(basis.lambda.get(r) * width, leading)).collect(),
            truncation: truncation(),
            modes: modes.collect(),
        }
    }
}

/// One mode on a panel: a lane of `LevelModes`.
#[derive(Clone, Copy, Default)]
struct Mover {
    /// e^x, h phi1 and h^2 phi2
    half: [Complex64; 3],
    whole: [Complex64; 3],
    reach: f64,
    fast_reach: f64,
    middle_reach: f64,
    turning: Complex64,
    envelope: f64,
}

impl Mover {
    fn new(lambda: Complex64, width: f64, slow: bool) -> Self {
        let x = lambda * width;
        let modulus = x.norm_sqr().sqrt();
        let reach = if slow {
            width * width * phi2_bound(modulus)
        } else if lambda.re <= 0.0 {
            (0.5 * width * width).min((2.0 + modulus) / lambda.norm_sqr())
        } else {
            f64::INFINITY
        };
        let turns = modulus > 1.0;
        let growth = x.re.max(0.0).exp();
        let step = |h: f64| {
            let (exponential, phi1, phi2) = exponential_and_phi(lambda * h);
            [exponential, h * phi1, h * h * phi2]
        };
        Self {
            half: if slow { step(0.5 * width) } else { Default::default() },
            whole: step(width),
            reach,
            fast_reach: if slow { 0.0 } else { reach },
            // Taylor's remainder, with |w| at the middle and the growth from there in terms of the start.
            middle_reach: if slow { width * width * modulus * growth / 48.0 } else { reach },
            turning: if turns { lambda.inv() } else { Complex64::default() },
            envelope: if turns { growth / lambda.norm_sqr() } else { reach },
        }
    }
}

impl LevelModes {
    fn of(modes: &[Mover; GROUP]) -> Self {
        let real = |of: fn(&Mover) -> f64| group(modes.each_ref().map(of));
        let complex = |of: fn(&Mover) -> Complex64| ComplexGroup::of(modes.each_ref().map(of));
        let step = |of: fn(&Mover) -> &[Complex64; 3]| {
            let part = |k: usize| ComplexGroup::of(modes.each_ref().map(|mode| of(mode)[k]));
            Step { exponential: part(0), phi1: part(1), phi2: part(2) }
        };
        Self {
            half: step(|mode| &mode.half),
            whole: step(|mode| &mode.whole),
            reach: real(|mode| mode.reach),
            fast_reach: real(|mode| mode.fast_reach),
            middle_reach: real(|mode| mode.middle_reach),
            turning: complex(|mode| mode.turning),
            envelope: real(|mode| mode.envelope),
        }
    }
}

impl Powers {
    fn new(x: Complex64, leading: f64) -> Self {
        let mut groups = [ComplexGroup::ZERO; TAIL_GROUPS];
        let mut power = Complex64::from(leading);
        for (g, group) in groups.iter_mut().enumerate() {
            let mut lanes = [Complex64::default(); GROUP];
            for (lane, value) in lanes.iter_mut().enumerate() {
                if power.l1_norm() > 1e-20 * leading {
                    *value = power;
                }
                power *= x * inverse(g * GROUP + lane + 3);
            }
            *group = ComplexGroup::of(lanes);
        }
        Self(groups)
    }
}

/// The sum of the terms that the polynomials of a mode leave out, over its whole series, at |x| = REACH;
/// less for slower modes.
fn truncation() -> f64 {
    let first: f64 = (3..=COEFFICIENTS).map(|j| REACH / j as f64).product::<f64>() * 0.5;
    first / (1.0 - REACH / (COEFFICIENTS + 1) as f64) / phi2_bound(REACH)
}
