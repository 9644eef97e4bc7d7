"""The return map of a periodic orbit by finite differences of runs, to hold multipliers against."""

import numpy as np

import stickslip as ss

#: Steps of displacements, m, and velocities, m/s: rounding and curvature stay below 1e-7 of a multiplier.
LENGTH, SPEED = 1e-10, 1e-7


def admissible(scene, combination):
    """Directions, in columns, of displacements and of velocities that a combination leaves free."""
    # The node of a spring is held, and not the body.
    states = list(zip(scene.contacts, combination, strict=True))
    closed = [
        scene.normal_direction(i)
        for i, (contact, letter) in enumerate(states)
        if letter != "d" and contact.normal_stiffness is None
    ]
    stuck = [
        scene.tangential_direction(i)
        for i, (contact, letter) in enumerate(states)
        if letter == "s" and contact.tangential_stiffness is None
    ]

    def across(directions):
        # That of a stop along its slider, for example, is zero.
        directions = [direction for direction in directions if direction.any()]
        if not directions:
            return np.eye(scene.size)
        return np.linalg.svd(np.array(directions))[2][len(directions) :].T

    return across(closed), across([*closed, *stuck])


def differenced_multipliers(cycle, phase=0, method="auto", at=0.5, steps=(LENGTH, SPEED)):
    """Eigenvalues of the differenced flow over a period, from within a phase."""
    begin, duration = cycle.phases[phase].start, cycle.phases[phase].duration
    middle = cycle.run.state(begin + at * duration)
    positions, velocities = admissible(cycle.scene, middle.combination)
    columns = []
    for free, step, moved in ((positions, steps[0], (1, 0)), (velocities, steps[1], (0, 1))):
        for direction in free.T:
            ends = []
            for sign in (step, -step):
                position = middle.position + sign * moved[0] * direction
                velocity = middle.velocity + sign * moved[1] * direction
                start = ss.State(position, velocity, middle.combination)
                end = ss.simulate(cycle.scene, cycle.period, start, method=method).state(cycle.period)
                ends.append(np.concatenate([positions.T @ end.position, velocities.T @ end.velocity]))
            columns.append((ends[0] - ends[1]) / (2.0 * step))
    scale = np.array([1e-3] * positions.shape[1] + [1.0] * velocities.shape[1])
    values = np.linalg.eigvals(np.array(columns).T * scale / scale[:, None])
    return values[np.argsort(-np.abs(values))]


def assert_multipliers(cycle, tolerance=1e-6, **where):
    """Every multiplier is an eigenvalue of the differenced map; those beyond them are zero."""
    differenced = differenced_multipliers(cycle, **where)
    for multiplier in cycle.multipliers:
        assert np.abs(differenced - multiplier).min() <= tolerance, multiplier
    for value in differenced:
        assert np.abs(cycle.multipliers - value).min() <= tolerance or abs(value) <= tolerance, value
