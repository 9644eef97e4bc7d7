"""The same mechanics by other means: contact forces as multipliers, motion by a Runge-Kutta method.

Nothing is shared with the package but the scene. In a combination the accelerations and contact forces solve

    [ M  -D ] [ a ]   [ F - C u - K x ]
    [ E   0 ] [ f ] = [ 0             ]

with one unknown force per constrained direction, so that y' = G y + h and every contact force is affine in y.
`solve_ivp` runs from event to event and is started again after each.
"""

import itertools
from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import solve_ivp

import stickslip as ss

#: Depth, m, below which a gap that was closed to rounding, and pulled open at once, counts as closed again.
ROUNDING = 1e-16
#: Part of the speed of an impact that is rounding of the velocities that it changes.
LIFTED = 1e-12
#: Events at one instant that the contacts can explain.
MOST_AT_ONCE = 4


@dataclass
class Motion:
    time: list = field(default_factory=list)
    contact: list = field(default_factory=list)
    kind: list = field(default_factory=list)
    combination: list = field(default_factory=list)
    #: y = (x, x') after each event
    states: list = field(default_factory=list)
    #: y at the end
    end_state: np.ndarray | None = None

    def labels(self):
        return list(zip(self.contact, self.kind, self.combination, strict=True))


class Mechanics:
    """The linear mechanics of a scene in each of its combinations."""

    def __init__(self, scene):
        def dense(matrix):
            return matrix.toarray() if hasattr(matrix, "toarray") else np.asarray(matrix)

        self.size = scene.size
        self.mass = np.diag(scene.mass) if scene.mass.ndim == 1 else dense(scene.mass)
        self.stiffness = dense(scene.stiffness)
        if scene.damping is None:
            self.damping = np.zeros_like(self.stiffness)
        elif hasattr(scene.damping, "stiffness"):
            self.damping = scene.damping.mass * self.mass + scene.damping.stiffness * self.stiffness
        else:
            self.damping = dense(scene.damping)
        #: C of what dissipates; the motion feels C + G and K + H.
        self.dissipative = self.damping
        if scene.gyroscopic is not None:
            self.damping = self.damping + dense(scene.gyroscopic)
        if scene.circulatory is not None:
            self.stiffness = self.stiffness + dense(scene.circulatory)
        self.force = scene.force
        self.contacts = scene.contacts
        self.normal = [scene.normal_direction(i) for i in range(len(scene.contacts))]
        self.tangential = [scene.tangential_direction(i) for i in range(len(scene.contacts))]
        self.normal_response = [self._response(d) for d in self.normal]
        self.tangential_response = [self._response(d) for d in self.tangential]
        self.static = [c.friction if c.static_friction is None else c.static_friction for c in scene.contacts]
        self.known = {}

    def linear(self, combination):
        """G and h of y' = G y + h, and for each contact (N, T) as (row, constant) pairs."""
        if combination not in self.known:
            self.known[combination] = self._linear(combination)
        return self.known[combination]

    def _linear(self, combination):
        n = self.size
        held, acting, owner = [], [], []
        given, load_of_friction = {}, np.zeros(n)
        for i, status in enumerate(combination):
            if status == "d":
                continue
            slope = {"+": 1.0, "-": -1.0, "s": 0.0}[status] * self.contacts[i].friction
            if self.contacts[i].normal is None:
                given[i] = self.contacts[i].normal_force
                load_of_friction += slope * given[i] * self.tangential[i]
                if status == "s":
                    held.append(self.tangential[i])
                    acting.append(self.tangential[i])
                    owner.append((i, "T", 0.0))
                continue
            held.append(self.normal[i])
            acting.append(self.normal[i] + slope * self.tangential[i])
            owner.append((i, "N", slope))
            if status == "s":
                held.append(self.tangential[i])
                acting.append(self.tangential[i])
                owner.append((i, "T", 0.0))
        k = len(held)
        system = np.zeros((n + k, n + k))
        system[:n, :n] = self.mass
        for j in range(k):
            system[:n, n + j] = -acting[j]
            system[n + j, :n] = held[j]
        load = np.zeros((n + k, 2 * n + 1))
        load[:n, :n], load[:n, n : 2 * n], load[:n, 2 * n] = -self.stiffness, -self.damping, self.force
        load[:n, 2 * n] += load_of_friction
        solved = np.linalg.solve(system, load)
        generator = np.zeros((2 * n, 2 * n))
        generator[:n, n:] = np.eye(n)
        generator[n:] = solved[:n, : 2 * n]
        offset = np.concatenate([np.zeros(n), solved[:n, 2 * n]])
        none = (np.zeros(2 * n), 0.0)
        forces = [[none, none] for _ in self.contacts]
        for i, normal_force in given.items():
            slope = {"+": 1.0, "-": -1.0, "s": 0.0}[combination[i]] * self.contacts[i].friction
            forces[i] = [(none[0], normal_force), (none[0], slope * normal_force)]
        for j, (i, name, slope) in enumerate(owner):
            row, constant = solved[n + j, : 2 * n], solved[n + j, 2 * n]
            if name == "N":
                forces[i] = [(row, constant), (slope * row, slope * constant)]
            else:
                forces[i][1] = (row, constant)
        return generator, offset, forces

    def event_functions(self, combination):
        """(contact, kind, row, constant): positive while the combination holds."""
        n = self.size
        forces = self.linear(combination)[2]
        functions = []
        for i, status in enumerate(combination):
            (normal, normal0), (friction, friction0) = forces[i]
            if status in "+-":
                if self.contacts[i].normal is not None:
                    functions.append((i, "release", normal, normal0))
                if self.static[i] > 0.0:
                    sign = -1.0 if status == "+" else 1.0
                    row = np.concatenate([np.zeros(n), sign * self.tangential[i]])
                    functions.append((i, "velocity", row, -sign * self.contacts[i].slider_speed))
            elif status == "s":
                for kind, sign in (("slip+", -1.0), ("slip-", 1.0)):
                    row = self.static[i] * normal + sign * friction
                    functions.append((i, kind, row, self.static[i] * normal0 + sign * friction0))
            else:
                row = np.concatenate([self.normal[i], np.zeros(n)])
                functions.append((i, "impact", row, self.contacts[i].gap))
        return functions

    def contact_force(self, combination, y, contact):
        (normal, normal0), (friction, friction0) = self.linear(combination)[2][contact]
        return normal @ y + normal0, friction @ y + friction0

    def slip(self, y, contact):
        return self.tangential[contact] @ y[self.size :] - self.contacts[contact].slider_speed

    def after(self, combination, y, contact, kind):
        """Combination and state after an event."""

        def with_status(status):
            return combination[:contact] + status + combination[contact + 1 :]

        if kind == "velocity":
            y = self._shifted(y, self.tangential_response[contact], -self.slip(y, contact))
            normal, friction = self.contact_force(with_status("s"), y, contact)
            limit = self.static[contact] * normal
            status = "s" if abs(friction) <= limit else "+" if friction > 0.0 else "-"
        elif kind == "release":
            status = "d"
        elif kind in ("slip+", "slip-"):
            status = kind[-1]
        else:
            return self._after_impact(combination, y, contact)
        return with_status(status), y

    def _after_impact(self, combination, y, contact):
        """Impulses along the normals of all that touch: ``0 <= p``, ``0 <= w+ + e w-``, one of them zero."""
        closed = [i for i, status in enumerate(combination) if status != "d" and self.normal[i].any()]
        touching = [contact, *closed]
        normals = np.array([self.normal[i] for i in touching])
        spread = np.linalg.solve(self.mass, normals.T)
        # Closed gaps are at rest.
        speed = np.concatenate([[normals[0] @ y[self.size :]], np.zeros(len(closed))])
        wanted = -self.contacts[contact].restitution * speed[0]
        impulse = nonnegative_impulses(normals @ spread, speed - np.eye(len(touching))[0] * wanted)
        change = spread @ impulse
        y = y.copy()
        y[self.size :] += change
        rising = {i for i in closed if self.normal[i] @ change > LIFTED * abs(speed[0])}
        combination = "".join("d" if i in rising else status for i, status in enumerate(combination))
        if self.contacts[contact].restitution > 0.0:
            return combination, y
        direction = self.normal[contact]
        y[: self.size] -= direction * (direction @ y[: self.size] + self.contacts[contact].gap)
        status = "+" if self.contacts[contact].tangential is None or self.slip(y, contact) < 0.0 else "-"
        closed = combination[:contact] + status + combination[contact + 1 :]
        return (combination if self.contact_force(closed, y, contact)[0] < 0.0 else closed), y

    def _response(self, direction):
        """The velocities that change with a unit of the velocity of `direction`, by an impulse along it."""
        response = np.linalg.solve(self.mass, direction)
        if not direction.any():
            return response
        return response / (direction @ response)

    def _shifted(self, y, response, change):
        shifted = y.copy()
        shifted[self.size :] += change * response
        return shifted


def nonnegative_impulses(w, speed):
    """The p of ``0 <= p``, ``0 <= speed + W p``, ``p' (speed + W p) = 0``, by trying which are not zero."""
    for count in range(1, len(speed) + 1):
        for active in itertools.combinations(range(len(speed)), count):
            p = np.zeros(len(speed))
            p[list(active)] = np.linalg.solve(w[np.ix_(active, active)], -speed[list(active)])
            if p.min() >= 0.0 and (speed + w @ p).min() >= -LIFTED * np.abs(speed).max():
                return p
    raise AssertionError("no impulses")


def integrate(scene, start, duration, *, rtol=1e-12, longest_step=1e-4):
    """The motion by DOP853 with restarts; absolute tolerances follow the size of x and x'.

    Two zeros of an event function within a step are missed, or found as the one it starts from (None is
    returned then), and zeros are found on the dense output, whose error has order 7: the longest step, s, is
    what decides.
    """
    mechanics = Mechanics(scene)
    y = np.concatenate([start.position, start.velocity])
    atol = np.concatenate([np.full(scene.size, 1e-4 * rtol), np.full(scene.size, 1e-1 * rtol)])
    combination, time, motion = start.combination, 0.0, Motion()
    while True:
        generator, offset, _ = mechanics.linear(combination)
        functions = mechanics.event_functions(combination)
        functions = [
            (i, kind, row, constant + ROUNDING * (kind == "impact" and abs(row @ y + constant) < ROUNDING))
            for i, kind, row, constant in functions
        ]
        watched = [_watched(row, constant) for _, _, row, constant in functions]
        solution = solve_ivp(
            lambda _, y, g=generator, h=offset: g @ y + h,
            (time, duration),
            y,
            method="DOP853",
            rtol=rtol,
            atol=atol,
            max_step=longest_step,
            events=watched,
        )
        assert solution.success, solution.message
        if solution.status == 0:
            motion.end_state = solution.y[:, -1]
            return motion
        index = next(k for k, found in enumerate(solution.t_events) if found.size)
        contact, kind, _, _ = functions[index]
        time = float(solution.t_events[index][0])
        before = combination
        combination, y = mechanics.after(combination, solution.y_events[index][0], contact, kind)
        if motion.time[-MOST_AT_ONCE:] == [time] * MOST_AT_ONCE:
            return None
        # Contacts that an impact lifts are released at the same instant.
        pairs = zip(before, combination, strict=True)
        lifted = [i for i, (one, new) in enumerate(pairs) if one != new == "d"]
        happened = [(i, "release") for i in lifted if i != contact]
        for i, what in sorted([*happened, (contact, kind)]):
            motion.time.append(time)
            motion.contact.append(i)
            motion.kind.append(what)
            motion.combination.append(combination)
            motion.states.append(y)


def _watched(row, constant):
    def function(_, y):
        return row @ y + constant

    function.terminal = True
    function.direction = -1.0
    return function


#: Longest steps of the peer, s. The shorter ones are for scenes with two zeros within a longer step.
STEPS = (1e-4, 1e-5, 1e-6)


def assert_same_motion(scene, start, duration, floor=1e-11):
    run = ss.simulate(scene, duration, start)
    events = run.events
    ours = list(zip(events.contact, events.kind, events.combination, strict=True))
    for step in STEPS:
        rough = integrate(scene, start, duration, longest_step=2 * step)
        fine = integrate(scene, start, duration, longest_step=step)
        if rough is not None and fine is not None and rough.labels() == fine.labels() == ours:
            break
    else:
        assert ours == ([] if fine is None else fine.labels())
    n = scene.size
    position, velocity = run.event_states()
    end = run.state(duration)
    states = np.vstack([np.hstack([position, velocity]), np.concatenate([end.position, end.velocity])])
    theirs, roughly = (np.vstack([*motion.states, motion.end_state]) for motion in (fine, rough))
    scale = np.repeat([np.abs(theirs[:, :n]).max(), np.abs(theirs[:, n:]).max()], n)
    # What the peer changes by from steps twice as long, fourfold: at an impact of 2e-3 m/s rounding of its
    # event functions adds as much.
    # Beside that the tolerance of a step adds up over some hundred, and a slow impact multiplies it.
    own_error = 4 * np.abs((theirs - roughly) / scale).max() + max(floor, 5e-11)
    assert own_error < 1e-5, "the peer is too far off to say anything"
    assert np.abs((states - theirs) / scale).max() <= own_error
    times = np.array([fine.time, rough.time])
    time_error = 4 * np.abs(times[0] - times[1]).max(initial=0.0) + 1e-12 * duration
    assert np.abs(events.time - times[0]).max(initial=0.0) <= time_error
    return run
