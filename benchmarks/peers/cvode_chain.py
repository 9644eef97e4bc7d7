"""CVODE by scikit-sundae for scenes of thousands of dofs, with one solver for all combinations.

Its products are sparse and its linear solver takes a band matrix.
Masses are lumped and every contact acts on two dofs of its own, so that with `r = F - C u - K x` a closed
contact takes `N = -r_n` and moves by `m u_t' = r_t + slope N`, or not at all while it sticks. Places and
velocities alternate in y, which gives the Jacobian a narrow band.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, Literal

import numpy as np
import scipy.sparse
from sksundae.cvode import CVODE

from peer_integrator import Motion
from peers.cvode import EVENT, MOST_STEPS
from peers.restart import OPEN, SLIPPING, Vector
from peers.solve_ivp import SCALES

#: Value of an event function that the status of its contact does not have.
FAR = 1.0
#: Event functions of a contact: gap or normal force, and what ends sliding or sticking.
KINDS = 3


class Chain:
    """The mechanics of a combination, which `set` changes contact by contact."""

    def __init__(self, scene: Any) -> None:
        self.size = scene.size
        self.mass = np.asarray(scene.mass)
        self.stiffness = scipy.sparse.csr_array(scene.stiffness)
        self.alpha, self.beta = scene.damping.mass, scene.damping.stiffness
        self.force = np.asarray(scene.force)
        contacts = scene.contacts
        self.tangential = np.array([contact.tangential for contact in contacts])
        self.normal = np.array([contact.normal for contact in contacts])
        self.friction = np.array([contact.friction for contact in contacts])
        self.static = np.array([contact.holding for contact in contacts])
        self.speed = np.array([contact.slider_speed for contact in contacts])
        self.gap = np.array([contact.gap for contact in contacts])
        self.status = np.array(["d"] * len(contacts))

    def residual(self, y: Vector) -> Vector:
        """Return F - C u - K x."""
        x, u = y[::2], y[1::2]
        return self.force - self.alpha * self.mass * u - self.stiffness @ (x + self.beta * u)

    def rates(self, _: float, y: Vector, rate: Vector) -> None:
        residual = self.residual(y)
        closed, sticking = self.status != "d", self.status == "s"
        normal = np.where(closed, -residual[self.normal], 0.0)
        slope = self.friction * np.select([self.status == "+", self.status == "-"], [1.0, -1.0], 0.0)
        residual[self.tangential] += slope * normal
        residual[self.normal[closed]] = 0.0
        residual[self.tangential[sticking]] = 0.0
        rate[::2] = y[1::2]
        rate[1::2] = residual / self.mass

    def watched(self, _: float, y: Vector, value: Vector) -> None:
        """Fill the event functions, three a contact."""
        residual = self.residual(y)
        normal, friction = -residual[self.normal], -residual[self.tangential]
        slip = y[2 * self.tangential + 1] - self.speed
        gap = y[2 * self.normal] + self.gap
        status, limit = self.status, self.static * normal
        sliding = (status == "+") | (status == "-")
        value[::KINDS] = np.select([status == "d", sliding], [gap, normal], FAR)
        value[1::KINDS] = np.select(
            [status == "+", status == "-", status == "s"], [-slip, slip, limit - friction], FAR
        )
        value[2::KINDS] = np.where(status == "s", limit + friction, FAR)

    def after(self, y: Vector, index: int) -> tuple[int, str]:
        """Take the event of a function: change y and the status; contact and kind."""
        contact, which = divmod(index, KINDS)
        before = self.status[contact]
        t, n = self.tangential[contact], self.normal[contact]
        if which == 0 and before == "d":
            kind, status = "impact", "+" if y[2 * t + 1] < self.speed[contact] else "-"
            y[2 * n] = y[2 * n + 1] = 0.0
            if -self.residual(y)[n] < 0.0:
                status = "d"
        elif which == 0:
            kind, status = "release", "d"
            y[2 * n] = max(y[2 * n], OPEN)
        elif before == "s":
            kind = "slip+" if which == 1 else "slip-"
            status = kind[-1]
            y[2 * t + 1] *= 1.0 - SLIPPING if status == "+" else 1.0 + SLIPPING
        else:
            kind = "velocity"
            y[2 * t + 1] = self.speed[contact]
            residual = self.residual(y)
            held = abs(residual[t]) <= self.static[contact] * -residual[n]
            # Friction along the slider, which is faster in `+`, against what pulls.
            status = "s" if held else "+" if residual[t] < 0.0 else "-"
            if not held:
                y[2 * t + 1] *= 1.0 - SLIPPING if status == "+" else 1.0 + SLIPPING
        self.status[contact] = status
        return contact, kind


def prepare(
    scene: Any, start: Any, duration: float, method: Literal["Adams", "BDF"], rtol: float, patience: float
) -> Callable[[], Motion]:
    """Return the run, which ends early after `patience` seconds."""
    chain = Chain(scene)
    entries = scipy.sparse.coo_array(chain.stiffness)
    reach = int(np.abs(entries.row - entries.col).max())
    partner = int(np.abs(chain.tangential - chain.normal).max())
    band = 2 * (reach + partner) + 1
    count = KINDS * len(chain.status)
    chain_events = chain.watched

    def watched(at: float, y: Vector, value: Vector) -> None:
        chain_events(at, y, value)

    watched.terminal = [True] * count  # type: ignore[attr-defined]
    watched.direction = [-1] * count  # type: ignore[attr-defined]
    cvode = CVODE(
        chain.rates,
        method=method,
        rtol=rtol,
        atol=rtol * np.tile(SCALES, scene.size),
        linsolver="band",
        lband=band,
        uband=band,
        eventsfn=watched,
        num_events=count,
        max_num_steps=MOST_STEPS,
    )

    def run() -> Motion:
        y = np.stack([start.position, start.velocity], axis=1).ravel()
        chain.status = np.array(list(start.combination))
        motion, now, begun = Motion(), 0.0, time.process_time()
        while time.process_time() - begun < patience:
            cvode.init_step(now, y)
            result = cvode.step(duration, "normal", duration)
            if not result.success:
                raise RuntimeError(result.message)
            if result.status != EVENT:
                break
            now, y = float(result.t), result.y.copy()
            contact, kind = chain.after(y, int(np.flatnonzero(result.i_events[-1])[0]))
            motion.time.append(now)
            motion.contact.append(contact)
            motion.kind.append(kind)
        return motion

    return run
