"""The reference solutions: runs computed with 220 bits, and their scenes."""

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np

import stickslip as ss

REFERENCE = Path(__file__).parents[1] / "reference"


def reference_solution(name):
    """A 220-bit reference solution with its scene; numbers rounded once to double."""
    record = json.loads((REFERENCE / f"{name}.json").read_text())
    case = record["case"]
    scene = ss.Scene(
        case["mass"],
        case["stiffness"],
        damping=ss.Rayleigh(mass=case["alpha"], stiffness=case["beta"]),
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
