"""Curves of stability beside the map of 100 x 100 verdicts that they replace: processor time, contradictions.

The scenes are the random ones of the tests, of up to 16 dofs, each with two of its parameters over wide
ranges. The map is `ss.stability` in the faster of two ways: one call with all samples, and, where a parameter
is friction, one call a row, in which only the terms with friction change. Two neighbours of the map
contradict the curves where their numbers of growing modes differ and no curve passes between, or the other
way round.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
from clock import clocked

import stickslip as ss
from report import Report, arguments
from stickslip import types
from stickslip.scene.parameters.family import Family

sys.path.insert(0, str(Path(__file__).parent.parent / "tests" / "support"))
from curve_checks import PLANES, contradictions, counts, random_plane

SCENES, SEED, CELLS = 100, 3, 100
#: Names of friction; no scene is varied over both.
FRICTION = ("friction", "friction_0")
#: Cells of the map beside the curves of the published model.
FINE = 400
#: Why a scene has no curves.
REFUSED = {
    "neither grows nor decays": "have no damping",
    "contacts open or close": "change their contacts over the ranges",
}


def by_rows(model: Any, parameters: dict[str, tuple[float, float]]) -> None:
    """Compute the map in rows over friction."""
    (name,) = (name for name in parameters if name in FRICTION)
    (other,) = (other for other in parameters if other != name)
    values, rows = (
        low + (high - low) * (np.arange(CELLS) + 0.5) / CELLS
        for low, high in (parameters[name], parameters[other])
    )
    family = Family(model)
    for value in rows:
        ss.stability(family.scene({other: float(value)}), {name: values})


def times(model: Any, parameters: dict[str, tuple[float, float]]) -> tuple[float, float, Any, Any]:
    """Return processor times of curves and map, one after the other, and curves and map."""
    own, found = clocked(lambda: ss.stability_boundary(model, parameters, progress=False))
    other, grid = clocked(lambda: counts(model, parameters, CELLS))
    if isinstance(model, ss.Scene) and any(name in FRICTION for name in parameters):
        other = min(other, clocked(lambda: by_rows(model, parameters))[0])
    return own, other, found, grid


def random_scenes(number: int, report: Report) -> None:
    """Add the table of random scenes."""
    rows: list[tuple[float, float]] = []
    refused: dict[str, int] = {}
    curves = wrong = compared = doubts = 0
    for index in range(number):
        scene, parameters = random_plane(SEED, index)
        try:
            own, other, found, grid = times(scene, parameters)
        except ss.InputError as error:
            (reason,) = (said for part, said in REFUSED.items() if part in str(error))
            refused[reason] = refused.get(reason, 0) + 1
            continue
        rows.append((own, other))
        denied, pairs = contradictions(found, scene, parameters, CELLS, known=grid)
        curves, wrong, compared = curves + len(found), wrong + len(denied), compared + pairs
        doubts += len(found.doubts) > 0
    spent = np.array(rows)
    table = []
    for what, part in (("curves", spent[:, 0]), (f"map, {CELLS} x {CELLS}", spent[:, 1])):
        quantiles = np.quantile(part, [0.0, 0.5, 0.9, 1.0])
        table.append([what, *(f"{1e3 * value:.0f}" for value in quantiles), f"{part.sum():.1f}"])
    headings = (f"{len(rows)} random scenes", "least, ms", "median", "nine of ten", "most", "all, s")
    report.table(headings, table)
    ratio = spent[:, 0] / spent[:, 1]
    left = " and ".join(f"{count} {reason}" for reason, count in refused.items())
    report.text(
        f"The curves take less than the map in {np.count_nonzero(ratio < 1.0)} of {len(rows)} scenes, in the",
        f"median {np.median(ratio):.2f} of its time and at most {ratio.max():.1f} times it. The {curves}",
        f"curves contradict {wrong} of {compared} pairs of neighbours; {doubts} results have doubts.",
        f"{number - len(rows)} more scenes have no such curves: {left}." if refused else "",
    )


def published(report: Report) -> None:
    """Add the table of the published model."""
    table = []
    for name, (model, parameters) in PLANES.items():
        own, other, found, _ = times(model, parameters)
        denied, compared = contradictions(found, model, parameters, FINE)
        table.append(
            [
                f"friction and {name}",
                f"{1e3 * own:.0f}",
                f"{1e3 * other:.0f}",
                f"{len(denied)} of {compared}",
                f"{_largest_error(found):.1e}",
            ]
        )
    report.table(
        (
            "published model over",
            "curves, ms",
            f"map {CELLS} x {CELLS}, ms",
            f"contradictions at {FINE} x {FINE}",
            "largest error of a point",
        ),
        table,
    )


def _largest_error(found: types.StabilityBoundary) -> float:
    return max(float(curve.error.max()) for curve in found)


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--scenes", type=int, default=SCENES, help="number of random scenes")
    options = parser.parse_args()
    report = Report("stability-boundary")
    times(*PLANES["damping"])  # loads what is loaded once
    random_scenes(options.scenes, report)
    published(report)
    report.finish(options.into, "stickslip", "numpy", "scipy")


if __name__ == "__main__":
    main()
