"""A brake pad on a rotating disc, from mesh to squeal: steady sliding, modes, lock-in, transient, energy.

Run it: ``python examples/squealing_disc.py --output squeal``. It needs ``pip install 'stickslip[fe]'``. Disc
and pad are meshed and assembled by scikit-fem; the nodes of the pad meet faces of the disc.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib

matplotlib.use("agg")
import matplotlib.pyplot as plt
import numpy as np
import skfem
from skfem.helpers import dot
from skfem.models.elasticity import lame_parameters, linear_elasticity

import stickslip as ss

#: Cells of the disc and of the pad along radius, angle and thickness; 28 nodes of the pad are in contact.
DISC, PAD = (6, 36, 1), (3, 6, 2)
#: Hz
BAND = (500.0, 12e3)


def ring(counts, radii, angles, heights):
    """Return hexahedra of a part of a ring; after a full turn it closes."""
    axes = [np.linspace(*ends, n + 1) for ends, n in zip((radii, angles, heights), counts, strict=True)]
    mesh = skfem.MeshHex.init_tensor(*axes)
    r, angle, z = mesh.p
    points = np.stack([r * np.cos(angle), r * np.sin(angle), z])
    _, first, place = np.unique(np.round(points, 9), axis=1, return_index=True, return_inverse=True)
    return skfem.MeshHex(points[:, first], place.ravel()[mesh.t])


def elastic(mesh, young, poisson, density, name):
    """Return the body of a mesh of one elastic material, with damping C = 2e-8 s K."""
    basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementHex1()), intorder=2)
    stiffness = linear_elasticity(*lame_parameters(young, poisson)).assemble(basis)
    mass = density * skfem.BilinearForm(lambda u, v, w: dot(u, v)).assemble(basis)
    damping = ss.Proportional(stiffness=2e-8)
    return ss.fe.Body.from_skfem(basis, mass, stiffness, damping=damping, name=name)


def brake(friction=0.5, disc_cells=DISC, pad_cells=PAD):
    """Return the scene: a disc of cast iron held at its hub, a pad of 60 degrees pressed on it by 1 MPa."""
    disc = elastic(
        ring(disc_cells, (0.06, 0.16), (0.0, 2 * np.pi), (0.0, 0.012)).with_boundaries(
            {"hub": lambda x: np.hypot(x[0], x[1]) < 0.0601, "top": lambda x: x[2] > 0.0119}
        ),
        120e9, 0.25, 7200.0, "disc",
    )  # fmt: skip
    pad = elastic(
        ring(pad_cells, (0.10, 0.15), (-np.pi / 6, np.pi / 6), (0.012, 0.020)).with_boundaries(
            {"face": lambda x: x[2] < 0.0121, "back": lambda x: x[2] > 0.0199}
        ),
        1e9, 0.3, 2500.0, "pad",
    )  # fmt: skip
    disc = disc.held(disc.surface("hub"))
    # Guided at its back: it moves only along the axis of the disc there.
    pad = pad.held(pad.surface("back"), directions=(1, 2))
    pairs = ss.fe.contact_pairs(
        pad.surface("face"), disc.surface("top"), velocity=ss.fe.Rotation(5.0), friction=friction
    )
    return ss.fe.assemble([pad, disc], pairs, force=pad.surface("back").pressure(1e6))


def lock_in(scene, frictions):
    """Return frequencies and growth rates of the modes in the band, each at its own steady sliding."""
    rows = []
    for friction in frictions:
        slipping = scene.replace(friction=friction)
        combination = ss.sliding_equilibrium(slipping).combination
        for mode in ss.complex_modes(slipping, combination).select(BAND):
            rows.append((friction, mode.frequency, mode.eigenvalue.real))
    return np.array(rows)


def drawn(scene, reduced, modes, worst, loci, run, power):
    """Return the figure: modes over friction, the mode that grows most, the motion, and who feeds it."""
    figure = plt.figure(figsize=(11.0, 8.0), layout="constrained")
    axes = figure.add_subplot(2, 2, 1)
    grows = loci[:, 2] > 0.0
    axes.plot(*loci[~grows, :2].T, ".", color="#4477aa", markersize=3, label="decays")
    axes.plot(*loci[grows, :2].T, "^", color="#cc3311", markersize=4, label="grows")
    axes.set(xlabel="friction", ylabel="frequency, Hz", title="Modes of steady sliding")
    axes.legend(frameon=False)
    shape = reduced.expand(modes)["shape"].isel(mode=worst.number).to_numpy()
    title = f"{worst.frequency:.0f} Hz, grows at {worst.eigenvalue.real:.0f} 1/s"
    ss.fe.draw(scene, shape, figure.add_subplot(2, 2, 2, projection="3d"), title=title)
    axes = figure.add_subplot(2, 2, 3)
    times = np.linspace(0.0, run.duration, 4001)
    force = run.sample(times).normal_force.to_numpy()
    axes.plot(1e3 * times, force.sum(axis=1), color="#4477aa", linewidth=0.7)
    axes.set(xlabel="time, ms", ylabel="sum of normal forces, N", title="From steady sliding to squeal")
    axes = figure.add_subplot(2, 2, 4)
    axes.bar(np.arange(power.size), power, color=np.where(power > 0.0, "#cc3311", "#4477aa"))
    axes.set(xlabel="contact", ylabel="mean power into the structure, W", title="Who feeds the squeal")
    return figure


def main(output, disc_cells=DISC, pad_cells=PAD, duration=4e-3):
    """Compute, draw and write everything into a folder; return what it says."""
    scene = brake(disc_cells=disc_cells, pad_cells=pad_cells)
    steady = ss.sliding_equilibrium(scene)
    reduced = ss.fe.reduce(scene, BAND, combination=steady.combination, tolerance=1e-2)
    modes = ss.complex_modes(reduced.scene, steady.combination)
    worst = max(modes.select(BAND), key=lambda mode: mode.eigenvalue.real)
    loci = lock_in(reduced.scene, np.linspace(0.0, 0.6, 25))
    start = ss.sliding_equilibrium(reduced.scene).perturbed(velocity={"q0": 1e-3})
    run = ss.simulate(reduced.scene, start, duration=duration)
    begin = 0.75 * duration
    power = run.balance(begin, duration).contacts.work.sum("status").to_numpy() / (duration - begin)
    late = run.sample(np.linspace(begin, min(duration, begin + 5.0 / worst.frequency), 120))
    ss.fe.write_vtu(output / "squeal.pvd", scene, reduced.expand(late))
    ss.fe.write_vtu(output / "mode.pvd", scene, reduced.expand(modes), mode=worst.number)
    drawn(scene, reduced, modes, worst, loci, run, power).savefig(output / "squealing-disc.png", dpi=110)
    return [
        f"{scene.size} dofs, {len(scene.contacts)} contacts, {steady.combination.count('d')} of them open",
        f"reduced to {reduced.scene.size} dofs, eigenvalues right to {reduced.errors.error.max():.1g}",
        f"the mode at {worst.frequency:.0f} Hz grows at {worst.eigenvalue.real:.1f} 1/s",
        f"{len(run.events)} events in {1e3 * duration:g} ms, energy to {run.balance().residual:.0e} J",
        f"{(power > 0).sum()} contacts feed {power[power > 0].sum():.3g} W, "
        f"the others take {-power[power < 0].sum():.3g} W",
    ]


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--output", type=Path, default=Path("squeal"), help="folder")
    folder = parser.parse_args().output
    folder.mkdir(parents=True, exist_ok=True)
    print("\n".join(main(folder)))
