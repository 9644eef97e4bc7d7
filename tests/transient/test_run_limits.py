"""How a run ends before its duration, and what it leaves."""

import os
import pickle
import signal
import sys
import time

import numpy as np
import pytest

import interrupts
import stickslip as ss
from equal_chain import long_chain
from one_mass import oscillator

#: s; a run that reaches it did not stop
ENDLESS = 1e9


def chattering_belt(**changes):
    """A mass on a belt, with static friction: two events every few milliseconds, for ever."""
    return oscillator(friction=0.3, static=0.6, speed=0.1, **changes), ss.State([0.0, 0.0], [0.1, 0.0], "s")


def test_time_limit():
    scene, start = chattering_belt()
    began = time.perf_counter()
    run = ss.simulate(scene, ENDLESS, start, time_limit=0.1)
    elapsed = time.perf_counter() - began
    assert run.stop_reason == "time_limit"
    # Asked every tenth of a millisecond or panel; the rest is the conversion of the events.
    assert elapsed >= 0.1
    assert 0.0 < run.duration < ENDLESS
    assert len(run.events) > 100
    assert run.events.time[-1] <= run.duration
    assert np.isfinite(run.state(run.duration).position).all()


@pytest.mark.parametrize("most", [0, 1, 7])
def test_max_events(most):
    scene, start = chattering_belt()
    run = ss.simulate(scene, ENDLESS, start, max_events=most)
    assert run.stop_reason == "max_events"
    assert len(run.events) == most
    assert run.duration == (run.events.time[-1] if most else 0.0)


INTERRUPTED = """
    import numpy as np
    import stickslip as ss
    from interrupts import Interrupt
    from test_run_limits import ENDLESS, SCENE

    scene, start = SCENE()
    interrupt = Interrupt(after=0.3)
    try:
        ss.simulate(scene, ENDLESS, start, method=METHOD)
    except KeyboardInterrupt as stopped:
        unheard = interrupt.unheard()
        run = stopped.partial
        run.state(run.duration)
        assert run.stop_reason == "interrupted"
        assert np.all(np.diff(run.events.time) >= 0.0) and run.events.time[-1] <= run.duration
        print(unheard, run.duration, len(run.events), flush=True)
    else:
        raise SystemExit("not interrupted")
"""


@pytest.mark.process
@pytest.mark.skipif(sys.platform == "win32", reason="SIGINT to one process")
@pytest.mark.parametrize(
    ("scene", "method"), [(chattering_belt, "auto"), (long_chain, "taylor"), (long_chain, "local")]
)
def test_ctrl_c_stops_a_run_and_keeps_it(scene, method):
    program = INTERRUPTED.replace("SCENE", scene.__name__).replace("METHOD", repr(method))
    printed = interrupts.printed(program, timeout=120, folders=[os.path.dirname(__file__)])
    unheard, duration, events = map(float, printed.split())
    # The promise in s of processor time, with the conversion of the events so far.
    assert unheard <= 0.2
    assert 0.0 < duration < ENDLESS
    assert events >= 1


def test_growth_without_bound_ends_with_the_part_computed():
    """A negative spring under friction without any stop: e^(r t) leaves the range of numbers at 709 / r."""
    scene = ss.Scene(
        [1.0, 1.0, 1.0],
        np.diag([-1e4, 5e4, 1e4]),
        force=[0.0, -20.0, 0.0],
        contacts=[ss.Contact(tangential=2, normal=1, friction=0.3, slider_speed=0.1)],
    )
    start = ss.steady_sliding(scene).perturbed(position={"x1": 1e-6})
    for method in ("modal", "taylor"):
        run = ss.simulate(scene, 100.0, start, method=method)
        assert run.stop_reason == "unbounded"
        # 5e-7 e^(100 t) = 1.8e308 at 7.24 s.
        latest = (np.log(np.finfo(float).max) - np.log(5e-7)) / 100.0
        assert 0.8 * latest < run.duration <= latest
        end = run.state(run.duration)
        assert np.isfinite(end.position).all()
        # The exponent carries the rounding of the rate.
        assert np.log(end.position[0]) == pytest.approx(np.log(5e-7) + 100.0 * run.duration, abs=1e-11)


def test_a_flutter_without_any_limit_but_lift_off():
    """Friction 3 under a thousandfold load: it grows through lift-off and impacts, in bounded work."""
    scene = ss.models.two_subsystems(friction=3.0, slider_speed=1e9, preload_displacement=1.0)
    start = ss.steady_sliding(scene).perturbed(velocity={"x1": 1e-3})
    run = ss.simulate(scene, 0.5, start, max_events=2000)
    assert run.stop_reason in ("duration", "max_events")
    assert {"release", "impact"} <= set(run.events.kind)
    assert np.isfinite(run.state(run.duration).position).all()


@pytest.fixture
def tangent():
    """g = h + a - a cos(w t) .. touches zero after a full cycle: an undamped mass released at the stop."""
    scene = oscillator(load=(0.0, 40.0), restitution=0.5)
    return scene, ss.State([0.0, 0.0], [0.0, 0.0], "d"), 2.0 * np.pi / np.sqrt(5e4 / 1.5)


@pytest.mark.parametrize("method", ["modal", "taylor"])
def test_a_touch_within_rounding_is_reported(tangent, method):
    scene, start, period = tangent
    run = ss.simulate(scene, 1.5 * period, start, method=method)
    (touch,) = run.grazings
    # A double root: rounding moves it by the square root of itself.
    assert touch.time == pytest.approx(period, rel=np.sqrt(100 * np.finfo(float).eps))
    assert (touch.contact, touch.alternative) == (0, "impact")
    assert abs(touch.value) <= touch.uncertainty
    # The load counts in the row of the mass, too.
    assert touch.uncertainty <= 2e-12 * 40.0 / 5e4
    assert len(run.events) == 0
    assert run.stop_reason == "duration"


def test_on_grazing_stop(tangent):
    scene, start, period = tangent
    run = ss.simulate(scene, 1.5 * period, start, on_grazing="stop")
    assert run.stop_reason == "grazing"
    assert len(run.grazings) == 1
    assert run.duration == pytest.approx(run.grazings[0].time, abs=np.spacing(period))
    assert run.duration == pytest.approx(period, rel=np.sqrt(100 * np.finfo(float).eps))
    # It can be taken up again from there, on either branch.
    assert run.state(run.duration).combination == "d"


def test_a_motion_ends_at_an_event_that_no_phase_can_follow():
    # Two modes of sliding at friction 0.5 are equal and have one shape between them.
    stiffness = np.array([[2.0, 0.0, 0.5], [0.0, 10.0, 2.0], [0.5, 2.0, 1.0]])
    contact = ss.Contact(tangential=0, normal=1, friction=0.5, slider_speed=5.0)
    scene = ss.Scene(mass=np.ones(3), stiffness=stiffness, force=[0.0, -1.0, 0.0], contacts=[contact])
    start = ss.State([0.0, 0.1, 0.0], np.zeros(3), "d", dofs=scene.dofs)
    with pytest.raises(ss.RunError, match="defective") as stopped:
        ss.simulate(scene, 3.0, start, method="modal")
    run = stopped.value.partial
    whole = ss.simulate(scene, 3.0, start, method="taylor")
    assert run.duration == pytest.approx(whole.events.time[0], rel=1e-12)
    # The event itself is not part of the motion: the state at its end is the one before it.
    assert not run.events.combination.size
    assert run.state(run.duration).combination == "d"
    assert pickle.loads(pickle.dumps(run)).duration == run.duration
    with pytest.raises(ss.NotPeriodicError):
        run.limit_cycle(further=0.0)


class OverdueError(Exception):
    """What a signal handler raises, as that of a test runner with a time limit does."""


def looked_for(scene, start):
    ss.simulate(scene, 0.01, start).limit_cycle(further=ENDLESS)


def run_on(scene, start):
    ss.simulate(scene, ENDLESS, start)


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="there is no timer of signals")
@pytest.mark.parametrize("work", [run_on, looked_for])
def test_what_a_signal_handler_raises_passes(work):
    def overdue(_signal, _frame):
        raise OverdueError("too late")

    before = signal.signal(signal.SIGALRM, overdue)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.3)
        with pytest.raises(OverdueError, match="too late"):
            work(*two_weakly_tied_blocks())
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
    # Nothing of it is left for the next run.
    scene, start = chattering_belt()
    assert ss.simulate(scene, 0.1, start).stop_reason == "duration"


def two_weakly_tied_blocks():
    """Blocks on belts of their own, on a torus that is watched without end."""
    stiffness = np.diag([1e4, 137.0**2, 1e4, 1e4])
    stiffness[:2, :2] += np.array([[10.0, -10.0], [-10.0, 10.0]])
    contacts = [
        ss.Contact(tangential=k, normal=k + 2, friction=0.21, static_friction=0.5, slider_speed=0.1)
        for k in (0, 1)
    ]
    scene = ss.Scene(
        [1.0] * 4,
        stiffness,
        damping=ss.Rayleigh(stiffness=1e-4),
        force=[0.0, 0.0, -100.0, -100.0],
        contacts=contacts,
    )
    return scene, ss.steady_sliding(scene).perturbed(velocity={"x1": -0.5, "x2": -0.5})
