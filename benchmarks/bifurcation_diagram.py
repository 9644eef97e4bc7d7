"""Time of a bifurcation diagram of 400 friction values of the two-subsystem model.

Every value is a motion from disturbed sliding to its attractor, refined to a periodic orbit with its
multipliers.
"""

import time

import numpy as np

import stickslip as ss

VALUES = np.linspace(0.7, 3.2, 400)


def main() -> None:
    scene = ss.models.two_subsystems()
    ss.bifurcation(scene, {"friction": VALUES[:2]})  # loads what is loaded once
    begin = time.perf_counter()
    diagram = ss.bifurcation(scene, {"friction": VALUES})
    elapsed = time.perf_counter() - begin
    kinds, counts = np.unique(diagram.data.kind, return_counts=True)
    found = ", ".join(f"{count} {kind}" for kind, count in zip(kinds, counts, strict=True))
    print(f"{VALUES.size} friction values, {VALUES[0]:g} to {VALUES[-1]:g}: {elapsed:.2f} s ({found})")


if __name__ == "__main__":
    main()
