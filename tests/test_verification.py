"""Every case of the verification manual agrees, and the page says what is computed."""

import dataclasses
import re
from functools import cache
from pathlib import Path

import pytest

import verification
from nightly import nightly
from verification import CASES, manual
from verification.case import Quantity, mp

pytestmark = pytest.mark.slow

EPS = 2.0**-52


@cache
def quantities(index):
    return CASES[index].quantities()


def parts(text):
    """The introduction of a page, and its sections."""
    return re.split(r"\n(?=## )", text)


#: Cases that take longest.
NIGHTLY = (
    "Mass on a belt under a cubic law of friction",
    "Mode coupling with a cubic contact spring",
    "Block on a Stribeck belt",
    "Bistable mass on a belt, with the basin of sliding",
    "Slider of rate and state",
)


@pytest.mark.parametrize(
    "index",
    nightly(range(len(CASES)), lambda index: CASES[index].title in NIGHTLY),
    ids=[case.title for case in CASES],
)
def test_a_case_agrees_and_the_page_says_so(index):
    """All but the last digits is the same text; the digits on the page lie within the tolerance."""
    assert quantities(index)
    for quantity in quantities(index):
        assert quantity.agrees, (quantity.name, quantity.expected, quantity.computed)
        assert quantity.matches_reference, (quantity.name, quantity.expected, quantity.reference)
    section = parts(manual.PAGE.read_text(encoding="utf-8"))[1 + index]
    written, taken = manual.masked(section)
    fresh, _ = manual.masked(manual.section(CASES[index], quantities(index)))
    assert written == fresh, "docs/verification.md: make verify writes it anew"
    for quantity, (computed, difference, relative) in zip(quantities(index), taken, strict=True):
        shown = dataclasses.replace(quantity, computed=float(computed))
        assert shown.agrees, (quantity.name, computed)
        # Two digits are shown.
        assert float(difference) == pytest.approx(shown.difference, rel=0.06, abs=EPS * abs(shown.computed))
        if quantity.expected:
            ratio = shown.difference / float(quantity.expected)
            assert float(relative) == pytest.approx(ratio, rel=0.06, abs=2 * EPS)


def test_the_page_has_all_cases():
    text = manual.PAGE.read_text(encoding="utf-8")
    introduction, *sections = parts(text)
    assert introduction == manual.INTRODUCTION
    assert [section.splitlines()[0] for section in sections] == [f"## {case.title}" for case in CASES]
    assert parts(manual.page([(case, []) for case in CASES]))[0] == introduction
    assert len(parts(manual.page([(case, []) for case in CASES]))) == 1 + len(CASES)


def test_titles_and_files_are_complete():
    assert len({case.title for case in CASES}) == len(CASES)
    package = Path(verification.__file__)
    files = {path for path in package.parent.glob("*.py") if "\nCASES = [" in path.read_text("utf-8")}
    assert {Path(family.__file__) for family in verification.FAMILIES} == files - {package}


def test_a_wrong_number_is_seen():
    right = Quantity(name="x", unit="m", expected=mp.mpf(2), computed=2.0, reference="2.00")
    assert right.agrees
    assert right.matches_reference
    for computed in (2.0 * (1.0 + 2e-12), -2.0, float("nan"), float("inf")):
        assert not dataclasses.replace(right, computed=computed).agrees
    assert not dataclasses.replace(right, expected=mp.mpf("2.02")).matches_reference
    zero = dataclasses.replace(right, expected=0, computed=1e-15, reference="")
    assert not zero.agrees
    assert dataclasses.replace(zero, absolute=1e-14).agrees


def test_a_changed_page_is_seen():
    case = CASES[0]
    text = manual.page([(case, quantities(0))])
    first = quantities(0)[0]
    assert manual.masked(text)[1][0][0] == manual.number(first.computed, digits=17)
    expected = manual.number(first.expected)
    for old, new in ((first.name, "place"), (expected, expected + "1"), (case.source, "hearsay")):
        assert manual.masked(text.replace(old, new))[0] != manual.masked(text)[0]
