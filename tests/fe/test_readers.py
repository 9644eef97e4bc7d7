"""Readers against matrices in memory, against CalculiX itself, and against hostile files."""

import sys
from pathlib import Path

import meshio
import numpy as np
import pytest
import scipy.io
import scipy.linalg
import scipy.sparse

import matrix_files
import stickslip as ss

CALCULIX = Path(__file__).parent / "calculix"


@pytest.fixture
def made():
    """A stiffness and a mass of 9 dofs that are sparse and positive definite, and the names of the dofs."""
    rng = np.random.default_rng(4)
    matrices = []
    for scale in (1e9, 1e-3):
        factor = np.where(rng.random((9, 9)) < 0.3, rng.standard_normal((9, 9)), 0.0) + 2.0 * np.eye(9)
        product = factor @ factor.T
        # A product of matrices is symmetric but for rounding.
        matrices.append(scale * (np.tril(product) + np.tril(product, -1).T))
    # As text 12.10 would be 12.1: nodes and directions are not numbers with a point.
    return (*matrices, [f"{node}.{k}" for node in (1, 10, 100) for k in (1, 2, 3)])


def equal(found, expected, digits):
    """Compare to half a unit of the last of `digits` digits of every entry."""
    np.testing.assert_allclose(found.toarray(), expected, rtol=0.51 * 10.0 ** (1 - digits), atol=0.0)


def test_calculix_prints_the_frequencies_of_the_matrices_that_it_stores():
    pad = ss.fe.read(*(CALCULIX / f"pad{suffix}" for suffix in (".sti", ".mas", ".dof")))
    assert pad.size == 48
    assert pad.dofs[:4] == ("1.1", "1.2", "1.3", "2.1")
    assert pad.notes == tuple(
        f"pad.{kind}: upper triangle of 48 x 48 mirrored, {pad_entries(kind)} entries"
        for kind in ("mas", "sti")
    )
    values = scipy.linalg.eigh(pad.stiffness.toarray(), pad.mass.toarray(), eigvals_only=True)[:6]
    lines = [line.split() for line in (CALCULIX / "pad.dat").read_text().splitlines()]
    printed = np.array([float(line[1]) for line in lines if len(line) == 5 and line[0].isdecimal()])
    assert printed.size == 6
    # Seven digits are printed.
    np.testing.assert_allclose(values, printed, rtol=0.51e-6)


def pad_entries(kind):
    found = [line.split() for line in (CALCULIX / f"pad.{kind}").read_text().splitlines()]
    return sum(row[0] != row[1] for row in found if row)


def test_units_and_mesh_of_a_calculix_deck():
    files = [CALCULIX / f"pad{suffix}" for suffix in (".sti", ".mas", ".dof")]
    plain = ss.fe.read(*files)
    pad = ss.fe.read(*files, mesh=CALCULIX / "pad.inp", units="mm-t-s", name="pad")
    equal(pad.stiffness, 1e3 * plain.stiffness.toarray(), 15)
    equal(pad.mass, 1e3 * plain.mass.toarray(), 15)
    assert pad.points.shape == (24, 3)
    np.testing.assert_allclose(np.ptp(pad.points, axis=0), [0.018, 0.008, 0.006])
    # Consistent mass: what moves with the body is 2500 kg/m3 less the part that the held nodes carry.
    along = np.array([dof.endswith(".1") for dof in pad.dofs], dtype=float)
    assert 0.5 * 2500.0 * 864e-9 < along @ (pad.mass @ along) < 2500.0 * 864e-9
    assert pad.names[0] == "pad.1.1"


def test_calculix_files_hold_the_matrices_to_14_digits(made, tmp_path):
    stiffness, mass, dofs = made
    matrix_files.calculix(tmp_path / "a.sti", stiffness)
    matrix_files.calculix(tmp_path / "a.mas", mass)
    matrix_files.names(tmp_path / "a.dof", dofs)
    body = ss.fe.read(tmp_path / "a.sti", tmp_path / "a.mas", tmp_path / "a.dof")
    equal(body.stiffness, stiffness, 14)
    equal(body.mass, mass, 14)
    assert body.dofs == tuple(dofs)


@pytest.mark.parametrize("keep", [np.tril, np.triu, np.array])
def test_matrix_input_in_any_order_of_dofs(made, tmp_path, keep):
    stiffness, mass, dofs = made
    matrix_files.matrix_input(tmp_path / "a_STIF2.mtx", stiffness, dofs, keep)
    # The mass of dofs without mass is not there, and others come in another order.
    mass[4], mass[:, 4] = 0.0, 0.0
    matrix_files.matrix_input(tmp_path / "a_MASS2.mtx", mass, dofs, keep)
    body = ss.fe.read(tmp_path / "a_STIF2.mtx", tmp_path / "a_MASS2.mtx")
    assert body.dofs == tuple(dofs)
    equal(body.stiffness, stiffness, 16)
    equal(body.mass, mass, 16)
    assert ("nothing mirrored" if keep is np.array else "one triangle of 9 x 9 mirrored") in body.notes[1]


def test_constrained_and_internal_dofs_of_matrix_input(made, tmp_path):
    stiffness, mass, _ = made
    dofs = ["-3.1", "1.1", "1.2", "1.3", "2.1", "2.2", "2.3", "7.1", "7.6"]
    stiffness[3, :] = stiffness[:, 3] = 0.0
    stiffness[3, 3] = 1e36
    matrix_files.matrix_input(tmp_path / "a_STIF1.mtx", stiffness, dofs)
    matrix_files.matrix_input(tmp_path / "a_MASS1.mtx", mass, dofs)
    body = ss.fe.read(tmp_path / "a_STIF1.mtx", tmp_path / "a_MASS1.mtx")
    assert body.dofs == tuple(dof for dof in dofs if dof != "1.3")
    assert body.notes[-1] == "1 dofs are constrained (diagonal from 1e+35 on) and left out"
    kept = [k for k in range(9) if k != 3]
    equal(body.mass, mass[np.ix_(kept, kept)], 16)


@pytest.mark.parametrize("kind", ["coordinate", "rsa", "rua", "mtx", "mtx symmetric", "npz", "mat"])
def test_formats_without_names(made, tmp_path, kind):
    stiffness, mass, dofs = made
    files, digits = {}, 16
    for key, matrix in (("stiffness", stiffness), ("mass", mass)):
        suffix = {"coordinate": "mtx", "mtx symmetric": "mtx"}.get(kind, kind)
        files[key] = path = tmp_path / f"{key}.{suffix}"
        if kind == "coordinate":
            matrix_files.coordinate(path, matrix)
        elif kind in ("rsa", "rua"):
            matrix_files.harwell_boeing(path, matrix, kind == "rsa")
        elif kind.startswith("mtx"):
            symmetry = "symmetric" if kind.endswith("symmetric") else "general"
            scipy.io.mmwrite(path, scipy.sparse.coo_array(matrix), symmetry=symmetry, precision=17)
            digits = 17
        elif kind == "npz":
            scipy.sparse.save_npz(path, scipy.sparse.csr_array(matrix))
            digits = 17
        else:
            scipy.io.savemat(path, {key[0].upper().replace("S", "K"): scipy.sparse.csc_array(matrix)})
            digits = 17
    body = ss.fe.read(**files, dofs=dofs)
    equal(body.stiffness, stiffness, digits)
    equal(body.mass, mass, digits)
    mirrored = kind in ("rsa", "mtx symmetric")
    assert all(("nothing mirrored" not in note) == mirrored for note in body.notes)


@pytest.mark.parametrize(("fields", "digits"), [("large", 10), ("free", 16), ("small", 3)])
@pytest.mark.parametrize("symmetric", [True, False])
def test_matrices_that_nastran_punches(made, tmp_path, fields, digits, symmetric):
    stiffness, mass, dofs = made
    path = tmp_path / "pad.pch"
    matrices = {"KAAX": stiffness, "MAAX": mass, "K4AAX": stiffness}
    matrix_files.punch(path, matrices, dofs, fields, symmetric)
    with pytest.warns(UserWarning, match="not read: K4AAX"):
        body = ss.fe.read(path)
    assert body.dofs == tuple(dofs)
    equal(body.stiffness, stiffness, digits)
    equal(body.mass, mass, digits)
    assert any("nothing mirrored" in note for note in body.notes) != symmetric


PUNCHED = "DMIG    KAAX           0       6       2       0\n"
COLUMN = "DMIG*   KAAX                          12               1\n"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (PUNCHED.replace("6       2", "6       4"), "line 1: expected a square or symmetric real matrix"),
        (
            PUNCHED.replace("6       2", "2       2"),
            "line 1: expected a square or symmetric real .* form '2'",
        ),
        (PUNCHED + PUNCHED, "line 2: the matrix KAAX came before"),
        (COLUMN, "line 1: no card before announces the matrix 'KAAX'"),
        (
            PUNCHED + COLUMN.replace("1\n", "7\n"),
            "line 2: expected node and direction 0 to 6, got '12' and '7'",
        ),
        (
            PUNCHED + COLUMN + "*                     12               1           seven\n",
            "line 3: expected a number",
        ),
        (PUNCHED, "the matrix KAAX has no entries"),
    ],
)
def test_damaged_cards_are_refused_with_their_line(tmp_path, text, told):
    path = tmp_path / "pad.pch"
    path.write_text(text)
    with pytest.raises(ss.InputError, match=told):
        ss.fe.read(stiffness=path, mass=path)


def test_matrices_and_mapping_of_ansys(made, tmp_path):
    stiffness, mass, dofs = made
    for name, matrix in (("k", stiffness), ("m", mass)):
        matrix_files.harwell_boeing(tmp_path / f"{name}.matrix", matrix, True)
    matrix_files.mapping(tmp_path / "k.mapping", dofs)
    files = {"stiffness": tmp_path / "k.matrix", "mass": tmp_path / "m.matrix"}
    body = ss.fe.read(**files, dofs=tmp_path / "k.mapping")
    assert body.dofs == tuple(dofs)
    equal(body.stiffness, stiffness, 16)
    text = (tmp_path / "k.mapping").read_text().replace("UX", "TEMP", 1)
    (tmp_path / "k.mapping").write_text(text)
    with pytest.raises(ss.InputError, match=r"k\.mapping, line 2: expected equation 1, a node and one of UX"):
        ss.fe.read(**files, dofs=tmp_path / "k.mapping")


def test_an_archive_holds_all(made, tmp_path):
    stiffness, mass, dofs = made
    np.savez(tmp_path / "a.npz", K=stiffness, M=mass, dofs=dofs)
    scipy.io.savemat(
        tmp_path / "a.mat", {"stiffness": stiffness, "mass": np.diag(mass), "C": 1e-5 * stiffness}
    )
    body = ss.fe.read(tmp_path / "a.npz")
    equal(body.mass, mass, 17)
    assert body.dofs == tuple(dofs)
    body = ss.fe.read(tmp_path / "a.mat", dofs=dofs)
    equal(body.mass, np.diag(np.diag(mass)), 17)
    equal(body.damping, 1e-5 * stiffness, 17)


def test_scipy_reads_the_same_unsymmetric_file(made, tmp_path):
    skewed = made[0] + np.triu(made[0], 1)
    matrix_files.harwell_boeing(tmp_path / "a.rua", skewed, symmetric=False)
    matrix_files.harwell_boeing(tmp_path / "m.rsa", made[1])
    body = ss.fe.read(stiffness=tmp_path / "a.rua", mass=tmp_path / "m.rsa", dofs=made[2])
    peer = scipy.io.hb_read(tmp_path / "a.rua", spmatrix=False).toarray()
    # Halves of sums: one rounding each.
    scale = 4e-16 * np.abs(peer).max()
    np.testing.assert_allclose((body.stiffness + body.circulatory).toarray(), peer, rtol=0, atol=scale)
    assert body.notes[-1].startswith("stiffness: unsymmetric, split into symmetric and skew part")


def test_fortran_numbers(tmp_path):
    """Exponents with D, of three digits without a letter, and fields that touch."""
    text = (
        f"{'t':72}{'K':8}\n{3:14d}{1:14d}{1:14d}{1:14d}{0:14d}\n{'RSA':14}{2:14d}{2:14d}{3:14d}{0:14d}\n"
        f"{'(16I5)':16}{'(16I5)':16}{'(1P,3D11.4)':20}\n    1    3    4\n    1    2    2\n"
        " 1.0000D+05-1.0000D+02 1.0000-101\n"
    )
    (tmp_path / "a.rsa").write_text(text)
    body = ss.fe.read(stiffness=tmp_path / "a.rsa", mass=tmp_path / "a.rsa", dofs=["1.1", "1.2"])
    assert body.stiffness.toarray().tolist() == [[1e5, -100.0], [-100.0, 1e-101]]


STI = "1 1 4.0e+00\n1 2 -1.0e+00\n2 2 3.0e+00\n"
MTX = "%%MatrixMarket matrix coordinate real symmetric\n2 2 3\n1 1 4.0\n2 1 -1.0\n2 2 3.0\n"
INPUT = "1,1, 1,1, 4.0\n1,2, 1,1, -1.0\n1,2, 1,2, 3.0\n"
HB = (
    f"{'t':72}{'K':8}\n{3:14d}{1:14d}{1:14d}{1:14d}{0:14d}\n{'RSA':14}{2:14d}{2:14d}{3:14d}{0:14d}\n"
    f"{'(16I5)':16}{'(16I5)':16}{'(3E12.4)':20}\n    1    3    4\n    1    2    2\n"
    "  4.0000E+00 -1.0000E+00  3.0000E+00\n"
)


@pytest.mark.parametrize(
    ("name", "text", "told"),
    [
        ("a.sti", STI + "1 2 -1.0\n", "line 4: an entry that came before: row 1, column 2"),
        ("a.sti", STI[:-4], "line 3: the file ends in the middle of a line"),
        ("a.sti", "\n".join(STI.split("\n")[:2]) + "\n", "line 2: the file ends without an entry (2, 2)"),
        ("a.sti", "", "line 0: the file ends without an entry (1, 1)"),
        ("a.sti", STI.replace("-1.0e+00", "nan"), "line 2: not finite: row 1, column 2"),
        ("a.sti", STI.replace("-1.0e+00", "-1e999"), "line 2: not finite: row 1, column 2"),
        ("a.sti", STI.replace("1 2", "2 1"), "line 2: in the lower triangle of a file that holds the upper"),
        ("a.sti", STI + "3 3 1.0\n", "line 4: outside a matrix of 2 rows"),
        ("a.sti", STI + "0 2 1.0\n", "line 4: outside a matrix of 2 rows"),
        ("a.sti", STI.replace("1 2", "1.5 2"), "line 2: expected a whole number as row"),
        ("a.sti", STI.replace("1 2 ", "1 2 7 "), "line 2: expected 3 numbers, got '1 2 7 -1.0e+00'"),
        ("a.sti", STI.replace("-1.0e+00", "?"), "line 2: expected 3 numbers, got '1 2 ?'"),
        ("a.sti", "\xff\n", "no text: byte 0"),
        ("a.mtx", MTX + "2 1 -1.0\n", "Line 6: Too many lines in file"),
        ("a.mtx", MTX.replace("2 2 3.0\n", ""), "Truncated file. Expected another 1 lines"),
        ("a.mtx", MTX.replace("2 2 3.0", "2 1 3.0"), "holds an entry twice"),
        ("a.mtx", MTX.replace("2 2 3\n", "9 9 99999\n"), "99999 entries announced, more than the file has"),
        ("a.mtx", MTX.replace("2 2 3\n", "2 3 3\n"), "expected a square matrix of real numbers"),
        ("a.mtx", MTX.replace("2 2 3\n", "3 3 3\n"), "3 rows, but 2 in dofs"),
        ("a.mtx", MTX.replace("-1.0", "nan"), "not finite: row 2, column 1"),
        ("a.mtx", MTX.replace("real", "complex"), "line 1: expected a real matrix, got complex symmetric"),
        ("a.mtx", MTX[:-3], "line 5: the file ends in the middle of a line"),
        ("b.mtx", INPUT + "1,2, 1,1, -1.0\n", "line 4: an entry that came before"),
        ("b.mtx", INPUT.replace("-1.0", "inf"), "line 2: not finite"),
        ("b.mtx", INPUT + "1,9, 1,1, 2.0\n", "line 4: expected a direction 1 to 6, got 9"),
        ("b.mtx", INPUT + "2,1, 1,1, 2.0\n1,1, 1,2, -1.0\n", "line 4: without its mirrored entry"),
        ("b.mtx", INPUT + "2,1, 2,1, 2.0\n", "dof 2.1 is not one of dofs"),
        ("b.mtx", INPUT[:-2], "line 3: the file ends in the middle of a line"),
        ("b.mtx", "\n", "no entries"),
        ("b.mtx", "1,1, 1,1, 1e36\n1,2, 1,2, 1e36\n", "every dof is constrained (diagonal from 1e+35 on)"),
        ("a.rsa", HB[:-14] + "\n", "its head announces 3 numbers in (3E12.4), it has 2"),
        ("a.rsa", HB.replace("    1    2    2\n", "    1    2\n"), "announces 3 numbers in (16I5), it has 2"),
        ("a.rsa", HB.rsplit("\n", 2)[0] + "\n", "its head announces 7 lines, it has 6"),
        ("a.rsa", HB.replace("    1    2    2\n", "    1    1    2\n"), "an entry that came before"),
        ("a.rsa", HB.replace("    1    2    2\n", "    1    2    1\n"), "line 7: in the upper"),
        ("a.rsa", HB.replace("    1    2    2\n", "    1    2    3\n"), "line 7: outside a matrix of 2 rows"),
        ("a.rsa", HB.replace("    1    3    4\n", "    1    4    3\n"), "line 5: pointers of columns"),
        ("a.rsa", HB.replace(" -1.0000E+00", "         nan"), "line 7: not finite"),
        ("a.rsa", HB.replace("RSA", "CSA"), "line 3: expected a real assembled matrix, RSA or RUA"),
        ("a.rsa", HB.replace("(3E12.4)", "(3E12.4"), "line 4: expected a format such as"),
        ("a.rsa", "title\n", "a head of four lines, got 1 lines"),
        ("a.txt", STI, "expected .sti, .mas, .mtx, .rsa, .rua, .hb, .matrix, .npz, .mat, .op4 or .pch"),
    ],
)  # fmt: skip
def test_hostile_files_are_refused_with_file_and_line(tmp_path, name, text, told):
    path = tmp_path / name
    path.write_bytes(text.encode("latin-1"))
    (tmp_path / "good.mas").write_text(STI)
    with pytest.raises(ss.InputError) as error:
        ss.fe.read(stiffness=path, mass=tmp_path / "good.mas", dofs=["1.1", "1.2"])
    assert told in str(error.value)
    assert name in str(error.value)


def test_good_files_of_the_hostile_ones_are_read(tmp_path):
    for name, text in (
        ("a.sti", STI),
        ("a.mtx", MTX),
        ("c.mtx", MTX.replace("2 1 -", "1 2 -")),
        ("b.mtx", INPUT),
        ("a.rsa", HB),
    ):
        (tmp_path / name).write_text(text)
        body = ss.fe.read(stiffness=tmp_path / name, mass=tmp_path / name, dofs=["1.1", "1.2"])
        assert body.stiffness.toarray().tolist() == [[4.0, -1.0], [-1.0, 3.0]]


def test_archives_that_are_damaged_or_hold_something_else(made, tmp_path):
    stiffness, mass, dofs = made
    path = tmp_path / "a.npz"
    np.savez(path, K=stiffness, M=mass)
    whole = path.read_bytes()
    twice = scipy.sparse.coo_array(([1.0, 1.0], ([0, 0], [0, 0])), shape=(9, 9))
    for told, write in (
        ("not readable", lambda: path.write_bytes(whole[: len(whole) // 2])),
        ("not finite: row 1, column 1", lambda: np.savez(path, K=np.nan * stiffness, M=mass)),
        ("expected a square matrix", lambda: np.savez(path, K=stiffness[:4], M=mass)),
        ("expected a square matrix of real numbers", lambda: np.savez(path, K=1j * stiffness, M=mass)),
        ("8 rows, but 9 in", lambda: np.savez(path, K=stiffness, M=mass[:8, :8])),
        ("holds an entry twice", lambda: scipy.sparse.save_npz(path, twice)),
    ):  # fmt: skip
        write()
        with pytest.raises(ss.InputError, match=told):
            ss.fe.read(stiffness=path, mass=path, dofs=dofs)
    with pytest.raises(ss.InputError, match="no such file"):
        ss.fe.read(tmp_path / "none.npz")
    matrix_files.calculix(tmp_path / "a.sti", stiffness)
    with pytest.raises(ss.InputError, match="mass: no file of it"):
        ss.fe.read(tmp_path / "a.sti")
    with pytest.raises(ss.InputError, match=r"stiffness: given by .*a.sti and by .*b.sti"):
        ss.fe.read(tmp_path / "a.sti", tmp_path / "b.sti")


def test_names_of_dofs_are_checked(made, tmp_path):
    stiffness, mass, dofs = made
    matrix_files.calculix(tmp_path / "a.sti", stiffness)
    matrix_files.calculix(tmp_path / "a.mas", mass)
    files = [tmp_path / f"a.{kind}" for kind in ("sti", "mas", "dof")]
    for told, text in (
        ("line 2: 1.1 came before", "1.1\n1.1\n"),
        ("line 1: expected node.direction, got '1.7'", "1.7\n"),
        ("outside a matrix of 8 rows", "".join(f"{dof}\n" for dof in dofs[:8])),
        ("the file ends without an entry (10, 10)", "".join(f"{dof}\n" for dof in [*dofs, "9.1"])),
    ):  # fmt: skip
        files[2].write_text(text)
        with pytest.raises(ss.InputError) as error:
            ss.fe.read(*files)
        assert told in str(error.value)


def test_a_mesh_gives_points(made, tmp_path):
    stiffness, mass, _ = made
    mesh = meshio.Mesh(np.eye(3), [("triangle", [[0, 1, 2]])])
    np.savez(tmp_path / "a.npz", K=stiffness, M=mass)
    body = ss.fe.read(tmp_path / "a.npz", mesh=mesh, units="mm-t-s")
    assert body.dofs == tuple(f"{node}.{k}" for node in (1, 2, 3) for k in (1, 2, 3))
    np.testing.assert_array_equal(body.points, 1e-3 * np.eye(3))
    assert body.cells["triangle"].tolist() == [[0, 1, 2]]


def test_op4_files_need_pyyeti(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyyeti.nastran.op4", None)
    (tmp_path / "pad.op4").write_bytes(b"")
    with pytest.raises(ss.InputError, match=r"pad\.op4: OP4 files are read by pyYeti; pip install pyyeti"):
        ss.fe.read(tmp_path / "pad.op4")


@pytest.mark.parametrize("binary", [True, False])
def test_op4_files_hold_the_matrices(made, tmp_path, binary):
    op4 = pytest.importorskip("pyyeti.nastran.op4")
    stiffness, mass, dofs = made
    skew = 1e3 * (np.tri(9) - np.tri(9).T)
    file = tmp_path / "pad.op4"
    held = {"kaa": scipy.sparse.coo_matrix(stiffness), "maa": mass, "baa": 1e-6 * stiffness + skew}
    op4.write(str(file), held, binary=binary)
    body = ss.fe.read(file, dofs=dofs)
    for found, expected in (
        (body.stiffness, stiffness),
        (body.mass, mass),
        (body.damping, 1e-6 * stiffness),
        (body.gyroscopic, skew),
    ):
        np.testing.assert_allclose(found.toarray(), expected, rtol=0, atol=1e-14 * np.abs(expected).max())
    whole = file.read_bytes()
    for part in (0, 5, len(whole) // 3, len(whole) // 2):
        file.write_bytes(whole[:part])
        with pytest.raises(ss.InputError, match=r"pad\.op4: not readable"):
            ss.fe.read(file, dofs=dofs)
    op4.write(str(file), ["kaa", "kaa"], [stiffness, mass], binary=binary)
    with pytest.raises(ss.InputError, match="holds KAA twice"):
        ss.fe.read(file, dofs=dofs)
    op4.write(str(file), {"kaa": stiffness}, binary=binary)
    with pytest.raises(ss.InputError, match="mass: no file of it"):
        ss.fe.read(file, dofs=dofs)
