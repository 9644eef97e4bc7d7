"""Eigenvalues along parameters: sweeps, critical points, sensitivities, maps of stability."""
