"""A damaged record of a motion or an orbit is refused, or gives a result; nothing panics."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

import stickslip as ss
from equal_chain import long_chain
from stickslip import _core


def bouncing():
    """A mass that bounces on a moving belt until it comes to rest there, and slides and sticks."""
    scene = ss.Scene(
        mass=[1.0, 1.0],
        stiffness=[[1e3, 0.0], [0.0, 1e2]],
        damping=ss.Rayleigh(stiffness=1e-4),
        force=[0.0, -20.0],
        contacts=[ss.Contact(tangential=0, normal=1, friction=0.5, slider_speed=0.1, restitution=0.5)],
    )
    return ss.simulate(scene, 1.0, ss.State([0.0, 1e-3], [0.0, 0.0], "d", dofs=scene.dofs))


def gliding():
    scene = ss.models.two_subsystems(friction=1.5)
    start = ss.steady_sliding(scene).perturbed(velocity={"x1": 1e-3})
    return ss.simulate(scene, 0.2, start)


def marching():
    """Bounces and slips of a local march, with a load that is switched."""
    scene, start = long_chain(2)
    contacts = [replace(contact, restitution=0.5) for contact in scene.contacts]
    loads = [ss.Switched({"x1": 30.0}, times=[4e-3], values=[0.0, 1.0])]
    return ss.simulate(scene.replace(contacts=contacts, loads=loads), 8e-3, start, method="local")


RUNS = {"bouncing": bouncing(), "two subsystems": gliding(), "local": marching()}
CYCLE = RUNS["two subsystems"].limit_cycle()


def damaged(record):
    """Yield the bytes with other values at many places, and cut short."""
    step = max(1, len(record) // 60)
    for place in range(0, len(record), step):
        for value in (0, 1, 0x40, 0x7F, 0x80, 0xFF):
            yield record[:place] + bytes([value]) + record[place + 1 :]
        yield record[:place]
    yield record + b"\0"


def used(run):
    """Ask a motion for everything that looks at its phases and events."""
    times = np.linspace(0.0, run.duration, 5)
    assert len(run.events.combination) == len(run.events.time)
    run.sample(times)
    run.state(run.duration)
    run.core.event_states()
    _core.attractor(run.core, 0.0, "auto", None, _core.Watch())
    run.energy(times)
    run.core.record()


def refusals(restored, record, use):
    """Return whether each damaged record is refused."""
    assert not refused_or_used(lambda: restored(record), use)
    with np.errstate(all="ignore"):
        return [refused_or_used(lambda: restored(changed), use) for changed in damaged(record)]  # noqa: B023


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

    refused = refusals(restored, record, used)
    assert any(refused)
    assert not all(refused)


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

    refused = refusals(restored, record, used_cycle)
    assert any(refused)
    assert not all(refused)


def test_bytes_that_are_no_record_are_refused():
    kept = {"motion": (_core.Trajectory, RUNS["two subsystems"].core), "orbit": (_core.Cycle, CYCLE.core)}
    for name, (kind, core) in kept.items():
        read = partial(kind.from_record, CYCLE.scene.core)
        record = core.record()
        head = record.index(name.encode()) + len(name)
        later = record[:head] + bytes([record[head] + 1]) + record[head + 1 :]
        with pytest.raises(ss.InputError, match=f"format {record[head] + 1}.*reads format {record[head]}"):
            read(later)
        (other,) = (core.record() for key, (_, core) in kept.items() if key != name)
        for wrong in (None, 1.0, [], {}, "text", b"", record[:-1], record + b"\0", other):
            with pytest.raises(ss.InputError, match="record: "):
                read(wrong)
