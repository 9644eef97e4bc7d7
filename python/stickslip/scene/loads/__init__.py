"""Loads that depend on time."""
