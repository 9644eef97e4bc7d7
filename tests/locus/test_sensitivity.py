import numpy as np
import pytest

import stickslip as ss
from stickslip.scene.laws.friction import Stribeck

EPS = np.finfo(float).eps
LOCK_IN = 0.612484152848669


def nearest(values, target):
    return int(np.abs(values - target).argmin())


@pytest.mark.parametrize(
    ("name", "value"),
    [("friction", 1.5), ("damping", 1e-4), ("wall_stiffness", 1.8e6), ("link_vertical_stiffness", 2.4e5)],
)
def test_against_finite_differences(name, value):
    found = ss.sensitivity(ss.models.two_subsystems, {"friction": 1.5, name: value})
    step = 1e-4 * value
    low, high = (
        ss.complex_modes(ss.models.two_subsystems(**{"friction": 1.5, name: value + side})).eigenvalues
        for side in (-step, step)
    )
    difference = (high - low) / (2 * step)
    # Central: the relative error is of the order of (step / distance to the next singularity)^2.
    assert found.derivative.sel(parameter=name).to_numpy() == pytest.approx(difference, rel=1e-5)


def test_against_complex_steps():
    scene = ss.models.two_subsystems(friction=1.5)
    found = ss.sensitivity(scene).derivative.to_numpy()[0]
    eigenvalues = ss.complex_modes(scene).eigenvalues
    base, one = (ss.equations_of(scene.replace(friction=mu), "++") for mu in (1.0, 2.0))
    rate = 1e3

    def at(friction):
        stiffness, damping = (
            getattr(base, k) + (friction - 1.0) * (getattr(one, k) - getattr(base, k))
            for k in ("stiffness", "damping")
        )
        inverse = 1.0 / np.diag(base.mass)[:, None]
        zero = np.zeros_like(base.mass)
        state = np.block([[zero, rate * np.eye(6)], [-inverse * stiffness / rate, -inverse * damping]])
        return np.linalg.eigvals(state)

    # Analytic in friction: the difference of conjugate steps has an error of step^2 and none of cancellation
    # beyond rounding over step.
    step = 1e-5
    plus, minus = at(1.5 + 1j * step), at(1.5 - 1j * step)
    for value, derivative in zip(eigenvalues, found, strict=True):
        difference = (plus[nearest(plus, value)] - minus[nearest(minus, value)]) / (2j * step)
        assert difference == pytest.approx(derivative, rel=1e-6)


def test_contacts_add_up():
    scene = ss.models.two_subsystems(friction=(1.2, 0.9))
    found = ss.sensitivity(scene, ("friction", "friction_0", "friction_1")).derivative.to_numpy()
    assert found[0] == pytest.approx(found[1] + found[2], rel=1e-12)


@pytest.mark.parametrize("matrix", ["mass", "damping", "stiffness"])
def test_entries_of_matrices(matrix):
    reference = ss.models.two_subsystems(friction=1.5)
    dense = {
        "mass": np.diag(reference.mass),
        "stiffness": reference.stiffness.toarray(),
        "damping": 1e-4 * reference.stiffness.toarray(),
    }

    def scene(**changed):
        return ss.Scene(**{**dense, **changed}, force=reference.force, contacts=reference.contacts)

    found = ss.sensitivity(scene(), entries=matrix).entry_derivative
    # Entries among the upper masses: a full mass matrix that couples contacts is another model.
    for i, j in ((0, 0), (0, 1), (1, 4)):
        step = 1e-5 * np.abs(np.diag(dense[matrix])).max()
        sides = []
        for side in (-step, step):
            changed = dense[matrix].copy()
            changed[i, j] += side
            changed[j, i] = changed[i, j]
            sides.append(ss.complex_modes(scene(**{matrix: changed})).eigenvalues)
        difference = (sides[1] - sides[0]) / (2 * step)
        expected = found.to_numpy()[:, i, j] + (found.to_numpy()[:, j, i] if i != j else 0.0)
        assert np.abs(difference - expected).max() <= 1e-5 * np.abs(difference).max()


@pytest.mark.parametrize("distance", [1e-11, 1e-12, 1e-14, 0.0])
def test_at_a_lock_in_only_the_mean_has_a_derivative(distance):
    found = ss.sensitivity(ss.models.two_subsystems(friction=LOCK_IN + distance))
    pair = np.flatnonzero(~found.defined.to_numpy())
    assert pair.size == 2
    assert found.partner.to_numpy()[pair].tolist() == pair[::-1].tolist()
    assert np.isnan(found.derivative.to_numpy()[0, pair]).all()
    means = found.mean_derivative.to_numpy()[0, pair]
    far = [
        ss.complex_modes(ss.models.two_subsystems(friction=LOCK_IN + side)).eigenvalues
        for side in (-1e-4, 1e-4)
    ]
    middles = [values[np.abs(values - 694.45j).argsort()[:2]].mean() for values in far]
    # The mean is analytic: the difference has an error of the step squared.
    assert means == pytest.approx((middles[1] - middles[0]) / 2e-4, rel=1e-6)


def test_an_oscillator_about_to_be_overdamped_is_its_own_partner():
    """``lambda = -c/2 +- sqrt(c^2/4 - k)``: near c^2 = 4 k the mean of both, -c/2, alone has a derivative."""
    stiffness = 100.0

    def model(c):
        return ss.Scene([1.0], [[stiffness]], damping=[[c]])

    found = ss.sensitivity(model, {"c": 20.0 * (1.0 - 1e-13)}, combination="")
    assert found.sizes["mode"] == 1
    assert found.eigenvalue.item().imag > 0.0
    assert not found.defined.item()
    assert found.partner.item() == 0
    assert found.mean_derivative.item() == pytest.approx(-0.5, rel=1e-6)


def test_a_parameter_at_the_end_of_its_domain():
    found = ss.sensitivity(ss.models.two_subsystems, {"friction": 0.0})
    inside = ss.sensitivity(ss.models.two_subsystems(friction=0.0))
    assert found.derivative.to_numpy() == pytest.approx(inside.derivative.to_numpy(), rel=1e-9)


def test_a_scene_and_its_model_agree_at_any_value():
    names = ("friction_0", "friction_1")
    at = ss.sensitivity(ss.models.two_subsystems(), dict.fromkeys(names, 0.5))
    there = ss.sensitivity(ss.models.two_subsystems(friction=0.5), names)
    model = ss.sensitivity(ss.models.two_subsystems, dict.fromkeys(names, 0.5))
    assert (at.derivative.to_numpy() == there.derivative.to_numpy()).all()
    assert model.derivative.to_numpy() == pytest.approx(there.derivative.to_numpy(), rel=1e-9)


def test_derivatives_to_entries_stand_beside_those_to_parameters():
    scene = ss.models.two_subsystems()
    both = ss.sensitivity(scene, ["friction", "stiffness"], entries="stiffness")
    assert both.derivative.sizes["parameter"] == 2
    # A factor on the stiffness changes every entry by itself, and damping in proportion along with it.
    weighted = both.entry_derivative.to_numpy() * scene.stiffness.toarray()
    assert weighted.sum(axis=(1, 2)) == pytest.approx(both.derivative.to_numpy()[1], rel=1e-8)
    assert both.entry_derivative.units == "1/s/(N/m)"
    assert both.unit.to_numpy().tolist() == ["1", "1"]
    alone = ss.sensitivity(scene, entries="mass")
    assert alone.sizes["parameter"] == 0
    assert alone.entry_derivative.dims == ("mode", "row", "column")
    assert ss.sensitivity(scene).parameter.to_numpy().tolist() == ["friction"]


def test_hostile_input():
    scene = ss.models.two_subsystems()
    with pytest.raises(ss.InputError, match="stifness: a scene has no such parameter"):
        ss.sensitivity(scene, ("stifness",))
    with pytest.raises(
        ss.InputError, match="parameters: expected a sequence of names, or values by name, got 'friction'"
    ):
        ss.sensitivity(scene, "friction")
    with pytest.raises(ss.InputError, match="vertical_stiffness: has no one value to start from"):
        ss.sensitivity(ss.models.two_subsystems, ("vertical_stiffness",))
    with pytest.raises(ss.InputError, match="entries: expected one of"):
        ss.sensitivity(scene, entries="inertia")


def rubbing(**changes) -> ss.Scene:
    """Return two dofs under a Stribeck law, one of them along the normal direction."""
    contact = {
        "tangential": 0,
        "normal": 1,
        "friction": Stribeck(0.5, 0.3, 0.1),
        "slider_speed": 0.2,
        **changes,
    }
    stiffness = [[100.0, -20.0, 5.0], [-20.0, 300.0, 10.0], [5.0, 10.0, 200.0]]
    return ss.Scene(
        np.ones(3),
        stiffness,
        damping=0.7 * np.eye(3),
        force=[0.0, -10.0, 2.0],
        contacts=[ss.Contact(**contact)],
    )


@pytest.mark.parametrize(
    ("name", "value"), [("slider_speed", 0.2), ("friction_static", 0.5), ("friction_speed", 0.1)]
)
def test_a_law_over_slip_speed_is_differentiated(name, value):
    scene, step = rubbing(), 1e-4 * value
    above, below = (
        ss.complex_modes(scene.replace(**{name: value + side * step})).eigenvalues for side in (1.0, -1.0)
    )
    expected = (above - below) / (2.0 * step)
    for found in (ss.sensitivity(scene, [name]), ss.sensitivity(scene, {name: value})):
        # Differences err by the square of the step.
        np.testing.assert_allclose(found.derivative.to_numpy()[0], expected, rtol=1e-6, atol=1e-9)


def test_stiffness_that_moves_the_slope_of_friction_is_refused():
    with pytest.raises(ss.InputError, match="stiffness also changes normal forces"):
        ss.sensitivity(rubbing(), entries="stiffness")
    assert np.isfinite(ss.sensitivity(rubbing(), entries="damping").entry_derivative).all()


def test_a_compliant_contact_is_differentiated():
    scene = rubbing(friction=0.4, normal_stiffness=800.0, tangential_stiffness=600.0)
    below, above = (
        ss.complex_modes(scene.replace(friction=0.4 + step)).eigenvalues for step in (-1e-5, 1e-5)
    )
    found = ss.sensitivity(scene).derivative.to_numpy()[0]
    np.testing.assert_allclose(found, (above - below) / 2e-5, rtol=1e-6, atol=1e-9)
