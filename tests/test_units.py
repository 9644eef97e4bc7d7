"""Every number in a labelled array says its unit."""

from functools import partial

import numpy as np
import xarray as xr

import stickslip as ss
from stickslip.scene.parameters.family import Family
from stickslip.show.units import TIMES, measured


def missing(array):
    if isinstance(array, xr.DataArray):
        dataset = array.to_dataset(name=str(array.name))
    else:
        dataset = array if isinstance(array, xr.Dataset) else array.to_dataset()
    # Whole numbers count or point at something, texts and flags name it.
    return [
        str(name)
        for name, variable in dataset.variables.items()
        if variable.dtype.kind in "fc" and not variable.attrs.get("units")
    ]


def test_every_number_has_a_unit(datasets):
    assert {call: missing(array) for call, array in datasets.items() if missing(array)} == {}


def test_a_missing_unit_would_be_seen(datasets):
    bare = datasets["sample"].copy()
    bare["position"].attrs = {}
    assert missing(bare) == ["position"]


def test_some_units_by_value(datasets):
    sweep = datasets["sweep"]
    assert sweep.slider_speed_1.units == "m/s"
    assert sweep.derivative.units == "1/s/(m/s)"
    assert datasets["sweep of a model"].wall_stiffness.units == "N/m"
    assert datasets["basins"].map.velocity_x2.units == "m/s"
    assert datasets["energy"].contact_power.units == "W"
    assert datasets["sensitivity"].unit.values.tolist() == ["1"]


def test_units_of_parameters_of_your_own_are_not_guessed():
    def model(damping, friction):
        return ss.models.two_subsystems(friction=friction, damping=damping)

    assert Family(model).units("damping") == {}
    assert Family(model).units("friction") == {"units": "1"}
    assert Family(partial(ss.models.two_subsystems, friction=1.0)).units("damping") == {"units": "s"}
    scene = ss.Scene(
        [1.0, 1.0],
        np.eye(2),
        contacts=[ss.Contact(tangential=0, normal=1, friction=0.1, name="pad")],
    )
    assert Family(scene).units("gap_pad") == {"units": "m"}


def test_what_is_one_unit_but_for_rounding_has_that_unit():
    shown = [measured(value, TIMES) for value in (np.nextafter(1.0, 0.0), 1.0 - 1e-12, 0.999, 0.0)]
    assert shown == ["1 s", "1 s", "999 ms", "0 s"]
