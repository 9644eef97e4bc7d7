"""Random chains of subsystems, the reference model beside its defective points, and sparse scenes."""

from __future__ import annotations

import numpy as np
from scipy import sparse

import stickslip as ss

#: Parts of the scenes: contacts coupled by mass, and the reference model beside a defective point.
COUPLED, DEFECTIVE = 0.2, 0.1

#: Friction of the reference model at which two modes coalesce.
DEFECTIVE_POINTS = (0.612484152848668518, 1.989108991216879)


def symmetric_scene(seed: int, index: int) -> tuple[ss.Scene, ss.State]:
    """Return the scene without these terms."""
    rng = np.random.default_rng([seed, index, 1])
    kind = rng.random()
    if kind < DEFECTIVE:
        return near_defective(rng)
    if kind < DEFECTIVE + COUPLED:
        return coupled_by_mass(rng)
    return chain(seed, index)


def near_defective(rng: np.random.Generator) -> tuple[ss.Scene, ss.State]:
    """Return the reference model, its friction 1e-16 to 1 of a defective value away from it, and a start."""
    away = rng.choice([-1.0, 1.0]) * 10.0 ** -rng.uniform(0.0, 16.0)
    friction = float(rng.choice(DEFECTIVE_POINTS)) * (1.0 + away)
    scene = ss.models.two_subsystems(
        friction=friction,
        slider_speed=float(rng.choice([-1.0, 1.0])) * 10.0 ** rng.uniform(-3.0, 0.0),
        preload_displacement=1e-3,
    ).replace(static_friction=friction)
    kick = {name: rng.normal() * 10.0 ** rng.uniform(-5, -2) for name in ("x1", "x2", "x5", "x6")}
    try:
        start = ss.steady_sliding(scene).perturbed(velocity=kick)
        ss.simulate(scene, 1e-9, start, max_events=0)
    except ss.InputError:
        position = np.zeros(8)
        position[3::4] = 1e-4
        start = ss.State(position, 0.1 * rng.normal(size=8), "dd")
    return scene, start


def coupled_by_mass(rng: np.random.Generator) -> tuple[ss.Scene, ss.State]:
    """Return a chain of 2 to 8 subsystems whose contact masses are tied to each other, in flight.

    The tangential and the normal directions are tied apart from each other, so that the normal forces do not
    depend on friction and no paradox of Painleve is possible.
    """
    count = int(rng.integers(2, 9))
    friction = rng.uniform(0.0, 1.5, count)
    scene = ss.models.chain(
        [
            ss.models.Subsystem(
                upper_mass=rng.uniform(0.1, 1.0),
                contact_mass=rng.uniform(0.1, 1.0),
                inclination=rng.uniform(0.0, 1.2),
                vertical_stiffness=2e5 * 10.0 ** rng.uniform(-0.5, 0.5),
                horizontal_stiffness=5e5 * 10.0 ** rng.uniform(-0.5, 0.5),
                ceiling_stiffness=1e5 * 10.0 ** rng.uniform(-0.5, 0.5),
                preload_displacement=10.0 ** rng.uniform(-4.0, -2.5),
                external_force=0.0,
            )
            for _ in range(count)
        ],
        [
            ss.models.Link(horizontal_stiffness=1e6 * rng.uniform(0.1, 1.0), vertical_stiffness=1e5)
            for _ in range(count - 1)
        ],
        wall_stiffness=1e6,
        friction=friction,
        static_friction=friction * np.where(rng.random(count) < 0.5, 1.0, rng.uniform(1.0, 1.6, count)),
        slider_speed=rng.choice([-1.0, 1.0], count) * 10.0 ** rng.uniform(-3.0, 0.0, count),
        restitution=np.where(rng.random(count) < 0.5, 0.0, rng.uniform(0.0, 0.8, count)),
        damping=10.0 ** rng.uniform(-5.0, -3.5),
        impact_friction=True,
    )
    mass = np.diag(scene.mass)
    for first in (2, 3):
        rows = np.arange(first, 4 * count, 4)
        factors = rng.normal(size=(count, count))
        tied = factors @ factors.T + 0.1 * count * np.eye(count)
        scale = np.sqrt(np.diag(mass)[rows] / np.diag(tied))
        mass[np.ix_(rows, rows)] = tied * np.outer(scale, scale)
    position = np.zeros(4 * count)
    position[3::4] = 10.0 ** rng.uniform(-5.0, -3.0, count)
    return scene.replace(mass=mass), ss.State(position, 0.1 * rng.normal(size=4 * count), "d" * count)


def chain(seed: int, index: int) -> tuple[ss.Scene, ss.State]:
    """Return a chain of 1 to 6 subsystems and a start state that is consistent with it.

    Half of the scenes spread their parameters over one decade, half over four: frequencies then over four
    decades, ratios of stiffness to mass over eight. Most start near sliding, the others in flight.
    """
    rng = np.random.default_rng([seed, index])
    decades = 2.0 if rng.random() < 0.5 else 0.5

    def spread(centre: float) -> float:
        return centre * 10.0 ** rng.uniform(-decades, decades)

    count = int(rng.integers(1, 7))
    subsystems = [
        ss.models.Subsystem(
            upper_mass=spread(0.3),
            contact_mass=spread(0.3),
            inclination=rng.uniform(0.0, 1.2),
            vertical_stiffness=spread(2e5),
            horizontal_stiffness=spread(5e5),
            ceiling_stiffness=spread(1e5),
            preload_displacement=spread(1e-3),
            external_force=0.0 if rng.random() < 0.7 else spread(10.0),
        )
        for _ in range(count)
    ]
    links = [
        ss.models.Link(horizontal_stiffness=spread(1e6), vertical_stiffness=spread(1e5))
        for _ in range(count - 1)
    ]
    friction = rng.uniform(0.0, 2.5, count) * (rng.random(count) < 0.95)
    scene = ss.models.chain(
        subsystems,
        links,
        wall_stiffness=spread(1e6),
        friction=friction,
        static_friction=friction * np.where(rng.random(count) < 0.5, 1.0, rng.uniform(1.0, 1.6, count)),
        slider_speed=rng.choice([-1.0, 1.0], count) * 10.0 ** rng.uniform(-3.0, 0.0, count),
        restitution=np.where(rng.random(count) < 0.5, 0.0, rng.uniform(0.0, 0.9, count)),
        damping=0.0 if rng.random() < 0.1 else 10.0 ** rng.uniform(-6.0, -3.5),
        impact_friction=bool(rng.random() < 0.5),
    )
    try:
        start = ss.steady_sliding(scene)
        kick = {name: rng.normal() * 10.0 ** rng.uniform(-4, -1) for name in scene.dofs}
        normal = {f"x{4 * i + 4}" for i in range(count)}
        start = start.perturbed(velocity={name: v for name, v in kick.items() if name not in normal})
        slip = start.velocity[2::4] - np.array([contact.slider_speed for contact in scene.contacts])
        start = ss.State(start.position, start.velocity, "".join("+" if s < 0 else "-" for s in slip))
        ss.simulate(scene, 1e-9, start, max_events=0)
    except ss.InputError:
        # No sliding equilibrium, or the kick leaves tension at a contact.
        start = flight(rng, count)
    return scene, start


def neighbours(shape: str, count: int) -> list[tuple[int, int]]:
    """Return which subsystems of a chain, a grid or a star are tied."""
    if shape == "chain":
        return [(i - 1, i) for i in range(1, count)]
    if shape == "star":
        return [(0, i) for i in range(1, count)]
    side = int(count**0.5)
    return [(i - 1, i) for i in range(count) if i % side] + [(i - side, i) for i in range(side, count)]


def sparse_scene(seed: int, index: int) -> tuple[ss.Scene, ss.State]:
    """Return a sparse scene of masses above and on sliders, tied in a chain, a grid or a star, in flight."""
    rng = np.random.default_rng([seed, index, 6])
    count = int(rng.integers(5, 41))
    # The stiffness of a spring between two dofs, or between one and the ground.
    springs = {}
    for i in range(count):
        x, y, along, normal = range(4 * i, 4 * i + 4)
        for pair in ((x, x), (y, y), (x, along), (y, normal), (along, normal)):
            springs[pair] = 10.0 ** rng.uniform(4.0, 6.0)
    for i, j in neighbours(str(rng.choice(["chain", "grid", "star"])), count):
        springs[4 * i, 4 * j] = 10.0 ** rng.uniform(4.0, 6.0)
        springs[4 * i + 1, 4 * j + 1] = 10.0 ** rng.uniform(4.0, 6.0)
    stiffness = sparse.lil_array((4 * count, 4 * count))
    for (i, j), k in springs.items():
        stiffness[i, i] += k
        if i != j:
            stiffness[j, j] += k
            stiffness[i, j] -= k
            stiffness[j, i] -= k
    stiffness = sparse.csr_array(stiffness)
    rate = float(rng.choice([0.0, 10.0 ** rng.uniform(-6.0, -4.0)]))
    damping = ss.Rayleigh(stiffness=rate) if rng.random() < 0.5 else sparse.csr_array(rate * stiffness)
    kinetic = rng.choice([0.0, 1.0], count, p=[0.1, 0.9]) * rng.uniform(0.1, 1.2, count)
    holding = kinetic * np.where(rng.random(count) < 0.5, 1.0, rng.uniform(1.0, 1.6, count))
    bounces = np.where(rng.random(count) < 0.5, 0.0, rng.uniform(0.0, 0.8, count))
    speeds = rng.choice([-1.0, 1.0], count) * 10.0 ** rng.uniform(-3.0, 0.0, count)
    contacts = [
        ss.Contact(
            tangential=4 * i + 2,
            normal=4 * i + 3,
            friction=kinetic[i],
            static_friction=holding[i],
            slider_speed=speeds[i],
            restitution=bounces[i],
        )
        for i in range(count)
    ]
    force = np.zeros(4 * count)
    force[3::4] = -(10.0 ** rng.uniform(1.0, 3.0, count))
    scene = ss.Scene(
        rng.uniform(0.1, 1.0, 4 * count),
        stiffness,
        damping if rate else None,
        force,
        contacts,
        impact_friction=bool(rng.random() < 0.5),
    )
    return scene, flight(rng, count)


def flight(rng: np.random.Generator, count: int) -> ss.State:
    """All contact masses above their sliders, by up to 1 mm."""
    position = np.zeros(4 * count)
    position[3::4] = 10.0 ** rng.uniform(-5, -3, count)
    return ss.State(position, 0.1 * rng.normal(size=4 * count), "d" * count)
