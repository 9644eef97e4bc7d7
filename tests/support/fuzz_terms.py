"""What the checks need of a scene: matrices, directions, loads, sliders, and its fastest modes."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from scipy import sparse

import stickslip as ss

#: A motion that has decayed by e to this power is below rounding of what it was.
FADED = 45.0


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

    loads: list[ss.Harmonic | ss.Switched] = []
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


def matrices(scene: ss.Scene) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return dense M, C + G and K + H."""

    def dense(matrix: Any) -> np.ndarray:
        return matrix.toarray() if sparse.issparse(matrix) else np.asarray(matrix)

    stiffness = dense(scene.stiffness)
    mass = np.diag(scene.mass) if scene.mass.ndim == 1 else scene.mass
    damping = scene.damping if scene.damping is not None else ss.Rayleigh()
    if isinstance(damping, ss.Rayleigh):
        damping = damping.mass * mass + damping.stiffness * stiffness
    damping = dense(damping)
    if scene.gyroscopic is not None:
        damping = damping + scene.gyroscopic
    return mass, damping, stiffness if scene.circulatory is None else stiffness + scene.circulatory


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
        reduced = ss.equations_of(scene, combination)
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
