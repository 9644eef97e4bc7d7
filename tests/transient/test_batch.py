"""Many runs at once give what they give alone, whatever happens to some of them."""

import os
import signal
import threading
import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import stickslip as ss
from random_scenes import drawn_scenes
from stickslip import types
from stickslip.transient.batch import WINDOW

KICK = {"x1": 1e-3}


def random_models(count, seed=0):
    rng = np.random.default_rng(seed)
    for friction, speed in zip(rng.uniform(0.9, 2.4, count), rng.uniform(0.01, 0.1, count), strict=True):
        yield ss.models.two_subsystems(friction=friction, slider_speed=speed)


def digest(outcome):
    """Everything a run consists of, to the last bit."""
    run = outcome.run
    end = run.state(run.duration)
    return (
        outcome.index,
        run.events.time.tobytes(),
        run.events.combination.tolist(),
        end.position.tobytes(),
        end.velocity.tobytes(),
        run.counters,
        run.stop_reason,
    )


@pytest.fixture(scope="module")
def alone():
    starts = [(scene, ss.steady_sliding(scene).perturbed(velocity=KICK)) for scene in random_models(50)]
    runs = [ss.simulate(scene, 0.2, start) for scene, start in starts]
    assert sum(len(run.events) for run in runs) > 1000
    return [digest(types.Outcome(i, run.scene, run, None)) for i, run in enumerate(runs)]


@pytest.mark.parametrize("threads", [1, 2, 5, None])
def test_every_run_is_what_it_is_alone(alone, threads):
    outcomes = ss.simulate_many(random_models(50), duration=0.2, velocity=KICK, threads=threads)
    assert [digest(outcome) for outcome in outcomes] == alone


@settings(max_examples=10)
@given(drawn_scenes(), st.integers(1, 4))
def test_many_starts_of_one_scene(drawn, threads):
    starts = [drawn.kicked(strength) for strength in np.linspace(0.3, 2.0, 8)]
    # A scene that remembers combinations gives the same motion and counts the same work.
    alone = [ss.simulate(drawn.scene.replace(), 0.02, start) for start in starts]
    together = ss.simulate_many(drawn.scene, starts, duration=0.02, threads=threads)
    expected = [digest(types.Outcome(i, drawn.scene, run, None)) for i, run in enumerate(alone)]
    assert [digest(outcome) for outcome in together] == expected


def test_failure_is_data():
    good = ss.models.two_subsystems()
    resting = ss.models.two_subsystems(slider_speed=0.0)
    outcomes = list(ss.simulate_many([good, resting, good], duration=0.05))
    assert [outcome.index for outcome in outcomes] == [0, 1, 2]
    assert [outcome.run is None for outcome in outcomes] == [False, True, False]
    assert [outcome.error is None for outcome in outcomes] == [True, False, True]
    assert isinstance(outcomes[1].error, ss.InputError)
    assert "slider_speed" in str(outcomes[1].error)
    starts = [ss.steady_sliding(good), ss.State([0.0] * 8, [0.0] * 8, "+")]
    first, second = ss.simulate_many(good, starts, duration=0.05)
    assert first.error is None
    assert second.run is None
    assert "one letter" in str(second.error)


def test_scenes_are_drawn_as_they_are_needed():
    drawn = 0

    def scenes():
        nonlocal drawn
        for scene in random_models(200):
            drawn += 1
            yield scene

    outcomes = ss.simulate_many(scenes(), duration=0.01, threads=2)
    for handed_out, _ in enumerate(outcomes):
        assert drawn <= handed_out + 2 * WINDOW
    assert drawn == 200


def interrupted_after(runs, count):
    """Hand on the runs; Ctrl-C when that many are done."""
    for done, outcome in enumerate(runs, 1):
        yield outcome
        if done == count:
            threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGINT)).start()


def test_interruption_hands_out_what_is_done_and_stops_the_rest():
    quick = [ss.models.two_subsystems(friction=0.3)] * 8  # stable: at rest
    endless = ss.models.two_subsystems()
    starts = [ss.steady_sliding(scene) for scene in quick]
    starts += [ss.steady_sliding(endless).perturbed(velocity=KICK)] * 8
    outcomes = []
    begin = time.process_time()
    runs = ss.simulate_many([*quick, *[endless] * 8], starts, duration=3600.0, threads=2)
    with pytest.raises(KeyboardInterrupt):
        outcomes.extend(interrupted_after(runs, len(quick)))
    # Processor time, s; the eight hours of motion would take more than a minute of it.
    assert time.process_time() - begin < 10.0
    assert [outcome.index for outcome in outcomes] == list(range(8))
    assert all(outcome.run.stop_reason == "duration" for outcome in outcomes)


def test_leaving_the_loop_stops_the_runs():
    quick, endless = ss.models.two_subsystems(friction=0.3), ss.models.two_subsystems()
    starts = [ss.steady_sliding(quick)]
    starts += [ss.steady_sliding(endless).perturbed(velocity=KICK)] * 8
    outcomes = ss.simulate_many([quick, *[endless] * 8], starts, duration=3600.0, threads=2)
    assert next(outcomes).run.stop_reason == "duration"
    begin = time.process_time()
    outcomes.close()
    time.sleep(0.2)
    assert time.process_time() - begin < 2.0


def test_what_a_generator_raises_passes():
    def broken():
        yield None
        raise ValueError("generator broke")

    with pytest.raises(ValueError, match="generator broke") as raised:
        list(ss.simulate_many(list(random_models(2)), broken(), duration=0.01))
    assert not isinstance(raised.value, ss.InputError)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"scenes": 3}, "scenes: expected a sequence, got 3"),
        ({"scenes": ["++"]}, r"scenes\[0\]: expected a Scene"),
        ({"starts": [None, 1]}, r"starts\[1\]: expected a State, got 1"),
        ({"starts": [None]}, "starts: expected one per scene, got 1 starts and more scenes"),
        ({"starts": [None] * 3}, "starts: expected one per scene, got 2 scenes and more starts"),
        ({"threads": 0}, "threads: expected an integer >= 1"),
        ({"threads": 100_000}, "threads: expected an integer <= 1024, got 100000"),
        ({"method": "euler"}, "method"),
        ({"velocity": {"x11": 1.0}}, "unknown dof 'x11'"),
    ],
)
def test_ill_posed_arguments(arguments, message):
    scenes = list(random_models(2))
    with pytest.raises(ss.InputError, match=message):
        list(ss.simulate_many(**{"scenes": scenes, "duration": 0.01, **arguments}))
