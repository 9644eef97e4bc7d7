"""Finite elements: bodies and their matrices, contact pairs, scenes, reduced models, motions on the mesh.

Data flows one way: files or arrays -> `Body` -> `contact_pairs` -> `assemble` -> a `Scene` -> `reduce`, and
displacements of either scene -> `write_vtu`.
"""

from stickslip.fe.assembly import assemble
from stickslip.fe.body import Body
from stickslip.fe.elastic import ring
from stickslip.fe.formats.readers import read
from stickslip.fe.pairs import Pairs, contact_pairs
from stickslip.fe.reduced.reduction import Reduction, reduce
from stickslip.fe.rotation import Rotation
from stickslip.fe.surface import Surface
from stickslip.fe.vtu import write_vtu

__all__ = [
    "Body",
    "Pairs",
    "Reduction",
    "Rotation",
    "Surface",
    "assemble",
    "contact_pairs",
    "read",
    "reduce",
    "ring",
    "write_vtu",
]
