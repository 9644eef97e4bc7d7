"""Modes of a band of a spinning disc, beside scipy's search at the same shifts and projections on real modes.

The disc is gyroscopic, circulatory and damped (tests/support/spinning_disc.py). scipy: `eigs` on the same
companion operator with `splu` of the same matrices, at the shifts that the program chose, for as many pairs
as it found there, right and left vectors. BLAS has one thread for both, by far the fastest for SuperLU.
Projection: the eigenvalues of the pencil projected on the real modes of M and K of lowest frequency.
Error: distance to scipy's eigenvalues at other shifts, refined in extended precision, in units of condition
times rounding of the eigenvalue.
"""

from __future__ import annotations

import resource
import sys
import time
from pathlib import Path

import numpy as np
import scipy.linalg
import scipy.sparse
import scipy.sparse.linalg
from threadpoolctl import threadpool_limits

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "support"))
import stickslip as ss
from reference_modes import reference_eigenvalues
from report import Report, arguments
from spinning_disc import spinning_disc
from stickslip.fe.reduced.lowest_modes import LowestModes
from stickslip.modes.complex_modes import judged
from stickslip.modes.sparse.pencil import SparsePencil
from stickslip.modes.sparse.region import Region
from stickslip.modes.sparse.search import Search, certified, covered

#: Meshes (radial, around, layers), and the band of each, Hz.
DISCS = {"5000": ((5, 84, 4), 10e3), "10000": ((6, 112, 5), 10e3), "50000": ((10, 240, 7), 6e3)}
LOWEST_GROWTH = -50.0
#: Dofs up to which eigenvalues are compared with refined ones.
REFINED = 20_000
#: Numbers of real modes to project on.
PROJECTIONS = (100,)


def scipy_search(pencil: SparsePencil, shift: complex, count: int) -> None:
    """Compute `count` right and left pairs nearest to a shift as a user of scipy would."""
    size, unit = pencil.size, abs(shift)
    factors = scipy.sparse.linalg.splu(
        pencil.at(shift), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.01, options={"SymmetricMode": True}
    )
    for side in "NT":
        mass, damping = (pencil.mass, pencil.damping) if side == "N" else (pencil.mass.T, pencil.damping.T)
        inertia, drag = (unit * mass).tocsr(), (damping + shift * mass).tocsr()

        def inverted(y: np.ndarray, side: str = side, inertia=inertia, drag=drag) -> np.ndarray:
            w = factors.solve(-unit * (inertia @ y[size:] + drag @ y[:size]), side)
            return np.concatenate([w, y[:size] + shift / unit * w])

        operator = scipy.sparse.linalg.LinearOperator((2 * size, 2 * size), inverted, dtype=complex)
        scipy.sparse.linalg.eigs(operator, k=count, tol=1e-10)


def seconds(work) -> tuple[float, float, object]:
    """Return wall and processor time, and the result."""
    wall, cpu = time.perf_counter(), time.process_time()
    result = work()
    return time.perf_counter() - wall, time.process_time() - cpu, result


def measured(scene: ss.Scene, highest: float) -> tuple[list[str], ss.Modes]:
    """Return the row of a disc, and its modes."""
    region = Region(0.0, 2.0 * np.pi * highest, LOWEST_GROWTH, np.inf)
    ordered, ordered_cpu, pencil = seconds(lambda: SparsePencil.of(scene, ""))
    search = Search(pencil)
    wall, cpu, width = seconds(lambda: covered(search, region))
    shifts = list(search.found)
    counted, counted_cpu, answer = seconds(lambda: certified(search, region, width))
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    modes = judged(scene, "", pencil, answer.found)

    def peer() -> None:
        with threadpool_limits(1, user_api="blas"):
            for found in shifts:
                scipy_search(pencil, found.shift, found.eigenvalues.size)

    _, peer_cpu, _ = seconds(peer)
    row = [
        str(scene.size),
        f"{highest / 1e3:g}",
        str(answer.found.eigenvalues.size),
        f"{ordered_cpu + cpu:.1f}",
        f"{peer_cpu:.1f}",
        f"{counted_cpu:.1f}",
        f"{ordered + wall + counted:.1f}",
        f"{answer.missing:.0e}",
        f"{memory:.0f}",
    ]
    return row, modes


def accuracy(modes: ss.Modes, highest: float) -> list[str]:
    """Return the largest residual, and the largest error in units of condition times rounding."""
    residual = f"{modes.residual.max():.0e}"
    if modes.mass.shape[0] > REFINED:
        return [residual, ""]
    found, condition = modes.eigenvalues, modes.condition
    expected = reference_eigenvalues(modes.mass, modes.damping, modes.stiffness, highest)
    expected = expected[(np.abs(expected) <= 2.0 * np.pi * highest) & (expected.real >= LOWEST_GROWTH)]
    nearest = expected[np.abs(found[:, None] - expected).argmin(axis=1)]
    error = np.abs(found - nearest) / (condition * np.finfo(float).eps * np.abs(nearest))
    return [residual, f"{error.max():.2f}"]


def main() -> None:
    """Print the tables."""
    parser = arguments(__doc__)
    parser.add_argument("--sizes", nargs="+", default=["5000", "10000"], choices=DISCS)
    chosen = parser.parse_args()
    report = Report("band-modes")
    rows, errors = [], []
    for name in chosen.sizes:
        mesh, highest = DISCS[name]
        scene = spinning_disc(*mesh)
        row, modes = measured(scene, highest)
        rows.append([*row, *accuracy(modes, highest)])
        errors += projections(scene, modes)
        print(*rows[-1], *errors[-len(PROJECTIONS) :], file=sys.stderr)
    headings = ["dofs", "band to, kHz", "modes", "search, CPU s", "scipy, CPU s", "count, CPU s", "both, s"]
    headings += ["missing", "memory, MB", "largest residual", "error"]
    report.table(headings, rows)
    headings = ["dofs", "real modes", "largest error of a growth rate, 1/s", "unstable", "of which found"]
    report.table(headings, errors)
    report.finish(chosen.into, "stickslip", "scipy")


def projections(scene: ss.Scene, modes: ss.Modes) -> list[list[str]]:
    """Return how far growth rates of projected pencils are from those of the band."""
    exact, grows = modes.eigenvalues, modes.unstable
    stiffness = scene.stiffness + 0.5 * (scene.circulatory + scene.circulatory.T)
    _, shapes = LowestModes(stiffness, scipy.sparse.diags_array(scene.mass), 0.0)(max(PROJECTIONS))
    rows = []
    for count in PROJECTIONS:
        basis = shapes[:, :count]
        k, c = (basis.T @ (matrix @ basis) for matrix in (modes.stiffness, modes.damping))
        state = np.block([[np.zeros((count, count)), np.eye(count)], [-k, -c]])
        values = scipy.linalg.eigvals(state)
        nearest = np.array([values[np.argmin(np.abs(values - value))] for value in exact])
        error = np.abs(nearest.real - exact.real).max()
        found = np.count_nonzero(nearest[grows].real > 0.0)
        rows.append([str(scene.size), str(count), f"{error:.2g}", str(np.count_nonzero(grows)), str(found)])
    return rows


if __name__ == "__main__":
    main()
