"""Random scenes with a known sliding equilibrium, for property tests."""

from dataclasses import dataclass

import numpy as np
from hypothesis import strategies as st

import stickslip as ss


@dataclass(frozen=True)
class Drawn:
    scene: ss.Scene
    #: sliding equilibrium by construction: position, m, and normal forces, N
    equilibrium: np.ndarray
    normal_force: np.ndarray
    rng: np.random.Generator

    def kicked(self, strength=1.0):
        """The sliding equilibrium, set in motion without violating it."""
        scene, rng = self.scene, self.rng
        start = ss.steady_sliding(scene)
        free = scene.size - 2 * len(scene.contacts)
        velocity = np.zeros(scene.size)
        if free:
            velocity[-free:] = strength * rng.uniform(-0.5, 0.5, free)
        for i, contact in enumerate(scene.contacts):
            # Less than the slider speed, so that no slip velocity changes sign.
            direction = scene.tangential_direction(i)
            velocity += direction * contact.slider_speed * rng.uniform(-0.5, 0.5)
        # Dashpots pull at the contacts: weaker until every normal force is compressive.
        while True:
            try:
                scene.core.check_state(start.position, velocity, start.combination)
            except ss.InputError:
                velocity = 0.5 * velocity
            else:
                return start.perturbed(velocity=velocity)

    def lifted(self, strength=1.0):
        """The sliding equilibrium with every contact lifted by micrometres, and the free dofs in motion."""
        scene, rng = self.scene, self.rng
        position = self.equilibrium.copy()
        for i in range(len(scene.contacts)):
            normal = scene.normal_direction(i)
            position += rng.uniform(1e-6, 1e-5) * normal
        velocity = np.zeros(scene.size)
        free = scene.size - 2 * len(scene.contacts)
        velocity[-free:] = strength * rng.uniform(-0.5, 0.5, free)
        return ss.State(position, velocity, "d" * len(scene.contacts))


@st.composite
def drawn_scenes(
    draw,
    restitution=(0.0,),
    max_contacts=2,
    min_friction=0.0,
    max_friction=1.5,
    unsymmetric=False,
    kinds=("both",),
):
    """Spring networks of a few masses, some of them on sliders; contact planes rotated or along dofs.

    With `unsymmetric` they have gyroscopic or circulatory terms, or both. The contacts are of `kinds`: with
    "both" directions, "stop", or "friction" under a given normal force.
    """
    count = draw(st.integers(1, max_contacts), label="contacts")
    free = draw(st.integers(1, 3), label="free dofs")
    rotated = draw(st.booleans(), label="rotated contact planes")
    full_matrices = draw(st.booleans(), label="full mass and damping matrices")
    frictions = [draw(st.floats(min_friction, max_friction), label="friction") for _ in range(count)]
    ratios = [draw(st.floats(1.0, 1.5), label="static over kinetic friction") for _ in range(count)]
    speeds = [
        draw(st.floats(0.01, 0.3), label="speed") * draw(st.sampled_from([-1, 1])) for _ in range(count)
    ]
    bounces = [draw(st.sampled_from(restitution), label="restitution") for _ in range(count)]
    kind = [draw(st.sampled_from(kinds), label="kind") for _ in range(count)]
    terms = draw(st.sampled_from(["G", "H", "GH"]), label="terms") if unsymmetric else ""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1), label="seed"))

    size = 2 * count + free
    # Both directions of a contact move one mass: no contact is coupled to another by mass.
    mass = np.diag(np.concatenate([np.repeat(rng.uniform(0.2, 1.5, count), 2), rng.uniform(0.2, 1.5, free)]))
    if full_matrices:
        coupling = rng.normal(size=(free, free))
        mass[2 * count :, 2 * count :] += 0.05 * coupling @ coupling.T
    stiffness = np.diag(rng.uniform(2e4, 2e5, size))
    for _ in range(2 * size):
        first, second = rng.choice(size, 2, replace=False)
        elongation = np.zeros(size)
        elongation[first], elongation[second] = 1.0, rng.uniform(-1.0, 1.0)
        stiffness += rng.uniform(1e4, 4e5) * np.outer(elongation, elongation)
    damping = ss.Rayleigh(mass=rng.uniform(0.0, 5.0), stiffness=rng.uniform(1e-5, 1e-4))
    if full_matrices:
        dashpots = rng.normal(size=(size, size))
        damping = 5.0 * dashpots @ dashpots.T

    gyroscopic = circulatory = None
    if "G" in terms:
        spinning = rng.normal(size=(size, size))
        gyroscopic = 30.0 * (spinning - spinning.T)
    if "H" in terms:
        circulatory = 2e4 * rng.normal(size=(size, size)) * (rng.random((size, size)) < 0.5)
    whole = stiffness if circulatory is None else stiffness + circulatory

    equilibrium = rng.uniform(-3e-4, 3e-4, size)
    normal_force = rng.uniform(30.0, 200.0, count)
    force = whole @ equilibrium
    contacts = []
    for i in range(count):
        angle = rng.uniform(0.0, 2.0 * np.pi) if rotated else 0.0
        tangential, normal = np.zeros(size), np.zeros(size)
        tangential[2 * i : 2 * i + 2] = np.cos(angle), np.sin(angle)
        normal[2 * i : 2 * i + 2] = -np.sin(angle), np.cos(angle)
        stop, given = kind[i] == "stop", kind[i] == "friction"
        sliding = 0.0 if stop else np.sign(speeds[i]) * frictions[i]
        force -= normal_force[i] * ((not given) * normal + sliding * tangential)
        law = {}
        if not stop:
            law["tangential"] = tangential if rotated else 2 * i
            law |= {"friction": frictions[i], "static_friction": ratios[i] * frictions[i]}
            law["slider_speed"] = speeds[i]
        if given:
            law["normal_force"] = normal_force[i]
        else:
            law["normal"] = normal if rotated else 2 * i + 1
            # A contact at its equilibrium: what is not closed there would be open by default.
            law |= {"restitution": bounces[i], "gap": -float(normal @ equilibrium)}
        contacts.append(ss.Contact(**law))
    scene = ss.Scene(
        mass if full_matrices else np.diag(mass),
        stiffness,
        damping=damping,
        force=force,
        contacts=contacts,
        gyroscopic=gyroscopic,
        circulatory=circulatory,
    )
    return Drawn(scene, equilibrium, normal_force, rng)


def combinations(scene):
    """Combinations of a scene; a contact without friction cannot stick."""

    def allowed(combination):
        pairs = zip(combination, scene.contacts, strict=True)
        return not any(s == "s" and c.static_friction == 0.0 for s, c in pairs)

    return st.text("+-sd", min_size=len(scene.contacts), max_size=len(scene.contacts)).filter(allowed)
