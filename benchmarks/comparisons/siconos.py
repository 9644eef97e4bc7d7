"""Beside Siconos: time stepping on a mass that sticks and slips on a belt, error over step beside time.

Both programs follow the same mass from the same start. The reference is the closed form of both phases in 40
digits. The errors are those of position and velocity at the end and, of the times of events, the largest.
Times are processor time of the run alone, the least over all rounds, without the import and the set-up.
"""

from __future__ import annotations

from clock import clocked
from mpmath import mp, mpf

import stickslip as ss
from comparisons.peer import ask, milliseconds, options
from report import Report

#: kg, N/m, N s/m, m/s, N: the damping below zero stands for friction that falls with the slip speed.
MASS, STIFFNESS, DAMPING, BELT, NORMAL, FRICTION = 1.0, 1.0, -0.05, 1.0, 1.0, 0.5
#: s: five cycles and a half.
DURATION = 34.0
STEPS = (1e-1, 1e-2, 1e-3, 1e-4)
#: Weight of the new velocity in the theta scheme: half, and one for the implicit Euler scheme.
THETAS = (0.5, 1.0)
ROUNDS = 5
REMEDY = "install Siconos (Debian: python3-siconos) and name the interpreter that imports it"


def exact() -> tuple[list[mpf], mpf, mpf]:
    """Return the times of the events, and position and velocity at the end, in 40 digits."""
    mp.dps = 40
    m, k, c, belt = map(mpf, (MASS, STIFFNESS, DAMPING, BELT))
    rest, decay = mpf(FRICTION) * NORMAL / k, c / (2 * m)
    turn = mp.sqrt(k / m - decay**2)
    # Sticking ends where spring and damper take all friction.
    onset = rest - c * belt / k
    from_rest, slope = onset - rest, (belt + decay * (onset - rest)) / turn

    def slip(t: mpf) -> tuple[mpf, mpf]:
        """Return position and velocity a time after the onset of slip."""
        fade, cosine, sine = mp.exp(-decay * t), mp.cos(turn * t), mp.sin(turn * t)
        away = fade * (from_rest * cosine + slope * sine)
        return rest + away, -decay * away + fade * turn * (slope * cosine - from_rest * sine)

    lasting = mp.findroot(lambda t: slip(t)[1] - belt, 2 * mp.pi * mpf("0.97"))
    caught = slip(lasting)[0]
    events, now = [], onset / belt
    while now < DURATION:
        events.append(now)
        now += lasting if len(events) % 2 else (onset - caught) / belt
    if len(events) % 2 == 0:
        raise SystemExit(f"DURATION = {DURATION:g}: the reference needs an end while the mass slips")
    return events, *slip(DURATION - events[-1])


def error(value: float, expected: mpf) -> str:
    return f"{float(abs(mpf(value) - expected)):.1e}"


def main() -> None:
    """Print the table."""
    chosen = options(__doc__, "python3", "an interpreter that imports siconos").parse_args()
    events, position, velocity = exact()
    question = {
        "mass": MASS, "stiffness": STIFFNESS, "damping": DAMPING, "belt": BELT, "normal": NORMAL,
        "friction": FRICTION, "duration": DURATION, "steps": STEPS, "thetas": THETAS, "rounds": ROUNDS,
    }  # fmt: skip
    contact = ss.Contact(tangential=0, normal_force=NORMAL, friction=FRICTION, slider_speed=BELT)
    scene = ss.Scene([MASS], [[STIFFNESS]], damping=[[DAMPING]], contacts=[contact])
    start = ss.State([0.0], [BELT], "s")
    rounds = [clocked(lambda: ss.simulate(scene, DURATION, start)) for _ in range(ROUNDS)]
    run = rounds[0][1]
    if len(run.events.time) != len(events):
        raise SystemExit(f"{len(run.events.time)} events, of which the closed form has {len(events)}")
    late = max(abs(mpf(float(t)) - e) for t, e in zip(run.events.time, events, strict=True))
    end = run.state(DURATION)
    ends = error(end.position[0], position), error(end.velocity[0], velocity)
    own = min(taken for taken, _ in rounds)
    rows = [
        ["stickslip", "from event to event", str(len(events)), milliseconds(own), *ends, f"{float(late):.1e}"]
    ]
    answer = ask(chosen.peer, "siconos", question, REMEDY)
    for one in answer["runs"]:
        setting, steps = f"step {one['step']:g} s", str(round(DURATION / one["step"]))
        ends = error(one["position"], position), error(one["velocity"], velocity)
        name = f"Siconos, theta = {one['theta']:g}"
        rows.append([name, setting, steps, milliseconds(one["time"]), *ends, "-"])
    report = Report("siconos")
    report.table(
        (
            "program",
            "setting",
            "events or steps",
            "ms",
            "position at the end, m",
            "velocity, m/s",
            "events, s",
        ),
        rows,
    )
    report.finish(chosen.into, "stickslip", "mpmath", peers=answer["version"])


if __name__ == "__main__":
    main()
