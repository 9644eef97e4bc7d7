"""Dips of an event function in panels under a law of friction, as deep as its error bound or twice that.

A block slides by its law, and a second block on a spring to it swings up to a stop. How far it swings is
known to 45 digits; the gap of the stop is that less a multiple of the error bound, which a touch reports.
"""

import numpy as np
import pytest
from mpmath import mpf

import stickslip as ss
from friction_peer import Peer, evaluated
from stickslip.scene.laws.friction import FrictionLaw

LAWS = [ss.friction.Stribeck(0.5, 0.3, 0.1), ss.friction.Rational(0.5, 0.3, 0.1)]
#: Deeper than the bound by its own size, a dip has to be an event; less than that, a touch is an answer too.
DEPTHS = [0.9, 0.99, 1.01, 1.1, 1.5, 1.9, 2.0]


def blocks(law: FrictionLaw, gap: float | None = None) -> ss.Scene:
    """Return two blocks tied by a spring, the first on a belt, and a stop of the second where it is given."""
    contacts = [ss.Contact(tangential=0, normal_force=10.0, friction=law, slider_speed=0.6)]
    if gap is not None:
        contacts.append(ss.Contact(normal={1: -1.0}, gap=gap))
    stiffness = [[300.0, -200.0], [-200.0, 200.0]]
    return ss.Scene([1.0, 0.5], stiffness, damping=[[0.4, 0.0], [0.0, 0.1]], contacts=contacts)


def turning(scene: ss.Scene, start: ss.State) -> tuple[mpf, mpf]:
    """Return when and where the second block turns first."""
    peer = Peer(scene, start)
    x, v, *_ = peer.series()
    speed, at = [row[1] for row in v], mpf(0)
    for _ in range(60):
        at -= evaluated(speed, at) / evaluated([k * c for k, c in enumerate(speed)][1:], at)
    return at, evaluated([row[1] for row in x], at)


@pytest.mark.parametrize("law", LAWS, ids=repr)
def test_no_dip_is_missed_at_any_place_of_a_panel(law):
    scene = blocks(law)
    steady = ss.steady_sliding(scene)
    widest = 0.0
    for k in range(60):
        # The slower the second block, the sooner it turns: anywhere in the first panel, and beyond.
        start = steady.perturbed(velocity={"x1": 0.05 * np.cos(k), "x2": 0.006 * (k + 0.5)})
        start = ss.State(start.position + np.array([0.0, 0.02]), start.velocity, start.combination)
        at, highest = turning(scene, start)
        end = 1.2 * float(at)
        widest = max(widest, ss.simulate(scene, end, start).counters["panels"])

        def swing(gap: mpf, start: ss.State = start, end: float = end) -> ss.Trajectory:
            return ss.simulate(blocks(law, float(gap)), end, ss.State(start.position, start.velocity, "+d"))

        (touch,) = swing(highest).grazings
        bound = touch.uncertainty
        assert bound < 1e-13
        for depth in DEPTHS:
            run = swing(highest - depth * bound)
            events = [t for t, c in zip(run.events.time, run.events.contact, strict=True) if c == 1]
            told = events or [touch.time for touch in run.grazings]
            assert told, (depth, k)
            # So far from its turn the block is some bounds away from the stop.
            assert abs(told[0] - float(at)) < 4.0 * np.sqrt(bound)
            assert events or depth < 2.0, (depth, k)
        clear = swing(highest + 2.1 * bound)
        assert not len(clear.events)
        assert not clear.grazings
    assert widest == 2
