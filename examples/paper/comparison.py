"""The published model computed end to end and compared with every published number."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from decimal import Decimal
from functools import cache
from typing import Any, Literal

from paper.numbers import (
    TABLE_1_FREQUENCIES,
    Misprint,
    agrees,
    mislabel,
    misprint,
    published,
)
from stickslip.cycles.cycle import Cycle
from stickslip.locus.critical import critical_points
from stickslip.modes.complex_modes import complex_modes
from stickslip.scene.checks import Real
from stickslip.scene.models import two_subsystems
from stickslip.scene.scene import Scene
from stickslip.scene.state import steady_sliding
from stickslip.transient.simulate import simulate
from stickslip.transient.trajectory import Trajectory

#: Displacement whose spectrum is published: vertical of the first upper mass.
UPPER_VERTICAL = "x2"
#: Friction over which critical values are looked for.
FRICTIONS = (0.0, 3.0)

Verdict = Literal["agrees", "erratum", "differs", "not printed"]


@dataclass(frozen=True)
class Row:
    """One published quantity beside the computed one."""

    source: str
    quantity: str
    published: str
    computed: str
    difference: str
    verdict: Verdict
    note: str = ""


def rows() -> list[Row]:
    """Compute every published quantity of the record, in its order."""
    record = published()
    return [
        *_natural_frequencies(record["natural_frequencies_mu0"]),
        *_critical_frictions(record["critical_friction"]),
        *(row for table in record["status_frequencies"] for row in _status_frequencies(table)),
        *(row for cycle in record["limit_cycles"] for row in _limit_cycle(cycle)),
    ]


def standard_run(duration: float = 0.6) -> Trajectory:
    """Return the standard run: friction 1.5, slider speed 0.025 m/s, x1' = 1e-3 m/s beside equilibrium."""
    scene = two_subsystems()
    return simulate(scene, duration, steady_sliding(scene).perturbed(velocity={"x1": 1e-3}))


@cache
def attractor(friction: Decimal, slider_speed: Decimal) -> tuple[Trajectory, Cycle]:
    """Return the motion from the published start, and what it settles to."""
    scene = two_subsystems(friction=float(friction), slider_speed=float(slider_speed))
    run = simulate(scene, 0.6, steady_sliding(scene).perturbed(velocity={"x1": 1e-3}))
    return run, run.limit_cycle()


def frequencies(scene: Scene, combination: str) -> Real:
    """Return one frequency per conjugate pair or real eigenvalue, ascending, Hz."""
    return complex_modes(scene, combination).frequencies


def critical_frictions() -> tuple[float, float, float]:
    """Return where the first and the second pair become unstable, and where their growth rates cross."""
    points = critical_points(two_subsystems(), {"friction": FRICTIONS})
    first, second = (point.value for point in points if point.kind == "hopf")
    # Below the first Hopf point the lead passes between modes that all decay.
    (crossing,) = (point.value for point in points if point.kind == "crossing" and point.value > second)
    return first, second, crossing


def _natural_frequencies(record: dict[str, Any]) -> Iterator[Row]:
    label = "friction 0: natural frequency {}, Hz"
    computed = frequencies(two_subsystems(friction=0.0), record["status"])
    for number, (printed, value) in enumerate(zip(record["hz"], computed, strict=True), start=1):
        yield _number(record["figure"], label.format(number), printed, float(value))
    # The first erratum is shown by computing what its labels lead to.
    stated_all = " and ".join(str(stated) for stated in TABLE_1_FREQUENCIES)
    note = f"k3, k4, k5, k7, k8 as printed in Table 1, against the matrix of Eq. 21, give {stated_all} Hz"
    mislabelled = frequencies(two_subsystems(friction=0.0, labels="printed"), record["status"])
    for number, (printed, stated) in enumerate(zip(record["hz"], TABLE_1_FREQUENCIES, strict=False)):
        value = float(mislabelled[number])
        yield Row(
            "Table 1",
            label.format(number + 1),
            str(printed),
            f"{value:.4f}",
            f"{value - float(printed):+.4f}",
            "erratum" if agrees(stated, value) else "differs",
            note,
        )


def _critical_frictions(record: dict[str, Any]) -> Iterator[Row]:
    names = {
        "first_hopf": "friction at the first Hopf point",
        "second_hopf": "friction at the second Hopf point",
        "real_parts_cross": "friction where the real parts cross",
    }
    for (key, name), value in zip(names.items(), critical_frictions(), strict=True):
        yield _number(record["figure"], name, record[key], value, digits=10)


def _status_frequencies(record: dict[str, Any]) -> Iterator[Row]:
    scene = two_subsystems(friction=float(record["friction"]))
    status = record["status"]
    computed = frequencies(scene, status)
    for column, (printed, value) in enumerate(zip(record["hz"], computed, strict=True)):
        name = f"friction {record['friction']}, {status}: frequency {column + 1}, Hz"
        erratum = misprint(record["table"], status, column)
        if erratum is None:
            yield _number(record["table"], name, printed, float(value))
        else:
            confirmed = _misprint_confirmed(erratum, printed, float(value), scene)
            yield _number(record["table"], name, printed, float(value), record["erratum"], confirmed)


def _misprint_confirmed(erratum: Misprint, printed: Decimal, computed: float, scene: Scene) -> bool:
    if not agrees(erratum.model, computed):
        return False
    if erratum.printed_from is None:
        return True
    return any(agrees(printed, float(value)) for value in frequencies(scene, erratum.printed_from))


def _number(
    source: str,
    quantity: str,
    printed: Decimal,
    computed: float,
    note: str = "",
    erratum: bool = False,
    digits: int = 4,
) -> Row:
    verdict: Verdict = "erratum" if erratum else "agrees" if agrees(printed, computed) else "differs"
    difference = f"{computed - float(printed):+.{digits}f}"
    return Row(source, quantity, str(printed), f"{computed:.{digits}f}", difference, verdict, note)


def _limit_cycle(record: dict[str, Any]) -> Iterator[Row]:
    friction, speed, source = record["friction"], record["slider_speed"], record["figure"]
    run, cycle = attractor(friction, speed)
    place = f"friction {friction}, slider speed {speed}:"
    if "statuses" in record:
        yield _statuses(record, cycle, f"{place} statuses")
    if "main_frequency_hz" in record:
        value = cycle.main_frequency(UPPER_VERTICAL)
        yield _number(source, f"{place} main frequency, Hz", record["main_frequency_hz"], value)
    if "period_doubled" in record:
        # The motion repeats after two periods of its main line.
        doubled = cycle.main_harmonic(UPPER_VERTICAL) == 2
        same = doubled == record["period_doubled"]
        words = {True: "doubled", False: "single"}
        yield Row(
            source,
            f"{place} period",
            words[record["period_doubled"]],
            f"{words[doubled]}, {1e3 * cycle.period:.4f} ms",
            "" if same else "not the same",
            "agrees" if same else "differs",
        )
    if "first_status_change_after_s" in record:
        printed = record["first_status_change_after_s"]
        yield _number(source, f"{place} first status change, s", printed, float(run.events.time[0]))


def _statuses(record: dict[str, Any], cycle: Cycle, quantity: str) -> Row:
    computed = set(cycle.combinations)
    shown = " ".join(sorted(computed))
    if record["statuses"] is None:
        return Row(record["figure"], quantity, "-", shown, "", "not printed", record["note"])
    printed = set(record["statuses"])
    missing, extra = sorted(printed - computed), sorted(computed - printed)
    difference = f"{' '.join(missing)} → {' '.join(extra)}" if printed != computed else ""
    verdict: Verdict = "agrees" if printed == computed else "differs"
    erratum = mislabel(record["friction"], record["slider_speed"])
    if erratum is not None and (missing, extra) == ([erratum.printed], [erratum.model]):
        verdict = "erratum"
    return Row(
        record["figure"],
        quantity,
        " ".join(sorted(printed)),
        shown,
        difference,
        verdict,
        record.get("note", ""),
    )
