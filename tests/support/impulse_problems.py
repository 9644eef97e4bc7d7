"""Statuses of random impulse problems, found by trying every combination and confirmed in 50 digits.

    python tests/impulse_problems.py > tests/reference/impulse_problems.txt

The problems are drawn again, number by number, by the test in `one_solution.rs` that reads the file: all
entries are small integers over powers of two, exact in both languages. Slip is about 1 m/s, approach 1e-8 to
1e-16 m/s. A line holds the only combination of statuses that is consistent, or `several`.
"""

from __future__ import annotations

import itertools

import mpmath as mp
import numpy as np

#: (contacts, problems)
GROUPS = ((2, 4000), (3, 3000), (4, 3000), (6, 100))
#: Violations, relative, up to which doubles leave a combination to the 50 digits.
CANDIDATE = 1e-6

mp.mp.dps = 50


class Draws:
    """The linear congruential generator of Knuth's MMIX, high bits first."""

    def __init__(self, seed: int) -> None:
        self.state = seed

    def below(self, bound: int) -> int:
        """Return an integer in [0, bound)."""
        self.state = (self.state * 6364136223846793005 + 1442695040888963407) % 2**64
        return (self.state >> 33) % bound


def problem(count: int, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return W, the velocities (tangential, normal) before the impact, and the friction coefficients."""
    draws = Draws(seed)
    size = 2 * count
    factor = np.array([[draws.below(2047) - 1023 for _ in range(size)] for _ in range(size)]) / 1024
    w = factor @ factor.T + np.eye(size)
    velocity, friction = np.empty(size), np.empty(count)
    for i in range(count):
        velocity[2 * i] = (512 + draws.below(1024)) / 1024 * (1 - 2 * draws.below(2))
        velocity[2 * i + 1] = -(1024 + draws.below(1024)) / 1024 * 2.0 ** -(27 + draws.below(27))
        friction[i] = draws.below(512) / 1024
    return w, velocity, friction


def statuses_of(count: int, seed: int) -> str:
    """Return the consistent statuses of a problem, or ``several``."""
    w, velocity, friction = problem(count, seed)
    size = 2 * count
    names = list(itertools.product("s+-d", repeat=count))
    matrices = np.zeros((len(names), size, size))
    rhs = np.zeros((len(names), size))
    for k, name in enumerate(names):
        fill(matrices[k], rhs[k], name, w, velocity, friction)
    forces = np.linalg.solve(matrices, rhs[..., None])[..., 0]
    after = velocity + forces @ w.T
    scales = np.abs(velocity) + np.abs(forces) @ np.abs(w).T
    found = []
    for k, name in enumerate(names):
        if consistent(
            name, forces[k], after[k], friction, CANDIDATE * scales[k] / np.diag(w), CANDIDATE * scales[k]
        ):
            matrix, vector = mp.matrix(size, size), mp.matrix(size, 1)
            exact_w = mp.matrix(w.tolist())
            fill(matrix, vector, name, exact_w, velocity, friction)
            exact = mp.lu_solve(matrix, vector)
            moved = mp.matrix(velocity.tolist()) + exact_w * exact
            zero = [mp.mpf(10) ** -40] * size
            if consistent(name, exact, moved, friction, zero, zero):
                found.append("".join(name))
    assert found, (count, seed)
    return found[0] if len(found) == 1 else "several"


def fill(matrix, rhs, name, w, velocity, friction) -> None:  # type: ignore[no-untyped-def]
    """Write the equations of statuses: a velocity that vanishes, or a force that is given by another."""
    for i, status in enumerate(name):
        t, n = 2 * i, 2 * i + 1
        held = {"s": (t, n), "d": ()}.get(status, (n,))
        for row in (t, n):
            if row in held:
                for k in range(2 * len(name)):
                    matrix[row, k] = w[row, k]
                rhs[row] = -velocity[row]
            else:
                matrix[row, row] = 1
        if status in "+-":
            matrix[t, n] = -friction[i] if status == "+" else friction[i]


def consistent(name, forces, after, friction, force_slack, slack) -> bool:  # type: ignore[no-untyped-def]
    """Return whether all inequalities of the statuses hold."""
    for i, status in enumerate(name):
        t, n = 2 * i, 2 * i + 1
        if status == "d":
            if after[n] < -slack[n]:
                return False
            continue
        if forces[n] < -force_slack[n]:
            return False
        if status == "s" and abs(forces[t]) > friction[i] * forces[n] + force_slack[t]:
            return False
        if (status == "+" and after[t] > slack[t]) or (status == "-" and after[t] < -slack[t]):
            return False
    return True


if __name__ == "__main__":
    for count, problems in GROUPS:
        for seed in range(problems):
            print(statuses_of(count, seed))
