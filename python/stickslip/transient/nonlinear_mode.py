"""Nonlinear modes: frequency and damping of a mode over its amplitude."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse

from stickslip.cycles.attractors import at_rest, is_valid
from stickslip.cycles.branches.arclength import Curve
from stickslip.cycles.branches.branch import Branch, Placed, along_branch, continued
from stickslip.cycles.cycle import Cycle
from stickslip.faults import InputError, Interrupted, OrbitError
from stickslip.modes.complex_modes import complex_modes
from stickslip.modes.modes import Mode
from stickslip.motion.errors import NotPeriodicError
from stickslip.motion.motion import Motion
from stickslip.scene.checks import Real, real_array, whole_number
from stickslip.scene.contact import nearest
from stickslip.scene.laws.damping import Rayleigh, rayleigh_matrix
from stickslip.scene.scene import Scene, checked
from stickslip.scene.state import State, steady_sliding
from stickslip.transient.simulate import simulate
from stickslip.transient.trajectory import Trajectory

#: Instants of a period at which a motion is looked at, and periods until an amplitude is given up.
INSTANTS, MOTIONS = 128, 120
#: How often the amplitude of the linear motion that begins is halved until all contacts keep their statuses.
HALVINGS = 40
#: Part of the distance to the amplitude wanted, as a power of e, by which a motion grows in a period; and the
#: largest delta that lets it grow, of the angular frequency.
APPROACH, MOST = 0.3, 0.2
#: Growth in a period, and distance from the amplitude wanted, as powers of e, at which Newton's method
#: begins.
STEADY, NEAR = 3e-2, 0.1
#: Instants of a period at which a motion may go on under another delta.
LATEST = 16
#: Periods in which Newton's method looks for an orbit, and durations of this in which the motion may settle.
PERIODS, SETTLING = 4, 3.0
#: Parts of the rest of M that are fed, one after the other.
SHARES = (0.25, 0.5, 0.75, 1.0)
#: Ratio of amplitudes up to which the orbit that Newton's method finds is the one that was looked for.
OTHER = 1.5
#: First step along the branch, steps to an amplitude, its accuracy, and the change that may be the last.
FIRST, STEPS, ROUNDING, NEARLY = 1e-4, 40, 1e-14, 1e-10


def nonlinear_mode(scene: Scene, mode: int, amplitudes: Sequence[float], *, dof: str | None = None) -> Branch:
    """Return the periodic motions into which a mode grows, over its amplitude.

    Friction and nonlinear springs change frequency and damping of a mode with its amplitude. For each
    amplitude there is a delta for which the motion under the damping ``C - delta M`` is periodic: delta feeds
    in what the scene loses in a period (extended periodic motion concept, Krack, Computers and Structures
    154, 2015). With the angular frequency omega of that motion the damping ratio of the mode is
    ``delta / (2 omega)``; for small amplitudes delta is ``-2 Re(lambda)``. Where delta is 0 the motion is a
    limit cycle of the scene itself, stable or not.

    Parameters
    ----------
    scene
        A scene with contacts and without loads in time. The mode is one of rest: contacts whose slider rests
        stick, all others are as in steady sliding.
    mode
        Number of the mode among those of `complex_modes` of that combination, from 0 on.
    amplitudes
        (k,), m, positive and ascending: half the distance between both ends of the motion of `dof`. Without
        elements and laws of friction each has to be large enough for an event: below, the mode is the linear
        one.
    dof
        Name of the dof; None: the one that moves most in the linear mode.

    Returns
    -------
    Branch
        Its `data` over ``point``, with ``delta`` (1/s) as a coordinate: as `continuation` for its cycles, and
        ``frequency`` Hz, ``damping_ratio`` and ``followed``. Its `cycles`, and so their multipliers, are
        those of the scene with ``C - delta M``. No `points` are looked for; `end` is ``range``.

    Raises
    ------
    InputError
        If the scene has loads in time or no contact, the mode does not oscillate, or an argument is
        ill-posed.
    OrbitError
        If no periodic motion of an amplitude is found; the message names the amplitude. The periodic motion
        is not a single one, and not found, where a contact sticks all the time with any friction force, or
        where every amplitude has the same delta. Its ``partial`` holds the amplitudes found before.
    Interrupted
        On Ctrl-C; a `KeyboardInterrupt` whose ``partial`` holds the amplitudes found by then.
    """
    checked(scene)
    if scene.loads:
        raise InputError("scene: a nonlinear mode is free, without loads in time")
    if not scene.contacts:
        raise InputError("scene: expected a contact, at whose events or turns a periodic motion begins")
    wanted = real_array("amplitudes", amplitudes, 1)
    if not wanted.size or not (np.diff(wanted, prepend=0.0) > 0.0).all() or not np.isfinite(wanted).all():
        raise InputError(f"amplitudes: expected positive and ascending numbers, got {amplitudes!r}")
    if dof is not None and dof not in scene.dofs:
        raise InputError(f"dof: the scene has no dof {dof!r}{nearest(str(dof), scene.dofs)}")
    resting = any(one.tangential is not None and not one.slider_speed for one in scene.contacts)
    rest = at_rest(scene) if resting else steady_sliding(scene)
    modes = complex_modes(scene, rest.combination)
    number = whole_number("mode", mode, 0)
    if number >= len(modes):
        raise InputError(f"mode: there are {len(modes)} modes, numbered from 0, got {mode!r}")
    linear = modes[number]
    if not linear.eigenvalue.imag > 0.0:
        raise InputError(f"mode: number {number} does not oscillate, lambda = {linear.eigenvalue:.6g} 1/s")
    place = int(np.abs(linear.shape).argmax()) if dof is None else scene.dofs.index(dof)
    if linear.shape[place] == 0.0:
        raise InputError(f"dof: {scene.dofs[place]} does not move in mode {number}")
    shape = (linear.shape / linear.shape[place]).real
    search = _Search(_Feeding.of(scene, shape), rest, linear, place)
    guess = search.begin(float(wanted[0]))
    found: list[Placed] = []
    for amplitude in wanted.tolist():
        try:
            found.append(search.orbit(guess, amplitude))
            guess = search.after(*found[-1])
        except OrbitError as error:
            error.partial = _branch(found) if found else None
            raise
        except KeyboardInterrupt as interrupt:
            partial = _branch(found) if found else None
            done = f"interrupted after {len(found)} of {wanted.size} amplitudes"
            raise Interrupted(done, partial) from interrupt
    return _branch(found)


def _branch(found: Sequence[Placed]) -> Branch:
    """Return the motions of a mode, each with its delta."""
    data = along_branch("delta", found, {"units": "1/s"})
    data["frequency"] = ("point", 1.0 / data.period.to_numpy(), {"units": "Hz"})
    data["damping_ratio"] = ("point", (data.delta * data.period / (4.0 * np.pi)).to_numpy(), {"units": "1"})
    cycles = tuple(cycle for _, cycle in found)
    return Branch(data, cycles, (), "range")


@dataclass(frozen=True)
class _Feeding:
    """A scene that is fed with energy: its mass and damping matrices, and the linear mode, (n,)."""

    scene: Scene
    mass: Any
    damping: Any
    shape: Real

    @classmethod
    def of(cls, scene: Scene, shape: Real) -> _Feeding:
        """Return the matrices of a scene, (n, n), with the mode for which ``shape' M shape`` is 1."""
        mass: Any = scene.mass if scene.mass.ndim == 2 else scipy.sparse.diags_array(scene.mass)
        damping: Any = 0.0 * mass if scene.damping is None else scene.damping
        if isinstance(damping, Rayleigh):
            damping = rayleigh_matrix(damping, mass, scene.stiffness)
        return cls(scene, mass, damping, shape / np.sqrt(shape @ (mass @ shape)))

    def at(self, delta: float, rest: float = 1.0) -> Scene:
        """Return the scene in which delta feeds the linear mode, and the rest of M in part.

        Of all the rest the damping is ``C - delta M``.
        """
        fed = rest * self.mass
        if rest < 1.0:
            moment = self.mass @ self.shape
            fed = (1.0 - rest) * np.outer(moment, moment) + fed
        return self.scene.replace(damping=self.damping - delta * fed)


def _nearby(run: Trajectory) -> Cycle:
    """Return the periodic motion near a run, by Newton's method, or else that to which it settles."""
    try:
        return run.closed_cycle()
    except OrbitError:
        return run.limit_cycle(further=SETTLING * run.duration, progress=False)


def _period(times: Real, moved: Real, before: float) -> float:
    """Return the time between the last two passages upwards through the middle; `before` without them."""
    centred = moved - 0.5 * (moved.min() + moved.max())
    up = np.flatnonzero((centred[:-1] < 0.0) & (centred[1:] >= 0.0))
    if up.size < 2:
        return before
    at = times[up] - centred[up] * (times[up + 1] - times[up]) / (centred[up + 1] - centred[up])
    return float(at[-1] - at[-2])


@dataclass(frozen=True)
class _Guess:
    """A state near a periodic motion, its period in s, and delta in 1/s."""

    state: State
    period: float
    delta: float


@dataclass(frozen=True)
class _Search:
    """Periodic motions of amplitudes of a dof (`place`) about a state of rest."""

    feeding: _Feeding
    rest: State
    mode: Mode
    place: int

    def linear(self, amplitude: float) -> _Guess:
        """Return the linear mode with an amplitude, as it passes the state of rest."""
        omega = self.mode.eigenvalue.imag
        velocity = amplitude * omega * (self.mode.shape / self.mode.shape[self.place]).real
        state = self.rest.perturbed(velocity=velocity)
        return _Guess(state, 2.0 * np.pi / omega, -2.0 * self.mode.eigenvalue.real)

    def is_linear(self, amplitude: float) -> bool:
        """Return whether the linear mode with an amplitude is a motion of the scene: no event ends it."""
        scene, guess = self.feeding.scene, self.linear(amplitude)
        linear = not (scene.core.has_friction_laws or scene.core.has_planes or scene.core.has_elements)
        if not (linear and is_valid(scene, guess.state)):
            return False
        return not len(simulate(self.feeding.at(guess.delta, 0.0), guess.period, guess.state).events)

    def begin(self, amplitude: float) -> _Guess:
        """Return a linear motion of at most an amplitude, in which the contacts keep their statuses."""
        for halvings in range(1, HALVINGS + 1):
            guess = self.linear(0.5**halvings * amplitude)
            if is_valid(self.feeding.scene, guess.state):
                return guess
        raise OrbitError("no motion of the linear mode keeps the statuses of the contacts")

    def after(self, delta: float, cycle: Cycle) -> _Guess:
        """Return a periodic motion as the beginning of another one."""
        return self.go_on(cycle.run, cycle.period, delta)

    def go_on(self, run: Motion, period: float, delta: float) -> _Guess:
        """Return where a motion goes on under another delta: the last state that fits the scene.

        The force that a sticking contact needs changes with delta.
        """
        scene = self.feeding.at(delta, 0.0)
        for time in run.duration - period * np.arange(LATEST) / LATEST:
            state = run.state(float(time))
            if is_valid(scene, state):
                return _Guess(state, period, delta)
        raise OrbitError(f"no state of a period goes on with delta = {delta:g} 1/s")

    def orbit(self, guess: _Guess, amplitude: float) -> Placed:
        """Return delta and the periodic motion of an amplitude, from another motion.

        A motion grows or decays like ``exp((delta - own) t / 2)``, where ``own`` keeps its amplitude. What it
        does in a period says ``own``; delta beside it leads to the amplitude wanted. Newton's method then
        finds the orbit of that delta, and steps along the branch that of the amplitude.
        """
        name = f"amplitude {amplitude:g} m of {self.rest.dofs[self.place]}"
        reason: object = "its energy balance does not settle"
        if self.is_linear(amplitude):
            raise OrbitError(f"{name}: no event happens, so that the mode is the linear one")
        first, earlier = 0.0, guess.delta
        for _ in range(MOTIONS):
            run = simulate(self.feeding.at(guess.delta, 0.0), guess.period, guess.state)
            if run.duration < guess.period:
                raise OrbitError(f"{name}: the motion ends early: {run.stop_reason}")
            times = np.linspace(0.0, run.duration, INSTANTS + 1)
            moved = run.sample(times).position.to_numpy()[:, self.place]
            last = 0.5 * float(np.ptp(moved))
            if not last > 0.0:
                raise OrbitError(f"{name}: the dof comes to rest")
            growth, missing = float(np.log(last / (first or last))), float(np.log(amplitude / last))
            first = last
            if abs(growth) <= STEADY and abs(missing) <= NEAR:
                near = simulate(run.scene, PERIODS * guess.period, run.state(run.duration))
                try:
                    return self.corrected(self.fed_whole(_nearby(near), guess.delta), guess.delta, amplitude)
                except (OrbitError, NotPeriodicError) as error:
                    reason = error
            most = MOST * 2.0 * np.pi / guess.period
            more = float(np.clip(2.0 * APPROACH * missing / guess.period, -most, most))
            # The ranges of two periods after each other change by the mean of both.
            own, earlier = 0.5 * (earlier + guess.delta) - 2.0 * growth / guess.period, guess.delta
            guess = self.go_on(run, _period(times, moved, guess.period), own + more)
        raise OrbitError(f"{name}: no periodic motion is found: {reason}")

    def fed_whole(self, cycle: Cycle, delta: float) -> Cycle:
        """Return the orbit of a delta that feeds all of M, from that of the linear mode alone.

        Fed as a whole, modes that lose less than the one that is looked for would outgrow it in a motion.
        """
        placed = 0.0, cycle
        for rest in SHARES:
            placed = rest, continued(placed, rest, lambda share: self.feeding.at(delta, share))
        return placed[1]

    def corrected(self, cycle: Cycle, delta: float, amplitude: float) -> Placed:
        """Return delta and the orbit of an amplitude on the branch through an orbit near it."""
        curve = Curve(self.feeding.at, 2.0 * np.pi / cycle.period)
        at, length, last = curve.begin(cycle.core.orbit(), delta, 1.0), 0.0, np.inf
        before, step = float(cycle.amplitude[self.place]), FIRST
        if not amplitude / OTHER < before < OTHER * amplitude:
            raise OrbitError(f"the orbit nearby has the amplitude {before:g} m")
        for _ in range(STEPS):
            at = curve.beyond(at, step)
            found = curve.cycle(at)
            now = float(found.amplitude[self.place])
            missed = abs(now - amplitude) / amplitude
            if missed <= ROUNDING or (last <= NEARLY and missed >= 0.5 * last):
                if not found.is_followed():
                    raise OrbitError("the contact laws do not hold along the orbit")
                return at.value, found
            if now == before:
                break
            length, last = step * (amplitude - now) / (now - before), missed
            before, step = now, length
        raise OrbitError("no step along the branch leads to the amplitude")
