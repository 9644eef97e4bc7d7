"""Complex frequencies of steady sliding against those that CalculiX 2.20 prints for the same mesh."""

from pathlib import Path

import numpy as np

import stickslip as ss
from meshed import plate

CALCULIX = Path(__file__).parent / "calculix"


def blocks(path):
    """Return the lines of data behind every keyword of a deck, with the line of the keyword."""
    found = []
    for line in path.read_text().splitlines():
        if line.startswith("*") and not line.startswith("**"):
            found.append((line, []))
        elif not line.startswith("**"):
            found[-1][1].append(line.split(","))
    return found


def test_squeal_of_a_rubbed_pad():
    """18 contacts, three flutter pairs among the first twelve modes.

    CalculiX lets contacts give a little (penalty 1e18 Pa/m) and prints seven digits; with a penalty a tenth
    as stiff its distance from rigid contacts is ten times as large, 4.5e-6.
    """
    deck = blocks(CALCULIX / "rub.inp")
    body = plate((8, 1, 4), (0.04, 0.004, 0.02), (0.0, 0.0, 0.0), young=10e9, density=2500.0)
    nodes = np.array(deck[0][1], dtype=float)
    np.testing.assert_array_equal(nodes[:, 0], body.nodes)
    np.testing.assert_allclose(nodes[:, 1:], body.points, rtol=0, atol=1e-12)
    # Friction is lowered by 2 % for the modes, so that all contacts slide.
    friction = [float(rows[0][0]) for keyword, rows in deck if keyword == "*FRICTION"][-1]
    body = body.held(body.surface("top"))
    plane = body.held([dof for dof in body.dofs if dof.endswith(".2")])
    pairs = ss.fe.contact_pairs(
        plane.surface("bottom"), None, velocity=(1.0, 0.0, 0.0), friction=friction, gap=-1e-11
    )
    scene = ss.fe.assemble(plane, pairs)
    assert len(pairs) == 18
    table = [line.split() for line in (CALCULIX / "rub.dat").read_text().splitlines()]
    # Mode, angular frequency w and imaginary part g: lambda = j w - g.
    printed = np.array(
        [1j * complex(float(row[1]), float(row[3])) for row in table if row and row[0].isdecimal()]
    )
    assert printed.size == 12
    assert np.count_nonzero(printed.real > 1e3) == 3
    modes = ss.complex_modes(scene, "+" * 18, band=(0.0, 90e3))
    found = modes.eigenvalues
    assert found.size == 12
    error = [np.abs(found - value).min() / abs(value) for value in printed]
    assert max(error) < 1e-6
    assert sorted(np.abs(found[:, None] - printed).argmin(axis=0)) == list(range(12))
