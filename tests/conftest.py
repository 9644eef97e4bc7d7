"""Profiles of the property tests, and the reference solutions.

The fast profile draws the same examples every time; the slow one, `make test-slow`, draws many new ones.
"""

import signal
import sys

import numpy as np
import pytest
from hypothesis import HealthCheck, settings

import stickslip as ss
from reference_runs import reference_solution

settings.register_profile("fast", max_examples=20, deadline=None, derandomize=True)

# A shell that starts this in the background has Ctrl-C ignored; tests send it to themselves.
signal.signal(signal.SIGINT, signal.default_int_handler)

settings.register_profile(
    "slow",
    max_examples=500,
    deadline=None,
    print_blob=True,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("fast")


@pytest.fixture(autouse=True)
def _no_figure_stays_open():
    """Close what a test has drawn: with many open figures pyplot warns, and later tests would fail."""
    yield
    if pyplot := sys.modules.get("matplotlib.pyplot"):
        pyplot.close("all")


@pytest.fixture(scope="session")
def standard():
    """Friction 1.5, slider speed 0.025 m/s, 0.6 s: 312 events."""
    return reference_solution("paper-mu1.5-v0.025")


@pytest.fixture(scope="session")
def lifting():
    """Friction 2.2, slider speed 0.05 m/s, 0.3 s: 147 events with release and impact."""
    return reference_solution("paper-mu2.2-v0.05")


@pytest.fixture(scope="module")
def datasets():
    """Every labelled array that the package returns, by the call it comes from."""
    times = np.linspace(0.0, 0.2, 5)
    scene = ss.models.two_subsystems()
    model = ss.models.two_subsystems
    run = ss.simulate(scene, 0.3, ss.steady_sliding(scene).perturbed(velocity={"x1": 1e-3}))
    cycle = run.limit_cycle()
    modes = ss.complex_modes(scene)
    selection = ss.mode_selection(scene, np.linspace(1e-5, 1e-4, 3), phases=4)
    balance = run.balance()
    return {
        "sample": run.sample(times),
        "modal_coordinates": run.modal_coordinates(times),
        "energy": run.energy(times),
        "run.to_dataset": run.to_dataset(5),
        "sample of all phases": run.sample(),
        "events": run.events.to_dataset(),
        "spectrum": run.spectrum("x2"),
        "sampled spectrum": run.spectrum(end=0.1),
        "cycle.table": cycle.table(),
        "harmonics": cycle.harmonics(4),
        "harmonic_energy": cycle.harmonic_energy(4),
        "cycle.to_dataset": cycle.to_dataset(5),
        "amplitude": cycle.amplitude,
        "minimum": cycle.minimum,
        "maximum": cycle.maximum,
        "balance.contacts": balance.contacts,
        "balance.combinations": balance.combinations,
        "modal_energy": ss.modal_energy(run, times),
        "selection.modes": selection.modes,
        "selection.gains": selection.gains,
        "modes.to_dataset": modes.to_dataset(),
        "orbit": modes.orbit(0),
        "mode_power": ss.complex_modes(scene).power(),
        "mac": modes.mac(modes),
        "pairing": modes.pairing(modes),
        "contact_forces": run.start.contact_forces(scene),
        "status_table": ss.status_table(scene, ["++", "ss"]).data,
        "sweep": ss.sweep(scene, {"friction": [0.5, 1.5], "slider_speed_1": [0.01, 0.02]}, vectors=True),
        "sweep of a model": ss.sweep(model, {"wall_stiffness": [1.8e6, 1.9e6]}),
        "sweep of some modes": ss.sweep(scene, {"friction": [0.5, 1.5]}, modes=2),
        "sensitivity": ss.sensitivity(scene, ("friction",)),
        "entry_sensitivity": ss.sensitivity(scene, entries="stiffness"),
        "stability": ss.stability(model, {"friction": [0.5, 1.5]}),
        "bifurcation": ss.bifurcation(scene, {"friction": [1.5, 1.6]}),
        "continuation": ss.continuation(cycle, {"friction": (1.5, 1.51)}, points=3),
        "basins": ss.basins(scene, start=run.start, position={"x1": [0.0]}, velocity={"x2": [0.0, 1e-4]}),
    }
