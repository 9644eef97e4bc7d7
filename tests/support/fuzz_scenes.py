"""Random scenes for the fuzz campaign: scene i of a seed depends on the two numbers alone."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection
from functools import partial

import numpy as np

import stickslip as ss
from fuzz_chains import flight, sparse_scene, symmetric_scene
from fuzz_terms import contact_directions, matrices, slider_speeds
from stickslip.scene.laws.friction import FrictionLaw

#: m/s; about the speed at which contacts close.
CLOSING = 0.1
#: What the same scenes may have besides.
EXTRAS = {
    "unsymmetric": "gyroscopic and circulatory terms",
    "forced": "loads in time",
    "stops": "stops, friction under given normal forces, and contact directions that depend on each other",
    "laws": "friction over slip speed",
    "compliant": "contacts with springs",
    "tables": "friction over slip speed by tables only",
    "vanishing": "friction over slip speed that is 0 at rest, so that nothing sticks",
    "elements": "nonlinear springs and dampers",
    "twins": "a second half tied to the first, which moves alike: all events come in pairs",
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
    if kinds := [kind for kind in LAWS if kind in extras]:
        scene, start = with_laws(scene, start, seed, index, kinds[-1])
    if "elements" in extras:
        scene, start = with_elements(scene, start, seed, index)
    return with_springs(scene, start, seed, index) if "compliant" in extras else (scene, start)


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
        ss.simulate(scene, 1e-9, start, max_events=0)
    except ss.InputError:
        # The terms leave tension at a contact.
        count = len(scene.contacts)
        start = flight(rng, count)
    return scene, start


def with_loads(scene: ss.Scene, start: ss.State, seed: int, index: int) -> tuple[ss.Scene, ss.State]:
    """Return a scene under up to three harmonic loads and a switched one, on sliders that may vibrate."""
    rng = np.random.default_rng([seed, index, 3])
    count = len(scene.contacts)
    size = np.abs(scene.force).max() * 10.0 ** rng.uniform(-2.0, 0.5)
    loads: list[ss.Harmonic | ss.Switched] = [
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
        loads.append(
            ss.Switched({int(rng.integers(4 * count)): size}, times, rng.normal(size=times.size + 1))
        )
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
        ss.simulate(scene, 1e-9, start, max_events=0)
    except ss.InputError:
        # The loads leave tension at a contact, or a slider that vibrates slips the other way.
        start = flight(rng, count)
    return scene, start


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


def with_laws(
    scene: ss.Scene, start: ss.State, seed: int, index: int, kind: str
) -> tuple[ss.Scene, ss.State]:
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
            law = LAWS[kind](rng, contact.friction, abs(contact.slider_speed), float(speed))
        if law is not None:
            at_rest = law.coefficient(0.0)
            static = None if holding == 1.0 or at_rest == 0.0 else holding * at_rest
            contact = dataclasses.replace(contact, friction=law, static_friction=static)
        contacts.append(contact)
    scene = scene.replace(contacts=contacts)
    try:
        ss.simulate(scene, 1e-9, start, max_events=0)
    except ss.InputError:
        # Forces that W couples leave tension at a contact.
        start = flight(rng, scene.size // 4)
    return scene, start


def drawn_law(
    rng: np.random.Generator, friction: float, slip: float, speed: float, table: bool = False
) -> FrictionLaw:
    """Return a law that has a coefficient at a slip speed and changes over another."""
    ratio = rng.uniform(0.4, 1.0) if rng.random() < 0.7 else rng.uniform(1.0, 2.0)
    law: FrictionLaw
    match 3 if table else rng.integers(4):
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


def drawn_vanishing_law(rng: np.random.Generator, friction: float, slip: float, speed: float) -> FrictionLaw:
    """Return a law that is 0 at rest, has a coefficient at a slip speed of about another, and is no line.

    What would stick creeps instead, at a rate of about N mu / (m v), 1/s: a small v is a stiff motion.
    """
    speed = max(speed, 0.02 * max(slip, CLOSING))
    at = max(slip, speed)
    match rng.integers(4):
        case 0:
            return ss.friction.Law(lambda s, a=friction, v=speed: a * np.tanh(s / v))
        case 1:
            return ss.friction.Law(lambda s, a=friction, v=at: a * (s / v) ** 2 / (1.0 + (s / v) ** 2))
        case 2:
            return ss.friction.Stribeck(0.0, friction, speed, rng.uniform(0.0, 0.1) * friction / at)
        case _:
            speeds = np.cumsum([0.0, *rng.uniform(0.1, 1.5, int(rng.integers(2, 6)))])
            values = friction * np.tanh(speeds) * rng.uniform(0.9, 1.1, speeds.size)
            return ss.friction.Tabulated((speed * speeds).tolist(), values.tolist())


#: How each kind of law is drawn.
LAWS = {"laws": drawn_law, "tables": partial(drawn_law, table=True), "vanishing": drawn_vanishing_law}


def with_elements(scene: ss.Scene, start: ss.State, seed: int, index: int) -> tuple[ss.Scene, ss.State]:
    """Return the scene with up to four springs and dampers, as strong as its others at motions of some size.

    Where elements are not computed the scene stays as it is.
    """
    rng = np.random.default_rng([seed, index, 8])
    mass, _, stiffness = matrices(scene)
    rate = np.sqrt((np.diag(stiffness) / np.diag(mass)).max())
    size = max(np.abs(start.position).max(), np.abs(start.velocity).max() / rate, 1e-4)
    found: list[ss.Spring | ss.Damper] = []
    for _ in range(int(rng.integers(1, 5))):
        chosen = rng.choice(scene.size, int(rng.integers(1, 3)), replace=False).tolist()
        direction = dict(zip(chosen, (1.0, -rng.uniform(0.5, 1.0)), strict=False))
        length = size * 10.0 ** rng.uniform(-1.0, 0.5)
        k = np.diag(stiffness).mean() * 10.0 ** rng.uniform(-2.0, 0.0)
        if rng.random() < 0.25:
            speed, c = length * rate, k / rate * 10.0 ** rng.uniform(-1.5, 0.0)
            found.append(ss.Damper(direction, ss.spring.Polynomial(0.3 * c, 0.0, c / speed**2)))
            continue
        law: ss.spring.Law | ss.spring.Gap | ss.spring.Polynomial | ss.spring.Tabulated
        match rng.integers(4):
            case 0:
                law = ss.spring.Polynomial(k, rng.uniform(-1.0, 1.0) * k / length, k / length**2)
            case 1:
                law = ss.spring.Law(lambda u, k=k, scale=length: k * scale * np.tanh(u / scale))
            case 2:
                law = ss.spring.Gap(k, rng.uniform(-1.0, 1.0) * length)
            case _:
                places = np.cumsum(rng.uniform(0.2, 1.0, 5))
                forces = np.cumsum(rng.uniform(0.0, 1.5, 5))
                law = ss.spring.Tabulated(length * (places - places[2]), k * length * (forces - forces[2]))
        found.append(ss.Spring(direction, law, rng.uniform(-0.5, 0.5) * length))
    try:
        scene = scene.replace(elements=found)
    except ss.InputError as error:
        if "not computed beside" not in str(error):
            raise
        return scene, start
    try:
        ss.simulate(scene, 1e-9, start, max_events=0)
    except ss.InputError:
        # The springs leave tension at a contact.
        start = flight(rng, scene.size // 4)
    return scene, start


def with_springs(scene: ss.Scene, start: ss.State, seed: int, index: int) -> tuple[ss.Scene, ss.State]:
    """Return a scene most of whose contacts have springs, with a diagonal mass, and a state in flight.

    Where contacts depend on each other, springs may be refused: mass couples them. The scene then has none.
    Under a law that rises, friction acts on springs too.
    """
    rng, by_laws = (np.random.default_rng([seed, index, stream]) for stream in (5, 7))
    contacts = []
    for contact in scene.contacts:
        springs: dict[str, float] = {}
        if rng.random() < 0.8:
            if contact.normal is not None:
                springs |= {"normal_stiffness": 10.0 ** rng.uniform(4.0, 7.0), "restitution": 0.0}
            by_law = isinstance(contact.friction, FrictionLaw)
            if contact.tangential is not None and not by_law and rng.random() < 0.7:
                springs["tangential_stiffness"] = 10.0 ** rng.uniform(4.0, 7.0)
            if by_law and rises(contact):
                # Its node relaxes at k / (mu' N), and a panel covers about twelve relaxation times.
                speed = abs(contact.slider_speed)
                rise = contact.coefficient(1.01 * speed) - contact.coefficient(0.99 * speed)
                pressed = contact.normal_force or np.abs(scene.force).max()
                stiffness = pressed * 10.0 ** by_laws.uniform(2.0, 4.5)
                if contact.normal is not None:
                    # A time t after it closes N is N' t: k / (12 mu' N') panels reach to e t.
                    growth = CLOSING * springs["normal_stiffness"]
                    stiffness = min(stiffness, growth * 10.0 ** by_laws.uniform(1.0, 3.0))
                springs["tangential_stiffness"] = float(stiffness * rise / (0.02 * speed))
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


def rises(contact: ss.Contact) -> bool:
    """Return whether slip without mass may follow the law of a contact, from steady sliding on."""
    given = {"normal_force": 1.0, "friction": contact.friction, "slider_speed": contact.slider_speed}
    try:
        node = ss.Contact(tangential=0, tangential_stiffness=1.0, **given)
        ss.complex_modes(ss.Scene([1.0], [[1.0]], contacts=[node]))
    except ss.InputError:
        return False
    return True
