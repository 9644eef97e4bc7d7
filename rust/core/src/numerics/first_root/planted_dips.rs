//! The first root of polynomials whose roots and dips are known.

use crate::numerics::first_root::polynomial::{COEFFICIENTS, ROW};
use crate::numerics::first_root::search::{FirstRoot, RESOLUTION, Verdict};
use crate::numerics::simd::VectorUnit;

const ERROR: f64 = 4e-11;

fn first(polynomial: &[f64], end: f64) -> Verdict {
    let mut row = [0.0; ROW];
    row[..polynomial.len()].copy_from_slice(polynomial);
    VectorUnit::default().run(FirstRoot { polynomial: &row, error: ERROR, end })
}

fn product(p: &[f64], q: &[f64]) -> Vec<f64> {
    let mut product = vec![0.0; p.len() + q.len() - 1];
    for (i, a) in p.iter().enumerate() {
        q.iter().enumerate().for_each(|(j, b)| product[i + j] += a * b);
    }
    product
}

fn value(p: &[f64], s: f64) -> f64 {
    p.iter().rev().fold(0.0, |value, c| value * s + c)
}

/// The lowest value on [0, end]: on a mesh, and between the neighbours of its lowest point by trisection.
fn lowest(p: &[f64], end: f64) -> f64 {
    let at = |k: usize| end * k as f64 / 4000.0;
    let lowest = (0..=4000).min_by(|&i, &j| value(p, at(i)).total_cmp(&value(p, at(j))));
    let lowest = lowest.unwrap_or_default();
    let (mut low, mut high) = (at(lowest.saturating_sub(1)), at((lowest + 1).min(4000)));
    for _ in 0..60 {
        let third = (high - low) / 3.0;
        if value(p, low + third) < value(p, high - third) {
            high -= third;
        } else {
            low += third;
        }
    }
    value(p, low).min(value(p, end))
}

/// `height prod (s - place)^order - depth ERROR`: a dip at every place, all of them equally deep.
fn dips(places: &[f64], order: usize, height: f64, depth: f64) -> Vec<f64> {
    let factors = places.iter().flat_map(|&place| std::iter::repeat_n(place, order));
    let mut p = factors.fold(vec![height], |p, place| product(&p, &[-place, 1.0]));
    p[0] -= depth * ERROR;
    p
}

/// A line: the simplest function there is, with its root in the first part of the interval.
#[test]
fn a_line_crosses_once() {
    let p = [10.0, -3750.0];
    for end in [0.05, 1.0] {
        let Verdict::Crossing { root, touch: None } = first(&p, end) else {
            panic!("no crossing up to {end}");
        };
        assert!((root - 10.0 / 3750.0).abs() < 1e-17);
    }
    assert!(matches!(first(&p, 0.002), Verdict::Clear { touch: None, in_band: None }));
}

/// The time of a touch is that of the minimum, not of the place within the band at which the march stepped.
#[test]
fn a_touch_is_told_at_its_lowest_point() {
    for k in 1..100 {
        let place = 0.01 * f64::from(k);
        for depth in [-0.9, -0.3, 0.0, 0.5, 0.9] {
            let p = dips(&[place], 2, 0.3, depth);
            let Verdict::Clear { touch: Some(touch), in_band: None } = first(&p, 1.0) else {
                panic!("no touch at {place}");
            };
            assert!((touch.at - place).abs() < 1e-14, "{} of {place}", touch.at);
            assert!((touch.value + depth * ERROR).abs() < 1e-15);
        }
    }
}

/// The promise: a dip deeper than the error is a crossing, one that is shallower is told as a touch.
#[test]
fn planted_dips_are_crossings_exactly_where_they_are_deeper_than_the_error() {
    // The coefficients, a few of order one, are rounded to some 1e-15, a part of 1e-4 of the error.
    let depths = [0.0, 0.5, 0.9, 0.99, 0.999, 1.001, 1.01, 1.03, 1.06, 1.1, 1.125, 1.2, 1.5, 2.0];
    let near = [1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 0.01];
    let places = near.into_iter().chain((1..40).map(|k| 0.0251 * f64::from(k)));
    let places: Vec<f64> = places.chain(near.map(|distance| 1.0 - distance)).collect();
    for (&place, order, height, second) in places
        .iter()
        .flat_map(|place| [2, 4].map(|order| (place, order)))
        .flat_map(|(place, order)| [1.0, 0.3, 0.01].map(|height| (place, order, height)))
        .flat_map(|(place, order, height)| {
            [None, Some(0.2), Some(0.61)].map(|second| (place, order, height, second))
        })
    {
        // Nearer to each other than that, p does not leave the band between two dips of order four.
        let second = second.filter(|second| (place - second).abs() > 0.1 * f64::from(order as u32));
        let mut both: Vec<f64> = std::iter::once(place).chain(second).collect();
        both.sort_by(f64::total_cmp);
        for depth in depths {
            let p = dips(&both, order, height, depth);
            let verdict = first(&p, 1.0);
            let told =
                format!("depth {depth} at {both:?}, order {order}, height {height}: {verdict:?}");
            match verdict {
                Verdict::Crossing { root, .. } => {
                    assert!(depth > 1.0, "{told}");
                    // Within the band, and no later than the first dip.
                    assert!(root <= both[0] && value(&p, root) <= ERROR, "{told}");
                }
                Verdict::Clear { touch, in_band } => {
                    assert!(depth < 1.0, "{told}");
                    let lowest = touch.or(in_band).expect(&told);
                    assert!(lowest.value.abs() <= ERROR * (1.0 + RESOLUTION), "{told}");
                }
            }
        }
    }
}

proptest::proptest! {
    #![proptest_config(proptest::prelude::ProptestConfig::with_cases(2000))]

    /// Any polynomial, shifted so that its lowest value on a fine mesh lies in or about the band.
    #[test]
    fn whatever_falls_through_the_band_is_a_crossing(
        coefficients in proptest::collection::vec(-1.0..1.0, 2..COEFFICIENTS),
        decay in 0.3..1.0,
        height in -8.0..0.0,
        depth in -1.5..3.0,
        end in 0.3..1.0,
    ) {
        let scales = (0..).map(|k| 10f64.powf(height) * f64::powi(decay, k));
        let mut p: Vec<f64> = coefficients.iter().zip(scales).map(|(c, scale)| c * scale).collect();
        let mesh: Vec<f64> = (0..=4000).map(|k| end * f64::from(k) / 4000.0).collect();
        let lowest = lowest(&p, end);
        p[0] -= lowest + depth * ERROR;
        let below = mesh.iter().copied().find(|&s| value(&p, s) < -1.001 * ERROR);
        match first(&p, end) {
            Verdict::Crossing { root, .. } => {
                // Not deeper than the error only where it falls through the band beyond `end`.
                proptest::prop_assert!(depth > -0.001, "nothing crosses");
                proptest::prop_assert!(value(&p, root) <= ERROR);
                proptest::prop_assert!(below.is_none_or(|below| root <= below));
            }
            Verdict::Clear { touch, in_band } => {
                proptest::prop_assert!(below.is_none());
                let in_band_on_mesh = mesh.iter().any(|&s| value(&p, s) < 0.999 * ERROR);
                let told = touch.or(in_band).is_some();
                // What still falls at the end is told by the next panel.
                proptest::prop_assert!(told || !in_band_on_mesh || value(&p, end) <= ERROR);
            }
        }
    }

    /// Real roots at least 0.02 apart, complex ones at least 0.1 from the axis: between two of them p goes
    /// farther than the error.
    #[test]
    fn the_first_of_planted_roots_is_found(
        gaps in proptest::collection::vec(0.02..0.6, 1..6),
        pairs in proptest::collection::vec((0.0..1.0, 0.1..1.0), 0..4),
        end in 0.1..1.0,
    ) {
        let mut p = vec![1.0];
        let mut root = 0.0;
        for gap in &gaps {
            root += gap;
            p = product(&p, &[1.0, -1.0 / root]);
        }
        for (re, im) in pairs {
            let square: f64 = re * re + im * im;
            p = product(&p, &[1.0, -2.0 * re / square, 1.0 / square]);
        }
        let size: f64 = p.iter().map(|c| c.abs()).sum();
        let slope: f64 = p.iter().zip(0..).skip(1).map(|(c, k)| c * f64::from(k) * f64::powi(gaps[0], k - 1)).sum();
        let verdict = first(&p, end);
        match verdict {
            Verdict::Crossing { root, touch } => {
                // Some rounding of p, over its slope.
                let rounding = 64.0 * f64::EPSILON * size / slope.abs();
                proptest::prop_assert!((root - gaps[0]).abs() <= rounding, "off by {} of {rounding}", root - gaps[0]);
                proptest::prop_assert!(root <= end && touch.is_none());
            }
            Verdict::Clear { .. } => proptest::prop_assert!(end <= gaps[0] + 1.1 * ERROR / slope.abs(), "{verdict:?}"),
        }
    }
}
