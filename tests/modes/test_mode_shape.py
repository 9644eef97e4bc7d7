import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

import stickslip as ss
from random_scenes import combinations, drawn_scenes


@given(drawn_scenes(), st.data())
def test_contact_less_damping_power_is_the_growth_of_energy(drawn, data):
    combination = data.draw(combinations(drawn.scene))
    modes = ss.complex_modes(drawn.scene, combination)
    assume(not modes.defective.any())
    power = ss.complex_modes(drawn.scene, combination).power()
    size = (
        np.abs(power.contact_power).sum("contact")
        + power.damping_power
        + 2.0 * np.abs(power.eigenvalue) * np.abs(power.energy)
    )
    # What cancels are the residuals of the pairs, times the norm of the problem over that of the mode's own
    # terms.
    assert (np.abs(power.residual) <= 1e-10 * size.max()).all()


def test_published_balance_of_a_stable_and_an_unstable_mode():
    stable = ss.complex_modes(ss.models.two_subsystems(friction=0.65)).power()
    per_energy = (stable.contact_power.sum("contact") / stable.energy).to_numpy()
    lost = (stable.damping_power / stable.energy).to_numpy()
    # Contact power alone does not carry the sign of the growth (design: +28.8 against 45.6).
    fed = int(np.argmax(per_energy))
    assert per_energy[fed] == pytest.approx(28.8, abs=0.05)
    assert lost[fed] == pytest.approx(45.6, abs=0.05)
    assert stable.eigenvalue.to_numpy()[fed].real < 0.0


def test_an_orbit_is_the_motion_of_the_mode():
    modes = ss.complex_modes(ss.models.two_subsystems(friction=1.5))
    mode = int(np.argmax(modes.eigenvalues.real))
    motion = modes.orbit(mode, ("x1", "x2"), periods=2.0, samples=101)
    value = modes.eigenvalues[mode]
    period = 2 * np.pi / abs(value.imag)
    assert motion.time[-1] == pytest.approx(2 * period)
    # One period later everything is larger by e^{Re(lambda) T}.
    growth = np.exp(value.real * period)
    assert motion.to_numpy()[50:] == pytest.approx(growth * motion.to_numpy()[:51], rel=1e-9, abs=1e-12)
    assert growth > 1.0


def test_phase_lags_are_those_of_the_orbit():
    modes = ss.complex_modes(ss.models.two_subsystems(friction=1.5))
    lags = modes.phase_lag("x1", "x2")
    for mode in range(len(modes)):
        turned = modes.shapes[0, mode] * np.exp(-1j * lags[mode]) / modes.shapes[1, mode]
        assert turned.imag == pytest.approx(0.0, abs=1e-12 * abs(turned))
        assert turned.real > 0.0
    # A closed contact does not move along its normal.
    assert np.isnan(modes.phase_lag("x3", "x4")).all()


def test_without_friction_orbits_are_straight():
    lags = ss.complex_modes(ss.models.two_subsystems(friction=0.0)).phase_lag("x1", "x2")
    assert np.abs(np.sin(lags)) == pytest.approx(0.0, abs=1e-12)


def test_hostile_input():
    modes = ss.complex_modes(ss.models.two_subsystems())
    with pytest.raises(ss.InputError, match=r"number: expected a mode in 0\.\.5, got 6"):
        modes.orbit(6)
    with pytest.raises(ss.InputError, match="dofs: unknown dof 'y1'"):
        modes.orbit(0, ("y1",))
    with pytest.raises(ss.InputError, match="periods > 0"):
        modes.orbit(0, periods=0.0)
    with pytest.raises(ss.InputError, match="leading: unknown dof"):
        modes.phase_lag("y1", "x1")
