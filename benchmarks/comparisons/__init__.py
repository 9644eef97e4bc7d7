"""Comparisons with other programs, one module each: the same question to both, errors beside times.

``PYTHONPATH=benchmarks python -m comparisons.siconos --into docs/comparisons/siconos.md`` writes the tables
of a page; ``make compare`` writes all of them.
"""
