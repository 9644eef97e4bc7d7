"""What motions settle to: where they start, how long they are watched, what their end is called."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import TypeAlias

import numpy as np

from stickslip import _core
from stickslip.faults import InputError
from stickslip.modes.complex_modes import complex_modes
from stickslip.modes.modes import Modes
from stickslip.motion.motion import Motion
from stickslip.scene.checks import Real, finite_time
from stickslip.scene.scene import Scene
from stickslip.scene.state import State, steady_sliding

#: Lyapunov exponent, 1/s, its standard error, and the time it was measured over, s; nan where there is none.
Growth: TypeAlias = tuple[float, float, float]
#: What the core says a motion settles to: kind, cycle, growth of neighbours, last stretch of the motion.
Settled: TypeAlias = "_core._Settled"
#: That, and why the last stretch ended.
Outcome: TypeAlias = tuple[Settled, str]

#: Labels of starts that violate their combination, and of those that an interrupt came before.
OUTSIDE, UNKNOWN = -1, -2
#: Periods of the slowest mode of sliding between first looks at a motion: some tens of periods of a cycle.
STRETCH = 60.0
#: Modes nearest to zero among which the slowest that moves is looked for.
SLOWEST = 12
#: First looks' time after which a motion counts as one that does not recur.
LOOKS = 30
#: Growth of the disturbance, as a power of e, over the transient that is shown.
GROWTH = 30.0
#: Bounds of its length, in periods of the leading mode.
SHORTEST, LONGEST = 20.0, 400.0
#: Part of the slider speed at which the most unstable mode starts.
DISTURBANCE = 0.5
#: Part of this below which a disturbance is none.
LEAST_PART = 1e-12
#: Growth of neighbours, as a power of e, beyond which it says something: less is what the shape of a torus
#: makes of them.
DECIDED = 2.0
#: What helps where a motion was followed too short.
LONGER = "follow it longer: give further, or a longer duration"
#: Standard errors from zero at which a growth rate has a sign.
CERTAIN = 3.0


def disturbed_sliding(scene: Scene, *, band: tuple[float, float] | None = None) -> State:
    """Return steady sliding with its fastest growing mode set in motion.

    The mode is added as a velocity alone. It is so small that no contact has a tangential velocity above half
    of its slider speed, so that every contact goes on sliding; contacts whose slider rests,
    such as stops, set no such bound. Nor does damping take more than half of the normal force of a contact.

    Parameters
    ----------
    scene
        A scene with a sliding equilibrium.
    band
        Lowest and highest frequency of the modes among which the fastest growing one is chosen, Hz; of a
        large scene no others are computed. None: all modes.

    Raises
    ------
    InputError
        If there is no sliding equilibrium, or no mode in the band.
    """
    start = steady_sliding(scene)
    modes = complex_modes(scene, start.combination, band=band)
    if not len(modes):
        if band is not None:
            raise InputError(f"band: steady sliding has no mode from {band[0]:g} to {band[1]:g} Hz")
        raise InputError("scene: steady sliding has no mode that could be set in motion")
    return set_in_motion(scene, start, modes)


def set_in_motion(scene: Scene, start: State, modes: Modes) -> State:
    """Return what `disturbed_sliding` does from a sliding equilibrium whose modes are known already."""
    shape = modes.shapes[:, int(np.argmax(modes.eigenvalues.real))].real
    slips = [
        abs(float(scene.tangential_direction(i) @ shape)) / abs(contact.slider_speed)
        for i, contact in enumerate(scene.contacts)
        if contact.slider_speed
    ]
    largest = max(slips, default=0.0)
    velocity = shape * (DISTURBANCE / largest if largest > 0.0 else 1e-3)
    moving = start.perturbed(velocity=velocity)
    pressed = start.contact_forces(scene).normal_force.to_numpy()
    part = 1.0
    while part > LEAST_PART and not _stays_pressed(scene, moving, pressed):
        part *= 0.5
        moving = start.perturbed(velocity=part * velocity)
    return moving


def _stays_pressed(scene: Scene, moving: State, pressed: Real) -> bool:
    """Return whether the velocity of a state takes at most half of the normal forces at rest, by damping."""
    try:
        forces = moving.contact_forces(scene).normal_force.to_numpy()
    except InputError:
        # A contact would pull.
        return False
    return bool((forces >= (1.0 - DISTURBANCE) * pressed).all())


def at_rest(scene: Scene) -> State:
    """Return an equilibrium in which every contact whose slider rests sticks without a friction force.

    All other contacts slide or are open. This is where a motion starts in a scene that has no steady sliding
    because a slider rests, such as a joint under a harmonic load.
    """
    resting = [contact.tangential is not None and not contact.slider_speed for contact in scene.contacts]
    if not any(resting):
        raise InputError("scene: no slider rests, so a motion starts from steady sliding")
    # Without friction the direction in which a contact slides is of no account.
    held = [
        dataclasses.replace(one, friction=0.0, static_friction=None, slider_speed=1.0) if rests else one
        for one, rests in zip(scene.contacts, resting, strict=True)
    ]
    found = steady_sliding(scene.replace(contacts=held))
    letters = [
        "s" if rests and letter != "d" else letter
        for rests, letter in zip(resting, found.combination, strict=True)
    ]
    return State(found.position, found.velocity, "".join(letters), scene.dofs)


def shown_duration(modes: Modes) -> float:
    """Return how long the leading mode takes to show itself, s."""
    leading = modes.eigenvalues[int(np.argmax(modes.eigenvalues.real))]
    frequency = abs(leading.imag) / (2.0 * np.pi) or abs(leading) or 1.0
    growth = abs(leading.real)
    periods = GROWTH / growth * frequency if growth > 0.0 else LONGEST
    return float(min(max(periods, SHORTEST), LONGEST) / frequency)


def affordable_search(run: Motion, longest: float, most_events: int) -> float:
    """Return how much longer a motion can be followed, s: at most `longest`, and about so many events.

    The events are expected to go on at the rate of the second half of the motion, so that the limit counts
    work and reads no clock.
    """
    half = 0.5 * run.duration
    late = np.count_nonzero(run.events.time > half)
    return min(longest, most_events * half / late) if late else longest


def described(kind: str, growth: Growth, stop_message: str) -> tuple[str, str]:
    """Return what a motion without limit cycle is, and that in a sentence."""
    if kind == "equilibrium":
        return kind, "the motion settles to an equilibrium: every mode decays and no event can follow"
    if kind == "unbounded":
        return kind, "the motion grows without bound"
    if kind == "stopped":
        return kind, f"the run could not go on: {stop_message}"
    exponent, error, time = growth
    if np.isnan(exponent):
        return "undecided", f"the motion was followed too short to say what it settles to; {LONGER}"
    if exponent == -np.inf:
        met = f"its difference from a neighbouring motion vanishes within {time:g} s"
        return "unsettled", f"the motion has not settled yet: {met}; {LONGER}"
    shown = f"largest Lyapunov exponent {exponent:.4g} +- {error:.2g} 1/s over {time:g} s"
    if exponent * time > DECIDED and exponent > CERTAIN * error:
        return "chaotic", f"the motion is chaotic: {shown}"
    if exponent * time < -DECIDED and exponent < -CERTAIN * error:
        return "unsettled", f"the motion has not settled yet ({shown}); {LONGER}"
    if abs(exponent) * time <= DECIDED and error * time <= DECIDED:
        return (
            "quasi-periodic",
            f"the motion does not recur, and its neighbours neither part nor meet: {shown}",
        )
    return (
        "undecided",
        f"the motion does not recur, and whether its neighbours part is not sure: {shown}; {LONGER}",
    )


def settled(
    scenes: Sequence[Scene], starts: Sequence[State], stretch: float, limit: float, *, runs: bool = False
) -> tuple[list[Outcome | None], BaseException | None]:
    """Return what the motion from every start settles to, and what interrupted the search, if anything did.

    What was not done by then is None. The last stretches of the motions come with them if `runs`.
    """
    ordered = [state.ordered(scene.dofs) for scene, state in zip(scenes, starts, strict=True)]
    parts = [(state.position, state.velocity, state.statuses) for state in ordered]
    return _core.settle_all([scene.core for scene in scenes], parts, stretch, limit, runs)


def is_valid(scene: Scene, state: State) -> bool:
    """Return whether a state satisfies its combination in a scene."""
    state = state.ordered(scene.dofs)
    try:
        scene.core.check_state(state.position, state.velocity, state.statuses)
    except InputError:
        return False
    return True


def starts_from(
    start: State | Callable[[Scene], State] | None,
    default: Callable[[Scene], State] = disturbed_sliding,
) -> Callable[[Scene], State]:
    """Return the start of a motion as a function of the scene; None: the `default`."""
    if start is None:
        return default
    if isinstance(start, State):
        return lambda scene: start
    if callable(start):
        return start
    raise InputError(f"start: expected a State or a function from a Scene to one, got {start!r}")


def stretch_of(scene: Scene, stretch: float | None) -> float:
    """Return the time between two looks, by default from the slowest mode of sliding, s."""
    if stretch is not None:
        return finite_time("stretch", stretch)
    # Of a large scene no others are computed than the slowest, and those that stand still.
    for count in (SLOWEST, 2 * scene.size):
        moving = np.abs(complex_modes(scene, near=0.0, count=count).eigenvalues)
        slowest = moving[moving > 0.0].min(initial=np.inf)
        if np.isfinite(slowest):
            break
    if not np.isfinite(slowest):
        raise InputError("stretch: give it in s, since the scene has no mode that sets a time scale")
    return float(STRETCH * 2.0 * np.pi / slowest)
