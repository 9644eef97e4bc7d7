"""Masses at the limit of what doubles invert: every question is answered, or refused with a reason."""

import numpy as np
import pytest

import stickslip as ss

SIZE = 5


def drawn(seed: int) -> ss.Scene:
    """Return a scene with a mass of condition 1e13 to 1e16; in every third contacts depend."""
    rng = np.random.default_rng(seed)
    basis, _ = np.linalg.qr(rng.normal(size=(SIZE, SIZE)))
    mass = (basis * np.logspace(0.0, -rng.uniform(13.0, 16.0), SIZE)) @ basis.T
    vectors = rng.normal(size=(4, SIZE))
    if seed % 3 == 0:
        vectors[3] = vectors[0] + vectors[1]
    law = ss.friction.Stribeck(kinetic=0.3, static=0.5, speed=0.01) if seed % 2 else 0.4
    contacts = [
        ss.Contact(tangential=tangential, normal=normal, friction=law, slider_speed=0.1)
        for tangential, normal in (vectors[[0, 2]], vectors[[1, 3]])
    ]
    return ss.Scene(
        0.5 * (mass + mass.T),
        np.eye(SIZE),
        force=rng.normal(size=SIZE),
        contacts=contacts,
        dofs=[f"q{k}" for k in range(SIZE)],
        impact_friction=True,
        loads=[ss.Harmonic({"q0": 1.0}, 10.0)] if seed % 5 == 0 else (),
    )


def refusal(question) -> str:
    """Return why a question is refused; empty if it is answered."""
    try:
        question()
    except ss.StickslipError as error:
        return str(error)
    return ""


@pytest.mark.parametrize("seed", range(24))
def test_a_mass_near_singular_is_factorised_or_refused(seed):
    reason = refusal(lambda: drawn(seed))
    if reason:
        assert "positive definite" in reason
        return
    scene, rest = drawn(seed), ss.State(np.zeros(SIZE), np.zeros(SIZE), "dd")
    questions = [
        lambda: ss.complex_modes(scene, "++"),
        lambda: ss.steady_sliding(scene),
        lambda: ss.simulate(scene, 1e-3, rest, max_events=50),
    ]
    assert not [reason for reason in map(refusal, questions) if "internal error" in reason]
