//! What rounding of the rows of the equation of motion leaves in an event function on a panel.
//!
//! The polynomials of a panel obey the equation of motion with a defect: of each order k, the row of a coordinate is rounded by
//! at most the number of its operations times the sum of its absolute terms, also where these cancel. The error e of the
//! polynomials starts at zero, and with `|A|` and `|B|`, the absolute values of M^-1 L' K and M^-1 L' C, it stays below the
//! solution of `e'' = |A| e + |B| e' + defect`. An event function sees of this solution a sum over the sizes of all
//! coefficients, whose weights depend on the combination alone.

use crate::contact::functional::Functional;
use crate::linalg::sparse::SparseMatrix;
use crate::numerics::first_root::polynomial::DEGREE;
use crate::scene::model::Scene;
use crate::scene::reduction::bases::Reduction;

/// Times that a defect goes on to the neighbours: what follows is below 6^30 / 30! = 1e-9 of the rest, in the norm.
const TIMES: usize = DEGREE + 1;

/// The weights of one event function, on the widest panel, for one rounding per operation.
#[derive(Debug)]
pub(crate) struct RowRounding {
    /// For each coordinate those of its sizes as in `Sizes`, q before q' of the constant coefficients, the linear ones and the
    /// others, and that of its force.
    weights: Vec<[f64; 7]>,
    /// s
    width: f64,
    /// The power of the width with which the error grows at least.
    power: i32,
}

impl RowRounding {
    /// Where mass couples no coordinates and every coordinate has some.
    pub fn new(scene: &Scene, reduction: &Reduction, functional: &Functional, width: f64) -> Self {
        let kept = &reduction.kept;
        let inverse: Vec<f64> = kept.iter().map(|&k| 1.0 / scene.mass.get(k, k)).collect();
        // Weights of the rows of `|M^-1 L'| |matrix|`.
        let product = |weights: &[f64], matrix: &SparseMatrix| {
            let mut sums = vec![0.0; scene.size];
            for (i, weight) in weights.iter().enumerate().filter(|entry| *entry.1 > 0.0) {
                for (source, factor) in reduction.sources(i) {
                    let factor = weight * factor.abs() * inverse[i];
                    matrix.row(source).for_each(|(k, entry)| sums[k] += factor * entry.abs());
                }
            }
            sums
        };
        let [mut of_q, mut of_u] = [&functional.position, &functional.velocity].map(|terms| {
            let mut all = vec![0.0; kept.len()];
            let kept = terms.iter().filter_map(|&(k, weight)| Some((reduction.place(k)?, weight)));
            kept.for_each(|(place, weight)| all[place] += weight.abs());
            all
        });
        let power = if of_u.iter().all(|weight| *weight == 0.0) { 2 } else { 1 };
        // Of defects of order 0, 1 and 2, of which one of order k is k! h^(l + 1) / (k + l + 1)! after l times; higher ones less.
        let mut defects = [(); 3].map(|()| vec![0.0; kept.len()]);
        for l in 0..TIMES {
            let [first, second, third] = [1, 2, 3].map(|more| (l + more) as f64);
            let step = width / first;
            let factors = [step, step / second, 2.0 * step / (second * third)];
            for (sums, factor) in defects.iter_mut().zip(factors) {
                sums.iter_mut().zip(&of_u).for_each(|(sum, weight)| *sum += factor * weight);
            }
            let [pulled, dragged] =
                [&scene.stiffness, &scene.damping].map(|matrix| product(&of_u, matrix));
            for (i, &k) in kept.iter().enumerate() {
                of_u[i] = step * (of_q[i] + dragged[k]);
                of_q[i] = step * pulled[k];
            }
        }
        let mut weights = vec![[0.0; 7]; scene.size];
        for (i, &k) in kept.iter().enumerate() {
            weights[k][6] = defects[0][i] * inverse[i];
        }
        for (order, defects) in defects.iter().enumerate() {
            for (half, matrix) in [&scene.stiffness, &scene.damping].into_iter().enumerate() {
                for (weights, sum) in weights.iter_mut().zip(product(defects, matrix)) {
                    weights[2 * order + half] = sum;
                }
            }
        }
        Self { weights, width, power }
    }

    /// The error of the function for one rounding per operation, on a panel of this width.
    pub fn of(&self, width: f64, sizes: &[[Vec<f64>; 2]; 3], force: &[f64]) -> f64 {
        let [[q0, u0], [q1, u1], [q2, u2]] =
            sizes.each_ref().map(|of| of.each_ref().map(|x| &x[..force.len()]));
        let mut sum = 0.0;
        for (k, [a, b, c, d, e, f, of_force]) in self.weights.iter().enumerate() {
            let of_sizes = a * q0[k] + b * u0[k] + c * q1[k] + d * u1[k] + e * q2[k] + f * u2[k];
            sum += of_sizes + of_force * force[k].abs();
        }
        (width / self.width).powi(self.power) * sum
    }
}
