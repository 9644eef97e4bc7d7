"""Modes of a band and near points by sparse shift and invert, and the count of those missing."""

import numpy as np
import pytest
import scipy.sparse

import stickslip as ss
from planted_spectra import outcome, withheld
from quad_block import quad_block
from reference_modes import reference_eigenvalues
from spinning_disc import spinning_disc
from stickslip.modes.sparse import dissection, shift_invert
from stickslip.modes.sparse import pencil as pencils
from stickslip.modes.sparse.certificate import FACTORIZATIONS, Certificate
from stickslip.modes.sparse.dissection import dissected
from stickslip.modes.sparse.pencil import SparsePencil
from stickslip.modes.sparse.region import Region
from stickslip.modes.sparse.search import search_region, with_conjugates

EPS = np.finfo(float).eps


@pytest.fixture(scope="module")
def disc():
    """A spinning disc of 360 dofs between pads: small enough for all its modes."""
    return spinning_disc(2, 20, 3)


@pytest.fixture(scope="module")
def every(disc):
    return ss.complex_modes(disc, "")


def test_band_is_what_all_modes_have_in_it(disc, every):
    """Both correct their eigenvalues in doubled precision: they differ by condition times rounding."""
    for band, growth in (
        ((0.0, 12e3), (-50.0, None)),
        ((4e3, 11e3), (None, None)),
        ((1e3, 9e3), (1.0, 40.0)),
    ):
        part = ss.complex_modes(disc, "", band=band, growth=growth)
        low, high = (
            default if g is None else g for g, default in zip(growth, (-np.inf, np.inf), strict=True)
        )
        wanted = (every.frequencies >= band[0]) & (every.frequencies <= band[1])
        wanted &= (every.eigenvalues.real >= low) & (every.eigenvalues.real <= high)
        expected = every.eigenvalues[wanted]
        assert len(part) == expected.size > 0
        assert np.all(np.abs(part.eigenvalues - expected) <= 10.0 * part.condition * EPS * np.abs(expected))
        assert np.array_equal(part.unstable, every.unstable[wanted])
        assert abs(part.missing) < 0.01
        assert part.doubts == ()
        # Vectors are known up to a factor, and have the same largest entry.
        alike = np.abs(np.sum(part.shapes.conj() * every.shapes[:, wanted], axis=0))
        sizes = np.linalg.norm(part.shapes, axis=0) * np.linalg.norm(every.shapes[:, wanted], axis=0)
        np.testing.assert_allclose(alike, sizes, rtol=1e-9)


def test_a_band_without_the_count_of_missing_modes(disc):
    counted, uncounted = (
        ss.complex_modes(disc, "", band=(4e3, 11e3), certify=certify) for certify in (True, False)
    )
    assert uncounted.missing is None
    assert dict(uncounted.summary().facts)["missing"] == "not known"
    np.testing.assert_allclose(uncounted.eigenvalues, counted.eigenvalues, rtol=1e-12)


def test_vectors_are_biorthogonal_and_residuals_those_of_the_stated_matrices(disc):
    modes = ss.complex_modes(disc, "", band=(0.0, 12e3))
    product = modes.left.T @ (modes.state_a @ modes.right)
    off = np.abs(product - np.diag(modes.a)) / np.sqrt(np.abs(modes.a)[:, None] * np.abs(modes.a))
    assert off.max() < 1e-7
    np.testing.assert_allclose(modes.b, -modes.eigenvalues * modes.a, rtol=1e-14)
    for k, value in enumerate(modes.eigenvalues):
        x, size = modes.right_displacement[:, k], abs(value)
        terms = (value**2 * modes.mass) @ x + (value * modes.damping) @ x + modes.stiffness @ x
        scale = sum(
            factor * abs(matrix).sum(axis=1).max()
            for factor, matrix in ((size**2, modes.mass), (size, modes.damping), (1.0, modes.stiffness))
        )
        # Both are sums of some 80 rounded products.
        assert abs(np.abs(terms).max() / (scale * np.abs(x).max()) - modes.residual[k]) < 20 * EPS
    assert modes.residual.max() < 1e-13


def test_near_points_are_their_nearest_eigenvalues(disc, every):
    upper = every.eigenvalues
    points = [2j * np.pi * 3000.0, -40.0 + 2j * np.pi * 7000.0]
    nearest = [np.argsort(np.abs(upper - point))[:7] for point in points]
    expected = upper[np.unique(np.concatenate(nearest))]
    modes = ss.complex_modes(disc, "", near=points, count=7)
    found = modes.eigenvalues
    np.testing.assert_allclose(np.sort_complex(found), np.sort_complex(expected), rtol=1e-12)
    assert modes.missing is None
    # The spectrum is mirrored, and so is what is near a point of the lower half plane.
    mirrored = ss.complex_modes(disc, "", near=np.conj(points), count=7)
    np.testing.assert_allclose(mirrored.eigenvalues, modes.eigenvalues, rtol=1e-12)


def test_near_the_real_axis_conjugates_are_not_counted_twice(disc, every):
    modes = ss.complex_modes(disc, "", near=500.0, count=5)
    upper = every.eigenvalues
    expected = upper[np.argsort(np.abs(upper - 500.0))[:5]]
    found = modes.eigenvalues
    np.testing.assert_allclose(np.sort_complex(found), np.sort_complex(expected), rtol=1e-12)


def test_a_shift_on_an_eigenvalue_is_moved_aside(disc, every):
    value = every.eigenvalues[6]
    for count in (1, 5):
        modes = ss.complex_modes(disc, "", near=value, count=count)
        assert len(modes) == count
        assert abs(modes.eigenvalues - value).min() <= 1e-12 * abs(value)


def test_sliding_contacts_of_a_mesh():
    """Friction makes the reduced pencil unsymmetric: left vectors are others than right ones."""
    scene = quad_block(20, 10, 2)
    modes, every = ss.complex_modes(scene, band=(0.0, 60e3)), ss.complex_modes(scene)
    expected = every.eigenvalues[every.frequencies <= 60e3]
    assert len(modes) == expected.size > 5
    assert np.all(np.abs(modes.eigenvalues - expected) <= 10.0 * modes.condition * EPS * np.abs(expected))
    assert abs(modes.missing) < 0.01
    assert np.array_equal(modes.combination, every.combination)
    np.testing.assert_allclose(modes.shapes, every.shapes[:, every.frequencies <= 60e3], atol=1e-7)


def test_scenes_of_few_dofs_take_a_part_of_all_modes():
    scene = ss.models.two_subsystems(friction=2.2)
    every, part = ss.complex_modes(scene), ss.complex_modes(scene, band=(100.0, 300.0), growth=(0.0, None))
    wanted = (every.frequencies >= 100.0) & (every.frequencies <= 300.0) & (every.eigenvalues.real >= 0.0)
    assert np.array_equal(part.eigenvalues, every.eigenvalues[wanted])
    assert part.missing == 0.0
    point = 2j * np.pi * 120.0
    upper = every.eigenvalues
    near = ss.complex_modes(scene, near=point, count=1)
    assert near.eigenvalues[0] == upper[np.argmin(np.abs(upper - point))]
    assert len(near) == 1


def test_withheld_eigenvalues_are_counted(disc):
    pencil = SparsePencil.of(disc, "")
    region = Region(0.0, 2.0 * np.pi * 12e3, -50.0, np.inf)
    outer = region.wider(0.1 * region.high)
    wide = search_region(pencil, region.wider(0.3 * region.high)).found.eigenvalues
    certificate = Certificate.of(pencil, outer, 0.1 * region.high)
    assert certificate.factorizations <= FACTORIZATIONS
    assert abs(certificate.missing(with_conjugates(wide))) < 1e-6
    for count in (1, 4):
        gone = np.argsort(np.abs(wide))[2 : 2 + count]
        left = np.delete(wide, gone)
        assert abs(certificate.missing(with_conjugates(left)) - 2 * count) < 1e-6


@pytest.mark.nightly
def test_eigenvalues_next_to_the_contour_are_counted_right_or_in_doubt():
    """One to four of them withheld together, at 1e-6 to 0.2 of the radius; the file itself runs thousands."""
    words = [withheld(seed) for seed in range(40)]
    assert set(words) <= {"right", "doubt"}
    assert words.count("right") >= 25


def test_more_pairs_than_first_asked_for_are_found_within_a_radius(disc, every, monkeypatch):
    """However few the first search takes: the number of the next ones follows from their distances."""
    upper = every.eigenvalues
    shift, radius = 4e4j, 2e4
    # An eigenvalue on the border may be found or not.
    expected = upper[np.abs(upper - shift) <= radius * (1.0 - 1e-9)]
    monkeypatch.setattr(shift_invert, "_FIRST", 4)
    found = shift_invert.search_near(SparsePencil.of(disc, ""), shift, 120, radius)
    assert found.radius > radius
    within = found.eigenvalues[np.abs(found.eigenvalues - shift) <= radius]
    assert within.size == expected.size > 12
    np.testing.assert_allclose(np.sort_complex(within), np.sort_complex(expected), rtol=1e-9)
    few = shift_invert.search_near(SparsePencil.of(disc, ""), shift, 5, radius)
    assert few.eigenvalues.size == 5
    assert few.radius < radius


def test_planted_spectra_are_counted_right_or_in_doubt():
    """0 to 40 eigenvalues, clusters, double ones, one next to a bound; the file itself runs thousands."""
    words = [outcome(seed)[0] for seed in range(1000, 1012)]
    assert set(words) <= {"right", "doubt"}
    assert words.count("right") >= 10


def test_an_eigenvalue_on_the_border_is_told():
    """Undamped masses: every growth rate is zero, and so is the bound."""
    size = 150
    chain = scipy.sparse.diags_array(
        [np.full(size - 1, -1.0), np.full(size, 2.0), np.full(size - 1, -1.0)], offsets=(-1, 0, 1)
    )
    scene = ss.Scene(np.ones(size), 1e6 * chain.tocsr())
    modes = ss.complex_modes(scene, "", band=(0.0, 100.0), growth=(0.0, None))
    assert modes.doubts
    assert all("lies on a bound" in doubt for doubt in modes.doubts)
    assert "doubt" in str(modes)


@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize("n", [40, 150])
def test_a_mode_just_outside_a_bound_is_told(n, side):
    """A chain between a wall and a free end: frequencies ``sin((2 k - 1) pi / (4 n + 2)) / pi`` Hz."""
    matrix = np.diag(np.r_[2.0 * np.ones(n - 1), 1.0]) - np.eye(n, k=1) - np.eye(n, k=-1)
    scene = ss.Scene(np.ones(n), scipy.sparse.csr_array(matrix))
    k = 9
    frequency = np.sin((2 * k - 1) * np.pi / (4 * n + 2)) / np.pi
    modes = ss.complex_modes(scene, "", band=(0.0, frequency * (1.0 + side * 8.0 * EPS)))
    assert len(modes) == (k if side > 0 else k - 1)
    (doubt,) = modes.doubts
    assert ("left out" in doubt) == (side < 0)


@pytest.mark.parametrize(
    "damping", [None, ss.Rayleigh(stiffness=1e-6), ss.Rayleigh(mass=1.0)], ids=["none", "K", "M"]
)
@pytest.mark.parametrize("bodies", [1, 3, 6])
def test_rigid_body_motions_are_counted(bodies, damping):
    """Free chains have the eigenvalues ``4 k sin(j pi / 2 n)^2`` of M^-1 K, and zero among them."""
    n = 120
    chain = np.diag(np.r_[1.0, 2.0 * np.ones(n - 2), 1.0]) - np.eye(n, k=1) - np.eye(n, k=-1)
    springs = 1e6 * np.linspace(1.0, 1.7, bodies)
    stiffness = scipy.sparse.block_diag([scipy.sparse.csr_array(k * chain) for k in springs])
    squares = np.sort((4.0 * springs[:, None] * np.sin(np.arange(n) * np.pi / (2 * n)) ** 2).ravel())
    top = float(np.sqrt(squares[20:22]).mean()) / (2.0 * np.pi)
    mass, beta = (0.0, 0.0) if damping is None else (damping.mass, damping.stiffness)
    loss = mass + beta * squares[:21]
    roots = np.sqrt(0.25 * loss**2 - squares[:21] + 0j)
    expected = np.concatenate([-0.5 * loss + roots, -0.5 * loss - roots])
    scene = ss.Scene(np.ones(n * bodies), stiffness.tocsr(), damping=damping)
    modes = ss.complex_modes(scene, "", band=(0.0, top)).with_conjugates
    assert len(modes) == 42
    assert modes.doubts == ()
    assert abs(modes.missing) < 0.01
    assert np.count_nonzero(modes.eigenvalues == 0.0) == (bodies if mass else 2 * bodies)
    found, expected = (
        v[np.lexsort((v.imag.round(6), np.abs(v).round(6)))] for v in (modes.eigenvalues, expected)
    )
    np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-10)


def test_modes_in_the_order_of_nested_dissection_are_the_same(disc, every, monkeypatch):
    """Where many entries fill in, nested dissection orders the factorizations."""
    monkeypatch.setattr(pencils, "_DISSECTED", 0)
    modes = ss.complex_modes(disc, "", band=(0.0, 12e3))
    expected = every.eigenvalues[every.frequencies <= 12e3]
    assert np.all(np.abs(modes.eigenvalues - expected) <= 10.0 * modes.condition * EPS * np.abs(expected))
    product = modes.left.T @ (modes.state_a @ modes.right)
    off = np.abs(product - np.diag(modes.a)) / np.sqrt(np.abs(modes.a)[:, None] * np.abs(modes.a))
    assert off.max() < 1e-7


def fill(graph, order):
    """Return the pairs of vertices that elimination in an order joins."""
    neighbours = [set(row) - {k} for k, row in enumerate(np.split(graph.indices, graph.indptr[1:-1]))]
    count = 0
    for k in order:
        rest = neighbours[k]
        count += len(rest)
        for j in rest:
            neighbours[j] |= rest
            neighbours[j] -= {j, k}
    return count


def grid(rows, columns):
    """Return the graph of a grid in which a vertex knows the eight around it."""
    path = [
        scipy.sparse.diags_array([1.0, 1.0, 1.0], offsets=[-1, 0, 1], shape=(n, n)) for n in (rows, columns)
    ]
    return scipy.sparse.csr_array(scipy.sparse.kron(*path))


def test_dissection_divides_a_grid(monkeypatch):
    """Of a strip the fill grows with its length, nearly as with the best order."""
    monkeypatch.setattr(dissection, "_PART", 12)
    rng = np.random.default_rng(0)
    counts = {}
    for length in (40, 80):
        strip = grid(6, length)
        mixed = rng.permutation(6 * length)
        graph = scipy.sparse.csr_array(strip.tocsr()[mixed][:, mixed])
        order = dissected(graph)
        assert np.array_equal(np.sort(order), np.arange(6 * length))
        counts[length] = fill(graph, order)
        # Column by column, the best that is known here, fills 6 to 7 neighbours below each vertex.
        assert counts[length] < 2.0 * fill(strip, np.arange(6 * length).reshape(6, length).T.ravel())
        assert counts[length] < 0.5 * fill(graph, rng.permutation(6 * length))
    assert counts[80] < 2.5 * counts[40]


@pytest.mark.parametrize(
    "graph",
    [
        scipy.sparse.csr_array(np.ones((100, 100))),
        scipy.sparse.csr_array(np.eye(100)),
        scipy.sparse.csr_array(scipy.sparse.block_diag([grid(9, 9), np.ones((70, 70)), grid(1, 90)])),
        scipy.sparse.csr_array(np.ones((1, 1))),
    ],
)
def test_dissection_of_any_graph_is_an_order(graph):
    assert np.array_equal(np.sort(dissected(graph)), np.arange(graph.shape[0]))


@pytest.mark.nightly
@pytest.mark.slow
def test_disc_of_5000_dofs():
    """Against scipy's search at other shifts, refined by quotients in extended precision."""
    scene = spinning_disc()
    assert scene.size == 5040
    band, bound = (0.0, 6e3), -50.0
    modes = ss.complex_modes(scene, "", band=band, growth=(bound, None))
    assert abs(modes.missing) < 0.01
    assert modes.doubts == ()
    reference = reference_eigenvalues(modes.mass, modes.damping, modes.stiffness, band[1])
    wanted = (np.abs(reference) <= 2.0 * np.pi * band[1]) & (reference.real >= bound)
    expected = reference[wanted]
    found = modes.eigenvalues
    condition = modes.condition
    assert found.size == expected.size > 10
    expected = expected[np.argsort(np.abs(expected))]
    assert np.all(np.abs(found - expected) <= 10.0 * condition * EPS * np.abs(expected))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"band": (0.0, 1.0), "near": 1j}, "near: cannot be given together with band"),
        ({"growth": (0.0, None)}, "growth: needs a band"),
        ({"certify": False}, "certify: needs a band"),
        ({"band": (5.0, 1.0)}, r"band: expected \(lowest, highest\)"),
        ({"band": (-1.0, 1.0)}, r"band: expected \(lowest, highest\)"),
        ({"band": (0.0, 1.0, 2.0)}, r"band: expected \(lowest, highest\)"),
        ({"band": (0.0, np.nan)}, "band"),
        ({"band": (0.0, 1.0), "growth": (2.0, 1.0)}, "growth: expected"),
        ({"band": (0.0, 1.0), "growth": 3.0}, "growth: expected"),
        ({"band": (0.0, 1.0), "growth": (1e3, None)}, "growth: no eigenvalue of the band"),
        ({"near": []}, "near: expected one or several"),
        ({"near": np.inf}, "near: expected one or several"),
        ({"near": "fast"}, "near: expected one or several"),
        ({"near": 1j, "count": 0}, "count: expected an integer >= 1"),
    ],
)
def test_ill_posed_questions_are_refused(disc, arguments, message):
    with pytest.raises(ss.InputError, match=message):
        ss.complex_modes(disc, "", **arguments)
