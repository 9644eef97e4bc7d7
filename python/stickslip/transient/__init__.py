"""The nonlinear transient: one run, or many at once."""
