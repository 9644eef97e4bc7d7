"""Laws of friction of a user's own: traced from functions, read from texts, refused with a reason."""

import math
import pickle
from functools import partial

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy import stats

import stickslip as ss
from stickslip.scene.laws.expression import EVALUATED, FUNCTIONS, Variable, joined, parsed, text
from stickslip.scene.laws.operations import operations, values
from stickslip.study.sample.fingerprint import fingerprint

Law = ss.friction.Law
SPEEDS = np.array([0.0, 1e-3, 0.07, 0.3, 2.0])


def falling(s, kinetic=0.3, rise=0.2, scale=0.1):
    return kinetic + rise * np.exp(-s / scale)


TEXT = "kinetic + rise * exp(-s / scale)"
NUMBERS = {"kinetic": 0.3, "rise": 0.2, "scale": 0.1}
LAW = Law(falling)
#: The same law, built in.
STRIBECK = ss.friction.Stribeck(static=0.5, kinetic=0.3, speed=0.1)


def belt(friction, **changes):
    contact = ss.Contact(
        **{"tangential": "x", "normal_force": 10.0, "slider_speed": 0.1, **changes}, friction=friction
    )
    return ss.Scene([1.0], [[100.0]], damping=[[1.0]], contacts=[contact], dofs=["x"])


def test_a_function_and_its_text_are_the_same_law():
    read = Law(TEXT, **NUMBERS)
    assert LAW.formula == TEXT
    assert read == LAW
    assert hash(read) == hash(LAW)
    assert repr(LAW) == f"Law('{TEXT}', kinetic=0.3, rise=0.2, scale=0.1)"
    assert eval(repr(LAW)) == LAW
    copied = pickle.loads(pickle.dumps(LAW))
    assert copied == LAW
    # What identifies a study is the same in a process that has the law from another one.
    assert fingerprint(copied) == fingerprint(LAW) == fingerprint(read) != fingerprint(LAW.replace(rise=0.1))
    assert ss.friction.Law(TEXT, scale=0.1, rise=0.2, kinetic=0.3) == LAW
    assert LAW.replace(rise=0.1) == Law(falling, rise=0.1) != LAW
    assert LAW.parameters() == NUMBERS
    # One function for the law and for numbers, to the last bit.
    assert [LAW.coefficient(speed) for speed in SPEEDS] == falling(SPEEDS).tolist()


class Rig:
    level = 0.3

    def law(self, s, rise=0.2):
        return self.level + rise * np.exp(-s)

    def __call__(self, s):
        return self.level + s


def summed(s, slope=2.0):
    mu = 1.0 + s
    mu += 0.5
    mu *= slope
    return +mu - sum([s, s**2]) / 4


@pytest.mark.parametrize(
    ("function", "formula"),
    [
        (lambda v: 0.3 + v, "0.3 + s"),
        (lambda s: 2 - (s - 1) - (s + 2) * -3, "2 - (s - 1) - (s + 2) * -3"),
        (lambda s: (1 + s) / (2 * (3 + s)) / 4, "(1 + s) / (2 * (3 + s)) / 4"),
        (lambda s: 1 / (1 + np.square(s)) - np.reciprocal(4 + s), "1 / (1 + s * s) - 1 / (4 + s)"),
        (lambda s: 1 + np.tanh(-(s * s) / 0.1) - -s, "1 + tanh(-(s * s) / 0.1) - -s"),
        (lambda s: np.cos(s / 3) - np.arctan(-s) * np.sin(s), "cos(s / 3) - arctan(-s) * sin(s)"),
        (lambda s: -np.negative(s + 1) + np.sqrt(np.log(2.0 + s)), "s + 1 + sqrt(log(2 + s))"),
        (lambda s: np.float64(0.3) * s + 2**0.5, "0.3 * s + 1.4142135623730951"),
        (lambda s, a=2.0, b=3.0: (-a) ** b * -s + a**-2, "(-a)**b * -s + a**-2"),
        (lambda s, d=0.5: 1 + np.exp(-((s + 1) ** d)), "1 + exp(-(s + 1)**d)"),
        (lambda s, d=2: -(((s / 0.1) ** d) ** 2) + 9, "-((s / 0.1)**d)**2 + 9"),
        (lambda s, *, k=3: 1 + k * s, "1 + k * s"),
        (lambda s, k=3, /: 1 + k * s, "1 + k * s"),
        (partial(falling, rise=0.5), TEXT),
        (Rig().law, "0.3 + rise * exp(-s)"),
        (Rig(), "0.3 + s"),
        (summed, "(1 + s + 0.5) * slope - (0 + s + s**2) / 4"),
    ],
)
def test_what_a_function_does_is_noted(function, formula):
    law = Law(function)
    assert law.formula == formula
    assert Law(formula, **law.parameters()) == law
    for speed in SPEEDS:
        assert law.coefficient(speed) == function(np.float64(speed))


SLIP = Variable("s", "the slip speed", "friction", "Tabulated")
LEAVES = st.one_of(
    st.just(("variable",)),
    st.sampled_from([("number", "a"), ("number", "b")]),
    st.floats(-4.0, 4.0).map(lambda value: ("constant", value)),
)


def _grown(trees):
    two = st.tuples(st.sampled_from(["add", "subtract", "multiply", "divide"]), trees, trees)
    one = st.tuples(st.sampled_from(["negative", "exp", "tanh", "arctan", "sin", "cos"]), trees)
    power = st.tuples(st.just("power"), trees, st.integers(-3, 3).map(lambda n: ("constant", float(n))))
    return st.one_of(two, one, power)


def _made(tree):
    """Return a tree as the operators make it, which fold constants."""
    if tree[0] not in EVALUATED:
        return tree
    return joined(SLIP, tree[0], *map(_made, tree[1:]))


@given(st.recursive(LEAVES, _grown, max_leaves=12), st.floats(0.0, 3.0))
def test_a_formula_is_read_as_it_is_told_and_its_operations_give_its_value(drawn, speed):
    numbers = {"a": 0.7, "b": -1.3}
    try:
        tree = _made(drawn)
        told = text(SLIP, tree)
        listed = operations(SLIP, tree, numbers)
    except ss.InputError:
        # Such as a division of constants by zero.
        assume(False)
    assert parsed(SLIP, told) == tree
    assert len(set(listed)) == len(listed)
    for place, (name, first, second, _) in enumerate(listed):
        assert max(first, second) <= place
        assert name in ("constant", *EVALUATED)
    slots = values(listed, speed)
    with np.errstate(all="ignore"):
        # Numbers as arrays: numpy divides by zero.
        names = {name: getattr(np, name) for name in FUNCTIONS} | {"s": np.float64(speed)}
        names |= {name: np.float64(value) for name, value in numbers.items()}
        expected = float(eval(told, {"__builtins__": {}}, names))
    # Where nothing is far larger than the rest, rounding stays below this.
    assume(np.isfinite(expected) and np.abs(slots).max() < 1e4)
    assert slots[-1] == pytest.approx(expected, rel=1e-9, abs=1e-9)


def test_what_stands_twice_is_computed_once():
    x = "(s / 0.1)"
    assert len(operations(SLIP, parsed(SLIP, f"{x} * {x} + {x} * {x}"), {})) == 4
    assert len(operations(SLIP, parsed(SLIP, "s**8 - s**8"), {})) == 2
    # A sign moves into a constant; what has no s in it is one number.
    assert operations(SLIP, parsed(SLIP, "exp(-s / (a * b))"), {"a": 2.0, "b": 3.0}) == [
        ("constant", 0, 0, -6.0),
        ("divide", 0, 1, 0.0),
        ("exp", 2, 0, 0.0),
    ]
    assert len(operations(SLIP, ("variable",), {})) == 2


def squared(s, count):
    return s if count == 0 else squared(s * s, count - 1)


def branching(s):
    return 0.3 if s > 0.1 else 0.2


BRANCH = "a law cannot branch on the slip speed s >= 0: use Tabulated"
SIGNS = r"\+ - \* / \*\* and exp, log, sqrt, tanh, arctan, sin, cos"
NO_SIGN = f"is none of {SIGNS}"


@pytest.mark.parametrize(
    ("function", "said"),
    [
        (branching, f"friction: numpy.greater: {BRANCH}"),
        (lambda s: 0.3 if s == 0.1 else s, f"friction: numpy.equal: {BRANCH}"),
        (lambda s: 0.3 if s else 0.2, BRANCH),
        (lambda s: round(s), BRANCH),
        (lambda s: int(s), BRANCH),
        (abs, "friction: numpy.absolute: a law cannot branch"),
        (lambda s: min(s, 1.0), BRANCH),
        (lambda s: np.maximum(s, 1.0), f"friction: numpy.maximum: {BRANCH}"),
        (lambda s: np.where(s, 1.0, 2.0), f"friction: numpy.where: {BRANCH}"),
        (lambda s: np.interp(s, [0.0, 1.0], [1.0, 2.0]), f"friction: numpy.interp: {BRANCH}"),
        (lambda s: np.clip(s, 0.0, 1.0), f"friction: numpy.clip: {BRANCH}"),
        (lambda s: math.exp(-s), r"friction: .* numpy.exp in place of math.exp"),
        (lambda s: np.sinh(s), f"friction: numpy.sinh {NO_SIGN}"),
        (lambda s: s % 1, f"friction: numpy.remainder {NO_SIGN}"),
        (lambda s: np.add(s, 1.0, where=True), f"friction: numpy.add {NO_SIGN}"),
        (lambda s: 0.3, "friction: 0.3 does not depend on the slip speed s: give the plain number"),
        (lambda s, mu=0.3: 2 * mu, "friction: 2 .* mu does not depend on the slip speed s"),
        (lambda s: None, "friction: expected a formula of the slip speed s >= 0, got .* that returns None"),
        (lambda s: [s], r"friction: .* that returns \[s\]"),
        (lambda s, mu: mu * s, "friction: mu: the number has no value; give it as a default"),
        (lambda s, *rest: s, r"friction: \*rest: expected a function of the slip speed .* named numbers"),
        (lambda s, **rest: s, r"friction: \*\*rest: expected a function"),
        (lambda *, s: s, "friction: s: expected a function"),
        (lambda: 0.3, "friction: expected a function of the slip speed s >= 0, got <function"),
        (lambda s: 2**s, r"friction: the exponent s depends on the slip speed .*: write exp\(exponent"),
        (lambda s: s**0.5, r"friction: Law\('s\*\*0.5'\) is not smooth at rest: power 0.5 of 0; add a small"),
        (lambda s: 1 + s**65, "friction: expected exponents up to 64, got 65"),
        (lambda s: np.log(s), r"friction: mu at rest must be finite and >= 0, got -inf of Law\('log\(s\)'\)"),
        (lambda s: s - 1, "friction: mu at rest must be finite and >= 0, got -1 of"),
        (lambda s: 1 / (1 + 1 / s), "friction: mu at rest must be finite"),
        (lambda s, scale=0.0: 1 + s / (1 / scale), "friction: 1 / scale must be finite, got inf at scale=0"),
        (lambda s: s * np.array([1.0, 2.0]), r"friction: .* expected a real number, got array\(\[1., 2.\]\)"),
        (lambda s: s * True, "friction: a number of the formula: expected a real number, got True"),
        (lambda s: s * 1j, "friction: .* expected a real number, got 1j"),
        (lambda s: s + math.inf, "friction: expected finite numbers in the formula, got inf"),
        (lambda s, k=math.nan: 1 + k * s, "friction: k: must be finite, got nan"),
        (lambda s, k="one": 1 + k * s, "friction: k: expected a real number, got 'one'"),
        (lambda s: s[0], "friction: the function takes no expression: .* not subscriptable"),
        (lambda s: s.mean(), "friction: the function takes no expression: .* no attribute 'mean'"),
        (lambda s, exp=1.0: s * exp, "friction: 'exp' cannot name a number of a formula"),
        (lambda v, s=1.0: v * s, "friction: 's' cannot name a number"),
        (lambda s, formula=1.0: s * formula, "friction: 'formula' cannot name a number"),
        (lambda s, v_1=1.0: s * v_1, "friction: v_1: _1 at the end stands for one contact; call it v1"),
        (lambda s, unread=1.0: 1 + s, "friction: unread: is no number of the formula '1 .* s'"),
        (lambda s: squared(s, 100), "friction: expected a formula of at most 200 operations, got 255"),
        (0.3, "friction: formula: expected a function or a text, got 0.3"),
    ],
)
def test_what_is_no_formula_is_refused_with_the_reason(function, said):
    with pytest.raises(ss.InputError, match=said):
        Law(function)


def test_numbers_beside_a_function_are_its_own():
    assert Law(lambda s, mu: mu * s, mu=2.0).parameters() == {"mu": 2.0}
    with pytest.raises(ss.InputError, match="friction: ris: the function has no such number; it has kinetic"):
        Law(falling, ris=0.3)
    with pytest.raises(ss.InputError, match="friction: the law 'stribeck' has no 'rise'; it has static"):
        STRIBECK.replace(rise=0.3)


ONLY = f"friction: formula: expected numbers, names, {SIGNS}, got "
HOSTILE = {
    "__import__('os').system('true')": ONLY,
    "s.__class__": ONLY + "'s.__class__'",
    "(lambda: s)()": ONLY,
    "[s for s in 'a']": ONLY,
    "f'{s}'": ONLY,
    "'text'": ONLY,
    "True * s": ONLY + "'True'",
    "2j * s": ONLY,
    "sinh(s)": ONLY + r"'sinh\(s\)'",
    "exp(s, s)": ONLY,
    "exp(x=s)": ONLY,
    "exp(*s)": ONLY,
    "np.exp(s)": ONLY,
    "s ^ 2": ONLY + r"'s \^ 2'; a power is written \*\*",
    "s // 2": ONLY,
    "...": ONLY,
    "s if s else 1": f"friction: formula: 's if s else 1': {BRANCH}",
    "s > 1": BRANCH,
    "s and 1": BRANCH,
    "abs(s)": BRANCH,
    "exp": "friction: formula: exp in 'exp' has no value",
    "ris * s": r"friction: formula: ris in 'ris .* s' has no value; give it as ris=\.\.\.",
    "": "friction: formula: '' cannot be read",
    "s; s": "cannot be read: invalid syntax",
    "s := 1": "cannot be read",
    "s\0": "cannot be read",
    "\ud800": "cannot be read",
    "s + 1e999": "friction: expected finite numbers in the formula, got inf",
    "s + " + "9" * 400: "friction: a number of the formula: expected a number of at most",
    "s + " + "9" * 5000: "cannot be read",
    "10**10**10 + s": r"friction: 10\*\*10000000000 must be finite, got inf",
    "s + 1 / 0": "friction: 1 / 0 must be finite",
    "1 + s**1000000000": "friction: expected exponents up to 64, got 1e.09",
    "s" + " * s" * 201: "friction: formula: expected at most 200 operations, got 201",
    "s" + " + 1" * 2400: "friction: formula: expected at most 200 operations, got 2400",
    "(" * 3000 + "s" + ")" * 3000: "friction: formula: .* cannot be read: too many nested parentheses",
    "-" * 9000 + "s": "friction: formula: .* is nested too deeply",
    "s" + "**2" * 3000: "friction: formula: .* is nested too deeply",
    "1 + " * 3000 + "s": "friction: formula: expected at most 10000 letters, got 12001",
}


@pytest.mark.parametrize("formula", HOSTILE)
def test_a_text_that_is_no_formula_is_refused(formula):
    with pytest.raises(ss.InputError, match=HOSTILE[formula]):
        Law(formula)


def test_a_file_holds_the_formula(tmp_path):
    path = tmp_path / "scene.toml"
    ss.save(belt(LAW), path)
    assert (
        f'{{law = "formula", formula = "{TEXT}", kinetic = 0.3, rise = 0.2, scale = 0.1}}' in path.read_text()
    )
    assert ss.load(path).scene.contacts[0].friction == LAW
    for written, said in (
        (TEXT.replace("exp", "eval"), ONLY),
        (TEXT.replace("rise", "ris"), "ris in .* has no value"),
        ("kinetic + scale * s", "rise: is no number of the formula"),
        ("().__class__", ONLY),
    ):
        (tmp_path / "hostile.toml").write_text(path.read_text().replace(TEXT, written))
        with pytest.raises(ss.InputError, match=f"hostile.toml: .*{said}"):
            ss.load(tmp_path / "hostile.toml")
    (tmp_path / "hostile.toml").write_text(path.read_text().replace(f'"{TEXT}"', "3"))
    with pytest.raises(ss.InputError, match="friction: formula: expected a text, got 3"):
        ss.load(tmp_path / "hostile.toml")
    model = ss.Case(partial(ss.models.two_subsystems, friction=[LAW, STRIBECK]))
    ss.save(model, tmp_path / "model.toml")
    assert [one.friction for one in ss.load(tmp_path / "model.toml").scene.contacts] == [LAW, STRIBECK]


def test_numbers_of_a_formula_are_parameters():
    scene = belt(LAW)
    raised = scene.replace(friction_rise=0.4)
    assert raised.contacts[0].friction == LAW.replace(rise=0.4)
    assert scene.replace(friction_rise_0=0.4).contacts[0].friction == LAW.replace(rise=0.4)
    expected = ss.complex_modes(belt(ss.friction.Stribeck(0.7, 0.3, 0.1))).eigenvalues
    np.testing.assert_allclose(ss.complex_modes(raised).eigenvalues, expected, rtol=1e-13)
    over = {"friction_rise": [0.2, 0.4]}
    branches = ss.sweep(scene, over).isel(friction_rise=1)
    np.testing.assert_allclose(branches.eigenvalue[branches.eigenvalue.imag > 0.0], expected, rtol=1e-13)
    study = ss.Study(scene, {"friction_rise_0": stats.uniform(0.2, 0.2)}, outputs=["growth_rate"], samples=2)
    assert study.run(progress=False).growth_rate.size == 2
    for name in ("friction", "friction_0"):
        with pytest.raises(
            ss.InputError, match=r"friction: .* numbers are friction_kinetic, friction_rise, fri"
        ):
            ss.sweep(scene, {name: [0.2, 0.4]})
    with pytest.raises(
        ss.InputError, match="friction_ris: a scene has no such parameter; nearest: friction_rise"
    ):
        ss.sweep(scene, {"friction_ris": [0.2, 0.4]})
    with pytest.raises(ss.InputError, match=r"friction: mu at rest must be finite .* scale=0\.0"):
        scene.replace(friction_scale=0.0)


def test_steady_sliding_of_a_formula_is_that_of_the_law_built_in():
    own, built = (belt(law, slider_speed=0.3) for law in (LAW, STRIBECK))
    np.testing.assert_allclose(ss.steady_sliding(own).position, ss.steady_sliding(built).position, rtol=1e-14)
    speeds = {"slider_speed": (0.1, 0.5)}
    (hopf,), (expected,) = (ss.critical_points(scene, speeds) for scene in (own, built))
    assert hopf.value == pytest.approx(expected.value, rel=1e-12)
    assert hopf.kind == expected.kind


def test_a_formula_is_finite_at_the_speed_of_its_slider():
    with pytest.raises(
        ss.InputError, match=r"contact 0: friction: must be finite at the slider speed -0\.5 m/s"
    ):
        belt(Law("0.3 + 0.01 / (1 - 2 * s)"), slider_speed=-0.5)
