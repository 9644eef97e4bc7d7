"""One scene in another form, which series propagate another way, and the comparison of their motions."""

import numpy as np

import stickslip as ss


def in_matrices(scene):
    """Return the scene with its damping as a matrix, which series take as it is."""
    mass = np.asarray(scene.mass, dtype=float)
    mass = np.diag(mass) if mass.ndim == 1 else mass
    law = scene.damping
    return scene.replace(damping=law.mass * mass + law.stiffness * np.asarray(scene.stiffness, dtype=float))


def compare_motions(scene, other, start, *, events, time_error, sample_error, near_share):
    """Expect of a scene by series and by modes what its other form does by series.

    Return how many events happen; a run ends after `events` of them. `time_error` of their times and
    `sample_error` of samples are relative, and more than `near_share` of the samples are as near.
    """
    runs = [
        ss.simulate(which, 1.0, start, method=method, max_events=events)
        for which, method in [(scene, "taylor"), (other, "taylor"), (scene, "modal")]
    ]
    first, *others = ([(event.contact, str(event.kind)) for event in run.events] for run in runs)
    for run, found in zip(runs[1:], others, strict=True):
        assert found == first
        times = [[event.time for event in one.events] for one in (runs[0], run)]
        np.testing.assert_allclose(times[0], times[1], rtol=time_error)
    instants = np.linspace(0.0, min(run.events[-1].time for run in runs), 200, endpoint=False)
    samples = [run.sample(instants) for run in runs]
    for sample in samples[1:]:
        for quantity in ("position", "velocity", "normal_force"):
            found, expected = samples[0][quantity].to_numpy(), sample[quantity].to_numpy()
            near = np.isclose(found, expected, rtol=0.0, atol=sample_error * np.abs(expected).max())
            # A sample within rounding of an event may lie on either side of it.
            assert np.mean(near.all(axis=1)) > near_share
    return len(first)
