//! Modal propagation: every mode of the combination moves on its own.
//!
//! `z' = lambda z + p0 + p1 t` for each mode. With `w = z''`, which is a pure exponential,
//!
//! ```text
//! z(t + h) = z + h z' + h^2 phi2(lambda h) w,   z'(t + h) = z' + h phi1(lambda h) w,   w(t + h) = e^{lambda h} w
//! ```
//!
//! holds for every lambda, zero included, without cancellation; an event function `Re sum h_r z_r + ..`
//! is then a polynomial with coefficients `Re sum h_r w_r lambda_r^j / (j + 2)!` from the second power on.

use std::sync::OnceLock;

use num_complex::Complex64;

use super::phi::{exponential_and_phi, phi2_bound};
use super::{COEFFICIENTS, DEGREE, Panel, REACH};
use crate::event::EventFunction;
use crate::reduction::Reduced;
use crate::spectrum::Mode;

/// Widths grow by powers of two from the one that the fastest mode allows: 2^-40 .. 1 covers twelve
/// orders of magnitude of time constants in one scene.
const LEVELS: usize = 64;

/// Everything about the modes of one combination that does not depend on the state.
#[derive(Debug)]
pub(crate) struct ModalBasis {
    kept: Vec<usize>,
    /// Ascending in modulus; one of each conjugate pair.
    lambda: Vec<Complex64>,
    /// Right vectors with the weight of the conjugate, mode fastest: `q_k = Re sum_r shape[k][r] z_r`.
    shape: Vec<Complex64>,
    /// `z_r = sum_k from_position[k][r] q_k + from_velocity[k][r] q'_k`, mode fastest.
    from_position: Vec<Complex64>,
    from_velocity: Vec<Complex64>,
    force_constant: Vec<Complex64>,
    force_linear: Vec<Complex64>,
    sticking: Vec<StickingForce>,
    functions: Vec<ModalFunction>,
    base_width: f64,
    levels: [OnceLock<Level>; LEVELS],
}

/// The modal force per unit of the tangential displacement at which a contact sticks.
#[derive(Debug)]
struct StickingForce {
    coordinate: usize,
    speed: f64,
    force: Vec<Complex64>,
}

/// An event function in modal coordinates.
#[derive(Debug)]
struct ModalFunction {
    weights: Vec<Complex64>,
    magnitudes: Vec<f64>,
    constant: f64,
    /// (coordinate, weight) of the tangential displacements of sticking contacts.
    sticking: Vec<(usize, f64)>,
    slope: f64,
}

/// What depends on the width of a panel alone.
#[derive(Debug)]
struct Level {
    width: f64,
    exponential: Vec<Complex64>,
    phi1: Vec<Complex64>,
    phi2: Vec<Complex64>,
    /// Modes slow enough for the polynomials: a prefix.
    slow: usize,
    /// `Re` and `Im` of `x_r^j / (j + 2)!`, j fastest.
    powers_re: Vec<f64>,
    powers_im: Vec<f64>,
    /// Bound of `|h^2 phi2(x s) s^2|` on the panel: by the series for slow modes, for decaying fast ones by
    /// `min(h^2 / 2, (2 + |x|) / |lambda|^2)`; infinite for growing fast ones.
    reach: Vec<f64>,
}

const TAIL: usize = COEFFICIENTS - 2;

impl ModalBasis {
    pub fn new(reduced: &Reduced, functions: &[EventFunction], mut modes: Vec<Mode>) -> Self {
        modes.sort_by(|p, q| p.eigenvalue.norm().total_cmp(&q.eigenvalue.norm()));
        let m = reduced.size();
        let count = modes.len();
        let lambda: Vec<Complex64> = modes.iter().map(|mode| mode.eigenvalue).collect();
        let mut shape = vec![Complex64::default(); m * count];
        let mut from_position = shape.clone();
        let mut from_velocity = shape.clone();
        for (r, mode) in modes.iter().enumerate() {
            let weight = if mode.is_real() { 1.0 } else { 2.0 };
            for k in 0..m {
                shape[k * count + r] = weight * mode.right[k];
                // left' ((C + lambda M) q + M q') / a
                let product = |matrix: &[f64]| -> Complex64 {
                    (0..m).map(|i| mode.left[i] * matrix[i * m + k]).sum::<Complex64>() / mode.a
                };
                from_velocity[k * count + r] = product(&reduced.mass);
                from_position[k * count + r] =
                    product(&reduced.damping) + mode.eigenvalue * from_velocity[k * count + r];
            }
        }
        let modal_force = |force: &[f64]| -> Vec<Complex64> {
            modes
                .iter()
                .map(|mode| {
                    mode.left.iter().zip(force).map(|(v, f)| v * f).sum::<Complex64>() / mode.a
                })
                .collect()
        };
        let sticking: Vec<StickingForce> = reduced
            .sticking
            .iter()
            .map(|stick| StickingForce {
                coordinate: stick.coordinate,
                speed: stick.speed,
                force: modal_force(&stick.load),
            })
            .collect();
        let mut column = vec![usize::MAX; reduced.kept.last().map_or(0, |last| last + 1)];
        reduced.kept.iter().enumerate().for_each(|(j, &k)| column[k] = j);
        let column = |k: usize| column.get(k).copied().filter(|&j| j != usize::MAX);
        let functions = functions
            .iter()
            .map(|function| {
                let functional = &function.functional;
                let mut modal = ModalFunction {
                    weights: vec![Complex64::default(); count],
                    magnitudes: Vec::new(),
                    constant: functional.constant,
                    sticking: Vec::new(),
                    slope: 0.0,
                };
                let stuck = |k: usize| sticking.iter().find(|stick| stick.coordinate == k);
                for &(k, weight) in &functional.position {
                    if let Some(j) = column(k) {
                        for r in 0..count {
                            modal.weights[r] += weight * shape[j * count + r];
                        }
                    } else if let Some(stick) = stuck(k) {
                        modal.sticking.push((k, weight));
                        modal.slope += weight * stick.speed;
                    }
                }
                for &(k, weight) in &functional.velocity {
                    if let Some(j) = column(k) {
                        for r in 0..count {
                            modal.weights[r] += weight * lambda[r] * shape[j * count + r];
                        }
                    } else if let Some(stick) = stuck(k) {
                        modal.constant += weight * stick.speed;
                    }
                }
                modal.magnitudes = modal.weights.iter().map(|h| h.norm()).collect();
                modal
            })
            .collect();
        let fastest = lambda.last().map_or(0.0, |lambda| lambda.norm());
        Self {
            kept: reduced.kept.clone(),
            shape,
            from_position,
            from_velocity,
            force_constant: modal_force(&reduced.force_constant),
            force_linear: modal_force(&reduced.force_linear),
            sticking,
            functions,
            // Without modes every motion is prescribed and linear; any width does.
            base_width: if fastest > 0.0 { REACH / fastest } else { 1.0 },
            levels: [const { OnceLock::new() }; LEVELS],
            lambda,
        }
    }

    fn level(&self, level: usize) -> &Level {
        self.levels[level].get_or_init(|| self.build_level(self.base_width * (level as f64).exp2()))
    }

    fn build_level(&self, width: f64) -> Level {
        let count = self.lambda.len();
        let mut level = Level {
            width,
            exponential: Vec::with_capacity(count),
            phi1: Vec::with_capacity(count),
            phi2: Vec::with_capacity(count),
            // Ulps above the reach, so that the fastest mode itself belongs to level 0.
            slow: self
                .lambda
                .partition_point(|lambda| lambda.norm() * width <= REACH * (1.0 + 1e-12)),
            powers_re: vec![0.0; count * TAIL],
            powers_im: vec![0.0; count * TAIL],
            reach: Vec::with_capacity(count),
        };
        for (r, &lambda) in self.lambda.iter().enumerate() {
            let x = lambda * width;
            let (exponential, phi1, phi2) = exponential_and_phi(x);
            level.exponential.push(exponential);
            level.phi1.push(width * phi1);
            level.phi2.push(width * width * phi2);
            if r < level.slow {
                let mut power = Complex64::from(0.5 * width * width);
                for j in 0..TAIL {
                    level.powers_re[r * TAIL + j] = power.re;
                    level.powers_im[r * TAIL + j] = power.im;
                    power *= x / (j + 3) as f64;
                }
                level.reach.push(width * width * phi2_bound(x.norm()));
            } else if lambda.re <= 0.0 {
                level.reach.push((0.5 * width * width).min((2.0 + x.norm()) / lambda.norm_sqr()));
            } else {
                level.reach.push(f64::INFINITY);
            }
        }
        level
    }
}

/// One phase in modal coordinates.
#[derive(Debug)]
pub(crate) struct ModalMotion<'a> {
    basis: &'a ModalBasis,
    start: f64,
    panels: u32,
    level: usize,
    z: Vec<Complex64>,
    dz: Vec<Complex64>,
    /// z''
    w: Vec<Complex64>,
    /// p1 of this phase.
    force_linear: &'a [Complex64],
    /// Constant part of each event function at local time 0.
    constants: Vec<f64>,
    /// (coordinate, q at local time 0, speed)
    prescribed: Vec<(usize, f64, f64)>,
}

impl<'a> ModalMotion<'a> {
    /// Starts at local time 0 from (q, q').
    pub fn new(basis: &'a ModalBasis, q: &[f64], u: &[f64]) -> Self {
        let count = basis.lambda.len();
        let mut z = vec![Complex64::default(); count];
        for (j, &k) in basis.kept.iter().enumerate() {
            let row = j * count..(j + 1) * count;
            let (from_q, from_u) = (&basis.from_position[row.clone()], &basis.from_velocity[row]);
            for r in 0..count {
                z[r] += from_q[r] * q[k] + from_u[r] * u[k];
            }
        }
        let mut force = basis.force_constant.clone();
        for stick in &basis.sticking {
            for (p, load) in force.iter_mut().zip(&stick.force) {
                *p += load * q[stick.coordinate];
            }
        }
        let dz: Vec<Complex64> = (0..count).map(|r| basis.lambda[r] * z[r] + force[r]).collect();
        let w = (0..count).map(|r| basis.lambda[r] * dz[r] + basis.force_linear[r]).collect();
        let constants = basis
            .functions
            .iter()
            .map(|function| {
                let stuck: f64 = function.sticking.iter().map(|&(k, weight)| weight * q[k]).sum();
                function.constant + stuck
            })
            .collect();
        Self {
            basis,
            start: 0.0,
            panels: 0,
            level: 0,
            z,
            dz,
            w,
            force_linear: &basis.force_linear,
            constants,
            prescribed: basis
                .sticking
                .iter()
                .map(|stick| (stick.coordinate, q[stick.coordinate], stick.speed))
                .collect(),
        }
    }

    pub fn start(&self) -> f64 {
        self.start
    }

    /// Whether every mode too fast for the polynomials of `level` has decayed below rounding.
    fn allows(&self, level: &Level) -> bool {
        let fast = level.slow..self.w.len();
        self.basis.functions.iter().all(|function| {
            let bound: f64 = fast
                .clone()
                .map(|r| function.magnitudes[r] * self.w[r].norm() * level.reach[r])
                .sum();
            let scale: f64 =
                function.magnitudes.iter().zip(&self.z).map(|(h, z)| h * z.norm()).sum();
            bound <= f64::EPSILON * scale
        })
    }

    pub fn expand(&mut self, panel: &mut Panel) {
        while self.level + 1 < LEVELS && self.allows(self.basis.level(self.level + 1)) {
            self.level += 1;
        }
        let basis = self.basis;
        let level = basis.level(self.level);
        let count = self.w.len();
        panel.width = level.width;
        panel.coefficients.clear();
        panel.coefficients.resize(basis.functions.len() * COEFFICIENTS, 0.0);
        panel.error.clear();
        panel.curvature_error.clear();
        // Dot products of `count` complex terms, a table built by DEGREE multiplications, Horner's rule,
        // and the recurrence over the panels before this one, each a few roundings of relative size u.
        let unit = 0.5 * f64::EPSILON;
        let rounding = unit * (2 * count + 3 * DEGREE + 10 + 8 * self.panels as usize) as f64;
        // The first neglected term, with the geometric factor of those after it.
        let first = DEGREE + 1;
        let truncation = |x: f64| -> f64 {
            let term: f64 = (3..=first).map(|j| x / j as f64).product::<f64>() * 0.5;
            term / (1.0 - x / (first + 1) as f64)
        };
        let slow_truncation = truncation(REACH);
        for (index, function) in basis.functions.iter().enumerate() {
            let c = &mut panel.coefficients[index * COEFFICIENTS..(index + 1) * COEFFICIENTS];
            let mut value = self.constants[index] + function.slope * self.start;
            let mut slope = function.slope;
            let mut affine = self.constants[index].abs() + (function.slope * self.start).abs();
            let mut curvature = 0.0;
            let mut remainder = 0.0;
            for r in 0..count {
                let h = function.weights[r];
                value += h.re * self.z[r].re - h.im * self.z[r].im;
                slope += h.re * self.dz[r].re - h.im * self.dz[r].im;
                let size = function.magnitudes[r];
                affine += size * (self.z[r].norm() + level.width * self.dz[r].norm());
                let amplitude = size * self.w[r].norm();
                if r < level.slow {
                    curvature += amplitude * level.reach[r];
                    remainder += amplitude * level.width * level.width * slow_truncation;
                    let g = h * self.w[r];
                    let re = &level.powers_re[r * TAIL..(r + 1) * TAIL];
                    let im = &level.powers_im[r * TAIL..(r + 1) * TAIL];
                    for ((c, re), im) in c[2..].iter_mut().zip(re).zip(im) {
                        *c += g.re * re - g.im * im;
                    }
                } else {
                    remainder += amplitude * level.reach[r];
                }
            }
            c[0] = value;
            c[1] = slope * level.width;
            affine += function.slope.abs() * level.width;
            panel.curvature_error.push(rounding * curvature + remainder);
            panel.error.push(rounding * (affine + curvature) + remainder);
        }
    }

    pub fn advance(&mut self) {
        let level = self.basis.level(self.level);
        for r in 0..self.w.len() {
            let w = self.w[r];
            self.z[r] += level.width * self.dz[r] + level.phi2[r] * w;
            self.dz[r] += level.phi1[r] * w;
            self.w[r] = level.exponential[r] * w;
        }
        self.start += level.width;
        self.panels += 1;
    }

    fn propagated(&self, offset: f64) -> (Vec<Complex64>, Vec<Complex64>) {
        let mut z = self.z.clone();
        let mut dz = self.dz.clone();
        for r in 0..z.len() {
            let lambda = self.basis.lambda[r];
            let force = self.dz[r] - lambda * self.z[r];
            // Inverting z' = lambda z + p costs one exponential, and loses no digit unless p / lambda,
            // the static part, is larger than what moves.
            if force.norm_sqr() <= 64.0 * (lambda * self.z[r]).norm_sqr()
                && self.force_linear[r].norm_sqr() <= 64.0 * (lambda * self.dz[r]).norm_sqr()
            {
                let w = (lambda * offset).exp() * self.w[r];
                dz[r] = (w - self.force_linear[r]) / lambda;
                z[r] = (dz[r] - force - self.force_linear[r] * offset) / lambda;
            } else {
                let (_, phi1, phi2) = exponential_and_phi(lambda * offset);
                z[r] += offset * (self.dz[r] + offset * phi2 * self.w[r]);
                dz[r] += offset * phi1 * self.w[r];
            }
        }
        (z, dz)
    }

    pub fn state(&self, offset: f64, q: &mut [f64], u: &mut [f64]) {
        let (z, dz) = self.propagated(offset);
        let count = z.len();
        for (j, &k) in self.basis.kept.iter().enumerate() {
            let shape = &self.basis.shape[j * count..(j + 1) * count];
            let real_dot = |x: &[Complex64]| -> f64 {
                shape.iter().zip(x).map(|(a, b)| a.re * b.re - a.im * b.im).sum()
            };
            q[k] = real_dot(&z);
            u[k] = real_dot(&dz);
        }
        for &(k, start, speed) in &self.prescribed {
            q[k] = start + speed * (self.start + offset);
            u[k] = speed;
        }
    }
}
