"""Stiffnesses of compliant contacts, and times and factors of switched loads, as parameters by name."""

from functools import partial

import numpy as np
import pytest

import stickslip as ss


def compliant(normal_stiffness=3e4, step=0.02, factor=1.5):
    """A mass on a compliant contact beside a rigid stop, under a load that is switched twice."""
    return ss.Scene(
        [1.0, 1.0, 1.0],
        np.diag([2e3, 2e3, 1e3]) + 500.0 * (1.0 - np.eye(3)),
        damping=np.diag([1.0, 1.0, 1.0]),
        force=[0.0, -40.0, -5.0],
        contacts=[
            ss.Contact(
                tangential=0,
                normal=1,
                friction=0.4,
                slider_speed=0.1,
                normal_stiffness=normal_stiffness,
                tangential_stiffness=2e4,
                name="pad",
            ),
            ss.Contact(normal=2, name="stop"),
        ],
        loads=[ss.Switched({0: 5.0}, times=[step, 0.06], values=[0.0, factor, -1.0], name="pull")],
    )


#: Name, value, unit, and the scene with it by other means.
CASES = {
    "normal_stiffness_0": (5e4, "N/m", compliant(5e4)),
    "normal_stiffness_pad": (5e4, "N/m", compliant(5e4)),
    "normal_stiffness": (5e4, "N/m", compliant(5e4)),
    "pull_times_0": (0.03, "s", compliant(step=0.03)),
    "pull_values_1": (2.0, "1", compliant(factor=2.0)),
}


@pytest.mark.parametrize("name", CASES)
def test_replace_sweep_and_study(name):
    value, unit, expected = CASES[name]
    start = ss.steady_sliding(expected)
    run = ss.simulate(expected, 0.1, start)
    other = ss.simulate(compliant().replace(**{name: value}), 0.1, start)
    assert (other.state(0.1).position == run.state(0.1).position).all()
    standing = 3e4 if name.startswith("normal") else {"pull_times_0": 0.02}.get(name, 1.5)
    swept = ss.sweep(compliant(), {name: [standing, value]})
    assert swept[name].attrs["units"] == unit
    modes = ss.complex_modes(expected).with_conjugates.eigenvalues
    assert np.sort_complex(swept.eigenvalue.values[1]) == pytest.approx(np.sort_complex(modes), rel=1e-9)
    answers = ss.Study(compliant(), {name: [standing, value]}, outputs=["growth_rate"]).run()
    largest = modes.real.max()
    assert float(answers.growth_rate[1]) == pytest.approx(largest, rel=1e-9)


def test_bifurcation_over_a_contact_stiffness():
    """As the scenes one by one."""
    scene = ss.Scene(
        [1.0, 1.0],
        np.diag([400.0, 100.0]),
        damping=np.diag([6.0, 5.0]),
        force=[0.0, -12.0],
        contacts=[
            ss.Contact(
                tangential=0,
                normal=1,
                friction=0.3,
                static_friction=0.5,
                slider_speed=0.04,
                normal_stiffness=3e4,
                tangential_stiffness=1e4,
            )
        ],
    )
    start = ss.State([0.0, -4e-4], [0.04, 0.0], "s")
    found = ss.bifurcation(scene, {"tangential_stiffness_0": [8e3, 1e4]}, start=start)
    for cycle, stiffness in zip(found.cycles, (8e3, 1e4), strict=True):
        other = scene.replace(tangential_stiffness=stiffness)
        expected = ss.simulate(other, 30.0, start).limit_cycle()
        assert cycle.period == pytest.approx(expected.period, rel=1e-9)


def test_what_has_no_such_number():
    with pytest.raises(ss.InputError, match="normal_stiffness_stop: a rigid contact has no normal_stiffness"):
        ss.sweep(compliant(), {"normal_stiffness_stop": [1e4, 2e4]})
    with pytest.raises(ss.InputError, match="no such parameter"):
        ss.sweep(compliant(), {"pull_times_2": [0.1, 0.2]})
    with pytest.raises(ss.InputError, match="must be positive and ascending"):
        compliant().replace(pull_times_0=0.07)


def test_a_function_passes_them_on():
    model = partial(compliant, normal_stiffness=4e4)
    swept = ss.sweep(model, {"tangential_stiffness_pad": [2e4, 3e4]})
    expected = compliant(4e4).replace(tangential_stiffness_pad=3e4)
    assert swept.tangential_stiffness_pad.attrs["units"] == "N/m"
    assert np.sort_complex(swept.eigenvalue.values[1]) == pytest.approx(
        np.sort_complex(ss.complex_modes(expected).with_conjugates.eigenvalues), rel=1e-9
    )
