"""How a motion grows from a Hopf point: the first Lyapunov coefficient.

In a combination of sliding and open contacts the displacements x, the friction forces T and the changes N of
the normal forces obey, with d = d/dt,

```text
(M d^2 + C d + K) x - t T - n N = 0
T_i - sigma mu N_i + mu' N_0 w_i = b_i     sliding, with w_i = d (t_i x + T_i / k_t)
n_i x + N_i / k_n = p_i                    closed, with a normal direction
```

where w is the slip velocity less that of steady sliding, mu and its derivatives are those of steady sliding,
and 1 / k is zero at rigid contacts. A spring or damper along e, with u = e x or e dx, is a part of K or C by
its slope at rest, and adds ``-(phi'' u^2 / 2 + phi''' u^3 / 6) e`` to the right side of the first equation.
Under a contact stiffness by a law, ``N = phi(u)`` with ``u = -n x``, k_n is the slope at steady sliding and
``p = (phi'' u^2 / 2 + phi''' u^3 / 6) / k_n``; else p is 0. The terms of higher order of b are those of
``T = sigma mu(|s|) (N_0 + N)``, sigma = 1 in ``+``:

```text
b = -mu' w N + sigma mu'' N_0 w^2 / 2 + sigma mu'' w^2 N / 2 - mu''' N_0 w^3 / 6
```

A contact with a state, ``T = -N f(s, z)`` and ``dz = g(s, z)``, has the change of z as one more unknown; with
the change n of N, which vanishes where N is given:

```text
T_i + N_0 (f_s w_i + f_z z_i) + f n_i = -(N_0 + n) (f_ss w^2 / 2 + f_sz w z + f_zz z^2 / 2 + ...)
                                        - n (f_s w + f_z z)
(d - g_z) z_i - g_s w_i       = g_ss w^2 / 2 + g_sz w z + g_zz z^2 / 2 + ...
```

Friction in a plane is ``T = -(N_0 + n) h(w_0 + w)`` with ``h(w) = mu(|w|) w / |w|``, and both directions have
one n. Also with a constant coefficient it is not linear, as its direction turns:

```text
T + N_0 Dh w + h n = -N_0 (D2h(w, w) / 2 + D3h(w, w, w) / 6) - n (Dh w + D2h(w, w) / 2)
```

At a Hopf point the matrix A(d) of the left sides has null vectors, ``A(i w) p = 0`` and ``q* A(i w) = 0``,
scaled to ``q* A'(i w) p = 1``. The amplitude z of p obeys ``z' = i w z + g z |z|^2 / 2`` to third order, with
the bilinear form B and the trilinear form C of b:

```text
g = q* (C(p, p, p*) + 2 B(p, A(0)^-1 B(p, p*)) + B(p*, A(2 i w)^-1 B(p, p))),     l_1 = Re g / (2 w)
```

(Kuznetsov, *Elements of Applied Bifurcation Theory*, section 5.4, where A is the matrix of equations of first
order.)
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, TypeAlias

import numpy as np
import scipy.sparse
import scipy.sparse.linalg

from stickslip.scene.checks import Complex, Real
from stickslip.scene.contact import steady_slips
from stickslip.scene.elements import Damper
from stickslip.scene.laws.spring import SpringLaw
from stickslip.scene.laws.state import LawWithState
from stickslip.scene.scene import Scene
from stickslip.scene.structure import core_matrices, directions, tangent

Criticality: TypeAlias = Literal["supercritical", "subcritical", "linear until a status changes"]
#: Phasors of w and N, (c,) each, of u, (e,), of z, and of the penetration of contacts, (c,) each.
_Phasors = tuple[Complex, Complex, Complex, Complex, Complex]

#: Null vectors are those of an inverse this far off the eigenvalue, relative; their error is its square.
_SHIFT = 1e-9
_ITERATIONS = 3
#: Change of the growth rate, of the frequency, up to which a motion as large as the slip allows is linear.
_LINEAR = 1e-12


def criticality(scene: Scene, combination: str, eigenvalue: complex) -> tuple[Criticality, float] | None:
    """Return how motions grow from a Hopf point, and l_1 of a mode whose largest displacement is 1 m, 1/m^2.

    None where a contact sticks, so that steady sliding is no rest, where the stiffness of the combination is
    singular, where friction is not smooth at steady sliding, as that of elasto-plastic bristles, or where it
    acts in a plane on a spring.
    """
    if any(one.beside is not None and one.tangential_stiffness is not None for one in scene.contacts):
        return None
    if not (scene.core.has_friction_laws or scene.core.has_elements or "o" in combination):
        return "linear until a status changes", 0.0
    states = [k for k, one in enumerate(scene.contacts) if isinstance(one.friction, LawWithState)]
    if "s" in combination or any(scene.core.state_derivatives(k) is None for k in states):
        return None
    try:
        return _Sliding(scene, combination).growth(1j * abs(eigenvalue.imag))
    except RuntimeError:
        # SuperLU finds a singular matrix.
        return None


@dataclass(frozen=True, eq=False)
class _Sliding:
    """Motions near steady sliding in one combination, as vectors (x, T, N, z)."""

    scene: Scene
    combination: str

    @cached_property
    def signs(self) -> Real:
        """Sigma by contact, zero where none slides."""
        sign = {"+": 1.0, "-": -1.0, "d": 0.0, "o": 0.0}
        pairs = zip(self.combination, self.scene.contacts, strict=True)
        return np.array([sign[one] * (contact.tangential is not None) for one, contact in pairs])

    @cached_property
    def slides(self) -> Any:
        """Whether a contact slides along a line or slips in a plane, by contact."""
        return (self.signs != 0.0) | np.array([letter == "o" for letter in self.combination], dtype=bool)

    @cached_property
    def planes(self) -> list[tuple[list[int], Real, Real, Real, Real]]:
        """The contacts of both directions of planes that slip, and h, Dh, D2h and D3h of each."""
        contacts = self.scene.contacts
        found = []
        for k, one in enumerate(contacts):
            if self.combination[k] == "o" and one.beside is not None and k < one.beside:
                pair = [k, one.beside]
                slip = -np.array([contacts[i].slider_speed for i in pair])
                found.append((pair, *_turning(slip, self.friction[:, k])))
        return found

    def resistance(self, normal_force: Real) -> Any:
        """Return how friction grows against slip, (c, c), N s/m: of lines on the diagonal."""
        matrix = scipy.sparse.lil_array(np.diag(np.abs(self.signs) * self.friction[1] * normal_force))
        for pair, _, first, _, _ in self.planes:
            matrix[np.ix_(pair, pair)] = normal_force[pair[0]] * first
        return matrix.tocsr()

    @cached_property
    def follows(self) -> Any:
        """Friction forces per normal force, and normal forces that are those of another contact, (c, c)."""
        pressed, shared = np.diag(self.signs * self.friction[0]), np.zeros((self.signs.size,) * 2)
        for pair, steady, *_ in self.planes:
            pressed[pair, pair] = -steady
            for own, other in (pair, pair[::-1]):
                # One of both has the normal direction, or none where the normal force is given.
                shared[other, own] = self.closed[own]
        return scipy.sparse.csr_array(pressed), scipy.sparse.csr_array(shared)

    @cached_property
    def friction(self) -> Real:
        """Mu and its derivatives, (4, c)."""
        found = [self.scene.core.friction_derivatives(i) for i in range(len(self.combination))]
        mu = np.array(found).reshape(-1, 4).T
        steady = np.where(self.has_state, -self.signs * self.states[0, 0], mu[0])
        slope = np.where(self.has_state, self.states[0, 1], mu[1])
        return np.stack([steady, slope, *np.where(self.has_state, 0.0, mu[2:])])

    @cached_property
    def has_state(self) -> Any:
        """Whether a contact has a state, by contact."""
        return np.array([isinstance(one.friction, LawWithState) for one in self.scene.contacts], dtype=bool)

    @cached_property
    def states(self) -> Real:
        """F and g with their derivatives by s, z, ss, sz, zz, sss, ssz, szz, zzz, (2, 10, c)."""
        none = np.zeros((2, 10))
        pairs = enumerate(self.has_state)
        found = [self.scene.core.state_derivatives(k) if has_state else none for k, has_state in pairs]
        return np.array(found, dtype=float).reshape(-1, 2, 10).transpose(1, 2, 0)

    @cached_property
    def closed(self) -> Real:
        """1 by contact that is closed and has a normal direction, else 0."""
        pairs = zip(self.combination, self.scene.contacts, strict=True)
        return np.array([float(one != "d" and contact.normal is not None) for one, contact in pairs])

    @cached_property
    def compliance(self) -> tuple[Real, Real]:
        """1 / k_t and 1 / k_n by contact."""
        along = [one.tangential_stiffness for one in self.scene.contacts]
        laws = zip([one.normal_stiffness for one in self.scene.contacts], self.pressed[2], strict=True)
        # Of an open contact nothing is pressed.
        across = [slope or None if isinstance(k, SpringLaw) else k for k, slope in laws]
        node, spring = (np.array([0.0 if k is None else 1.0 / k for k in one]) for one in (along, across))
        return node, spring

    @cached_property
    def pressed(self) -> Real:
        """Of contact stiffnesses by laws u, phi and its first three derivatives, (5, c); zeros of others."""
        found = np.zeros((5, len(self.combination)))
        with_law = [isinstance(one.normal_stiffness, SpringLaw) for one in self.scene.contacts]
        behind = self.scene.core.elements_at_rest(self.combination)[len(self.scene.elements) :]
        if any(with_law):
            found[:, with_law] = np.array(behind).T
        return found * self.closed

    @cached_property
    def matrices(self) -> list[Any]:
        """M, C, K, and the tangential and normal directions by row."""
        rows = scipy.sparse.csr_array(self.scene.core.contact_directions())
        mass, damping, stiffness, *_ = core_matrices(self.scene)
        springs, dampers, _ = self.tangent
        return [mass, damping + dampers, stiffness + springs, rows[::2], rows[1::2]]

    @cached_property
    def tangent(self) -> tuple[Any, Any, Real]:
        """What the elements add to K, C and F."""
        return tangent(self.scene, self.combination)

    @cached_property
    def elements(self) -> tuple[Any, Real, Real]:
        """Directions of the elements, (e, n), phi'' and phi''', (2, e), and which are dampers, (e,)."""
        found = np.array(self.scene.core.elements_at_rest(self.combination)).reshape(-1, 5)
        found = found[: len(self.scene.elements)]
        dampers = np.array([isinstance(one, Damper) for one in self.scene.elements], dtype=bool)
        return directions(self.scene), found[:, 3:].T, dampers

    @cached_property
    def normal_force(self) -> Real:
        """N_0 by contact, of steady sliding."""
        contacts = self.scene.contacts
        given = np.array([contact.normal_force or 0.0 for contact in contacts])
        gaps = np.array([contact.gap for contact in contacts])
        force = self.scene.force + self.tangent[2]
        # N = phi(u_0) + k (u - u_0) under a law.
        before = self.pressed[1] * self.compliance[1] - self.pressed[0]
        none, closing = 0.0 * gaps, np.where(self.closed > 0.0, before - gaps, given)
        load = np.concatenate([force, none, closing, none])
        at_rest = _inverse(self.matrix(0.0, none)).solve(load.astype(complex))
        return np.array(at_rest[force.size + gaps.size :][: gaps.size].real)

    def matrix(self, rate: complex, normal_force: Real) -> Any:
        """Return A(rate)."""
        mass, damping, stiffness, along, across = self.matrices
        node, spring = self.compliance
        one = np.ones_like(self.signs)
        slope = rate * self.resistance(normal_force)
        pressed, shared = self.follows
        (_, _, by_state, *_), (_, bends, recovers, *_) = self.states
        own = np.where(self.has_state, rate - recovers, one)
        pressing = np.where(self.closed > 0.0, spring, one)
        return _block(
            [
                [rate * (rate * mass + damping) + stiffness, -along.T, -across.T, None],
                [
                    slope @ along,
                    _diagonal(one) + slope @ _diagonal(node),
                    -pressed,
                    _diagonal(normal_force * by_state),
                ],
                [_diagonal(self.closed) @ across, None, _diagonal(pressing) - shared, None],
                [_diagonal(-rate * bends) @ along, None, None, _diagonal(own)],
            ]
        )

    def derivative(self, rate: complex) -> Any:
        """Return A'(rate)."""
        mass, damping, _, along, _ = self.matrices
        slope = self.resistance(self.normal_force)
        zero = _diagonal(0.0 * self.signs)
        node, _ = self.compliance
        bends = self.states[1, 1]
        return _block(
            [
                [2.0 * rate * mass + damping, None, None, None],
                [slope @ along, slope @ _diagonal(node), None, None],
                [None, None, zero, None],
                [_diagonal(-bends) @ along, None, None, _diagonal(self.has_state.astype(float))],
            ]
        )

    def null_vectors(self, rate: complex) -> tuple[Complex, Complex]:
        """Return p and q, with a largest displacement of 1 in p and ``q* A' p = 1``."""
        near = _inverse(self.matrix(rate * (1.0 + _SHIFT), self.normal_force))
        slope = self.derivative(rate)
        right = left = np.ones(slope.shape[0], dtype=complex)
        for _ in range(_ITERATIONS):
            right, left = near.solve(slope @ right), near.solve(slope.conj().T @ left, trans="H")
            right, left = right / np.abs(right).max(), left / np.abs(left).max()
        right = right / np.abs(right[: self.scene.size]).max()
        return right, left / np.conj(left.conj() @ (slope @ right))

    def phasors(self, vector: Complex, rate: complex) -> _Phasors:
        """Return those of w, zero where a contact does not slide, of N, of u and of z."""
        size, count = self.scene.size, self.signs.size
        along, (node, _) = self.matrices[3], self.compliance
        slip = along @ vector[:size] + node * vector[size : size + count]
        directions, _, dampers = self.elements
        arguments = np.where(dampers, rate, 1.0) * (directions @ vector[:size])
        normal, state = vector[size + count : size + 2 * count], vector[size + 2 * count :]
        penetration = -(self.matrices[4] @ vector[:size])
        return rate * slip * self.slides, normal, arguments, state, penetration

    def bilinear(self, first: _Phasors, second: _Phasors) -> Complex:
        """Return B by row of A."""
        _, slope, curvature, _ = self.friction
        mixed = first[0] * second[1] + second[0] * first[1]
        square = self.signs * curvature * self.normal_force * first[0] * second[0]
        _, (bent, _), _ = self.elements
        (w, z), (v, y) = (first[0], first[3]), (second[0], second[3])
        _, _, by_state, ss, sz, zz, *_ = self.states.transpose(1, 0, 2)
        of_states = ss * w * v + sz * (w * y + z * v) + zz * z * y
        of_springs = self.pressed[3] * first[4] * second[4] * self.compliance[1]
        pressing = by_state[0] * (z * second[1] + y * first[1])
        of_contacts = square - slope * mixed * np.abs(self.signs) - pressing
        for pair, _, by_slip, twice, _ in self.planes:
            (w, n), (v, m) = ((of[0][pair], of[1][pair[0]]) for of in (first, second))
            of_contacts[pair] = -self.normal_force[pair[0]] * np.einsum("iab,a,b", twice, w, v)
            of_contacts[pair] -= n * (by_slip @ v) + m * (by_slip @ w)
        return self.rows(-bent * first[2] * second[2], of_contacts, of_springs, of_states)

    def rows(
        self, of_elements: Complex, of_contacts: Complex, of_springs: Complex, of_states: Complex
    ) -> Complex:
        """Return forces of elements, b and p of the contacts, and terms of f and g, as a right side of A."""
        along = self.elements[0].T @ of_elements
        friction = of_contacts - self.normal_force * of_states[0]
        return np.concatenate([along, friction, of_springs, of_states[1]])

    def trilinear(self, mode: _Phasors) -> Complex:
        """Return C(p, p, p*) by row of A."""
        _, _, curvature, third = self.friction
        slip, normal, argument, state, depth = mode
        mixed = 2.0 * np.abs(slip) ** 2 * normal + slip**2 * normal.conj()
        cubic = third * self.normal_force * slip * np.abs(slip) ** 2
        _, (_, bent), _ = self.elements
        _, _, _, ss, sz, zz, sss, ssz, szz, zzz = self.states.transpose(1, 0, 2)
        of_states = sss * slip * np.abs(slip) ** 2 + zzz * state * np.abs(state) ** 2
        of_states = of_states + ssz * (slip**2 * state.conj() + 2.0 * np.abs(slip) ** 2 * state)
        of_states = of_states + szz * (state**2 * slip.conj() + 2.0 * np.abs(state) ** 2 * slip)
        of_elements = -bent * argument * np.abs(argument) ** 2
        of_springs = self.pressed[4] * depth * np.abs(depth) ** 2 * self.compliance[1]
        crossed = normal.conj() * slip * state + normal * (slip.conj() * state + slip * state.conj())
        squares = 2.0 * np.abs(state) ** 2 * normal + state**2 * normal.conj()
        pressing = ss[0] * mixed + 2.0 * sz[0] * crossed + zz[0] * squares
        of_contacts = self.signs * curvature * mixed - cubic * np.abs(self.signs) - pressing
        for pair, _, _, twice, thrice in self.planes:
            w, n = slip[pair], normal[pair[0]]
            of_contacts[pair] = -self.normal_force[pair[0]] * np.einsum("iabc,a,b,c", thrice, w, w, w.conj())
            of_contacts[pair] -= 2.0 * n * np.einsum("iab,a,b", twice, w, w.conj())
            of_contacts[pair] -= n.conj() * np.einsum("iab,a,b", twice, w, w)
        return self.rows(of_elements, of_contacts, of_springs, of_states)

    def answer(self, forces: Complex, rate: complex) -> _Phasors:
        """Return what a right side of A brings about."""
        response = _inverse(self.matrix(rate, self.normal_force)).solve(forces.astype(complex))
        return self.phasors(response, rate)

    def growth(self, rate: complex) -> tuple[Criticality, float]:
        """Return how motions grow, and l_1, at the eigenvalue `rate`."""
        right, left = self.null_vectors(rate)
        mode = self.phasors(right, rate)
        conjugate = (mode[0].conj(), mode[1].conj(), mode[2].conj(), mode[3].conj(), mode[4].conj())
        mean = self.answer(self.bilinear(mode, conjugate), 0.0)
        double = self.answer(self.bilinear(mode, mode), 2.0 * rate)
        forces = self.trilinear(mode) + 2.0 * self.bilinear(mode, mean) + self.bilinear(conjugate, double)
        growth = float((left.conj() @ forces).real)
        # At this amplitude a contact sticks.
        speeds, slips = steady_slips(self.scene.contacts), np.abs(mode[0])
        for pair, *_ in self.planes:
            slips[pair] = np.linalg.norm(slips[pair])
        moving = slips > 0.0
        amplitude = float((speeds[moving] / slips[moving]).min(initial=1e150))
        if abs(growth) * amplitude**2 <= _LINEAR * abs(rate):
            return "linear until a status changes", 0.0
        return "subcritical" if growth > 0.0 else "supercritical", growth / (2.0 * abs(rate))


def _turning(slip: Real, friction: Real) -> tuple[Real, Real, Real, Real]:
    """Return ``h(w) = mu(|w|) w / |w|``, Dh, D2h and D3h, from mu and its derivatives, (4,).

    With ``g = mu / r``, and ``w = (r + a, b)`` along and across the slip, the speed is
    ``r + a + b^2 / 2 r - a b^2 / 2 r^2`` to third order, and h is ``g (r + a, b)``.
    """
    r = float(np.linalg.norm(slip))
    mu, slope, curvature, third = friction
    g = mu / r
    g1 = (slope - g) / r
    g2 = (curvature - 2.0 * g1) / r
    first = np.diag([slope, g])
    twice, thrice = np.zeros((2, 2, 2)), np.zeros((2, 2, 2, 2))
    twice[0, 0, 0] = curvature
    twice[0, 1, 1] = twice[1, 0, 1] = twice[1, 1, 0] = g1
    thrice[0, 0, 0, 0] = third
    for places in ((0, 0, 1, 1), (0, 1, 0, 1), (0, 1, 1, 0), (1, 1, 0, 0), (1, 0, 1, 0), (1, 0, 0, 1)):
        thrice[places] = g2
    thrice[1, 1, 1, 1] = 3.0 * g1 / r
    along = slip / r
    turn = np.array([along, [-along[1], along[0]]]).T
    return (
        mu * along,
        turn @ first @ turn.T,
        np.einsum("ia,jb,kc,abc", turn, turn, turn, twice),
        np.einsum("ia,jb,kc,ld,abcd", turn, turn, turn, turn, thrice),
    )


def _block(parts: list[list[Any]]) -> Any:
    return scipy.sparse.csr_array(scipy.sparse.block_array(parts))


def _diagonal(values: Any) -> Any:
    return scipy.sparse.diags_array(values)


def _inverse(matrix: Any) -> Any:
    return scipy.sparse.linalg.splu(scipy.sparse.csc_array(matrix, dtype=complex))
