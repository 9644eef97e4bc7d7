"""Matrices and vectors of scenes and bodies in files."""
