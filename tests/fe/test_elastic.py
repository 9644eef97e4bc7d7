"""Elastic bodies from meshes: patch test, rigid motions, a bar, a ring that turns, and what is refused."""

import sys

import numpy as np
import pytest
import scipy.linalg
import skfem

import quad_block
import spinning_disc
import stickslip as ss

STEEL = {"young": 210e9, "poisson": 0.3, "density": 7800.0}
KINDS = [skfem.MeshTri, skfem.MeshQuad, skfem.MeshTet, skfem.MeshHex]


def brick(kind, counts=(4, 3, 3), sides=(0.05, 0.03, 0.02), bent=0.2):
    """Return a mesh of a box whose inner points are moved by up to a part of a cell."""
    dimension = 2 if kind in KINDS[:2] else 3
    counts, sides = counts[:dimension], np.array(sides[:dimension])
    mesh = kind.init_tensor(*(np.linspace(0.0, s, n + 1) for s, n in zip(sides, counts, strict=True)))
    inner = mesh.interior_nodes()
    moved = mesh.p.copy()
    shift = np.random.default_rng(1).uniform(-bent, bent, (dimension, inner.size))
    moved[:, inner] += shift * (sides / counts)[:, None]
    return kind(moved, mesh.t)


def by_dof(body, values):
    """Return values (p, d) at points as a vector over the dofs."""
    return np.array([values[int(n) - 1, int(k) - 1] for n, k in (dof.split(".") for dof in body.dofs)])


@pytest.mark.parametrize(
    ("kind", "plane"),
    [(kind, plane) for kind in KINDS[:2] for plane in ("strain", "stress")]
    + [(kind, None) for kind in KINDS[2:]],
)
def test_the_patch_test(kind, plane):
    """A linear displacement has a constant stress: no force inside, and the energy of Hooke's law."""
    mesh = brick(kind)
    dimension = len(mesh.p)
    options, depth = ({}, 1.0) if plane is None else ({"plane": plane, "thickness": 0.01}, 0.01)
    body = ss.fe.Body.elastic(mesh, **STEEL, **options)
    gradient = 1e-3 * np.random.default_rng(2).standard_normal((dimension, dimension))
    moved = by_dof(body, mesh.p.T @ gradient.T)
    force = body.stiffness @ moved
    inside = by_dof(body, np.isin(np.arange(mesh.p.shape[1]), mesh.interior_nodes())[:, None] * np.ones(3))
    assert inside.sum() > 0
    scale = np.abs(force).max()
    assert np.abs(force[inside > 0]).max() < 1e-12 * scale
    young, poisson = STEEL["young"], STEEL["poisson"]
    strain = 0.5 * (gradient + gradient.T)
    first = young * poisson / (1.0 + poisson) / (1.0 - poisson * (1.0 if plane == "stress" else 2.0))
    stress = first * np.trace(strain) * np.eye(dimension) + young / (1.0 + poisson) * strain
    volume = np.prod((0.05, 0.03, 0.02)[:dimension]) * depth
    assert moved @ force == pytest.approx(volume * (stress * strain).sum(), rel=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_rigid_motions_cost_nothing_and_carry_the_whole_mass(kind):
    mesh = brick(kind)
    dimension = len(mesh.p)
    body = ss.fe.Body.elastic(mesh, **STEEL)
    squares = scipy.linalg.eigh(body.stiffness.toarray(), body.mass.toarray(), eigvals_only=True)
    free = 3 if dimension == 2 else 6
    assert np.abs(squares[:free]).max() < 1e-9 * squares[free]
    mass = 7800.0 * np.prod((0.05, 0.03, 0.02)[:dimension])
    points = mesh.p.T
    for axis in range(dimension):
        along = by_dof(body, np.eye(dimension)[axis] * np.ones_like(points))
        assert along @ body.mass @ along == pytest.approx(mass, rel=1e-12)
    # The moment of inertia of a rectangle about its corner; two Gauss points integrate the mass of distorted
    # hexahedra nearly exactly.
    turned = by_dof(body, np.column_stack([-points[:, 1], points[:, 0], 0.0 * points[:, 0]])[:, :dimension])
    assert turned @ body.mass @ turned == pytest.approx(mass * (0.05**2 + 0.03**2) / 3.0, rel=1e-6)


def test_the_first_frequencies_of_a_bar():
    """Held at one end, ``w = c k``, ``k = (2 j - 1) pi / 2 L``; with linear elements of length h
    ``w^2 = 6 (c / h)^2 (1 - cos k h) / (2 + cos k h)``."""
    count, length = 20, 0.2
    mesh = skfem.MeshHex.init_tensor(
        np.linspace(0, length, count + 1), [0.0, 0.01], [0.0, 0.01]
    ).with_defaults()
    body = ss.fe.Body.elastic(mesh, young=70e9, poisson=0.0, density=2700.0)
    # Along its axis alone.
    body = body.held(dof for dof in body.dofs if not dof.endswith(".1"))
    body = body.held(body.surface("left"))
    squares = scipy.linalg.eigh(body.stiffness.toarray(), body.mass.toarray(), eigvals_only=True)
    wave, h = (2 * np.arange(1, 4) - 1) * np.pi / (2 * length), length / count
    speed = np.sqrt(70e9 / 2700.0)
    discrete = 6 * (speed / h) ** 2 * (1 - np.cos(wave * h)) / (2 + np.cos(wave * h))
    np.testing.assert_allclose(squares[:3], discrete, rtol=1e-9)
    np.testing.assert_allclose(np.sqrt(squares[:3]), speed * wave, rtol=(3 * np.pi / 2 / count) ** 2 / 6)


def test_a_rectangle_by_hand():
    """Stiffness and mass of one element in plane strain, integrated without scikit-fem."""
    mesh = skfem.MeshQuad.init_tensor([0.0, 0.004], [0.0, 0.003])
    body = ss.fe.Body.elastic(
        mesh,
        young=quad_block.YOUNG,
        poisson=quad_block.POISSON,
        density=quad_block.DENSITY,
        thickness=quad_block.THICKNESS,
    )
    stiffness, mass = quad_block.element(0.004, 0.003)
    corners = [(0, 0), (1, 0), (1, 1), (0, 1)]
    place = {tuple(point): node for node, point in enumerate(np.round(mesh.p.T / [0.004, 0.003]).astype(int))}
    order = [body.dofs.index(f"{place[corner] + 1}.{k}") for corner in corners for k in (1, 2)]
    for ours, theirs in ((body.stiffness, stiffness), (body.mass, mass)):
        np.testing.assert_allclose(
            ours.toarray()[np.ix_(order, order)], theirs, rtol=0, atol=1e-13 * theirs.max()
        )


def test_a_ring():
    whole = ss.fe.ring((2, 12, 3), (0.06, 0.1), (0.0, 2 * np.pi), (-0.01, 0.02))
    assert (whole.p.shape[1], whole.t.shape[1]) == (3 * 12 * 4, 2 * 12 * 3)
    counts = {name: len(facets) for name, facets in whole.boundaries.items()}
    assert counts == {"inner": 36, "outer": 36, "bottom": 24, "top": 24}
    sector = ss.fe.ring((2, 4, 3), (0.06, 0.1), (-0.3, 0.3), (-0.01, 0.02))
    counts = {name: len(facets) for name, facets in sector.boundaries.items()}
    assert counts == {"inner": 12, "outer": 12, "bottom": 8, "top": 8, "start": 6, "end": 6}
    body = ss.fe.Body.elastic(sector, **STEEL)
    for name, normal in (("start", (-np.sin(0.3), -np.cos(0.3), 0)), ("end", (-np.sin(0.3), np.cos(0.3), 0))):
        np.testing.assert_allclose(body.surface(name).normals, np.tile(normal, (12, 1)), atol=1e-12)
    assert np.hypot(*body.surface("inner").points.T[:2]) == pytest.approx(0.06)
    # The area of a polygon: each of 12 cells stands for a triangle of its angle less that of the hole.
    mass = 7800.0 * 0.03 * 12 * 0.5 * np.sin(np.pi / 6) * (0.1**2 - 0.06**2)
    body = ss.fe.Body.elastic(whole, **STEEL)
    assert body.mass.sum() / 3 == pytest.approx(mass, rel=1e-12)


def test_rotation_is_that_of_matrices_by_hand():
    """Gyroscopic matrix, softening and lumped mass of a spinning disc, assembled without scikit-fem."""
    radial, around, layers = 3, 24, 3
    mesh = ss.fe.ring(
        (radial, around, layers - 1),
        (spinning_disc.INNER, spinning_disc.OUTER),
        (0.0, 2 * np.pi),
        (0.0, spinning_disc.THICKNESS),
    )
    material = {
        "young": spinning_disc.YOUNG,
        "poisson": spinning_disc.POISSON,
        "density": spinning_disc.DENSITY,
    }
    bodies = [
        ss.fe.Body.elastic(mesh, **material, rotation=rotation).lumped()
        for rotation in (None, ss.fe.Rotation(spinning_disc.SPEED))
    ]
    still, turns = (body.held(body.surface("inner")) for body in bodies)
    assert still.gyroscopic is None
    # Both go over radius, angle and height, the hand's with the last one fastest.
    r, angle = np.hypot(*mesh.p[:2]), np.arctan2(mesh.p[1], mesh.p[0]) % (2 * np.pi)
    steps = np.round(angle / (2 * np.pi / around)) % around
    ranks = np.lexsort((np.round(mesh.p[2], 9), steps, np.round(r, 9)))
    kept = [node for node in ranks if r[node] > spinning_disc.INNER * (1 + 1e-9)]
    order = [turns.dofs.index(f"{node + 1}.{k}") for node in kept for k in (1, 2, 3)]
    mass, stiffness, gyroscopic, _ = spinning_disc.disc_matrices(radial, around, layers)
    unmoved = spinning_disc.disc_matrices(radial, around, layers, speed=0.0)[1]
    np.testing.assert_allclose(turns.mass.diagonal()[order], mass, rtol=1e-12)
    for ours, theirs in (
        (turns.gyroscopic, gyroscopic),
        (turns.stiffness - still.stiffness, stiffness - unmoved),
    ):
        # The pad's springs, and rounding of K, cancel in the difference.
        difference = abs(ours[order][:, order] - theirs).max()
        assert difference < 1e-14 * abs(still.stiffness).max() + 1e-12 * abs(gyroscopic).max()
    assert abs(turns.gyroscopic).max() > 1.0


@pytest.mark.parametrize("lumped", [False, True])
def test_waves_of_a_ring_that_turns(lumped):
    """Along the axis alone, in the frame at rest: ``w + n speed`` and ``w - n speed``.

    With cells of the angle h the gyroscopic matrix is too small by (n h)^2 / 6, and so is a consistent mass.
    """
    speed, count = 300.0, 96
    mesh = ss.fe.ring((1, count, 1), (0.09, 0.1), (0.0, 2 * np.pi), (0.0, 0.01))
    found = []
    for rotation in (None, ss.fe.Rotation(speed)):
        body = ss.fe.Body.elastic(mesh, **STEEL, rotation=rotation)
        body = body.lumped() if lumped else body
        body = body.held(dof for dof in body.dofs if not dof.endswith(".3"))
        modes = ss.complex_modes(ss.fe.assemble(body), "", band=(1e3, 18e3))
        values = np.sort(modes.eigenvalues.imag)
        found.append(values)
    still, turning = found
    # Pairs with one, two and three nodal diameters, at rest.
    for waves in (1, 2, 3):
        pair = still[2 * waves - 2 : 2 * waves]
        assert pair[1] == pytest.approx(pair[0], rel=1e-9)
        for sign in (-1, 1):
            wanted = pair[0] + sign * waves * speed
            nearest = turning[np.abs(turning - wanted).argmin()]
            error = (2 * np.pi * waves / count) ** 2 / 6 * waves * speed
            if lumped:
                assert (wanted - nearest) * sign == pytest.approx(error, rel=0.1)
            else:
                assert abs(nearest - wanted) < 0.1 * error


@pytest.mark.parametrize("speed", [300.0, -900.0])
def test_waves_of_a_ring_that_turns_in_its_own_plane(speed):
    """A thin ring bends without extension: ``u_r = -du_t/dangle``.

    With ``u_t = a cos n angle + b sin n angle``
    the kinetic energy of ``u' + speed du/dangle`` is, up to a factor, ``(n^2 + 1)(a'^2 + b'^2)
    + 2 speed n (n^2 - 1)(a' b - a b') + speed^2 (n^2 - 1)^2 (a^2 + b^2)``: with
    ``e = speed (n^2 - 1) / (n^2 + 1)`` the frequencies are ``sqrt(w^2 - e^2) + n e`` and ``... - n e``.
    """
    count, thick, radius = 72, 5e-4, 0.1
    angles, node = 2 * np.pi * np.arange(count) / count, np.arange(count)
    around = np.array([np.cos(angles), np.sin(angles)])
    after = (node + 1) % count
    mesh = skfem.MeshQuad(
        np.hstack([(radius - thick) * around, radius * around]),
        np.array([node, node + count, after + count, after]),
    )
    still, turns = (
        ss.fe.Body.elastic(mesh, **STEEL, plane="stress", rotation=rotation)
        for rotation in (None, ss.fe.Rotation(speed))
    )
    squares = scipy.linalg.eigh(still.stiffness.toarray(), still.mass.toarray(), eigvals_only=True)
    turning = ss.complex_modes(ss.fe.assemble(turns), "").eigenvalues
    for waves in (2, 3):
        # After the free motions, pairs with two, three, ... waves.
        w = np.sqrt(squares[2 * waves - 1 : 2 * waves + 1]).mean()
        e = speed * (waves**2 - 1) / (waves**2 + 1)
        for sign in (-1, 1):
            wanted = np.sqrt(w**2 - e**2) + sign * waves * e
            # What a ring of finite thickness and of straight cells has apart from the thin round one.
            error = thick / radius + (2 * np.pi * waves / count) ** 2 / 6
            assert np.abs(turning - 1j * wanted).min() < error * waves * abs(e)


@pytest.mark.parametrize("speed", [300.0, 3000.0])
def test_damping_in_proportion_to_stiffness_takes_energy_at_every_speed(speed):
    """Inertia softens K, which becomes negative; damping refers to the K of the material."""
    mesh = ss.fe.ring((1, 16, 1), (0.09, 0.1), (0.0, 2 * np.pi), (0.0, 0.01))
    still, turns = (
        ss.fe.Body.elastic(mesh, **STEEL, rotation=rotation, damping=ss.Rayleigh(1e-3, 1e-6))
        for rotation in (None, ss.fe.Rotation(speed))
    )
    # With the gyroscopic matrix, which is skew-symmetric.
    both = ss.complex_modes(ss.fe.assemble(turns), "").damping
    damping = 0.5 * (both + both.T)
    size = np.abs(damping).max()
    assert scipy.linalg.eigvalsh(turns.stiffness.toarray()).min() < -1e-9 * abs(turns.stiffness).max()
    assert scipy.linalg.eigvalsh(damping).min() > 0.0
    np.testing.assert_allclose(
        damping, (1e-3 * still.mass + 1e-6 * still.stiffness).toarray(), rtol=0, atol=1e-13 * size
    )


def test_a_rotation_is_that_about_its_axis():
    points = np.array([[0.3, -0.2, 0.5], [1.0, 0.0, 0.0]])
    axis, centre = np.array([1.0, 2.0, -2.0]), np.array([0.1, 0.2, 0.3])
    expected = 4.0 * np.cross(axis / 3.0, points - centre)
    for length in (1.0, 1e-200, 1e200):
        found = ss.fe.Rotation(4.0, length * axis, list(centre))(points)
        np.testing.assert_allclose(found, expected, rtol=1e-14, atol=1e-15)
    plane = np.array([[1.0, 0.0], [0.0, 2.0]])
    np.testing.assert_allclose(ss.fe.Rotation(2.0)(plane), [[0.0, 2.0], [-4.0, 0.0]])
    np.testing.assert_allclose(
        ss.fe.Rotation(2.0, (0, 0, -3), (1.0, 0.0))(plane), [[0.0, 0.0], [4.0, 2.0]], atol=1e-15
    )
    assert ss.fe.Rotation(2, [0, 0, 1]) == ss.fe.Rotation(2.0)
    assert len({ss.fe.Rotation(2.0, np.array([0, 0, 1])), ss.fe.Rotation(2.0)}) == 1


@pytest.mark.parametrize(
    ("arguments", "points", "told"),
    [
        ((np.nan,), None, "speed: must be finite, got nan"),
        (("5",), None, "speed: expected a real number, got '5'"),
        (
            (1.0, (0, 0, 0)),
            None,
            r"axis: expected a vector of three numbers that is not zero, got \(0, 0, 0\)",
        ),
        ((1.0, (0, 1)), None, r"axis: expected .*, got \(0, 1\)"),
        ((1.0, (0, np.nan, 1)), None, r"axis: expected .*, got \(0, nan, 1\)"),
        ((1.0, "z"), None, "axis: expected real numbers, got"),
        ((1.0, (0, 0, 1), (0.0,)), None, r"centre: expected two or three finite numbers, got \(0.0,\)"),
        ((1.0, (0, 0, 1), (0.0, np.inf)), None, "centre: expected two or three finite numbers, got"),
        ((1.0, (0, 0, 1), (0, 0)), np.zeros((2, 3)), r"centre: expected three numbers for points in space"),
        (
            (1.0, (1, 0, 0)),
            np.zeros((2, 2)),
            r"axis: expected \(0, 0, 1\) or \(0, 0, -1\) for points in the plane",
        ),
        ((1.0, (1, 0, 1)), np.zeros((2, 2)), r"axis: expected .*, got \(1.0, 0.0, 1.0\)"),
        ((1.0,), np.zeros(3), "points: expected a 2-dimensional array"),
        ((1.0,), np.zeros((1, 4)), "points: expected 2 or 3 coordinates each, got 4"),
    ],
)
def test_rotations_that_are_refused(arguments, points, told):
    with pytest.raises(ss.InputError, match=told):
        ss.fe.Rotation(*arguments)(points)


def test_the_mesh_of_a_file_comes_with_its_boundaries(tmp_path):
    mesh = brick(skfem.MeshTet).with_defaults()
    mesh.save(tmp_path / "part.msh", file_format="gmsh")
    body = ss.fe.Body.elastic(skfem.Mesh.load(tmp_path / "part.msh"), **STEEL, name="part")
    assert body.names[0].startswith("part.")
    plain = ss.fe.Body.elastic(mesh, **STEEL)
    assert abs(body.stiffness - plain.stiffness).max() < 1e-12 * abs(plain.stiffness).max()


def loose():
    mesh = skfem.MeshTri()
    return skfem.MeshTri(np.hstack([mesh.p, [[2.0], [2.0]]]), mesh.t)


def flat():
    mesh = skfem.MeshTri()
    return skfem.MeshTri(mesh.p * [[1.0], [0.0]], mesh.t)


def folded(kind):
    """Return four cells, the last of which has two corners exchanged."""
    mesh = brick(kind, (4, 1, 1), bent=0.0)
    cells = mesh.t.copy()
    cells[[0, 1], 3] = cells[[1, 0], 3]
    return kind(mesh.p, cells)


@pytest.mark.parametrize("kind", KINDS)
def test_cells_of_either_hand(kind):
    """A mesh that is a mirror image has the same matrices, with the sign of one direction turned."""
    mesh = brick(kind)
    mirrored = kind(mesh.p * np.r_[-1.0, np.ones(len(mesh.p) - 1)][:, None], mesh.t)
    one, other = (ss.fe.Body.elastic(each, **STEEL) for each in (mesh, mirrored))
    sign = by_dof(one, np.tile(np.r_[-1.0, np.ones(len(mesh.p) - 1)], (mesh.p.shape[1], 1)))
    turned = sign[:, None] * other.stiffness.toarray() * sign
    np.testing.assert_allclose(turned, one.stiffness.toarray(), rtol=0, atol=1e-12 * abs(one.stiffness).max())


@pytest.mark.parametrize(
    ("mesh", "changes", "told"),
    [
        (
            folded(skfem.MeshQuad),
            {},
            "mesh: cell 3 is folded: its corners, points .*, go round the wrong way",
        ),
        (folded(skfem.MeshHex), {}, "mesh: cell 3 is folded"),
        (None, {}, "mesh: expected a MeshTri, MeshQuad, MeshTet or MeshHex of scikit-fem, got NoneType"),
        (skfem.MeshTri2(), {}, "mesh: expected .* got MeshTri2"),
        (skfem.MeshLine(), {}, "mesh: expected .* got MeshLine1"),
        (loose(), {}, "mesh: point 4 is in no cell"),
        (flat(), {}, "mesh: cell 0 has no volume"),
        (skfem.MeshTri(), {"young": 0.0}, "young: must be positive and finite, got 0"),
        (skfem.MeshTri(), {"density": np.inf}, "density: must be positive and finite, got inf"),
        (skfem.MeshTri(), {"poisson": 0.5}, "poisson: must be above -1 and below 0.5, got 0.5"),
        (skfem.MeshTri(), {"plane": "shell"}, "plane: expected 'strain' or 'stress', got 'shell'"),
        (skfem.MeshTri(), {"plane": np.ones(2)}, "plane: expected 'strain' or 'stress', got array"),
        (skfem.MeshTri(), {"thickness": np.ones(2)}, "thickness: expected a real number, got array"),
        (skfem.MeshTri(), {"thickness": -1.0}, "thickness: must be positive and finite, got -1"),
        (skfem.MeshHex(), {"thickness": 1.0}, "plane, thickness: only a mesh in the plane has them"),
        (skfem.MeshHex(), {"rotation": 5.0}, "rotation: expected a Rotation, got"),
        (
            skfem.MeshHex(),
            {"rotation": ss.fe.Rotation(5.0)},
            "rotation: must leave the body where it is, but material leaves it at",
        ),
    ],
)
def test_bodies_that_are_refused(mesh, changes, told):
    with pytest.raises(ss.InputError, match=told):
        ss.fe.Body.elastic(mesh, **{**STEEL, **changes})


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"counts": (2, 12)}, "counts: expected three numbers, got"),
        ({"counts": 3}, "counts: expected three numbers, got 3"),
        ({"counts": np.array(3)}, r"counts: expected three numbers, got array\(3\)"),
        ({"counts": (2, [1, 2], 1)}, "counts: expected an integer >= 1"),
        ({"counts": (2, 0, 1)}, "counts: expected an integer >= 1"),
        ({"counts": (2, 2, 1)}, "counts, angles: a full turn needs at least three cells, got 2"),
        ({"radii": (0.2, 0.1)}, "radii: expected a lower and a higher number, got"),
        ({"radii": (0.0, 0.1)}, "radii: must be positive, got 0"),
        ({"heights": (0.0,)}, "heights: expected a lower and a higher number, got"),
        ({"angles": (0.0, 7.0)}, "angles: must span at most a full turn, got 7"),
    ],
)
def test_rings_that_are_refused(changes, told):
    good = {"counts": (2, 12, 1), "radii": (0.1, 0.2), "angles": (0, 2 * np.pi), "heights": (0, 0.01)}
    with pytest.raises(ss.InputError, match=told):
        ss.fe.ring(**{**good, **changes})


def test_without_scikit_fem(monkeypatch):
    monkeypatch.setitem(sys.modules, "skfem", None)
    for call, wanted in (
        (lambda: ss.fe.Body.elastic(None, **STEEL), "Body.elastic"),
        (lambda: ss.fe.ring((1, 3, 1), (1, 2), (0, 1), (0, 1)), "ring"),
    ):
        with pytest.raises(
            ss.InputError, match=rf"{wanted}: this needs skfem; pip install 'stickslip\[fe\]'"
        ):
            call()
