"""A motion of a scene: its events, samples, energies, balance and the spectrum of a stretch."""
