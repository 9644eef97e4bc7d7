from itertools import permutations

import numpy as np
import pytest
import scipy.linalg
import scipy.optimize
from hypothesis import given
from hypothesis import strategies as st

import stickslip as ss
from curve_checks import random_plane
from quad_block import quad_block
from stickslip import types
from stickslip.locus.path import Sliding
from stickslip.scene.parameters.family import Family

EPS = np.finfo(float).eps


def kinds(points, kind):
    return [point for point in points if point.kind == kind]


def test_published_model_to_eleven_digits():
    points = ss.critical_points(ss.models.two_subsystems(), {"friction": (0.0, 3.0)})
    assert [point.kind for point in points] == ["lock_in", "hopf", "lock_in", "hopf", "crossing"]
    values = [point.value for point in points]
    # Reference values of 60-digit arithmetic, printed to 14 digits.
    expected = [0.612484152848669, 0.70156717308523, 1.989108991216879, 2.1002056016114, 2.39623672105574]
    assert values == pytest.approx(expected, abs=1e-13, rel=0.0)
    assert [point.direction for point in points] == [0, 1, 0, 1, 0]
    assert all(point.complex_value.imag == 0.0 for point in points)


def test_a_model_function_gives_the_same_points():
    exact = ss.critical_points(ss.models.two_subsystems(), {"friction": (0.0, 3.0)})
    sampled = ss.critical_points(ss.models.two_subsystems, {"friction": (0.0, 3.0)})
    assert [p.kind for p in sampled] == [p.kind for p in exact]
    assert [p.value for p in sampled] == pytest.approx([p.value for p in exact], rel=1e-12)


def test_hopf_points_are_zeros_of_the_real_part():
    scene = ss.models.two_subsystems()
    points = ss.critical_points(scene, {"friction": (0.0, 3.0)}, kinds=("hopf",))
    assert len(points) == 2
    for point in points:
        modes = ss.complex_modes(scene.replace(friction=point.value))
        growth = np.abs(modes.eigenvalues.real).min()
        # 1e-12 of the parameter, as growth rate.
        assert growth <= 1e-12 * point.value * abs(point.slope)
        before, after = (
            ss.complex_modes(scene.replace(friction=point.value + side)).unstable.sum()
            for side in (-1e-6, 1e-6)
        )
        assert after - before == point.direction


def two_modes(damping_difference):
    """Mode coupling of two dofs: K = [[2 + mu, mu - 0.3], [-0.3, 3]] 1e4 N/m, lock-in at mu = 0.5046."""

    def model(friction):
        stiffness = np.array([[2.0, -0.3, -1.0], [-0.3, 3.0, -1.0], [-1.0, -1.0, 10.0]]) * 1e4
        return ss.Scene(
            [1.0, 1.0, 1.0],
            stiffness,
            damping=np.diag([2.0, 2.0 + damping_difference, 0.0]),
            force=[0.0, 0.0, -1.0],
            contacts=[ss.Contact(tangential=0, normal=2, friction=friction, slider_speed=1.0)],
        )

    return model


def exact_pencil(scene):
    """(M, C, K0, K1) of ``K = K0 + mu K1`` for the model above."""
    stiffness, damping = scene.stiffness, scene.damping
    k0 = stiffness[:2, :2]
    k1 = np.array([-stiffness[2, :2], [0.0, 0.0]])
    return damping[:2, :2], k0, k1


@pytest.mark.parametrize("difference", [0.0, 1e-6, 1e-3, 0.1, 2.0])
def test_exceptional_points_of_unequal_damping_are_complex(difference):
    model = two_modes(difference)
    points = ss.critical_points(model, {"friction": (0.0, 1.5)}, proximity=0.5)
    (lock_in,) = kinds(points, "lock_in")
    damping, k0, k1 = exact_pencil(model(0.0))
    # A double root of det(lambda^2 + lambda C + K0 + mu K1), by polynomial algebra: discriminant in lambda.
    entries = [
        np.polynomial.Polynomial([k0[i, j] + lock_in.complex_value * k1[i, j], damping[i, j], float(i == j)])
        for i in range(2)
        for j in range(2)
    ]
    determinant = entries[0] * entries[3] - entries[1] * entries[2]
    scale = abs(lock_in.eigenvalue) ** 4
    assert abs(determinant(lock_in.eigenvalue)) <= 1e-13 * scale
    slope = abs(determinant.deriv()(lock_in.eigenvalue)) * abs(lock_in.eigenvalue)
    assert slope <= 1e-12 * scale
    assert (abs(lock_in.complex_value.imag) > 0.0) == (difference > 1e-9)


def test_without_damping_flutter_begins_at_the_lock_in():
    scene = ss.models.two_subsystems(damping=0.0)
    points = ss.critical_points(scene, {"friction": (0.0, 3.0)})
    assert kinds(points, "hopf") == []
    assert [point.value for point in kinds(points, "lock_in")] == pytest.approx(
        [0.612484152848669, 1.989108991216879], rel=1e-13
    )


def test_divergence_is_where_the_stiffness_is_singular():
    scene = ss.models.two_subsystems()
    (point,) = kinds(ss.critical_points(scene, {"friction": (0.0, 5.0)}, combination="--"), "divergence")
    stiffness = ss.equations_of(scene.replace(friction=point.value), "--").stiffness
    singular = np.linalg.svd(stiffness, compute_uv=False)
    assert singular[-1] <= 64 * EPS * singular[0]
    assert point.direction == 1
    assert point.frequency == 0.0
    modes = ss.complex_modes(scene.replace(friction=point.value + 1e-3), "--")
    assert (modes.eigenvalues.imag[modes.unstable] == 0.0).any()


def oscillators(growth):
    """Uncoupled oscillators whose growth rates are given functions of p."""

    def model(p):
        rates = np.array([rate(p) for rate in growth])
        stiffness = 1e4 * np.arange(1.0, rates.size + 1.0)
        return ss.Scene(np.ones(rates.size), np.diag(stiffness), damping=np.diag(-2.0 * rates))

    return model


@given(st.floats(-0.9, 0.9), st.floats(1e-4, 0.4))
def test_two_crossings_inside_one_interval_are_found(centre, half_distance):
    def rate(p):
        return (p - centre) ** 2 - half_distance**2

    points = kinds(ss.critical_points(oscillators([rate]), {"p": (-1.5, 1.5)}), "hopf")
    expected = [centre - half_distance, centre + half_distance]
    assert [point.value for point in points] == pytest.approx(expected, abs=1e-11)
    assert [point.direction for point in points] == [-1, 1]


@given(st.floats(-0.5, 0.5), st.floats(0.05, 0.5))
def test_the_lead_passes_where_growth_rates_are_equal(first, distance):
    growth = [lambda p: -1.0, lambda p: -1.0 + (p - first), lambda p: -1.0 + 3.0 * (p - first - distance)]
    points = kinds(ss.critical_points(oscillators(growth), {"p": (-1.0, 2.0)}), "crossing")
    expected = [first, first + 1.5 * distance]
    assert [point.value for point in points] == pytest.approx([p for p in expected if p < 2.0], abs=1e-12)


@given(st.lists(st.floats(1e-3, 0.4), min_size=2, max_size=6))
def test_every_leader_of_a_fan_of_tangents_is_found(distances):
    """Growth rates along tangents of p^2 lead one after another, also several within one step."""
    touched = np.concatenate([[0.0], np.cumsum(distances)]) - 0.5 * sum(distances)
    growth = [lambda p, t=t: 2.0 * t * p - t**2 - 3.0 for t in touched]
    points = kinds(ss.critical_points(oscillators(growth), {"p": (-1.5, 1.5)}), "crossing")
    expected = 0.5 * (touched[1:] + touched[:-1])
    assert [point.value for point in points] == pytest.approx(expected, abs=1e-10)


def test_parameters_beside_the_range_are_fixed():
    (point,) = ss.critical_points(
        ss.models.two_subsystems, {"friction": 1.5, "damping": (1e-5, 1e-3)}, kinds=("hopf",)
    )
    modes = ss.complex_modes(ss.models.two_subsystems(friction=1.5, damping=point.value))
    assert np.abs(modes.eigenvalues.real).min() <= 1e-12 * point.value * abs(point.slope)
    assert point.direction == -1


@pytest.mark.parametrize(
    ("arguments", "options", "message"),
    [
        ({"friction": (1.0, 0.0)}, {}, "friction: expected finite lower < upper"),
        ({"friction": (0.0, 1.0, 2.0)}, {}, "friction: expected a range"),
        ({"friction": 1.0}, {}, "expected one with a range"),
        ({"friction": (0.0, 1.0)}, {"proximity": -1.0}, "proximity: must be >= 0"),
        ({"friction": (-1.0, 1.0)}, {}, "friction: must be >= 0, got -1"),
        ({"friction": (0.0, 1.0)}, {"kinds": "hopf"}, "kinds: expected some of .*'hopf'.*, got 'hopf'"),
        ({"friction": (0.0, 1.0)}, {"kinds": ("hopf", "fold")}, "kinds: expected some of"),
        ({"friction": (0.0, 1.0)}, {"kinds": ()}, "kinds: expected some of"),
    ],
)
def test_hostile_ranges_are_refused(arguments, options, message):
    with pytest.raises(ss.InputError, match=message):
        ss.critical_points(ss.models.two_subsystems(), arguments, **options)


def test_points_are_a_sequence_and_a_table(tmp_path):
    scene = ss.models.two_subsystems()
    points = ss.critical_points(scene, {"friction": (0.0, 3.0)})
    assert [point.kind for point in points] == [points[k].kind for k in range(len(points))]
    assert isinstance(points[1:], types.CriticalPoints)
    assert list(points[1:]) == list(points)[1:]
    with pytest.raises(IndexError):
        points[len(points)]
    data = points.to_dataset()
    assert data.friction.values.tolist() == [point.value for point in points]
    assert data.friction.units == "1"
    assert data.eigenvalue.values[0] == points[0].eigenvalue
    assert points.to_dataframe().kind.tolist() == [point.kind for point in points]
    (table,) = points.summary().tables
    assert [row[0] for row in table.rows] == [point.kind.replace("_", "-") for point in points]
    assert repr(points).startswith(f"CriticalPoints({len(points)} over friction)\n  CriticalPoint(")
    ss.save(points, tmp_path / "points.nc")
    assert ss.load(tmp_path / "points.nc").to_dataset().identical(data)
    speeds = ss.critical_points(ss.models.two_subsystems, {"slider_speed": (0.01, 0.02)}).to_dataset()
    assert speeds.slider_speed.units == "m/s"
    assert speeds.sizes["point"] == 0


def test_kinds_are_those_among_all_points():
    scene = ss.models.two_subsystems()
    every = ss.critical_points(scene, {"friction": (0.0, 3.0)})
    for kind in ("hopf", "crossing", "lock_in"):
        found = ss.critical_points(scene, {"friction": (0.0, 3.0)}, kinds=(kind,))
        assert {point.kind for point in found} <= {kind}
        assert [p.value for p in found] == pytest.approx(
            [p.value for p in every if p.kind == kind], rel=1e-12
        )
    both = ss.critical_points(scene, {"friction": (0.0, 3.0)}, kinds=["hopf", "crossing"])
    assert [p.kind for p in both] == [p.kind for p in every if p.kind in ("hopf", "crossing")]


def counted_hopf_points(model, **parameter):
    """Hopf points, eigenproblems of the mesh, and modes followed from one of its points to the next."""
    ((name, ends),) = parameter.items()
    path = Sliding(Family(model)).path(name, *ends, {})
    (_, _, places, *_), nodes, followed = path.hopf_points()
    return places.real, nodes, followed


def test_hopf_points_alone_are_those_among_all_critical_points():
    rng = np.random.default_rng(3)
    found = 0
    for _ in range(6):
        spread = {name: rng.uniform(0.7, 1.4, 2) for name in ("upper_mass", "contact_mass")}
        scene = ss.models.two_subsystems(damping=10.0 ** rng.uniform(-6.0, -4.0), **spread)
        every = kinds(ss.critical_points(scene, {"friction": (0.0, 3.0)}), "hopf")
        alone = ss.critical_points(scene, {"friction": (0.0, 3.0)}, kinds=("hopf",))
        assert [p.value for p in alone] == pytest.approx([p.value for p in every], rel=1e-12)
        assert [p.direction for p in alone] == [p.direction for p in every]
        found += len(every)
    assert found >= 6


def test_limits_of_stability_are_those_among_all_critical_points():
    """Of random scenes with lock-ins, modes that meet their conjugates, and general damping."""
    kept = ("hopf", "divergence", "separation")
    rng = np.random.default_rng(5)
    found = dict.fromkeys(kept, 0)
    for index in (18, 33, 36, 39, 78, 85, 87, 91):
        scene, ranges = random_plane(3, index)
        for name, other in permutations(ranges):
            path = Sliding(Family(scene)).path(name, *ranges[name], {other: rng.uniform(*ranges[other])})
            limits = [(kind, place.real) for kind, _, place, *_ in zip(*path.stability_limits(), strict=True)]
            points = zip(*path.critical_points(0.0)[0], strict=True)
            every = [(kind, place.real) for kind, _, place, *_ in points if kind in kept]
            assert [kind for kind, _ in limits] == [kind for kind, _ in every], index
            off = 1e-9 * np.ptp(ranges[name])
            assert [place for _, place in limits] == pytest.approx([place for _, place in every], abs=off)
            for kind, _ in limits:
                found[kind] += 1
    assert min(found.values()) >= 3, found


def test_only_modes_near_the_axis_are_followed():
    """Of the 104 modes of a mesh a few come near the axis; to join all takes thousands of eigenproblems."""
    scene = quad_block(10, 5, 2)
    values, nodes, followed = counted_hopf_points(scene, friction=(0.0, 0.3))
    assert len(values) == 3
    for value in values:
        before, after = (
            ss.complex_modes(scene.replace(friction=value + side)).unstable.sum() for side in (-1e-6, 1e-6)
        )
        assert after == before + 1
    # One eigenproblem for each interval and a few halvings; one mode in a hundred in each.
    assert nodes <= 100
    assert followed <= 2 * nodes


def largest_growths(scene):
    """Real parts of all eigenvalues by LAPACK, largest first; damping is proportional to stiffness."""
    reduced = ss.equations_of(scene, "+" * len(scene.contacts))
    squares = scipy.linalg.eigvals(reduced.stiffness, np.asarray(reduced.mass)).astype(complex)
    half = 0.5 * scene.damping.stiffness * squares
    root = np.sqrt(half**2 - squares)
    return np.sort(np.concatenate([-half + root, -half - root]).real)[::-1]


@pytest.mark.slow
def test_hopf_points_are_the_zeros_of_lapacks_real_parts():
    """On a grid the number of growing eigenvalues tells how many pairs cross in each of its intervals."""
    scene = quad_block(10, 5, 2)
    grid = np.linspace(0.0, 0.3, 31)
    growing = [int((largest_growths(scene.replace(friction=p)) > 0.0).sum()) for p in grid]
    expected = [
        scipy.optimize.brentq(lambda p, k=k: largest_growths(scene.replace(friction=p))[k], a, b, xtol=1e-13)
        for a, b, before, after in zip(grid, grid[1:], growing, growing[1:], strict=False)
        for k in range(min(before, after), max(before, after), 2)
    ]
    points = ss.critical_points(scene, {"friction": (0.0, 0.3)}, kinds=("hopf",))
    assert len(expected) == 3
    # LAPACK's eigenvalues err by some ulp of the largest one.
    largest = scipy.linalg.norm(np.diag(1.0 / scene.mass) @ scene.stiffness, 2) ** 0.5
    for value, point in zip(sorted(expected), points, strict=True):
        assert abs(value - point.value) <= 100.0 * EPS * largest / abs(point.slope)


def test_newtons_method_starts_where_no_point_found_explains_the_prediction():
    """Every node near a lock-in predicts it: hundreds of predictions, two points."""
    path = Sliding(Family(ss.models.two_subsystems())).path("friction", 0.0, 3.0, {})
    (found, *_), nodes, starts = path.critical_points(0.3)
    assert found.count("lock_in") == 2
    assert nodes <= 300
    assert starts <= 10
    # Of the mesh, and of the other critical points.
    assert nodes < path.eigenproblems <= nodes + 40


@pytest.mark.parametrize("damping", [0.0, 1e-3])
def test_hopf_points_tell_of_a_lock_in_without_one(damping):
    """K = [[2, mu - 1/2], [-1/2, 2]]: the modes lock in at mu = 1/2; with damping a Hopf point follows."""
    contact = ss.Contact(tangential=0, normal=1, friction=0.2, slider_speed=1.0, normal_stiffness=1.0)
    scene = ss.Scene(
        [1.0, 1.0],
        [[2.0, -0.5], [-0.5, 1.0]],
        damping=ss.Rayleigh(mass=damping),
        force=[0.0, -10.0],
        contacts=[contact],
    )
    (lock_in,) = [
        point for point in ss.critical_points(scene, {"friction": (0.0, 1.0)}) if point.kind == "lock_in"
    ]
    assert lock_in.value == pytest.approx(0.5, rel=1e-12)
    if damping:
        assert len(ss.critical_points(scene, {"friction": (0.0, 1.0)}, kinds=("hopf",))) == 1
        return
    with pytest.warns(
        UserWarning, match=r"critical_points: .*a mode grows at friction = 1: .*ask for these kinds"
    ):
        assert not ss.critical_points(scene, {"friction": (0.0, 1.0)}, kinds=("hopf",))
    # Neutral at both ends of a range below the lock-in.
    assert not ss.critical_points(scene, {"friction": (0.0, 0.4)}, kinds=("hopf",))
