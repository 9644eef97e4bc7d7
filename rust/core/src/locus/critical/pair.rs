//! Two eigenvalues that meet between two nodes, or come near to it, taken together.
//!
//! Near an exceptional point each of them is a square root of the parameter, but their mean `mu` and the square `delta` of
//! half their difference are analytic, and tell on an interval with the point in it what branches do not.
//!
//! Of two modes, with `x = Re mu` and `sqrt(delta) = y + i z`, one reaches the imaginary axis where
//!
//! ```text
//! g = x^4 - x^2 Re delta - (Im delta)^2 / 4 = (x^2 - y^2) (x^2 + z^2) = Re lambda_1 Re lambda_2 (x^2 + z^2)
//! ```
//!
//! vanishes. A mode that meets its conjugate, and goes on as two real ones, does so where `mu` vanishes, and one of the
//! real ones passes zero where `mu^2 - delta`, the product of both, does.

use num_complex::Complex64;

use crate::locus::branches::Pair;
use crate::locus::critical::point::Stretch;
use crate::locus::node::{Node, UNCOUPLED, is_steady};

/// Mean of two eigenvalues and square of half their difference, each with its derivative.
struct Together {
    mean: [Complex64; 2],
    square: [Complex64; 2],
}

impl Together {
    /// Of two modes of a node, or of one and its conjugate.
    fn new(node: &Node, modes: &[usize]) -> Self {
        let of = |mode: usize| [node.modes[mode].eigenvalue, node.slopes[mode]];
        let first = of(modes[0]);
        let second = modes.get(1).map_or(first.map(|z| z.conj()), |&mode| of(mode));
        let half = 0.5 * (first[0] - second[0]);
        Self {
            mean: [0, 1].map(|k| 0.5 * (first[k] + second[k])),
            square: [half * half, half * (first[1] - second[1])],
        }
    }
}

/// The function of two modes whose sign is that of the product of both real parts, and its derivative.
pub(crate) fn product_of_growths(node: &Node, modes: [usize; 2]) -> (f64, f64) {
    let Together { mean, square: [delta, delta_slope] } = Together::new(node, &modes);
    let [a, b] = modes.map(|mode| node.modes[mode].eigenvalue);
    let (x, x_slope, z) = (mean[0].re, mean[1].re, 0.5 * (a - b).im);
    let slope = 2.0 * x * x_slope * (2.0 * x * x - delta.re)
        - x * x * delta_slope.re
        - 0.5 * delta.im * delta_slope.im;
    (a.re * b.re * (x * x + z * z), slope)
}

/// A function of the parameter between two nodes, from what it is at either: value, derivative and uncertainty.
fn stretch([from, to]: [&Node; 2], ends: [(f64, f64, f64); 2]) -> Stretch {
    let width = to.value - from.value;
    Stretch {
        value: ends.map(|end| end.0),
        rise: ends.map(|end| end.1 * width),
        uncertainty: ends.map(|end| end.2),
    }
}

/// Whether the places are known at which one of two modes reaches the axis between two nodes, and neither node is one. Of
/// two modes whose mean lies on the axis, as without damping, neither crosses it where they meet.
pub(crate) fn is_settled(nodes: [&Node; 2], pair: &Pair) -> bool {
    let end = |side: usize| {
        let (value, slope) = product_of_growths(nodes[side], pair[side]);
        (value, slope, 0.0)
    };
    let is_off_the_axis = |side: usize| {
        let (node, modes) = (nodes[side], pair[side]);
        let uncertainty: f64 = modes.iter().map(|&mode| node.uncertainty(mode)).sum();
        let real = |mode: usize| node.modes[mode].eigenvalue.re;
        modes.iter().all(|&mode| node.growth_sign(mode) != 0.0)
            && (real(modes[0]) + real(modes[1])).abs() > uncertainty
    };
    [0, 1].into_iter().all(is_off_the_axis) && stretch(nodes, [0, 1].map(end)).is_settled()
}

/// Whether no mode that meets its conjugate reaches the axis between two nodes, and it is known whether a real one that it
/// goes on as passes zero.
fn stays_off_the_axis(nodes: [&Node; 2], modes: &[Vec<usize>; 2]) -> bool {
    let ends = [0, 1].map(|side| {
        let (node, modes) = (nodes[side], &modes[side]);
        let Together { mean, square } = Together::new(node, modes);
        let product = mean[0] * mean[0] - square[0];
        let slope = 2.0 * mean[0] * mean[1] - square[1];
        let last = modes[modes.len() - 1];
        let [first, last] =
            [modes[0], last].map(|m| (node.uncertainty(m), node.modes[m].eigenvalue.norm()));
        let lost = first.0 * last.1 + last.0 * first.1;
        [(mean[0].re, mean[1].re, 0.5 * (first.0 + last.0)), (product.re, slope.re, lost)]
    });
    let [mean, product] = [0, 1].map(|k| stretch(nodes, ends.map(|end| end[k])));
    let [before, after] = mean.signs();
    let is_damped = |side: usize| modes[side].iter().all(|&m| nodes[side].is_damped_shape(m));
    (is_damped(0) && is_damped(1) || before == after && mean.is_settled()) && product.is_settled()
}

/// How modes go on: one by one, in pairs, or with their conjugates, off the axis.
#[derive(Default)]
pub(crate) struct Continuation {
    pub singles: Vec<(usize, usize)>,
    pub pairs: Vec<Pair>,
    conjugates: Vec<[Vec<usize>; 2]>,
}

impl Continuation {
    /// Of the modes `rows`, those that meet or come near to it in pairs; None if it is not safe.
    pub fn new(here: &Node, rows: &[usize], there: &Node) -> Option<Self> {
        let (mut rows, mut found) = (rows.to_vec(), Self::default());
        loop {
            let (next, correlations) = here.decided_modes(&rows, there);
            if let Some(k) = next.iter().position(Option::is_none) {
                found.take_together(here, &mut rows, k, there)?;
                continue;
            }
            let next: Vec<usize> = next.into_iter().flatten().collect();
            match here.drifting(&rows, there, &next, &correlations) {
                Some((k, l)) => {
                    found.take([here, there], &mut rows, [k, l], &[next[k], next[l]])?
                }
                None => {
                    found.singles = rows.into_iter().zip(next).collect();
                    let nodes = [here, there];
                    let keeps =
                        found.conjugates.iter().all(|modes| stays_off_the_axis(nodes, modes));
                    return (keeps && found.keeps_means(nodes, &correlations)).then_some(found);
                }
            }
        }
    }

    /// Takes two of the rows, or one with its conjugate, together, from the modes that continue them; None if one of two is real.
    fn take(
        &mut self,
        nodes: [&Node; 2],
        rows: &mut Vec<usize>,
        [k, l]: [usize; 2],
        next: &[usize; 2],
    ) -> Option<()> {
        let taken = [rows[k], rows[l]];
        let real = |side: usize, modes: &[usize; 2]| modes.map(|m| nodes[side].modes[m].is_real());
        match [real(0, &taken), real(1, next)] {
            _ if k == l => self.conjugates.push([vec![taken[0]], vec![next[0]]]),
            [[true, true], [true, true]] => self.conjugates.push([taken.to_vec(), next.to_vec()]),
            [[false, false], [false, false]] => self.pairs.push([taken, *next]),
            _ => return None,
        }
        rows.retain(|row| !taken.contains(row));
        Some(())
    }

    /// Takes a row that no mode continues by itself with its conjugate, or with another row.
    fn take_together(
        &mut self,
        here: &Node,
        rows: &mut Vec<usize>,
        k: usize,
        there: &Node,
    ) -> Option<()> {
        let parted = |node: &Node, mode: usize, other: &Node| {
            let (two, is_decisive) = node.continued_by_two(&[mode], other);
            let are_real = two.iter().all(|&mode| other.modes[mode].is_real());
            (is_decisive && are_real && !node.modes[mode].is_real()).then_some(two)
        };
        let row = rows[k];
        if here.modes[row].is_real() {
            let (next, _) = here.continued_by_two(&[row], there);
            let two = parted(there, next[0], here).filter(|two| two.contains(&row))?;
            rows.retain(|row| !two.contains(row));
            self.conjugates.push([two.to_vec(), vec![next[0]]]);
        } else if let Some(two) = parted(here, row, there) {
            rows.remove(k);
            self.conjugates.push([vec![row], two.to_vec()]);
        } else {
            let (l, next) = (0..rows.len()).filter(|&l| l != k).find_map(|l| {
                let (next, is_decisive) = here.continued_by_two(&[row, rows[l]], there);
                is_decisive.then_some((l, next))
            })?;
            self.take([here, there], rows, [k, l], &next)?;
        }
        Some(())
    }

    /// All modes of one node, 0 or 1, that are not continued one by one.
    pub fn taken_together(&self, side: usize) -> Vec<usize> {
        let pairs = self.pairs.iter().flat_map(|pair| pair[side]);
        pairs.chain(self.conjugates.iter().flat_map(|modes| modes[side].iter().copied())).collect()
    }

    /// Whether the mean of all that are taken together keeps its distances from its conjugate, from the coupled modes, whose
    /// `correlations` are given row by row, and from one another.
    fn keeps_means(&self, nodes: [&Node; 2], correlations: &[f64]) -> bool {
        let count = nodes[1].modes.len();
        let mean = |modes: [&[usize]; 2]| {
            [0, 1].map(|side| Together::new(nodes[side], modes[side]).mean[0])
        };
        let pairs = self.pairs.iter().map(|[here, there]| [&here[..], &there[..]]);
        let conjugates = self.conjugates.iter().map(|[here, there]| [&here[..], &there[..]]);
        let groups: Vec<[&[usize]; 2]> = pairs.chain(conjugates).collect();
        let means: Vec<[Complex64; 2]> = groups.iter().map(|&modes| mean(modes)).collect();
        let keeps = |a: [Complex64; 2], b: [Complex64; 2]| is_steady(a[0] - b[0], a[1] - b[1]);
        (0..groups.len()).all(|k| {
            let is_coupled = |row: usize| {
                groups[k][1].iter().any(|&s| correlations[row * count + s] >= UNCOUPLED)
            };
            (k >= self.pairs.len() || keeps(means[k], means[k].map(|mean| mean.conj())))
                && self.singles.iter().enumerate().all(|(row, &(r, s))| {
                    let single = [nodes[0].modes[r].eigenvalue, nodes[1].modes[s].eigenvalue];
                    !is_coupled(row) || keeps(means[k], single)
                })
                && means[..k].iter().all(|&other| keeps(means[k], other))
        })
    }
}
