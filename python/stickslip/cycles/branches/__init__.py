"""Branches of periodic orbits: over given values, around folds, and the points at which they change."""
