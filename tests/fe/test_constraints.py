"""Ties, equations, rigid bodies and local axes of decks: the matrices, and where the nodes go."""

from pathlib import Path

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse
import skfem

import matrix_files
import stickslip as ss
from meshed import elastic

CALCULIX = Path(__file__).parent / "calculix"


def transformation(body, dofs):
    """Return the displacements of nodes as sums of the dofs of a body, (m, n)."""
    place = {name: k for k, name in enumerate(body.names)}
    rows = np.zeros((len(dofs), body.size))
    for row, dof in zip(rows, dofs, strict=True):
        node, direction = map(int, dof.split("."))
        for name, weight in body.displacement("", node, direction).items():
            row[place[name]] += weight
    return rows


def frequencies(body):
    return scipy.linalg.eigh(body.stiffness.toarray(), body.mass.toarray(), eigvals_only=True)


def box(counts, size, low=(0.0, 0.0, 0.0)):
    axes = [np.linspace(a, a + s, n + 1) for a, s, n in zip(low, size, counts, strict=True)]
    return skfem.MeshHex.init_tensor(*axes)


class Model:
    """Blocks one beside the other, without what ties them, and the deck of their mesh."""

    def __init__(self, *meshes):
        bodies = [elastic(mesh) for mesh in meshes]
        self.firsts = np.cumsum([0, *(len(body.points) for body in bodies)])
        self.points = np.concatenate([body.points for body in bodies])
        self.cells = np.concatenate(
            [body.cells["hexahedron"] + first for body, first in zip(bodies, self.firsts, strict=False)]
        )
        self.mass, self.stiffness = (
            scipy.sparse.block_diag([getattr(body, key) for body in bodies]).toarray()
            for key in ("mass", "stiffness")
        )
        self.dofs = [f"{node + 1}.{k}" for node in range(len(self.points)) for k in (1, 2, 3)]

    def nodes(self, where):
        return [k + 1 for k, point in enumerate(self.points) if where(*point)]

    def faces(self, block, where):
        """Return rows "element, face" of the faces of a block whose nodes are all in a place."""
        from stickslip.fe.formats.deck import SOLIDS

        inside = range(self.firsts[block], self.firsts[block + 1])
        return "".join(
            f"{cell + 1}, {side}\n"
            for cell, nodes in enumerate(self.cells)
            if nodes[0] in inside
            for side, corners in SOLIDS[8].items()
            if all(where(*self.points[nodes[corner]]) for corner in corners)
        )

    def deck(self, path, cards):
        path.write_text(
            "*NODE\n"
            + "".join(f"{k + 1}, {x!r}, {y!r}, {z!r}\n" for k, (x, y, z) in enumerate(self.points.tolist()))
            + "*ELEMENT, TYPE=C3D8\n"
            + "".join(
                f"{k + 1}, {', '.join(str(n + 1) for n in cell)}\n" for k, cell in enumerate(self.cells)
            )
            + cards
        )
        return path

    def read(self, folder, cards):
        np.savez(folder / "a.npz", K=self.stiffness, M=self.mass, dofs=self.dofs)
        return ss.fe.read(folder / "a.npz", mesh=self.deck(folder / "a.inp", cards))


def tied(lower, upper, folder, options=""):
    """Return two blocks of 40 x 20 x 20 mm with a tie at half their height, and the model."""
    model = Model(box(lower, (0.04, 0.02, 0.01)), box(upper, (0.04, 0.02, 0.01), (0.0, 0.0, 0.01)))

    def between(x, y, z):
        return abs(z - 0.01) < 1e-9

    cards = (
        f"*SURFACE, NAME=MASTER\n{model.faces(0, between)}*SURFACE, NAME=SLAVE\n{model.faces(1, between)}"
        f"*TIE, NAME=GLUE{options}\nSLAVE, MASTER\n"
    )
    return model.read(folder, cards), model


def test_matrices_of_calculix_are_reduced_by_the_transformation_of_the_deck():
    """A tie, a rigid body, equations, supports along local axes: CalculiX 2.20 has eliminated all of them."""
    joined = ss.fe.read(
        *(CALCULIX / f"joined{suffix}" for suffix in (".sti", ".mas", ".dof")), mesh=CALCULIX / "joined.inp"
    )
    apart = ss.fe.read(*(CALCULIX / f"apart{suffix}" for suffix in (".sti", ".mas", ".dof")))
    assert (
        "dependent displacements from joined.inp, line 43: *TIE on: 42, the solver has eliminated them"
        in joined.notes
    )
    assert "nodes with local axes: 4; the matrices are along global ones" in joined.notes
    rows = transformation(joined, apart.dofs)
    for key in ("stiffness", "mass"):
        expected = getattr(joined, key).toarray()
        found = rows.T @ getattr(apart, key).toarray() @ rows
        # CalculiX writes 14 digits of sums of some 50 entries.
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


def test_blocks_of_matching_meshes_are_one_block(tmp_path):
    body, model = tied((3, 2, 1), (3, 2, 1), tmp_path)
    assert body.size == 3 * 4 * 3 * 3
    assert "dependent displacements from a.inp" in body.notes[-1]
    assert body.notes[-1].endswith("on: 36, eliminated here")
    whole = elastic(box((3, 2, 2), (0.04, 0.02, 0.02)))
    values = frequencies(whole)
    np.testing.assert_allclose(frequencies(body)[6:], values[6:], rtol=1e-10)
    assert body.mass.toarray().sum() == pytest.approx(model.mass.sum(), rel=1e-14)


def rigid_motions(points):
    """Return the six rigid motions of points, (3 p, 6)."""
    shifts = np.tile(np.eye(3), (len(points), 1))
    turns = np.stack([np.cross(axis, points).ravel() for axis in np.eye(3)], axis=1)
    return np.hstack([shifts, turns])


def free_values(body, motion, model):
    """Return the values of the free dofs in a motion of all nodes."""
    place = {dof: k for k, dof in enumerate(model.dofs)}
    return motion[[place[dof] for dof in body.dofs]]


@pytest.mark.parametrize(("lower", "upper"), [((2, 1, 1), (3, 2, 1)), ((2, 2, 1), (4, 4, 2))])
def test_blocks_of_other_meshes_move_as_a_rigid_body_without_force(tmp_path, lower, upper):
    body, model = tied(lower, upper, tmp_path)
    motions = rigid_motions(model.points)
    rows = transformation(body, model.dofs)
    free = free_values(body, motions, model)
    np.testing.assert_allclose(rows @ free, motions, atol=1e-13)
    scale = np.abs(body.stiffness.data).max()
    np.testing.assert_allclose(body.stiffness @ free, 0.0, atol=1e-13 * scale)
    values = frequencies(body)
    assert np.abs(values[:6]).max() < 1e-12 * values[-1] < values[6]


def test_a_tie_to_a_finer_mesh_passes_the_patch_test(tmp_path):
    """A uniform strain needs no forces but those on the outer faces."""
    body, model = tied((2, 2, 1), (4, 4, 2), tmp_path)
    rng = np.random.default_rng(2)
    strained = (model.points @ rng.standard_normal((3, 3))).ravel()
    free = free_values(body, strained, model)
    np.testing.assert_allclose(transformation(body, model.dofs) @ free, strained, atol=1e-14)
    forces = body.stiffness @ free
    inside = [
        k
        for k, dof in enumerate(body.dofs)
        if all(
            1e-9 < x < size - 1e-9
            for x, size in zip(model.points[int(dof.split(".")[0]) - 1], (0.04, 0.02, 0.02), strict=True)
        )
    ]
    assert len(inside) > 3
    np.testing.assert_allclose(forces[inside], 0.0, atol=1e-13 * np.abs(forces).max())


def test_nodes_far_from_the_master_stay_free(tmp_path):
    model = Model(
        box((1, 1, 1), (0.01, 0.01, 0.01)), box((2, 1, 1), (0.02, 0.01, 0.01), (0.0, 0.0, 0.01 + 1e-5))
    )
    low, high = (model.faces(0, lambda x, y, z: z == 0.01), model.faces(1, lambda x, y, z: z == 0.01 + 1e-5))
    cards = f"*SURFACE, NAME=M\n{low}*SURFACE, NAME=S\n{high}*TIE, NAME=T{{}}\nS, M\n"
    body = model.read(tmp_path, cards.format(""))
    assert body.size == 3 * (8 + 12 - 4)
    assert any("*TIE: 2 nodes lie farther than 0.0007" in note for note in body.notes)
    assert any("nodes lie up to 1e-05 off the master surface" in note for note in body.notes)
    none = model.read(tmp_path, cards.format(", POSITION TOLERANCE=1E-6"))
    assert none.size == 3 * 20


def test_two_tied_bodies_are_drawn_with_all_nodes(tmp_path):
    """Displacements that are sums stand behind the dofs of both bodies."""
    bodies, models = [], []
    for k, counts in enumerate([(2, 1, 1), (1, 1, 1)]):
        (tmp_path / str(k)).mkdir()
        body, model = tied(counts, (3, 2, 1), tmp_path / str(k))
        bodies.append(
            ss.fe.Body(
                body.mass,
                body.stiffness,
                points=body.points,
                dofs=body.dofs,
                name=f"b{k}",
                cells={kind: nodes + 1 for kind, nodes in body.cells.items()},
                dependent={
                    f"{node}.{d}": {f"{n}.{j}": w for (n, j), w in weights.items()}
                    for (node, d), weights in body.dependent.items()
                },
            )
        )
        models.append(model)
    scene = ss.fe.assemble(bodies)
    motions = [rigid_motions(model.points) @ np.arange(1.0, 7.0) for model in models]
    position = np.concatenate(
        [
            free_values(body, motion, model)
            for body, motion, model in zip(bodies, motions, models, strict=True)
        ]
    )
    expected = np.concatenate(motions).reshape(-1, 3)
    np.testing.assert_allclose(scene.mesh.displacements(position), expected, atol=1e-13)
    both = np.stack([position, 2j * position])
    np.testing.assert_allclose(scene.mesh.displacements(both)[1], 2j * expected, atol=1e-13)
    assert scene.plot.mesh(1e-4 * position).collections
    assert len(ss.fe.write_vtu(tmp_path / "a.pvd", scene, position)) == 2


def test_an_equation_takes_the_first_displacement_out(tmp_path):
    """Two bodies of 2 and 3 kg at springs of 8 and 5 N/m with u1 = 2 u2: (4 * 8 + 5) / (4 * 2 + 3)."""
    np.savez(tmp_path / "a.npz", K=np.diag([8.0, 5.0]), M=np.diag([2.0, 3.0]), dofs=["1.1", "2.1"])
    (tmp_path / "a.inp").write_text(
        "*NODE\n1, 0., 0., 0.\n2, 1., 0., 0.\n*EQUATION\n2\n1, 1, 1., 2, 1, -2.\n"
    )
    body = ss.fe.read(tmp_path / "a.npz", mesh=tmp_path / "a.inp")
    assert body.dofs == ("2.1",)
    assert frequencies(body)[0] == pytest.approx(37.0 / 11.0, rel=1e-15)
    scene = ss.fe.assemble(body)
    np.testing.assert_allclose(scene.mesh.displacements(np.array([0.5]))[:, 0], [1.0, 0.5])
    held = body.held(["2.1"][:0])
    assert held.displacement("", 1, 1) == {"2.1": 2.0}


def turned(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def test_supports_along_local_axes_are_those_of_the_turned_model(tmp_path):
    """Matrices as Abaqus writes them: at some nodes along local axes, held directions with 1e36."""
    mesh = box((3, 2, 1), (0.04, 0.02, 0.01))
    axes = turned(0.4)
    straight, oblique = Model(mesh), Model(mesh)
    oblique.points = straight.points @ axes
    whole = np.kron(np.eye(len(straight.points)), axes.T)
    for key in ("mass", "stiffness"):
        setattr(oblique, key, whole @ getattr(straight, key) @ whole.T)
    feet = straight.nodes(lambda x, y, z: x == 0.0)
    # Local axis 1 is the x of the straight model.
    local = np.eye(len(straight.dofs))
    for node in feet:
        local[3 * node - 3 : 3 * node, 3 * node - 3 : 3 * node] = axes
    gone = [3 * node - 3 for node in feet] + [3 * node - 2 for node in feet[:2]]
    for key, name in (("mass", "MASS"), ("stiffness", "STIF")):
        matrix = local @ getattr(oblique, key) @ local.T
        if key == "stiffness":
            matrix[gone, gone] = 1e36
        matrix_files.matrix_input(tmp_path / f"a_{name}2.mtx", matrix, oblique.dofs)
    x, y = axes[0], axes[1]
    cards = (
        f"*NSET, NSET=FEET\n{', '.join(map(str, feet))}\n*NSET, NSET=TWO\n{feet[0]}, {feet[1]}\n"
        f"*TRANSFORM, NSET=FEET\n{', '.join(map(repr, [*x.tolist(), *y.tolist()]))}\n"
        "*BOUNDARY\nFEET, 1, 1\nTWO, 2, 2\n"
    )
    files = [tmp_path / "a_STIF2.mtx", tmp_path / "a_MASS2.mtx"]
    body = ss.fe.read(*files, mesh=oblique.deck(tmp_path / "a.inp", cards))
    assert f"nodes with local axes: {len(feet)}; the matrices are along local ones" in body.notes
    kept = np.setdiff1d(np.arange(len(straight.dofs)), gone)
    expected = scipy.linalg.eigh(
        straight.stiffness[np.ix_(kept, kept)], straight.mass[np.ix_(kept, kept)], eigvals_only=True
    )
    np.testing.assert_allclose(frequencies(body), expected, rtol=1e-10, atol=1e-10 * expected[3])
    # A node moves along global axes, and not along what holds it.
    node = feet[-1]
    np.testing.assert_allclose(
        axes[0] @ transformation(body, [f"{node}.{k}" for k in (1, 2, 3)]), 0.0, atol=1e-15
    )


def test_forces_and_contacts_of_dependent_nodes_act_on_what_they_depend_on(tmp_path):
    model = Model(box((1, 1, 1), (0.02, 0.02, 0.01)), box((2, 2, 1), (0.02, 0.02, 0.01), (0.0, 0.0, 0.01)))
    middle = (
        model.faces(0, lambda x, y, z: abs(z - 0.01) < 1e-9),
        model.faces(1, lambda x, y, z: abs(z - 0.01) < 1e-9),
    )
    low = model.nodes(lambda x, y, z: z == 0.0)
    cards = (
        f"*SURFACE, NAME=M\n{middle[0]}*SURFACE, NAME=S\n{middle[1]}*TIE, NAME=T\nS, M\n"
        f"*NODE\n*NSET, NSET=LOW\n{', '.join(map(str, low))}\n"
        f"*MPC\nPIN, {low[0]}, {low[1]}\n"
    ).replace("*NODE\n*NSET", "*NSET")
    body = model.read(tmp_path, cards)
    face = body.surface("LOW")
    loads = face.pressure(1e6)
    assert sum(force for name, force in loads.items() if name.endswith(".3")) == pytest.approx(400.0)
    assert f"{low[0]}.3" not in loads
    pairs = ss.fe.contact_pairs(face, None, velocity=(1.0, 0.0, 0.0), friction=0.3)
    assert [name.partition(".")[0] for name in pairs.contacts[0].normal] == [str(low[1])]
    with pytest.raises(
        ss.InputError, match=rf"dofs: displacement {low[0]}\.1 depends on {low[1]}\.1, which stays"
    ):
        body.held(body.surface([low[0]]))
    held = body.held(face)
    assert held.displacement("", low[0], 1) == {}
    scene = ss.fe.assemble(body)
    motions = rigid_motions(model.points)[:, 1]
    moved = scene.mesh.displacements(free_values(body, motions, model))
    np.testing.assert_allclose(moved, motions.reshape(-1, 3), atol=1e-14)


#: Two grids on the x axis and one beside them, of which the second has a system turned by 90 degrees about z.
BULK = """SOL 103
BEGIN BULK
GRID,1,,0.,0.,0.
GRID,2,,1.,0.,0.,7
GRID,3,,1.,1.,0.
GRID,4,,0.,0.,1.
CORD2R,7,,0.,0.,0.,0.,0.,1.,
,0.,1.,0.
CTETRA,1,1,1,2,3,4
"""


def bulk(folder, cards, stiffness, mass, dofs):
    matrix_files.punch(folder / "a.pch", {"KAAX": stiffness, "MAAX": mass}, dofs)
    (folder / "a.bdf").write_text(BULK + cards + "ENDDATA\n")
    return ss.fe.read(folder / "a.pch", mesh=folder / "a.bdf")


DOFS = [f"{node}.{k}" for node in (1, 2, 3, 4) for k in (1, 2, 3)]


def stiff():
    root = np.random.default_rng(4).integers(-4, 5, (12, 12)).astype(float)
    return root @ root.T + 12.0 * np.eye(12)


def test_local_systems_of_nastran(tmp_path):
    """Direction 1 of grid 2 is y, direction 2 is -x."""
    body = bulk(tmp_path, "", stiff(), np.eye(12), DOFS)
    assert body.dofs == tuple(DOFS)
    turn = np.eye(12)
    turn[3:6, 3:6] = [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    np.testing.assert_allclose(body.stiffness.toarray(), turn.T @ stiff() @ turn, atol=1e-7)
    # Held along its direction 1, it moves along x alone.
    kept = [k for k in range(12) if k != 3]
    part = bulk(tmp_path, "SPC1,1,1,2\n", stiff()[np.ix_(kept, kept)], np.eye(11), [DOFS[k] for k in kept])
    assert part.displacement("", 2, 2) == {}
    np.testing.assert_allclose(frequencies(part), np.linalg.eigvalsh(stiff()[np.ix_(kept, kept)]), rtol=1e-8)


@pytest.mark.parametrize("by_solver", [False, True])
@pytest.mark.parametrize(
    ("card", "relation"),
    [
        ("MPC,1,4,1,1.,1,2,-2.,,\n,,3,3,.5\n", {"4.1": {"1.2": 2.0, "3.3": -0.5}}),
        ("MPC*    1               4               1               1.\n*       2               1"
         "               3.\n",
         {"4.1": {"2.2": -3.0}}),
    ],
)  # fmt: skip
def test_multipoint_constraints_of_nastran(tmp_path, card, relation, by_solver):
    axes = np.eye(12)
    axes[3:6, 3:6] = [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    rows = np.eye(12)[:, [k for k in range(12) if DOFS[k] != "4.1"]]
    ((_, parts),) = relation.items()
    free = [dof for dof in DOFS if dof != "4.1"]
    for dof, weight in parts.items():
        rows[9, free.index(dof)] = weight
    local = axes @ stiff() @ axes.T
    expected = rows.T @ stiff() @ rows
    if by_solver:
        # The solver's own free displacements are along the axes of the grids.
        turn = np.eye(11)
        turn[3:6, 3:6] = axes[3:6, 3:6]
        body = bulk(tmp_path, card, turn @ expected @ turn.T, np.eye(11), free)
    else:
        body = bulk(tmp_path, card, local, np.eye(12), DOFS)
    assert body.dofs == tuple(free)
    assert body.displacement("", 4, 1) == pytest.approx(parts)
    np.testing.assert_allclose(body.stiffness.toarray(), expected, rtol=1e-8, atol=1e-6)


def test_rigid_elements_of_nastran(tmp_path):
    """Grids 2 and 3 move with grid 1, which has rotations; grid 4 is the mean of three others."""
    dofs = [*DOFS, "1.4", "1.5", "1.6"]
    stiffness = np.zeros((15, 15))
    stiffness[:12, :12] = stiff()
    stiffness += np.diag([0.0] * 12 + [1.0] * 3)
    cards = "RBE2,11,1,123,2,THRU,3\nRBE3,12,,4,123,1.,123,1,2,\n,3\n"
    body = bulk(tmp_path, cards, stiffness, np.eye(15), dofs)
    assert body.dofs == ("1.1", "1.2", "1.3", "1.4", "1.5", "1.6")
    points = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    # Where the others are rigid, so is their mean.
    np.testing.assert_allclose(transformation(body, DOFS), rigid_motions(points), atol=1e-12)


@pytest.mark.parametrize(
    ("cards", "told"),
    [
        ("RBE1,5,1,123\n", r"a\.bdf, line 10: RBE1 is not read; write MPC"),
        ("MPC,1,4,1,1.,1,2,-2.\nMPC,2,4,2,1.,1,2,-2.\n", "line 10: MPC has several sets; keep the one"),
        ("RBE3,12,,4,123,1.,123,1,2\n", "line 10: RBE3: its nodes say no rotation; write MPC"),
        ("RBAR,5,1,4,123,456\n", "line 10: RBAR: its independent directions are not those of one node"),
        ("GRID,9,3,0.,0.,0.\n", "line 10: GRID: its point is in the system 3; write points in the basic"),
        ("GRID,9,,0.,0.,0.,8\n", "line 10: GRID: its system of displacements 8 is not read; write CORD2R"),
    ],
)  # fmt: skip
def test_cards_of_nastran_that_are_not_covered_are_refused(tmp_path, cards, told):
    with pytest.raises(ss.InputError, match=told):
        bulk(tmp_path, cards, stiff(), np.eye(12), DOFS)


@pytest.mark.parametrize(
    ("cards", "told"),
    [
        ("*COUPLING, REF NODE=1, SURFACE=S\n", r"line 12: \*COUPLING is not read; write \*EQUATION or"),
        ("*TIE, NAME=T\nP, Q\n", r"line 12: \*TIE: there is no set of nodes 'P'"),
        ("*EQUATION\n2\n1, 1, 1., 2, 11, 1.\n", r"line 12: \*EQUATION: direction 11 of node 2 is no"),
        ("*EQUATION\n2\n1, 1, x, 2, 1, 1.\n", r"line 12: \*EQUATION: expected a number, got 'X'"),
        ("*MPC\nSLIDER, 1, 2, 3\n", r"line 12: \*MPC: SLIDER, 1, 2, 3 is not read; write \*EQUATION"),
        ("*RIGID BODY, ELSET=A, REF NODE=1\n", r"line 12: \*RIGID BODY: name the nodes by NSET="),
        ("*RIGID BODY, NSET=1, REF NODE=2\n", "no dofs rotate the reference node 2; name its ROT NODE"),
        ("*TRANSFORM, NSET=1, TYPE=S\n0,0,0,1,0,0\n", r"line 12: \*TRANSFORM: expected NSET=, TYPE=R or C"),
        ("*NSET, NSET=A\n1\n*TRANSFORM, NSET=A\n1,0,0,2,0,0\n", r"line 14: \*TRANSFORM: .* give no axes"),
        ("*NSET, NSET=A\n1\n*TRANSFORM, NSET=A\n1,0,0,0,1,0\n", "the local axes of nodes .* is not known"),
    ],
)  # fmt: skip
def test_cards_that_are_not_covered_are_refused(tmp_path, cards, told):
    with pytest.raises(ss.InputError, match=told):
        Model(box((1, 1, 1), (1.0, 1.0, 1.0))).read(tmp_path, cards)


def test_a_deck_of_another_run_is_refused(tmp_path):
    model = Model(box((1, 1, 1), (1.0, 1.0, 1.0)))
    kept = [k for k, dof in enumerate(model.dofs) if dof not in ("1.1", "3.1")]
    model.mass, model.stiffness = (matrix[np.ix_(kept, kept)] for matrix in (model.mass, model.stiffness))
    model.dofs = [model.dofs[k] for k in kept]
    applied = "*EQUATION\n2\n1, 1, 1., 2, 1, -1.\n"
    with pytest.raises(ss.InputError, match=r"\*EQUATION: the matrices have all its displacements, although"):
        model.read(tmp_path, applied + "*EQUATION\n2\n4, 1, 1., 2, 1, -1.\n")
    with pytest.raises(
        ss.InputError, match=r"\*EQUATION: displacement 3\.1 is neither a dof of the matrices nor"
    ):
        model.read(tmp_path, "*EQUATION\n2\n1, 1, 1., 3, 1, -1.\n")


def test_relations_that_say_the_same_twice_count_once(tmp_path):
    model = Model(box((1, 1, 1), (1.0, 1.0, 1.0)))
    chain = "2\n1, 1, 1., 2, 1, -1.\n2\n2, 1, 1., 3, 1, -1.\n2\n1, 1, 1., 3, 1, -1.\n"
    body = model.read(tmp_path, f"*EQUATION\n{chain}")
    assert body.size == 22
    assert body.displacement("", 1, 1) == body.displacement("", 2, 1) == {"3.1": 1.0}


def test_two_ties_of_a_node_count_once(tmp_path):
    """A second tie of the slave would hold together what it lies on."""
    model = Model(box((1, 1, 1), (1.0, 1.0, 1.0)), box((1, 1, 1), (1.0, 1.0, 1.0), (0.0, 0.0, 1.0)))
    low, high = (model.faces(k, lambda x, y, z: z == 1.0) for k in (0, 1))
    cards = f"*SURFACE, NAME=M\n{low}*SURFACE, NAME=S\n{high}*TIE, NAME=T\nS, M\n*TIE, NAME=U\nS, M\n"
    assert model.read(tmp_path, cards).size == 3 * 12


def test_multipoint_constraints_of_a_deck(tmp_path):
    """A node between two others, and one at a lever of a node with rotations."""
    dofs = [f"{node}.{k}" for node in (1, 2, 3, 4) for k in (1, 2, 3)] + ["1.4", "1.5", "1.6"]
    np.savez(tmp_path / "a.npz", K=np.eye(15), M=np.eye(15), dofs=dofs)
    (tmp_path / "a.inp").write_text(
        "*NODE\n1, 0., 0., 0.\n2, 4., 0., 0.\n3, 1., 0., 0.\n4, 0., 2., 0.\n"
        "*MPC\nLINEAR, 3, 1, 2\nBEAM, 4, 1\n"
    )
    body = ss.fe.read(tmp_path / "a.npz", mesh=tmp_path / "a.inp")
    assert body.dofs == (*dofs[:6], *dofs[12:])
    assert body.displacement("", 3, 2) == {"1.2": 0.75, "2.2": 0.25}
    assert body.displacement("", 4, 1) == {"1.1": 1.0, "1.6": -2.0}
    assert body.displacement("", 4, 3) == {"1.3": 1.0, "1.4": 2.0}


def test_levers_of_a_plane_model(tmp_path):
    dofs = ["1.1", "1.2", "1.6", "2.1", "2.2"]
    np.savez(tmp_path / "a.npz", K=np.eye(5), M=np.eye(5), dofs=dofs)
    (tmp_path / "a.inp").write_text("*NODE\n1, 0., 0.\n2, 3., 2.\n*MPC\nBEAM, 2, 1\n")
    body = ss.fe.read(tmp_path / "a.npz", mesh=tmp_path / "a.inp")
    assert body.dofs == ("1.1", "1.2", "1.6")
    assert body.displacement("", 2, 1) == {"1.1": 1.0, "1.6": -2.0}
    assert body.displacement("", 2, 2) == {"1.2": 1.0, "1.6": 3.0}
    assert not any("not known" in note for note in body.notes)


def test_cylindrical_axes(tmp_path):
    """Held along the radius, a node at 30 degrees about z moves along the circle and z."""
    c, s = np.cos(np.pi / 6.0), 0.5
    matrix_files.matrix_input(tmp_path / "a_STIF2.mtx", np.diag([1e36, 2.0, 3.0]), ["1.1", "1.2", "1.3"])
    matrix_files.matrix_input(tmp_path / "a_MASS2.mtx", np.eye(3), ["1.1", "1.2", "1.3"])
    (tmp_path / "a.inp").write_text(
        f"*NODE\n1, {float(2.0 * c)!r}, 1., 5.\n*NSET, NSET=A\n1\n*TRANSFORM, NSET=A, TYPE=C\n0,0,0,0,0,1\n"
        "*BOUNDARY\nA, 1\n"
    )
    body = ss.fe.read(tmp_path / "a_STIF2.mtx", tmp_path / "a_MASS2.mtx", mesh=tmp_path / "a.inp")
    assert body.dofs == ("1.2", "1.3")
    np.testing.assert_allclose(frequencies(body), [2.0, 3.0], rtol=1e-14)
    assert body.displacement("", 1, 1) == pytest.approx({"1.2": -s / c})


def test_weights_of_a_body_are_checked():
    matrices = np.eye(2), np.eye(2)
    with pytest.raises(ss.InputError, match=r"dependent: '1\.1' is a dof"):
        ss.fe.Body(*matrices, dofs=["1.1", "2.1"], dependent={"1.1": {"2.1": 1.0}})
    with pytest.raises(ss.InputError, match=r"dependent\['3\.1'\]: '4\.1' is no dof"):
        ss.fe.Body(*matrices, dofs=["1.1", "2.1"], dependent={"3.1": {"4.1": 1.0}})
