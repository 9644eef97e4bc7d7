"""The complex modes of a scene: all of them, those of a band, or those near given points."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from stickslip.faults import InputError
from stickslip.modes.modes import Modes, one_of_each_pair
from stickslip.modes.sparse.pencil import SparsePencil, sparse_array
from stickslip.modes.sparse.region import Region
from stickslip.modes.sparse.search import MARGIN, Search, certified, covered
from stickslip.modes.sparse.shift_invert import Found
from stickslip.scene.checks import Complex, Index, real_array, whole_number
from stickslip.scene.scene import Scene, checked_combination

#: Free coordinates up to which all modes are computed and a part of them chosen: that takes less time than a
#: search.
FEW = 100
#: Largest distance to a bound, relative to the rounding of an eigenvalue, at which its side is in doubt.
_BORDER = 10.0


def complex_modes(
    scene: Scene,
    combination: str | None = None,
    *,
    band: Sequence[float] | None = None,
    growth: Sequence[float | None] = (None, None),
    near: ArrayLike | None = None,
    count: int = 20,
    certify: bool = True,
) -> Modes:
    """Return the complex modes of a scene: all of them, or those of a band or near given points.

    Parameters
    ----------
    scene
        The scene.
    combination
        One letter of ``+ - s d`` per contact; None: that of steady sliding, in which each slider speed gives
        the sign of its contact.
    band
        Lowest and highest frequency ``|lambda| / 2 pi``, Hz, both included: the result has all modes of the
        band, and `Modes.missing` counts those that were not found.
    growth
        With `band`: lowest and highest growth rate Re lambda, 1/s, both included; None: no bound.
    near
        One or several points of the plane of eigenvalues, 1/s: the result has the modes nearest to each.
    count
        With `near`: number of modes at each point.
    certify
        With `band`: whether the modes that are missing are counted (`Modes.missing`); without the count,
        which takes several factorizations more, a mode can be missed unnoticed.

    Raises
    ------
    InputError
        If `combination` does not fit the scene, or a slider speed is zero where none is given; if `band`,
        `growth`, `near` or `count` is ill-posed, or both `band` and `near` are given.
        If a contact slips without mass at a speed at which its law of friction has levelled off.
    NoSteadyStateError
        If none is given and a contact would pull in steady sliding. With a combination the modes are computed
        whether or not the static load keeps its contacts closed.

    Notes
    -----
    All modes: errors of the eigenvalues are `condition` times rounding times the norm of the problem; every
    pair's `residual` is checked by the core.

    A part of them: block Arnoldi on ``[[0, 1], [-K, -C]] y = lambda [[1, 0], [0, M]] y``, shifted and
    inverted with one sparse LU of ``P(sigma) = sigma^2 M + sigma C + K`` per shift, for right and for left
    vectors (Saad 2011, chapters 6 and 8). Every eigenvalue is then corrected by ``v' P(lambda) x / v'
    P'(lambda) x`` with the stated matrices in doubled precision, so that its error is about `condition` times
    rounding times ``|lambda|``; `residual` is ``|P(lambda) x| / ((|lambda|^2 |M| + |lambda| |C| + |K|) |x|)``
    in the largest entry and row sum, `condition` ``(2 |lambda| |x|_M |v|_M + |x_s|_C |v_s|_C) / |v'
    P'(lambda) x|``, s being the coordinates that slip without mass.

    A contact that slips without mass under a law of friction moves by the slope of the law: with N_0 its
    normal force and v the slip speed, ``N_0 mu'(v) x_s' + (K x)_s = 0``, a state of first order, with one
    eigenvalue.

    Shifts are added until their discs cover the band. Whether an eigenvalue was missed is then counted by the
    winding of ``det P`` round a wide contour, with those found divided out: see `Modes.missing`. Without the
    count the shifts cover the band all the same.
    """
    chosen = checked_combination(scene, combination)
    if near is not None and band is not None:
        raise InputError("near: cannot be given together with band; call it once with each")
    if band is None and tuple(growth) != (None, None):
        raise InputError(f"growth: needs a band, got growth={growth!r} alone")
    if band is None and not certify:
        raise InputError("certify: needs a band, in which it leaves missing modes uncounted")
    region = None if band is None else region_of(band, growth)
    points = np.zeros(0, dtype=complex) if near is None else _points(near)
    whole_number("count", count, 1)
    if near is None and region is None:
        return _all_modes(scene, chosen)
    matrices = scene.core.sparse_pencil(chosen)
    size = matrices[0][2].size - 1
    if size <= FEW:
        modes = _all_modes(scene, chosen)
        if region is not None:
            return _bordered(modes, region)
        return modes[_nearest(modes.eigenvalues, points, count)]
    pencil = SparsePencil.of_matrices(*map(sparse_array, matrices))
    if region is not None:
        return _bordered(band_modes(scene, chosen, pencil, region, certify), region)
    asked = count
    while True:
        search = Search(pencil)
        search.near(list(points), min(asked, 2 * size))
        merged = search.merged()
        if asked >= 2 * size or all(
            np.count_nonzero(found.eigenvalues.imag >= -1e-9 * np.abs(found.eigenvalues)) >= min(count, size)
            for found in search.found
        ):
            break
        # Near the real axis half of those found are conjugates.
        asked *= 2
    modes = judged(scene, chosen, pencil, merged.kept(_nearest(merged.eigenvalues, points, count)))
    return dataclasses.replace(modes, missing=None)


def _all_modes(scene: Scene, combination: str) -> Modes:
    every = Modes(combination=combination, dofs=scene.dofs, scene=scene, **scene.core.modes(combination))
    return every[one_of_each_pair(every.eigenvalues)]


def region_of(band: Sequence[float], growth: Sequence[float | None]) -> Region:
    """Return what a band in Hz and a range of growth rates in 1/s bound.

    Raise `InputError` if one is ill-posed, or nothing lies in both.
    """
    ends = real_array("band", band, 1)
    if ends.shape != (2,) or not 0.0 <= ends[0] < ends[1]:
        raise InputError(f"band: expected (lowest, highest) in Hz, 0 <= lowest < highest, got {band!r}")
    if not isinstance(growth, Sequence | np.ndarray) or len(growth) != 2:
        raise InputError(f"growth: expected (lowest, highest) in 1/s, each a number or None, got {growth!r}")
    left, right = (
        default if bound is None else float(real_array("growth", [bound], 1)[0])
        for bound, default in zip(growth, (-np.inf, np.inf), strict=True)
    )
    if not left < right:
        raise InputError(f"growth: expected (lowest, highest), lowest < highest, got {growth!r}")
    region = Region(2.0 * np.pi * ends[0], 2.0 * np.pi * ends[1], left, right)
    if left >= region.high or right <= -region.high:
        raise InputError(f"growth: no eigenvalue of the band {band!r} can have a growth rate in {growth!r}")
    return region


def band_modes(
    scene: Scene, combination: str, pencil: SparsePencil, region: Region, certify: bool = True
) -> Modes:
    """Return the modes of a region of a large scene and of a margin round it, counted if wanted."""
    search = Search(pencil)
    width = covered(search, region)
    if not certify:
        merged = search.merged()
        inside = merged.kept(region.holds(merged.eigenvalues, MARGIN * region.high))
        return dataclasses.replace(judged(scene, combination, pencil, inside), missing=None)
    answer = certified(search, region, width)
    modes = judged(scene, combination, pencil, answer.found)
    return dataclasses.replace(modes, missing=answer.missing, doubts=answer.doubts)


def _points(near: ArrayLike) -> Complex:
    try:
        points = np.atleast_1d(np.asarray(near, dtype=complex))
    except (TypeError, ValueError):
        raise InputError(f"near: expected one or several complex numbers in 1/s, got {near!r}") from None
    if points.ndim != 1 or points.size == 0 or not np.isfinite(points).all():
        raise InputError(f"near: expected one or several finite complex numbers in 1/s, got {near!r}")
    # The spectrum is mirrored in the real axis.
    upper: Complex = points.real + 1j * np.abs(points.imag)
    return upper


def _nearest(values: Complex, points: Complex, count: int) -> Index:
    """Return the places of the `count` eigenvalues nearest to each point, ascending."""
    chosen = [np.argsort(np.abs(values - point), kind="stable")[:count] for point in points]
    return np.unique(np.concatenate(chosen))


def judged(scene: Scene, combination: str, pencil: SparsePencil, found: Found) -> Modes:
    """Return the modes of pairs of the upper half plane."""
    right, left = (np.ascontiguousarray(pencil.unscaled(vectors).T) for vectors in (found.right, found.left))
    parts = scene.core.judged_pairs(combination, found.eigenvalues, right, left)
    order = np.argsort(np.abs(parts["eigenvalues"]), kind="stable")
    columns = {name: array[..., order] for name, array in parts.items()}
    undefined = columns["defective"]
    columns["a"][undefined] = np.nan
    columns["left_displacement"][:, undefined] = np.nan
    columns["b"] = -columns["eigenvalues"] * columns["a"]
    mass, damping, stiffness = map(sparse_array, scene.core.sparse_pencil(combination))
    return Modes(
        combination=combination,
        dofs=scene.dofs,
        scene=scene,
        mass=mass,
        damping=damping,
        stiffness=stiffness,
        **columns,
    )


def _bordered(modes: Modes, region: Region) -> Modes:
    """Return the modes in a region, with the doubt on which side of a bound some lie within rounding."""
    inside = region.holds(modes.eigenvalues)
    near = region.border(modes.eigenvalues) <= _BORDER * modes.rounding
    # Left out or not, and the number of those in the region.
    number = np.cumsum(inside) - 1
    doubts = tuple(
        (f"mode {number[k]}" if inside[k] else "a mode that is left out")
        + f", {modes.frequencies[k]:.6g} Hz with growth rate {modes.eigenvalues[k].real:.6g} 1/s, lies on a "
        "bound within rounding"
        for k in np.flatnonzero(near)
    )
    return dataclasses.replace(modes[inside], doubts=modes.doubts + doubts)
