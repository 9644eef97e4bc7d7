"""What a page shows over parameters: root loci over one, the verdict of stability over two."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from stickslip.explorer.picture import packed
from stickslip.explorer.wanted import CELLS, VALUES, Wanted
from stickslip.faults import InputError, StickslipError
from stickslip.locus.critical import critical_points
from stickslip.locus.stability import stability
from stickslip.locus.sweep import sweep

#: Eigenvalues beyond which loci are left out: every value is an eigenproblem.
LARGE = 120


def loci(wanted: Wanted) -> dict[str, Any]:
    """Return growth rates and frequencies over a parameter; with ``critical`` also its Hopf points.

    `NaN` stands where there is no steady sliding.
    """
    name, low, high = wanted.axis("x")
    count = wanted.whole("count", VALUES)
    model = wanted.explored.family.given
    if 2 * wanted.explored.scene.size > LARGE:
        return {"error": f"Root loci are left out for {wanted.explored.scene.size} dofs."}
    fixed = wanted.fixed(name)
    try:
        found = sweep(model, over={**fixed, name: np.linspace(low, high, count)}, progress=False)
        points = (
            critical_points(model, over={**fixed, name: (low, high)})
            if wanted.message.get("critical") is True
            else ()
        )
    except StickslipError as error:
        return {"error": f"No root loci: {error}."}
    eigenvalue = found.eigenvalue.to_numpy().T
    # Of a pair of conjugates one; a branch may meet the real axis and come back on either side.
    upper = eigenvalue[np.max(eigenvalue.imag, axis=1) > 0.0]
    upper = upper[np.mean(upper.imag, axis=1) >= 0.0]
    real = eigenvalue[(np.abs(eigenvalue.imag).max(axis=1) == 0.0)]
    branches = np.concatenate([upper, real])
    exists = found.steady_sliding.to_numpy()
    return {
        "error": None,
        "branches": len(branches),
        "growth": packed(np.where(exists, branches.real, np.nan)),
        "frequency": packed(np.where(exists, np.abs(branches) / (2.0 * np.pi), np.nan)),
        "hopf": [
            {"value": point.value, "frequency": point.frequency}
            for point in points
            if point.kind == "hopf" and point.steady_sliding
        ],
    }


def verdicts(wanted: Wanted) -> dict[str, Any]:
    """Return the largest growth rate over two parameters, in rows of one value of ``y`` each.

    `NaN` stands where there is no steady sliding. ``seconds`` is how long it took: what a finer map will take
    can be known from it.
    """
    (x, left, right), (y, low, high) = wanted.axis("x"), wanted.axis("y")
    columns, rows = wanted.whole("columns", CELLS), wanted.whole("rows", CELLS)
    begun = time.thread_time()
    first, second = np.meshgrid(np.linspace(left, right, columns), np.linspace(low, high, rows))
    over: dict[str, Any] = {**wanted.fixed(x, y), x: first.ravel(), y: second.ravel()}
    try:
        found = stability(wanted.explored.family.given, over=over)
    except InputError as error:
        return {"error": f"No map: {error}."}
    growth = np.where(found.steady_sliding.to_numpy(), found.growth_rate.to_numpy(), np.nan)
    return {"error": None, "growth": packed(growth), "seconds": time.thread_time() - begun}
