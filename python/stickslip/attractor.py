"""What a motion settles to: recurrence of its events, and of the states after them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stickslip.arrays import Real
from stickslip.errors import RunError
from stickslip.scene import Scene
from stickslip.state import State
from stickslip.transient import Trajectory, simulate

#: A state returns if it differs by less than this part of the range of the motion. Rounding is some 1e-13.
RETURN = 1e-9
#: The mismatch of a shorter recurrence is there to stay if it exceeds that of the full period by this
#: factor: it then changes by less than twice its inverse in a period. Less would take the slowly dying
#: alternation of a multiplier near -1 for a doubled period.
STATIONARY = 1e5
#: Consecutive periods over which the events must repeat.
REPEATS = 4
#: Samples of one period, for its spectrum: some hundred harmonics of a motion with kinks.
SAMPLES = 4096


@dataclass(frozen=True, eq=False)
class Attractor:
    """A periodic motion with status changes.

    Attributes
    ----------
    run
        The motion at its end on the attractor.
    onset
        Time of the first status change of the transient, s.
    begin
        Time in `run` at which the last complete period begins, at an event, s.
    period
        Smallest period, s.
    combinations
        The status combinations of one period in order; the rotation that comes first in the alphabet.
    """

    run: Trajectory
    onset: float
    begin: float
    period: float
    combinations: tuple[str, ...]

    def sample_times(self) -> Real:
        """Return equidistant times of one period, its end left out, s."""
        return self.begin + self.period * np.arange(SAMPLES) / SAMPLES

    def main_harmonic(self, dof: str) -> int:
        """Return the harmonic of the period that is largest in the displacement of a dof."""
        motion = self.run.sample(self.sample_times()).position.sel(dof=dof).to_numpy()
        return int(1 + np.argmax(np.abs(np.fft.rfft(motion)[1:])))

    def main_frequency(self, dof: str) -> float:
        """Return the frequency of the largest spectral line of the displacement of a dof, Hz."""
        return self.main_harmonic(dof) / self.period


def settle(scene: Scene, start: State, *, stretch: float = 1.0, limit: float = 30.0) -> Attractor:
    """Simulate until the motion recurs.

    Parameters
    ----------
    scene, start
        See `simulate`.
    stretch
        Length of motion after which recurrence is looked for, s.
    limit
        Longest motion to try, s.

    Raises
    ------
    RunError
        If the motion ends without status changes, or does not recur within `limit`; `partial` is its last
        stretch.
    """
    elapsed, onset, state = 0.0, None, start
    while True:
        run = simulate(scene, state, stretch)
        if onset is None and len(run.events):
            onset = elapsed + float(run.events.time[0])
        elapsed += run.duration
        count = _events_per_period(run)
        if count is not None and onset is not None:
            return _attractor(run, onset, count)
        if elapsed >= limit or run.stop_reason != "duration":
            raise RunError(f"no recurrence of events within {elapsed:g} s of motion", run)
        state = run.state(run.duration)


def _events_per_period(run: Trajectory) -> int | None:
    events = run.events
    labels = list(zip(events.contact, events.kind, events.combination, strict=True))
    if not labels:
        return None
    states = np.hstack(
        [part / max(np.ptp(part, axis=0).max(), np.finfo(float).tiny) for part in run.event_states()]
    )
    shorter: list[float] = []
    for count in range(1, len(labels) // REPEATS + 1):
        if labels[-(REPEATS - 1) * count :] != labels[-REPEATS * count : -count]:
            continue
        mismatch = float(np.abs(states[-count:] - states[-2 * count : -count]).max())
        if mismatch < RETURN:
            stays = all(other > STATIONARY * mismatch for other in shorter)
            return count if stays else None
        shorter.append(mismatch)
    return None


def _attractor(run: Trajectory, onset: float, count: int) -> Attractor:
    time, combination = run.events.time, run.events.combination
    first = len(time) - 1 - count
    lasting = [k for k in range(first, len(time) - 1) if time[k + 1] > time[k]]
    sequence = [str(combination[k]) for k in lasting]
    return Attractor(
        run=run,
        onset=onset,
        begin=float(time[first]),
        period=float(time[-1] - time[first]),
        combinations=min(tuple(sequence[k:] + sequence[:k]) for k in range(len(sequence))),
    )
