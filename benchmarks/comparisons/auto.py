"""Beside AUTO-07p: the curves of Hopf points of a smooth scene over two parameters, errors beside times.

The error of a point is its distance from the exact curve, on which the Hurwitz determinant of the linearised
scene vanishes, in 40 digits and over the ranges of the parameters. Times are processor time: of the programs
of AUTO with their start, without the compilation, and of `ss.stability_boundary`, which also counts the
unstable modes over a grid, so that no curve is missed.
"""

from __future__ import annotations

import os
import resource
import shlex
import shutil
import tempfile
from pathlib import Path

import numpy as np
from clock import clocked
from mpmath import mp, mpf

import stickslip as ss
from comparisons.peer import milliseconds
from report import Report, arguments

ROUNDS = 5
#: Derivatives along both parameters.
AXES = ((1, 0), (0, 1))
REMEDY = "install auto-07p and gfortran, or say by AUTO_DIR where AUTO is and by FC what compiles and links"


def hurwitz(speed: mpf, kinetic: mpf) -> mpf:
    """Return the determinant that vanishes at Hopf points: a1 a2 a3 - a0 a3^2 - a1^2 a4."""
    level = (mpf("0.6") - kinetic) * mp.exp(-speed / mpf("0.5"))
    force = 2 * (kinetic + level)
    stretch = mp.findroot(lambda s: force - (mpf("0.5") * s + mpf("0.8") * s**3) * mpf(5) / 3 - s, force / 2)
    tangent = mpf("0.5") + mpf("2.4") * stretch**2
    first = (mpf(1), mpf("0.06") - 2 * level / mpf("0.5"), 1 + tangent)
    second = (mpf("0.7"), mpf("0.1"), mpf("1.5") + tangent)
    a = [sum(first[i] * second[k - i] for i in range(3) if 0 <= k - i < 3) for k in range(5)]
    a[4] -= tangent**2
    return a[1] * a[2] * a[3] - a[0] * a[3] ** 2 - a[1] ** 2 * a[4]


def distances(points: np.ndarray, spans: np.ndarray) -> np.ndarray:
    """Return the distance of points (k, 2) from the exact curve, to first order, over the ranges."""
    found = []
    for place in points:
        speed, kinetic = map(mpf, map(float, place))
        slopes = [mp.diff(hurwitz, (speed, kinetic), order) * s for order, s in zip(AXES, spans, strict=True)]
        found.append(float(abs(hurwitz(speed, kinetic)) / mp.norm(slopes)))
    return np.array(found)


def processor() -> float:
    """Return the processor time of all programs that have ended, s."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def by_auto() -> tuple[float, np.ndarray]:
    """Return the least time and the points, (number of the curve, speed, friction)."""
    from auto_peer import compiled, curves

    home = Path(os.environ.get("AUTO_DIR", "/usr/lib/auto-07p"))
    compiler = shlex.split(os.environ.get("FC", "gfortran -fopenmp"))[0]
    if not list((home / "lib").glob("*.o")):
        raise SystemExit(f"AUTO_DIR: there are no objects of AUTO in '{home / 'lib'}'; {REMEDY}")
    if shutil.which(compiler) is None:
        raise SystemExit(f"FC: there is no program '{compiler}'; {REMEDY}")
    os.environ["OMP_NUM_THREADS"] = "1"
    times = []
    with tempfile.TemporaryDirectory() as folder:
        program = compiled(Path(folder))
        for _ in range(ROUNDS):
            begin = processor()
            lines = curves(program, Path(folder))
            times.append(processor() - begin)
    return min(times), np.array([line.split() for line in lines], dtype=float)


def main() -> None:
    """Print the table."""
    chosen = arguments(__doc__).parse_args()
    mp.dps = 40
    taken, table = by_auto()
    from auto_peer import RANGES, belt

    spans = np.array([high - low for low, high in RANGES.values()])
    own = [clocked(lambda: ss.stability_boundary(belt(), RANGES)) for _ in range(ROUNDS)]
    boundary = own[0][1]
    ours = np.concatenate([curve.values for curve in boundary])
    rows = [
        ["stickslip", str(len(boundary)), milliseconds(min(t for t, _ in own)), *errors(ours, spans)],
        ["AUTO-07p", str(len(np.unique(table[:, 0]))), milliseconds(taken), *errors(table[:, 1:], spans)],
    ]
    report = Report("auto")
    report.table(("program", "curves", "ms", "points", "median error", "largest error"), rows)
    report.finish(chosen.into, "stickslip", "numpy", "mpmath", peers="AUTO-07p")


def errors(points: np.ndarray, spans: np.ndarray) -> list[str]:
    """Return the number of points, and the median and the largest of their errors."""
    found = distances(points, spans)
    return [str(len(points)), f"{np.median(found):.1e}", f"{found.max():.1e}"]


if __name__ == "__main__":
    main()
