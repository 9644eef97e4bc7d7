"""What a page shows over parameters: root loci over one, the verdict of stability over two."""

from __future__ import annotations

import time
from collections.abc import Iterable
from typing import Any

import numpy as np

from stickslip.explorer.picture import packed
from stickslip.explorer.wanted import CELLS, VALUES, Wanted
from stickslip.faults import InputError, StickslipError
from stickslip.locus.critical import critical_points
from stickslip.locus.points import CriticalPoint
from stickslip.locus.stability import stability
from stickslip.locus.sweep import sweep
from stickslip.modes.modes import shown_growth

#: Eigenvalues beyond which loci are left out: every value is an eigenproblem.
LARGE = 60
#: Computing time of a map at most, s: meanwhile nothing else is computed.
LONGEST = 5.0


def loci(wanted: Wanted) -> dict[str, Any]:
    """Return growth rates and frequencies over a parameter; with ``critical`` also its Hopf points.

    `NaN` stands where there is no steady sliding.
    """
    name, low, high = wanted.axis("x")
    count = wanted.whole("count", VALUES)
    model = wanted.explored.family.given
    band = wanted.explored.band
    if wanted.explored.scene.size > LARGE and band is None:
        return {"error": f"Root loci are left out for {wanted.explored.scene.size} dofs."}
    fixed = wanted.fixed(name)
    try:
        found = sweep(model, {**fixed, name: np.linspace(low, high, count)}, band=band, progress=False)
        points = (
            critical_points(model, {**fixed, name: (low, high)}, band=band)
            if wanted.message.get("critical") is True
            else ()
        )
    except StickslipError as error:
        return {"error": f"No root loci: {error}."}
    imaginary, unstable = found.eigenvalue.to_numpy().T.imag, found.unstable.to_numpy().T
    # Of a pair of conjugates one; a branch may meet the real axis and come back on either side.
    upper = (imaginary.max(axis=1) > 0.0) & (imaginary.mean(axis=1) >= 0.0)
    real = np.abs(imaginary).max(axis=1) == 0.0
    listed = np.concatenate([np.flatnonzero(upper), np.flatnonzero(real)])
    branches, unstable = found.eigenvalue.to_numpy().T[listed], unstable[listed]
    growth = shown_growth(branches.real, unstable)
    exists = found.steady_sliding.to_numpy()
    return {
        "error": None,
        "branches": len(branches),
        "growth": packed(np.where(exists, growth, np.nan)),
        "frequency": packed(np.where(exists, np.abs(branches) / (2.0 * np.pi), np.nan)),
        "unstable": packed(unstable),
        "hopf": hopf_points(points),
    }


def hopf_points(points: Iterable[CriticalPoint]) -> list[dict[str, float]]:
    """Return where Hopf points lie that steady sliding reaches, as the page marks them."""
    return [
        {"value": point.value, "frequency": point.frequency}
        for point in points
        if point.kind == "hopf" and point.steady_sliding
    ]


def verdicts(wanted: Wanted) -> dict[str, Any]:
    """Return the largest growth rate over two parameters, in rows of one value of ``y`` each.

    ``unstable`` says where a mode grows by more than rounding. `NaN` stands where there is no steady sliding.
    The map of a band is that of `curves`.
    """
    (x, left, right), (y, low, high) = wanted.axis("x"), wanted.axis("y")
    columns, rows = wanted.whole("columns", CELLS), wanted.whole("rows", CELLS)
    first, second = np.meshgrid(np.linspace(left, right, columns), np.linspace(low, high, rows))
    fixed = wanted.fixed(x, y)
    growth, unstable = np.empty((rows, columns)), np.empty((rows, columns), dtype=bool)
    try:
        # The second row tells how long the others will take; the first also loads what computes it.
        for part in (slice(0, 1), slice(1, 2), slice(2, rows)):
            before = time.perf_counter()
            samples: dict[str, Any] = {**fixed, x: first[part].ravel(), y: second[part].ravel()}
            found = stability(wanted.explored.family.given, samples)
            grows = found.unstable_modes.to_numpy() > 0
            rates = shown_growth(found.growth_rate.to_numpy(), grows)
            rates = np.where(found.steady_sliding.to_numpy(), rates, np.nan)
            growth[part], unstable[part] = rates.reshape(-1, columns), grows.reshape(-1, columns)
            expected = rows * (time.perf_counter() - before)
            if part.start == 1 and expected > LONGEST:
                return {"error": f"The map is left out: it would take {expected:.0f} s."}
    except InputError as error:
        return {"error": f"No map: {error}."}
    sent = {"growth": packed(growth), "unstable": packed(unstable)}
    return {"error": None, **sent}
