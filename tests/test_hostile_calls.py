"""Calls with what a newcomer might hand over: each is told by type and wording, before any work starts."""

import dataclasses
import subprocess
import sys
from fractions import Fraction

import numpy as np
import pytest
import scipy.sparse
import scipy.stats
import xarray as xr

import stickslip as ss

NAN, INF = float("nan"), float("inf")
HUGE = 10**400
MODEL = ss.models.two_subsystems
SCENE = MODEL()
START = ss.steady_sliding(SCENE)
RUN = ss.simulate(SCENE, 0.01, START)


class OwnLaw(ss.friction.Law):
    """Friction of which the core would take the formula, and not what the class makes of it."""

    def coefficient(self, speed):
        return 0.4 / (1.0 + speed**2)


class OwnRational(ss.friction.Rational):
    """Friction of which the core would take the numbers, and not the formula."""

    def coefficient(self, speed):
        return self.kinetic


def masses(size=4, **changes):
    return ss.Scene(**{"mass": np.ones(size), "stiffness": 1e4 * np.eye(size), **changes})


def contact(tangential=0, normal=1, **changes):
    return ss.Contact(tangential=tangential, normal=normal, **{"friction": 0.5, **changes})


def rigid_pad(**changes):
    """A body that moves along x and y and turns, with two points that rub."""
    points = [contact([1.0, 0.0, 0.1], [0.0, 1.0, s]) for s in (-0.2, 0.2)]
    return masses(3, contacts=points, **changes)


CALLS = {
    # things that are no numbers, and numbers that are no floats
    "contacts None": (lambda: masses(contacts=None), "contacts: expected a sequence of contacts, got None"),
    "contacts a number": (lambda: masses(contacts=3), "contacts: expected a sequence of contacts, got 3"),
    "mass None": (lambda: masses(mass=None), "mass: expected real numbers, got None"),
    "dataset as mass": (lambda: masses(mass=xr.Dataset()), "mass: expected an array of numbers, got <xarray"),
    "friction a DataArray": (lambda: MODEL(friction=xr.DataArray(0.3)), "friction: expected a real number"),
    "huge friction": (
        lambda: MODEL(friction=HUGE),
        r"friction: expected a number of at most 1.8e\+308, got 10",
    ),
    "huge mass": (lambda: masses(mass=[1, 1, 1, HUGE]), "mass: expected a number of at most"),
    "no repr": (lambda: MODEL(friction=10**5000), "friction: .* got an integer of 16610 bits"),
    "huge duration": (lambda: ss.simulate(SCENE, HUGE, START), "duration: expected a number of at most"),
    "huge time limit": (
        lambda: ss.simulate(SCENE, 1.0, START, time_limit=HUGE),
        "time_limit: expected a number",
    ),
    "max_events": (
        lambda: ss.simulate(SCENE, 1.0, START, max_events=10**30),
        "max_events: .* <= 9223372036854",
    ),
    "samples": (
        lambda: RUN.to_dataset(10**30),
        "samples: expected an integer <= 9223372036854775807, got 1000",
    ),
    "masked": (
        lambda: masses(mass=np.ma.masked_equal([1.0, 2.0, 3.0, 4.0], 3.0)),
        "mass: expected real numbers, got masked entries",
    ),
    "samples beyond memory": (
        lambda: RUN.to_dataset(10**12),
        "samples: 1000000000000 would take .* GiB, of .* GiB of memory",
    ),
    "instants beyond memory": (
        lambda: RUN.sample(between=10**12),
        "between: 1000000000000 would take .* GiB, of .* GiB of memory",
    ),
    "range beyond memory": (
        lambda: ss.Case(SCENE, sweep={"friction": {"from": 0.0, "to": 3.0, "count": 10**13}}),
        r"\[sweep\]: friction: count: 10000000000000 would take 1.19e\+06 GiB",
    ),
    "study beyond memory": (
        lambda: ss.Study(SCENE, {"friction": scipy.stats.uniform(1.0, 0.5)}, samples=10**13),
        r"samples: 10000000000000 would take 1.49e\+05 GiB",
    ),
    "map beyond memory": (
        lambda: ss.sweep(
            SCENE, {"friction_0": np.linspace(1.0, 2.0, 10**6), "friction_1": np.linspace(1, 2, 10**6)}
        ),
        r"friction_0 and friction_1: 1000000000000 would take 9.54e\+05 GiB",
    ),
    "a law of one's own": (
        lambda: MODEL(friction=OwnLaw(lambda s: 0.4 + s)),
        r"contact 0: friction: OwnLaw is no law of stickslip.friction, .* Law\(lambda s: .* Tabulated\(",
    ),
    "a law made of another": (
        lambda: SCENE.replace(friction=OwnRational(0.5, 0.3, 0.1)),
        "contact 0: friction: OwnRational is no law of stickslip.friction",
    ),
    # infinities
    "friction inf": (lambda: SCENE.replace(friction=INF), "friction: must be finite, got inf"),
    "restitution nan": (lambda: SCENE.replace(restitution=NAN), "restitution: must be finite, got NaN"),
    "sweep to inf": (
        lambda: ss.Case(SCENE, sweep={"friction": {"from": 0.0, "to": INF, "count": 3}}),
        r"\[sweep\]: friction: from and to must be finite, got 0 and inf",
    ),
    "state nan": (
        lambda: ss.State([NAN, 0.0], [0.0, 0.0], "+"),
        "position: must be finite, got nan at index 0",
    ),
    "state inf": (
        lambda: ss.State([0.0, 0.0], [0.0, INF], "+"),
        "velocity: must be finite, got inf at index 1",
    ),
    "status": (lambda: ss.State([0.0], [0.0], "q"), "combination: expected one letter .*, got 'q'"),
    # directions
    "zero": (lambda: masses(contacts=[contact(np.zeros(4))]), "contact 0: tangential: must not be zero"),
    "same dof": (
        lambda: masses(contacts=[contact(2, 2)]),
        "contact 0: normal: must differ from the tangential",
    ),
    "multiple": (
        lambda: masses(contacts=[contact(np.ones(4), -3.0 * np.ones(4))]),
        "contact 0: normal: must differ from the tangential direction, got a multiple of it",
    ),
    "one dof": (
        lambda: masses(1, contacts=[contact([1.0], [1.0])]),
        "contact 0: normal: must differ from the tangential",
    ),
    # names
    "names twice": (
        lambda: masses(contacts=[contact(0, 1, name="a"), contact(2, 3, name="a")]),
        "contacts: 'a' names more than one contact",
    ),
    "name and index": (
        lambda: masses(contacts=[contact(0, 1, name="1"), contact(2, 3)]),
        "contacts: '1' names more than one contact",
    ),
    "names twice by replace": (
        lambda: SCENE.replace(contacts=[dataclasses.replace(c, name="a") for c in SCENE.contacts]),
        "contacts: 'a' names more than one contact",
    ),
    "blank contact": (
        lambda: masses(contacts=[contact(name=" ")]),
        "contact 0: name: expected a text that is not",
    ),
    "contact 3": (lambda: masses(contacts=[contact(name=3)]), "contact 0: name: expected a text .* got 3"),
    "blank dof": (lambda: masses(2, dofs=["", "b"]), "dofs: expected names that are not empty, got ''"),
    "dofs a text": (lambda: masses(2, dofs="ab"), "dofs: expected 2 names, got 'ab'"),
    # physics
    "negative beta": (
        lambda: ss.Rayleigh(stiffness=-1.0),
        "damping.stiffness: must be >= 0, got -1",
    ),
    "negative alpha": (
        lambda: ss.Rayleigh(mass=-1.0),
        "damping.mass: must be >= 0, got -1",
    ),
    "alpha nan": (lambda: ss.Rayleigh(mass=np.nan), "damping.mass: must be finite, got nan"),
    "beta a word": (
        lambda: ss.Rayleigh(stiffness="much"),
        "damping.stiffness: expected a real number, got 'much'",
    ),
    "chain mass": (
        lambda: MODEL(upper_mass=(0.3, -0.7)),
        r"subsystems\[1\].upper_mass: must be positive, got -0.7",
    ),
    "chain contact mass": (
        lambda: MODEL(contact_mass=0),
        r"subsystems\[0\].contact_mass: must be positive, got 0",
    ),
    # grammar
    "not square": (
        lambda: masses(stiffness=np.ones((3, 2))),
        r"stiffness: expected a square matrix, got shape \(3, 2\)",
    ),
    "no dofs": (lambda: ss.Scene([], np.zeros((0, 0))), "mass: expected at least one dof, got none"),
    "sparse mass": (
        lambda: masses(mass=scipy.sparse.csr_array(np.ones((2, 3)))),
        r"mass: expected a square matrix, got shape \(2, 3\)",
    ),
    "sparse complex mass": (
        lambda: masses(mass=scipy.sparse.csr_array(1j * np.eye(4))),
        "mass: expected real numbers, got dtype complex128",
    ),
    # names of parameters
    "one of two": (
        lambda: ss.sweep(MODEL, {"vertical_stiffness_2": [1.0, 2.0]}),
        "vertical_stiffness_2: the model has no such parameter; nearest: vertical_stiffness",
    ),
    # other things than cycles
    "trace": (
        lambda: ss.continuation(RUN, {"friction": (1.0, 2.0)}),
        "cycle: expected a Cycle, got Traj.*limit_cycle",
    ),
    "follow": (
        lambda: ss.continuation(SCENE, {"friction": (1.0, 2.0)}),
        "cycle: expected a Cycle, got Scene",
    ),
    "no duration": (lambda: ss.Case(SCENE).simulate(), r"duration is missing: give it, or \[run\] duration"),
}


@pytest.mark.parametrize("name", CALLS)
def test_hostile_call(name):
    call, message = CALLS[name]
    with pytest.raises(ss.InputError, match=message) as caught:
        call()
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 400


def test_numbers_of_other_kinds_are_numbers():
    expected = MODEL(friction=0.75)
    for friction in (Fraction(3, 4), np.float32(0.75), np.array(0.75), [Fraction(3, 4), np.float64(0.75)]):
        scene = MODEL(friction=friction)
        assert [c.friction for c in scene.contacts] == [c.friction for c in expected.contacts]
        assert "friction 0.75" in repr(scene)
    assert masses(mass=[Fraction(1, 2)] * 4).mass.tolist() == [0.5] * 4
    assert masses(mass=np.ma.array(np.ones(4))).mass.tolist() == [1.0] * 4


def test_sparse_masses():
    """Finite elements give them: a diagonal one stays lumped, any other computes like the dense one."""
    assert masses(mass=scipy.sparse.diags_array([1.0, 2.0, 3.0, 4.0])).mass.tolist() == [1.0, 2.0, 3.0, 4.0]
    consistent = np.array(
        [[2.0, 1.0, 0.0, 0.0], [1.0, 4.0, 1.0, 0.0], [0.0, 1.0, 4.0, 1.0], [0.0, 0.0, 1.0, 2.0]]
    )
    for kind in (scipy.sparse.csr_array, scipy.sparse.coo_array, scipy.sparse.csc_matrix):
        modes = ss.complex_modes(masses(mass=kind(consistent), contacts=[contact()]), "+")
        dense = ss.complex_modes(masses(mass=consistent, contacts=[contact()]), "+")
        assert modes.eigenvalues.tobytes() == dense.eigenvalues.tobytes()


def test_a_rigid_pad_with_masses_of_its_contacts():
    """What the error advises: the pad rests on the small masses as friction and its spring demand."""
    body, small, stiff, reach = 1.0, 1e-6, 1e8, 0.2
    # x, y, angle of the pad (moment of inertia 0.01); tangential and normal of each contact mass.
    mass = [body, body, 0.01, small, small, small, small]
    stiffness = np.zeros((7, 7))
    for k, arm in enumerate((-reach, reach)):
        for row, entries in ((3 + 2 * k, [1.0, 0.0, 0.0]), (4 + 2 * k, [0.0, 1.0, arm])):
            tie = np.zeros(7)
            tie[:3], tie[row] = entries, -1.0
            stiffness += stiff * np.outer(tie, tie)
    stiffness[0, 0] += 1e4
    scene = ss.Scene(
        mass,
        stiffness,
        force=[0.0, -10.0, 0.0, *[0.0] * 4],
        contacts=[contact(3, 4, slider_speed=0.1), contact(5, 6, slider_speed=0.1)],
    )
    resting = ss.steady_sliding(scene)
    # Friction 0.5 of the load 10 N against the spring of 1e4 N/m, to the compliance of the ties.
    assert resting.position[0] == pytest.approx(0.5 * 10.0 / 1e4, rel=1e-3)


@pytest.mark.process
def test_figures_of_studies_are_there_without_a_second_import():
    code = "import sys, stickslip as ss; ss.Study; assert 'matplotlib' not in sys.modules; "
    code += "ss.plot"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True).returncode == 0


def test_marginal_modes():
    """Without damping nothing grows or decays, whatever rounding says; with the least damping it does."""
    free = masses(contacts=[contact()], stiffness=np.diag([1e4, 2e4, 3e4, 4e4]) + 1e3)
    assert ss.complex_modes(free, "+").marginal.all()
    matrix = free.replace(damping=np.zeros((4, 4)))
    assert ss.complex_modes(matrix, "+").marginal.all()
    damped = ss.complex_modes(free.replace(damping=ss.Rayleigh(stiffness=1e-11)), "+")
    assert not damped.marginal.any()
    assert "marginal" in repr(ss.complex_modes(free, "+"))
    assert "-0.000000" not in repr(damped)
    growing = ss.complex_modes(MODEL())
    assert not growing.marginal.any()
    assert (growing.rounding < 1e-9 * np.abs(growing.eigenvalues)).all()
