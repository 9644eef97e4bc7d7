"""Basins of attraction: which attractor is reached from where, and the cycles that bound a basin."""
