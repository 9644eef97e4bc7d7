"""Contact pairs and the scenes that they make."""

import pickle

import numpy as np
import pytest
import scipy.sparse

import stickslip as ss
from meshed import block, plate


def field(body, gradient, shift):
    """Return a displacement that is linear in place, over the dofs of a body."""
    moved = body.points @ gradient.T + shift
    place = {int(node): k for k, node in enumerate(body.nodes)}
    return np.array([moved[place[int(d.split(".")[0])], int(d.split(".")[1]) - 1] for d in body.dofs])


@pytest.fixture(scope="module")
def plates():
    """A pad on a larger plate, of meshes that do not fit, 2 um apart."""
    pad = plate((4, 3, 1), (0.02, 0.01, 0.004), (0.003, 0.002, 0.003 + 2e-6), name="pad")
    disc = plate((6, 5, 1), (0.03, 0.02, 0.003), (0.0, 0.0, 0.0), name="disc")
    return pad, disc


def test_a_node_on_a_face_feels_what_the_face_does_there(plates):
    pad, disc = plates
    spin = ss.fe.Rotation(30.0, centre=(0.01, 0.05, 0.0))
    pairs = ss.fe.contact_pairs(pad.surface("bottom"), disc.surface("top"), velocity=spin, friction=0.4)
    assert len(pairs) == 20
    assert pairs.unpaired.size == 0
    np.testing.assert_allclose([c.gap for c in pairs.contacts], 2e-6, rtol=1e-9)
    np.testing.assert_allclose(pairs.normals, np.tile([0, 0, 1.0], (20, 1)), atol=1e-15)
    np.testing.assert_allclose(pairs.areas.sum(), 0.02 * 0.01, rtol=1e-12)
    # Velocity of the disc below each node: across the arm, 30 rad/s times its length.
    arm = pairs.points[:, :2] - [0.01, 0.05]
    speeds = [c.slider_speed for c in pairs.contacts]
    np.testing.assert_allclose(speeds, np.outer(30.0 * np.hypot(*arm.T), [1, 0]), rtol=1e-12)
    np.testing.assert_allclose(
        pairs.tangents[:, :2] * np.hypot(*arm.T)[:, None], arm @ [[0, 1], [-1, 0]], atol=1e-15
    )
    scene = ss.fe.assemble([pad, disc], pairs)
    rng = np.random.default_rng(2)
    for _ in range(3):
        (a, b), (c, d) = rng.standard_normal((2, 3, 3)), rng.standard_normal((2, 3))
        # Bilinear faces carry a linear field exactly; the feet lie 2 um below the nodes.
        x = np.concatenate([field(pad, a, c), field(disc, b, d)])
        below = pairs.points - 2e-6 * pairs.normals
        offset = pairs.points @ a.T + c - below @ b.T - d
        for k in range(len(pairs)):
            across = np.cross(pairs.normals[k], pairs.tangents[k])
            found = (
                scene.normal_direction(2 * k),
                scene.tangential_direction(2 * k),
                scene.tangential_direction(2 * k + 1),
            )
            for direction, own in zip((pairs.normals[k], pairs.tangents[k], across), found, strict=True):
                assert own @ x == pytest.approx(direction @ offset[k], abs=1e-13)


def test_nodes_that_face_nodes_touch_two_dofs_a_direction():
    pad = plate((2, 2, 1), (0.02, 0.02, 0.004), (0.01, 0.01, 0.003), name="pad")
    disc = plate((4, 4, 1), (0.04, 0.04, 0.003), (0.0, 0.0, 0.0), name="disc")
    for other in (disc.surface("top"), disc.surface(disc.surface("top").numbers)):
        pairs = ss.fe.contact_pairs(pad.surface("bottom"), other, velocity=(1.0, 0.0, 0.0), friction=0.4)
        assert len(pairs) == 9
        for contact, node in zip(pairs.contacts, pairs.nodes, strict=True):
            assert contact.gap == 0.0
            assert contact.normal == {f"pad.{node}.3": 1.0} | {
                dof: -1.0 for dof in contact.normal if dof.startswith("disc")
            }
            for direction, axis in zip(contact.tangential, (1, 2), strict=True):
                assert len(direction) == len(contact.normal) == 2
                assert sorted(direction.values()) == [-1.0, 1.0]
                assert all(dof.endswith(f".{axis}") for dof in direction)
    # What hangs over has no partner.
    beyond = plate((2, 2, 1), (0.04, 0.02, 0.004), (0.01, 0.01, 0.003), name="pad")
    pairs = ss.fe.contact_pairs(
        beyond.surface("bottom"), disc.surface("top"), velocity=(1, 0, 0), friction=0.4
    )
    assert (len(pairs), pairs.unpaired.size) == (6, 3)


def test_a_curved_surface_has_no_jumps():
    """A flat plate above a cylinder of facets: its normals are interpolated between nodes."""
    angle = np.linspace(-0.3, 0.3, 7)
    points = np.array([[0.1 * np.sin(a), y, 0.1 * np.cos(a) - 0.1] for y in (0.0, 0.02) for a in angle])
    facets = [[k + 1, k + 2, k + 9, k + 8] for k in range(6)]
    ridge = ss.fe.Body(np.ones(42), np.eye(42), points=points, surfaces={"top": facets}, name="ridge")
    x = np.linspace(-0.02, 0.02, 41)
    above = np.array([[a, 0.01, 1e-4] for a in x])
    pad = ss.fe.Body(np.ones(123), np.eye(123), points=above, name="pad")
    pairs = ss.fe.contact_pairs(
        pad.surface(np.arange(1, 42)), ridge.surface("top"), velocity=(0, 1, 0), friction=0.1
    )
    assert len(pairs) == 41
    # Of the cylinder, which facets of 0.1 rad follow to 0.1^2 / 12.
    sine = x / np.hypot(x, 0.1001)
    np.testing.assert_allclose(pairs.normals[:, 0], sine, atol=0.2 * 0.1**2 / 12)
    gaps = np.array([c.gap for c in pairs.contacts])
    np.testing.assert_allclose(gaps, np.hypot(x, 0.1001) - 0.1, atol=0.1 * (1 - np.cos(0.05)) + 1e-6)


def test_a_block_on_a_belt_is_the_model_by_hand():
    body = block(8, 4)
    pairs = ss.fe.contact_pairs(body.surface("low"), None, velocity=(1.0, 0.0), friction=0.3, gap=-1e-6)
    scene = ss.fe.assemble(body, pairs)
    by_hand = ss.Scene(
        body.mass,
        body.stiffness,
        damping=ss.Rayleigh(stiffness=1e-7),
        contacts=[
            ss.Contact(tangential=f"{n}.1", normal=f"{n}.2", friction=0.3, slider_speed=1.0, gap=-1e-6)
            for n in pairs.nodes
        ],
        dofs=body.dofs,
    )
    one, other = ss.steady_sliding(scene), ss.steady_sliding(by_hand)
    np.testing.assert_allclose(one.position, other.position, rtol=0, atol=1e-18)
    found, expected = (ss.complex_modes(s).eigenvalues[:12] for s in (scene, by_hand))
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_contact_forces_balance_the_pressure(plates):
    """Pad on springs, pressed through its back on a disc that is held below; no friction."""
    disc = plates[1].held(plates[1].surface("bottom"))
    pad = plate((4, 3, 1), (0.02, 0.01, 0.004), (0.003, 0.002, 0.003), name="pad")
    top = pad.surface("top")
    pad = pad.held(top, directions=(1, 2))
    pairs = ss.fe.contact_pairs(pad.surface("bottom"), disc.surface("top"), velocity=(1, 0, 0), friction=0.0)
    pressure = pad.surface("top").pressure(1e6)
    scene = ss.fe.assemble([pad, disc], pairs, force=[pressure, {"pad.1.3": 0.0}])
    steady = ss.steady_sliding(scene)
    forces = steady.contact_forces(scene).normal_force.to_numpy()
    assert forces.sum() == pytest.approx(1e6 * 0.02 * 0.01, rel=1e-9)
    assert (forces > 0.0).all()
    # The same vector by hand.
    vector = ss.fe.assemble([pad, disc], pairs, force=scene.force).force
    np.testing.assert_array_equal(vector, scene.force)


def test_damping_of_bodies(plates):
    pad, disc = plates

    def damped(body, damping):
        return ss.fe.Body(body.mass, body.stiffness, dofs=body.dofs, damping=damping, name=body.name)

    same = ss.fe.assemble([damped(b, ss.Rayleigh(1.0, 1e-7)) for b in (pad, disc)])
    assert same.damping == ss.Rayleigh(1.0, 1e-7)
    assert same.mesh is None
    mixed = ss.fe.assemble([damped(pad, ss.Rayleigh(2.0, 1e-7)), damped(disc, 1e-6 * disc.stiffness)])
    expected = scipy.sparse.block_diag([2.0 * pad.mass + 1e-7 * pad.stiffness, 1e-6 * disc.stiffness])
    assert abs(mixed.damping - expected).max() <= 1e-15 * abs(expected).max()
    one = ss.fe.assemble([pad, damped(disc, ss.Rayleigh(0.0, 1e-7))])
    assert abs(one.damping[: pad.size]).max() == 0.0
    assert ss.fe.assemble([pad, disc], damping=ss.Rayleigh(1.0)).damping == ss.Rayleigh(1.0)
    assert ss.fe.assemble([pad, disc]).damping is None


def test_a_scene_keeps_its_mesh(plates):
    pad, disc = plates
    pairs = ss.fe.contact_pairs(pad.surface("bottom"), disc.surface("top"), velocity=(1, 0, 0), friction=0.4)
    scene = ss.fe.assemble([pad, disc], pairs)
    assert len(scene.mesh.points) == len(pad.points) + len(disc.points)
    assert scene.replace(friction=0.1).mesh is scene.mesh
    assert pickle.loads(pickle.dumps(scene)).mesh.cells["hexahedron"].shape == (12 + 30, 8)
    x = np.arange(float(scene.size))
    for k in (0, 17, scene.size - 1):
        body, node, direction = scene.dofs[k].split(".")
        place = int(node) - 1 + (0 if body == "pad" else len(pad.points))
        assert scene.mesh.displacements(x)[place, int(direction) - 1] == k


def test_what_is_ill_posed_is_refused(plates):
    pad, disc = plates
    low, top = pad.surface("bottom"), disc.surface("top")
    for arguments, told in (
        (((low, top), {"velocity": (0, 0, 1)}), "velocity: .* leaves the surface"),
        (((low, top), {"velocity": (0, 0, 0)}), "velocity: must be finite and not zero"),
        (((low, top), {"velocity": (1, 0)}), "velocity: expected 3 components at each of 20 points"),
        (((low, disc.surface("bottom")), {"reach": 1.0}), "second: faces the same way as first"),
        (((low, top), {"reach": 1e-9}), "none of its nodes faces the second surface"),
        (((pad, top), {}), "first: expected a Surface, got Body"),
        (((low, disc), {}), "second: expected a Surface, or None"),
        (((low, block(2, 1).surface("low")), {}), "second: has another number of coordinates"),
        (((pad.held(low, (3,)).surface("bottom"), None), {}), "all dofs of the pair .* in its normal"),
    ):  # fmt: skip
        surfaces, options = arguments
        with pytest.raises(ss.InputError, match=told):
            ss.fe.contact_pairs(*surfaces, **{"velocity": (1, 0, 0), "friction": 0.4, **options})
    twin = ss.fe.Body(pad.mass, pad.stiffness, dofs=pad.dofs)
    for bodies, options, told in (
        ([], {}, "bodies: expected at least one Body"),
        ([twin, twin], {}, "bodies: '1.1' is a dof of two of them; give them names"),
        ([twin], {"pairs": [3]}, "pairs: expected Pairs or contacts"),
        ([twin], {"force": {"1.9": 1.0}}, "force: unknown dof '1.9'"),
        ([twin], {"force": [1.0]}, r"force: expected shape \(120,\), got \(1,\)"),
    ):
        with pytest.raises(ss.InputError, match=told):
            ss.fe.assemble(bodies, **options)
