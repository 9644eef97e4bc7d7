"""Beside CalculiX: complex frequencies of a pad that a belt rubs, errors beside times.

Both programs get the same mesh of bricks, held at its back and in plane strain, and give the twelve lowest
modes of steady sliding. CalculiX presses and drags the belt in two static steps and lets contacts give a
little; stickslip holds them closed. The reference is LAPACK's: all eigenvalues of the rigid contacts, by
dense matrices. CalculiX prints seven digits. Times are processor time, the least of all rounds: of the
program with its start, and of all that stickslip does from the mesh on.
"""

from __future__ import annotations

import subprocess
import tempfile
from functools import partial
from operator import itemgetter
from pathlib import Path

import numpy as np
import scipy.linalg
from clock import clocked

import stickslip as ss
from comparisons.peer import milliseconds, options, program, timed
from report import Report

#: Cells along length and height of the pad, 40 x 4 x 20 mm.
MESHES = ((8, 4), (16, 8), (24, 12))
#: Stiffness of CalculiX's contact, Pa/m, on the coarsest mesh; the first one on all.
PENALTIES = (1e18, 1e17, 1e16)
ROUNDS, first = 3, itemgetter(0)
SIZE, MODES = (0.04, 0.004, 0.02), 12
YOUNG, POISSON, DENSITY = 10e9, 0.3, 2500.0
#: CalculiX lowers the friction by 2 % for the modes, so that all contacts slide.
FRICTION, SLIDING = 0.3, 0.294
#: m: by which the belt is pressed and dragged.
PRESSED, DRAGGED = 1e-11, 5e-10
REMEDY = "install CalculiX (Debian: calculix-ccx) or name its program"


def plate(cells: tuple[int, int]) -> ss.fe.Body:
    """Return the pad, its back held."""
    from meshed import plate as mesh

    body = mesh((cells[0], 1, cells[1]), SIZE, (0.0, 0.0, 0.0), young=YOUNG, poisson=POISSON, density=DENSITY)
    body = body.held(body.surface("top"))
    return body.held([dof for dof in body.dofs if dof.endswith(".2")])


def lines(numbers: np.ndarray) -> str:
    """Return numbers of nodes, eight a line."""
    return "\n".join(", ".join(map(str, numbers[k : k + 8])) for k in range(0, numbers.size, 8))


def deck(cells: tuple[int, int], penalty: float) -> str:
    """Return the deck of the pad on its belt."""
    nx, nz = cells
    x, z = np.linspace(0.0, SIZE[0], nx + 1), np.linspace(0.0, SIZE[2], nz + 1)
    points = [(a, b, c) for c in z for a in x for b in (0.0, SIZE[1])]
    nodes = "\n".join(f"{k + 1}, {a:.12g}, {b:.12g}, {c:.12g}" for k, (a, b, c) in enumerate(points))
    bricks = []
    for k in range(nz):
        for i in range(nx):
            first = 2 * (i + (nx + 1) * k) + 1
            base = (first, first + 2, first + 3, first + 1)
            bricks.append((len(bricks) + 1, *base, *(node + 2 * (nx + 1) for node in base)))
    count, last = len(points), len(bricks)
    corners = [(a, b) for a, b in ((-0.02, -0.01), (0.06, -0.01), (0.06, 0.014), (-0.02, 0.014))]
    belt = [(a, b, c) for c in (-0.01, 0.0) for a, b in corners]
    slider = ", ".join(str(count + 1 + k) for k in range(8))
    row = np.arange(1, 2 * (nx + 1) + 1)
    return f"""*NODE, NSET=ALL
{nodes}
*ELEMENT, TYPE=C3D8, ELSET=BLOCK
{chr(10).join(", ".join(map(str, brick)) for brick in bricks)}
*NODE, NSET=BELT
{chr(10).join(f"{count + 1 + k}, {a}, {b}, {c}" for k, (a, b, c) in enumerate(belt))}
*ELEMENT, TYPE=C3D8, ELSET=SLIDER
{last + 1}, {slider}
*NSET, NSET=FACE
{lines(row)}
*NSET, NSET=BACK
{lines(count - row[::-1] + 1)}
*MATERIAL, NAME=LINING
*ELASTIC
{YOUNG:g}, {POISSON:g}
*DENSITY
{DENSITY:g}
*SOLID SECTION, ELSET=BLOCK, MATERIAL=LINING
*SOLID SECTION, ELSET=SLIDER, MATERIAL=LINING
*SURFACE, NAME=PAD, TYPE=NODE
FACE
*SURFACE, NAME=TOP
SLIDER, S2
*SURFACE INTERACTION, NAME=RUB
*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR
{penalty:g}
*FRICTION
{FRICTION:g}, {penalty / 10.0:g}
*CONTACT PAIR, INTERACTION=RUB, TYPE=NODE TO SURFACE
PAD, TOP
*BOUNDARY
BACK, 1, 3
ALL, 2, 2
*STEP
*STATIC
1., 1.
*BOUNDARY
BELT, 1, 2
BELT, 3, 3, {PRESSED:g}
*END STEP
*STEP
*STATIC
1., 1.
*BOUNDARY
BELT, 1, 1, {DRAGGED:g}
BELT, 2, 2
BELT, 3, 3, {PRESSED:g}
*END STEP
*STEP, PERTURBATION
*CHANGE FRICTION, INTERACTION=RUB
*FRICTION
{SLIDING:g}, {penalty / 10.0:g}
*FREQUENCY
{MODES}
*END STEP
"""


def by_calculix(solver: str, cells: tuple[int, int], penalty: float) -> tuple[float, np.ndarray]:
    """Return processor time and the eigenvalues that CalculiX prints."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "rub.inp").write_text(deck(cells, penalty))
        taken = timed([solver, "rub"], Path(folder))
        table = [line.split() for line in (Path(folder) / "rub.dat").read_text().splitlines()]
    # Mode, angular frequency w and imaginary part g: lambda = j w - g.
    rows = [row for row in table if len(row) == 4 and row[0].isdecimal()]
    if len(rows) < MODES:
        raise SystemExit(f"{solver} printed {len(rows)} of {MODES} modes with a contact of {penalty:g} Pa/m")
    return taken, np.array([1j * complex(float(row[1]), float(row[3])) for row in rows])


def rubbed(cells: tuple[int, int]) -> ss.Scene:
    """Return the scene of the pad, from the mesh on."""
    body = plate(cells)
    pairs = ss.fe.contact_pairs(
        body.surface("bottom"), None, velocity=(1.0, 0.0, 0.0), friction=SLIDING, gap=-PRESSED
    )
    return ss.fe.assemble(body, pairs)


def sliding(cells: tuple[int, int], band: tuple[float, float]) -> ss.Modes:
    """Return the modes of a band, Hz, while all contacts slide, from the mesh on."""
    scene = rubbed(cells)
    return ss.complex_modes(scene, "+" * len(scene.contacts), band=band)


def by_lapack(scene: ss.Scene) -> np.ndarray:
    """Return the lowest eigenvalues while all contacts slide: dense matrices, normal directions held."""
    contacts = range(len(scene.contacts))
    normal = np.stack([scene.normal_direction(k) for k in contacts], axis=1)
    forces = normal + SLIDING * np.stack([scene.tangential_direction(k) for k in contacts], axis=1)
    mass, stiffness = (
        scipy.sparse.csc_array(parts, shape=(scene.size, scene.size)).toarray()
        for parts in (scene.core.matrices()[k] for k in (0, 2))
    )
    # Directions that hold the normal ones, and equations in which contact forces do no work.
    right = scipy.linalg.qr(normal)[0][:, normal.shape[1] :]
    left = scipy.linalg.qr(forces)[0][:, normal.shape[1] :].T
    squares = scipy.linalg.eigvals(np.linalg.solve(left @ mass @ right, left @ stiffness @ right))
    roots = 1j * np.sqrt(squares)
    return roots[np.argsort(roots.imag)][:MODES]


def largest(found: np.ndarray, expected: np.ndarray) -> float:
    """Return the largest relative error, each eigenvalue beside the nearest."""
    return max(float((np.abs(found - value) / abs(value)).min()) for value in expected)


def main() -> None:
    """Print the tables."""
    chosen = options(__doc__, "ccx", "the program of CalculiX").parse_args()
    solver = program(chosen.peer, REMEDY)
    rows, beside = [], []
    for cells in MESHES:
        expected = by_lapack(rubbed(cells))
        # The band ends between two modes.
        band = (0.0, 1.001 * expected[-1].imag / (2.0 * np.pi))
        own, modes = min((clocked(partial(sliding, cells, band)) for _ in range(ROUNDS)), key=first)
        taken, values = min((by_calculix(solver, cells, PENALTIES[0]) for _ in range(ROUNDS)), key=first)
        rows.append(
            [
                f"{cells[0]} x {cells[1]}", str(modes.scene.size), str(len(modes.scene.contacts)),
                str(np.count_nonzero(expected.real > 1.0)),
                milliseconds(own), f"{largest(modes.eigenvalues, expected):.1e}",
                milliseconds(taken), f"{largest(values, expected):.1e}",
            ]
        )  # fmt: skip
        if not beside:
            for penalty in PENALTIES:
                _, softer = by_calculix(solver, cells, penalty)
                beside.append([f"{penalty:.0e}", f"{largest(softer, expected):.1e}"])
    report = Report("calculix")
    headings = ("dofs", "contacts", "unstable", "stickslip, ms", "error", "CalculiX, ms", "error")
    report.table(("mesh", *headings), rows)
    report.table(("contact of CalculiX, Pa/m", "error"), beside)
    version = subprocess.run([solver, "-v"], capture_output=True, text=True).stdout.strip()
    report.finish(chosen.into, "stickslip", "numpy", "scipy", peers=f"CalculiX {version.split()[-1]}")


if __name__ == "__main__":
    main()
