"""Figures of a limit cycle."""

from __future__ import annotations

from typing import Protocol

import xarray as xr
from matplotlib.axes import Axes

from stickslip.motion.figures import SAMPLES, Moving, MovingPlots, spectrum, tangential
from stickslip.scene.contact import contact_index
from stickslip.show.plots import axes_of
from stickslip.show.style import OVERLAY
from stickslip.show.units import TIMES, measured


class Periodic(Protocol):
    """What can be drawn as a limit cycle: a `Cycle`."""

    @property
    def run(self) -> Moving:
        """One period."""

    @property
    def period(self) -> float:
        """Its length, s."""

    @property
    def combinations(self) -> tuple[str, ...]:
        """The combinations of its phases."""

    def harmonics(self) -> xr.Dataset:
        """Return its Fourier series."""


class CyclePlots(MovingPlots[Periodic]):
    """Pictures of one period of a limit cycle."""

    _fine = 4097

    def __init__(self, cycle: Periodic) -> None:
        super().__init__(cycle, cycle.run)

    def __call__(self, *, contact: int | str = 0, samples: int = SAMPLES, ax: Axes | None = None) -> Axes:
        """Draw one period in the phase plane of a contact, by status, as `phase`; return the Axes.

        Parameters
        ----------
        contact
            Name or index of the contact.
        samples
            Points of the curve.
        ax
            Where to draw; None: on axes of its own.

        Raises
        ------
        InputError
            If there is no such contact.
        """
        return self.phase(contact=contact, samples=samples, ax=ax)

    def outline(self, *, contact: int | str = 0, label: str | None = None, ax: Axes | None = None) -> Axes:
        """Draw the orbit of a contact about its middle, to compare cycles; return the Axes.

        Each next one on the same axes has another colour and line style.

        Parameters
        ----------
        contact
            Name or index of the contact.
        label
            Name of the case for a legend, such as ``"friction 1.5"``.
        ax
            Where to draw; None: on axes of its own.

        Raises
        ------
        InputError
            If there is no such contact.
        """
        index = contact_index("contact", contact, self._run.scene.contacts)
        ((_, displaced, velocity),) = tangential(self._run, [index])
        axes = axes_of(ax)
        colour, style = OVERLAY[len(axes.lines) % len(OVERLAY)]
        centred = displaced - 0.5 * (displaced.max() + displaced.min())
        axes.plot(centred, velocity, color=colour, linestyle=style, linewidth=1.2, label=label)
        axes.set(xlabel="tangential displacement about its middle, µm", ylabel="tangential velocity, m/s")
        if label is not None:
            axes.legend(frameon=False, fontsize="small")
        return axes

    def spectrum(self, dof: str | None = None, *, label: str | None = None, ax: Axes | None = None) -> Axes:
        """Draw the exact lines of a dof, those of ``cycle.harmonics()``; return the Axes.

        Parameters
        ----------
        dof
            Name of the dof; None: the one that moves most.
        label
            Name of the lines for a legend.
        ax
            Where to draw; None: on axes of its own.

        Raises
        ------
        InputError
            If the dof is unknown.
        """
        return spectrum(self._result.harmonics(), dof, label=label, ax=ax)

    def _title(self) -> str:
        sequence = " → ".join(self._result.combinations)
        return f"Limit cycle, period {measured(self._result.period, TIMES, 5)}: {sequence}"
