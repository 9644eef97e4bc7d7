"""Matrices in the files of finite-element programs."""
