"""Springs and dampers as parts of scenes: laws, names, parameters, files, and what is refused."""

import numpy as np
import pytest

import stickslip as ss
from meshed import block

LAWS = [
    ss.spring.Polynomial(10.0, -2.0, 300.0),
    ss.spring.Gap(50.0, -0.1),
    ss.spring.Hertz(40.0, 1.4),
    ss.spring.Tabulated([-0.2, 0.1, 0.4], [-3.0, 1.0, 9.0]),
    ss.spring.Law(lambda u, most=4.0, scale=0.1: most * np.tanh(u / scale)),
]


def scene(*elements, **changes):
    given = {"mass": [1.0, 2.0], "stiffness": [[30.0, -10.0], [-10.0, 20.0]], "dofs": ["x", "y"]}
    return ss.Scene(**{**given, **changes}, elements=elements)


@pytest.mark.parametrize("law", LAWS)
def test_a_law_has_its_force_and_comes_back_from_its_table(law):
    assert type(law).of_table({k: v for k, v in law.table().items() if k != "law"}) == law
    assert eval(repr(law), vars(ss.spring)) == law
    # The core has the same force: a mass without other forces begins with its acceleration.
    for u in (-0.3, -0.05, 0.0, 0.07, 0.6):
        free = ss.Scene([2.0], [[0.0]], elements=[ss.Spring(0, law)])
        run = ss.simulate(free, 1e-6, ss.State(position=[u], velocity=[0.0], combination=""))
        velocity = run.state(1e-6).velocity[0]
        assert velocity == pytest.approx(-0.5e-6 * law.force(u), rel=1e-6, abs=1e-16)


def test_forces_of_laws():
    polynomial, gap, hertz, table, law = LAWS
    assert polynomial.force(0.5) == 10.0 * 0.5 - 2.0 * 0.25 + 300.0 * 0.125
    assert gap.force(-0.2) == 0.0
    assert gap.force(0.1) == pytest.approx(10.0)
    assert hertz.force(0.5) == 40.0 * 0.5**1.4
    border = (1e-9 / 40.0) ** (1.0 / 1.4)
    assert hertz.force(0.5 * border) == pytest.approx(0.5e-9, rel=1e-12)
    assert hertz.force(-0.1) == 0.0
    np.testing.assert_allclose([table.force(u) for u in (-0.2, 0.1, 0.4)], [-3.0, 1.0, 9.0])
    # Straight on beyond the ends.
    for start, step in ((-0.2, -0.1), (0.4, 0.1)):
        first, second = (table.force(start + k * step) for k in (1, 2))
        assert second - first == pytest.approx(first - table.force(start))
    assert law.force(0.05) == pytest.approx(4.0 * np.tanh(0.5))
    assert law.parameters() == {"most": 4.0, "scale": 0.1}


def test_numbers_of_elements_are_parameters():
    made = scene(ss.Spring("x", LAWS[0], 0.05, name="mount"), ss.Damper("y", 3.0))
    changed = made.replace(mount_k3=500.0, mount_offset=0.0, element_1_k1=4.0)
    assert changed.elements[0].law == ss.spring.Polynomial(10.0, -2.0, 500.0)
    assert changed.elements[0].offset == 0.0
    assert changed.elements[1].law == ss.spring.Polynomial(4.0)
    # Where nothing is said, an element stays as it is.
    assert made.replace(stiffness=2.0 * made.stiffness).elements == made.elements
    study = ss.Study(made, {"mount_k3": [1.0, 2.0]}, outputs=["growth_rate"]).run(progress=False)
    assert np.isfinite(study.growth_rate).all()
    with pytest.raises(ss.InputError, match=r"mount_k4: a scene has no such parameter; nearest: .*mount_k3"):
        ss.sweep(made, {"mount_k4": [1.0, 2.0]})
    with pytest.raises(ss.InputError, match="replace: unknown field 'mount_most'"):
        made.replace(mount_most=1.0)


@pytest.mark.parametrize("law", LAWS)
def test_a_scene_file_has_elements(law, tmp_path):
    made = scene(ss.Spring({"x": 1.0, "y": -0.5}, law, 0.1, name="mount"), ss.Damper([0.0, 2.0], 3.0))
    ss.save(made, tmp_path / "scene.toml")
    back = ss.load(tmp_path / "scene.toml").scene
    assert [one.law for one in back.elements] == [one.law for one in made.elements]
    assert [one.kind for one in back.elements] == ["spring", "damper"]
    assert (back.elements[0].offset, back.elements[0].name) == (0.1, "mount")
    start = ss.State(position=[0.3, 0.0], velocity=[0.0, 1.0], combination="")
    ends = [ss.simulate(one, 1.0, start).state(1.0).position for one in (made, back)]
    np.testing.assert_array_equal(*ends)
    assert repr(back.elements[0].law) in str(back)
    assert "mount" in str(back.summary())


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ('kind = "spring"\ndirection = "x"', "element 0: law is missing"),
        ('kind = "rod"\ndirection = "x"\nlaw = 1.0', "kind: expected one of spring, damper, got 'rod'"),
        ('kind = "damper"\ndirection = "x"\nlaw = 1.0\noffset = 1.0', "offset: a damper has none"),
        ('kind = "spring"\ndirection = "x"\nlaw = {law = "cubic"}', "law: expected one of polynomial, gap"),
        (
            'kind = "spring"\ndirection = "x"\nlaw = {law = "polynomial", k = 1.0}',
            "has no 'k'; it has k1, k2",
        ),
        ('kind = "spring"\ndirection = "z"\nlaw = 1.0', "unknown dof 'z'"),
    ],
)
def test_a_wrong_table_is_named(table, said, tmp_path):
    ss.save(scene(), tmp_path / "scene.toml")
    with open(tmp_path / "scene.toml", "a") as file:
        file.write(f"\n[[scene.element]]\n{table}\n")
    with pytest.raises(ss.InputError, match=said):
        ss.load(tmp_path / "scene.toml")


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: scene(3.0), "elements: expected Spring or Damper, got 3.0 at 0"),
        (
            lambda: ss.Scene([1.0], [[1.0]], elements=ss.Spring(0, 1.0)),
            "expected a sequence of Spring and Dam",
        ),
        (lambda: scene(ss.Spring("x", "hard")), "element 0: law: expected a law of stickslip.spring"),
        (lambda: scene(ss.Spring("x", ss.friction.Linear(0.1, 0.0))), "expected a law of stickslip.spring"),
        (lambda: scene(ss.Spring({"x": 0.0}, 1.0)), "element 0: direction: must not be zero"),
        (lambda: scene(ss.Spring("x", 1.0, np.inf)), "element 0: offset and direction must be finite"),
        (lambda: scene(ss.Spring("x", 1.0, name="a b")), "elements: name: expected a word"),
        (lambda: scene(*[ss.Spring("x", 1.0, name="a")] * 2), "'a' names more than one element"),
        (lambda: scene(ss.Damper("x", ss.spring.Law("exp(u)"))), "element 0: law: force at rest: must be 0"),
        (
            lambda: scene(ss.Spring("x", ss.spring.Law("sqrt(u)"))),
            "slope at zero: must be finite; give its arg",
        ),
        (lambda: ss.spring.Polynomial(), "expected 1 to 12 coefficients"),
        (lambda: ss.spring.Polynomial(1.0, np.nan), "law: k2: must be finite"),
        (lambda: ss.spring.Tabulated([0.0, 0.0], [1.0, 2.0]), "positions: must ascend"),
        (lambda: ss.spring.Tabulated([0.0, 1.0], [1.0]), "forces: expected one for each of 2 positions"),
        (lambda: ss.spring.Law("2 * k", k=1.0), "does not depend on the stretch u"),
        (
            lambda: ss.spring.Law(lambda u: abs(u)),
            "a law cannot branch on the stretch u.*use Tabulated or Gap",
        ),
        (
            lambda: scene(ss.Spring("y", 1.0), mass=[1.0, 0.0]),
            "not computed beside dofs without mass on which they act",
        ),
        (
            lambda: scene(
                ss.Spring("x", 1.0),
                contacts=[ss.Contact(normal="x"), ss.Contact(normal="x")],
            ),
            "not computed beside contacts whose directions depend on each other",
        ),
        (
            lambda: scene(
                ss.Spring("x", 1.0),
                contacts=[
                    ss.Contact(
                        tangential="x", normal="y", friction=0.1, slider_vibration=ss.Harmonic(0.1, 1.0)
                    )
                ],
            ),
            "not computed beside sliders that vibrate along directions on which they act",
        ),
    ],
)
def test_what_is_no_element_is_refused(make, said):
    with pytest.raises(ss.InputError, match=said):
        make()


def test_methods_for_linear_phases_refuse_elements():
    made = scene(ss.Spring("x", LAWS[0]))
    start = ss.State(position=[0.1, 0.0], velocity=[0.0, 0.0], combination="")
    with pytest.raises(ss.InputError, match="as element 0 is not linear; use 'auto' or 'taylor'"):
        ss.simulate(made, 1.0, start, method="modal")
    with pytest.raises(ss.InputError, match="method: 'local' does not work here: springs or dampers"):
        ss.simulate(made, 1.0, start, method="local")
    with pytest.raises(ss.InputError, match="need a linear structure, without elements"):
        ss.modal_energy(ss.simulate(made, 1.0, start), [0.0])


def test_a_reduced_model_stretches_its_springs_as_the_full_one():
    body = block(3, 2)
    pairs = ss.fe.contact_pairs(body.surface("low"), None, velocity=(1.0, 0.0), friction=0.5, gap=-1e-6)
    full = ss.fe.assemble(body, pairs, impact_friction=True)
    ends = {full.dofs[-1]: 1.0, full.dofs[-3]: -0.5}
    law = ss.spring.Polynomial(1e5, 0.0, 1e15)
    full = full.replace(elements=[ss.Spring(ends, law, 1e-7, name="tie"), ss.Damper(ends, 20.0)])
    top = float(ss.complex_modes(full).frequencies.max())
    reduction = ss.fe.reduce(full, (0.0, 0.5 * top), boundary="consistent", tolerance=0.5)
    spring, damper = reduction.scene.elements
    y = np.random.default_rng(1).normal(size=reduction.scene.size) * 1e-6
    x = reduction.expand(y)
    stretch = x[-1] - 0.5 * x[-3] - 1e-7
    assert spring.direction @ y - spring.offset == pytest.approx(stretch, rel=1e-12)
    assert damper.direction @ y == pytest.approx(
        stretch + 1e-7 - (reduction.offset[-1] - 0.5 * reduction.offset[-3])
    )
    assert (spring.law, spring.name, damper.law) == (law, "tie", ss.spring.Polynomial(20.0))
    # The full mass of the boundary keeps impacts alike.
    kick = {full.dofs[-1]: 0.02}
    starts = [ss.steady_sliding(full).perturbed(velocity=kick)]
    starts.append(reduction.project(starts[0]))
    runs = [ss.simulate(one, 2e-5, at) for one, at in zip((full, reduction.scene), starts, strict=True)]
    assert all(abs(run.balance().residual) < 1e-14 for run in runs)
