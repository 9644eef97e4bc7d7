"""Scene files: exact round trips, and errors that name file, key and value."""

import dataclasses
import os
import pickle
import sys
import tomllib
import zipfile
from functools import partial

import numpy as np
import pytest
import scipy.io
import scipy.sparse
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import stickslip as ss
from stickslip.files.toml_text import toml_text
from stickslip.scene.arrays.matrix_file import read_matrix, write_matrix

NUMBERS = st.floats(allow_nan=False, allow_infinity=False)
NAMES = st.text(st.characters(exclude_categories=["Cs"]), max_size=6)
#: Names of dofs and contacts, which are not blank.
LABELS = NAMES.filter(str.strip)


def identical(first, second):
    """Whether two values are the same to the last bit, of the same kind and shape."""
    if scipy.sparse.issparse(first):
        parts = ("data", "indices", "indptr")
        return (
            isinstance(second, scipy.sparse.csr_array)
            and first.shape == second.shape
            and all(np.array_equal(getattr(first, part), getattr(second, part)) for part in parts)
            and np.array_equal(np.signbit(first.data), np.signbit(second.data))
        )
    if isinstance(first, ss.Contact):
        return all(
            identical(getattr(first, f.name), getattr(second, f.name)) for f in dataclasses.fields(first)
        )
    if isinstance(first, ss.Scene):
        fields = [f.name for f in dataclasses.fields(first) if f.name not in ("core", "model", "contacts")]
        return all(identical(getattr(first, name), getattr(second, name)) for name in fields) and identical(
            resolved(first), resolved(second)
        )
    if isinstance(first, tuple):
        return len(first) == len(second) and all(map(identical, first, second))
    if isinstance(first, np.ndarray | list):
        a, b = np.asarray(first), np.asarray(second)
        return a.shape == b.shape and a.tobytes() == b.tobytes()
    return type(first) is type(second) and first == second


def resolved(scene):
    """The contacts of a scene with the numbers of their dofs, which a file gives by name, as vectors."""
    directions = [
        (scene.tangential_direction(i), scene.normal_direction(i)) for i in range(len(scene.contacts))
    ]
    return tuple(
        dataclasses.replace(contact, tangential=t, normal=n)
        for contact, (t, n) in zip(scene.contacts, directions, strict=True)
    )


@st.composite
def scenes(draw):
    """Scenes with every kind of argument; numbers of any size that the checks of a scene let through."""
    size = draw(st.integers(2, 5))
    scale = draw(st.sampled_from([1e-9, 0.1, 1.0, 3e8]))
    entry = st.floats(-1.0, 1.0)

    def symmetric(diagonal):
        half = draw(arrays(float, (size, size), elements=entry))
        return scale * (half + half.T + diagonal * np.eye(size))

    mass = draw(st.sampled_from(["lumped", "full"]))
    mass = (
        np.abs(draw(arrays(float, size, elements=entry))) + 0.1 if mass == "lumped" else symmetric(3.0 * size)
    )
    stiffness = symmetric(0.0)
    if draw(st.booleans()):
        stiffness = scipy.sparse.csr_array(np.where(np.abs(stiffness) > 0.3 * scale, stiffness, 0.0))
    damping = draw(
        st.sampled_from(
            [
                None,
                ss.Rayleigh(0.1 / 3.0, 1e-5 / 7.0),
                symmetric(2.0),
                scipy.sparse.csr_array(symmetric(2.0)),
            ]
        )
    )
    dofs = draw(st.none() | st.lists(LABELS, min_size=size, max_size=size, unique=True))
    names = dofs or [f"x{i + 1}" for i in range(size)]
    friction = draw(st.floats(0.0, 3.0))
    directions = [
        0,
        names[0],
        np.eye(size)[0] * 1.7,
        [0.6] + [0.0] * (size - 1),
        {names[0]: 0.1 / 3.0},
        {0: 1.7},
    ]
    direction = draw(st.sampled_from(directions))
    contact = ss.Contact(
        tangential=direction,
        normal=draw(st.sampled_from([1, names[1]])),
        friction=friction,
        static_friction=draw(st.sampled_from([None, friction + 0.1])),
        slider_speed=draw(st.floats(-1.0, 1.0)),
        restitution=draw(st.floats(0.0, 1.0)),
        gap=draw(st.floats(-1e-3, 1e-3)),
        name=draw(st.none() | LABELS),
    )
    force = draw(arrays(float, size, elements=NUMBERS))
    contacts = draw(st.sampled_from([(), (contact,)]))
    half = draw(arrays(float, (size, size), elements=entry))
    return ss.Scene(
        mass,
        stiffness,
        damping,
        force,
        contacts,
        dofs,
        draw(st.booleans()) if contacts else False,
        gyroscopic=draw(st.sampled_from([None, scale * (half - half.T)])),
        circulatory=draw(st.sampled_from([None, scale * half, scipy.sparse.csr_array(half)])),
    )


@given(scenes(), st.sampled_from(["auto", "inline", "npz", "mat", "mtx"]))
def test_a_scene_comes_back_exactly(tmp_path_factory, scene, matrices):
    path = tmp_path_factory.mktemp("scene") / "brake.toml"
    if matrices == "mtx":
        # Matrix Market has no negative zero to its reader.
        names = ("mass", "force", "stiffness", "damping", "gyroscopic", "circulatory")
        dense = {name: getattr(scene, name) for name in names}
        scene = scene.replace(**{k: m + 0.0 for k, m in dense.items() if isinstance(m, np.ndarray)})
    ss.save(scene, path, matrices=matrices)
    assert identical(scene, ss.load(path).scene)


TABLES = st.recursive(
    NUMBERS | st.integers() | st.booleans() | NAMES | st.just(float("inf")),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(NAMES, inner, max_size=4),
    max_leaves=12,
)


@given(st.dictionaries(NAMES, TABLES, max_size=5))
def test_any_table_comes_back_from_its_text(tables):
    assert shown(tomllib.loads(toml_text(tables))) == shown(tables)


@given(st.dictionaries(NAMES, TABLES, max_size=4), st.dictionaries(NAMES, TABLES, max_size=4))
def test_any_table_comes_back_from_a_text_that_was_another_one(older, tables):
    assert shown(tomllib.loads(toml_text(tables, toml_text(older)))) == shown(tables)


def test_a_file_that_is_saved_again_keeps_its_comments(tmp_path):
    path = tmp_path / "brake.toml"
    path.write_text(
        "# The brake of the test rig.\n[model]\nname = 'two_subsystems'\nfriction = 0.7 # dry\n"
        "# One stop takes as long.\n[run]\nduration = 1.0 # s\n"
    )
    case = ss.load(path)
    ss.save(dataclasses.replace(case, run={"duration": 2.0, "method": "modal"}), path)
    text = path.read_text()
    for line in ("# The brake of the test rig.", "friction = 0.7 # dry", "duration = 2.0 # s", "# One stop"):
        assert line in text
    assert ss.load(path).run == {"duration": 2.0, "method": "modal"}
    path.write_text("no TOML")
    ss.save(case, path)
    assert ss.load(path).run == {"duration": 1.0}


def test_a_scene_file_of_a_later_version_is_refused(tmp_path):
    path = tmp_path / "brake.toml"
    ss.save(ss.models.two_subsystems(), path)
    text = path.read_text()
    assert "format_version = 1\n" in text
    for version, message in (
        ("2", "reads files up to version 1, got 2; pip install"),
        ("'1'", "expected an"),
    ):
        path.write_text(text.replace("format_version = 1", f"format_version = {version}"))
        with pytest.raises(ss.InputError, match=f"brake.toml: format_version: .*{message}"):
            ss.load(path)


def shown(value):
    """A value as text, to the sign of zero, whatever the order of keys."""
    if isinstance(value, dict):
        return repr(sorted((key, shown(entry)) for key, entry in value.items()))
    return repr([shown(entry) for entry in value] if isinstance(value, list) else value)


@given(
    arrays(float, st.tuples(st.integers(2, 4), st.integers(2, 4)), elements=NUMBERS),
    st.sampled_from(["npz", "mat", "mtx"]),
    st.booleans(),
)
def test_a_matrix_comes_back_exactly(tmp_path_factory, matrix, kind, sparse):
    path = tmp_path_factory.mktemp("matrix") / f"k.{kind}"
    matrix = matrix + 0.0 if kind == "mtx" else matrix
    given_ = scipy.sparse.csr_array(matrix) if sparse else matrix
    write_matrix(path, "stiffness", given_)
    assert identical(given_, read_matrix(path))


def test_sections_come_back(tmp_path):
    path = tmp_path / "case.toml"
    model = partial(ss.models.two_subsystems, friction=(1.5, 0.1 + 0.2), damping=1e-5 / 3)
    start = {"velocity": {"x1": 1e-3, 4: 1 / 3}, "position": [0.0] * 7 + [1e-7]}
    run = {"duration": 0.6, "max_events": 1000, "method": "modal", "time_limit": None}
    sweep = {"friction": {"from": 0.0, "to": 3.0, "count": 301}, "slider_speed": [0.1, 0.3]}
    study = {"samples": 100, "parameters": {"friction": {"distribution": "uniform", "low": 0.3}}}
    case = ss.Case(model, start, run, sweep, study)
    ss.save(case, path)
    again = ss.load(path)
    assert again.model.func is ss.models.two_subsystems
    assert again.model.keywords == {"friction": [1.5, 0.1 + 0.2], "damping": 1e-5 / 3}
    assert again.start == {"velocity": {"x1": 1e-3, "x5": 1 / 3}, "position": start["position"]}
    assert again.run == {"duration": 0.6, "max_events": 1000, "method": "modal"}
    assert (again.sweep, again.study) == (sweep, study)
    assert identical(again.scene, case.scene)
    first, second = case.initial_state(), again.initial_state()
    assert first.velocity.tobytes() == second.velocity.tobytes()
    assert first.position.tobytes() == second.position.tobytes()
    assert again.values()["friction"].tobytes() == np.linspace(0.0, 3.0, 301).tobytes()


def test_a_chain_comes_back(tmp_path):
    parts = [
        ss.models.Subsystem(
            upper_mass=0.3 + i,
            contact_mass=0.3,
            inclination=0.1 * (i + 1),
            vertical_stiffness=4.5e5,
            horizontal_stiffness=3e5,
            ceiling_stiffness=6e4,
            preload_displacement=1e-3,
        )
        for i in range(3)
    ]
    links = [ss.models.Link(horizontal_stiffness=1.5e6, vertical_stiffness=2.4e5)] * 2
    case = ss.Case(partial(ss.models.chain, subsystems=parts, links=links, wall_stiffness=1.8e6))
    ss.save(case, tmp_path / "chain.toml")
    assert identical(ss.load(tmp_path / "chain.toml").scene, case.scene)


def test_a_large_sparse_scene_goes_into_a_file_beside_it(tmp_path):
    size = 3000
    stiffness = scipy.sparse.diags_array([-1.0, 2.0, -1.0], offsets=[-1, 0, 1], shape=(size, size)) * 1e6
    scene = ss.Scene(np.linspace(1.0, 2.0, size), stiffness, contacts=[])
    ss.save(scene, tmp_path / "long.toml")
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"long.toml", "long.mass.npz", "long.stiffness.npz", "long.force.npz"}
    assert identical(scene, ss.load(tmp_path / "long.toml").scene)


def test_a_run_of_a_file_is_that_of_the_scene(tmp_path):
    path = tmp_path / "standard.toml"
    path.write_text(
        '[model]\nname = "two_subsystems"\n[start]\nvelocity = { x1 = 1e-3 }\n[run]\nduration = 0.2\n'
    )
    run = ss.load(path).simulate()
    scene = ss.models.two_subsystems()
    same = ss.simulate(scene, 0.2, ss.steady_sliding(scene).perturbed(velocity={"x1": 1e-3}))
    assert run.events.time.tobytes() == same.events.time.tobytes()
    assert ss.load(path).replace(friction=0.5).scene.contacts[1].friction == 0.5


SCENE = """[scene]
mass = [1.0, 1.0]
stiffness = [[1e4, 0.0], [0.0, 1e4]]
[[scene.contact]]
tangential = "x1"
normal = "x2"
friction = 0.3
"""
MODEL = '[model]\nname = "two_subsystems"\n'


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("mass = [", r"no valid TOML: .*end of document"),
        (SCENE + MODEL, r"expected either \[scene\] or \[model\], got scene, model"),
        ("", r"expected either \[scene\] or \[model\], got neither"),
        (SCENE + "[rnu]\n", r"unknown key 'rnu'; nearest: run"),
        (
            SCENE.replace("friction", "frictoin"),
            r"contact 0: unknown key 'frictoin' \(= 0.3\); nearest: friction",
        ),
        (SCENE.replace("friction = 0.3\n", ""), r"contact 0: friction is missing"),
        (SCENE.replace("0.3", "-0.3"), r"\[scene\]: contact 0: friction: must be >= 0, got -0.3"),
        (SCENE.replace("0.3", '"high"'), r"contact 0: friction: expected a real number, got 'high'"),
        (SCENE.replace('"x1"', '"x3"'), r"contact 0: tangential: unknown dof 'x3'; known: x1, x2"),
        (SCENE.replace("mass = [1.0, 1.0]", 'mass = [1.0, "a"]'), r"mass: expected real numbers"),
        (SCENE.replace("mass = [1.0, 1.0]", 'mass = { file = "m.npz" }'), r"mass: no such file: .*m\.npz"),
        (
            SCENE.replace("mass = [1.0, 1.0]", 'mass = { file = "m.xls" }'),
            r"expected a file .npz, .mat or .mtx",
        ),
        (
            SCENE.replace("mass = [1.0, 1.0]", "mass = { fiel = 1 }"),
            r"mass: expected rows of numbers or a table",
        ),
        (
            SCENE.replace(
                "[[1e4, 0.0], [0.0, 1e4]]", "{ shape = [2, 2], row = [2], column = [0], value = [1] }"
            ),
            r"stiffness: no sparse matrix",
        ),
        (
            SCENE + "[start]\nvelocity = { y1 = 1e-3 }\n",
            r"\[start\]: velocity: unknown dof 'y1'; known: x1",
        ),
        (SCENE + "[start]\nposition = [0.0]\n", r"\[start\]: position: expected shape \(2,\), got \(1,\)"),
        (SCENE + "[start]\ncombination = 3\n", r"\[start\]: combination: expected a string"),
        (SCENE + "[run]\nduratoin = 1.0\n", r"\[run\]: unknown key 'duratoin' \(= 1.0\); nearest: duration"),
        (
            SCENE + '[run]\nmethod = "rk4"\n',
            r"\[run\]: method: expected 'auto', 'modal', 'taylor' or 'local', got 'rk4'",
        ),
        (SCENE + "[sweep]\nfriction = 0.3\n", r"\[sweep\]: friction: expected values or"),
        (SCENE + "[sweep]\nfriction = { from = 0, to = 1 }\n", r"\[sweep\]: friction: count is missing"),
        (SCENE + "[sweep]\nfriction = { from = 0, to = 1, count = 1 }\n", r"count: expected an integer >= 2"),
        (
            MODEL.replace("two_sub", "two_su"),
            r"\[model\]: name: unknown model 'two_susystems'; nearest: two_subsystems",
        ),
        ("[model]\nfriction = 1.0\n", r"\[model\]: name is missing; known: two_subsystems, chain"),
        (MODEL + "frcition = 1.0\n", r"\[model\]: unknown key 'frcition' \(= 1.0\); nearest: friction"),
        (
            MODEL + "friction = [1.0]\n",
            r"\[model\]: friction: expected a scalar or one value per contact \(2\)",
        ),
        (
            MODEL.replace("two_subsystems", "chain") + "wall_stiffness = 1.0\n",
            r"subsystems: expected at least one",
        ),
        (
            MODEL.replace("two_subsystems", "chain")
            + "wall_stiffness = 1.0\n[[model.subsystem]]\nmass = 1\n",
            r"subsystem 0: unknown key 'mass'",
        ),
    ],
)
def test_errors_name_file_key_and_value(tmp_path, text, message):
    path = tmp_path / "brake.toml"
    path.write_text(text)
    with pytest.raises(ss.InputError, match=message) as raised:
        ss.load(path)
    assert str(raised.value).startswith(str(path))


SPARSE = "{ shape = [2, 2], row = [0, 1], column = [0, 1], value = [1e4, true] }"


@pytest.mark.parametrize("matrix", ["[[true, 0.0], [0.0, 1e4]]", SPARSE])
def test_a_truth_value_is_no_stiffness(tmp_path, matrix):
    path = tmp_path / "brake.toml"
    path.write_text(SCENE.replace("[[1e4, 0.0], [0.0, 1e4]]", matrix))
    with pytest.raises(
        ss.InputError, match=r"stiffness: .*expected real numbers, got a truth value in \[.*True"
    ):
        ss.load(path)


def test_a_file_that_begins_with_the_mark_of_its_byte_order(tmp_path):
    path = tmp_path / "brake.toml"
    path.write_text(SCENE.replace("\n", "\r\n"), encoding="utf-8-sig", newline="")
    assert path.read_bytes().startswith(b"\xef\xbb\xbf[scene]\r\n")
    assert ss.load(path).scene.stiffness.tolist() == [[1e4, 0.0], [0.0, 1e4]]


@pytest.mark.parametrize("value", ["[" * 20_000 + "]" * 20_000, "1" * 5000], ids=["deep", "long"])
def test_toml_that_python_cannot_read(tmp_path, value):
    path = tmp_path / "brake.toml"
    path.write_text(f"{SCENE}[start]\nposition = {value}\n")
    with pytest.raises(ss.InputError, match=r"brake\.toml: no valid TOML: "):
        ss.load(path)


@pytest.mark.skipif(sys.platform == "win32", reason="pipes with a name")
@pytest.mark.parametrize(
    ("name", "reader"),
    [
        ("brake.toml", ss.load),
        ("a.nc", ss.load),
        ("a.npz", read_matrix),
        ("a.sti", lambda path: ss.fe.read(path, mass=path)),
        ("a.npz", ss.fe.read),
    ],
)
def test_only_regular_files_are_read(tmp_path, name, reader):
    """Opening a pipe waits for a writer that never comes."""
    os.mkfifo(tmp_path / name)
    with pytest.raises(
        ss.InputError, match=f"{name}: (expected a regular|no such) file|no such file: .*{name}"
    ):
        reader(tmp_path / name)


def test_a_missing_or_binary_file(tmp_path):
    with pytest.raises(ss.InputError, match=r"none\.toml: No such file"):
        ss.load(tmp_path / "none.toml")
    (tmp_path / "b.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ss.InputError, match=r"b\.toml: no valid TOML"):
        ss.load(tmp_path / "b.toml")
    with pytest.raises(ss.InputError, match=r"Is a directory"):
        ss.load(tmp_path)


class Trap:
    """Raises when it is unpickled."""

    def __reduce__(self):
        return (exec, ("raise SystemExit('unpickled')",))


def test_hostile_matrix_files(tmp_path):
    np.savez(tmp_path / "trap.npz", mass=np.array([Trap(), 1.0], dtype=object))
    with pytest.raises(ss.InputError, match=r"trap\.npz: not readable as \.npz: Object arrays"):
        read_matrix(tmp_path / "trap.npz")
    np.savez(tmp_path / "two.npz", K=np.eye(2), M=np.eye(2))
    with pytest.raises(ss.InputError, match=r"two\.npz: holds K, M; say which"):
        read_matrix(tmp_path / "two.npz", default="stiffness")
    with pytest.raises(ss.InputError, match=r"two\.npz: holds no 'k'"):
        read_matrix(tmp_path / "two.npz", "k")
    assert np.array_equal(read_matrix(tmp_path / "two.npz", default="K"), np.eye(2))
    np.savez(tmp_path / "text.npz", K=np.array(["a"]))
    with pytest.raises(ss.InputError, match=r"'K' does not hold real numbers"):
        read_matrix(tmp_path / "text.npz")
    scipy.io.savemat(tmp_path / "cells.mat", {"K": {"a": 1.0}})
    with pytest.raises(ss.InputError, match=r"'K' does not hold real numbers"):
        read_matrix(tmp_path / "cells.mat")
    for kind in ("npz", "mat", "mtx"):
        (tmp_path / f"cut.{kind}").write_bytes(b"PK\x03\x04 cut")
        with pytest.raises(ss.InputError, match=rf"cut\.{kind}: not readable"):
            read_matrix(tmp_path / f"cut.{kind}")
    (tmp_path / "a.mtx").touch()
    with pytest.raises(ss.InputError, match="a Matrix Market file has no names"):
        read_matrix(tmp_path / "a.mtx", "K")


def sparse_text(size):
    return f"{{ shape = [{size}, {size}], row = [], column = [], value = [] }}"


def bomb(path, **arrays):
    """Write an archive whose arrays are headers alone: nothing of them can be read."""
    with zipfile.ZipFile(path, "w") as archive:
        for name, (shape, kind) in arrays.items():
            with archive.open(f"{name}.npy", "w") as file:
                header = {"descr": kind, "fortran_order": False, "shape": shape}
                np.lib.format.write_array_header_1_0(file, header)


HUGE = 400_000_000


@pytest.mark.parametrize("named", [True, False], ids=["dofs", "no names"])
@pytest.mark.parametrize(
    "matrix",
    [sparse_text(HUGE), '{ file = "huge.mtx" }', '{ file = "huge.npz" }', '{ file = "sparse.npz" }'],
    ids=["toml", "mtx", "npz", "sparse"],
)
@pytest.mark.parametrize("rows", [True, False], ids=["rows beside", "alone"])
def test_sizes_are_compared_before_anything_is_made(tmp_path, monkeypatch, named, matrix, rows):
    """100 bytes of text took 33 s and 6.2 GB, a file of 70 bytes 17 s and 4.6 GB."""
    (tmp_path / "huge.mtx").write_text(
        f"%%MatrixMarket matrix coordinate real general\n{HUGE} {HUGE} 1\n1 1 1.0\n"
    )
    bomb(tmp_path / "huge.npz", mass=((HUGE, 4), "<f8"), stiffness=((HUGE, HUGE), "<f8"))
    (tmp_path / "sparse.npz").write_bytes(b"")
    scipy.sparse.save_npz(tmp_path / "small.npz", scipy.sparse.csr_array(np.eye(2)))
    with (
        zipfile.ZipFile(tmp_path / "small.npz") as small,
        zipfile.ZipFile(tmp_path / "sparse.npz", "w") as out,
    ):
        for name in small.namelist():
            with small.open(name) as file:
                content = file.read()
            if name == "shape.npy":
                content = content[:-16] + np.array([HUGE, HUGE]).tobytes()
            out.writestr(name, content)
    text = SCENE.replace("[[1e4, 0.0], [0.0, 1e4]]", matrix)
    if named:
        text = text.replace("mass =", 'dofs = ["x1", "x2"]\nmass =')
    if not rows:
        text = text.replace("mass = [1.0, 1.0]", f"mass = {sparse_text(HUGE)}")
    path = tmp_path / "brake.toml"
    path.write_text(text)
    for module, name in ((scipy.io, "mmread"), (scipy.sparse, "load_npz"), (scipy.sparse, "csr_array")):
        monkeypatch.setattr(module, name, lambda *_, **__: pytest.fail("an array has been made"))
    monkeypatch.setattr(np.lib.format, "read_array", only_small(np.lib.format.read_array))
    message = (
        r"\[scene\]: .*(expected \d+ rows, one per dof, got shape|\d+ rows, but \d+ entries in all matrices)"
    )
    with pytest.raises(ss.InputError, match=message):
        ss.load(path)


def only_small(read):
    def checked(file, *arguments, **options):
        array = read(file, *arguments, **options)
        assert array.size <= 2
        return array

    return checked


def test_only_the_array_that_is_asked_for_is_unpacked(tmp_path):
    """1.9 MB of which one number was asked for took 18 s and 2.0 GB."""
    np.savez(tmp_path / "a.npz", K=np.eye(2))
    bomb(tmp_path / "bomb.npz", M=((HUGE, HUGE), "<f8"))
    with zipfile.ZipFile(tmp_path / "a.npz", "a") as archive:
        archive.writestr("M.npy", zipfile.ZipFile(tmp_path / "bomb.npz").read("M.npy"))
    assert read_matrix(tmp_path / "a.npz", "K").tolist() == [[1.0, 0.0], [0.0, 1.0]]
    scipy.io.savemat(tmp_path / "a.mat", {"K": np.eye(2), "words": ["a"]})
    assert read_matrix(tmp_path / "a.mat", "K").tolist() == [[1.0, 0.0], [0.0, 1.0]]


def test_more_entries_than_there_can_be_are_refused(tmp_path):
    bomb(
        tmp_path / "a.npz",
        data=((HUGE,), "<f8"),
        indices=((HUGE,), "<i4"),
        indptr=((3,), "<i4"),
        format=((), "|S3"),
    )
    with zipfile.ZipFile(tmp_path / "a.npz", "a") as archive, archive.open("shape.npy", "w") as file:
        np.lib.format.write_array(file, np.array([2, 2]))
    with pytest.raises(ss.InputError, match=rf"a\.npz: holds {HUGE} entries of a matrix 2 x 2"):
        read_matrix(tmp_path / "a.npz")
    path = tmp_path / "a.mtx"
    path.write_text(f"%%MatrixMarket matrix coordinate real general\n2 2 {HUGE}\n1 1 1.0\n")
    with pytest.raises(
        ss.InputError, match=rf"a\.mtx: {HUGE} entries announced, more than the file has bytes"
    ):
        read_matrix(path)


@pytest.mark.parametrize("places", ["[0, 0.5]", "[0, true]"])
def test_rows_of_entries_are_whole_numbers(tmp_path, places):
    path = tmp_path / "brake.toml"
    matrix = SPARSE.replace("true", "1e4").replace("[0, 1]", places, 1)
    path.write_text(SCENE.replace("[[1e4, 0.0], [0.0, 1e4]]", matrix))
    with pytest.raises(ss.InputError, match=r"stiffness: .*row: expected"):
        ss.load(path)


def test_a_model_that_a_file_cannot_name(tmp_path):
    case = ss.Case(lambda friction=0.5: ss.models.two_subsystems(friction=friction))
    with pytest.raises(ss.InputError, match="a file cannot name"):
        ss.save(case, tmp_path / "x.toml")
    with pytest.raises(ss.InputError, match="matrices: expected"):
        ss.save(case.scene, tmp_path / "x.toml", matrices="csv")
    with pytest.raises(ss.InputError, match="is no text that a file can hold"):
        ss.save(ss.Scene([1.0], [[1.0]], dofs=["\ud800"]), tmp_path / "x.toml")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["scene.json", "scene.nc", "scene"])
def test_a_scene_is_saved_where_load_reads_it(tmp_path, name):
    with pytest.raises(ss.InputError, match=f"^{name}: expected a file .toml of a scene or a case$"):
        ss.save(ss.Scene([1.0], [[1.0]]), tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_a_scene_of_a_model_is_saved_as_the_model(tmp_path):
    """A page of matrices says nothing about the model that they came from."""
    path = tmp_path / "brake.toml"
    scene = ss.models.two_subsystems(friction=0.7, inclination=(0.2, 0.5)).replace(friction=(0.9, 1.1))
    ss.save(pickle.loads(pickle.dumps(scene)), path)
    assert tomllib.loads(path.read_text()) == {
        "format_version": 1,
        "model": {"name": "two_subsystems", "friction": [0.9, 1.1], "inclination": [0.2, 0.5]},
    }
    assert identical(ss.load(path).scene, scene)
    # What the model does not take makes it a scene of its own, and so does asking for its matrices.
    ss.save(scene.replace(gap=1e-6), path)
    assert identical(ss.load(path).scene, scene.replace(gap=1e-6))
    assert "stiffness" in tomllib.loads(path.read_text())["scene"]
    ss.save(scene, path, matrices="inline")
    contacts = tomllib.loads(path.read_text())["scene"]["contact"]
    assert [(contact["tangential"], contact["normal"]) for contact in contacts] == [
        ("x3", "x4"),
        ("x7", "x8"),
    ]
    assert identical(ss.load(path).scene, scene)


def test_a_model_whose_arguments_changed_after_the_call_is_saved_by_its_matrices(tmp_path):
    friction = np.array([0.5, 0.6])
    scene = ss.models.two_subsystems(friction=friction)
    friction[0] = 5.0
    ss.save(scene, tmp_path / "brake.toml")
    assert [contact.friction for contact in ss.load(tmp_path / "brake.toml").scene.contacts] == [0.5, 0.6]
