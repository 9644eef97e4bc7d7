"""Beside pyHarm: forced response by harmonic balance, error over harmonics beside time.

Two scenes: Duffing's oscillator, which is smooth, and NLvib's two masses with a one-sided spring, which is
not. The references are digits of other methods (`tests/verification/nonlinear_springs.py`): of the smooth
scene the largest displacement, of the other the root mean square of the first mass. Times are processor time
of one orbit, the least over all rounds: from a start far off, and from the orbit at a frequency nearby.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from clock import clocked

import stickslip as ss
from comparisons.peer import ask, milliseconds, options
from report import Report

ROUNDS, SAMPLES = 5, 1024
REMEDY = "pip install pyharm-os, into an environment of its own, and name its interpreter"


@dataclass
class Case:
    """A scene under a harmonic load, as both programs take it, and a digit of its orbit."""

    name: str
    stiffness: list[list[float]]
    #: Damping over stiffness, s.
    damping: float
    spring: ss.Spring
    connector: tuple[str, dict[str, float]]
    load: tuple[str, float]
    start: ss.State
    #: rad/s: the frequency of the reference, one nearby, and where the branch of pyHarm begins.
    rate: float
    nearby: float
    begin: float
    measure: Callable[[np.ndarray], float]
    expected: float
    harmonics: tuple[int, ...]

    def scene(self, rate: float) -> ss.Scene:
        """Return the scene at a frequency of the load, rad/s."""
        size, damping = len(self.stiffness), self.damping * np.array(self.stiffness)
        load = ss.Harmonic({self.load[0]: self.load[1]}, rate / (2.0 * np.pi))
        return ss.Scene([1.0] * size, self.stiffness, damping, loads=[load], elements=[self.spring])

    def question(self) -> dict[str, Any]:
        """Return what pyHarm is asked."""
        stiffness = np.array(self.stiffness)
        matrices = {
            "M": np.eye(len(stiffness)),
            "C": self.damping * stiffness,
            "K": stiffness,
            "G": 0.0 * stiffness,
        }
        return {
            "matrices": {name: matrix.tolist() for name, matrix in matrices.items()},
            "spring": self.connector,
            "loaded": int(self.load[0].removeprefix("x")) - 1,
            "amplitude": self.load[1],
            "rates": [self.begin, self.nearby, self.rate],
            "harmonics": self.harmonics,
            "samples": SAMPLES,
            "rounds": ROUNDS,
        }


def largest(motion: np.ndarray) -> float:
    """Return the largest distance from zero, m, by the parabola through the three samples around it."""
    distance = np.abs(motion)
    place = int(distance.argmax())
    before, at, after = distance[place - 1], distance[place], distance[(place + 1) % distance.size]
    return float(at + (after - before) ** 2 / (8.0 * (2.0 * at - before - after)))


def mean_square(motion: np.ndarray) -> float:
    """Return the root mean square, m."""
    return float(np.sqrt(np.mean(motion**2)))


CASES = (
    Case(
        name="Duffing",
        stiffness=[[1.0]],
        damping=0.05,
        spring=ss.Spring("x1", ss.spring.Polynomial(0.0, 0.0, 0.1)),
        connector=("CubicSpring", {"k": 0.1}),
        load=("x1", 0.18),
        start=ss.State([0.0], [0.0], ""),
        rate=1.0,
        nearby=0.995,
        begin=0.5,
        measure=largest,
        expected=1.3125626015912,
        harmonics=(1, 3, 5, 7, 9),
    ),
    Case(
        name="one-sided spring",
        stiffness=[[1.0, -1.0], [-1.0, 2.0]],
        damping=0.03,
        spring=ss.Spring("x1", ss.spring.Gap(100.0, 1.0)),
        connector=("PenaltyUnilateralGap", {"g": 1.0, "k": 100.0}),
        load=("x2", 0.1),
        start=ss.State([1.0, 0.5], [0.3, 0.0], ""),
        rate=0.7,
        nearby=0.695,
        begin=0.3,
        measure=mean_square,
        expected=0.799742770942,
        harmonics=(3, 7, 15, 31, 61),
    ),
)


def ours(case: Case) -> list[str]:
    """Return the row of stickslip."""
    period = 2.0 * np.pi / case.rate
    scene, beside = case.scene(case.rate), case.scene(case.nearby)

    def far() -> ss.Cycle:
        return ss.simulate(scene, 150.0 * period, case.start).limit_cycle(further=100.0 * period)

    first = ss.simulate(beside, 150.0 * period, case.start).limit_cycle(further=100.0 * period)
    alone = [clocked(far) for _ in range(ROUNDS)]
    onward = [clocked(lambda: first.continued(scene)) for _ in range(ROUNDS)]
    times = np.linspace(0.0, period, 20_001)[:-1]
    errors = [
        abs(case.measure(cycle.run.sample(times).position.to_numpy()[:, 0]) / case.expected - 1.0)
        for _, cycle in (alone[0], onward[0])
    ]
    return [
        "stickslip", "1", milliseconds(min(t for t, _ in alone)), milliseconds(min(t for t, _ in onward)),
        f"{max(errors):.1e}",
    ]  # fmt: skip


def motion(coefficients: list[list[float]]) -> np.ndarray:
    """Return a period of displacement from (harmonic, cosine, sine) of pyHarm."""
    angles = 2.0 * np.pi * np.arange(20_000) / 20_000
    return sum(c * np.cos(k * angles) + s * np.sin(k * angles) for k, c, s in coefficients)


def main() -> None:
    """Print the tables."""
    chosen = options(__doc__, "python3", "an interpreter that imports pyHarm").parse_args()
    report = Report("pyharm")
    for case in CASES:
        rows = [ours(case)]
        answer = ask(chosen.peer, "pyharm", case.question(), REMEDY)
        for one in answer["runs"]:
            name = f"pyHarm, harmonics to {one['harmonics']}"
            if one["failure"]:
                rows.append([name, "-", "-", "-", one["failure"]])
                continue
            found = case.measure(motion(one["coefficients"]))
            rows.append(
                [
                    name, str(one["points"]), milliseconds(one["branch"]), milliseconds(one["time"]),
                    f"{abs(found / case.expected - 1.0):.1e}",
                ]
            )  # fmt: skip
        headings = ("orbits", "ms, from far", "ms, from nearby", "relative error")
        report.table((case.name, *headings), rows)
    report.finish(chosen.into, "stickslip", "numpy", peers=answer["version"])


if __name__ == "__main__":
    main()
