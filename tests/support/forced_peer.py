"""Motion under loads in time by other means: `solve_ivp`, with forces and slider speeds as functions of time.

Accelerations and contact forces of a combination solve the equations of `peer_integrator` at every instant,
with the loads of the instant on the right, and accelerations of vibrating sliders where contacts stick.
"""

import numpy as np
from scipy.integrate import solve_ivp

import stickslip as ss
from peer_integrator import Mechanics, Motion


class ForcedMechanics(Mechanics):
    """The mechanics of a scene with loads in time, whose contacts no impact couples."""

    def __init__(self, scene):
        super().__init__(scene)
        self.scene = scene
        self.systems = {}

    def load(self, time):
        """F and the loads of an instant, (n,)."""
        force = np.array(self.force, dtype=float)
        for load in self.scene.loads:
            entries = load.amplitude
            pairs = entries.items() if isinstance(entries, dict) else enumerate(entries)
            if isinstance(load, ss.Harmonic):
                factor = np.cos(2.0 * np.pi * load.frequency * time + load.phase)
            else:
                factor = load.values[np.searchsorted(load.times, time, side="right")]
            for dof, entry in pairs:
                force[self.scene.dofs.index(dof) if isinstance(dof, str) else dof] += factor * entry
        return force

    def speed(self, contact, time):
        """Speed and acceleration of a slider."""
        law = self.contacts[contact]
        wave = law.slider_vibration
        if wave is None:
            return law.slider_speed, 0.0
        rate = 2.0 * np.pi * wave.frequency
        argument = rate * time + wave.phase
        return law.slider_speed + wave.amplitude * np.cos(argument), -rate * wave.amplitude * np.sin(argument)

    def system(self, combination):
        """The inverse of the equations of a combination, and which rows are whose."""
        if combination not in self.systems:
            n, held, acting, owner = self.size, [], [], []
            for i, status in enumerate(combination):
                if status == "d":
                    continue
                slope = {"+": 1.0, "-": -1.0, "s": 0.0}[status] * self.contacts[i].friction
                held.append(self.normal[i])
                acting.append(self.normal[i] + slope * self.tangential[i])
                owner.append((i, "N", slope))
                if status == "s":
                    held.append(self.tangential[i])
                    acting.append(self.tangential[i])
                    owner.append((i, "T", 0.0))
            k = len(held)
            matrix = np.zeros((n + k, n + k))
            matrix[:n, :n] = self.mass
            for j in range(k):
                matrix[:n, n + j], matrix[n + j, :n] = -acting[j], held[j]
            self.systems[combination] = np.linalg.inv(matrix), owner
        return self.systems[combination]

    def solved(self, combination, time, y):
        """Accelerations, and (N, T) by contact."""
        inverse, owner = self.system(combination)
        n = self.size
        right = np.zeros(n + len(owner))
        right[:n] = self.load(time) - self.stiffness @ y[:n] - self.damping @ y[n:]
        for j, (i, name, _) in enumerate(owner):
            right[n + j] = self.speed(i, time)[1] if name == "T" else 0.0
        solution = inverse @ right
        forces = np.zeros((len(self.contacts), 2))
        for j, (i, name, slope) in enumerate(owner):
            force = solution[n + j]
            if name == "N":
                forces[i] = force, slope * force
            else:
                forces[i, 1] = force
        return solution[:n], forces

    def functions(self, combination):
        """(contact, kind, function of time and state), positive while the combination holds."""
        found = []

        def slip(i, sign):
            return lambda t, y: sign * (self.tangential[i] @ y[self.size :] - self.speed(i, t)[0])

        def cone(i, sign):
            def value(t, y):
                normal, friction = self.solved(combination, t, y)[1][i]
                return self.static[i] * normal + sign * friction

            return value

        def pressed(i):
            return lambda t, y: self.solved(combination, t, y)[1][i, 0]

        def gap(i):
            return lambda t, y: self.normal[i] @ y[: self.size] + self.contacts[i].gap

        for i, status in enumerate(combination):
            if status in "+-":
                found.append((i, "release", pressed(i)))
                found.append((i, "velocity", slip(i, -1.0 if status == "+" else 1.0)))
            elif status == "s":
                found += [(i, "slip+", cone(i, -1.0)), (i, "slip-", cone(i, 1.0))]
            else:
                found.append((i, "impact", gap(i)))
        return found

    def following(self, combination, time, y, contact, kind):
        """Combination and state after an event."""

        def having(status):
            return combination[:contact] + status + combination[contact + 1 :]

        if kind == "release":
            return having("d"), y
        if kind in ("slip+", "slip-"):
            return having(kind[-1]), y
        y = y.copy()
        direction = self.normal[contact] if kind == "impact" else self.tangential[contact]
        response = self.normal_response if kind == "impact" else self.tangential_response
        if kind == "impact":
            speed = direction @ y[self.size :]
            y[self.size :] -= (1.0 + self.contacts[contact].restitution) * speed * response[contact]
            if self.contacts[contact].restitution > 0.0:
                return combination, y
            slip = self.tangential[contact] @ y[self.size :] - self.speed(contact, time)[0]
            closed = having("+" if slip < 0.0 else "-")
            return (closed if self.solved(closed, time, y)[1][contact, 0] >= 0.0 else combination), y
        slip = direction @ y[self.size :] - self.speed(contact, time)[0]
        y[self.size :] -= slip * response[contact]
        normal, friction = self.solved(having("s"), time, y)[1][contact]
        limit = self.static[contact] * normal
        return having("s" if abs(friction) <= limit else "+" if friction > 0.0 else "-"), y


def integrate_forced(scene, start, duration, *, longest_step=2e-3, rtol=1e-12):
    """The motion by DOP853, started again at every event and every switch of a load."""
    mechanics = ForcedMechanics(scene)
    y, combination, time, motion = (
        np.concatenate([start.position, start.velocity]),
        start.combination,
        0.0,
        Motion(),
    )
    switches = sorted(
        {t for load in scene.loads if isinstance(load, ss.Switched) for t in load.times if t < duration}
    )
    switches.append(duration)
    while True:
        functions = mechanics.functions(combination)
        watched = []
        for _, _, function in functions:

            def event(t, y, function=function):
                return function(t, y)

            event.terminal, event.direction = True, -1.0
            watched.append(event)
        solution = solve_ivp(
            lambda t, y, c=combination: np.concatenate([y[scene.size :], mechanics.solved(c, t, y)[0]]),
            (time, switches[0]),
            y,
            method="DOP853",
            rtol=rtol,
            atol=1e-13,
            max_step=longest_step,
            events=watched,
        )
        assert solution.success, solution.message
        if solution.status == 0:
            time, y = switches.pop(0), solution.y[:, -1]
            if not switches:
                motion.end_state = y
                return motion
            motion.time.append(time)
            motion.contact.append(-1)
            motion.kind.append("load")
            motion.combination.append(combination)
            continue
        index = next(k for k, found in enumerate(solution.t_events) if found.size)
        contact, kind, _ = functions[index]
        time = float(solution.t_events[index][0])
        combination, y = mechanics.following(combination, time, solution.y_events[index][0], contact, kind)
        motion.time.append(time)
        motion.contact.append(contact)
        motion.kind.append(kind)
        motion.combination.append(combination)
