"""What is drawn, compared and weighed as modes, apart from the class that offers it."""

from __future__ import annotations

from typing import Protocol

from stickslip.scene.checks import Complex, Flags, Real
from stickslip.scene.scene import Scene


class Computed(Protocol):
    """What functions of modes take: `Modes`, whose methods they are."""

    @property
    def combination(self) -> str:
        """The status combination."""

    @property
    def eigenvalues(self) -> Complex:
        """lambda, (m,), 1/s."""

    @property
    def frequencies(self) -> Real:
        """``|lambda| / 2 pi``, (m,), Hz."""

    @property
    def unstable(self) -> Flags:
        """Whether a mode grows, (m,)."""

    @property
    def shapes(self) -> Complex:
        """Displacements, (n, m)."""

    @property
    def dofs(self) -> tuple[str, ...]:
        """Names of the dofs."""

    @property
    def scene(self) -> Scene:
        """The scene."""

    def described(self, mode: int) -> str:
        """Return frequency and growth in words."""
