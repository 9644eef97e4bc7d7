"""Bodies of other programs: node numbers, ties, quadratic faces, one triangle, arrays without a place."""

import itertools
from pathlib import Path

import numpy as np
import pytest
import scipy.io
import scipy.sparse

import matrix_files
import stickslip as ss
from stickslip.fe.formats.deck import read_deck

CALCULIX = Path(__file__).parent / "calculix"
FILES = [CALCULIX / f"pad{suffix}" for suffix in (".sti", ".mas", ".dof")]
#: The lower face of the pad, 18 x 8 mm, which is free, and a facet of the upper one, which is held.
FACE = [[1, 5, 6, 2], [2, 6, 7, 3], [3, 7, 8, 4]]
BACK = [[17, 18, 22, 21]]
WHERE = {
    int(row[0]): [float(one) for one in row[1:]]
    for row in (line.split(",") for line in (CALCULIX / "pad.inp").read_text().splitlines()[1:25])
}


@pytest.fixture
def deck(tmp_path):
    """Return a function that writes the deck of the pad changed, and reads it with the matrices."""

    def read(number=lambda node: node, order=None, cards="", drop=()):
        lines = (CALCULIX / "pad.inp").read_text().splitlines()
        nodes = [f"{number(int(one.split(',')[0]))},{one.split(',', 1)[1]}" for one in lines[1:25]]
        cells = [
            ",".join([one.split(",")[0], *(str(number(int(n))) for n in one.split(",")[1:])])
            for one in lines[26:32]
        ]
        rest = [
            f"{number(int(one.split(',')[0]))},{one.split(',', 1)[1]}" if 39 <= k < 47 else one
            for k, one in enumerate(lines)
        ][32:]
        order = range(24) if order is None else order
        path = tmp_path / "pad.inp"
        path.write_text(
            "\n".join([lines[0], *(nodes[k] for k in order), lines[25], *cells, *rest, cards]) + "\n"
        )
        dofs = [(int(node), int(k)) for node, k in (one.split(".") for one in FILES[2].read_text().split())]
        kept = np.array([k for k, dof in enumerate(dofs) if dof not in drop])
        body = ss.fe.read(*FILES[:2], dofs=[f"{node}.{k}" for node, k in dofs])
        stiffness, mass = (matrix[kept][:, kept] for matrix in (body.stiffness, body.mass))
        np.savez(
            tmp_path / "pad.npz", K=stiffness.toarray(), M=mass.toarray(),
            dofs=[f"{number(dofs[k][0])}.{dofs[k][1]}" for k in kept],
        )  # fmt: skip
        return ss.fe.read(tmp_path / "pad.npz", mesh=path, units="m-kg-s")

    return read


@pytest.mark.parametrize(
    ("number", "order"),
    [
        (lambda node: node + 12, None),
        (lambda node: 7 * node, range(23, -1, -1)),
        (lambda node: node, np.random.default_rng(1).permutation(24)),
    ],
    ids=["offset", "reversed", "shuffled"],
)
def test_nodes_of_a_deck_keep_their_numbers(deck, number, order):
    """Points in the order of the file put node 13 of 13 to 48 to the place of node 25."""
    pad = deck(number, order)
    for node, where in WHERE.items():
        surface = pad.surface([number(node)])
        np.testing.assert_array_equal(surface.points, np.array([where]))
    plain = deck()
    face = pad.surface([[number(node) for node in facet] for facet in FACE])
    expected = {
        f"{number(int(node))}.{k}": force
        for (node, k), force in (
            (name.split("."), f) for name, f in plain.surface(FACE).pressure(1.0).items()
        )
    }
    assert face.pressure(1.0) == pytest.approx(expected, rel=1e-14)
    # What is drawn is the same body: every cell has the corners that it had.
    for body in (pad, plain):
        corners = body.points[body.cells["hexahedron"]]
        np.testing.assert_allclose(corners.mean(axis=1)[:, 2].max(), 4.5)
        np.testing.assert_allclose(np.ptp(corners, axis=1), np.tile([6.0, 8.0, 3.0], (6, 1)))


def test_a_deck_of_which_meshio_reads_a_part_is_refused(deck):
    with pytest.raises(ss.InputError, match=r"pad\.inp: the deck has 26 nodes, meshio reads 2; write all"):
        deck(cards="*NODE\n98, 0, 0, 0\n99, 1, 0, 0")


def test_nodes_of_nastran_keep_their_numbers(tmp_path):
    grids = {30: (1.0, 0.0, 0.0), 20: (0.0, 1.0, 0.0), 40: (0.0, 0.0, 0.0), 10: (0.0, 0.0, 1.0)}
    lines = [f"GRID,{node},,{x},{y},{z}" for node, (x, y, z) in grids.items()]
    path = tmp_path / "tet.bdf"
    path.write_text("\n".join(["BEGIN BULK", *lines, "CTETRA,1,1,40,30,20,10", "ENDDATA"]) + "\n")
    dofs = [f"{node}.{k}" for node in (10, 20, 30, 40) for k in (1, 2, 3)]
    np.savez(tmp_path / "a.npz", K=np.eye(12), M=np.eye(12), dofs=dofs)
    body = ss.fe.read(tmp_path / "a.npz", mesh=path)
    for node, where in grids.items():
        assert body.surface([node]).points.tolist() == [list(where)]
    assert body.nodes[body.cells["tetra"]].tolist() == [[40, 30, 20, 10]]


def quadratic(kind):
    """Return points of one distorted cell with straight edges, its number of corners, and its faces."""
    from stickslip.fe.surface import EDGES

    rng = np.random.default_rng(5)
    corners, faces = {
        "tetra10": (np.vstack([np.zeros(3), np.eye(3)]), [[0, 1, 2], [0, 1, 3], [1, 2, 3], [0, 2, 3]]),
        "hexahedron20": (
            np.array(
                [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1.0]]
            ),
            [[0, 1, 2, 3], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]],
        ),
        "triangle6": (np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]), [[0, 1], [1, 2], [2, 0]]),
    }[kind]
    # An affine map keeps faces plane.
    corners = corners @ (np.eye(corners.shape[1]) + 0.2 * rng.standard_normal((corners.shape[1],) * 2))
    return (
        np.vstack([corners, [corners[list(edge)].mean(axis=0) for edge in EDGES[kind]]]),
        len(corners),
        faces,
    )


@pytest.mark.parametrize("kind", ["tetra10", "hexahedron20", "triangle6"])
def test_facets_of_quadratic_elements_have_their_middles(kind):
    points, corners, faces = quadratic(kind)
    count, dimension = points.shape
    cells = {kind: np.arange(1, count + 1)[None]}
    matrices = np.eye(dimension * count), np.eye(dimension * count)
    body = ss.fe.Body(*matrices, points=points, cells=cells)
    surfaces = [body.surface((np.array([face]) + 1).tolist()) for face in faces]
    assert {len(surface) for surface in surfaces} == {3 if dimension == 2 else 2 * len(faces[0])}
    # What bounds a body has no area together, and a pressure on it no resultant and no moment.
    assert sum(surface.areas.sum(axis=0) for surface in surfaces) == pytest.approx(0.0, abs=1e-15)
    moment = np.zeros((dimension, dimension))
    for surface in surfaces:
        moment += surface.points.T @ surface.areas
        # Outward, each node with a share.
        out = surface.points.mean(axis=0) - points[:corners].mean(axis=0)
        assert (surface.areas @ out > 0.0).all()
    # The integral of x n' is the volume.
    assert moment == pytest.approx(np.linalg.det(moment) ** (1.0 / dimension) * np.eye(dimension), abs=1e-14)
    # All nodes of a facet say the same as its corners.
    whole = surfaces[0].numbers[_of_one(surfaces[0], faces[0])]
    again = ss.fe.Body(*matrices, points=points).surface([whole.tolist()])
    assert np.abs(again.areas) == pytest.approx(np.abs(surfaces[0].areas), abs=1e-15)


def _of_one(surface, face):
    """Return the places of the corners of a face in their order, and of the middles between them."""
    places = [int(np.flatnonzero(surface.numbers == corner + 1)[0]) for corner in face]
    ends = list(zip(places, np.roll(places, -1), strict=True))[: None if len(face) > 2 else 1]
    middles = [0.5 * (surface.points[a] + surface.points[b]) for a, b in ends]
    return places + [int(np.linalg.norm(surface.points - one, axis=1).argmin()) for one in middles]


def test_facets_of_corners_alone_are_refused_where_cells_are_unknown():
    points, _, _ = quadratic("tetra10")
    body = ss.fe.Body(np.eye(30), np.eye(30), points=points)
    message = (
        r"\[1 2 3\] has corners only, but node 5 lies in the middle of an edge; give all nodes of its facets"
    )
    with pytest.raises(ss.InputError, match=message):
        body.surface([[1, 2, 3]])
    assert len(body.surface([1, 2, 3, 5])) == 4


def test_a_pad_of_quadratic_elements_rests_on_its_middles():
    points, _, _ = quadratic("tetra10")
    stiffness = 1e6 * (np.eye(30) + np.diag(np.full(29, -0.3), 1) + np.diag(np.full(29, -0.3), -1))
    body = ss.fe.Body(stiffness, np.eye(30), points=points, cells={"tetra10": np.arange(1, 11)[None]})
    face = body.surface([[1, 2, 3]])
    pairs = ss.fe.contact_pairs(face, None, velocity=(1.0, 0.0, 0.0), friction=0.1, gap=-1e-6)
    assert len(pairs) == 6
    assert ss.steady_sliding(ss.fe.assemble(body, pairs)).normal_forces.sum() > 0.0


#: Node 4, a corner of the lower face, follows node 3 along x; its other dofs are missing for the test.
TIED = "*EQUATION\n2\n4,1,1.,3,1,-1.\n"


def test_dofs_that_depend_on_others_do_not_count_as_held(deck):
    pad = deck(cards=TIED, drop=[(4, 1), (4, 2), (4, 3)])
    assert pad.notes[-2:] == (
        "dependent displacements from pad.inp, line 52: *EQUATION on: 1, the solver has eliminated them",
        "dependent displacements of which the weights are not known: 2",
    )
    face = pad.surface(FACE)
    message = r"displacement 4\.[23] is no dof, it depends on others, and how is not known; see body.notes"
    with pytest.raises(ss.InputError, match=f"pressure: {message}"):
        face.pressure(1.0)
    with pytest.raises(ss.InputError, match=f"traction: {message}"):
        face.traction([1.0, 1.0, 0.0])
    with pytest.raises(ss.InputError, match=f"dofs: {message}"):
        pad.held(face)
    with pytest.raises(ss.InputError, match=f"first: pair of node 4: {message}"):
        ss.fe.contact_pairs(face, None, velocity=[1.0, 0.0, 0.0], friction=0.4)
    # Elsewhere nothing changes, and held dofs are held.
    plain = deck()
    two = plain.surface(FACE[:1]).pressure(1.0)
    assert pad.surface(FACE[:1]).pressure(1.0) == two
    assert pad.surface(BACK).pressure(1.0) == plain.surface(BACK).pressure(1.0) == {}
    assert len(ss.fe.contact_pairs(pad.surface(FACE[:1]), None, velocity=[1.0, 0.0, 0.0], friction=0.4)) == 4


def test_rotations_of_a_rigid_body_are_no_displacements(deck):
    pad = deck(cards="*NSET, NSET=TWO\n1, 2\n*RIGID BODY, NSET=TWO, REF NODE=3, ROT NODE=4\n")
    with pytest.raises(ss.InputError, match=r"displacement 4\.[123] is no dof"):
        pad.surface(FACE).pressure(1.0)


def test_sets_and_names_of_boundary_conditions_hold(tmp_path):
    path = tmp_path / "a.inp"
    path.write_text(
        "*NODE, NSET=ALL\n" + "".join(f"{n}, {n}.0, 0.0, 0.0\n" for n in range(1, 7))
        + "*NSET, NSET=Feet, GENERATE\n1, 3, 2\n*NSET, NSET=MORE\nFEET, 5\n"
        + "*BOUNDARY\nMore, 1, 2\n6, ENCASTRE\n*TIE, NAME=A\nP, Q\n"
    )  # fmt: skip
    from stickslip.fe.formats.deck import read_deck

    found = read_deck(path)
    assert found.held == {(n, k) for n, k in itertools.product((1, 3, 5), (1, 2))} | {
        (6, k) for k in range(1, 7)
    }
    assert found.constraints == [("a.inp, line 15: *TIE", "TIE", {"NAME": "A"}, [["P", "Q"]])]


@pytest.mark.parametrize("triangle", [np.triu, np.tril])
@pytest.mark.parametrize("kind", ["mat", "npz", "mtx", "rua"])
@pytest.mark.parametrize("key", ["K", "M", "C"])
def test_one_triangle_is_not_the_matrix(tmp_path, triangle, kind, key):
    """K / 2 and a skew part of the same size: 44 219 instead of 26 658 Hz."""
    body = ss.fe.read(*FILES)
    matrices = {"K": body.stiffness.toarray(), "M": body.mass.toarray()}
    matrices["C"] = 1e-5 * matrices["K"]
    matrices[key] = triangle(matrices[key])
    names = {"K": "stiffness", "M": "mass", "C": "damping"}
    files, arguments = [], {}
    if kind == "mat":
        files = [tmp_path / "a.mat"]
        scipy.io.savemat(files[0], matrices)
    elif kind == "npz":
        files = [tmp_path / "a.npz"]
        np.savez(files[0], **matrices)
    else:
        for name, matrix in matrices.items():
            path = arguments[names[name]] = tmp_path / f"{name}.{kind}"
            if kind == "rua":
                matrix_files.harwell_boeing(path, matrix, symmetric=False)
            else:
                with path.open("wb") as file:
                    scipy.io.mmwrite(file, scipy.sparse.coo_array(matrix), symmetry="general")
    which = "upper" if triangle is np.triu else "lower"
    with pytest.raises(ss.InputError, match=f"{names[key]} is one triangle: .* in the {which} one alone"):
        ss.fe.read(*files, **arguments, dofs=body.dofs)


def test_arrays_without_a_place_are_told(tmp_path):
    body = ss.fe.read(*FILES)
    arrays = {"K": body.stiffness.toarray(), "M": body.mass.toarray(), "D": np.eye(48), "Fex1": np.ones(48)}
    np.savez(tmp_path / "a.npz", **arrays)
    scipy.io.savemat(tmp_path / "a.mat", arrays)
    for name in ("a.npz", "a.mat"):
        with pytest.warns(
            UserWarning, match=rf"{name}: not read: D, Fex1; arrays are known as mass/M/MAA/MGG"
        ):
            found = ss.fe.read(tmp_path / name, dofs=body.dofs)
        assert f"{name}: not read: D, Fex1" in found.notes


def test_names_of_dofs_are_made_once():
    body = ss.fe.read(*FILES, name="pad")
    assert body.names is body.names
    held = body.held([body.names[0]])
    assert held.names == body.names[1:]


#: A set of the lower face, and the same face as S1 of the three lower elements, by a set and by number.
NAMED = """*NSET, NSET=Lower, GENERATE
1, 8, 1
*NSET, NSET=BOTH
LOWER
1, 2
*ELSET, ELSET=ROW, GENERATE
1, 2, 1
*SURFACE, NAME=rubbing
ROW, S1
3, S1
*SURFACE, NAME=NODES, TYPE=NODE
LOWER
*SURFACE, NAME=EDGE, TYPE=NODE
1
2
999
*SURFACE, NAME=SHAFT, TYPE=CYLINDER
START, 0., 1.
*SURFACE, NAME=WHOLE
BLOCK
*SURFACE, NAME=OTHERS
ROW, S1
PAD-1.ROW, S1
*SURFACE, NAME=POINTS, TYPE=NODE
PAD-1.LOWER"""


def test_sets_and_surfaces_of_a_deck_are_surfaces_of_the_body(deck):
    pad = deck(cards=NAMED)
    given = pad.surface(FACE)
    for name in ("LOWER", "BOTH", "RUBBING", "NODES"):
        found = pad.surface(name)
        assert found.numbers.tolist() == [1, 2, 3, 4, 5, 6, 7, 8]
        np.testing.assert_allclose(found.normals, given.normals, atol=1e-15)
        assert found.pressure(2.0) == pytest.approx(given.pressure(2.0), rel=1e-14)
    edge = pad.surface("EDGE")
    assert (edge.numbers.tolist(), edge.facets) == ([1, 2], None)
    assert any(
        note.startswith("not read: surfaces SHAFT, WHOLE, OTHERS, POINTS: neither") for note in pad.notes
    )
    with pytest.raises(ss.InputError, match="unknown 'SHAFT'"):
        pad.surface("SHAFT")


def test_given_surfaces_go_before_those_of_a_deck(tmp_path):
    path = tmp_path / "pad.inp"
    path.write_text((CALCULIX / "pad.inp").read_text() + NAMED + "\n")
    body = ss.fe.read(*FILES, mesh=path, surfaces={"LOWER": BACK})
    assert body.surface("LOWER").numbers.tolist() == [17, 18, 21, 22]
    assert body.surface("RUBBING").numbers.tolist() == [1, 2, 3, 4, 5, 6, 7, 8]


@pytest.mark.parametrize(
    ("kind", "points", "faces"),
    [
        (
            "C3D4",
            [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)],
            {"S1": {1, 2, 3}, "S2": {1, 4, 2}, "S3": {2, 4, 3}, "S4": {3, 4, 1}},
        ),
        (
            "C3D6",
            [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1)],
            {"S1": {1, 2, 3}, "S2": {4, 6, 5}, "S3": {1, 4, 5, 2}, "S4": {2, 5, 6, 3}, "S5": {3, 6, 4, 1}},
        ),
        (
            "C3D8R",
            [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)],
            {
                "S1": {1, 2, 3, 4}, "S2": {5, 8, 7, 6}, "S3": {1, 5, 6, 2},
                "S4": {2, 6, 7, 3}, "S5": {3, 7, 8, 4}, "S6": {4, 8, 5, 1},
            },
        ),
    ],
)  # fmt: skip
def test_faces_of_solid_elements_have_the_numbers_of_the_manual(tmp_path, kind, points, faces):
    """Abaqus 2023, Elements Guide, three-dimensional solid elements: element faces; CalculiX has the same."""
    nodes = [f"{k + 1}, {', '.join(map(str, where))}" for k, where in enumerate(points)]
    element = f"7, {', '.join(str(k + 1) for k in range(len(points)))}"
    cards = [line for face in faces for line in (f"*SURFACE, NAME={face}", f"7, {face}")]
    path = tmp_path / "one.inp"
    path.write_text("\n".join(["*NODE", *nodes, f"*ELEMENT, TYPE={kind}", element, *cards]) + "\n")
    size = 3 * len(points)
    dofs = [f"{node + 1}.{k}" for node in range(len(points)) for k in (1, 2, 3)]
    np.savez(tmp_path / "a.npz", K=np.eye(size), M=np.eye(size), dofs=dofs)
    body = ss.fe.read(tmp_path / "a.npz", mesh=path)
    middle = np.mean(points, axis=0)
    for name, corners in faces.items():
        surface = body.surface(name)
        assert set(surface.numbers.tolist()) == corners
        assert (np.einsum("ij,ij->i", surface.normals, surface.points - middle) > 0.0).all()


def test_a_mesh_that_meshio_cannot_read_is_told(tmp_path):
    """Its own answer is the end of the process."""
    path = tmp_path / "pad.inp"
    path.write_text((CALCULIX / "pad.inp").read_text() + "*NSET, NSET=A, GENERATE\n1, 8\n")
    with pytest.raises(ss.InputError, match=r"pad\.inp: meshio cannot read it"):
        ss.fe.read(*FILES, mesh=path)


def test_an_element_goes_on_in_the_next_line_and_needs_all_its_nodes(tmp_path):
    path = tmp_path / "a.inp"
    head = "*NODE\n1, 0, 0, 0\n*ELEMENT, TYPE=C3D8\n7, 1, 2, 3, 4, 5,\n6, 7"
    path.write_text(f"{head}, 8\n*SURFACE, NAME=UP\n7, S2\n")
    assert read_deck(path).faces == {"UP": [(5, 8, 7, 6)]}
    path.write_text(head)
    with pytest.raises(ss.InputError, match=r"a\.inp, line 3: expected a number and 8 nodes of each C3D8"):
        read_deck(path)
