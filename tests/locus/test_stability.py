import numpy as np
import pytest

import stickslip as ss

EPS = np.finfo(float).eps


def largest(modes):
    return modes.eigenvalues.real.max()


def samples(count, seed=0):
    rng = np.random.default_rng(seed)

    def spread(value, *shape):
        return np.asarray(value) * rng.uniform(0.5, 1.5, (count, *shape))

    return {
        "friction": rng.uniform(0.0, 3.0, (count, 2)),
        "upper_mass": spread([0.3, 0.7], 2),
        "contact_mass": spread([0.3, 0.7], 2),
        "inclination": spread([0.3, 0.75], 2),
        "vertical_stiffness": spread([4.5e5, 3e4], 2),
        "horizontal_stiffness": spread([3e5, 2.4e6], 2),
        "ceiling_stiffness": spread([6e4, 1.8e5], 2),
        "wall_stiffness": spread(1.8e6),
        "link_horizontal_stiffness": spread(1.5e6, 1),
        "link_vertical_stiffness": spread(2.4e5, 1),
        "damping": spread(1e-4),
    }


def test_sampled_models_equal_their_scenes():
    drawn = samples(200)
    found = ss.stability(ss.models.two_subsystems, drawn)
    for i in range(200):
        values = {name: value[i, 0] if value.shape[1:] == (1,) else value[i] for name, value in drawn.items()}
        modes = ss.complex_modes(ss.models.two_subsystems(**values))
        bound = 100 * EPS * modes.condition.max() * np.abs(modes.eigenvalues).max()
        assert abs(float(found.growth_rate[i]) - largest(modes)) <= bound
        if np.abs(modes.eigenvalues.real).min() > bound:
            assert int(found.unstable_modes[i]) == len(modes.select(unstable=True))


def test_a_scene_over_friction_and_a_function_agree():
    friction = np.linspace(0.0, 3.0, 40)
    fast = ss.stability(ss.models.two_subsystems, {"friction": friction})
    path = ss.stability(ss.models.two_subsystems(), {"friction": friction})
    scenes = ss.stability(lambda mu: ss.models.two_subsystems(friction=mu), {"mu": friction})
    for other in (path, scenes):
        assert other.growth_rate.to_numpy() == pytest.approx(fast.growth_rate.to_numpy(), abs=1e-9)
        assert (other.unstable_modes.to_numpy() == fast.unstable_modes.to_numpy()).all()
    unstable = np.where(friction > 2.1002056, 2, np.where(friction > 0.70156717, 1, 0))
    assert (fast.unstable_modes.to_numpy() == unstable).all()


def test_other_combinations_and_general_damping():
    scene = ss.models.two_subsystems(friction=2.2)
    dense = ss.Scene(
        scene.mass,
        scene.stiffness,
        damping=1e-4 * scene.stiffness.toarray(),
        force=scene.force,
        contacts=scene.contacts,
    )
    for combination in ("+-", "s+", "dd"):
        modes = ss.complex_modes(scene, combination)
        for model in (scene, dense):
            found = ss.stability(model, {"friction": [2.2]}, combination=combination)
            assert float(found.growth_rate[0]) == pytest.approx(largest(modes), rel=1e-9)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"friction": [0.1, -0.2]}, "sample 1: contact 0: friction: must be >= 0, got -0.2"),
        ({"upper_mass": [0.1, 0.0]}, r"sample 1: subsystems\[0\].upper_mass: must be positive, got 0"),
        ({"damping": [0.1, np.inf]}, "damping: must be finite, got inf"),
        ({"friction": [0.1, 0.2], "damping": [1e-4]}, "damping: expected 2 samples like friction, got 1"),
        ({"friction": np.ones((2, 3))}, r"friction: expected shape \(2,\) or \(2, 2\), got \(2, 3\)"),
        ({"friction": 1.0}, "expected at least one parameter with an array"),
    ],
)
def test_hostile_samples_are_refused(arguments, message):
    with pytest.raises(ss.InputError, match=message):
        ss.stability(ss.models.two_subsystems, arguments)
