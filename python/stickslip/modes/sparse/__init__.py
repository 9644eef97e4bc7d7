"""Modes of large scenes by sparse shift and invert: near points, or all of a band with a certificate."""
