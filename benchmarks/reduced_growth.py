"""Growth rates of reduced models beside those of the full ones, in random reductions.

A pad on a rotating disc (`meshed_contact`), with a random mesh, friction, speed and band. Each scene is
reduced with one of the boundaries, with the tolerance of growth rates and without. The growth rates of the
modes of the band that grow are compared with those of the full scene.
"""

from __future__ import annotations

import sys

import numpy as np
from clock import clocked
from meshed_contact import PRESSURE, bodies

import stickslip as ss
from report import Report, arguments

BOUNDARIES = ("lumped", "consistent", "massless")
#: Factor on the frequency up to which eigenvalues of the reduced scene can stand for those of the band
MARGIN = 1.02
#: Relative distance without which an eigenvalue of the reduced scene has no counterpart
NEAR = 0.02


def random_scene(rng: np.random.Generator) -> tuple[ss.Scene, tuple[float, float]]:
    """Return a scene and a band, Hz."""
    disc_cells = (int(rng.integers(3, 6)), int(rng.integers(30, 61)), int(rng.integers(1, 3)))
    pad_cells = (int(rng.integers(2, 5)), int(rng.integers(4, 9)), int(rng.integers(1, 3)))
    disc, pad = bodies(disc_cells, pad_cells, lumped=bool(rng.integers(2)))
    pairs = ss.fe.contact_pairs(
        pad.surface("face"),
        disc.surface("top"),
        velocity=ss.fe.Rotation(float(rng.uniform(1.0, 20.0))),
        friction=float(rng.uniform(0.2, 0.8)),
        plane=False,
    )
    force = pad.surface("back").pressure(PRESSURE)
    return ss.fe.assemble([disc, pad], pairs, force=force), (500.0, float(rng.uniform(5e3, 12e3)))


def errors(scene: ss.Scene, small: ss.Scene, band: tuple[float, float]) -> tuple[float, int]:
    """Return the largest relative error of a growth rate, and the number of spurious eigenvalues."""
    combination = "+" * len(scene.contacts)
    wider = (band[0] / MARGIN, band[1] * MARGIN)
    full = ss.complex_modes(scene, combination, band=wider).eigenvalues
    few = ss.complex_modes(small, combination).eigenvalues
    inside = [(np.abs(values) >= 2.0 * np.pi * band[0]) & (np.abs(values) <= 2.0 * np.pi * band[1])
              for values in (full, few)]  # fmt: skip
    spurious = sum(np.abs(full - value).min() > NEAR * abs(value) for value in few[inside[1]])
    growing = full[inside[0] & (full.real > 1e-4 * np.abs(full))]
    worst = 0.0
    for value in growing:
        nearest = few[np.abs(few - value).argmin()]
        worst = max(worst, abs(nearest.real - value.real) / value.real)
    return worst, int(spurious)


def reduced(
    scene: ss.Scene, band: tuple[float, float], boundary: str, asked: bool
) -> tuple[float, ss.fe.Reduction]:
    """Return processor time and the reduced model, with the tolerance of growth rates or without."""
    growth = 0.05 if asked else None
    combination = "+" * len(scene.contacts)
    return clocked(
        lambda: ss.fe.reduce(scene, band, boundary, combination=combination, growth_tolerance=growth)
    )


def main() -> None:
    """Print the table."""
    parser = arguments(__doc__)
    parser.add_argument("--reductions", type=int, default=18)
    parser.add_argument("--seed", type=int, default=1)
    chosen = parser.parse_args()
    rng = np.random.default_rng(chosen.seed)
    found: dict[tuple[str, bool], list[tuple[int, float, float, int]]] = {
        (boundary, asked): [] for boundary in BOUNDARIES for asked in (True, False)
    }
    refused: dict[tuple[str, bool], int] = dict.fromkeys(found, 0)
    for number in range(chosen.reductions):
        scene, band = random_scene(rng)
        boundary = BOUNDARIES[number % len(BOUNDARIES)]
        for asked in (True, False):
            try:
                time, reduction = reduced(scene, band, boundary, asked)
            except ss.InputError as error:
                refused[boundary, asked] += 1
                print(number, scene.size, boundary, asked, error, file=sys.stderr)
                continue
            worst, spurious = errors(scene, reduction.scene, band)
            print(number, scene.size, len(scene.contacts), boundary, asked, reduction.frequencies.size,
                  f"{worst:.3f}", spurious, f"{time:.1f}", file=sys.stderr)  # fmt: skip
            found[boundary, asked].append((reduction.frequencies.size, time, worst, spurious))
    rows = []
    for (boundary, asked), results in found.items():
        if not results:
            continue
        modes, times, worst, spurious = (np.array(column) for column in zip(*results, strict=True))
        rows.append(
            [
                boundary,
                "0.05" if asked else "none",
                str(len(results)),
                str(refused[boundary, asked]),
                f"{worst.max():.2g}",
                str(int(spurious.sum())),
                f"{np.median(modes):.0f}",
                f"{np.median(times):.1f}",
            ]
        )
    headings = [
        "boundary", "tolerance of growth", "reductions", "refused", "largest error of growth", "spurious",
        "modes, median", "CPU s, median",
    ]  # fmt: skip
    report = Report("reduced-growth")
    report.table(headings, rows)
    report.finish(chosen.into, "stickslip", "scipy")


if __name__ == "__main__":
    main()
