"""Counts of growing modes over a map beside the curves of a boundary, from what users see alone."""

from itertools import pairwise

import numpy as np

import stickslip as ss
from fuzz_scenes import fuzz_scene
from stickslip.scene.parameters.family import Family

#: Ranges of what random scenes are varied over, where they have it.
RANGES = {
    "friction": (0.0, 2.0),
    "friction_0": (0.0, 2.0),
    "friction_0_kinetic": (0.1, 0.6),
    "stiffness": (0.3, 3.0),
    "mass": (0.5, 2.0),
    "damping": (0.2, 3.0),
    "damping_stiffness": (0.0, 1e-4),
    "gyroscopic": (-2.0, 2.0),
    "circulatory": (-3.0, 3.0),
    "force": (0.5, 2.0),
}
#: Planes of the published model, by what is varied besides friction.
PLANES = {
    "slider speed": (ss.models.two_subsystems(), {"friction": (0.0, 3.0), "slider_speed": (0.01, 1.0)}),
    "a stiffness": (ss.models.two_subsystems, {"friction": (0.0, 3.0), "vertical_stiffness_0": (5e4, 2e6)}),
    "damping": (ss.models.two_subsystems, {"friction": (0.0, 3.0), "damping": (0.0, 2e-4)}),
}
#: What random scenes have besides.
EXTRAS = [(), (), ("unsymmetric",), ("unsymmetric",), ("laws",), ("compliant",)]


def random_plane(seed, index):
    """Return a random scene of up to 16 dofs, and two of its parameters with ranges."""
    rng = np.random.default_rng([seed, index, 42])
    while True:
        extras = EXTRAS[rng.integers(len(EXTRAS))]
        scene, _ = fuzz_scene(seed, int(rng.integers(10_000)), extras)
        parameters = {name: RANGES[name] for name in map(str, rng.choice([*RANGES], 2, replace=False))}
        if scene.size > 16:
            continue
        if "laws" not in extras:
            scene = scene.replace(static_friction=None)
        try:
            ss.stability(scene, {name: [0.5 * sum(ends)] for name, ends in parameters.items()})
        except ss.InputError:
            # The scene has no such number, or the two are the same.
            continue
        return scene, parameters


def counts(model, parameters, cells):
    """Return the places of a map, in the middles of its cells, and the number of growing modes (p, q)."""
    axes = {
        name: lower + (upper - lower) * (np.arange(cells) + 0.5) / cells
        for name, (lower, upper) in parameters.items()
    }
    grid = np.meshgrid(*axes.values(), indexing="ij")
    samples = {name: values.ravel() for name, values in zip(axes, grid, strict=True)}
    return axes, ss.stability(model, samples).unstable_modes.to_numpy().reshape(cells, cells)


def contradictions(boundary, model, parameters, cells, beside=1e-5, known=None):
    """Return pairs of neighbours of a map whose counts the curves deny, and how many pairs were compared.

    Counts that differ need a curve between; between equal ones an even number of curves may pass. Where a
    curve passes one of both places closer than `beside`, of the range, it may lie on either side as it is
    drawn. Two growing real eigenvalues that become a pair are one mode less and no curve: where counts
    alone deny the curves, the eigenvalues decide. `known` is what `counts` returns, where it is known.
    """
    axes, modes = counts(model, parameters, cells) if known is None else known
    names, places = list(axes), list(axes.values())
    lines = [curve.drawn(boundary.spans, 60) for curve in boundary if curve.kind != "separation"]

    def growing(along, k, j):
        values = {names[along]: float(places[along][j]), names[1 - along]: float(places[1 - along][k])}
        scene = Family(model).scene(values)
        modes = ss.complex_modes(scene, scene.core.sliding_combination())
        return np.count_nonzero(modes.with_conjugates.unstable)

    wrong, compared = [], 0
    for along in (0, 1):
        table = modes if along == 0 else modes.T
        for k, value in enumerate(places[1 - along]):
            meets = np.concatenate([np.zeros(0), *(_meets(line, along, value) for line in lines)])
            odd = np.array(
                [np.count_nonzero((meets > a) & (meets < b)) % 2 == 1 for a, b in pairwise(places[along])]
            )
            crossed = np.array([((meets > a) & (meets < b)).any() for a, b in pairwise(places[along])])
            near = np.abs(places[along][:, None] - meets) < beside * boundary.spans[along]
            near = near.any(axis=1)
            changed = np.diff(table[:, k]) != 0
            denied = (changed & ~crossed | ~changed & odd) & ~(near[1:] | near[:-1])
            compared += denied.size
            for j in np.flatnonzero(denied):
                changed = growing(along, k, j) != growing(along, k, j + 1)
                if changed != odd[j]:
                    wrong.append((names[along], k, int(j)))
    return wrong, compared


def _meets(line, along, value):
    """Return where a polyline crosses a line of the map."""
    across, ordinate = line[:, 1 - along] - value, line[:, along]
    k = np.flatnonzero((across[:-1] < 0.0) != (across[1:] < 0.0))
    part = across[k] / (across[k] - across[k + 1])
    return ordinate[k] + part * (ordinate[k + 1] - ordinate[k])
