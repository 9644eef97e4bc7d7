"""A damaged record of a motion or an orbit is refused, or gives a result; nothing panics."""

import copy
import itertools
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

import stickslip as ss
from equal_chain import long_chain
from stickslip import _core

NAN, INF = float("nan"), float("inf")
NUMBERS = (NAN, INF, -INF, -1.0, 0.0, 1e308, -1e308)
#: Beyond any index, and not a whole number of the core.
INTEGERS = (-1, 0, 1, 2, 7, 10**6, 2**63, 1.5, None, "0")


def bouncing():
    """A mass that bounces on a moving belt until it comes to rest there, and slides and sticks."""
    scene = ss.Scene(
        mass=[1.0, 1.0],
        stiffness=[[1e3, 0.0], [0.0, 1e2]],
        damping=ss.Proportional(stiffness=1e-4),
        force=[0.0, -20.0],
        contacts=[ss.Contact(tangential=0, normal=1, friction=0.5, slider_speed=0.1, restitution=0.5)],
    )
    return ss.simulate(scene, ss.State([0.0, 1e-3], [0.0, 0.0], "d", dofs=scene.dofs), 1.0)


def gliding():
    scene = ss.models.two_subsystems(friction=1.5)
    start = ss.sliding_equilibrium(scene).perturbed(velocity={"x1": 1e-3})
    return ss.simulate(scene, start, 0.2)


def marching():
    """Bounces and slips of a local march, with a load that is switched."""
    scene, start = long_chain(2)
    contacts = [replace(contact, restitution=0.5) for contact in scene.contacts]
    loads = [ss.Steps({"x1": 30.0}, times=[4e-3], values=[0.0, 1.0])]
    return ss.simulate(scene.replace(contacts=contacts, loads=loads), start, 8e-3, method="local")


RUNS = {"bouncing": bouncing(), "two subsystems": gliding(), "local": marching()}
CYCLE = RUNS["two subsystems"].limit_cycle()


def damaged(value):
    """Yield what a damaged file may hold instead of a value."""
    yield from (None, [], "text", b"\0", {}, object(), NAN)
    if isinstance(value, np.ndarray):
        yield from (value[:-1], value[1:], np.append(value, 0), value[::-1].copy(), value.reshape(1, -1))
        yield value.astype(str)
        for new, place in itertools.product(
            NUMBERS if value.dtype.kind == "f" else INTEGERS[:7], (0, value.size // 2, -1)
        ):
            changed = value.astype(object)
            if value.size:
                changed[place] = new
                yield changed
                if value.dtype.kind == "f" or new in range(-1, 10**7):
                    yield changed.astype(value.dtype)
    elif isinstance(value, list | tuple):
        yield from (value[:-1], value[1:], value[::-1], [*value, *value[-1:]], [None] * len(value))
        for place in sorted({0, len(value) // 2, len(value) - 1}) if value else ():
            for entry in damaged(value[place]):
                changed = list(value)
                changed[place] = entry
                yield type(value)(changed)
    elif isinstance(value, str):
        yield from ("", "++++", "dd", "ss", "modal", "taylor", "velocity", "impact", "accumulation", "slip+")
        yield from ("release", "chattering", "failed", "\0", "d", "s", "-")
    elif isinstance(value, bool | int):
        yield from INTEGERS
    elif isinstance(value, float):
        yield from NUMBERS


def mutations(record):
    for name, value in record.items():
        if isinstance(value, dict):
            for part, changed in mutations(value):
                yield f"{name}.{part}", {**record, name: changed}
        without = copy.copy(record)
        del without[name]
        yield name, without
        for entry in damaged(value):
            yield name, {**record, name: entry}


def used(run):
    """Ask a motion for everything that looks at its phases and events."""
    times = np.linspace(0.0, run.duration, 5)
    assert len(run.events.combination) == len(run.events.time)
    run.sample(times)
    run.state(run.duration)
    run.core.event_states()
    _core.attractor(run.core, 0.0, "auto", None)
    run.energy(times)
    run.core.record()


def refused_or_used(make, use):
    """Return whether a record was refused; anything but that or a result is raised."""
    try:
        use(make())
    except ss.StickslipError:
        return True
    return False


@pytest.mark.slow
@pytest.mark.parametrize("name", RUNS)
def test_damaged_motions(name):
    run = RUNS[name]
    record = run.core.record()

    def restored(damaged):
        return ss.Trajectory(run.scene, run.state(0.0), _core.Trajectory.from_record(run.scene.core, damaged))

    assert not refused_or_used(lambda: restored(record), used)
    refused, all_fields = set(), set()
    for field, changed in mutations(record):
        all_fields.add(field)
        with np.errstate(all="ignore"):
            if refused_or_used(lambda changed=changed: restored(changed), used):
                refused.add(field)
    assert refused == all_fields


@pytest.mark.slow
def test_damaged_orbits():
    record = CYCLE.core.record()

    def used_cycle(cycle):
        repr(cycle)
        cycle.margins()
        cycle.harmonics(4)
        cycle.is_followed()
        used(cycle.run)

    def restored(damaged):
        return ss.Cycle(CYCLE.scene, _core.Cycle.from_record(CYCLE.scene.core, damaged))

    assert not refused_or_used(lambda: restored(record), used_cycle)
    refused = set()
    for field, changed in mutations(record):
        with np.errstate(all="ignore"):
            if refused_or_used(lambda changed=changed: restored(changed), used_cycle):
                refused.add(field)
    assert refused == set(record)


@pytest.mark.parametrize(
    ("field", "place", "value"),
    [
        ("event_phase", 0, 0),
        ("event_phase", -1, 10**6),
        ("event_time", 0, 0.5),
        ("event_contact", 0, 2),
        ("phase_start", 0, 1e-9),
        ("phase_start", 1, 0.9),
        ("phase_start", -1, NAN),
        ("phase_rest", 0, INF),
        ("states", 3, NAN),
        ("states", -1, INF),
    ],
)
def test_a_number_that_does_not_fit_is_refused(field, place, value):
    run = RUNS["two subsystems"]
    record = run.core.record()
    record[field][place] = value
    with pytest.raises(ss.InputError, match="record: "):
        _core.Trajectory.from_record(run.scene.core, record)


@pytest.mark.parametrize(
    ("field", "value"),
    [("period", 1.0), ("period", NAN), ("residual", NAN), ("kinds", ["impact"]), ("contacts", [0])],
)
def test_an_orbit_that_does_not_fit_is_refused(field, value):
    record = {**CYCLE.core.record(), field: value}
    with pytest.raises(ss.InputError, match="record: "):
        _core.Cycle.from_record(CYCLE.scene.core, record)


def test_a_record_of_another_type_is_refused():
    for kind in (_core.Trajectory, _core.Cycle):
        read = partial(kind.from_record, CYCLE.scene.core)
        for record in (None, 1.0, [], {}, "text"):
            with pytest.raises(ss.InputError, match="record: "):
                read(record)
