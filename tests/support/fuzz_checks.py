"""What must hold of every run of the fuzz campaign."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

import stickslip as ss
from fuzz_events import NOISE, at_rest
from fuzz_samples import Sampled
from fuzz_terms import contact_directions, forces, matrices, plain, slider_speeds
from stickslip.scene.laws.friction import FrictionLaw

#: Rounding of a state: some hundred ulp, the limit of the condition of modes, over some dozens of phases.
SLACK = 3e-12
#: The same of a sum of modes of the largest condition, some hundred, which is lost twice.
SUPERPOSED = 2e-11
#: Part of the energy of a state below which works are not balanced: a state is known to some hundred ulp.
BALANCED = 1e-4
#: Phases that add as much to that: each rounds the state by an ulp or two.
PHASES = 300


def continuity(run: ss.Trajectory) -> str:
    """Return at which event positions jump, or ``""``.

    By more than what velocities make of four ulp of time, and rounding: modes at the limit of their condition
    leave `SUPERPOSED` of the displacements, and some `NOISE` of those `at_rest` about which they move.
    """
    time = np.unique(run.events.time)
    time = time[(time > 0.0) & (time < run.duration)]
    before, after = (run.sample(np.nextafter(time, side)) for side in (0.0, np.inf))
    size = np.maximum(np.abs(before.position.values), np.abs(after.position.values)).max(axis=1)
    speed = np.maximum(np.abs(before.velocity.values), np.abs(after.velocity.values)).max(axis=1)
    jump = np.abs(after.position.values - before.position.values).max(axis=1)
    rounding = SUPERPOSED * size + 16.0 * NOISE * at_rest(run.scene)
    wrong = jump > rounding + 4.0 * np.spacing(time) * speed
    if not wrong.any():
        return ""
    k = int(np.argmax(wrong))
    return f"a position jumps by {jump[k]:.2e} m at {float(time[k])!r} s"


def coefficients(contacts: Sequence[ss.Contact], slip: np.ndarray) -> np.ndarray:
    """Return mu of all contacts at slip velocities, (k, c)."""

    def column_of(contact: ss.Contact, speeds: np.ndarray) -> np.ndarray:
        law = contact.friction
        if isinstance(law, ss.friction.Tabulated):
            return cubics(law)(np.minimum(speeds, law.speeds[-1]))
        if isinstance(law, FrictionLaw):
            return np.fromiter(map(contact.coefficient, speeds), float, speeds.size)
        return np.full(speeds.size, law)

    columns = zip(contacts, np.abs(slip).T, strict=True)
    return np.stack([column_of(contact, speeds) for contact, speeds in columns], axis=1)


@lru_cache(maxsize=64)
def cubics(law: ss.friction.Tabulated) -> CubicHermiteSpline:
    """Return the monotone cubics of a table, level at its end; the law, which they check, has its own."""
    slopes = PchipInterpolator(law.speeds, law.values).derivative()(law.speeds)
    slopes[-1] = 0.0
    return CubicHermiteSpline(law.speeds, law.values, slopes)


def complementarity(sampled: Sampled) -> str:
    """Return where g >= 0, N >= 0, the friction cone or slip against friction fails, or ``""``.

    Between events, to rounding of the terms.
    """
    data, scene = sampled.between, sampled.run.scene
    position, velocity, normal, friction = data.position, data.velocity, data.normal, data.friction
    _, damping, stiffness = (np.abs(matrix) for matrix in sampled.matrices)
    stated = np.abs(forces(scene, data.time))
    load = np.abs(position) @ stiffness.T + np.abs(velocity) @ damping.T + stated
    length = SLACK * np.abs(position).max(initial=0.0)
    contacts = scene.contacts
    tangential, directed = contact_directions(scene)
    static = np.array([contact.holding for contact in contacts])
    slider = slider_speeds(scene, data.time)
    force = SLACK * load @ (np.abs(tangential) + np.abs(directed)).T
    speed = SLACK * np.maximum(np.abs(velocity).max(initial=0.0), np.abs(slider))
    gap = position @ directed.T + [contact.gap for contact in contacts]
    slip = velocity @ tangential.T - slider
    kinetic = coefficients(contacts, slip)
    # What the rounding of the slip velocity moves it by.
    loose = np.abs(coefficients(contacts, np.abs(slip) + speed) - kinetic)
    loose += np.abs(coefficients(contacts, np.maximum(np.abs(slip) - speed, 0.0)) - kinetic)
    status = data.status
    closed = status != ord("d")
    # Forces that nothing determines need not be admissible one by one.
    determined = np.ones_like(closed)
    for name, which in sampled.run.undetermined.items():
        within = (status == np.frombuffer(name.encode(), dtype=np.uint8)).all(axis=1)
        determined[np.ix_(within, [scene.contact_labels().index(label) for label in which])] = False
    # With a full mass positions are sums over coordinates, and a slider that vibrates carries velocities.
    vibrates = np.array([contact.slider_vibration is not None for contact in contacts])
    held = float(scene.mass.ndim == 2 or vibrates.any() or not plain(scene))
    along = (status == ord("+")) & (slip > speed) | (status == ord("-")) & (slip < -speed)
    sign = (status == ord("+")).astype(float) - (status == ord("-"))
    # A node on a tangential spring: how it slips shows in its places, one after the other in a phase.
    springs = np.array([(c.normal_stiffness or 0.0, c.tangential_stiffness or 0.0) for c in contacts])
    elastic, nodes = springs[:, 0] > 0.0, springs[:, 1] > 0.0
    force = force + springs.sum(axis=1) * length
    flexibility = np.where(nodes, 1.0 / np.where(nodes, springs[:, 1], 1.0), np.nan)
    place = position @ tangential.T + friction * flexibility - slider * data.time[:, None]
    phase = np.searchsorted(sampled.run.events.time, data.time)
    slipped = np.diff(place, axis=0, prepend=np.nan)
    slipped[np.diff(phase, prepend=-1) != 0] = np.nan
    slipped[:, vibrates] = np.nan
    step = length + force * flexibility + SLACK * np.abs(slider * data.time[:, None])
    # The slip speed of such a node under a law is not that of its mass; friction is no less than at rest.
    by_law = np.array([isinstance(c.friction, FrictionLaw) for c in contacts]) & nodes
    least = coefficients(contacts, np.zeros_like(slip))
    with np.errstate(invalid="ignore", divide="ignore"):
        kinetic = np.where(by_law, np.fmax(least, np.abs(friction) / normal), kinetic)
    loose = np.where(by_law, 0.0, loose)
    checks = {
        "penetration": ~(closed & elastic) & (gap < -length),
        "gap of a closed contact": closed & ~elastic & (np.abs(gap) > held * length),
        "normal spring": closed & elastic & (np.abs(normal + springs[:, 0] * gap) > force),
        "tension": closed & determined & (normal < -force),
        "force of an open contact": ~closed & (np.maximum(np.abs(normal), np.abs(friction)) > held * force),
        "friction cone": (sign == 0.0)
        & determined
        & (np.abs(friction) > static * normal + (1 + static) * force),
        "kinetic friction": (sign != 0.0)
        & determined
        & (np.abs(friction - sign * kinetic * normal) > (1 + kinetic) * force + loose * np.abs(normal)),
        "slip while sticking": (status == ord("s")) & ~nodes & (np.abs(slip) > held * speed),
        "slip along friction": along & ~nodes & (kinetic > 0.0),
        "slip of a node while sticking": (status == ord("s")) & (np.abs(slipped) > step),
        "slip of a node along friction": (kinetic > 0.0) & (sign * slipped > step),
    }
    for name, violated in checks.items():
        if violated.any():
            k, i = np.argwhere(violated)[0]
            values = f"N {normal[k, i]:.3e}, T {friction[k, i]:.3e}, g {gap[k, i]:.3e}, s {slip[k, i]:.3e}"
            return f"{name} at contact {i}, t = {float(data.time[k])!r}: {values}"
    return ""


def impact_law(sampled: Sampled) -> str:
    """Return where ``g'+ = -e g'-`` or the Coulomb impulse fails, or something else jumps, or ``""``.

    At instants of one impact.
    """
    if not plain(sampled.run.scene):
        return rebound_law(sampled)
    if sampled.run.scene.mass.ndim == 2:
        return coupled_impact_law(sampled)
    events, scene, contacts = sampled.run.events, sampled.run.scene, sampled.run.scene.contacts
    instants = sampled.impacts
    apart = np.diff(events.time, prepend=-1.0)[instants] > 0.0
    single = (events.kind[instants] == "impact") & apart & (events.time[instants] > 0.0)
    instants = instants[single]
    if instants.size == 0:
        return ""
    position, velocity = sampled.before.position[single], sampled.before.velocity[single]
    after = sampled.after[1][single]
    mass, damping, stiffness = sampled.matrices
    mass = np.diag(mass)
    # What forces change within the two ulp of time between the states compared.
    load = np.abs(position) @ np.abs(stiffness).T + np.abs(velocity) @ np.abs(damping).T
    stated = np.abs(forces(scene, events.time[instants]))
    drift = 2.0 * np.spacing(events.time[instants])[:, None] * (load + stated) / mass
    # Rounding of positions moves velocities by what the fastest mode makes of it.
    rate = max(
        (np.abs(damping).sum(axis=1) / mass).max(), np.sqrt((np.abs(stiffness).sum(axis=1) / mass).max())
    )
    rounding = 4.0 * np.finfo(float).eps * rate * np.abs(position).max(axis=1)
    slack = drift + (SLACK * np.abs(velocity).max(axis=1) + rounding)[:, None]
    which = events.contact[instants]
    row = np.arange(instants.size)
    t, n = 4 * which + 2, 4 * which + 3
    restitution = np.array([contact.restitution for contact in contacts])[which]
    speeds = slider_speeds(scene, events.time[instants])
    slip = velocity[row, t] - speeds[row, which]
    friction = coefficients(contacts, velocity[:, 2::4] - speeds)[row, which] * scene.impact_friction
    approach = -velocity[row, n]
    expected = velocity.copy()
    expected[row, n] = restitution * approach
    impulse = friction * (1.0 + restitution) * mass[n] / mass[t]
    # Where impacts follow each other within an ulp of time, what is sampled before one may be after the last.
    reach = impulse * np.maximum(approach, 0.0)
    expected[row, t] -= np.clip(slip, -reach, reach)
    slack[row, t] += impulse * slack[row, n]
    off = np.abs(after - expected) > slack
    if off.any():
        k, dof = np.argwhere(off)[0]
        values = f"{velocity[k, dof]!r} -> {after[k, dof]!r}, expected {expected[k, dof]!r}"
        return f"impact of contact {which[k]} at {events.time[instants[k]]!r}: velocity {dof} {values}"
    return ""


def rebound_law(sampled: Sampled) -> str:
    """Return where ``g'+ = -e g'-`` fails or masses without contact jump, or ``""``.

    At instants of one impact.
    """
    events, scene, contacts = sampled.run.events, sampled.run.scene, sampled.run.scene.contacts
    time = events.time[sampled.impacts]
    alone = np.array([np.count_nonzero(np.abs(events.time - t) <= 1e-12) == 1 for t in time], dtype=bool)
    single = alone & (events.kind[sampled.impacts] == "impact")
    time, which = time[single], events.contact[sampled.impacts][single]
    before, after = sampled.before.velocity[single], sampled.after[1][single]
    mass, damping, stiffness = (np.abs(matrix) for matrix in sampled.matrices)
    inverse = np.abs(np.linalg.inv(sampled.matrices[0]))
    position = np.abs(sampled.before.position[single])
    load = position @ stiffness.T + np.abs(before) @ damping.T + np.abs(forces(scene, time))
    # Springs of contacts press as well.
    for contact, normal, tangential in zip(contacts, *np.abs(contact_directions(scene))[::-1], strict=True):
        reach = (position @ normal + abs(contact.gap)) * (contact.normal_stiffness or 0.0)
        load += np.outer(reach, normal + contact.holding * tangential)
    rate = np.sqrt((inverse @ stiffness).sum(axis=1).max())
    size = np.abs(before).max(axis=1, initial=0.0) + np.abs(after).max(axis=1, initial=0.0)
    rounding = SLACK * size
    displaced = 4.0 * np.finfo(float).eps * rate * position.max(axis=1, initial=0.0)
    pushed = 2.0 * np.spacing(time)[:, None] * (load @ inverse)
    # Where a contact keeps two masses apart, their distance is a coordinate: modes know the place of the
    # lighter one to the rounding of the momentum of the heavier one. So they do in another contact of these.
    keeps = contact_directions(scene)[1] != 0.0
    heavier = np.array([np.ptp(np.log(np.diag(mass)[own])) if own.any() else 0.0 for own in keeps])
    shared = keeps.astype(int) @ keeps.T > 0
    ratio = np.exp(np.where(shared, heavier, 0.0).max(axis=1))[which]
    slack = pushed + (rounding + ratio * displaced)[:, None]
    normal = contact_directions(scene)[1][which]
    restitution = np.array([contact.restitution for contact in contacts])[which]
    arrived, left = np.sum(normal * before, axis=1), np.sum(normal * after, axis=1)
    off = np.abs(left + restitution * arrived) > 2.0 * np.sum(np.abs(normal) * slack, axis=1)
    if off.any():
        k = int(np.argmax(off))
        return (
            f"impact of contact {which[k]} at {float(time[k])!r}: {arrived[k]!r} -> {left[k]!r}, "
            f"restitution {restitution[k]}"
        )
    touched = np.any(contact_directions(scene), axis=(0, 1))
    slack = pushed + (rounding + displaced)[:, None]
    elsewhere = np.abs((after - before) @ sampled.matrices[0]) > slack @ mass
    if elsewhere[:, ~touched].any():
        k = int(np.argmax(elsewhere[:, ~touched].any(axis=1)))
        return f"impact of contact {which[k]} at {float(time[k])!r}: impulse elsewhere"
    return ""


def coupled_impact_law(sampled: Sampled) -> str:
    """Return where the impulses of contacts that mass couples break the impact law, or ``""``.

    ``g'+ >= -e g'-``, ``p_n >= 0``, the friction cone, and no impulse but at contacts; where no series ends.
    """
    events, scene, contacts = sampled.run.events, sampled.run.scene, sampled.run.scene.contacts
    ends = np.isin(events.time[sampled.impacts], events.time[events.kind == "accumulation"])
    apart = np.diff(np.concatenate([[-1.0], events.time[sampled.impacts]])) > 1e-12
    single = ~ends & apart
    before, after = sampled.before.velocity[single], sampled.after[1][single]
    mass, damping, stiffness = sampled.matrices
    time, position = events.time[sampled.impacts][single], sampled.before.position[single]
    stated = np.abs(forces(scene, time))
    load = np.abs(position) @ np.abs(stiffness).T + np.abs(before) @ np.abs(damping).T + stated
    inverse = np.abs(np.linalg.inv(mass))
    rate = np.sqrt((inverse @ np.abs(stiffness)).sum(axis=1).max())
    size = np.abs(before).max(axis=1, initial=0.0) + np.abs(after).max(axis=1, initial=0.0)
    rounding = SLACK * size + 4.0 * np.finfo(float).eps * rate * np.abs(position).max(axis=1, initial=0.0)
    slack = 2.0 * np.spacing(time)[:, None] * (load @ inverse) + rounding[:, None]
    impulse, push = (after - before) @ mass, slack @ np.abs(mass)
    restitution = np.array([contact.restitution for contact in contacts])
    # Impacts at one instant press on each other: a rebound then is one of more than the approach before.
    alone = np.array([np.count_nonzero((events.time == t) & (events.kind == "impact")) == 1 for t in time])
    # They strike in turn, with the slip velocities that those before leave; impulses may oppose each other.
    reach = np.where(alone, 0.0, (np.abs(impulse) @ inverse).max(axis=1, initial=0.0))[:, None]
    slip = before[:, 2::4] - slider_speeds(scene, time)
    # The largest mu is at an end of the slip speeds, or at a knot of a table: its cubics are monotone.
    low, high = np.maximum(np.abs(slip) - reach, 0.0), np.abs(slip) + reach
    laws = [contact.friction for contact in contacts]
    knots = {speed for law in laws if isinstance(law, ss.friction.Tabulated) for speed in law.speeds}
    friction = np.max([coefficients(contacts, np.clip(s, low, high)) for s in (0.0, *knots, np.inf)], axis=0)
    normal, tangential = impulse[:, 3::4], impulse[:, 2::4]
    struck = (normal > push[:, 3::4]) & alone[:, None]
    rebound = after[:, 3::4] + restitution * np.minimum(before[:, 3::4], 0.0)
    checks = {
        "tension": normal < -push[:, 3::4],
        "rebound": struck & (np.abs(rebound) > 2.0 * slack[:, 3::4]),
        "friction cone": np.abs(tangential)
        > friction * np.maximum(normal, 0.0) + push[:, 2::4] + friction * push[:, 3::4],
        "impulse elsewhere": (np.abs(impulse) > push)[:, 0::4] | (np.abs(impulse) > push)[:, 1::4],
    }
    for name, violated in checks.items():
        if violated.any():
            k, i = np.argwhere(violated)[0]
            return f"impact at {float(time[k])!r}, contact {i}: {name}: {before[k]} -> {after[k]}"
    return ""


def energy_residual(sampled: Sampled) -> float:
    """Return the residual of the energy balance over the sum of absolute work terms.

    Or over a part of the energy, `BALANCED` and more of it the more phases there are.

    The change of ``1/2 u' M u + 1/2 x' K x``, less what impacts change it by, against the Gauss quadrature of
    contact, external, circulatory and damping power.
    """
    run, data = sampled.run, sampled.at_nodes
    mass, damping, restoring = sampled.matrices
    # Of K + H the symmetric part stores, the other one works.
    stiffness, following = 0.5 * (restoring + restoring.T), 0.5 * (restoring - restoring.T)
    tangential, normal = contact_directions(run.scene)
    until, weights, velocity = sampled.powers_until, sampled.weights, data.velocity
    powers = np.column_stack(
        [
            data.friction * (velocity @ tangential.T),
            # The springs of contacts are outside.
            data.normal
            * (velocity @ normal.T)
            * [c.normal_stiffness is not None for c in run.scene.contacts],
            np.sum(velocity * forces(run.scene, data.time), axis=1),
            -np.sum((velocity @ following) * data.position, axis=1),
            -np.sum((velocity @ damping) * velocity, axis=1),
        ]
    )

    def energy(position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        return 0.5 * (
            np.sum((velocity @ mass) * velocity, axis=-1) + np.sum((position @ stiffness) * position, axis=-1)
        )

    def size(state: ss.State) -> float:
        position, velocity = np.abs(state.position), np.abs(state.velocity)
        return float(0.5 * (velocity @ np.abs(mass) @ velocity + position @ np.abs(stiffness) @ position))

    end = run.state(until)
    change = float(energy(end.position, end.velocity) - energy(run.start.position, run.start.velocity))
    reached = run.events.time[sampled.impacts] <= until
    before = energy(sampled.before.position, sampled.before.velocity)
    jumps = (energy(*sampled.after) - before)[reached]
    turnover = (weights @ np.abs(powers)).sum() + np.abs(jumps).sum() + abs(change)
    phases = np.searchsorted(run.events.time, until)
    scale = max(turnover, BALANCED * (1.0 + phases / PHASES) * max(size(run.start), size(end)))
    return float(abs(change - (weights @ powers).sum() - jumps.sum()) / scale)


def balance_residual(run: ss.Trajectory) -> float:
    """Return the residual of the program's own balance, over the works or the same part of the energy."""
    balance = run.balance()
    works = [balance.stored, balance.external, balance.circulatory, balance.damping, balance.impact]
    turnover = np.abs(works).sum() + float(np.abs(balance.contacts.work).sum())
    mass, _, stiffness = (np.abs(matrix) for matrix in matrices(run.scene))
    states = [(np.abs(s.position), np.abs(s.velocity)) for s in (run.start, run.state(run.duration))]
    energy = max(0.5 * (v @ mass @ v + x @ stiffness @ x) for x, v in states)
    scale = max(turnover, BALANCED * (1.0 + len(run.events) / PHASES) * energy)
    return float(abs(balance.residual) / scale)
