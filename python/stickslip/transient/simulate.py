"""The nonlinear transient: exact motion between status changes, and the changes."""

from __future__ import annotations

from typing import Any, Literal

from stickslip import _core
from stickslip.cycles.attractors import disturbed_sliding
from stickslip.faults import InputError, Interrupted
from stickslip.motion.errors import RunError
from stickslip.scene.checks import real_number, whole_number
from stickslip.scene.scene import Scene, checked
from stickslip.scene.state import State
from stickslip.transient.trajectory import Trajectory


def simulate(
    scene: Scene,
    duration: float,
    start: State | None = None,
    *,
    method: Literal["auto", "modal", "taylor", "local"] = "auto",
    max_events: int | None = None,
    time_limit: float | None = None,
    accumulation_tolerance: float = 0.0,
    on_grazing: Literal["keep", "stop"] = "keep",
) -> Trajectory:
    """Return the motion of a scene from a start.

    Parameters
    ----------
    scene
        The scene.
    duration
        > 0, s.
    start
        State at t = 0; it must satisfy its own combination. None: `disturbed_sliding`, which is steady
        sliding with its fastest growing mode set in motion.
    method
        How phases are propagated: ``modal`` in modal coordinates, ``taylor`` by Taylor series, ``auto`` by
        whichever is well-conditioned and takes less work. The choice counts operations and reads no clock, so
        the same arguments give the same run. ``local`` is for large sparse scenes with lumped mass: by Taylor
        series, of which an event restarts only those that it can reach. The motion is the same to rounding;
        beyond some 200 coordinates ``auto`` takes it.
    max_events
        Stop after that many events; None: ten million events are an error, before they fill the memory.
    time_limit
        Stop after that much wall-clock time, s; None: no limit.
    accumulation_tolerance
        Bounces whose remaining times sum to less than this, s, are replaced by their limit: the contact comes
        to rest there, as one event ``accumulation`` (see `Trajectory.accumulations`). At least one ulp of t.
    on_grazing
        What to do where an event function touches zero within rounding: ``keep`` the status and go on, or
        ``stop`` the run at the touch.

    Raises
    ------
    InputError
        If an argument is ill-posed, the start penetrates or violates its combination, or there is no start
        and no steady sliding.
    RunError
        If the motion cannot be continued; `RunError.partial` holds it up to there.
    Interrupted
        On Ctrl-C; a `KeyboardInterrupt` that holds the motion up to there.
    """
    checked(scene)
    if not isinstance(start, State | None):
        raise InputError(f"start: expected a State or None, got {start!r}")
    settings = run_settings(duration, method, max_events, time_limit, accumulation_tolerance, on_grazing)
    start = (disturbed_sliding(scene) if start is None else start).ordered(scene.dofs)
    core = _core.Trajectory.simulate(scene.core, start.position, start.velocity, start.statuses, *settings)
    run = Trajectory(scene, start, core)
    if run.stop_reason in ("failed", "chattering"):
        raise RunError(core.stop_message, run)
    if run.stop_reason == "interrupted":
        raise Interrupted(f"interrupted after {run.duration:g} s of motion", run)
    return run


#: duration, method, max_events, time_limit, accumulation_tolerance, on_grazing
RunSettings = tuple[
    float,
    Literal["auto", "modal", "taylor", "local"],
    int | None,
    float | None,
    float,
    Literal["keep", "stop"],
]


def run_settings(
    duration: Any,
    method: Any,
    max_events: Any,
    time_limit: Any,
    accumulation_tolerance: Any,
    on_grazing: Any,
) -> RunSettings:
    """Return what a run takes besides scene and start, as the core takes it."""
    if method not in ("auto", "modal", "taylor", "local"):
        raise InputError(f"method: expected 'auto', 'modal', 'taylor' or 'local', got {method!r}")
    if on_grazing not in ("keep", "stop"):
        raise InputError(f"on_grazing: expected 'keep' or 'stop', got {on_grazing!r}")
    return (
        real_number("duration", duration),
        method,
        None if max_events is None else whole_number("max_events", max_events, 0),
        None if time_limit is None else real_number("time_limit", time_limit),
        real_number("accumulation_tolerance", accumulation_tolerance),
        on_grazing,
    )
