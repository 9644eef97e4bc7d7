"""Frequencies and stability of status combinations at one call."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from stickslip.faults import InputError, NoSteadyStateError
from stickslip.modes.complex_modes import complex_modes
from stickslip.scene.contact import letters_of
from stickslip.scene.scene import Scene, checked
from stickslip.show.summary import Shown, Summary, Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Combinations computed unasked: all of four contacts.
_LARGEST = 256


@dataclass(frozen=True, repr=False, eq=False)
class StatusTable(Shown):
    """Modes of several status combinations.

    Attributes
    ----------
    data
        Over ``combination`` and ``pair``, one of each conjugate pair, ascending in frequency, nan beyond the
        last and in combinations without modes: ``eigenvalue`` (1/s), ``frequency`` (Hz), ``damping_ratio``,
        ``unstable``.
    """

    data: xr.Dataset

    def rows(self) -> list[tuple[str, list[str]]]:
        """Return (combination, frequencies in Hz as text), unstable ones marked ``*``, real ones ``r``."""
        table = []
        for combination in self.data.combination.to_numpy():
            row = self.data.sel(combination=combination)
            cells = [
                f"{float(frequency):.2f}{'*' * bool(unstable)}{'r' * bool(np.imag(eigenvalue) == 0.0)}"
                for frequency, unstable, eigenvalue in zip(
                    row.frequency.to_numpy(), row.unstable.to_numpy(), row.eigenvalue.to_numpy(), strict=True
                )
                if not np.isnan(frequency)
            ]
            table.append((str(combination), cells))
        return table

    def __repr__(self) -> str:
        lines = ["status  frequencies, Hz (* unstable, r real eigenvalue: no oscillation)"]
        width = max((len(cell) for _, cells in self.rows() for cell in cells), default=0)
        for combination, cells in self.rows():
            lines.append(f"{combination:<7}" + "".join(f" {cell:<{width}}" for cell in cells).rstrip())
        return "\n".join(lines)

    def to_dataset(self) -> xr.Dataset:
        """Return the numbers."""
        return self.data

    def summary(self) -> Summary:
        """Return a table of the frequencies, one row per combination."""
        width = max((len(cells) for _, cells in self.rows()), default=0)
        rows = [(name, *cells, *[""] * (width - len(cells))) for name, cells in self.rows()]
        caption = "Frequencies, Hz (* unstable, r real eigenvalue: no oscillation)"
        headings = ("combination", *(f"pair {k}" for k in range(width)))
        return Summary(tables=[Table(caption, headings, rows)])

    def plot(self, *, ax: Axes | None = None) -> Axes:
        """Draw the frequencies of every combination, those of unstable modes in red; return the Axes.

        Parameters
        ----------
        ax
            Where to draw; None: on axes of its own.
        """
        from stickslip.show.plots import axes_of
        from stickslip.show.style import STABLE, UNSTABLE

        axes = axes_of(ax)
        names = self.data.combination.to_numpy()
        place = np.broadcast_to(np.arange(names.size)[:, None], self.data.frequency.shape)
        for grows, colour, label in ((False, STABLE, "stable"), (True, UNSTABLE, "unstable")):
            chosen = self.data.unstable.to_numpy() == grows
            axes.plot(place[chosen], self.data.frequency.to_numpy()[chosen], "_", color=colour, label=label)
        axes.set(
            xlabel="status combination", ylabel="frequency, Hz", xticks=range(names.size), xticklabels=names
        )
        axes.legend(frameon=False, fontsize="small")
        return axes


def status_table(scene: Scene, combinations: Sequence[str] | None = None) -> StatusTable:
    """Return frequencies, damping ratios and stability of status combinations (the paper's Table 4).

    Parameters
    ----------
    scene
        The scene.
    combinations
        The combinations; None: all that are possible. A contact without friction does not stick, a stop is
        ``+`` or ``d``, friction under a given normal force is never ``d``, and friction in a plane is ``o``
        or ``s``.

    Raises
    ------
    InputError
        If a combination does not fit the scene, or None stands for more than 256 of them.
    """
    if combinations is None:
        contacts = checked(scene).contacts
        possible = [letters_of(contact) for contact in contacts]
        planes = [(k, one.beside) for k, one in enumerate(contacts) if one.beside is not None]
        # Both directions of a plane have one letter.
        count = math.prod(map(len, possible)) // 2 ** (len(planes) // 2)
        if count > _LARGEST:
            raise InputError(f"combinations: {count} are too many for one table, choose some")
        chosen = [
            "".join(letters)
            for letters in itertools.product(*possible)
            if all(letters[k] == letters[beside] for k, beside in planes)
        ]
    else:
        chosen = list(combinations)
        if isinstance(combinations, str) or not chosen:
            raise InputError(f"combinations: expected a sequence of them, got {combinations!r}")
    rows = []
    for combination in chosen:
        try:
            modes = complex_modes(scene, combination)
        except NoSteadyStateError:
            rows.append((np.zeros(0, dtype=complex), np.zeros(0, dtype=bool)))
            continue
        rows.append((modes.eigenvalues, modes.unstable))
    eigenvalue = np.full((len(chosen), max(len(values) for values, _ in rows)), complex(np.nan, np.nan))
    unstable = np.zeros(eigenvalue.shape, dtype=bool)
    for row, (values, grows) in enumerate(rows):
        eigenvalue[row, : values.size], unstable[row, : values.size] = values, grows
    modulus = np.abs(eigenvalue)
    with np.errstate(invalid="ignore"):
        ratio = -eigenvalue.real / modulus
    dims = ("combination", "pair")
    return StatusTable(
        xr.Dataset(
            {
                "eigenvalue": (dims, eigenvalue, {"units": "1/s"}),
                "frequency": (dims, modulus / (2.0 * np.pi), {"units": "Hz"}),
                "damping_ratio": (dims, ratio, {"units": "1"}),
                "unstable": (dims, unstable),
            },
            coords={"combination": chosen},
        )
    )
