"""Every number in a labelled array says its unit."""

from functools import partial

import numpy as np
import pytest
import xarray as xr

import stickslip as ss
from stickslip.locus.units import parameter_units

TIMES = np.linspace(0.0, 0.2, 5)


@pytest.fixture(scope="module")
def datasets():
    """Every labelled array that the package returns, by the call it comes from."""
    scene = ss.models.two_subsystems()
    model = ss.models.two_subsystems
    run = ss.simulate(scene, ss.sliding_equilibrium(scene).perturbed(velocity={"x1": 1e-3}), 0.3)
    cycle = run.limit_cycle()
    modes = ss.complex_modes(scene)
    selection = ss.mode_selection(scene, np.linspace(1e-5, 1e-4, 3), phases=4)
    balance = run.balance()
    return {
        "sample": run.sample(TIMES),
        "modal_coordinates": run.modal_coordinates(TIMES),
        "energy": run.energy(TIMES),
        "run.dataset": run.dataset(5),
        "spectrum": run.spectrum("x2"),
        "sampled spectrum": run.spectrum(end=0.1),
        "cycle.table": cycle.table(),
        "harmonics": cycle.harmonics(4),
        "harmonic_energy": cycle.harmonic_energy(4),
        "cycle.dataset": cycle.dataset(5),
        "amplitude": cycle.amplitude,
        "minimum": cycle.minimum,
        "maximum": cycle.maximum,
        "balance.contacts": balance.contacts,
        "balance.combinations": balance.combinations,
        "modal_energy": ss.modal_energy(run, TIMES),
        "selection.modes": selection.modes,
        "selection.gains": selection.gains,
        "modes.dataset": modes.dataset(),
        "orbit": ss.orbit(modes, 0),
        "mode_power": ss.mode_power(scene),
        "status_table": ss.status_table(scene, ["++", "ss"]).data,
        "sweep": ss.sweep(scene, friction=[0.5, 1.5], slider_speed_1=[0.01, 0.02], vectors=True),
        "sweep of a model": ss.sweep(model, wall_stiffness=[1.8e6, 1.9e6]),
        "sensitivity": ss.sensitivity(scene, parameters=("friction",)),
        "entry_sensitivity": ss.entry_sensitivity(scene, "stiffness"),
        "stability": ss.stability(model, friction=[0.5, 1.5]),
        "bifurcation": ss.bifurcation(scene, friction=[1.5, 1.6]),
        "follow_branch": ss.follow_branch(cycle, friction=[1.5, 1.51]),
        "trace_branch": ss.trace_branch(cycle, friction=(1.5, 1.51), points=3),
        "basins": ss.basins(scene, run.start, position={"x1": [0.0]}, velocity={"x2": [0.0, 1e-4]}),
    }


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

    assert parameter_units(model, "damping") == {}
    assert parameter_units(model, "friction") == {"units": "1"}
    assert parameter_units(partial(ss.models.two_subsystems, friction=1.0), "damping") == {"units": "s"}
    scene = ss.Scene(
        [1.0, 1.0],
        np.eye(2),
        contacts=[ss.Contact(tangential=0, normal=1, friction=0.1, name="pad")],
    )
    assert parameter_units(scene, "gap_pad") == {"units": "m"}
