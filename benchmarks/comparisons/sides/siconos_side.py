"""The side of Siconos: a mass on a belt under a given normal force, by its time stepping of Moreau and Jean.

Run by an interpreter that imports siconos; reads a question and prints the answer, both as
JSON, the answer as the last line. The belt is a
second body, so heavy that friction does not slow it. The run is one call, so that no loop in Python is timed.
"""

import importlib.metadata
import json
import sys
import time

import numpy as np
import siconos.kernel as kernel

#: kg
BELT_MASS = 1e15


def simulation(asked, step, theta):
    """Return the simulation and the system of one run."""
    system = kernel.LagrangianLinearTIDS(
        np.array([0.0, 0.0]),
        np.array([asked["belt"], asked["belt"]]),
        np.diag([asked["mass"], BELT_MASS]),
        np.diag([asked["stiffness"], 0.0]),
        np.diag([asked["damping"], 0.0]),
    )
    # Bounds are those of the impulse over a step.
    limit = step * asked["friction"] * asked["normal"]
    law, relation = kernel.RelayNSL(1, -limit, limit), kernel.LagrangianLinearTIR(np.array([[1.0, -1.0]]))
    model = kernel.NonSmoothDynamicalSystem(0.0, asked["duration"])
    model.insertDynamicalSystem(system)
    contact = kernel.Interaction(law, relation)
    model.link(contact, system)
    scheme, times, solver = kernel.MoreauJeanOSI(theta), kernel.TimeDiscretisation(0.0, step), kernel.Relay()
    stepping = kernel.TimeStepping(model, times, scheme, solver)
    return stepping, system, (model, contact, law, relation, scheme, times, solver)


def run(asked, step, theta):
    """Return processor time, s, position and velocity at the end of one run."""
    stepping, system, _kept = simulation(asked, step, theta)
    begin = time.process_time()
    stepping.run()
    return time.process_time() - begin, system.q()[0], system.velocity()[0]


def main():
    """Answer the question."""
    asked = json.load(sys.stdin)
    runs = []
    for theta in asked["thetas"]:
        for step in asked["steps"]:
            found = [run(asked, step, theta) for _ in range(asked["rounds"] if step > 1e-3 else 2)]
            _, position, velocity = found[0]
            runs.append(
                {
                    "theta": theta,
                    "step": step,
                    "time": min(one[0] for one in found),
                    "position": position,
                    "velocity": velocity,
                }
            )
    print(json.dumps({"runs": runs}))


if __name__ == "__main__":
    if sys.argv[1:] == ["--version"]:
        version = importlib.metadata.version("siconos")
        print(f"Siconos {version}, Python {sys.version.split()[0]}, numpy {np.__version__}")
    else:
        main()
