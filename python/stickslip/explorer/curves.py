"""The curves that a page draws over its map: where stability ends, and the points at which they meet."""

from __future__ import annotations

import time
from collections import Counter
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from stickslip.explorer.maps import LARGE, LONGEST
from stickslip.explorer.picture import packed
from stickslip.explorer.wanted import SEARCHED, Wanted
from stickslip.faults import StickslipError
from stickslip.locus.boundary.boundary import boundary_of, search_over
from stickslip.locus.boundary.curves import CodimensionTwo, pieces
from stickslip.locus.boundary.figures import LINES
from stickslip.locus.boundary.result import StabilityBoundary
from stickslip.locus.boundary.search import Search
from stickslip.modes.modes import shown_growth

#: What a line says that is not drawn through.
DRAWN = {"-": "", "-.": " (dash-dotted)", "--": " (dashed)"}
#: Computing time of the curves of a band at most, s: every line may be an eigenproblem of a mesh.
OF_BAND = 60.0
#: Doubts that are told in full.
TOLD = 2


def curves(wanted: Wanted) -> dict[str, Any]:
    """Return the curves over two parameters on which stability ends, and their points of codimension two.

    Other messages are computed between two lines of the search. It ends after `LONGEST` of its own time, that
    of a band after `OF_BAND`; the curves found by then are shown, and ``whole`` is False. With a band
    ``map`` holds the largest growth rates, and where a mode grows, in the middles of as many cells.
    """
    begun = time.perf_counter()
    (x, left, right), (y, low, high) = wanted.axis("x"), wanted.axis("y")
    cells = wanted.whole("cells", SEARCHED)
    band = wanted.explored.band
    if (size := wanted.explored.scene.size) > LARGE and band is None:
        return {"error": f"Curves are left out for {size} dofs; they need a band of frequencies."}
    ranges = {**wanted.fixed(x, y), x: (left, right), y: (low, high)}
    try:
        # Of matrices of some hundred rows at most: more threads take longer wherever anything else runs.
        with threadpool_limits(1, user_api="blas"):
            search = search_over(wanted.explored.family.given, ranges, None, cells, band)
            whole = _searched(search, wanted, _longest(wanted) - (time.perf_counter() - begun))
            found = boundary_of(search)
    except StickslipError as error:
        return {"error": f"No curves: {error}."}
    return {
        "error": None,
        "whole": whole,
        "said": _said(found),
        "pieces": [
            {"x": packed(points[:, 0]), "y": packed(points[:, 1]), "line": LINES[curve.kind], "look": look}
            for curve in found
            for points, look in pieces(curve, found.spans, found.points)
        ],
        "points": [_point(point, (x, y)) for point in found.points] + incomplete(found),
        "map": _map(search) if band is not None and whole else None,
    }


def _longest(wanted: Wanted) -> float:
    """Return the computing time of curves at most, s."""
    return LONGEST if wanted.explored.band is None else OF_BAND


def _searched(search: Search, wanted: Wanted, patience: float) -> bool:
    """Search until all is found, or for so long; return whether all is."""
    since, spent = time.perf_counter(), 0.0
    for done, total in search.run():
        spent += time.perf_counter() - since
        if spent > patience:
            search.doubts.append(f"stopped after {done} of {total} lines, {_longest(wanted):g} s")
            return False
        wanted.pause()
        since = time.perf_counter()
    return True


def _said(found: StabilityBoundary) -> str:
    """Return in words which curves there are, and whether one may be missing."""
    counts = Counter[str](curve.kind for curve in found)
    kinds = [
        f"{counts[kind]} {kind.replace('hopf', 'Hopf')} curve{'s' * (counts[kind] > 1)}{DRAWN[line]}"
        for kind, line in LINES.items()
        if counts[kind]
    ]
    first = ", ".join(kinds) or "No curves"
    # Counted are those of a large scene, at some points of every curve.
    if (text := dict(found.summary().facts).get("eigenvalues missing")) is not None:
        first += f"; eigenvalues missing {text}"
    if found.doubts:
        more = f"; and {len(found.doubts) - TOLD} more" if len(found.doubts) > TOLD else ""
        return f"{first}; one may be missing: {'; '.join(found.doubts[:TOLD])}{more}."
    return f"{first}; counts of modes agree at {' x '.join(map(str, found.map.growth_rate.shape))} places."


def _map(search: Search) -> dict[str, Any]:
    """Return growth rates in the rows of `verdicts`, at as many places in both directions."""
    grows = search.counts > 0
    rates = shown_growth(search.growth, grows)
    return {"cells": len(rates), "growth": packed(rates), "unstable": packed(grows)}


def incomplete(found: StabilityBoundary) -> list[dict[str, Any]]:
    """Return the points at which eigenvalues of the band were not found."""
    return [
        {"x": x, "y": y, "name": "", "told": f"{missing:.2f} eigenvalues missing at {x:.6g}, {y:.6g}"}
        for curve in found
        for (x, y), missing in zip(
            curve.values[curve.incomplete].tolist(), curve.missing[curve.incomplete], strict=True
        )
    ]


def _point(point: CodimensionTwo, names: tuple[str, str]) -> dict[str, Any]:
    """Return a point with its name, and what is told where the pointer is on it."""
    name = point.kind.replace("_", " ").replace("hopf", "Hopf")
    frequencies = ", ".join(f"{one:.6g} Hz" for one in point.frequencies if np.isfinite(one))
    remark = f", {point.remark}" if point.remark else ""
    x, y = (point.values[one] for one in names)
    told = f"{name}{remark} at {x:.6g}, {y:.6g}" + (f": {frequencies}" if frequencies else "")
    return {"x": x, "y": y, "name": "" if point.kind == "degenerate" else name, "told": told}
