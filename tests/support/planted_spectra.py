"""Small pencils with planted eigenvalues: any number in a band, clusters, double ones, some next to it.

As a script, it searches the bands of some, and counts what it withholds next to the contours of others.
"""

import sys
from collections import Counter

import numpy as np
import scipy.sparse

from stickslip.modes.sparse.certificate import Certificate
from stickslip.modes.sparse.pencil import SparsePencil
from stickslip.modes.sparse.region import Region
from stickslip.modes.sparse.search import search_region, with_conjugates

#: The band, 1/s, and the lowest growth rate.
HIGH, LEFT = 1000.0, -20.0


def planted(seed):
    """Return M, C, K, the region and the eigenvalues of the upper half plane in it.

    Every pair of roots is a coordinate ``x'' - 2 Re(l) x' + |l|^2 x = 0``, of real roots p and q
    ``x'' - (p + q) x' + p q x = 0``; a random change of basis of condition 10 mixes them.
    """
    random = np.random.default_rng(seed)
    low = float(random.choice([0.0, 0.0, 300.0]))
    count = int(random.integers(0, 41))
    inside = []
    while len(inside) < count:
        value = complex(random.uniform(LEFT + 1.0, 30.0), random.uniform(max(low, 5.0) + 1.0, HIGH - 1.0))
        kind = random.integers(0, 6)
        copies = 1
        if kind == 0:
            copies = 2
        elif kind == 1:
            # Next to a bound, on its inner side.
            gap = 10.0 ** random.uniform(-7.0, -1.0)
            value = complex(LEFT + gap, value.imag) if random.random() < 0.5 else 1j * (HIGH - gap) + 0.1
        inside += [value] * copies
        if kind == 2:
            inside += [
                value * (1.0 + 10.0 ** random.uniform(-9.0, -3.0)) for _ in range(random.integers(1, 4))
            ]
    outside = [
        complex(random.uniform(-60.0, 30.0), y)
        for y in np.concatenate([random.uniform(1.001, 4.0, random.integers(5, 30)) * HIGH])
    ]
    outside += [
        complex(random.uniform(3.0, 20.0) * LEFT, random.uniform(1.0, HIGH))
        for _ in range(random.integers(0, 10))
    ]
    if low > 0.0:
        outside += [
            complex(random.uniform(-10, 10), y)
            for y in random.uniform(0.1, 0.999, random.integers(0, 10)) * low
        ]
    pairs = [(-2.0 * z.real, abs(z) ** 2) for z in inside + outside]
    reals = [random.uniform(-3.0, 3.0, 2) * HIGH for _ in range(random.integers(0, 3))]
    pairs += [(-(p + q), p * q) for p, q in reals]
    roots = np.array(inside + outside + [complex(p) for pair in reals for p in pair], dtype=complex)
    region = Region(low, HIGH, LEFT, np.inf)
    return mixed(random, pairs), region, roots[region.holds(roots)]


def mixed(random, pairs):
    """Return M, C, K of coordinates with given damping and stiffness in another basis."""
    size = len(pairs)
    left, _, right = np.linalg.svd(random.standard_normal((size, size)))
    basis = left * np.geomspace(1.0, 10.0, size) @ right
    c, k = (np.linalg.solve(basis, np.array(column)[:, None] * basis) for column in zip(*pairs, strict=True))
    return [scipy.sparse.csr_array(matrix) for matrix in (np.eye(size), c, k)]


def outcome(seed):
    """Return ``right``, ``doubt`` or ``wrong``, with the expected values and the answer."""
    matrices, region, expected = planted(seed)
    answer = search_region(SparsePencil.of_matrices(*matrices), region)
    found = answer.found.eigenvalues[region.holds(answer.found.eigenvalues)]
    if answer.doubts:
        return "doubt", expected, answer
    # Eigenvalues nearer to a bound than rounding moves them may lie on either side.
    clear = np.count_nonzero(region.border(expected) > 1e-6)
    return "right" if clear <= found.size <= expected.size else "wrong", expected, answer


def withheld(seed):
    """Return ``right``, ``doubt`` or ``wrong`` where groups of one to four next to the contour are hidden."""
    random = np.random.default_rng(seed)
    low, right = float(random.choice([0.0, 0.0, 0.3 * HIGH])), float(random.choice([np.inf, 0.1 * HIGH]))
    region = Region(low, HIGH, 5.0 * LEFT, right)

    def anywhere(count):
        return random.uniform(-0.3, 0.06, count) * HIGH + 1j * random.uniform(0.005, 3.0, count) * HIGH

    kept, hidden = anywhere(random.integers(5, 60)), [anywhere(random.integers(0, 3))]
    for _ in range(random.integers(0, 5)):
        gap = 10.0 ** random.uniform(-3.0, 2.3) * random.choice([-1.0, 1.0])
        place = complex(5.0 * LEFT + gap, random.uniform(0.01, 0.9) * HIGH)
        if random.random() < 0.5:
            place = (HIGH + gap) * np.exp(1j * random.uniform(np.pi / 2 - 0.05, np.pi / 2 + 0.1))
        copies = random.standard_normal(random.integers(1, 5))
        hidden.append(place * (1.0 + 10.0 ** random.uniform(-9.0, -2.0) * copies))
    hidden = np.concatenate(hidden)
    pairs = [(-2.0 * z.real, abs(z) ** 2) for z in np.concatenate([kept, hidden])]
    certificate = Certificate.of(SparsePencil.of_matrices(*mixed(random, pairs)), region, 0.1 * HIGH)
    known = with_conjugates(kept)
    while certificate.refined(known):
        pass
    if certificate.unresolved(known) or (hidden.size and region.border(hidden).min() < 1e-6):
        return "doubt"
    expected = 2 * np.count_nonzero(region.holds(hidden))
    return "right" if abs(certificate.missing(known) - expected) < 1e-6 else "wrong"


if __name__ == "__main__":
    first, last = map(int, sys.argv[1:3])
    print(Counter(withheld(seed) for seed in range(first, last)))
    counts = {}
    worst = 0.0
    for seed in range(first, last):
        word, expected, answer = outcome(seed)
        counts[word] = counts.get(word, 0) + 1
        if word != "right":
            print(
                seed,
                word,
                expected.size,
                answer.found.eigenvalues.size,
                answer.missing,
                answer.doubts,
                answer.shifts,
            )
        else:
            worst = max(worst, abs(answer.missing))
    print(counts, "largest |missing| where right:", worst)
