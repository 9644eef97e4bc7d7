"""Which unstable mode the limit cycle takes, from the energy gained per cycle over amplitude."""

import numpy as np
import pytest

import stickslip as ss
from stickslip.energy.selection import Kick
from stickslip.scene.structure import Structure


def scene(friction):
    return ss.models.two_subsystems(friction=friction, slider_speed=0.025, preload_displacement=1e-3)


@pytest.fixture(scope="module", params=[2.2, 3.0])
def selection(request):
    return request.param, ss.mode_selection(scene(request.param), phases=12)


def test_small_amplitudes_gain_what_the_eigenvalue_says():
    model = scene(2.2)
    selection = ss.mode_selection(model, [1e-7, 1e-6], phases=4)
    rates = ss.complex_modes(model).eigenvalues
    rates = rates[(rates.real > 0.0) & (rates.imag > 0.0)]
    # Nothing switches below the onset: after one period the deviation is e^{Re(lambda) T} times itself.
    expected = np.expm1(4.0 * np.pi * rates.real / rates.imag)
    ratio = (selection.gains.net / selection.gains.energy).values
    # 1e-7 m beside static displacements of 5e-4 m, in squared form.
    np.testing.assert_allclose(ratio, expected[:, None] * np.ones(2), rtol=1e-9)


@pytest.mark.slow
def test_the_gain_of_every_amplitude_is_contact_less_losses(selection):
    gains = selection[1].gains
    defect = np.abs(gains.net - (gains.contact - gains.damping - gains.impact))
    # Steady sliding stores 78 mJ, and its forces of 100 N work along with every displacement.
    assert float(defect.max()) <= 1e-13 * 78e-3
    assert (gains.damping > 0.0).all()
    assert (gains.impact >= -1e-15 * gains.energy).all()


@pytest.mark.slow
def test_each_balance_closes_once_between_gain_and_loss(selection):
    modes, gains = selection[1].modes, selection[1].gains
    for j in range(modes.sizes["mode"]):
        below = gains.net[j].where(gains.amplitude < 0.9 * modes.amplitude[j], drop=True)
        above = gains.net[j].where(gains.amplitude > 1.2 * modes.amplitude[j], drop=True)
        assert (below > 0.0).all()
        assert (above < 0.0).all()


@pytest.mark.slow
def test_the_transient_selects_the_mode_that_closes_at_the_larger_energy(selection):
    """At friction 3 the second mode grows twice as fast, and still the first carries the cycle."""
    friction, result = selection
    assert result.modes.sizes["mode"] == 2
    assert result.dominant == 0
    assert float(result.modes.energy[0]) > 10.0 * float(result.modes.energy[1])
    if friction == 3.0:
        assert float(result.modes.growth_rate[1]) > 1.5 * float(result.modes.growth_rate[0])
    model = scene(friction)
    equilibrium, modes = ss.steady_sliding(model), ss.complex_modes(model)
    unstable = np.flatnonzero(modes.unstable)
    periods = []
    for r in unstable:
        # Started in the shape of either mode, the motion ends in the same cycle near the first one.
        kick = Kick(model, equilibrium, Structure.of(model), modes.eigenvalues[r], modes.shapes[:, r], 1)
        cycle = ss.simulate(model, 1.0, kick.start(1e-6, 0.0)).limit_cycle()
        periods.append(cycle.period)
        assert cycle.main_frequency("x2") == pytest.approx(112.0, abs=1.0)
        energy = ss.modal_energy(cycle.run, cycle.period * np.arange(128) / 128)
        sliding = energy.isel(time=energy.combination.values == "++")
        held = sliding.energy.mean("time").values
        growing = np.flatnonzero(sliding.growth_rate.values[0] > 0.0)
        assert growing.size == 2
        assert held[growing[0]] > 3.0 * held[growing[1]]
    assert periods[0] == pytest.approx(periods[1], rel=1e-9)


def test_the_shape_of_a_stable_scene_is_refused():
    with pytest.raises(ss.InputError, match="no oscillating unstable mode"):
        ss.mode_selection(scene(0.5))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"amplitudes": [0.0]}, "amplitudes: must be positive"),
        ({"amplitudes": [np.nan]}, "amplitudes: must be positive"),
        ({"phases": 0}, "phases: expected an integer >= 1, got 0"),
        ({"phases": 2.5}, "phases: expected an integer >= 1, got 2.5"),
    ],
)
def test_hostile_arguments(arguments, message):
    with pytest.raises(ss.InputError, match=message):
        ss.mode_selection(scene(1.5), **arguments)


def test_selection_in_a_plane_along_one_of_its_directions_is_that_of_a_line():
    law = ss.friction.Stribeck(static=0.5, kinetic=0.3, speed=0.2)
    contact = {"normal_force": 10.0, "friction": law}
    line = ss.Scene(
        [1.0],
        [[100.0]],
        [[0.5]],
        dofs=["x"],
        contacts=[ss.Contact(tangential="x", slider_speed=0.2, **contact)],
    )
    plane = ss.models.mass_on_belt_in_plane(damping=0.5, friction=law, slider_speed=(0.2, 0.0))
    for found in (ss.mode_selection(plane), ss.mode_selection(plane, [0.01, 0.05])):
        assert found.combination == "oo"
        assert found.modes.amplitude[found.dominant] == pytest.approx(
            float(ss.mode_selection(line).modes.amplitude[0]), rel=1e-9
        )
