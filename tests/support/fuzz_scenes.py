"""Random scenes for the fuzz campaign: scene i of a seed depends on the two numbers alone."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection
from typing import Any

import numpy as np
from scipy import sparse

import stickslip as ss

#: Parts of the scenes: contacts coupled by mass, and the reference model beside a defective point.
COUPLED, DEFECTIVE = 0.2, 0.1
#: Friction of the reference model at which two modes coalesce.
DEFECTIVE_POINTS = (0.612484152848668518, 1.989108991216879)


#: What the same scenes may have besides.
EXTRAS = {
    "unsymmetric": "gyroscopic and circulatory terms",
    "forced": "loads in time",
    "stops": "stops, friction under given normal forces, and contact directions that depend on each other",
    "laws": "friction over slip speed, where slip has mass",
    "compliant": "contacts with springs",
    "sparse": "chains, grids and stars of 5 to 40 subsystems instead, marched locally and as a whole",
}


def fuzz_scene(seed: int, index: int, extras: Collection[str] = ()) -> tuple[ss.Scene, ss.State]:
    """Return a scene whose contact i has the directions 4 i + 2 and 4 i + 3, and a start state.

    Most are chains; others are the reference model at a random distance from a defective point, or chains
    whose contacts mass couples. With `EXTRAS` the same scenes get further terms or other contacts.
    """
    scene, start = sparse_scene(seed, index) if "sparse" in extras else symmetric_scene(seed, index)
    if "unsymmetric" in extras:
        scene, start = with_unsymmetric_terms(scene, start, seed, index)
    if "forced" in extras:
        scene, start = with_loads(scene, start, seed, index)
    if "stops" in extras:
        scene, start = with_stops(scene, seed, index)
    if "laws" in extras:
        scene, start = with_laws(scene, start, seed, index)
    return with_springs(scene, start, seed, index) if "compliant" in extras else (scene, start)


def with_stops(scene: ss.Scene, seed: int, index: int) -> tuple[ss.Scene, ss.State]:
    """Return a scene with stops, given normal forces and dependent directions, and a state in flight.

    Further contacts are ceilings, stops along the sliders, friction on dofs that have contacts, and pairs of
    dofs that keep apart.
    """
    rng = np.random.default_rng([seed, index, 4])
    start = flight(rng, len(scene.contacts))
    contacts, further = [], []
    for i, contact in enumerate(scene.contacts):
        along, normal = 4 * i + 2, 4 * i + 3
        other = 4 * int(rng.integers(len(scene.contacts))) + 3
        law = {"friction": contact.friction, "slider_speed": contact.slider_speed}
        force = 10.0 ** rng.uniform(-1.0, 2.0)
        restitution = float(rng.choice([0.0, rng.uniform(0.0, 0.8)]))
        clearance = 10.0 ** rng.uniform(-5.0, -3.0)
        match rng.integers(4):
            case 0:
                contacts.append(ss.Contact(normal=normal, restitution=contact.restitution))
            case 1:
                contacts.append(ss.Contact(tangential=along, normal_force=force, **law))
            case _:
                contacts.append(contact)
        match rng.integers(6):
            case 0:
                gap = start.position[normal] + clearance
                further.append(ss.Contact(normal={normal: -1.0}, gap=gap, restitution=restitution))
            case 1:
                side = float(rng.choice([-1.0, 1.0]))
                further.append(ss.Contact(normal={along: side}, gap=clearance, restitution=restitution))
            case 2:
                law["friction"] = rng.uniform(0.1, 1.0)
                further.append(ss.Contact(tangential=along, normal_force=force, **law))
            case 3 if other != normal and scene.mass.ndim == 1:
                further.append(ss.Contact(normal={normal: 1.0, other: -1.0}, gap=2e-3))
    scene = scene.replace(contacts=[*contacts, *further], impact_friction=True)
    slip = contact_directions(scene)[0] @ start.velocity - slider_speeds(scene, np.zeros(1))[0]
    letters = [
        "d" if contact.normal is not None else "+" if s < 0.0 else "-"
        for contact, s in zip(scene.contacts, slip, strict=True)
    ]
    return scene, ss.State(start.position, start.velocity, "".join(letters))


def with_springs(scene: ss.Scene, start: ss.State, seed: int, index: int) -> tuple[ss.Scene, ss.State]:
    """Return a scene most of whose contacts have springs, with a diagonal mass, and a state in flight.

    Where contacts depend on each other, springs may be refused: mass couples them. The scene then has none.
    """
    rng = np.random.default_rng([seed, index, 5])
    contacts = []
    for contact in scene.contacts:
        springs: dict[str, float] = {}
        if rng.random() < 0.8:
            if contact.normal is not None:
                springs |= {"normal_stiffness": 10.0 ** rng.uniform(4.0, 7.0), "restitution": 0.0}
            by_law = isinstance(contact.friction, ss.friction.Law)
            if contact.tangential is not None and not by_law and rng.random() < 0.7:
                springs["tangential_stiffness"] = 10.0 ** rng.uniform(4.0, 7.0)
        contacts.append(dataclasses.replace(contact, **springs))
    mass = np.diag(scene.mass) if scene.mass.ndim == 2 else scene.mass
    try:
        scene = scene.replace(mass=mass, contacts=contacts)
    except ss.InputError as error:
        if "mass couples" not in str(error):
            raise
        return scene, start
    if set(start.combination) <= {"d"} or any(contact.normal is None for contact in contacts):
        return scene, start
    return scene, flight(rng, scene.size // 4)


def with_laws(scene: ss.Scene, start: ss.State, seed: int, index: int) -> tuple[ss.Scene, ss.State]:
    """Return the scene with laws of friction that have its coefficients at the slider speeds, and a start.

    Most weaken with slip speed, the others strengthen. Their slope is as strong as the scene is stiff, at the
    normal forces that its preload makes, or a tenth to ten times that.
    """
    rng = np.random.default_rng([seed, index, 6])
    mass, _, stiffness = matrices(scene)
    rate = np.sqrt((np.abs(stiffness).sum(axis=1) / np.diag(mass)).max())
    tangential, _ = contact_directions(scene)
    contacts = []
    for i, contact in enumerate(scene.contacts):
        holding = contact.holding / contact.friction if contact.friction else 1.0
        law = None
        if contact.friction and rng.random() < 0.85:
            # N mu / (m v) is the rate that the law brings.
            pressed = contact.normal_force or np.abs(scene.force).max()
            inertia = 1.0 / (tangential[i] ** 2 @ (1.0 / np.diag(mass)))
            speed = contact.friction * pressed / (inertia * rate) * 10.0 ** rng.uniform(-1.0, 1.0)
            law = drawn_law(rng, contact.friction, abs(contact.slider_speed), float(speed))
        if law is not None:
            static = None if holding == 1.0 else holding * law.coefficient(0.0)
            contact = dataclasses.replace(contact, friction=law, static_friction=static)
        contacts.append(contact)
    scene = scene.replace(contacts=contacts)
    try:
        ss.simulate(scene, start, 1e-9, max_events=0)
    except ss.InputError:
        # Forces that W couples leave tension at a contact.
        start = flight(rng, scene.size // 4)
    return scene, start


def drawn_law(rng: np.random.Generator, friction: float, slip: float, speed: float) -> ss.friction.Law:
    """Return a law that has a coefficient at a slip speed and changes over another."""
    ratio = rng.uniform(0.4, 1.0) if rng.random() < 0.7 else rng.uniform(1.0, 2.0)
    law: ss.friction.Law
    match rng.integers(4):
        case 0:
            # One that falls reaches 0 at some slip speed, and ends the run.
            slope = rng.uniform(0.0, 1.0) if ratio > 1.0 else -0.01 / max(slip, 0.1)
            return ss.friction.Linear(friction - slope * slip * friction, slope * friction)
        case 1:
            viscous = rng.uniform(0.0, 0.1) if rng.random() < 0.5 else 0.0
            law = ss.friction.Stribeck(1.0, ratio, speed, viscous)
        case 2:
            law = ss.friction.Rational(1.0, ratio, speed)
        case _:
            speeds = np.cumsum([0.0, *rng.uniform(0.1, 1.5, int(rng.integers(2, 6)))])
            falling = ratio + (1.0 - ratio) * np.exp(-speeds)
            values = falling * rng.uniform(0.9, 1.1, speeds.size)
            law = ss.friction.Tabulated((speed * speeds).tolist(), values.tolist())
    factor = friction / law.coefficient(slip)
    match law:
        case ss.friction.Tabulated():
            return ss.friction.Tabulated(law.speeds, [factor * value for value in law.values])
        case ss.friction.Stribeck():
            return ss.friction.Stribeck(factor, factor * ratio, speed, factor * law.viscous)
        case _:
            return ss.friction.Rational(factor, factor * ratio, speed)


def contact_directions(scene: ss.Scene) -> tuple[np.ndarray, np.ndarray]:
    """Return the tangential and the normal directions of all contacts, (c, n) each."""
    both = scene.core.contact_directions()
    return both[0::2], both[1::2]


def plain(scene: ss.Scene) -> bool:
    """Return whether each contact is rigid, on two dofs of its own, and touches where its normal dof is 0."""
    return 4 * len(scene.contacts) == scene.size and not any(
        c.tangential is None or c.normal is None or c.gap or c.normal_stiffness is not None
        for c in scene.contacts
    )


def with_loads(scene: ss.Scene, start: ss.State, seed: int, index: int) -> tuple[ss.Scene, ss.State]:
    """Return a scene under up to three harmonic loads and a switched one, on sliders that may vibrate."""
    rng = np.random.default_rng([seed, index, 3])
    count = len(scene.contacts)
    size = np.abs(scene.force).max() * 10.0 ** rng.uniform(-2.0, 0.5)
    loads: list[ss.Harmonic | ss.Steps] = [
        ss.Harmonic(
            {
                int(dof): size * rng.normal()
                for dof in rng.choice(4 * count, int(rng.integers(1, 4)), replace=False)
            },
            frequency=10.0 ** rng.uniform(1.0, 3.0),
            phase=rng.uniform(-np.pi, np.pi),
        )
        for _ in range(int(rng.integers(1, 4)))
    ]
    if rng.random() < 0.5:
        times = np.sort(rng.uniform(0.0, 0.1, int(rng.integers(1, 4))))
        loads.append(ss.Steps({int(rng.integers(4 * count)): size}, times, rng.normal(size=times.size + 1)))
    contacts = [
        dataclasses.replace(
            contact,
            slider_vibration=ss.Harmonic(
                contact.slider_speed * rng.uniform(0.0, 2.0),
                10.0 ** rng.uniform(1.0, 3.0),
                rng.uniform(0.0, 6.0),
            ),
        )
        if rng.random() < 0.3
        else contact
        for contact in scene.contacts
    ]
    scene = scene.replace(loads=loads, contacts=contacts)
    try:
        ss.simulate(scene, start, 1e-9, max_events=0)
    except ss.InputError:
        # The loads leave tension at a contact, or a slider that vibrates slips the other way.
        start = flight(rng, count)
    return scene, start


def flight(rng: np.random.Generator, count: int) -> ss.State:
    """All contact masses above their sliders, by up to 1 mm."""
    position = np.zeros(4 * count)
    position[3::4] = 10.0 ** rng.uniform(-5, -3, count)
    return ss.State(position, 0.1 * rng.normal(size=4 * count), "d" * count)


def forces(scene: ss.Scene, times: np.ndarray) -> np.ndarray:
    """Return F with the loads at some times, (k, n)."""
    total = np.tile(scene.force, (np.size(times), 1))
    for load in scene.loads:
        if isinstance(load, ss.Harmonic):
            factor = np.cos(2.0 * np.pi * load.frequency * times + load.phase)
        else:
            factor = np.asarray(load.values)[np.searchsorted(load.times, times, side="right")]
        for dof, entry in load.amplitude.items():
            total[:, dof] += entry * factor
    return total


def slider_speeds(scene: ss.Scene, times: np.ndarray) -> np.ndarray:
    """Return the speeds of the sliders at some times, (k, c)."""
    speeds = np.tile([contact.slider_speed for contact in scene.contacts], (np.size(times), 1)).astype(float)
    for i, contact in enumerate(scene.contacts):
        wave = contact.slider_vibration
        if wave is not None:
            speeds[:, i] += wave.amplitude * np.cos(2.0 * np.pi * wave.frequency * times + wave.phase)
    return speeds


def from_time(scene: ss.Scene, begin: float) -> ss.Scene:
    """Return the scene whose loads at 0 are those of this one at a time."""

    def later(wave: ss.Harmonic) -> ss.Harmonic:
        return dataclasses.replace(wave, phase=wave.phase + 2.0 * np.pi * wave.frequency * begin)

    loads: list[ss.Harmonic | ss.Steps] = []
    for load in scene.loads:
        if isinstance(load, ss.Harmonic):
            loads.append(later(load))
        else:
            past = int(np.searchsorted(load.times, begin, side="right"))
            times = [time - begin for time in load.times[past:]]
            loads.append(dataclasses.replace(load, times=times, values=load.values[past:]))
    contacts = [
        contact
        if contact.slider_vibration is None
        else dataclasses.replace(contact, slider_vibration=later(contact.slider_vibration))
        for contact in scene.contacts
    ]
    return scene.replace(loads=loads, contacts=contacts) if begin and (loads or contacts) else scene


def load_rate(scene: ss.Scene) -> float:
    """Return the fastest rate of a load or slider, 1/s."""
    waves = [load.frequency for load in scene.loads if isinstance(load, ss.Harmonic)]
    waves += [c.slider_vibration.frequency for c in scene.contacts if c.slider_vibration is not None]
    return 2.0 * np.pi * max(waves, default=0.0)


def with_unsymmetric_terms(
    scene: ss.Scene, start: ss.State, seed: int, index: int
) -> tuple[ss.Scene, ss.State]:
    """Return a scene with G, H or both, as large as a part of its other terms, and a start state."""
    rng = np.random.default_rng([seed, index, 2])
    mass, _, stiffness = matrices(scene)
    size = np.sqrt(np.outer(np.diag(stiffness), np.diag(stiffness)))
    rate = np.sqrt(size * np.sqrt(np.outer(np.diag(mass), np.diag(mass))))
    kind = rng.integers(3)
    terms = {}
    if kind != 1:
        spinning = np.triu(rng.normal(size=size.shape) * (rng.random(size.shape) < 0.3), 1)
        spinning *= 10.0 ** rng.uniform(-3.0, 0.0) * rate
        terms["gyroscopic"] = spinning - spinning.T
    if kind != 0:
        following = rng.normal(size=size.shape) * (rng.random(size.shape) < 0.3)
        terms["circulatory"] = 10.0 ** rng.uniform(-3.0, -1.0) * size * following
    scene = scene.replace(**terms)
    try:
        ss.simulate(scene, start, 1e-9, max_events=0)
    except ss.InputError:
        # The terms leave tension at a contact.
        count = len(scene.contacts)
        start = flight(rng, count)
    return scene, start


def symmetric_scene(seed: int, index: int) -> tuple[ss.Scene, ss.State]:
    """Return the scene without these terms."""
    rng = np.random.default_rng([seed, index, 1])
    kind = rng.random()
    if kind < DEFECTIVE:
        return near_defective(rng)
    if kind < DEFECTIVE + COUPLED:
        return coupled_by_mass(rng)
    return chain(seed, index)


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
    damping = ss.Proportional(stiffness=rate) if rng.random() < 0.5 else sparse.csr_array(rate * stiffness)
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
        start = ss.sliding_equilibrium(scene).perturbed(velocity=kick)
        ss.simulate(scene, start, 1e-9, max_events=0)
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
        start = ss.sliding_equilibrium(scene)
        kick = {name: rng.normal() * 10.0 ** rng.uniform(-4, -1) for name in scene.dofs}
        normal = {f"x{4 * i + 4}" for i in range(count)}
        start = start.perturbed(velocity={name: v for name, v in kick.items() if name not in normal})
        slip = start.velocity[2::4] - np.array([contact.slider_speed for contact in scene.contacts])
        start = ss.State(start.position, start.velocity, "".join("+" if s < 0 else "-" for s in slip))
        ss.simulate(scene, start, 1e-9, max_events=0)
    except ss.InputError:
        # No sliding equilibrium, or the kick leaves tension at a contact.
        start = flight(rng, count)
    return scene, start


def matrices(scene: ss.Scene) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return dense M, C + G and K + H."""

    def dense(matrix: Any) -> np.ndarray:
        return matrix.toarray() if sparse.issparse(matrix) else np.asarray(matrix)

    stiffness = dense(scene.stiffness)
    mass = np.diag(scene.mass) if scene.mass.ndim == 1 else scene.mass
    damping = scene.damping if scene.damping is not None else ss.Proportional()
    if isinstance(damping, ss.Proportional):
        damping = damping.mass * mass + damping.stiffness * stiffness
    damping = dense(damping)
    if scene.gyroscopic is not None:
        damping = damping + scene.gyroscopic
    return mass, damping, stiffness if scene.circulatory is None else stiffness + scene.circulatory


#: A motion that has decayed by e to this power is below rounding of what it was.
FADED = 45.0


def fastest(scene: ss.Scene, combinations: list[str]) -> tuple[np.ndarray, np.ndarray]:
    """Return the stages of a phase in each combination, (combinations, 2n) each.

    Local times, ascending, at which another mode has died out, s, the last of them infinite; and the largest
    modulus of an eigenvalue up to then, 1/s. Coordinates that a combination holds only add zeros.
    """
    if not plain(scene):
        return fastest_of_modes(scene, combinations)
    mass, damping, stiffness = matrices(scene)
    size = scene.size
    reduced = np.empty((len(combinations), 2, size, size))
    for k, combination in enumerate(combinations):
        every = np.stack([stiffness, damping, mass])
        whole = every.copy()
        held = []
        for i, (letter, contact) in enumerate(zip(combination, scene.contacts, strict=True)):
            t, n = 4 * i + 2, 4 * i + 3
            if letter in "+-":
                factor = contact.coefficient() if letter == "-" else -contact.coefficient()
                every[:, t] += factor * whole[:, n]
            held += {"d": [], "s": [t, n]}.get(letter, [n])
        every[:, held] = 0.0
        every[:, :, held] = 0.0
        every[2, held, held] = 1.0
        reduced[k] = np.linalg.solve(every[2], every[:2])
    if scene.unsymmetric:
        state = np.zeros((len(combinations), 2 * size, 2 * size))
        state[:, :size, size:] = np.eye(size)
        state[:, size:, :size], state[:, size:, size:] = -reduced[:, 0], -reduced[:, 1]
        values = np.linalg.eigvals(state).astype(complex)
    else:
        kappa = np.linalg.eigvals(reduced[:, 0]).astype(complex)
        half = 0.5 * (scene.damping.mass + scene.damping.stiffness * kappa)
        root = np.sqrt(half**2 - kappa)
        values = np.concatenate([-half + root, -half - root], axis=1)
    # A root near zero of a stiff pair is lost in the difference; it only ends stages.
    with np.errstate(divide="ignore"):
        fades = np.where(values.real < 0.0, FADED / -values.real, np.inf)
    order = np.argsort(fades, axis=1)
    sizes = np.maximum(np.abs(values), load_rate(scene))
    fades, rates = (np.take_along_axis(a, order, axis=1) for a in (fades, sizes))
    fades[:, -1] = np.inf
    return fades, np.maximum.accumulate(rates[:, ::-1], axis=1)[:, ::-1]


def fastest_of_modes(scene: ss.Scene, combinations: list[str]) -> tuple[np.ndarray, np.ndarray]:
    """Return the same by the reduced matrices of the program, without the slopes of laws."""
    constant = [
        dataclasses.replace(contact, friction=contact.coefficient(), static_friction=None)
        for contact in scene.contacts
    ]
    scene = scene.replace(contacts=constant)
    fades = np.full((len(combinations), 2 * scene.size), np.inf)
    rates = np.full((len(combinations), 2 * scene.size), load_rate(scene))
    for k, combination in enumerate(combinations):
        reduced = ss.reduce(scene, combination)
        m = reduced.stiffness.shape[0]
        state = np.zeros((2 * m, 2 * m))
        state[:m, m:] = np.eye(m)
        state[m:, :m] = -np.linalg.solve(reduced.mass, reduced.stiffness)
        state[m:, m:] = -np.linalg.solve(reduced.mass, reduced.damping)
        values = np.linalg.eigvals(state).astype(complex)
        with np.errstate(divide="ignore"):
            own = np.where(values.real < 0.0, FADED / -values.real, np.inf)
        order = np.argsort(own)
        # What a combination holds fades at once.
        held = 2 * (scene.size - m)
        fades[k, :held] = 0.0
        fades[k, held:] = own[order]
        rates[k, held:] = np.maximum(rates[k, held:], np.abs(values)[order])
    fades[:, -1] = np.inf
    return fades, np.maximum.accumulate(rates[:, ::-1], axis=1)[:, ::-1]
