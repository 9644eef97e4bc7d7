"""Bodies: what they refuse, surfaces with normals and loads, and the matrices of CalculiX by scikit-fem."""

import itertools
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse
import skfem

import stickslip as ss
from meshed import elastic

CALCULIX = Path(__file__).parent / "calculix"
BOX = np.array([0.018, 0.008, 0.006])


def box(kind, counts=(3, 1, 2)):
    """Return a mesh of a box with its faces named."""
    mesh = kind.init_tensor(*(np.linspace(0.0, side, n + 1) for side, n in zip(BOX, counts, strict=True)))
    return mesh.with_boundaries(
        {
            "low": lambda x: x[2] < 1e-9,
            "top": lambda x: x[2] > BOX[2] - 1e-9,
            "left": lambda x: x[0] < 1e-9,
        }
    )


@pytest.mark.parametrize("mesh", [skfem.MeshHex, skfem.MeshTet])
def test_surfaces_of_a_box_in_space(mesh):
    body = elastic(box(mesh), name="box")
    rng = np.random.default_rng(1)
    for name, outward, area in (
        ("low", [0.0, 0.0, -1.0], BOX[0] * BOX[1]),
        ("top", [0.0, 0.0, 1.0], BOX[0] * BOX[1]),
        ("left", [-1.0, 0.0, 0.0], BOX[1] * BOX[2]),
    ):
        surface = body.surface(name)
        assert len(surface) == {"low": 8, "top": 8, "left": 6}[name]
        np.testing.assert_allclose(surface.normals, np.tile(outward, (len(surface), 1)), atol=1e-14)
        np.testing.assert_allclose(surface.areas.sum(axis=0), area * np.array(outward), atol=1e-18)
        # The load does the work of the pressure on any displacement that is linear in place.
        gradient = rng.standard_normal((3, 3))
        force = surface.pressure(2e6)
        moved = {
            f"box.{node}.{k + 1}": value
            for node, row in zip(body.nodes, body.points @ gradient.T, strict=True)
            for k, value in enumerate(row)
        }
        middle = gradient @ surface.points.mean(axis=0)
        work = sum(value * moved[dof] for dof, value in force.items())
        assert work == pytest.approx(-2e6 * area * middle @ outward, rel=1e-12)
        pulled = surface.traction([1e5, 0.0, 0.0])
        assert sum(pulled.values()) == pytest.approx(1e5 * area, rel=1e-12)
        assert {dof.rsplit(".", 1)[1] for dof in pulled} == {"1"}
    for traction, told in (
        (5.0, "expected a 1-dimensional array"),
        ([1.0, 0.0], "expected 3 components, got 2"),
    ):
        with pytest.raises(ss.InputError, match=f"traction: {told}"):
            surface.traction(traction)


def test_cells_are_in_the_order_of_vtk():
    """Corners 0 to 3 go round one face, counterclockwise seen from 4 to 7, which lie above them."""
    body = elastic(box(skfem.MeshHex))
    corners = body.points[body.cells["hexahedron"]]
    one, other, up = (corners[:, k] - corners[:, 0] for k in (1, 3, 4))
    np.testing.assert_allclose(corners[:, 2], corners[:, 0] + one + other, atol=1e-15)
    np.testing.assert_allclose(corners[:, 4:] - corners[:, :4], np.repeat(up[:, None], 4, axis=1), atol=1e-15)
    volume = np.einsum("ij,ij->i", np.cross(one, other), up)
    np.testing.assert_allclose(volume, BOX.prod() / 6, rtol=1e-12)


@pytest.mark.parametrize("mesh", [skfem.MeshHex, skfem.MeshTet])
def test_faces_bound_the_body(mesh):
    """Their area is that of the box: none is inside, none is missing."""
    shape = elastic(box(mesh)).mesh
    area = 0.0
    for face in shape.faces():
        first, *others = shape.points[face]
        for one, other in itertools.pairwise(others):
            area += 0.5 * np.linalg.norm(np.cross(one - first, other - first))
    assert area == pytest.approx(2 * (BOX[0] * BOX[1] + BOX[1] * BOX[2] + BOX[2] * BOX[0]))


def test_calculix_stores_the_matrices_that_scikit_fem_assembles():
    """The same hexahedra with full integration; CalculiX writes 14 digits in mm, t, s."""
    pad = ss.fe.read(
        *(CALCULIX / f"pad{suffix}" for suffix in (".sti", ".mas", ".dof")),
        mesh=CALCULIX / "pad.inp",
        units="mm-t-s",
    )
    body = elastic(box(skfem.MeshHex))
    body = body.held(body.surface("top"))
    assert body.size == pad.size == 48
    place = {
        tuple(np.round(1e6 * point).astype(int)): node
        for node, point in zip(body.nodes, body.points, strict=True)
    }
    same = []
    for dof in pad.dofs:
        node, direction = dof.split(".")
        point = pad.points[int(node) - 1]
        same.append(body.dofs.index(f"{place[tuple(np.round(1e6 * point).astype(int))]}.{direction}"))
    for name in ("mass", "stiffness"):
        peer, ours = getattr(pad, name), getattr(body, name)[same][:, same]
        assert abs(ours - peer).max() < 1e-13 * abs(peer).max()


def test_a_plane_body_and_held_dofs():
    mesh = skfem.MeshQuad.init_tensor(np.linspace(0, 0.04, 5), np.linspace(0, 0.02, 3))
    mesh = mesh.with_boundaries({"low": lambda x: x[1] < 1e-9, "top": lambda x: x[1] > 0.02 - 1e-9})
    body = elastic(mesh)
    low = body.surface("low")
    np.testing.assert_allclose(low.normals, np.tile([0.0, -1.0], (5, 1)), atol=1e-14)
    assert sum(low.pressure(1e6, thickness=0.01).values()) == pytest.approx(1e6 * 0.04 * 0.01)
    held = body.held(body.surface("top"))
    assert held.size == body.size - 10
    assert held.surface("top").pressure(1e6) == {}
    assert held.mesh.dofs.shape == (15, 2)
    assert (held.mesh.dofs == -1).sum() == 10
    kept = [body.dofs.index(dof) for dof in held.dofs]
    assert abs(held.stiffness - body.stiffness[kept][:, kept]).max() == 0.0
    assert body.held(["1.1"]).dofs == tuple(dof for dof in body.dofs if dof != "1.1")
    # Displacements by point: of held dofs zero.
    shown = held.mesh.displacements(np.arange(1.0, held.size + 1.0))
    assert shown.shape == (15, 2)
    assert (shown == 0.0).sum() == 10
    assert len(held.mesh.faces()) == 8


def test_facets_without_cells_are_taken_as_they_run():
    points = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    surfaces = {"up": [[1, 2, 3, 4]], "down": [[4, 3, 2, 1]], "nodes": [1, 3]}
    body = ss.fe.Body(np.ones(12), np.eye(12), points=points, surfaces=surfaces)
    np.testing.assert_allclose(body.surface("up").normals[0], [0, 0, 1])
    np.testing.assert_allclose(body.surface("down").normals[0], [0, 0, -1])
    assert body.surface("nodes").facets is None
    assert body.surface([2, 4]).numbers.tolist() == [2, 4]
    with pytest.raises(ss.InputError, match="its facets are needed"):
        _ = body.surface("nodes").normals


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"mass": np.ones(5)}, r"mass: expected shape \(4, 4\), got \(5, 5\)"),
        ({"stiffness": np.triu(np.ones((4, 4)))}, "stiffness: must be symmetric, got 1 at .* split A as"),
        ({"stiffness": np.diag([1.0, np.nan, 1.0, 1.0])}, r"stiffness: must be finite, got nan at \(1, 1\)"),
        ({"stiffness": scipy.sparse.csr_array((0, 0)), "mass": []}, "stiffness: expected shape"),
        ({"gyroscopic": np.eye(4)}, "gyroscopic: must be skew-symmetric"),
        ({"dofs": ["1.1", "1.2", "2.1"]}, "dofs: expected 4 names for matrices of 4 rows, got 3"),
        ({"dofs": ["1.1", "1.2", "2.1", "1.1"]}, "dofs: '1.1' names more than one dof"),
        ({"dofs": ["1.1", "1.2", "2.1", "2.10"]}, "dofs: expected names 'node.direction'"),
        ({"dofs": ["1.1", "1.2", "3.1", "3.2"]}, "dofs: '3.1' is of a node without a point"),
        ({"points": [[0.0, 0.0], [1.0, np.inf]]}, "points: must be finite, got .* at node 2"),
        ({"points": [[0.0], [1.0]]}, "points: expected 2 or 3 coordinates per node, got 1"),
        ({"points": None, "dofs": None}, "dofs: names are needed where no points are given"),
        ({"surfaces": {"a": [[1, 5]]}}, r"surfaces\['a'\]: there is no node 5"),
        ({"cells": {"line": [[0.5, 1.0]]}}, r"cells\['line'\]: expected node numbers"),
        ({"name": ""}, "name: expected a text that is not empty"),
    ],
)
def test_what_is_ill_posed_is_refused(changes, told):
    good = {
        "mass": np.ones(4),
        "stiffness": np.eye(4),
        "points": [[0.0, 0.0], [1.0, 0.0]],
        "surfaces": {"a": [[1, 2]], "b": [[1, 2, 1, 2]], "c": [[1, 1]], "e": [[1, 2, 2]]},
    }
    body = ss.fe.Body(**good)
    assert body.dofs == ("1.1", "1.2", "2.1", "2.2")
    with pytest.raises(ss.InputError, match=told):
        ss.fe.Body(**{**good, **changes})
    for name, expected in (
        ("b", "expected facets of 2, 3 nodes, got 4"),
        ("c", "has no area"),
        ("e", "has no area"),
        ("d", "unknown 'd'"),
    ):
        with pytest.raises(ss.InputError, match=expected):
            body.surface(name)


def test_lumped_mass_keeps_the_energy_of_translations():
    """A bar of n elements held at one end, E = rho = A = L = 1, has w_k = 2 n sin((2 k - 1) pi / 4 n)."""
    count = 12
    rows = np.arange(count + 1)
    links = scipy.sparse.diags_array([-1.0, -1.0], offsets=[-1, 1], shape=(count + 1, count + 1))
    stiffness = count * (scipy.sparse.diags_array(np.where((rows == 0) | (rows == count), 1.0, 2.0)) + links)
    mass = (scipy.sparse.diags_array(stiffness.diagonal() / count * 2.0) - links) / (6.0 * count)
    bar = ss.fe.Body(mass, stiffness, dofs=[f"{k}.1" for k in rows]).lumped().held(["0.1"])
    scene = ss.fe.assemble(bar)
    modes = np.arange(1, count + 1)
    expected = 2.0 * count * np.sin((2.0 * modes - 1.0) * np.pi / (4.0 * count))
    found = np.abs(ss.complex_modes(scene, "").eigenvalues)
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    body = elastic(box(skfem.MeshHex))
    lumped = body.lumped().mass
    assert (lumped - scipy.sparse.diags_array(lumped.diagonal())).nnz == 0
    for k in range(3):
        moved = np.array([float(dof.endswith(f".{k + 1}")) for dof in body.dofs])
        assert moved @ lumped @ moved == pytest.approx(moved @ body.mass @ moved, rel=1e-12)


def test_contacts_of_lumped_bodies_are_not_coupled():
    """A consistent mass couples them, but on a plane face no normal with a tangential direction."""
    body = elastic(box(skfem.MeshHex), 1e9, damping=ss.Rayleigh(stiffness=1e-6))
    for made, coupled in ((body, True), (body.lumped(), False)):
        held = made.held(made.surface("top"))
        low = held.surface("low")
        pairs = ss.fe.contact_pairs(low, None, velocity=(1.0, 0.0, 0.0), friction=0.3, gap=1e-6)
        scene = ss.fe.assemble(held, pairs)
        assert len(pairs) == 8
        falling = [-0.5 * dof.endswith(".3") for dof in scene.dofs]
        start = ss.State(np.zeros(scene.size), falling, "dd" * 8, scene.dofs)
        if coupled:
            with pytest.raises(ss.InputError, match="beside contacts that mass couples, in a motion"):
                ss.simulate(scene, 5e-6, start)
            along = ss.fe.contact_pairs(
                low, None, velocity=(1.0, 0.0, 0.0), friction=0.3, gap=1e-6, plane=False
            )
            scene = ss.fe.assemble(held, along)
            start = ss.State(np.zeros(scene.size), falling, "d" * 8, scene.dofs)
            run = ss.simulate(scene, 5e-6, start, max_events=8)
            slips = [scene.tangential_direction(i) for i in range(8)]
            assert "impact" in list(run.events.kind)
            before = run.sample(np.nextafter(run.events.time, 0.0)).velocity.values
            assert np.abs((run.event_states()[1] - before) @ np.transpose(slips)).max() < 1e-9
        else:
            assert "impact" in list(ss.simulate(scene, 5e-6, start).events.kind)


def test_a_mass_without_positive_row_sums_is_not_lumped():
    mass = np.array([[2.0, -3.0], [-3.0, 5.0]])
    with pytest.raises(ss.InputError, match=r"the row of '1.1' sums to -1 kg"):
        ss.fe.Body(mass, np.eye(2), dofs=["1.1", "2.1"]).lumped()
    # Other directions do not count.
    body = ss.fe.Body(mass, np.eye(2), dofs=["1.1", "1.2"]).lumped()
    np.testing.assert_array_equal(body.mass.diagonal(), [2.0, 5.0])
