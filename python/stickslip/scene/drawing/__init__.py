"""Drawings of a scene: bodies and springs from its matrices, or its mesh."""
