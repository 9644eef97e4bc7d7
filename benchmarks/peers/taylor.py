"""heyoka: Taylor integrators compiled for each combination, with terminal events.

One integrator per combination, each with the right side and the event functions of that combination alone and
their zero coefficients left out. The compiler's options that could matter (`fast_math`, `slp_vectorize`,
`compact_mode`) and leaving the constrained dofs out of the state gain nothing here. State and time are
written through views, and a phase costs one call. Friction over slip speed may follow Stribeck's law,
and polynomial springs may act on dofs without contacts.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import heyoka
import numpy as np
from numpy.typing import NDArray

import stickslip as ss
from peer_integrator import Mechanics, Motion
from peers.restart import MOST_EVENTS, Vector, leave
from stickslip.scene.laws.friction import FrictionLaw

#: Coefficients below this part of the largest are rounding of zeros.
ROUNDING = 1e-13


#: Entries of a direction by dof, the offset, and the coefficients of a polynomial spring.
PolynomialSpring = tuple[dict[int, float], float, tuple[float, ...]]


class Phase:
    """The integrator of one combination."""

    def __init__(
        self,
        mechanics: Mechanics,
        combination: str,
        tolerance: float,
        laws: dict[int, ss.friction.Stribeck],
        compact: bool,
        springs: Sequence[PolynomialSpring] = (),
    ) -> None:
        n = mechanics.size
        variables = heyoka.make_vars(*(f"x{i}" for i in range(n)), *(f"u{i}" for i in range(n)))

        def affine(row: NDArray[np.float64], constant: float) -> Any:
            terms = [float(a) * v for a, v in zip(row, variables, strict=True) if a != 0.0]
            return heyoka.sum([*terms, heyoka.expression(float(constant))] if constant else terms)

        generator, offset, self.forces = mechanics.linear(combination)
        still = set()
        for contact, status in zip(mechanics.contacts, combination, strict=True):
            if status != "d":
                still.add(contact.normal)
            if status == "s":
                still.add(contact.tangential)
        # What laws of friction push with, beside a linear part without them: +-mu(|s|) N.
        pushes: dict[int, Any] = {}
        for i, law in laws.items():
            contact = mechanics.contacts[i]
            if combination[i] in "+-":
                sign = 1.0 if combination[i] == "+" else -1.0
                row, constant = self.forces[i][0]
                slip = -sign * (variables[n + contact.tangential] - float(contact.slider_speed))
                mass = float(mechanics.mass[contact.tangential, contact.tangential])
                pushes[contact.tangential] = (
                    sign / mass * coefficient(law, slip) * affine(cleared(row), constant)
                )
        rates = list(variables[n:])
        for i, (row, constant) in enumerate(zip(generator[n:], offset[n:], strict=True)):
            rate = heyoka.expression(0.0) if i in still else affine(cleared(row), constant)
            rates.append(rate + pushes[i] if i in pushes else rate)
        for entries, offset, coefficients in springs:
            # Along dofs without contacts, so that contact forces do not change.
            stretch = sum(float(entry) * variables[i] for i, entry in entries.items()) - float(offset)
            force = sum(float(k) * stretch ** (j + 1) for j, k in enumerate(coefficients) if k)
            for i, entry in entries.items():
                rates[n + i] -= float(entry / mechanics.mass[i, i]) * force
        functions = mechanics.event_functions(combination)
        self.labels = [(contact, kind) for contact, kind, _, _ in functions]
        self.integrator = heyoka.taylor_adaptive(
            list(zip(variables, rates, strict=True)),
            np.zeros(2 * n),
            tol=tolerance,
            compact_mode=compact,
            t_events=[
                heyoka.t_event(affine(cleared(row), constant), direction=heyoka.event_direction.negative)
                for _, _, row, constant in functions
            ],
        )
        self.state: Vector = self.integrator.state


def coefficient(law: ss.friction.Stribeck, slip: Any) -> Any:
    """Return mu over an expression."""
    return law.kinetic + (law.static - law.kinetic) * heyoka.exp(-slip / law.speed) + law.viscous * slip


def cleared(row: Vector) -> Vector:
    """Return the row with the rounding of its zeros set to zero."""
    return np.where(np.abs(row) < ROUNDING * np.abs(row).max(), 0.0, row)


def prepare(
    scene: Any, start: Any, duration: float, tolerance: float, *, compact: bool = False
) -> Callable[[], Motion]:
    """Return the run; tolerance 0 stands for an ulp. A combination is compiled when it first comes.

    In `compact` mode compiling takes less and running more.
    """
    laws = {
        i: contact.friction
        for i, contact in enumerate(scene.contacts)
        if isinstance(contact.friction, FrictionLaw)
    }
    frictions = [0.0 if i in laws else contact.friction for i, contact in enumerate(scene.contacts)]
    mechanics = Mechanics(scene.replace(friction=frictions, static_friction=None, elements=()))
    springs = [
        (
            {scene.dofs.index(name): entry for name, entry in one.direction.items()},
            one.offset,
            one.law.coefficients,
        )
        for one in scene.elements
    ]
    mechanics.static = [contact.holding for contact in scene.contacts]
    initial = np.concatenate([start.position, start.velocity])
    known: dict[str, Phase] = {}
    n, contacts = mechanics.size, mechanics.contacts

    def phase(combination: str) -> Phase:
        if combination not in known:
            known[combination] = Phase(mechanics, combination, tolerance, laws, compact, springs)
        return known[combination]

    def settled(combination: str, state: Vector, contact: int, kind: str) -> str:
        """What `Mechanics.after` does, in place and for directions that are dofs."""
        before, behind, law = combination[:contact], combination[contact + 1 :], contacts[contact]
        if kind == "velocity":
            state[n + law.tangential] = law.slider_speed
            (normal, normal0), (friction, friction0) = phase(before + "s" + behind).forces[contact]
            force = friction.dot(state) + friction0
            if abs(force) <= mechanics.static[contact] * (normal.dot(state) + normal0):
                status = "s"
            else:
                status = "+" if force > 0.0 else "-"
        elif kind == "release":
            status = "d"
        elif kind == "impact":
            state[law.normal] = state[n + law.normal] = 0.0
            status = "+" if state[n + law.tangential] < law.slider_speed else "-"
            normal, normal0 = phase(before + status + behind).forces[contact][0]
            if normal.dot(state) + normal0 < 0.0:
                status = "d"
        else:
            status = kind[-1]
        return before + status + behind

    def run() -> Motion:
        motion, combination = Motion(), start.combination
        current = phase(combination)
        current.state[:] = initial
        current.integrator.time = 0.0
        while len(motion.time) < MOST_EVENTS:
            outcome = int(current.integrator.propagate_until(duration)[0])
            time = current.integrator.time
            if time >= duration:
                break
            # A terminal event i that stops the integration is reported as -i - 1.
            contact, kind = current.labels[-outcome - 1]
            changed = settled(combination, current.state, contact, kind)
            leave(mechanics, changed, current.state, contact)
            if changed != combination:
                following = phase(changed)
                following.state[:] = current.state
                following.integrator.time = time
                combination, current = changed, following
            # What was just found is no longer at zero, and nothing else needs an interval without events.
            current.integrator.reset_cooldowns()
            motion.time.append(time)
            motion.contact.append(contact)
            motion.kind.append(kind)
            motion.combination.append(combination)
        return motion

    return run
