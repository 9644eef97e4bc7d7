"""The published model of two subsystems: every printed number, and two solutions with 220 bits."""

from collections import Counter

import numpy as np
from paper import comparison as reproduce
from paper.numbers import published

import stickslip as ss
from reference_runs import reference_solution
from verification.case import Case, Quantity

RUNS = {
    "friction 1.5": "paper-mu1.5-v0.025",
    "friction 2.2": "paper-mu2.2-v0.05",
}
#: Tolerances of event times, s, and of the shift in time that errors at the end may amount to, s.
TIME, SHIFT = 4e-14, 2e-12


#: Numbers and sets that the paper prints and the program computes, and those of them that are misprints.
PRINTED, ERRATA = 96, 7


def printed():
    """Count the printed quantities by what the comparison says of them."""
    verdicts = Counter(row.verdict for row in reproduce.rows() if row.verdict != "not printed")
    expected = {"agrees": PRINTED - ERRATA, "erratum": ERRATA, "differs": 0}
    return [
        Quantity(name=f"printed quantities: {what}", unit="", expected=count, computed=verdicts[what])
        for what, count in expected.items()
    ]


def solutions():
    """Compare events and end of both runs with the solutions of 220 bits."""
    rows = []
    for where, name in RUNS.items():
        reference = reference_solution(name)
        run = ss.simulate(reference.scene, reference.duration, reference.start)
        assert np.array_equal(run.events.contact, reference.contact)
        assert np.array_equal(run.events.kind, reference.kind)
        assert np.array_equal(run.events.combination, reference.combination)
        end, n = run.state(run.duration), run.scene.size
        exact = reference.end_state
        errors = [
            ("largest error of a time", "s", run.events.time - reference.time, TIME),
            ("largest error of x at the end", "m", end.position - exact[:n], SHIFT * 0.1),
            ("largest error of x' at the end", "m/s", end.velocity - exact[n:], SHIFT * 500.0),
        ]
        rows.append(
            Quantity(name=f"{where}: events", unit="", expected=len(reference.time), computed=len(run.events))
        )
        rows += [
            Quantity(
                name=f"{where}: {what}", unit=unit, expected=0, computed=np.abs(error).max(), absolute=limit
            )
            for what, unit, error, limit in errors
        ]
    return rows


CASES = [
    Case(
        title="Two subsystems: what the paper prints",
        source=f"{published()['source']}.",
        model=(
            "`ss.models.two_subsystems`, see [theory](theory.md): natural frequencies, critical frictions, "
            "frequencies of every status combination, and status sets, main frequencies and first events "
            "of the limit cycles. `make reproduce` lists them one by one."
        ),
        tolerance=(
            "A printed number agrees if the computed one differs by less than one unit of its last digit. "
            "Misprints are those that the errata there explain."
        ),
        quantities=printed,
    ),
    Case(
        title="Two subsystems: solutions with 220 bits",
        source=(
            "The same model. The reference solutions were computed with 220 bits by another program; they "
            "lie in `tests/reference`."
        ),
        model=(
            "Friction 1.5 and slider speed 0.025 m/s over 0.6 s, and friction 2.2 and 0.05 m/s, with "
            "lift-off, over 0.3 s; both from steady sliding with x1' = 1 mm/s added. Contacts, kinds and "
            "combinations of all events are the same."
        ),
        tolerance=(
            "Times: 4e-14 s, some hundred ulp of 0.6 s, as every event passes its rounding on to the next. "
            "Displacements and velocities at the end: what 2e-12 s makes of them at 0.1 m/s and 500 m/s^2."
        ),
        quantities=solutions,
    ),
]
