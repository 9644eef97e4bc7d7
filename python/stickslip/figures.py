"""`plot`: the figure of every dataset that the package returns, found by its variables."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from inspect import signature
from typing import Any

import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure, FigureBase

from stickslip.cycles.diagram_figures import basins, bifurcation
from stickslip.faults import InputError
from stickslip.locus.figures import loci, stability_map
from stickslip.motion.energy_figures import energies, modal_shares
from stickslip.motion.figures import spectrum
from stickslip.scene.checks import described
from stickslip.study.figures import (
    convergence,
    distribution,
    eigenvalue_moments,
    morris_effects,
    probability,
    sobol_indices,
    study,
)


@dataclass(frozen=True)
class _Kind:
    """A kind of dataset: variables and dimensions that it has, and how it is drawn."""

    name: str
    parts: frozenset[str]
    draw: Callable[..., Axes | Figure]
    #: argument of `draw` that `what` is; None: it takes none
    what: str | None = None


def _kind(name: str, parts: str, draw: Callable[..., Axes | Figure], what: str | None = None) -> _Kind:
    return _Kind(name, frozenset(parts.split()), draw, what)


#: Results of a study stand first: their outputs bear the names of other kinds.
_KINDS = (
    _kind("results of a study", "status reason sample", study, "output"),
    _kind("a sweep", "eigenvalue branch", loci),
    _kind("basins", "reached attractor", basins),
    _kind("a bifurcation or a branch", "amplitude sequence period stability dof", bifurcation, "dof"),
    _kind("a spectrum", "amplitude frequency", spectrum, "dof"),
    _kind("energies and powers", "energy_rate contact_power time", energies, "part"),
    _kind("energies of modes", "share energy total time", modal_shares, "combination"),
    _kind("a probability", "probability lower upper", probability),
    _kind("a convergence", "estimate samples", convergence),
    _kind("Sobol' indices", "first total parameter", sobol_indices),
    _kind("Morris' effects", "absolute_effect deviation", morris_effects),
    _kind("moments of eigenvalues", "covariance growth_deviation", eigenvalue_moments),
)


def plot(
    data: xr.Dataset,
    what: str | None = None,
    *,
    ax: Axes | None = None,
    figure: FigureBase | None = None,
    **options: Any,
) -> Any:
    """Draw a dataset that a call of the package returned; return the Axes, or the Figure of several panels.

    Results that are no datasets draw themselves: ``run.plot()``, ``cycle.plot.energy()``.

    ==================================================  =======  ==========================================
    dataset of                                          returns  `what`, options
    ==================================================  =======  ==========================================
    ``ss.sweep`` over one parameter                     Figure   ``critical``: `CriticalPoints`, whose Hopf
                                                                 points get rings; ``slow=False``: all growth
                                                                 rates, far below those of the least damped
                                                                 branches as well
    ``ss.sweep`` over two                               Figure
    ``diagram.to_dataset()``, ``branch.to_dataset()``   Axes     a dof; None: the one that moves most
    ``basins.to_dataset()``, ``boundary.to_dataset()``  Axes
    ``run.spectrum()``, ``cycle.harmonics()``           Axes     a dof; None: the one that moves most;
                                                                 ``label``
    ``run.energy(times)``                               Figure
    the same                                            Axes     ``stored``, ``rate`` or ``powers``
    ``ss.modal_energy(run, times)``                     Axes     a status combination
    ``study.run()``                                     Figure
    the same                                            Axes     an output; ``bins``, ``label``, and of an
                                                                 output with several values which one:
                                                                 ``contact=0``
    ``ss.study.probability(...)`` over a parameter      Axes     ``label``
    ``ss.study.convergence(...)``                       Axes     ``label``
    ``ss.study.importance(...)``                        Axes
    ``study.eigenvalue_moments()``                      Axes     ``results`` with the output ``eigenvalues``,
                                                                 ``mode``: number of the mode, ``most``:
                                                                 samples drawn
    ==================================================  =======  ==========================================

    Parameters
    ----------
    data
        The dataset, also one read from a file.
    what
        What of it is drawn, see above.
    ax
        Where to draw one panel; None: on axes of its own.
    figure
        Where to draw several, with as many panels or none; None: in a new one.
    **options
        See above.

    Raises
    ------
    InputError
        If there is no picture of such a dataset, or `what` or an option does not fit it.
    """
    names = {*data.variables, *data.dims} if isinstance(data, xr.Dataset) else set()
    kind = next((kind for kind in _KINDS if kind.parts <= names), None)
    if kind is None:
        known = ", ".join(kind.name for kind in _KINDS)
        raise InputError(f"data: expected the dataset of {known}, got {described(data)}")
    if what is not None:
        if kind.what is None:
            raise InputError(f"what: {kind.name} has one picture, got {what!r}")
        options[kind.what] = what
    options |= {name: place for name, place in (("ax", ax), ("figure", figure)) if place is not None}
    draw = kind.draw
    if draw is loci and data.eigenvalue.ndim > 2:
        draw = stability_map
    if draw is study and what is not None:
        draw = distribution
    try:
        signature(draw).bind(data, **options)
    except TypeError as error:
        raise InputError(f"plot: {kind.name}: {error}") from None
    return draw(data, **options)
