"""Squeal of a block on a belt: a separation pulse, with mass at its contacts or without."""

import numpy as np

import stickslip as ss
from meshed import block
from stickslip.fe.reduced.contact_coordinates import contact_directions


def on_belt(columns, rows, every=1, friction=0.3, **changes):
    """Return the scene of a block on a belt with one in `every` lower node in contact."""
    body = block(columns, rows)
    low = body.surface("low")
    chosen = low.numbers[np.argsort(low.points[:, 0])][::every]
    pairs = ss.fe.contact_pairs(low, None, velocity=(1.0, 0.0), friction=friction, gap=-1e-6)
    kept = [c for c, node in zip(pairs.contacts, pairs.nodes, strict=True) if node in set(chosen)]
    return ss.fe.assemble(body, kept).replace(**changes)


def lumped_block(columns, rows, every, boundary="lumped"):
    """Return the block at friction 0.2 with lumped mass, of which a massless boundary has none at contacts.

    That of a contact goes to the lower nodes beside it, half to each, and at an end of the face to the next
    two by ``x_0 = 2 x_1 - x_2``: the whole mass and its centre stay where they are.
    """
    scene = on_belt(columns, rows, every, friction=0.2)
    mass = np.asarray(scene.mass.sum(axis=1)).ravel()
    if boundary == "massless":
        points = scene.mesh.points
        low = np.flatnonzero(points[:, 1] < 1e-9)
        low = scene.mesh.dofs[low[np.argsort(points[low, 0])]]
        touching = set(contact_directions(scene)[1].nonzero()[0])
        moved = mass.copy()
        for k, dofs in enumerate(low):
            for direction, dof in enumerate(dofs):
                if dof not in touching:
                    continue
                inner = np.sign(len(low) // 2 - k) or 1
                shares = {-1: 0.5, 1: 0.5} if 0 < k < len(low) - 1 else {inner: 2.0, 2 * inner: -1.0}
                for step, share in shares.items():
                    moved[low[k + step, direction]] += share * mass[dof]
                moved[dof] -= mass[dof]
        mass = moved
    return scene.replace(mass=mass)


def reduced_block(scene, boundary, modes):
    """Return its reduction."""
    return ss.fe.reduce(scene, (1e3, 60e3), boundary, combination="++++++", modes=modes)


def pulse(scene, reduced, full=False, duration=1e-2):
    """Return mean period, s, and mean share of time detached once the motion has settled, and the run."""
    model, kick = reduced.scene, {"q0": 5e-3}
    if full:
        model, kick = scene, 5e-3 * reduced.basis[:, model.dofs.index("q0")]
    start = ss.steady_sliding(model).perturbed(velocity=kick)
    run = ss.simulate(model, duration, start, method="taylor")
    times, statuses = np.array(run.events.time), list(run.events.combination)
    late = times > 0.5 * run.duration
    leaves = [
        time
        for time, before, after in zip(times[1:], statuses[:-1], statuses[1:], strict=True)
        if before == "++++++" != after and time > 0.5 * run.duration
    ]
    apart = np.array([status.count("d") for status in statuses])[late][:-1] @ np.diff(times[late])
    share = apart / (len(scene.contacts) * (times[late][-1] - times[late][0]))
    return np.mean(np.diff(leaves)), share, run
