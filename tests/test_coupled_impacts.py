"""Series of impacts over contacts that mass couples."""

import numpy as np
import pytest

import stickslip as ss
from coupled_scenes import elastic_block, masses_on_a_belt

CASES = [
    (count, coupling, restitution)
    for count in (2, 3, 4, 5, 6, 7, 8)
    for coupling in (0.3, 0.6, 0.9)
    for restitution in (0.0, 0.2, 0.5)
]
#: What quadrature and rounding leave of the works, relative.
BALANCE = 1e-11


def check(run):
    """Complementarity between the events, and the balance of energy."""
    scene = run.scene
    count = len(scene.contacts)
    edges = np.concatenate([[0.0], run.events.time, [run.duration]])
    widths = np.diff(edges)
    longest = np.argsort(widths)[-300:]
    times = np.sort((edges[longest, None] + widths[longest, None] * np.array([0.1, 0.5, 0.9])).ravel())
    data = run.sample(times)
    gap = np.array([scene.normal_direction(i) for i in range(count)]) @ data.position.values.T
    gap = gap.T + np.array([contact.gap for contact in scene.contacts])
    # Rounding of motions about the static displacement under the same load.
    static = np.linalg.solve(scene.stiffness, scene.force)
    scale = max(np.abs(data.position.values).max(), np.abs(static).max())
    assert gap.min() >= -1e3 * np.finfo(float).eps * scale
    normal = data.normal_force.values
    assert normal.min() >= -1e-9 * np.abs(normal).max()
    balance = run.balance()
    turnover = sum(abs(float(getattr(balance, name))) for name in ("stored", "external", "damping"))
    turnover += np.abs(balance.contact).sum() + np.abs(balance.impact).sum()
    assert abs(balance.residual) <= BALANCE * turnover


@pytest.mark.parametrize(("count", "coupling", "restitution"), CASES)
def test_masses_on_a_belt_come_to_rest(count, coupling, restitution):
    scene, start = masses_on_a_belt(count, coupling, restitution)
    run = ss.simulate(scene, start, 0.1)
    assert run.stop_reason == "duration"
    check(run)
    # No contact has more than a hundred events within any millisecond, on the mean of the contacts.
    time = run.events.time
    within = np.searchsorted(time, time + 1e-3) - np.arange(time.size)
    assert within.max() <= 100 * count
