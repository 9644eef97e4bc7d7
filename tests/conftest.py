"""Profiles of the property tests, and the reference solutions.

The fast profile draws the same examples every time; the slow one, `make test-slow`, draws many new ones.
"""

import json
import signal
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import HealthCheck, settings

import stickslip as ss

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

REFERENCE = Path(__file__).parent / "reference"


def reference_solution(name):
    """A 220-bit reference solution with its scene; numbers rounded once to double."""
    record = json.loads((REFERENCE / f"{name}.json").read_text())
    case = record["case"]
    scene = ss.Scene(
        case["mass"],
        case["stiffness"],
        damping=ss.Proportional(mass=case["alpha"], stiffness=case["beta"]),
        force=case["force"],
        contacts=[ss.Contact(**contact) for contact in case["contacts"]],
        impact_friction=case["impact_friction"],
    )
    events = record["events"]
    return SimpleNamespace(
        scene=scene,
        start=ss.State(
            [float(x) for x in record["x0"]], [float(v) for v in record["v0"]], "".join(case["status0"])
        ),
        perturbation=np.array(case["v0"]),
        duration=case["duration"],
        time=np.array([float(event[0]) for event in events]),
        contact=np.array([event[1] for event in events]),
        kind=np.array([event[2] for event in events]),
        combination=np.array([event[3] for event in events]),
        last_event_state=np.array([float(x) for x in record["last_event_state"]]),
        end_state=np.array([float(x) for x in record["y_end"]]),
        grazing=record["grazing"],
    )


@pytest.fixture(scope="session")
def standard():
    """Friction 1.5, slider speed 0.025 m/s, 0.6 s: 312 events."""
    return reference_solution("paper-mu1.5-v0.025")


@pytest.fixture(scope="session")
def lifting():
    """Friction 2.2, slider speed 0.05 m/s, 0.3 s: 147 events with release and impact."""
    return reference_solution("paper-mu2.2-v0.05")
