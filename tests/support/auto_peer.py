"""Hopf curves of a smooth scene by AUTO-07p, a program for continuation (Doedel and Oldeman).

    python tests/support/auto_peer.py > tests/reference/auto/hopf_curves.txt

compiles `tests/reference/auto/hopf.f90` with the objects of AUTO and follows the equilibrium, then the curve
of every Hopf point on it, in both directions. AUTO_DIR says where AUTO is, FC what compiles and links, with
OpenMP.
"""

import os
import shlex
import shutil
import subprocess
import tempfile
from pathlib import Path

import stickslip as ss

REFERENCE = Path(__file__).parents[1] / "reference" / "auto"
CURVES = REFERENCE / "hopf_curves.txt"
#: What `hopf.f90` is written for, and where it looks.
RANGES = {"slider_speed": (0.05, 3.0), "friction_kinetic": (0.02, 0.58)}


def belt():
    """Return the scene of `hopf.f90`: two masses, a cubic spring, Stribeck friction on the first."""
    return ss.Scene(
        [1.0, 0.7],
        [[1.0, 0.0], [0.0, 1.5]],
        damping=[[0.06, 0.0], [0.0, 0.1]],
        dofs=["x", "y"],
        elements=[ss.Spring({"x": 1.0, "y": -1.0}, ss.spring.Polynomial(0.5, 0.0, 0.8))],
        contacts=[
            ss.Contact(
                tangential="x",
                normal_force=2.0,
                friction=ss.friction.Stribeck(static=0.6, kinetic=0.2, speed=0.5),
                slider_speed=1.0,
            )
        ],
    )


def run(program, constants, folder):
    """Run the program of AUTO with constants; return the rows of its points."""
    (folder / "fort.2").write_text(constants)
    subprocess.run([program], cwd=folder, input=constants, text=True, check=True, capture_output=True)
    rows = [line.split() for line in (folder / "fort.7").read_text().splitlines()]
    return [row for row in rows if row[0] != "0"]


def compiled(folder):
    """Return the program of AUTO for the scene, compiled into a folder."""
    home = Path(os.environ.get("AUTO_DIR", "/usr/lib/auto-07p"))
    compiler = shlex.split(os.environ.get("FC", "gfortran -fopenmp"))
    program = folder / "hopf"
    objects = sorted(map(str, (home / "lib").glob("*.o")))
    subprocess.run(
        [*compiler, "-O", str(REFERENCE / "hopf.f90"), *objects, "-o", str(program)], cwd=folder, check=True
    )
    return program


def curves(program, folder):
    """Return rows of text: number of the Hopf point, slider speed, kinetic friction."""
    first = run(program, (REFERENCE / "c.equilibrium").read_text(), folder)
    shutil.copy(folder / "fort.8", folder / "equilibrium")
    # Type 3 is a Hopf point; labels count what is stored.
    labels = [int(row[3]) for row in first if row[2] == "3"]
    constants = (REFERENCE / "c.hopf").read_text()
    lines = []
    for label in labels:
        for step in ("DS = 0.01,", "DS = -0.01,"):
            shutil.copy(folder / "equilibrium", folder / "fort.3")
            chosen = constants.replace("IRS = 2", f"IRS = {label}").replace("DS = 0.01,", step)
            lines += [f"{label} {row[4]} {row[10]}" for row in run(program, chosen, folder)]
    return lines


def main():
    """Print the curves."""
    with tempfile.TemporaryDirectory() as folder:
        print("\n".join(curves(compiled(Path(folder)), Path(folder))))


if __name__ == "__main__":
    main()
