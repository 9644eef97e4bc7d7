"""A computed transient: a motion that can be asked for the limit cycle it settles to."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

from stickslip import _core
from stickslip.faults import Interrupted, OrbitError
from stickslip.motion.errors import NotPeriodicError
from stickslip.motion.motion import Motion
from stickslip.scene.checks import finite_time
from stickslip.scene.contact import dof_index
from stickslip.show.progress import LONG, watched

if TYPE_CHECKING:
    import xarray as xr

    from stickslip.cycles.cycle import Cycle


#: How much longer a search follows a motion unless told otherwise, in durations of the computed part.
FURTHER = 10.0


@dataclass(frozen=True, eq=False, repr=False)
class Trajectory(Motion):
    """A computed motion from 0 to `duration`: the events are kept, anything between is evaluated on demand.

    Attributes
    ----------
    scene, start
        What was simulated, from where.
    """

    def limit_cycle(
        self,
        further: float | None = None,
        method: Literal["auto", "modal", "taylor", "local"] = "auto",
        *,
        time_limit: float | None = None,
        progress: bool | None = None,
    ) -> Cycle:
        """Return the periodic orbit that the motion settles to, refined to rounding.

        Recurring events and states give a first orbit, Newton's method on the exact return map the rest. The
        motion must be on the orbit, or approach it with the orbit stable; the period is the smallest one.

        Parameters
        ----------
        further
            How much longer the motion is followed, s, if the computed part does not show the orbit yet; 0 to
            look at the computed part only. None: ten times the duration of the computed part.
        method
            How phases are propagated, see `simulate`.
        time_limit
            Wall-clock limit of the search, s, > 0; the error then says what is known so far. None: no limit.
        progress
            Whether a bar on standard error shows how much of `further` has been followed. None: on a
            terminal, once the search takes longer than 3 s.

        Raises
        ------
        NotPeriodicError
            If the motion settles to no cycle, or none is found in time; it says what it is instead, with the
            largest Lyapunov exponent where there is one.
        InputError
            If `further` is negative or not finite, `time_limit` not positive and finite, or `method` no known
            word.
        Interrupted
            On Ctrl-C; a `KeyboardInterrupt` that holds the last stretch of the motion.
        """
        from stickslip.cycles.attractors import described
        from stickslip.cycles.cycle import Cycle

        patience = None if time_limit is None else finite_time("time_limit", time_limit)
        longer = FURTHER * self.duration if further is None else finite_time("further", further, 0.0)
        watch = _core.Watch()

        def followed() -> int:
            return round(100.0 * watch.followed / longer) if longer > 0.0 else 0

        with watched(followed, 100, "limit cycle, % of `further`", progress, LONG):
            kind, core, growth, last = _core.attractor(self.core, longer, method, patience, watch)
        if core is not None:
            return Cycle(self.scene, core)
        ended = self if last is None else replace(self, start=self.state(self.duration), core=last)
        if ended.stop_reason == "interrupted":
            raise Interrupted(f"interrupted after {ended.duration:g} s of motion", ended)
        label, message = described(kind, growth, ended.core.stop_message)
        if label == "undecided" and not len(self.events) and not len(ended.events):
            message += (
                "; nothing has happened in it: if it begins in exact steady sliding, it stays there "
                "however unstable that is, unless the start is disturbed (disturbed_sliding, State.perturbed)"
            )
        if last is not None and ended.stop_reason == "time_limit":
            message += f" (the time limit of computing, {time_limit:g} s, was reached)"
        raise NotPeriodicError(message, ended, label, growth[0], growth[1])

    def closed_cycle(self, method: Literal["auto", "modal", "taylor", "local"] = "auto") -> Cycle:
        """Return the periodic orbit that Newton's method finds from the end of the motion, stable or not.

        The guess is the motion between its last event and the last earlier event that is like it. If contacts
        slide without events by a law of friction or slip in a plane, the guess is the motion between the last
        two turns of the contact that moves most. `limit_cycle` returns the orbit to which the motion itself
        settles.

        Parameters
        ----------
        method
            How phases are propagated, see `simulate`.

        Raises
        ------
        OrbitError
            If nothing in the motion comes back, or Newton's method finds no orbit near it.
        InputError
            If `method` is no known word.
        """
        from stickslip.cycles.cycle import Cycle

        core = _core.closed(self.core, method)
        if core is None:
            raise OrbitError(
                "no event of the motion comes back, and no contact that slides by a law or slips in a plane "
                "turns twice"
            )
        return Cycle(self.scene, core)

    def spectrum(
        self,
        dof: str | None = None,
        *,
        begin: float | None = None,
        end: float | None = None,
        harmonics: int = 64,
        further: float | None = None,
        samples: int = 2**14,
        window: Any = "hann",
        detrend: Literal["constant", "linear"] | None = "constant",
    ) -> xr.Dataset:
        """Return the spectrum of displacements.

        Without `begin` and `end`: the lines of the limit cycle that the motion settles to, in closed form
        (`Cycle.harmonics`): no window, no leakage. With one of them: the discrete Fourier transform of that
        stretch, such as the growing part up to the first event, or a motion that has no period.

        Parameters
        ----------
        dof
            Name of a dof; None: all of them.
        begin, end
            The stretch to sample, s. If only one of them is given, the stretch begins at 0 or ends with the
            motion.
        harmonics, further
            Highest harmonic of the exact lines, and `further` of `limit_cycle`.
        samples, window, detrend
            For the transform: number of equidistant samples, >= 8; a window of `scipy.signal.get_window`; and
            what is subtracted first: the mean, a straight line, or nothing.

        Returns
        -------
        xarray.Dataset
            Over ``frequency`` (Hz), and ``dof`` if none was named: ``coefficient``, complex, and
            ``amplitude`` of the cosine at that frequency, m. The attribute ``method`` is ``exact`` or
            ``sampled``.

        Raises
        ------
        NotPeriodicError
            If the exact lines are asked for and the motion settles to no cycle.
        InputError
            If the dof is unknown or an argument is ill-posed.
        """
        if begin is not None or end is not None:
            return super().spectrum(
                dof, begin=begin, end=end, samples=samples, window=window, detrend=detrend
            )
        cycle = self.limit_cycle(further)
        lines = cycle.harmonics(harmonics).swap_dims(harmonic="frequency")
        lines.attrs.update(method="exact", period=cycle.period)
        return lines if dof is None else lines.isel(dof=dof_index("dof", dof, self.scene.dofs))
