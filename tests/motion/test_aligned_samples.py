import numpy as np
import pytest

import stickslip as ss


@pytest.fixture(scope="module")
def run():
    scene = ss.Scene(
        [1.0, 1.0],
        np.diag([100.0, 1.0]),
        force=[0.0, -10.0],
        contacts=[ss.Contact(tangential=0, normal=1, friction=0.5, restitution=0.5, name="ball")],
    )
    return ss.simulate(scene, 0.4, ss.State([0.0, 0.1], [0.0, 0.0], "d"))


def test_without_times_both_sides_of_every_event_are_sampled(run):
    found = run.sample()
    time, instant = found.time.to_numpy(), found.instant.to_numpy()
    assert (np.diff(time) > 0.0).all()
    assert (instant[0], instant[-1]) == ("start", "end")
    assert (time[0], time[-1]) == (0.0, run.duration)
    events = np.unique(run.events.time)
    assert events.size > 3
    assert (time[instant == "after"] == events).all()
    assert (time[instant == "before"] == np.nextafter(events, 0.0)).all()
    assert set(instant) == {"start", "before", "after", "end"}
    # Newton's law of impact holds across each pair, and the ball is where it was.
    before, after = (found.isel(time=np.flatnonzero(instant == side)) for side in ("before", "after"))
    assert after.velocity[:3, 1].to_numpy() == pytest.approx(
        -0.5 * before.velocity[:3, 1].to_numpy(), rel=1e-12
    )
    assert after.position.to_numpy() == pytest.approx(before.position.to_numpy(), abs=1e-15)


def test_instants_between_events_part_each_phase_evenly(run):
    found = run.sample(between=3)
    time, instant = found.time.to_numpy(), found.instant.to_numpy()
    ends = np.unique([0.0, *run.events.time, run.duration])
    inside = time[instant == "between"].reshape(ends.size - 1, 3)
    assert inside == pytest.approx(ends[:-1, None] + np.diff(ends)[:, None] * [[0.25, 0.5, 0.75]], rel=1e-14)


def test_a_motion_without_events_has_its_ends(run):
    scene = ss.models.two_subsystems(friction=0.1)
    quiet = ss.simulate(scene, 0.1, ss.steady_sliding(scene))
    assert quiet.sample().instant.to_numpy().tolist() == ["start", "end"]
    with pytest.raises(ss.InputError, match="between: expected 0 where times are given, got 2"):
        run.sample([0.1], between=2)
    with pytest.raises(ss.InputError, match="between: expected an integer >= 0, got -1"):
        run.sample(between=-1)


def test_what_touches_or_ends_a_phase_names_its_contact():
    scene = ss.models.two_subsystems()
    named = scene.replace(
        contacts=[
            ss.Contact(tangential="x3", normal="x4", friction=1.5, slider_speed=0.025, name="left"),
            ss.Contact(tangential="x7", normal="x8", friction=1.5, slider_speed=0.025, name="right"),
        ]
    )
    cycle = ss.simulate(named, 0.6, ss.steady_sliding(named).perturbed(velocity={"x1": 1e-3})).limit_cycle()
    names = ("left", "right")
    assert {phase.name for phase in cycle.phases} == set(names)
    assert all(phase.name == names[phase.contact] for phase in cycle.phases)
    assert cycle.margins()
    assert all(margin.name == names[margin.contact] for margin in cycle.margins())
