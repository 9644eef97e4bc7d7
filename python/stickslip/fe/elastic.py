"""Matrices of elastic bodies from a mesh of scikit-fem, and the mesh of a ring."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import scipy.sparse
from numpy.typing import NDArray

from stickslip.faults import InputError
from stickslip.fe.rotation import Rotation
from stickslip.scene.checks import Real, described, package, real_array, real_number, whole_number
from stickslip.scene.laws.damping import DampingLike, Rayleigh

#: Elements of scikit-fem by the meshes that `Body.elastic` takes.
ELEMENTS = {
    "MeshTri1": "ElementTriP1",
    "MeshQuad1": "ElementQuad1",
    "MeshTet1": "ElementTetP1",
    "MeshHex1": "ElementHex1",
}
#: Part of the velocity at the middle of a facet that may leave a body of revolution: between flat facets and
#: the round surface that they stand for lie up to some degrees, at the end of a sector 90.
LEAVES = 0.2
#: Degree of the polynomials that are integrated exactly, in every direction of a quadrilateral or hexahedron.
ORDER = 2
#: The order of the corners of a hexahedron in scikit-fem, as places in the order of VTK.
SKFEM_HEXAHEDRON = [0, 3, 6, 2, 1, 5, 7, 4]
#: Names of cells in meshio, by dimension and number of corners.
CELLS = {(2, 3): "triangle", (2, 4): "quad", (3, 4): "tetra", (3, 8): "hexahedron"}


def elastic_matrices(
    mesh: Any,
    young: float,
    poisson: float,
    density: float,
    plane: Literal["strain", "stress"] | None,
    thickness: float | None,
    rotation: Rotation | None,
    damping: DampingLike | None,
) -> tuple[Any, dict[str, Any]]:
    """Return the basis of a mesh, and the matrices that `Body.elastic` describes, by name.

    Raise `InputError` if a number is out of its range, the mesh is none of these, a point is in no cell, a
    cell is folded or has no volume, or a body that rotates is no body of revolution.
    """
    skfem = package("skfem", "Body.elastic", "fe")
    helpers = package("skfem.helpers", "Body.elastic", "fe")
    elasticity = package("skfem.models.elasticity", "Body.elastic", "fe")
    kind = type(mesh).__name__
    if not isinstance(mesh, skfem.Mesh) or kind not in ELEMENTS:
        raise InputError(f"mesh: expected a MeshTri, MeshQuad, MeshTet or MeshHex of scikit-fem, got {kind}")
    if not (rotation is None or isinstance(rotation, Rotation)):
        raise InputError(f"rotation: expected a Rotation, got {described(rotation)}")
    stretch, density = _positive("young", young), _positive("density", density)
    contraction = real_number("poisson", poisson)
    if not -1.0 < contraction < 0.5:
        raise InputError(f"poisson: must be above -1 and below 0.5, got {contraction:g}")
    if mesh.p.shape[0] == 3 and (plane is not None or thickness is not None):
        raise InputError("plane, thickness: only a mesh in the plane has them; this one is in space")
    if not (plane is None or (isinstance(plane, str) and plane in ("strain", "stress"))):
        raise InputError(f"plane: expected 'strain' or 'stress', got {described(plane)}")
    deep = 1.0 if thickness is None else _positive("thickness", thickness)
    loose = np.setdiff1d(np.arange(mesh.p.shape[1]), mesh.t)
    if loose.size:
        raise InputError(f"mesh: point {loose[0]} is in no cell")
    first, shear = elasticity.lame_parameters(stretch, contraction)
    if plane == "stress":
        first = 2.0 * first * shear / (first + 2.0 * shear)
    element = skfem.ElementVector(getattr(skfem, ELEMENTS[kind])())
    with np.errstate(divide="ignore", invalid="ignore"):
        basis = skfem.Basis(mesh, element, intorder=ORDER)
    # The volume that a unit of the reference cell takes; cells of either hand are good.
    taken = basis.mapping.detDF(basis.X)
    empty = ~(np.abs(taken).min(axis=1) > 0.0)
    if empty.any():
        raise InputError(f"mesh: cell {int(empty.argmax())} has no volume")
    folded = (taken.min(axis=1) < 0.0) & (taken.max(axis=1) > 0.0)
    if folded.any():
        cell = int(folded.argmax())
        raise InputError(
            f"mesh: cell {cell} is folded: its corners, points {mesh.t[:, cell]}, go round the wrong way"
        )

    def assembled(product: Any) -> scipy.sparse.csr_array:
        return scipy.sparse.csr_array(deep * density * skfem.BilinearForm(product).assemble(basis))

    mass = assembled(lambda u, v, w: helpers.dot(u, v))
    stiffness = scipy.sparse.csr_array(deep * elasticity.linear_elasticity(first, shear).assemble(basis))
    if rotation is None:
        return basis, {"mass": mass, "stiffness": stiffness, "damping": damping}

    def velocity(points: Any) -> Any:
        """Return the velocities of the material at points (d, ...)."""
        return rotation(points.reshape(len(points), -1).T).T.reshape(points.shape)

    rim = skfem.FacetBasis(mesh, element, intorder=1)
    flow = velocity(rim.global_coordinates())
    leaving = np.abs((flow * rim.normals).sum(axis=0)) > LEAVES * np.sqrt((flow**2).sum(axis=0))
    if leaving.any():
        where = np.asarray(rim.global_coordinates())[:, leaving][:, 0]
        raise InputError(
            f"rotation: must leave the body where it is, but material leaves it at {where}; only a body of "
            "revolution rotates here, about its own axis"
        )
    along = helpers.mul
    convected = assembled(lambda u, v, w: helpers.dot(v, along(helpers.grad(u), velocity(w.x))))
    softened = assembled(
        lambda u, v, w: helpers.dot(
            along(helpers.grad(u), velocity(w.x)), along(helpers.grad(v), velocity(w.x))
        )
    )
    if isinstance(damping, Rayleigh) and damping.stiffness:
        # Of the elastic K, which is never negative; the other one is, for fast rotation.
        damping = damping.mass * mass + damping.stiffness * stiffness
    return basis, {
        "mass": mass,
        "stiffness": stiffness - softened,
        "gyroscopic": convected - convected.T,
        "damping": damping,
    }


def ring(
    counts: Sequence[int], radii: Sequence[float], angles: Sequence[float], heights: Sequence[float]
) -> Any:
    """Return a scikit-fem mesh of hexahedra of a ring about the z axis, or of a sector of one.

    Parameters
    ----------
    counts
        Numbers of cells along radius, angle and height.
    radii, angles, heights
        Lowest and highest, m, rad and m. A full turn closes.

    Returns
    -------
    skfem.MeshHex
        With the boundaries ``inner``, ``outer``, ``bottom``, ``top``, and of a sector ``start`` and ``end``,
        its lowest and highest angle.

    Raises
    ------
    InputError
        If scikit-fem is missing, a count is not positive, ends do not ascend, the inner radius is not
        positive, or the angles span more than a full turn.
    """
    skfem = package("skfem", "ring", "fe")
    numbers = list(counts) if np.iterable(counts) else []
    if len(numbers) != 3:
        raise InputError(f"counts: expected three numbers, got {described(counts)}")
    axes, turn = [], 2.0 * np.pi
    for name, ends, count in zip(
        ("radii", "angles", "heights"), (radii, angles, heights), numbers, strict=True
    ):
        pair = real_array(name, ends, 1)
        if pair.shape != (2,) or not -np.inf < pair[0] < pair[1] < np.inf:
            raise InputError(f"{name}: expected a lower and a higher number, got {described(ends)}")
        axes.append(np.linspace(pair[0], pair[1], whole_number("counts", count, 1) + 1))
    if not axes[0][0] > 0.0:
        raise InputError(f"radii: must be positive, got {axes[0][0]:g}")
    span = axes[1][-1] - axes[1][0]
    closed = bool(np.isclose(span, turn, rtol=1e-9))
    if span > turn and not closed:
        raise InputError(f"angles: must span at most a full turn, got {span:g}")
    if closed and numbers[1] < 3:
        raise InputError(f"counts, angles: a full turn needs at least three cells, got {numbers[1]}")
    box = skfem.MeshHex.init_tensor(*axes)
    place = np.stack([np.searchsorted(axis, row) for axis, row in zip(axes, box.p, strict=True)])
    if closed:
        place[1] %= numbers[1]
    _, kept, node = np.unique(place, axis=1, return_index=True, return_inverse=True)
    (r, angle, z), place = box.p[:, kept], place[:, kept]
    mesh = skfem.MeshHex(
        np.ascontiguousarray([r * np.cos(angle), r * np.sin(angle), z]),
        np.ascontiguousarray(node.ravel()[box.t]),
    )
    faces = {"inner": (0, 0), "outer": (0, numbers[0]), "bottom": (2, 0), "top": (2, numbers[2])}
    if not closed:
        faces |= {"start": (1, 0), "end": (1, numbers[1])}
    rim = mesh.boundary_facets()
    return mesh.with_boundaries(
        {
            name: rim[(place[axis][mesh.facets[:, rim]] == end).all(axis=0)]
            for name, (axis, end) in faces.items()
        }
    )


@dataclass(frozen=True)
class MeshParts:
    """What a body takes from a mesh of scikit-fem, named as in `Body`; nodes count from 1."""

    points: Real
    dofs: list[str]
    cells: dict[str, NDArray[np.int64]]
    surfaces: dict[str, NDArray[np.int64]]


def mesh_parts(basis: Any) -> MeshParts:
    """Return points, names of the dofs, cells and surfaces of a basis of scikit-fem.

    Raise `InputError` if the element has dofs that are not at corners, or there is no name for the cells.
    """
    mesh, rows = basis.mesh, np.asarray(basis.nodal_dofs)
    if rows.shape != mesh.p.shape or rows.size != basis.N:
        raise InputError(
            "basis: expected an ElementVector with dofs at the corners of the cells only, such as that of "
            "ElementHex1"
        )
    dofs = [""] * basis.N
    for k, row in enumerate(rows):
        for node, dof in enumerate(row):
            dofs[dof] = f"{node + 1}.{k + 1}"
    cells = np.asarray(mesh.t).T + 1
    if (kind := CELLS.get((mesh.p.shape[0], cells.shape[1]))) is None:
        raise InputError(
            f"basis: cells of {cells.shape[1]} nodes in {mesh.p.shape[0]} dimensions are not known here"
        )
    if kind == "hexahedron":
        cells = cells[:, SKFEM_HEXAHEDRON]
    surfaces = {name: facet_nodes(mesh, indices) + 1 for name, indices in (mesh.boundaries or {}).items()}
    return MeshParts(np.ascontiguousarray(mesh.p.T), dofs, {kind: cells}, surfaces)


def facet_nodes(mesh: Any, indices: Any) -> NDArray[np.int64]:
    """Return the nodes of facets of scikit-fem, around each."""
    found = np.asarray(mesh.facets[:, np.asarray(indices)]).T
    if found.shape[1] != 4:
        return found
    # scikit-fem sorts the nodes of a facet: start at the first and go round by the sense of the corners.
    corners = mesh.p.T[found]
    middle = corners.mean(axis=1, keepdims=True)
    first = corners[:, :1] - middle
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, None]
    side = np.cross(np.broadcast_to(normal, first.shape), first)
    offsets = corners - middle
    length, width = (np.linalg.norm(v, axis=-1) for v in (first, side))
    angle = np.arctan2((offsets * side).sum(-1) / width, (offsets * first).sum(-1) / length)
    return np.take_along_axis(found, np.argsort(angle, axis=1), axis=1)


def _positive(name: str, value: float) -> float:
    number = real_number(name, value)
    if not 0.0 < number < np.inf:
        raise InputError(f"{name}: must be positive and finite, got {number:g}")
    return number
