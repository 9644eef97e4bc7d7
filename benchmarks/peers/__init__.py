"""The standard run by other programs, each written as those who know it would.

All take the linear mechanics of `tests/support/peer_integrator.py` and follow the same rules at events.
Contact directions are single dofs and the mass is lumped, as in the two-subsystem model.
"""
