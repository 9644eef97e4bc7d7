//! Critical points against planted ones: problems whose eigenvalues are known functions of the parameter.

use std::f64::consts::PI;
use std::sync::atomic::AtomicUsize;

use nalgebra::DMatrix;
use num_complex::Complex64;

use crate::locus::branches::Mesh;
use crate::locus::critical::hopf::{first_hopf_point, hopf_points};
use crate::locus::critical::point::{CriticalKind, CriticalPoint};
use crate::locus::critical::roots::axis_crossings;
use crate::locus::critical::search::{critical_points, stability_limits};
use crate::locus::parameter_path::{Path, PathDamping, Piece};
use crate::locus::series::{ChebyshevSeries, StaticSeries};
use crate::locus::sweep::Sweep;
use crate::locus::watched_path::WatchedPath;
use crate::scene::status::Combination;

/// Chebyshev nodes of an entry: exact for polynomials below this degree.
const DEGREES: usize = 8;

/// The series over p in [0, 1] of a matrix that is a polynomial of p.
fn series(matrix: impl Fn(f64) -> DMatrix<f64>) -> ChebyshevSeries {
    let angle = |j: usize| PI * (j as f64 + 0.5) / DEGREES as f64;
    let values: Vec<_> = (0..DEGREES).map(|j| matrix(0.5 + 0.5 * angle(j).cos())).collect();
    let coefficient = |k: usize| {
        let share = if k == 0 { 1.0 } else { 2.0 } / DEGREES as f64;
        let terms = values.iter().enumerate().map(|(j, value)| value * (k as f64 * angle(j)).cos());
        terms.sum::<DMatrix<f64>>() * share
    };
    ChebyshevSeries((0..DEGREES).map(coefficient).collect())
}

/// A path over p in [0, 1] with unit mass and no contacts.
fn path(size: usize, stiffness: ChebyshevSeries, damping: PathDamping) -> Path {
    let zeros = |rows: usize, columns: usize| ChebyshevSeries(vec![DMatrix::zeros(rows, columns)]);
    let piece = Piece {
        lower: 0.0,
        upper: 1.0,
        centre: 0.5,
        half_width: 0.5,
        mass: ChebyshevSeries(vec![DMatrix::identity(size, size)]),
        stiffness,
        damping,
        statics: StaticSeries {
            load: zeros(size, 1),
            rows: zeros(0, size),
            offsets: zeros(0, 1),
            speeds: zeros(0, 1),
        },
    };
    Path::new(Combination::new(Vec::new()), size, vec![piece]).unwrap()
}

/// The path whose eigenvalues are `growth_i(p) +- i frequency_i`, in coordinates that couple all modes.
fn planted(growths: &[&dyn Fn(f64) -> f64], frequencies: &[f64]) -> Path {
    let size = growths.len();
    let rotation =
        DMatrix::from_fn(size, size, |i, j| (1.0 + (3 * i + 5 * j) as f64).sin()).qr().q();
    let rotated = |entry: &dyn Fn(usize) -> f64| {
        let diagonal = DMatrix::from_fn(size, size, |i, j| if i == j { entry(i) } else { 0.0 });
        &rotation * diagonal * rotation.transpose()
    };
    let damping = series(|p| rotated(&|i| -2.0 * growths[i](p)));
    let stiffness = series(|p| rotated(&|i| growths[i](p).powi(2) + frequencies[i].powi(2)));
    path(size, stiffness, PathDamping::General(damping))
}

/// A path that is searched, with its counter.
fn search<T>(path: &Path, found: impl FnOnce(WatchedPath<'_>) -> T) -> T {
    let eigenproblems = AtomicUsize::new(0);
    found(WatchedPath { path, cancel: None, eigenproblems: &eigenproblems })
}

fn all_points(path: &Path) -> Vec<CriticalPoint> {
    search(path, |path| critical_points(path, 0.0)).unwrap().points
}

fn of_kind(points: &[CriticalPoint], kind: CriticalKind) -> Vec<f64> {
    points.iter().filter(|point| point.kind == kind).map(|point| point.value).collect()
}

/// Values of the parameter, found and planted, agree: rounding of eigenvalues of modulus 10 over slopes of at least 0.1.
fn agree(found: &[f64], planted: &[f64], context: &str) {
    let mut planted = planted.to_vec();
    planted.sort_by(f64::total_cmp);
    assert_eq!(found.len(), planted.len(), "{context}: {found:?}, planted {planted:?}");
    for (found, planted) in found.iter().zip(&planted) {
        assert!((found - planted).abs() <= 1e-11, "{context}: {found}, planted {planted}");
    }
}

/// All searches for Hopf points find the planted ones, and the first one among them.
fn check_hopf(path: &Path, planted: &[f64], context: &str) {
    agree(&of_kind(&all_points(path), CriticalKind::Hopf), planted, context);
    let alone = search(path, hopf_points).unwrap().points;
    agree(&of_kind(&alone, CriticalKind::Hopf), planted, context);
    let first = search(path, |path| first_hopf_point(path, |_| true)).unwrap();
    let least = planted.iter().copied().min_by(f64::total_cmp);
    assert_eq!(first.is_some(), least.is_some(), "{context}");
    if let (Some(first), Some(least)) = (first, least) {
        assert!((first.value - least).abs() <= 1e-11, "{context}: {}", first.value);
    }
}

proptest::proptest! {
    #![proptest_config(proptest::prelude::ProptestConfig::with_cases(24))]

    /// Each mode crosses the axis once, at a random place, upwards or downwards.
    #[test]
    fn planted_hopf_points_are_found(
        places in proptest::collection::vec(0.02f64..0.98, 3),
        rises in proptest::collection::vec(0.1f64..3.0, 3),
        downwards in proptest::collection::vec(proptest::prelude::any::<bool>(), 3),
    ) {
        let growth = |i: usize| {
            let rise = if downwards[i] { -rises[i] } else { rises[i] };
            let place = places[i];
            move |p: f64| rise * (p - place)
        };
        let (a, b, c) = (growth(0), growth(1), growth(2));
        let path = planted(&[&a, &b, &c], &[2.0, 5.0, 10.0]);
        check_hopf(&path, &places, "random places");
        for point in search(&path, hopf_points).unwrap().points {
            let mode = (0..3).find(|&i| (places[i] - point.value).abs() <= 1e-11).unwrap();
            proptest::prop_assert_eq!(point.slope < 0.0, downwards[mode]);
        }
    }
}

proptest::proptest! {
    #![proptest_config(proptest::prelude::ProptestConfig::with_cases(24))]

    /// A sweep follows planted branches, with their slopes and signs; of some modes, those of the largest real parts.
    #[test]
    fn sweeps_follow_planted_branches(
        places in proptest::collection::vec(0.0..1.0f64, 3),
        slopes in proptest::collection::vec(-1.0..1.0f64, 3),
    ) {
        let frequencies = [3.0, 5.5, 8.0];
        let growth = |i: usize, p: f64| slopes[i] * (p - places[i]);
        let [a, b, c] = [0, 1, 2].map(|i| move |p: f64| growth(i, p));
        let path = planted(&[&a, &b, &c], &frequencies);
        let values: Vec<f64> = (0..=12).map(|k| f64::from(k) / 12.0).collect();
        let largest = |i: usize| f64::max(growth(i, 0.0), growth(i, 1.0));
        let mut order = [0, 1, 2];
        order.sort_by(|&i, &j| largest(j).total_cmp(&largest(i)));
        for modes in [None, Some(1), Some(2)] {
            let mut followed = order[..modes.unwrap_or(3)].to_vec();
            followed.sort_unstable();
            let sweep = search(&path, |path| Sweep::new(path, &values, false, modes)).unwrap();
            assert_eq!(sweep.branches, 2 * followed.len());
            for (k, &p) in values.iter().enumerate() {
                for (branch, &i) in followed.iter().flat_map(|i| [i, i]).enumerate() {
                    let sign = if branch % 2 == 0 { 1.0 } else { -1.0 };
                    let planted = Complex64::new(growth(i, p), sign * frequencies[i]);
                    let place = k * sweep.branches + branch;
                    let context = format!("{modes:?}, {p}: mode {i}, {}", sweep.eigenvalues[place]);
                    assert!((sweep.eigenvalues[place] - planted).norm() <= 1e-11, "{context}");
                    assert!((sweep.slopes[place].re - slopes[i]).abs() <= 1e-9, "{context}");
                    let clear = growth(i, p).abs() > 1e-11;
                    assert!(!clear || sweep.unstable[place] == (growth(i, p) > 0.0), "{context}");
                }
                let grows = [0, 1, 2].map(|i| growth(i, p));
                let clear = grows.iter().all(|growth| growth.abs() > 1e-11);
                assert!(!clear || sweep.stable[k] == grows.iter().all(|&growth| growth < 0.0));
            }
        }
    }
}

/// One branch crosses upwards and back within one step of the first mesh, which has 64.
#[test]
fn near_hopf_points_of_one_branch_are_told_apart() {
    for distance in [1e-2, 1e-3, 1e-4] {
        let (low, high) = (0.4003 - 0.5 * distance, 0.4003 + 0.5 * distance);
        // The scale keeps the slope at both, and the rounding of the places, the same.
        let bump = |p: f64| -(p - low) * (p - high) / distance;
        let path = planted(&[&bump, &|_| -1.0], &[3.0, 7.0]);
        agree(&of_kind(&all_points(&path), CriticalKind::Hopf), &[low, high], "both");
        let alone = search(&path, hopf_points).unwrap().points;
        agree(&of_kind(&alone, CriticalKind::Hopf), &[low, high], "alone");
    }
}

/// At a node of the mesh the branch has no sign.
#[test]
fn hopf_points_at_nodes_are_found_once() {
    for place in [1.0 / 64.0, 0.25, 0.5, 63.0 / 64.0] {
        let path = planted(&[&|p| p - place, &|_| -2.0], &[3.0, 7.0]);
        check_hopf(&path, &[place], "at a node");
    }
}

/// Several nodes so near to a crossing that none of them has a sign are as one.
#[test]
fn a_crossing_within_rounding_of_several_nodes_is_found_once() {
    let place = 0.3;
    let path = planted(&[&|p| p - place, &|_| -2.0], &[30.0, 70.0]);
    let near = (-3..=3).map(|k| place + 1e-14 * f64::from(k));
    let values: Vec<f64> = std::iter::once(0.2).chain(near).chain([0.4]).collect();
    search(&path, |path| {
        let mesh = Mesh::new(path, &values, &|_, _, _| true).unwrap();
        let crossing = |node: usize| {
            let modes = &mesh.nodes[node].modes;
            (0..modes.len()).find(|&mode| modes[mode].eigenvalue.im < 50.0).unwrap()
        };
        let without: usize = (0..mesh.nodes.len())
            .filter(|&node| mesh.nodes[node].growth_sign(crossing(node)) == 0.0)
            .count();
        assert!(without >= 3, "{without}");
        let points = axis_crossings(path, &mesh, 0..mesh.links.len()).unwrap();
        assert_eq!(points.len(), 1);
        assert!((points[0].value - place).abs() <= 1e-11);
    });
}

/// A branch that lies on the axis over a stretch, and one that touches it, do not cross it.
#[test]
fn branches_that_stay_on_the_axis_do_not_cross_it() {
    let path = planted(&[&|_| 0.0, &|p| -1.0 - p], &[3.0, 7.0]);
    check_hopf(&path, &[], "neutral");
    let path = planted(&[&|p| -(p - 0.37).powi(2), &|p| -1.0 - p], &[3.0, 7.0]);
    check_hopf(&path, &[], "touching");
}

/// Three branches lead one after the other within one step of the mesh; two of them do so where the third is lower.
#[test]
fn leaders_within_one_step_are_found_in_turn() {
    let (place, distance) = (0.4003, 1e-3);
    let falling = |p: f64| -1.0 - (p - place);
    let rising = |p: f64| -1.0 + (p - place);
    let high = |_: f64| -1.0 + distance;
    let low = |_: f64| -1.0 - distance;
    let path = planted(&[&falling, &high, &rising], &[2.0, 5.0, 10.0]);
    let found = of_kind(&all_points(&path), CriticalKind::Crossing);
    agree(&found, &[place - distance, place + distance], "three leaders");
    let path = planted(&[&falling, &low, &rising], &[2.0, 5.0, 10.0]);
    agree(&of_kind(&all_points(&path), CriticalKind::Crossing), &[place], "two leaders");
}

/// Two modes tied by a circulatory stiffness `e`, which coalesce where `e` is half of the difference of their stiffnesses,
/// with damping `alpha M`, and where one of them begins to grow: on the axis lambda^2 is minus the mean stiffness, and
/// e^2 - half^2 is alpha^2 times it.
fn locking_in(place: f64, alpha: f64) -> (Path, f64) {
    let (lower, upper) = (100.0, 104.0);
    let half = 0.5 * (upper - lower);
    let stiffness = series(|p| {
        let circulatory = half * p / place;
        DMatrix::from_row_slice(2, 2, &[lower, circulatory, -circulatory, upper])
    });
    let damping = PathDamping::Proportional {
        alpha: ChebyshevSeries::scalar(alpha),
        beta: ChebyshevSeries::scalar(0.0),
    };
    let hopf = place * (1.0 + alpha * alpha * 102.0 / (half * half)).sqrt();
    (path(2, stiffness, damping), hopf)
}

#[test]
fn a_planted_lock_in_is_found() {
    for place in [0.21, 0.5, 0.77] {
        let (path, hopf) = locking_in(place, 0.2);
        let points = all_points(&path);
        agree(&of_kind(&points, CriticalKind::LockIn), &[place], "lock-in");
        let point = points.iter().find(|point| point.kind == CriticalKind::LockIn).unwrap();
        // lambda^2 + alpha lambda + (lower + upper) / 2 = 0.
        let frequency = (102.0_f64 - 0.01).sqrt();
        assert!((point.eigenvalue.re + 0.1).abs() <= 1e-9);
        assert!((point.eigenvalue.im - frequency).abs() <= 1e-9 * frequency);
        let planted: Vec<f64> = Some(hopf).filter(|&p| p < 1.0).into_iter().collect();
        agree(&of_kind(&points, CriticalKind::Hopf), &planted, "flutter");
    }
}

/// However little damping there is, and however near to the lock-in flutter begins, the mesh stays as it is.
#[test]
fn flutter_behind_a_lock_in_takes_few_eigenproblems() {
    for (place, alpha) in (1..8).map(|k| (0.2345 + 0.0811 * f64::from(k), 0.1f64.powi(k))) {
        let (path, hopf) = locking_in(place, alpha);
        let search = search(&path, hopf_points).unwrap();
        agree(&of_kind(&search.points, CriticalKind::Hopf), &[hopf], "behind a lock-in");
        assert!(search.points[0].slope > 0.0);
        // Those that the search starts from, and halvings of the interval with the lock-in.
        assert!(search.nodes <= 33 + 4, "{alpha}: {}", search.nodes);
    }
}

/// A stiffness that passes zero: a real eigenvalue does.
#[test]
fn a_planted_divergence_is_found() {
    let stiffness = series(|p| DMatrix::from_row_slice(2, 2, &[0.63 - p, 0.0, 0.0, 50.0]));
    let damping = PathDamping::Proportional {
        alpha: ChebyshevSeries::scalar(0.5),
        beta: ChebyshevSeries::scalar(0.0),
    };
    let path = path(2, stiffness, damping);
    let limits = search(&path, stability_limits).unwrap();
    for points in [all_points(&path), limits] {
        agree(&of_kind(&points, CriticalKind::Divergence), &[0.63], "divergence");
        assert!(points.iter().all(|point| point.kind != CriticalKind::Hopf));
    }
    // A mode that meets its conjugate before does not reach the axis.
    assert!(search(&path, hopf_points).unwrap().nodes <= 33 + 4);
}
