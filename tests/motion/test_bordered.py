"""Series of scenes whose stiffness couples coordinates through contacts alone, beside other ways."""

import dataclasses

import numpy as np
import pytest

import stickslip as ss
from nightly import nightly
from quad_block import free_block, quad_block, reduced_block
from scene_forms import compare_motions, in_matrices

#: Of the damping, 1/s and s.
ALPHA, BETA = 40.0, 1e-7


def kicked(scene):
    return ss.steady_sliding(scene).perturbed(velocity={scene.dofs[0]: 0.5})


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
        ss.Switched({mode: 5.0}, [2e-4, 5e-4], [0.0, 1.0, -1.0]),
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
    scene = SCENES[name]().replace(damping=ss.Rayleigh(mass=ALPHA, stiffness=BETA))
    alike(scene, in_matrices(scene))


@pytest.mark.parametrize("loaded", [False, True])
@pytest.mark.parametrize("model", [lumped, coupled])
def test_the_same_events_with_dampers_on_single_modes(model, loaded):
    alike(*in_single_modes(under_loads(model()) if loaded else model()))


def compliant(which, **springs):
    """Return a model with springs at some contacts, as parts of what its first contact feels of K."""
    scene = lumped().replace(damping=ss.Rayleigh(mass=ALPHA, stiffness=BETA))
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
    return ss.steady_sliding(scene).perturbed(velocity=dict.fromkeys(scene.dofs[:3], -3.0))


@pytest.mark.parametrize("name", nightly(COMPLIANT, ("beside rigid ones", "under loads").__contains__))
def test_the_same_events_with_compliant_contacts(name):
    scene = COMPLIANT[name]()
    alike(scene, in_matrices(scene), struck(scene))


def test_compliant_contacts_belong_to_the_border():
    """What the border serves is bounded by the norm of M, in which panels are longer."""
    scene = COMPLIANT["beside rigid ones"]()
    runs = [ss.simulate(which, 2e-3, struck(scene), method="taylor") for which in (scene, in_matrices(scene))]
    assert runs[0].counters["panels"] < runs[1].counters["panels"]
    assert runs[0].counters["taylor_phases"] == runs[1].counters["taylor_phases"]


def on_modes():
    """Return modes of a free block on compliant contacts, each of which moves all of them."""
    scene = free_block(20, 8, 5, 40)
    felt = float(np.asarray(scene.stiffness)[-1, -1] / np.sum(np.square(scene.contacts[0].normal)))
    springs = {"normal_stiffness": 0.2 * felt, "tangential_stiffness": 0.1 * felt}
    contacts = [dataclasses.replace(contact, **springs) for contact in scene.contacts]
    return scene.replace(contacts=contacts, damping=ss.Rayleigh(mass=ALPHA, stiffness=BETA))


def held_without_mass():
    """Return modes with held contacts, at which nothing has mass."""
    scene = lumped()
    mass = np.array(scene.mass, dtype=float)
    mass[: 2 * len(scene.contacts)] = 0.0
    return scene.replace(mass=mass, damping=ss.Rayleigh(mass=ALPHA, stiffness=BETA))


def free_without_mass():
    """Return modes of the free structure and its residual flexibility."""
    scene = quad_block(20, 8, 4, lumped=False, sparse=True)
    reduced = ss.fe.reduce(scene, (1e3, 60e3), "massless", combination="++++++", modes=60).scene
    return reduced.replace(damping=ss.Rayleigh(mass=ALPHA, stiffness=BETA))


def shaken(scene):
    """Return the scene with loads on a mode and a dof without mass, and a slider that vibrates."""
    loads = [*under_loads(scene).loads, ss.Harmonic({scene.dofs[1]: 0.3}, frequency=4e3)]
    return scene.replace(loads=loads)


WITHOUT_MASS = {
    "compliant contacts on modes": on_modes,
    "modes with held contacts": held_without_mass,
    "modes of the free structure": free_without_mass,
    "held contacts under loads": lambda: shaken(held_without_mass()),
    "free structure under loads": lambda: shaken(free_without_mass()),
    "static friction": lambda: free_without_mass().replace(static_friction=0.45),
}
#: Those of a free structure, which take longest.
FREE = ("modes of the free structure", "free structure under loads", "static friction")


def in_full(scene):
    """Return the scene with dampers between its modes that are too weak to be seen, which no border has."""
    mass, stiffness = np.asarray(scene.mass, dtype=float), np.asarray(scene.stiffness, dtype=float)
    mass = mass if mass.ndim == 1 else mass.diagonal()
    edge, inner = np.flatnonzero(mass == 0.0), np.flatnonzero(mass)
    followed = np.linalg.solve(stiffness[np.ix_(edge, edge)], stiffness[np.ix_(edge, inner)])
    felt = stiffness[np.ix_(inner, inner)] - stiffness[np.ix_(inner, edge)] @ followed
    damping = np.zeros(stiffness.shape)
    damping[np.ix_(inner, inner)] = scene.damping.stiffness * 0.5 * (felt + felt.T)
    damping += np.diag(scene.damping.mass * mass)
    damping[[-2, -1], [-1, -2]] += 1e-12 * damping[-1, -1]
    return scene.replace(damping=damping)


def loosened(scene):
    """Return the start of a motion with contacts that open: fast modes are struck."""
    return ss.steady_sliding(scene).perturbed(velocity=dict.fromkeys(scene.dofs[-20:-10:5], 0.02))


@pytest.mark.parametrize("name", nightly(WITHOUT_MASS, FREE.__contains__))
def test_the_same_events_with_dofs_without_mass(name):
    scene = WITHOUT_MASS[name]()
    alike(scene, in_full(scene), loosened(scene))


@pytest.mark.parametrize("name", WITHOUT_MASS)
def test_dofs_without_mass_belong_to_the_border(name):
    """What the border serves is bounded by the norm of M, and not by row sums."""
    scene = WITHOUT_MASS[name]()
    runs = [
        ss.simulate(which, 1.0, loosened(scene), method="taylor", max_events=50)
        for which in (scene, in_full(scene))
    ]
    assert runs[0].counters["panels"] != runs[1].counters["panels"]
    assert runs[0].counters["taylor_phases"] == runs[1].counters["taylor_phases"]


def alike(scene, without, start=None):
    """Expect of the scene by series and by modes what another form of it does by series."""
    bounds = {"time_error": 1e-11, "sample_error": 1e-9, "near_share": 0.99}
    assert compare_motions(scene, without, start or kicked(scene), events=100, **bounds) == 100


def test_panels_are_not_shorter_than_without_the_border():
    """The norm of M is nearer to the fastest mode than row sums are."""
    scene = lumped().replace(damping=ss.Rayleigh(mass=ALPHA, stiffness=BETA))
    runs = [ss.simulate(which, 2e-3, kicked(scene), method="taylor") for which in (scene, in_matrices(scene))]
    assert runs[0].counters["panels"] <= runs[1].counters["panels"]
    assert runs[0].counters["taylor_phases"] == runs[1].counters["taylor_phases"]
