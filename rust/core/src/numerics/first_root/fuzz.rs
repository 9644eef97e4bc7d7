//! Random problems of the certified root search against another way to the same answer: subdivision in Bernstein form.
//!
//! On an interval a polynomial lies within its Bernstein coefficients, and the first and last are its values at the
//! ends. Halving the interval (de Casteljau) tells to rounding where a polynomial first falls below a level, by another
//! basis and without a derivative.
//!
//! `make fuzz-roots N=1000000` draws more of them.

use proptest::prelude::*;

use crate::numerics::first_root::polynomial::{COEFFICIENTS, ROW};
use crate::numerics::first_root::search::{FirstRoot, Touch, Verdict};
use crate::numerics::simd::VectorUnit;

/// The bound of the polynomials' errors, of polynomials of order one.
const ERROR: f64 = 4e-11;
/// Part of the error by which levels are moved to what is certain, beside the rounding of this search.
const MARGIN: f64 = 1e-3;

/// The first place in [0, end] where a polynomial is below a level.
fn first_below(p: &[f64], level: f64, end: f64) -> Option<f64> {
    below_from(0.0, p, level, end)
}

/// The first place in [from, end] where a polynomial is below a level, up to the width of 1e-13 in which `from` lies.
fn below_from(from: f64, p: &[f64], level: f64, end: f64) -> Option<f64> {
    let n = p.len() - 1;
    let mut bernstein = vec![0.0; n + 1];
    for (j, b) in bernstein.iter_mut().enumerate() {
        // binomial(j, k) / binomial(n, k)
        let mut weight = 1.0;
        for (k, c) in p.iter().enumerate().take(j + 1) {
            *b += weight * c * end.powi(k as i32);
            weight *= (j - k) as f64 / (n - k).max(1) as f64;
        }
        *b -= level;
    }
    subdivided(&bernstein, from, 0.0, end)
}

fn subdivided(bernstein: &[f64], from: f64, start: f64, width: f64) -> Option<f64> {
    if start + width < from || bernstein.iter().all(|&b| b >= 0.0) {
        return None;
    }
    if bernstein[0] < 0.0 && start >= from {
        return Some(start);
    }
    let last = bernstein[bernstein.len() - 1];
    if width < 1e-13 {
        return (last < 0.0).then_some(start + width);
    }
    let (mut left, mut right) = (Vec::with_capacity(bernstein.len()), bernstein.to_vec());
    for k in (1..=bernstein.len()).rev() {
        left.push(right[0]);
        for i in 0..k - 1 {
            right[i] = 0.5 * (right[i] + right[i + 1]);
        }
    }
    let half = 0.5 * width;
    subdivided(&left, from, start, half).or_else(|| subdivided(&right, from, start + half, half))
}

fn value(p: &[f64], s: f64) -> f64 {
    p.iter().rev().fold(0.0, |value, c| value.mul_add(s, *c))
}

fn multiplied(p: &[f64], q: &[f64]) -> Vec<f64> {
    let mut product = vec![0.0; p.len() + q.len() - 1];
    for (i, a) in p.iter().enumerate() {
        q.iter().enumerate().for_each(|(j, b)| product[i + j] += a * b);
    }
    product
}

/// Scaled to coefficients of order one that start positive.
fn scaled(mut p: Vec<f64>, height: f64) -> Vec<f64> {
    p.truncate(COEFFICIENTS);
    let size: f64 = p.iter().map(|c| c.abs()).sum();
    let sign = if p[0] < 0.0 { -1.0 } else { 1.0 };
    p.iter_mut().for_each(|c| *c *= sign * 10f64.powf(height) / size);
    p
}

/// Any coefficients.
fn dense() -> impl Strategy<Value = Vec<f64>> {
    (prop::collection::vec(-1.0..1.0, 2..=COEFFICIENTS), 0.2..1.0, -9.0..0.0).prop_map(
        |(coefficients, decay, height): (Vec<f64>, f64, f64)| {
            let powers = coefficients.iter().zip(0..);
            scaled(powers.map(|(c, k)| c * decay.powi(k)).collect(), height)
        },
    )
}

/// Real roots of several orders inside, at and beyond the borders, and complex pairs as near to the axis as they come.
fn by_roots() -> impl Strategy<Value = Vec<f64>> {
    let place = prop_oneof![
        4 => -0.2..1.2f64,
        1 => Just(1.0),
        1 => (-9.0..-1.0f64).prop_map(|small| 10f64.powf(small)),
        1 => (-9.0..-1.0f64).prop_map(|small| 1.0 - 10f64.powf(small)),
    ];
    let real = prop::collection::vec((place, 1usize..5), 0..4);
    let pairs = prop::collection::vec((-0.1..1.1f64, -7.0..0.0f64), 0..4);
    (real, pairs, -9.0..0.0).prop_map(|(real, pairs, height)| {
        let mut p = vec![1.0];
        for (place, order) in real {
            for _ in 0..order {
                p = multiplied(&p, &[place, -1.0]);
            }
        }
        for (re, im) in pairs {
            let square = re * re + 10f64.powf(2.0 * im);
            p = multiplied(&p, &[square, -2.0 * re, 1.0]);
        }
        scaled(p, height)
    })
}

/// `a + b s + e^{-d s} cos(w s + f)` with |w| and d up to the reach of a panel: what event functions are.
fn by_modes() -> impl Strategy<Value = Vec<f64>> {
    (-2.0..2.0f64, -2.0..2.0f64, 0.0..2.0f64, 0.0..3.0f64, -3.2..3.2f64, -9.0..0.0f64).prop_map(
        |(a, b, decay, turn, phase, height)| {
            // Re e^{if} (i w - d)^k / k!
            let (mut re, mut im) = (phase.cos(), phase.sin());
            let mut p = vec![0.0; COEFFICIENTS];
            for (k, c) in p.iter_mut().enumerate() {
                *c = re;
                let next = (-decay * re - turn * im, turn * re - decay * im);
                (re, im) = (next.0 / (k + 1) as f64, next.1 / (k + 1) as f64);
            }
            p[0] += a;
            p[1] += b;
            scaled(p, height)
        },
    )
}

/// Lowered so that its lowest value on [0, end] lies that many errors below zero, unless it would start negative there:
/// the search is asked about functions that start positive.
fn at_depth(mut p: Vec<f64>, depth: f64, end: f64) -> Vec<f64> {
    let size: f64 = p.iter().map(|c| c.abs()).sum();
    let (mut low, mut high) = (-size, size);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        match first_below(&p, middle, end) {
            Some(_) => high = middle,
            None => low = middle,
        }
    }
    let lowered = p[0] - (high + depth * ERROR);
    if lowered >= 0.0 {
        p[0] = lowered;
    }
    p
}

fn check(p: &[f64], end: f64) -> Result<(), TestCaseError> {
    let mut row = [0.0; ROW];
    row[..p.len()].copy_from_slice(p);
    let problem = || FirstRoot { polynomial: &row, error: ERROR, end };
    let verdict = VectorUnit::default().run(problem());
    prop_assert_eq!(verdict, VectorUnit::Portable.run(problem()), "vector units disagree");
    // Of this search and of the other one.
    let size: f64 = p.iter().map(|c| c.abs()).sum();
    let rounding = MARGIN * ERROR + 128.0 * f64::EPSILON * size;
    let surely_below = first_below(p, -ERROR - rounding, end);
    let in_band = |touch: Touch| {
        (touch.value - value(p, touch.at)).abs() <= rounding
            && touch.value.abs() <= ERROR + rounding
            && (0.0..=end).contains(&touch.at)
    };
    match verdict {
        Verdict::Crossing { root, touch } => {
            prop_assert!(root >= 0.0 && root <= end, "beyond the end");
            prop_assert!(value(p, root).abs() <= ERROR + rounding, "no root: {}", value(p, root));
            prop_assert!(surely_below.is_none_or(|below| root <= below), "not the first: {root}");
            // An earlier dip as deep, to rounding, may count as a touch.
            let falls = below_from(root - 1e-12, p, -ERROR + rounding, 1.0);
            prop_assert!(falls.is_some(), "does not fall through");
            prop_assert!(touch.is_none_or(|touch| in_band(touch) && touch.at <= root));
        }
        Verdict::Clear { touch, in_band: at_end } => {
            prop_assert!(surely_below.is_none(), "missed {surely_below:?}");
            prop_assert!(touch.is_none_or(in_band), "a touch beyond the band");
            prop_assert!(at_end.is_none_or(in_band), "undecided beyond the band");
            let told = touch.is_some() || at_end.is_some();
            let surely_in_band = first_below(p, ERROR - rounding, end).is_some();
            // What still falls at the end is told by the next panel.
            let falling = value(p, end) <= ERROR + rounding;
            prop_assert!(told || !surely_in_band || falling, "a touch that is not told");
            let surely_above = first_below(p, ERROR + rounding, end).is_none();
            prop_assert!(!told || !surely_above, "a touch where there is none");
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::default())]

    #[test]
    fn random_problems(
        p in prop_oneof![dense(), by_roots(), by_modes()],
        end in prop_oneof![Just(1.0), 0.01..1.0],
        depth in prop_oneof![
            1 => Just(None),
            2 => (-2.5..2.5f64).prop_map(Some),
            1 => (0.9..1.1f64).prop_map(Some),
            1 => (-1.1..-0.9f64).prop_map(Some),
        ],
    ) {
        let lowered = depth.map_or_else(|| p.clone(), |depth| at_depth(p.clone(), depth, end));
        check(&lowered, end)?;
    }
}

/// The subdivision itself, on roots that are known.
#[test]
fn subdivision_finds_planted_roots() {
    let cubed = multiplied(&multiplied(&[0.3, -1.0], &[0.3, -1.0]), &[0.3, -1.0]);
    assert!((first_below(&cubed, 0.0, 1.0).expect("a root") - 0.3).abs() < 1e-4);
    assert!((first_below(&[0.3, -1.0], 0.0, 1.0).expect("a root") - 0.3).abs() < 1e-12);
    assert_eq!(first_below(&[0.3, -1.0], 0.0, 0.29), None);
    // (s - 0.5)^2 - 1e-10 falls below zero 1e-5 before its lowest place.
    let dip = [0.25 - 1e-10, -1.0, 1.0];
    assert!((first_below(&dip, 0.0, 1.0).expect("a dip") - (0.5 - 1e-5)).abs() < 1e-9);
    assert_eq!(first_below(&dip, -1.001e-10, 1.0), None);
    // Of two dips the later one, which is no less deep.
    let two = multiplied(&[0.09, -0.6, 1.0], &[0.49, -1.4, 1.0]);
    assert!((below_from(0.4, &two, 1e-8, 1.0).expect("a dip") - 0.69975).abs() < 1e-4);
    assert_eq!(below_from(0.8, &two, 1e-8, 1.0), None);
}
