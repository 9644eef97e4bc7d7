"""The side of pyHarm: the forced response at one frequency, by harmonic balance with continuation.

Run by an interpreter that imports pyHarm; reads a question and prints the answer, both as JSON, the answer as
the last line. The branch begins where no spring acts and ends beyond the frequency of the question; from its
point next to the one nearby the orbit there is solved for, and from that one the orbit asked for.
"""

import importlib.metadata
import json
import logging
import sys
import time
import warnings

import numpy as np
from pyHarm.Maestro import Maestro

#: What the branch may take; pyHarm goes on for ever where its steps do not converge.
TIMEOUT = {"status": True, "timeout": "00:00:00:20"}
#: Residual up to which an orbit counts as found.
SOLVED = 1e-9


def problem(asked, harmonics, begin, end):
    """Return the description of a system and its analysis between two frequencies, rad/s."""
    kind, numbers = asked["spring"]
    connectors = {
        "spring": {"type": kind, "connect": {"body": [0]}, "dirs": [0], **numbers},
        "load": {
            "type": "CosinusForcing",
            "connect": {"body": [asked["loaded"]]},
            "dirs": [0],
            "amp": asked["amplitude"],
        },
    }
    matrices = {name: np.array(entries) for name, entries in asked["matrices"].items()}
    analysis = {
        "study": "frf",
        "ds0": 0.02,
        "ds_max": 0.05,
        "ds_min": 1e-7,
        "puls_inf": begin,
        "puls_sup": end,
        "verbose": False,
        "stopper_options": {"timeout": TIMEOUT},
        "solver_options": {"root": {"method": "hybr", "options": {"xtol": 1e-13}}},
    }
    return Maestro(
        {
            "system": {"type": "Base", "nh": harmonics, "nti": asked["samples"]},
            "substructures": {"body": {"matrix": matrices, "ndofs": 1}},
            "connectors": connectors,
            "analysis": {"response": analysis},
        }
    )


def solved(asked, harmonics, rate, near):
    """Return processor time, solution at a frequency from one near it, norm of its residual, and dofs."""
    whole = problem(asked, harmonics, rate, rate + 1.0)
    response = whole.nls["response"]
    begin = time.process_time()
    response.initialise(near)
    taken = time.process_time() - begin
    found = response.SolList[0]
    return taken, found.x[:-1], float(np.linalg.norm(found.R_solver)), whole.system.expl_dofs


def answer(asked, harmonics):
    """Return the orbit of a number of harmonics, or why there is none."""
    begin, nearby, rate = asked["rates"]
    branches = []
    for _ in range(2):
        # The first round compiles.
        whole = problem(asked, harmonics, begin, rate)
        started = time.process_time()
        whole.operate()
        branches.append(time.process_time() - started)
    points = [point for point in whole.nls["response"].SolList if point.flag_accepted]
    if points[-1].x[-1] < rate:
        return {"harmonics": harmonics, "failure": "branch ends before"}
    close = min(points, key=lambda point: abs(point.x[-1] - nearby)).x[:-1]
    _, close, missed, _ = solved(asked, harmonics, nearby, close)
    found = [solved(asked, harmonics, rate, close) for _ in range(asked["rounds"])]
    missed = max(missed, found[0][2])
    if missed > SOLVED:
        return {"harmonics": harmonics, "failure": f"residual {missed:.0e}"}
    dofs, values = found[0][3], found[0][1]
    first = (dofs.node_num == 0).to_numpy()
    rows = {}
    for harmonic, part, value in zip(dofs.harm[first], dofs.cs[first], values[first], strict=True):
        rows.setdefault(int(harmonic), [int(harmonic), 0.0, 0.0])["cs".index(part) + 1] = value
    return {
        "harmonics": harmonics,
        "failure": "",
        "points": len(whole.nls["response"].SolList),
        "branch": branches[1],
        "time": min(one[0] for one in found),
        "coefficients": list(rows.values()),
    }


def main():
    """Answer the question."""
    warnings.simplefilter("ignore")
    logging.disable(logging.CRITICAL)
    asked = json.load(sys.stdin)
    print(json.dumps({"runs": [answer(asked, count) for count in asked["harmonics"]]}))


if __name__ == "__main__":
    if sys.argv[1:] == ["--version"]:
        version = importlib.metadata.version("pyharm-os")
        print(f"pyHarm {version}, Python {sys.version.split()[0]}, numpy {np.__version__}")
    else:
        main()
