"""Pictures of the documentation beside those that the program draws today."""

from pathlib import Path

import matplotlib
import numpy as np
import pytest
from matplotlib.image import imread

DOCS = Path(__file__).parents[2] / "docs"
#: The version of matplotlib that drew the pictures of the gallery and of the first pages; others set letters
#: and lines a little differently.
DRAWN_BY = "3.11"
#: Part of the pixels that may differ: on another processor curves end in another pixel here and there, at
#: most 2e-5 of all.
DIFFERING = 5e-5


def assert_shown(name, drawn):
    """Check that docs/`name` shows the picture in the file `drawn`."""
    if not matplotlib.__version__.startswith(f"{DRAWN_BY}."):
        pytest.skip(f"docs/{name} was drawn by matplotlib {DRAWN_BY}")
    kept, today = (imread(picture)[..., :3] for picture in (DOCS / name, drawn))
    assert kept.shape == today.shape, f"docs/{name} is not what the program draws: make docs, make gallery"
    differing = (np.abs(kept - today).max(axis=-1) > 0.1).mean()
    assert differing <= DIFFERING, f"docs/{name} is not what the program draws: make docs, make gallery"
