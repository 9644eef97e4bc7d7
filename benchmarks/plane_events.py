"""What an event of friction in a plane costs beside one of friction along a line.

A row of pads on springs is pulled along by a slider until it slips, and sticks again. Its slip stays on a
line, where a scene of friction along this line has the same motion, or it turns.
"""

from __future__ import annotations

import sys
import time

import numpy as np

import stickslip as ss
from report import Report, arguments

PADS = (1, 2, 4, 8)
#: s of motion, and rounds of which the least time counts.
MOTION, ROUNDS = 50.0, 5
#: Friction and static friction, and the speeds of the slider, m/s.
FRICTION, STATIC, ALONG, ACROSS = 0.4, 0.6, 0.1, 0.03


def row_of_pads(pads: int, plane: bool, turns: bool) -> tuple[ss.Scene, ss.State]:
    """Return pads with three dofs each, coupled in a row, and their start: all stick."""
    own = np.array([[100.0, 0.0, 10.0], [0.0, 100.0, 0.0], [10.0, 0.0, 400.0]])
    if turns:
        own += [[0.0, 5.0, 0.0], [5.0, 0.0, 7.0], [0.0, 7.0, 0.0]]
    stiffness = np.kron(np.eye(pads), own)
    for i in range(pads - 1):
        coupling = (20.0 + 7.0 * i) * np.kron([[1.0, -1.0], [-1.0, 1.0]], np.eye(3))
        stiffness[3 * i : 3 * i + 6, 3 * i : 3 * i + 6] += coupling
    speeds = np.array([ALONG, ACROSS if turns else 0.0])
    contacts = [
        ss.Contact(
            tangential=(f"x{i}", f"y{i}") if plane else f"x{i}",
            normal=f"z{i}",
            friction=FRICTION,
            static_friction=STATIC,
            slider_speed=speeds if plane else ALONG,
        )
        for i in range(pads)
    ]
    scene = ss.Scene(
        mass=np.ones(3 * pads),
        stiffness=stiffness,
        damping=0.01 * np.eye(3 * pads),
        force=np.tile([0.0, 0.0, -50.0], pads),
        dofs=[f"{axis}{i}" for i in range(pads) for axis in "xyz"],
        contacts=contacts,
    )
    position, velocity = np.zeros((pads, 3)), np.zeros((pads, 3))
    position[:, 0] = np.linspace(0.0, 0.05, pads)
    velocity[:, :2] = speeds
    return scene, ss.State(position.ravel(), velocity.ravel(), "s" * len(scene.contacts))


def main() -> None:
    """Print the table."""
    parser = arguments(__doc__)
    parser.add_argument("--pads", nargs="+", type=int, default=PADS)
    chosen = parser.parse_args()
    rows = []
    for pads in chosen.pads:
        kinds = {"line": (False, False), "plane, straight": (True, False), "plane, turning": (True, True)}
        cases = {name: row_of_pads(pads, *kind) for name, kind in kinds.items()}
        spent, runs = dict.fromkeys(cases, np.inf), {}
        for _ in range(ROUNDS):
            for name, (scene, start) in cases.items():
                begin = time.process_time()
                runs[name] = ss.simulate(scene, MOTION, start)
                spent[name] = min(spent[name], time.process_time() - begin)
        line = runs["line"]
        for name, run in runs.items():
            events, panels = len(run.events), run.counters["panels"]
            per_event = 1e6 * spent[name] / events
            times = f"{per_event / (1e6 * spent['line'] / len(line.events)):.0f}"
            off = ""
            if name == "plane, straight":
                assert events == len(line.events)
                off = f"{np.abs(run.events.time - line.events.time).max():.0e}"
            cells = [str(pads), name, str(events), f"{panels / events:.1f}", f"{per_event:.1f}"]
            rows.append([*cells, "" if name == "line" else times, off])
            print(*rows[-1], file=sys.stderr)
    report = Report("plane-events")
    headings = ["pads", "friction", "events", "panels per event", "us per event", "times a line's"]
    report.table([*headings, "times of events apart, s"], rows)
    report.finish(chosen.into, "stickslip", "numpy")


if __name__ == "__main__":
    main()
