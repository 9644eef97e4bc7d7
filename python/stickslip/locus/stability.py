"""The stability verdict alone, for many scenes at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from stickslip import _core
from stickslip.faults import InputError
from stickslip.locus.band.path import BandPath, is_large, wanted_region
from stickslip.locus.band.sweep import band_verdicts
from stickslip.locus.path import Sliding, moved_friction
from stickslip.modes.complex_modes import complex_modes
from stickslip.modes.sparse.region import Region
from stickslip.scene.checks import Real, real_array
from stickslip.scene.parameters.family import Family, Model
from stickslip.scene.parameters.values import apart, checked_parameters
from stickslip.scene.scene import Scene


def stability(
    model: Model,
    parameters: Mapping[str, Any],
    *,
    combination: str | None = None,
    band: Sequence[float] | None = None,
    growth: Sequence[float | None] = (None, None),
) -> xr.Dataset:
    """Return the least stable eigenvalue of every scene of a sample, without computing vectors.

    Parameters
    ----------
    model
        A `Scene`, or a function from keywords to one. Scenes and the functions of `stickslip.models`, also
        with some arguments set by `functools.partial`, are evaluated in compiled code.
    parameters
        Samples (k,) of parameters, by names as for `sweep`, all of one length; numbers stay the same in all
        samples. A parameter with several entries, such as ``friction`` of two contacts, also takes (k,
        entries).
    combination
        One letter of ``+ - s d`` per contact; None: that of steady sliding of each sample, in which each
        slider speed gives the sign of its contact.
    band, growth
        Frequencies in Hz and growth rates in 1/s as for `complex_modes`: only the modes inside decide the
        verdict. For a large scene one parameter has samples, and its modes are followed as by `sweep`.

    Returns
    -------
    xarray.Dataset
        Over ``sample``, with the parameters as coordinates (a variable that is named as one has ``computed_``
        before its name): ``eigenvalue``, the one with the largest real
        part and nonnegative imaginary part, 1/s; ``growth_rate``, its real part; ``frequency``,
        ``|lambda| / 2 pi``, Hz; ``unstable_modes``, the number of modes that grow, where a conjugate pair
        counts as one; ``steady_sliding``, whether steady sliding of the combination exists (`sweep`): if it
        does not, the other values say nothing about it; ``normal_force`` of the closed contacts in
        equilibrium, N, also over ``contact``. With `band` eigenvalues are nan where no mode is inside, and
        the attributes are ``missing`` and ``doubts`` of both ends (`sweep`).

    Raises
    ------
    InputError
        If a parameter is unknown, lengths differ, a value is ill-posed, or a slider speed is zero where no
        combination is given; if `band` or `growth` is ill-posed, or a large scene has samples of several
        parameters.
    """
    region = wanted_region(band, growth)
    family = Family(model)
    told = checked_parameters(model, parameters)
    columns = _columns(family, {name: real_array(name, value, 0, 1, 2) for name, value in told.items()})
    rows = np.column_stack([*columns.values()])
    attrs: dict[str, Any] = {}
    if region is None:
        found, contacts = _verdicts(family, combination, tuple(columns), rows)
    else:
        found, contacts, attrs = _band_verdicts(family, combination, told, columns, rows, region)
    eigenvalue = found["eigenvalue"]
    variables = {
        "eigenvalue": ("sample", eigenvalue, {"units": "1/s"}),
        "growth_rate": ("sample", eigenvalue.real, {"units": "1/s"}),
        "frequency": ("sample", np.abs(eigenvalue) / (2.0 * np.pi), {"units": "Hz"}),
        "unstable_modes": ("sample", found["unstable_modes"]),
        "steady_sliding": ("sample", found["steady_sliding"]),
        "normal_force": (("sample", "contact"), found["normal_force"], {"units": "N"}),
    }
    return xr.Dataset(
        apart(variables, columns),
        coords={
            "contact": contacts,
            **{name: ("sample", values, family.units(name)) for name, values in columns.items()},
        },
        attrs=attrs,
    )


def _columns(family: Family, arrays: dict[str, Real]) -> dict[str, Real]:
    """Return the samples of every number by its name, (k,) each."""
    lengths = {name: len(value) for name, value in arrays.items() if value.ndim > 0}
    if not lengths:
        raise InputError("stability: expected at least one parameter with an array of samples")
    first, count = next(iter(lengths.items()))
    columns: dict[str, Real] = {}
    for name, array in arrays.items():
        if array.ndim and len(array) != count:
            raise InputError(f"{name}: expected {count} samples like {first}, got {len(array)}")
        _, place, entries, late = family.slot(name)
        if array.ndim < 2:
            columns[name] = np.broadcast_to(array, count)
        elif place is None and array.shape[1] == entries and not late:
            columns |= {f"{name}_{k}" if entries > 1 else name: array[:, k] for k in range(entries)}
        else:
            several = "" if entries == 1 else f" or ({count}, {entries})"
            raise InputError(f"{name}: expected shape ({count},){several}, got {array.shape}")
    return columns


def _band_verdicts(
    family: Family,
    combination: str | None,
    told: Mapping[str, Any],
    columns: Mapping[str, Real],
    rows: Real,
    region: Region,
) -> tuple[dict[str, Any], list[Any], dict[str, Any]]:
    """Return the verdicts on the modes of a region, labels of contacts, and the attributes."""
    sliding, names = Sliding(family, combination), tuple(columns)
    points = [dict(zip(names, map(float, row), strict=True)) for row in rows]
    name, fixed = names[0], {key: value for key, value in points[0].items() if key != names[0]}
    if not is_large(sliding, name, points[0][name], fixed):
        found, contacts = _verdicts(family, combination, names, rows)
        for k, point in enumerate(points):
            modes = complex_modes(family.scene(point), combination)
            inside = np.flatnonzero(region.holds(modes.eigenvalues))
            found["unstable_modes"][k] = np.count_nonzero(modes.unstable[inside])
            real = modes.eigenvalues.real[inside]
            found["eigenvalue"][k] = (
                modes.eigenvalues[inside[np.argmax(real)]] if inside.size else complex(np.nan, np.nan)
            )
        return found, contacts, {"missing": [0.0, 0.0], "doubts": []}
    varied = [key for key, value in told.items() if np.ndim(value)]
    if len(varied) != 1 or varied[0] not in names:
        raise InputError(f"band: of a large scene expected samples of one parameter, got {varied}")
    name = varied[0]
    values = columns[name].copy()
    fixed = {key: value for key, value in points[0].items() if key != name}
    lower, upper = float(values.min()), float(values.max())
    followed = BandPath(sliding, name, fixed, lower, upper + (lower == upper), region)
    labels = family.scene(points[0]).contact_labels()
    attrs = {"missing": followed.missing, "doubts": followed.doubts}
    return band_verdicts(followed.path, values, region), labels, attrs


def _verdicts(
    family: Family, combination: str | None, names: tuple[str, ...], rows: Real
) -> tuple[dict[str, Any], list[Any]]:
    """Return the verdicts on samples, and the labels of their contacts."""
    if isinstance(family.model, Scene) and len(names) == 1 and moved_friction(family.model, names[0]):
        # Only the terms with friction change from one sample to the next.
        lower, upper = float(rows.min(initial=np.inf)), float(rows.max(initial=-np.inf))
        path = Sliding(family, combination).path(names[0], lower, upper + (lower == upper), {})
        return path.growth(rows[:, 0].copy()), family.model.contact_labels()

    def scene(row: Real) -> Scene:
        return family.scene(dict(zip(names, map(float, row), strict=True)))

    if family.compiled(names):
        for sample, place in np.argwhere(~np.isfinite(rows)):
            raise InputError(f"{names[place]}: must be finite, got {rows[sample, place]} in sample {sample}")
        family.check_angles(names, rows)
        labels = family.template.contact_labels()
        samples: Any = family.compile(names), np.ascontiguousarray(rows)
    else:
        scenes = [scene(row) for row in rows]
        labels = scenes[0].contact_labels() if scenes else []
        for one in scenes:
            if len(one.contacts) != len(labels):
                raise InputError(
                    f"model: expected {len(labels)} contacts in every scene, got {len(one.contacts)}"
                )
        samples = [one.core for one in scenes]
    found = _core.verdicts(samples, len(labels), combination)
    if isinstance(found, tuple):
        sample, reason = found
        try:
            # Made here, a chain tells which of its arguments is wrong.
            scene(rows[sample])
        except InputError as error:
            reason = str(error)
        raise InputError(f"sample {sample}: {reason}")
    return found, labels
