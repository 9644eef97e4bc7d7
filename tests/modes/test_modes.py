import os
import subprocess
import sys

import mpmath
import numpy as np
import pytest
import scipy.linalg
import scipy.optimize
from hypothesis import assume, given
from hypothesis import strategies as st

import equal_chain
import stickslip as ss
from quad_block import quad_block
from random_scenes import combinations, drawn_scenes

EPS = np.finfo(float).eps
#: Condition number of an eigenvalue up to which a scene counts as away from defective points.
WELL_CONDITIONED = 1e3


@given(drawn_scenes(), st.data())
def test_left_and_right_vectors_are_biorthogonal(drawn, data):
    modes = ss.complex_modes(drawn.scene, data.draw(combinations(drawn.scene)))
    assume(modes.condition.max() < WELL_CONDITIONED)
    for matrix, diagonal in ((modes.state_a, modes.a), (modes.state_b, modes.b)):
        product = modes.left.T @ matrix @ modes.right
        # Relative to what cancels in each entry.
        size = np.abs(modes.left).T @ np.abs(matrix) @ np.abs(modes.right)
        assert np.abs(product - np.diag(diagonal)).max() <= 1e-12 * size.max()
        assert (
            np.abs(product - np.diag(diagonal)) <= 1e-12 * np.sqrt(np.outer(np.diag(size), np.diag(size)))
        ).all()
    assert np.abs(modes.eigenvalues + modes.b / modes.a).max() <= 1e-12 * np.abs(modes.eigenvalues).max()


@given(drawn_scenes(), st.data())
def test_every_pair_solves_the_eigenproblem(drawn, data):
    modes = ss.complex_modes(drawn.scene, data.draw(combinations(drawn.scene)))
    m = modes.mass.shape[0]
    mass, damping, stiffness = modes.state_a[m:, :m], modes.state_a[:m, :m], modes.state_b[:m, :m]
    for eigenvalue, right in zip(modes.eigenvalues, modes.right.T, strict=True):
        xi = right[:m]
        assert right[m:] == pytest.approx(eigenvalue * xi, rel=4 * EPS)
        assert np.abs(xi).max() == pytest.approx(1.0, rel=4 * EPS)
        terms = [eigenvalue**2 * mass, eigenvalue * damping, stiffness]
        size = sum(np.abs(term).sum(axis=1) for term in terms)
        # Backward stable up to a modest multiple of the size of the problem.
        assert (np.abs(sum(terms) @ xi) <= 100 * m * EPS * size.max()).all()
    assert (modes.residual <= 100 * m * EPS).all()


@pytest.mark.parametrize("friction", [0.0, 1e-3])
def test_modes_of_a_mesh_against_lapack(friction):
    """With ``C = beta K`` and ``K x = kappa M x``: lambda^2 + beta kappa lambda + kappa = 0."""
    scene = quad_block(12, 6, 2, friction=friction)
    modes = ss.complex_modes(scene).with_conjugates
    m = modes.mass.shape[0]
    kappa = scipy.linalg.eigvals(modes.stiffness, modes.mass)
    # Right to some hundred roundings of the largest one.
    rounding = 1e3 * EPS * np.abs(kappa).max()
    half = -0.5 * scene.damping.stiffness * kappa
    roots = np.concatenate([half + np.sqrt(half**2 - kappa), half - np.sqrt(half**2 - kappa)])
    for value in modes.eigenvalues:
        nearest = roots[np.abs(roots - value).argmin()]
        # What lambda moves with kappa: (1 + beta lambda) / (2 lambda + beta kappa), a half over lambda here.
        assert abs(value - nearest) <= rounding / abs(value)
        assert abs(value.real - nearest.real) <= rounding / abs(value)
    assert modes.eigenvalues.size == 2 * m
    assert modes.residual.max() <= 100 * EPS


@given(drawn_scenes(), st.data())
def test_modes_are_one_of_each_pair_sorted_by_modulus_and_all_of_them_with_conjugates(drawn, data):
    modes = ss.complex_modes(drawn.scene, data.draw(combinations(drawn.scene)))
    values = modes.eigenvalues
    assert (values.imag >= 0.0).all()
    assert (np.diff(np.abs(values)) >= -EPS * np.abs(values[1:])).all()
    every = modes.with_conjugates
    expected = drawn.scene.core.modes(modes.combination)
    for name in ("eigenvalues", "right_displacement", "left_displacement", "a", "b", "shapes", "condition"):
        assert np.array_equal(getattr(every, name), expected[name], equal_nan=True)
    assert every.with_conjugates is every
    for set_of in (modes, every):
        assert (
            len(set_of) == len(list(set_of)) == set_of.frequencies.size == set_of.to_dataset().sizes["mode"]
        )
    values, index = every.eigenvalues, 0
    while index < values.size:
        if values[index].imag == 0.0:
            index += 1
        else:
            assert values[index].imag > 0.0
            assert values[index + 1] == values[index].conjugate()
            index += 2


@pytest.mark.parametrize("combination", ["++", "+d", "s+", "ss", "+-", "dd"])
@pytest.mark.parametrize("friction", [0.0, 0.612, 1.5, 2.2])
def test_eigenvalues_against_forty_digits(combination, friction):
    scene = ss.models.two_subsystems(friction=friction)
    if friction == 0.0 and "s" in combination:
        with pytest.raises(ss.InputError, match="friction 0"):
            ss.complex_modes(scene, combination)
        return
    modes = ss.complex_modes(scene, combination)
    reduced = ss.equations_of(scene, combination)
    with mpmath.workdps(40):
        m = reduced.mass.shape[0]
        inverse = mpmath.matrix(reduced.mass) ** -1
        state = mpmath.zeros(2 * m)
        state[:m, m:] = mpmath.eye(m)
        state[m:, :m] = -inverse * mpmath.matrix(reduced.stiffness)
        state[m:, m:] = -inverse * mpmath.matrix(reduced.damping)
        exact = np.array([complex(value) for value in mpmath.eig(state, left=False, right=False)])
    left = list(exact)
    for value, condition in zip(modes.eigenvalues, modes.condition, strict=True):
        nearest = min(left, key=lambda other: abs(other - value))
        left.remove(nearest)
        # First order: condition times a backward error of some ten roundings.
        assert abs(value - nearest) <= 20 * EPS * condition * abs(value)


@pytest.mark.parametrize("seed", range(6))
def test_masses_and_stiffnesses_over_twelve_orders_of_magnitude(seed):
    """Also the slowest mode, 1e-10 of the fastest and less, is right to its own rounding."""
    rng = np.random.default_rng(seed)
    wide = {
        name: 10.0 ** rng.uniform(-6.0, 6.0, shape)
        for name, shape in {
            "upper_mass": 2,
            "contact_mass": 2,
            "vertical_stiffness": 2,
            "horizontal_stiffness": 2,
            "ceiling_stiffness": 2,
        }.items()
    }
    scene = ss.models.two_subsystems(friction=(0.4, 0.9), inclination=(0.3, 0.75), damping=1e-5, **wide)
    modes = ss.complex_modes(scene, "+" * len(scene.contacts))
    stiffness, kept = scene.stiffness, [0, 1, 2, 4, 5, 6]
    dense = stiffness.toarray() if hasattr(stiffness, "toarray") else stiffness
    with mpmath.workdps(60):
        reduced = mpmath.matrix(6)
        for i, row in enumerate(kept):
            for j, column in enumerate(kept):
                entry = mpmath.mpf(dense[row, column])
                if row in (2, 6):
                    friction = mpmath.mpf(scene.contacts[row // 4].friction)
                    entry -= friction * mpmath.mpf(dense[row + 1, column])
                reduced[i, j] = entry / mpmath.mpf(scene.mass[row])
        exact = []
        for kappa in mpmath.eig(reduced, left=False, right=False):
            half = mpmath.mpf(scene.damping.stiffness) * kappa / 2
            root = mpmath.sqrt(half * half - kappa)
            exact += [complex(-half + root), complex(-half - root)]
    assert modes.residual.max() <= 1e-13
    for value, condition in zip(modes.eigenvalues, modes.condition, strict=True):
        nearest = min(exact, key=lambda other: abs(other - value))
        exact.remove(nearest)
        # Rounding of the value itself, and of the Rayleigh quotient that corrects it.
        assert abs(value - nearest) <= 4 * EPS * condition * abs(value)


@pytest.mark.parametrize("general", [False, True])
def test_coupled_masses_under_friction_are_solved_to_rounding(general):
    """The reduced mass is not symmetric here; vectors of 45 coordinates are refined."""
    count, contacts = 51, 6
    rng = np.random.default_rng(1)
    rotation = np.linalg.qr(rng.standard_normal((count, count)))[0]
    stiffness = (rotation * np.linspace(1e6, 1e9, count)) @ rotation.T
    stiffness = 0.5 * (stiffness + stiffness.T)
    mass = np.eye(count) + np.diag(np.full(count - 1, 0.2), 1) + np.diag(np.full(count - 1, 0.2), -1)
    spread = np.diag(rng.uniform(0.0, 100.0, count))
    force = np.zeros(count)
    force[contacts : 2 * contacts] = -1e3
    scene = ss.Scene(
        mass,
        stiffness,
        damping=1e-6 * stiffness + spread if general else ss.Rayleigh(stiffness=1e-6),
        force=force,
        contacts=[
            ss.Contact(tangential=i, normal=contacts + i, friction=0.3, slider_speed=1.0)
            for i in range(contacts)
        ],
    )
    modes = ss.complex_modes(scene)
    reduced_mass = ss.equations_of(scene, "+" * contacts).mass
    assert not np.array_equal(reduced_mass, reduced_mass.T)
    assert modes.condition.max() < WELL_CONDITIONED
    # A residual of the refined problem is one rounding of its terms; unrefined ones are ten times that.
    assert modes.residual.max() <= EPS
    size = np.sqrt(np.abs(modes.a))
    product = (modes.left.T @ modes.state_a @ modes.right - np.diag(modes.a)) / np.outer(size, size)
    assert np.abs(product).max() <= 1e-12


def test_a_real_positive_eigenvalue_is_static_divergence():
    modes = ss.complex_modes(ss.models.two_subsystems(friction=1.5), "+-")
    real = modes.eigenvalues.imag == 0.0
    assert (real & (modes.eigenvalues.real > 0.0)).any()
    assert modes.unstable[real & (modes.eigenvalues.real > 0.0)].all()


def test_general_damping_agrees_with_proportional_damping():
    scene = ss.models.two_subsystems(friction=1.5)
    general = scene.replace(damping=1e-4 * scene.stiffness.toarray())
    by_blocks, by_state = ss.complex_modes(scene), ss.complex_modes(general)
    error = np.abs(by_blocks.eigenvalues - by_state.eigenvalues)
    condition = np.maximum(by_blocks.condition, by_state.condition)
    # The 2n problem has a backward error relative to its largest eigenvalue.
    assert (error <= 100 * EPS * condition * np.abs(by_blocks.eigenvalues).max()).all()


def test_shapes_cover_all_dofs_of_the_scene():
    modes = ss.complex_modes(ss.models.two_subsystems(), "s+")
    assert modes.shapes.shape == (8, 5)
    assert not modes.shapes[[2, 3, 7]].any()  # stuck tangentially, and both contacts closed
    assert np.array_equal(modes.shapes[[0, 1, 4, 5, 6]], modes.right[:5])


def test_several_modes_are_modes_again():
    modes = ss.complex_modes(ss.models.two_subsystems(friction=1.5))
    first, growing, picked = modes[0:4], modes[modes.unstable], modes[[4, 0]]
    assert isinstance(first, ss.Modes)
    np.testing.assert_array_equal(first.eigenvalues, modes.eigenvalues[:4])
    np.testing.assert_array_equal(first.left, modes.left[:, :4])
    assert growing.unstable.all()
    assert len(growing) == modes.unstable.sum() > 0
    assert [mode.eigenvalue for mode in picked] == [modes[4].eigenvalue, modes[0].eigenvalue]
    assert picked[1].number == 1
    assert picked.to_dataset().sizes["mode"] == 2
    assert len(modes[:0]) == 0
    with pytest.raises(IndexError):
        modes[[True, False]]


def test_frequency_and_damping_ratio_of_one_oscillator():
    omega, zeta = 200.0, 0.1
    scene = ss.Scene([2.0], [[2.0 * omega**2]], damping=[[2.0 * 2.0 * zeta * omega]])
    modes = ss.complex_modes(scene, "")
    assert modes.frequencies == pytest.approx(omega / (2 * np.pi), rel=4 * EPS)
    assert modes.damping_ratios == pytest.approx(zeta, rel=8 * EPS)
    expected = omega * complex(-zeta, np.sqrt(1 - zeta**2))
    assert modes.eigenvalues == pytest.approx([expected], rel=8 * EPS)


def test_defective_points_are_flagged_and_left_without_vectors():
    # The undamped modes coalesce here; with C = beta K the damped ones do too.
    modes = ss.complex_modes(ss.models.two_subsystems(friction=0.612484152848669))
    assert modes.defective.sum() == 2
    assert np.isnan(modes.left[:, modes.defective]).all()
    assert np.isfinite(modes.left[:, ~modes.defective]).all()
    assert not ss.complex_modes(ss.models.two_subsystems(friction=0.60)).defective.any()


def test_eigenvalues_where_the_plain_double_shift_wanders():
    """Two complex pairs left in four rows: one such neighbour in nine took more than sixty sweeps."""
    scene = ss.models.two_subsystems(
        wall_stiffness=1954904.901123497,
        vertical_stiffness=(440887.1349048497, 31167.156400843724),
        horizontal_stiffness=(292926.8201629947, 2184313.0199112142),
        ceiling_stiffness=(59768.17283453948, 178397.43240868003),
        link_horizontal_stiffness=1518418.118600642,
        link_vertical_stiffness=244488.14761098026,
    )
    for friction in 2.140625 * (1.0 + 1e-14 * np.arange(200)):
        moved = scene.replace(friction=friction)
        found = ss.complex_modes(moved).eigenvalues
        reduced = ss.equations_of(moved, "++")
        inverse = np.linalg.inv(reduced.mass)
        state = np.block(
            [
                [np.zeros((6, 6)), np.eye(6)],
                [-inverse @ reduced.stiffness, -inverse @ reduced.damping],
            ]
        )
        expected = np.linalg.eigvals(state)
        # LAPACK's backward error over twelve rows, times a condition of some ten.
        apart = np.abs(found[:, None] - expected).min(axis=1)
        assert apart.max() < 1e-10 * np.abs(expected).max()


@pytest.mark.slow
@pytest.mark.parametrize("link", [1.0, 1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize("friction", [0.4, 1.5])
def test_long_chains_of_equals_against_lapack(friction, link):
    """Weak links leave eigenvalues in clusters as near as their square."""
    count = 40
    tie = {name: link * value for name, value in vars(equal_chain.LINK).items()}
    scene = ss.models.chain(
        [equal_chain.PART] * count,
        [ss.models.Link(**tie)] * (count - 1),
        wall_stiffness=1e6 * link,
        friction=friction,
        slider_speed=0.05,
    )
    modes = ss.complex_modes(scene, "+" * len(scene.contacts)).with_conjugates
    a, b, value = modes.state_a, modes.state_b, modes.eigenvalues
    assert value.size == 6 * count
    # Time in units of the fastest mode, for LAPACK's sake.
    rate = np.abs(value).max()
    scale = np.concatenate([np.ones(3 * count), np.full(3 * count, rate)])
    units = np.outer(scale, scale) / rate
    expected = rate * scipy.linalg.eigvals(-b * units / rate, a * units)
    rows, columns = scipy.optimize.linear_sum_assignment(np.abs(value[:, None] - expected))
    error = np.abs(value[rows] - expected[columns])
    assert (error <= 1e-13 * rate * np.maximum(modes.condition[rows], 1.0)).all()
    # Above this, modes are improved one by one.
    assert modes.residual.max() <= 3e-14
    assert modes.condition.max() < WELL_CONDITIONED
    size = np.sqrt(np.abs(modes.a))
    product = (modes.left.T @ a @ modes.right - np.diag(modes.a)) / np.outer(size, size)
    assert np.abs(product).max() <= 1e-12


def test_nothing_moves_where_nothing_is_free():
    scene = ss.Scene(
        mass=[1.0, 1.0],
        stiffness=np.diag([2.0, 3.0]),
        force=[0.0, -1.0],
        contacts=[ss.Contact(tangential=0, normal=1, friction=0.5, slider_speed=0.0)],
    )
    modes = ss.complex_modes(scene, "s")
    assert modes.eigenvalues.shape == (0,)
    assert modes.shapes.shape == (2, 0)
    assert modes.right.shape == modes.left.shape == modes.state_a.shape == (0, 0)
    assert modes.to_dataset().sizes == {"mode": 0, "dof": 2}


THREADS = """
import os
import stickslip as ss
ss.complex_modes(ss.models.two_subsystems())
print(len(os.listdir("/proc/self/task")))
"""


@pytest.mark.process
@pytest.mark.skipif(sys.platform != "linux", reason="counts the threads that the kernel knows")
def test_the_modes_of_a_small_scene_need_no_other_thread():
    """A process with threads can't be forked."""
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    found = subprocess.run(
        [sys.executable, "-c", THREADS], capture_output=True, text=True, check=True, env=environment
    )
    assert found.stdout.strip() == "1"


@pytest.mark.parametrize("part", [0.0, 0.25])
def test_a_damping_matrix_that_is_proportional_to_the_last_bit_is_taken_as_such(part):
    stiffness = np.diag([1.0, 0.0, 9.0])
    matrix = ss.Scene(mass=[1.0, 2.0, 3.0], stiffness=stiffness, damping=part * stiffness)
    stated = matrix.replace(damping=ss.Rayleigh(stiffness=part))
    found, expected = (ss.complex_modes(scene, "") for scene in (matrix, stated))
    assert found.eigenvalues.tobytes() == expected.eigenvalues.tobytes()
    by_mass = matrix.replace(damping=np.diag(0.5 * matrix.mass))
    stated = matrix.replace(damping=ss.Rayleigh(mass=0.5))
    found, expected = (ss.complex_modes(scene, "") for scene in (by_mass, stated))
    assert found.eigenvalues.tobytes() == expected.eigenvalues.tobytes()


def test_a_rigid_body_beside_damped_dofs_is_a_defective_zero():
    """Of no damping that is proportional: x1 moves freely, the others are sqrt(k - c^2 / 4) oscillators."""
    scene = ss.Scene(
        mass=[1.0, 1.0, 1.0], stiffness=np.diag([4.0, 0.0, 9.0]), damping=np.diag([0.1, 0.0, 0.2])
    )
    modes = ss.complex_modes(scene, "")
    zero = modes.eigenvalues == 0.0
    assert zero.sum() == 2
    assert modes.defective[zero].all()
    assert not modes.defective[~zero].any()
    assert not modes.unstable.any()
    rounding = 8 * np.finfo(float).eps
    for stiffness, damping in ((4.0, 0.1), (9.0, 0.2)):
        value = complex(-0.5 * damping, np.sqrt(stiffness - 0.25 * damping**2))
        assert np.abs(modes.eigenvalues - value).min() <= rounding * abs(value)
    run = ss.simulate(scene, 2.0, ss.State([0.0, 0.0, 0.0], [0.0, 0.5, 0.0], ""))
    assert run.state(2.0).position[1] == pytest.approx(1.0, rel=rounding)


def test_a_mode_is_unstable_beyond_its_rounding():
    """What rounding leaves of the growth of an undamped mode is no growth."""
    scene = ss.models.two_subsystems(friction=0.3, damping=0.0)
    modes = ss.complex_modes(scene)
    assert (modes.eigenvalues.real[modes.unstable] > modes.rounding[modes.unstable]).all()
    assert not (modes.unstable & modes.marginal).any()
    dense = [np.abs(matrix) for matrix in (modes.mass, modes.damping, modes.stiffness)]
    modulus = np.abs(modes.eigenvalues)
    right, left = np.abs(modes.right_displacement), np.abs(modes.left_displacement)
    parts = zip((modulus**2, modulus, 1.0), dense, strict=True)
    bound = 4 * np.finfo(float).eps * sum(f * (left * (m @ right)).sum(axis=0) for f, m in parts)
    np.testing.assert_allclose(modes.rounding, bound / np.abs(modes.a), rtol=1e-12)


def sums(scene):
    """How many modes of steady sliding grow, a pair being one, by every part of the package that says so."""
    friction = scene.contacts[0].friction
    sweep = ss.sweep(scene, {"friction": [friction, friction + 1e-3]})
    assert bool(sweep.stable[0]) == (not sweep.unstable[0].any())
    table = ss.status_table(scene, ["+" * len(scene.contacts)]).data
    return {
        "modes": len(ss.complex_modes(scene).select(unstable=True)),
        "sweep": int((sweep.unstable & (sweep.eigenvalue.imag >= 0.0))[0].sum()),
        "stability": int(ss.stability(scene, {"friction": [friction]}).unstable_modes[0]),
        "study": int(ss.Study(scene, {"friction": [friction]}).run().unstable_modes[0]),
        "table": int(table.unstable.sum()),
    }


def lone_dashpot():
    """Four masses, one of them damped: one of the others neither grows nor decays, whatever rounding says."""
    damping = np.zeros((4, 4))
    damping[3, 3] = 5.0
    return ss.Scene(
        np.ones(4),
        np.diag([1e4, 2e4, 3e4, 4e4]) + np.diag([10.0, 0.0, 0.0], 1) + np.diag([10.0, 0.0, 0.0], -1),
        damping=damping,
        force=[0.0, -1.0, 0.0, 0.0],
        contacts=[ss.Contact(tangential=0, normal=1, friction=0.1, slider_speed=1.0)],
    )


@pytest.mark.parametrize(
    ("scene", "growing"),
    [
        (ss.models.two_subsystems(friction=0.3, damping=0.0), 0),
        (ss.models.two_subsystems(friction=0.7, damping=0.0), 1),
        (ss.models.two_subsystems(friction=0.7), 0),
        (ss.models.two_subsystems(friction=0.8), 1),
        # Where two undamped modes have just met: a defective pair, which rounding splits.
        (ss.models.two_subsystems(friction=0.61248415284867, damping=0.0), 0),
        (lone_dashpot(), 0),
    ],
)
def test_unstable_means_the_same_everywhere(scene, growing):
    assert set(sums(scene).values()) == {growing}, sums(scene)


def test_a_growth_rate_within_rounding_is_zero():
    undamped = ss.models.two_subsystems(damping=0.0)
    points = ss.critical_points(undamped, {"friction": (0.0, 3.0)})
    meeting = next(point for point in points if point.kind == "lock_in").value
    growing = 0
    # Rounding splits the pair that meets here in frequency or in growth.
    for friction in meeting + np.spacing(meeting) * np.arange(-8, 9):
        modes = ss.complex_modes(undamped.replace(friction=friction))
        growing += modes.eigenvalues.real.max() > 0.0
        assert modes.defective.any()
        assert np.isfinite(modes.rounding).all()
        assert modes.marginal.all()
        for verdict in (
            ss.stability(undamped, {"friction": [friction]}),
            ss.stability(ss.models.two_subsystems, {"friction": [friction], "damping": [0.0]}),
        ):
            assert verdict.growth_rate.item() == 0.0
            assert verdict.unstable_modes.item() == 0
    assert growing > 0
