"""Curves over two parameters on which stability of sliding ends."""
