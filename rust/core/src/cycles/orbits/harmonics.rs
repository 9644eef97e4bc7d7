//! Fourier coefficients of a periodic orbit in closed form: no window, no leakage, no aliasing.
//!
//! Along a phase every acceleration is a sum of exponentials, `q'' = Re sum_r xi_r w_r e^{lambda_r t}`. A displacement
//! has no jump and a velocity only those of the impacts, so two integrations by parts over a period T give, for
//! `c_k = 1/T int_0^T q e^{-i k omega t} dt`, omega = 2 pi / T, k != 0,
//!
//! ```text
//! -(k omega)^2 T c_k = sum over phases int q'' e^{-i k omega t} dt + sum over impacts (q'+ - q'-) e^{-i k omega t_j}
//! int_0^tau e^{(lambda - i k omega) t} dt = tau phi1((lambda - i k omega) tau)
//! ```
//!
//! and for the mean, with the modal velocity `z'` at the start of a phase and `z'' = lambda z' + f`,
//!
//! ```text
//! int_0^tau q dt = tau q + tau^2 sum_r xi_r (z'_r phi2(lambda_r tau) + tau f_r phi3(lambda_r tau))
//! ```
//!
//! All coefficients of phases without a well-conditioned modal basis, with dofs without mass or under loads in time are
//! integrated by Gauss's rule on pieces short enough for rounding: on a piece of length h the m-point rule leaves at most
//! `h^{2m+1} (m!)^4 / ((2m + 1) ((2m)!)^3) |f^(2m)|`, and here `|f^(2m)| <= rho^{2m} |f|` with
//! rho = the fastest eigenvalue plus k omega.

use num_complex::Complex64;

use crate::contact::linear_friction::of_phase;
use crate::cycles::linearization::flow::Flow;
use crate::cycles::orbits::orbit::{Orbit, OrbitFailure, OrbitPhase, go_on};
use crate::modes::complex_modes::Modes;
use crate::numerics::gauss::gauss_rule;
use crate::numerics::phi::{exponential_and_phi, phi3};

/// Longest piece, times rho: the rule of 18 points leaves 1e-30 of the largest integrand there, e^8 times that at its
/// start.
const PIECE: f64 = 8.0;
/// Condition of the modes up to which the closed form is used: it loses about as many ulp.
const CONDITION: f64 = 1e4;

/// Harmonics of a phase between two looks at whether the computation is over.
const PATIENCE: usize = 32;

/// Coefficients c_0 .. c_count of every dof, harmonic by harmonic, m.
pub struct Harmonics {
    /// Order of the highest harmonic.
    pub count: usize,
    /// c_k of dof i at `k n + i`, with n dofs and k = 0 .. count, m.
    pub displacement: Vec<Complex64>,
}

impl Orbit {
    /// Fourier coefficients `c_k` of the displacement of every dof, with
    /// `x(t) = c_0 + 2 Re sum_k c_k e^{i k omega t}` and t = 0 at the section, for k = 0 .. count; a failure as
    /// soon as `is_over`, which every few dozen harmonics of a phase ask.
    pub fn harmonics(
        &self,
        count: usize,
        is_over: &dyn Fn() -> bool,
    ) -> Result<Harmonics, OrbitFailure> {
        let scene = self.scene();
        let (coordinates, n) = (scene.size, scene.structure());
        let flows = self.flows()?;
        let omega = std::f64::consts::TAU / self.period;
        let mut sums = vec![Complex64::default(); (count + 1) * n];
        let mut time = 0.0;
        let look = |k: usize| if k.is_multiple_of(PATIENCE) { go_on(is_over) } else { Ok(()) };
        for (index, (step, flow)) in self.steps.iter().zip(&flows).enumerate() {
            let bare = scene.bare();
            let modes = match flow.panel() {
                None => Some(Modes::new(&of_phase(bare, flow.combination()), flow.combination())?),
                Some(_) => None,
            };
            let loads = if self.load_periods > 0 { scene.fastest_load() } else { 0.0 };
            let rates = modes.iter().flat_map(|modes| &modes.eigenvalues);
            let fastest = rates.map(|l| l.norm()).fold(loads, f64::max);
            let exact = modes.as_ref().filter(|modes| {
                // Dofs without mass, and those that follow others, are none of the coordinates of the modes.
                self.load_periods == 0
                    && scene.massless.is_empty()
                    && scene.dependents.is_empty()
                    && modes.condition.iter().all(|&condition| condition < CONDITION)
            });
            if let Some(modes) = exact {
                let kept = &modes.reduced.reduction.kept;
                let field = flow.field(&step.state);
                let m = kept.len();
                let rate: Vec<f64> = kept
                    .iter()
                    .map(|&k| field[k])
                    .chain(kept.iter().map(|&k| field[coordinates + k]))
                    .collect();
                // z' are the coordinates of y', and f = left' F1 / a.
                let velocities = modes.coordinates(&rate);
                let ramp = |r: usize| {
                    let left = &modes.left[m * r..m * (r + 1)];
                    let terms = left.iter().zip(&modes.reduced.force_linear);
                    terms.map(|(l, f)| l * f).sum::<Complex64>() / modes.a[r]
                };
                let tau = step.duration;
                let (q, u) = step.state.split_at(coordinates);
                let (q, _) = scene.at_rest(q, u);
                (0..n).for_each(|k| sums[k] += tau * (q[k] + 0.5 * tau * field[k]));
                kept.iter().for_each(|&k| sums[k] -= 0.5 * tau * tau * field[k]);
                let mut w = Vec::with_capacity(velocities.len());
                for (r, (&dz, &lambda)) in velocities.iter().zip(&modes.eigenvalues).enumerate() {
                    let f = ramp(r);
                    w.push(lambda * dz + f);
                    let x = lambda * tau;
                    let factor = tau * tau * (dz * exponential_and_phi(x).2 + tau * f * phi3(x));
                    for (j, &coordinate) in kept.iter().enumerate() {
                        sums[coordinate] += factor * modes.right[m * r + j];
                    }
                }
                for k in 1..=count {
                    look(k)?;
                    let s = omega * k as f64;
                    let shift = Complex64::new(0.0, -s * time).exp();
                    for (r, w) in w.iter().enumerate() {
                        let exponent = modes.eigenvalues[r] - Complex64::new(0.0, s);
                        let phi1 = exponential_and_phi(exponent * step.duration).1;
                        let factor = shift * step.duration * phi1 * w;
                        for (j, &coordinate) in kept.iter().enumerate() {
                            sums[k * n + coordinate] += factor * modes.right[m * r + j];
                        }
                    }
                }
            } else {
                integrate(step, flow, fastest, |state, weight, _| {
                    let (q, u) = state.split_at(coordinates);
                    let (q, _) = scene.at_rest(q, u);
                    (0..n).for_each(|k| sums[k] += weight * q[k]);
                });
                for k in 1..=count {
                    look(k)?;
                    let s = omega * k as f64;
                    integrate(step, flow, fastest + s, |state, weight, t| {
                        let field = flow.field(state);
                        let factor = weight * Complex64::new(0.0, -s * (time + t)).exp();
                        let (u, acceleration) = field.split_at(coordinates);
                        let (_, acceleration) = scene.at_rest(u, acceleration);
                        (0..n).for_each(|i| sums[k * n + i] += factor * acceleration[i]);
                    });
                }
            }
            time += step.duration;
            let next = &self.steps[(index + 1) % self.steps.len()].state;
            let end = flow.end(&step.state, step.duration);
            for k in 1..=count {
                let turn = Complex64::new(0.0, -omega * k as f64 * time).exp();
                for i in 0..n {
                    let jump = next[coordinates + i] - end[coordinates + i];
                    sums[k * n + i] += turn * jump;
                }
            }
        }
        let mut displacement = Vec::with_capacity(sums.len());
        for k in 0..=count {
            let s = omega * k as f64;
            let factor = if k == 0 { 1.0 / self.period } else { -1.0 / (self.period * s * s) };
            let row = &sums[k * n..(k + 1) * n];
            let part = |f: fn(&Complex64) -> f64| -> Vec<f64> {
                let values: Vec<f64> = row.iter().map(|c| factor * f(c)).collect();
                if k == 0 { scene.positions(&values) } else { scene.velocities(&values) }
            };
            let (re, mut im) = (part(|c| c.re), part(|c| c.im));
            if k == 0 {
                im.fill(0.0);
            }
            displacement.extend(re.into_iter().zip(im).map(|(re, im)| Complex64::new(re, im)));
        }
        Ok(Harmonics { count, displacement })
    }
}

/// Calls `add(state, weight, time)` at the nodes of Gauss's rule over the phase; under a law of friction each series by
/// itself, which is shorter than the fastest mode needs.
fn integrate(step: &OrbitPhase, flow: &Flow<'_>, rate: f64, mut add: impl FnMut(&[f64], f64, f64)) {
    let rule = gauss_rule();
    let mut from = 0.0;
    while from < step.duration {
        let to = flow.smooth_until(&step.state, from).unwrap_or(step.duration).min(step.duration);
        let pieces = (rate * (to - from) / PIECE).ceil().max(1.0) as usize;
        let width = (to - from) / pieces as f64;
        for piece in 0..pieces {
            for (node, weight) in rule.nodes.iter().zip(&rule.weights) {
                let time = from + width * (piece as f64 + node);
                add(&flow.end(&step.state, time), width * weight, time);
            }
        }
        from = to;
    }
}
