"""Motions under friction over slip speed by Taylor series in 45 digits, in dof coordinates.

For lumped masses and contacts along single dofs. Nothing is shared with the compiled core: series come from
the equations of motion in the dofs, events from sign changes between samples, refined to all digits.
"""

from __future__ import annotations

import numpy as np
from mpmath import mp, mpf

import stickslip as ss
from stickslip.scene.laws.friction import FrictionLaw, Linear, Rational, Stribeck, Tabulated

mp.dps = 45
ORDER = 44
#: Samples of a step among which signs are compared, and the part of a step that is the start of a function.
SAMPLES = 64
SIGN = {"+": 1, "-": -1}


class Peer:
    """The motion from a state on, event by event."""

    def __init__(self, scene: ss.Scene, start: ss.State) -> None:
        stiffness = np.asarray(
            scene.stiffness.todense() if hasattr(scene.stiffness, "todense") else scene.stiffness
        )
        damping = scene.damping
        if isinstance(damping, ss.Rayleigh):
            self.damping = [
                [
                    mpf(damping.stiffness) * mpf(k)
                    + (mpf(damping.mass) * mpf(scene.mass[i]) if i == j else 0)
                    for j, k in enumerate(row)
                ]
                for i, row in enumerate(stiffness.tolist())
            ]
        else:
            dense = np.zeros_like(stiffness) if damping is None else np.asarray(damping)
            self.damping = [[mpf(c) for c in row] for row in dense.tolist()]
        self.stiffness = [[mpf(k) for k in row] for row in stiffness.tolist()]
        self.mass = [mpf(m) for m in scene.mass.tolist()]
        self.force = [mpf(f) for f in scene.force.tolist()]
        self.contacts = scene.contacts
        #: Springs along dofs without contacts: entries of d by dof, offset, and coefficients of phi.
        self.springs = [
            (
                {scene.dofs.index(name): mpf(entry) for name, entry in one.direction.items()},
                mpf(one.offset),
                [mpf(c) for c in one.law.coefficients],
            )
            for one in scene.elements
        ]
        self.x = [mpf(float(x)) for x in start.position]
        self.v = [mpf(float(v)) for v in start.velocity]
        self.statuses = list(start.combination)
        self.time = mpf(0)
        self.events: list[tuple[mpf, int, str]] = []
        self.settle_exactly()

    def settle_exactly(self) -> None:
        for contact, status in zip(self.contacts, self.statuses, strict=True):
            if contact.normal is not None and status != "d":
                self.x[contact.normal] = self.v[contact.normal] = mpf(0)
            if status == "s":
                self.v[contact.tangential] = mpf(contact.slider_speed)

    def residual(self, x: list[mpf], v: list[mpf], row: int) -> mpf:
        """Return ``(F - K x - C v)_row``."""
        terms = zip(self.stiffness[row], self.damping[row], x, v, strict=True)
        return self.force[row] - mp.fsum(k * a + c * b for k, c, a, b in terms if k or c)

    def series(self) -> tuple[list[list[mpf]], list[list[mpf]], list[list[mpf]], list[list[mpf]]]:
        """Return coefficients of x, v, and of (S, N) of all contacts, by powers of time."""
        n = len(self.mass)
        x, v = [list(self.x)], [list(self.v)]
        slips: list[list[mpf]] = [[] for _ in self.contacts]
        normals: list[list[mpf]] = [[] for _ in self.contacts]
        laws = [LawSeries(c.friction) if isinstance(c.friction, FrictionLaw) else None for c in self.contacts]
        held = set()
        for contact, status in zip(self.contacts, self.statuses, strict=True):
            held |= {contact.normal} if status != "d" else set()
            held |= {contact.tangential} if status == "s" else set()
        for k in range(ORDER):
            load = [self.force[i] if k == 0 else mpf(0) for i in range(n)]
            for i in range(n):
                pairs = zip(self.stiffness[i], self.damping[i], x[k], v[k], strict=True)
                load[i] -= mp.fsum(a * p + c * q for a, c, p, q in pairs if a or c)
            for direction, offset, numbers in self.springs:
                stretch = [mp.fsum(d * row[i] for i, d in direction.items()) for row in x]
                stretch[0] -= offset
                power, force = [mpf(1)] + k * [mpf(0)], mpf(0)
                for number in numbers:
                    power = [mp.fsum(power[j] * stretch[m - j] for j in range(m + 1)) for m in range(k + 1)]
                    force += number * power[k]
                for i, d in direction.items():
                    load[i] -= d * force
            for i, (contact, status) in enumerate(zip(self.contacts, self.statuses, strict=True)):
                if status == "d":
                    continue
                if contact.normal is None:
                    normals[i].append(mpf(contact.normal_force) if k == 0 else mpf(0))
                else:
                    normals[i].append(-load[contact.normal])
                if status not in SIGN:
                    continue
                relative = v[k][contact.tangential] - (mpf(contact.slider_speed) if k == 0 else 0)
                slips[i].append(-SIGN[status] * relative)
                law = laws[i]
                if law is None:
                    push = mpf(contact.friction) * normals[i][k]
                else:
                    law.extend(slips[i])
                    push = mp.fsum(law.value[j] * normals[i][k - j] for j in range(k + 1))
                load[contact.tangential] += SIGN[status] * push
            x.append([p / (k + 1) for p in v[k]])
            v.append([mpf(0) if i in held else load[i] / self.mass[i] / (k + 1) for i in range(n)])
        return x, v, slips, normals

    def functions(self, x: list, v: list, slips: list, normals: list) -> list[tuple[int, str, list[mpf]]]:
        """Return the event functions as polynomials, by contact and what happens at their zeros."""
        found = []
        for i, (contact, status) in enumerate(zip(self.contacts, self.statuses, strict=True)):
            if status == "d":
                found.append((i, "gap", [row[contact.normal] for row in x[:ORDER]]))
                continue
            if status in SIGN:
                found.append((i, "slip", slips[i]))
                if contact.normal is not None:
                    found.append((i, "release", normals[i]))
                continue
            limit = mpf(contact.holding)
            required = [
                -self.residual(x[k], v[k], contact.tangential)
                if k == 0
                else -self.residual(x[k], v[k], contact.tangential) + self.force[contact.tangential]
                for k in range(ORDER)
            ]
            for kind, sign in (("+", -1), ("-", 1)):
                function = [limit * a + sign * b for a, b in zip(normals[i], required, strict=True)]
                found.append((i, kind, function))
        return found

    def step(self, until: mpf) -> bool:
        """Go on to the next event or the end of a series; False at `until`."""
        x, v, slips, normals = self.series()
        size = max(max(map(abs, v[0])), mpf(10) ** -6)
        last = max(max(abs(c) for c in v[k]) for k in (ORDER - 1, ORDER))
        width = (mpf(10) ** -44 * size / last) ** (mpf(1) / ORDER) if last else until - self.time
        width = min(width, until - self.time)
        first = None
        grid = np.arange(1, SAMPLES + 1) / SAMPLES
        for i, kind, function in self.functions(x, v, slips, normals):
            scaled = np.array([float(c * width**k) for k, c in enumerate(function)])
            values = np.polynomial.polynomial.polyval(grid, scaled)
            scale = np.abs(scaled).sum()
            # A function that leaves zero upwards is below rounding of floats at first.
            below = np.flatnonzero(values < -1e-15 * scale)
            if below.size == 0:
                continue
            at = self.root(function, width, below[0], scaled)
            if at is not None and (first is None or at < first[0]):
                first = (at, i, kind)
        at = width if first is None else first[0]
        self.x = [evaluated([row[k] for row in x], at) for k in range(len(self.x))]
        self.v = [evaluated([row[k] for row in v], at) for k in range(len(self.v))]
        self.time += at
        if first is None:
            return self.time < until
        self.happen(*first[1:])
        return True

    def root(self, function: list[mpf], width: mpf, index: int, scaled: np.ndarray) -> mpf | None:
        low, high = width * int(index) / SAMPLES, width * (int(index) + 1) / SAMPLES
        low = max(low, width * mpf(10) ** -9)
        if evaluated(function, low) <= 0:
            raise AssertionError("a function that does not leave zero upwards")
        for _ in range(12):
            middle = (low + high) / 2
            low, high = (middle, high) if evaluated(function, middle) > 0 else (low, middle)
        at = (low + high) / 2
        slope = [k * c for k, c in enumerate(function)][1:]
        for _ in range(7):
            at -= evaluated(function, at) / evaluated(slope, at)
        return at

    def happen(self, contact: int, kind: str) -> None:
        law, status = self.contacts[contact], self.statuses[contact]
        if kind == "release":
            self.statuses[contact] = "d"
        elif kind in SIGN:
            self.statuses[contact] = kind
        elif kind == "slip":
            self.v[law.tangential] = mpf(law.slider_speed)
            self.statuses[contact] = self.at_rest(contact)
        else:
            # Plastic; damping brings the jump of the velocity to the other contacts.
            self.x[law.normal] = self.v[law.normal] = mpf(0)
            for i, other in enumerate(self.contacts):
                if i != contact and (self.statuses[i] == "d" or other.normal is None):
                    continue
                if self.pressed(i) < 0:
                    self.statuses[i] = "d"
                    continue
                slip = self.v[other.tangential] - mpf(other.slider_speed)
                self.statuses[i] = self.at_rest(i) if slip == 0 else "-" if slip > 0 else "+"
        self.settle_exactly()
        if kind == "gap" or self.statuses[contact] != status or kind == "slip":
            self.events.append((self.time, contact, "".join(self.statuses)))

    def pressed(self, contact: int) -> mpf:
        law = self.contacts[contact]
        if law.normal is None:
            return mpf(law.normal_force)
        return -self.residual(self.x, self.v, law.normal)

    def at_rest(self, contact: int) -> str:
        law = self.contacts[contact]
        required = -self.residual(self.x, self.v, law.tangential)
        limit = mpf(law.holding) * self.pressed(contact)
        return "s" if abs(required) <= limit else "+" if required > limit else "-"

    def run(self, events: int, until: float) -> list[tuple[mpf, int, str]]:
        """Return (time, contact, combination) of the first events."""
        while len(self.events) < events and self.step(mpf(until)):
            pass
        return self.events[:events]


class LawSeries:
    """Coefficients of mu along a slip speed."""

    def __init__(self, law: FrictionLaw) -> None:
        self.law = law
        self.inner: list[mpf] = []
        self.value: list[mpf] = []

    def extend(self, slip: list[mpf]) -> None:
        k, law = len(slip) - 1, self.law
        if isinstance(law, Linear):
            self.value.append((mpf(law.mu0) if k == 0 else 0) + mpf(law.slope) * slip[k])
            return
        if isinstance(law, Tabulated):
            raise NotImplementedError
        assert isinstance(law, Stribeck | Rational)
        speed, kinetic = mpf(law.speed), mpf(law.kinetic)
        falling = mpf(law.static) - kinetic
        viscous = mpf(law.viscous) if isinstance(law, Stribeck) else mpf(0)
        if isinstance(law, Stribeck):
            new = (
                mp.exp(-slip[0] / speed)
                if k == 0
                else -mp.fsum(j * slip[j] * self.inner[k - j] for j in range(1, k + 1)) / (k * speed)
            )
        else:
            new = (
                1 / (1 + slip[0] / speed)
                if k == 0
                else -self.inner[0] * mp.fsum(slip[j] * self.inner[k - j] for j in range(1, k + 1)) / speed
            )
        self.inner.append(new)
        self.value.append(falling * new + viscous * slip[k] + (kinetic if k == 0 else 0))


def evaluated(coefficients: list[mpf], at: mpf) -> mpf:
    """Return the value of a polynomial."""
    value = mpf(0)
    for c in reversed(coefficients):
        value = value * at + c
    return value
