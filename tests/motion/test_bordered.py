"""Series of scenes whose stiffness couples coordinates through contacts alone, beside other ways."""

import dataclasses

import numpy as np
import pytest

import stickslip as ss
from quad_block import reduced_block
from scene_forms import compare_motions, in_matrices

#: Of the damping, 1/s and s.
ALPHA, BETA = 40.0, 1e-7


def kicked(scene):
    return ss.sliding_equilibrium(scene).perturbed(velocity={scene.dofs[0]: 0.5})


def lumped():
    return reduced_block(20, 8, 5, 40)


def coupled():
    """Return a model whose contacts mass couples, with its modes apart."""
    scene = lumped()
    mass = np.diag(np.asarray(scene.mass, dtype=float))
    contacts = len(scene.contacts)
    for part in (slice(0, contacts), slice(contacts, 2 * contacts)):
        mass[part, part] += 0.1 * mass[0, 0]
    return scene.replace(mass=mass, impact_friction=True)


def with_static_friction(scene):
    return scene.replace(static_friction=0.5, restitution=[0.3 * (k % 2) for k in range(len(scene.contacts))])


def under_loads(scene):
    """Return the scene with loads on a mode and a contact, of two frequencies, and one that is switched."""
    contact, mode = scene.dofs[0], scene.dofs[-1]
    loads = [
        ss.Harmonic({mode: 20.0, contact: 0.5}, frequency=3e3, phase=0.3),
        ss.Harmonic({scene.dofs[-2]: 8.0}, frequency=2.5e4),
        ss.Steps({mode: 5.0}, [2e-4, 5e-4], [0.0, 1.0, -1.0]),
    ]
    return scene.replace(loads=loads)


SCENES = {
    "lumped": lumped,
    "lumped, under loads": lambda: under_loads(lumped()),
    "coupled, under loads": lambda: under_loads(coupled()),
    "coupled": coupled,
    "static friction and restitution": lambda: with_static_friction(lumped()),
    "coupled, with static friction and restitution": lambda: with_static_friction(coupled()),
}


def in_single_modes(scene):
    """Return the scene with dampers on its modes and between its contacts, with the border and without it."""
    contacts = 2 * len(scene.contacts)
    stiffness = np.array(scene.stiffness, dtype=float)
    damping = np.diag(np.sqrt(stiffness.diagonal()) * np.linspace(0.01, 0.05, len(scene.dofs)))
    damping[:contacts, :contacts] = BETA * stiffness[:contacts, :contacts]
    # Too weak to be seen.
    stiffness[-2, -1] = stiffness[-1, -2] = 1e-12
    return scene.replace(damping=damping), scene.replace(damping=damping, stiffness=stiffness)


@pytest.mark.parametrize("name", SCENES)
def test_the_same_events_as_without_the_border(name):
    scene = SCENES[name]().replace(damping=ss.Proportional(mass=ALPHA, stiffness=BETA))
    alike(scene, in_matrices(scene))


@pytest.mark.parametrize("loaded", [False, True])
@pytest.mark.parametrize("model", [lumped, coupled])
def test_the_same_events_with_dampers_on_single_modes(model, loaded):
    alike(*in_single_modes(under_loads(model()) if loaded else model()))


def compliant(which, **springs):
    """Return a model with springs at some contacts, as parts of what its first contact feels of K."""
    scene = lumped().replace(damping=ss.Proportional(mass=ALPHA, stiffness=BETA))
    felt = float(np.asarray(scene.stiffness)[0, 0])
    springs = {direction: felt * part for direction, part in springs.items()}
    contacts = [
        dataclasses.replace(contact, **springs) if which(k) else contact
        for k, contact in enumerate(scene.contacts)
    ]
    return scene.replace(contacts=contacts)


COMPLIANT = {
    "both directions": lambda: compliant(lambda k: True, normal_stiffness=10.0, tangential_stiffness=7.0),
    "beside rigid ones": lambda: compliant(lambda k: k % 2, normal_stiffness=0.3, tangential_stiffness=0.2),
    "normal only": lambda: compliant(lambda k: k % 2 == 0, normal_stiffness=0.3),
    "under loads": lambda: under_loads(
        compliant(lambda k: k != 2, normal_stiffness=10.0, tangential_stiffness=7.0)
    ),
}


def struck(scene):
    """Return the start of a motion with contacts that open and stick."""
    return ss.sliding_equilibrium(scene).perturbed(velocity=dict.fromkeys(scene.dofs[:3], -3.0))


@pytest.mark.parametrize("name", COMPLIANT)
def test_the_same_events_with_compliant_contacts(name):
    scene = COMPLIANT[name]()
    alike(scene, in_matrices(scene), struck(scene))


def test_compliant_contacts_belong_to_the_border():
    """What the border serves is bounded by the norm of M, in which panels are longer."""
    scene = COMPLIANT["beside rigid ones"]()
    runs = [ss.simulate(which, struck(scene), 2e-3, "taylor") for which in (scene, in_matrices(scene))]
    assert runs[0].counters["panels"] < runs[1].counters["panels"]
    assert runs[0].counters["taylor_phases"] == runs[1].counters["taylor_phases"]


def alike(scene, without, start=None):
    """Expect of the scene by series and by modes what another form of it does by series."""
    bounds = {"time_error": 1e-11, "sample_error": 1e-9, "near_share": 0.99}
    assert compare_motions(scene, without, start or kicked(scene), events=100, **bounds) == 100


def test_panels_are_not_shorter_than_without_the_border():
    """The norm of M is nearer to the fastest mode than row sums are."""
    scene = lumped().replace(damping=ss.Proportional(mass=ALPHA, stiffness=BETA))
    runs = [ss.simulate(which, kicked(scene), 2e-3, "taylor") for which in (scene, in_matrices(scene))]
    assert runs[0].counters["panels"] <= runs[1].counters["panels"]
    assert runs[0].counters["taylor_phases"] == runs[1].counters["taylor_phases"]
