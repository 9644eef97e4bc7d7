"""Contact pairs: nodes that face nodes, faces, or a rigid slider, with their directions and gaps."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from stickslip.faults import InputError
from stickslip.fe.surface import Surface, bilinear
from stickslip.scene.checks import Real, described, real_array, real_number
from stickslip.scene.contact import Contact
from stickslip.scene.laws.law import FrictionLaw
from stickslip.show.summary import Shown, Summary, Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Velocity of the slider, m/s: one vector, or a function from points (k, d) to velocities (k, d).
Velocity: TypeAlias = ArrayLike | Callable[[Real], Any]

#: A node lies on the edge of a facet, or on a node, up to this part of the facet's size.
ON_EDGE = 1e-6
#: A gap below this part of the facet's size is rounding of a coordinate, and zero.
TOUCHING = 1e-12
#: Facets whose middles are nearest to a node that are tried.
TRIED = 16
#: Entries of a direction below this are rounding of its geometry.
ROUNDING = 1e-14


@dataclass(frozen=True, eq=False, repr=False)
class Pairs(Shown):
    """Contacts of a scene, k of them, and where they lie; made by `contact_pairs`.

    Attributes
    ----------
    contacts
        The contacts, as `Scene` takes them.
    nodes
        Node of the first surface of each pair.
    points
        Where it lies, (k, d), m.
    normals, tangents
        Unit vectors (k, d): from the second body to the first, and along the velocity.
    areas
        Part of the first surface that belongs to each pair, (k,), m2 (of a plane body: m); nan where only
        nodes are known.
    unpaired
        Nodes of the first surface that face nothing.
    """

    contacts: tuple[Contact, ...]
    nodes: NDArray[np.int64]
    points: Real
    normals: Real
    tangents: Real
    areas: Real
    unpaired: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.contacts)

    def __repr__(self) -> str:
        speeds = [_speed(contact) for contact in self.contacts]
        gaps = [contact.gap for contact in self.contacts]
        text = f"Pairs({len(self)}, slider speed {min(speeds):g} to {max(speeds):g} m/s"
        text += f", gap {min(gaps):g} to {max(gaps):g} m"
        return text + (f", {self.unpaired.size} nodes unpaired)" if self.unpaired.size else ")")

    def summary(self) -> Summary:
        """Return a table of the pairs."""
        rows = [
            (str(k), str(node), _speed(contact), contact.gap, float(area))
            for k, (node, contact, area) in enumerate(zip(self.nodes, self.contacts, self.areas, strict=True))
        ]
        headings = ("contact", "node", "slider speed, m/s", "gap, m", "area, m2")
        return Summary(
            [("unpaired nodes", str(self.unpaired.size))], [Table("Contact pairs", headings, rows)]
        )

    def plot(self, values: ArrayLike, *, label: str = "", ax: Axes | None = None) -> Axes:
        """Draw a quantity of every pair where it lies, as colours or as a curve; return the Axes.

        Pairs in space are coloured and seen along the coordinate axis along which they are least wide; pairs
        in the plane are a curve over the axis along which they are widest. Coordinates are in mm.

        Parameters
        ----------
        values
            One number per pair, (k,), such as its power; colours are red above and blue below zero.
        label
            Name of the quantity, with its unit.
        ax
            Where to draw; None: on axes of its own.

        Raises
        ------
        InputError
            If it is not one finite number per pair.
        """
        from stickslip.show.plots import axes_of
        from stickslip.show.style import UNSTABLE

        points, shown = self.points, real_array("values", values, 1)
        if shown.shape != (len(points),) or not np.isfinite(shown).all():
            raise InputError(f"values: expected {len(points)} finite numbers, one per pair, got {shown}")
        axes = axes_of(ax)
        wide = np.sort(np.argsort(-np.ptp(points, axis=0), kind="stable")[:2])
        if points.shape[1] == 2:
            wide = wide[np.ptp(points[:, wide], axis=0).argmax()]
            order = np.argsort(points[:, wide])
            axes.plot(1e3 * points[order, wide], shown[order], "o-", color=UNSTABLE)
            axes.set(xlabel=f"{'xy'[wide]}, mm", ylabel=label)
            return axes
        largest = np.abs(shown).max() or 1.0
        x, y = 1e3 * points[:, wide].T
        spots = axes.scatter(x, y, c=shown, cmap="coolwarm", vmin=-largest, vmax=largest, edgecolor="black")
        axes.figure.colorbar(spots, ax=axes, label=label)
        axes.set(xlabel=f"{'xyz'[wide[0]]}, mm", ylabel=f"{'xyz'[wide[1]]}, mm")
        axes.set_aspect("equal", adjustable="datalim")
        return axes


def contact_pairs(
    first: Surface,
    second: Surface | None,
    *,
    velocity: Velocity,
    friction: float | FrictionLaw,
    static_friction: float | None = None,
    restitution: float = 0.0,
    gap: float | None = None,
    reach: float | None = None,
    plane: bool = True,
) -> Pairs:
    """Return the contacts between the nodes of one surface and another surface, or a rigid slider.

    A node of `first` is paired with what the second surface has opposite to it: a node where one is there,
    else a point of a facet, whose displacement is that of the facet's nodes weighted by their shape
    functions. The normal is that of the second surface there, from it to the first; the tangential direction
    is that of the velocity, without its part along the normal.

    Parameters
    ----------
    first
        The surface whose nodes are paired.
    second
        What slides past it; None: a rigid slider that the first surface touches all over.
    velocity
        Velocity of the second surface relative to the first, m/s: a vector (d,), or a function from points
        (k, d) to velocities (k, d), such as `Rotation`.
    friction, static_friction, restitution
        As in `Contact`.
    gap
        Clearance of every pair at rest, m. None: as the surfaces lie, 0 to a rigid slider.
    reach
        Largest distance between node and facet, m; None: the size of the facets.
    plane
        Whether friction acts in the plane of the surface: it opposes the slip velocity, whatever direction
        that has, and damps motion across the velocity. A scene lists such a pair as two contacts, the first
        one along the velocity. False: friction acts along the velocity alone, as it always does between
        bodies in the plane, without friction, and where all dofs across the velocity are held.

    Raises
    ------
    InputError
        If nothing faces each other, a normal is not known, both surfaces face the same way, the velocity
        vanishes or leaves the surface, or all dofs of a pair along a direction are held.
    """
    if not isinstance(first, Surface):
        raise InputError(f"first: expected a Surface, got {described(first)}")
    if second is not None and not isinstance(second, Surface):
        raise InputError(f"second: expected a Surface, or None for a rigid slider, got {described(second)}")
    dimension = first.points.shape[1]
    if second is not None and second.points.shape[1] != dimension:
        raise InputError("second: has another number of coordinates than first")
    weights, normals, gaps = _opposite(first, second, reach)
    paired = np.flatnonzero(np.isfinite(gaps))
    if not paired.size:
        raise InputError("first: none of its nodes faces the second surface within reach; see reach=")
    weights, normals, points = [weights[k] for k in paired], normals[paired], first.points[paired]
    gaps = gaps[paired] if gap is None else np.full(paired.size, real_number("gap", gap))
    speeds, tangents = _sliding(velocity, first.numbers[paired], points, normals)
    in_plane = plane and dimension == 3 and friction != 0.0
    across = np.cross(normals, tangents) if in_plane else np.zeros(normals.shape)
    contacts = []
    for k, place in enumerate(paired):
        node = first.numbers[place]
        normal, tangential, beside = (
            _entries(first, second, int(node), weights[k], d) for d in (normals[k], tangents[k], across[k])
        )
        if not normal or not tangential:
            which = "tangential" if normal else "normal"
            raise InputError(f"first: all dofs of the pair of node {node} are held in its {which} direction")
        directions: Any = (tangential, beside) if beside else tangential
        contacts.append(
            Contact(
                tangential=directions,
                normal=normal,
                friction=friction,
                static_friction=static_friction,
                slider_speed=(float(speeds[k]), 0.0) if beside else float(speeds[k]),
                restitution=restitution,
                gap=float(gaps[k]),
            )
        )
    areas = np.full(paired.size, np.nan)
    if first.facets is not None:
        areas = np.linalg.norm(first.areas[paired], axis=1)
    unpaired = np.setdiff1d(np.arange(len(first)), paired)
    return Pairs(
        tuple(contacts),
        first.numbers[paired],
        points,
        normals,
        tangents,
        areas,
        first.numbers[unpaired],
    )


def _speed(contact: Contact) -> float:
    return float(np.max(contact.slider_speed))


#: What one node faces: places of nodes in the second surface and their weights.
Weights: TypeAlias = list[tuple[int, float]]


def _opposite(
    first: Surface, second: Surface | None, reach: float | None
) -> tuple[list[Weights], Real, Real]:
    """Return for each node of the first surface what it faces, the normal, and the gap; nan: nothing."""
    if second is None:
        return [[] for _ in first.points], -first.normals, np.zeros(len(first))
    if second.facets is None:
        weights, normals, gaps = _nearest_nodes(first, second, reach)
    else:
        weights, normals, gaps = feet(first, second, reach)
        if first.facets is not None:
            there = np.isfinite(gaps)
            same = np.einsum("ij,ij->i", normals[there], first.normals[there]) > 0.0
            if same.any():
                node = first.numbers[there][same][0]
                raise InputError(f"second: faces the same way as first at node {node}; turn its facets round")
    return weights, normals, gaps


def _nearest_nodes(first: Surface, second: Surface, reach: float | None) -> tuple[list[Weights], Real, Real]:
    """Pair nodes with nodes: what is between them lies along the normal of the first surface."""
    normals = -first.normals
    size = (
        np.sqrt(np.linalg.norm(first.areas, axis=1))
        if first.points.shape[1] == 3
        else (np.linalg.norm(first.areas, axis=1))
    )
    distance, nearest = cKDTree(second.points).query(first.points)
    offsets = first.points - second.points[nearest]
    gaps = np.einsum("ij,ij->i", offsets, normals)
    aside = np.linalg.norm(offsets - gaps[:, None] * normals, axis=1)
    limit = size if reach is None else np.full(size.shape, real_number("reach", reach))
    gaps[np.abs(gaps) <= TOUCHING * size] = 0.0
    gaps[(aside > ON_EDGE * size) | (distance > limit)] = np.nan
    return [[(int(k), 1.0)] for k in nearest], normals, gaps


def feet(first: Surface, second: Surface, reach: float | None) -> tuple[list[Weights], Real, Real]:
    """Pair nodes with points of facets, along the normal of the second surface.

    Returns for each node the places of the nodes of the second surface with their weights, the normal (k, d),
    and the gap (k,), m; a node that meets no facet has no weights and the gap nan.
    """
    assert second.facets is not None
    corners = second.points[second.facets]
    size = np.linalg.norm(corners - corners.mean(axis=1, keepdims=True), axis=2).max(axis=1)
    tree = cKDTree(corners.mean(axis=1))
    distances, candidates = tree.query(first.points, k=min(TRIED, len(corners)))
    weights: list[Weights] = []
    normals, gaps = np.full(first.points.shape, np.nan), np.full(len(first), np.nan)
    for k, point in enumerate(first.points):
        best: tuple[float, Weights, Real, float] | None = None
        for facet, distance in zip(np.atleast_1d(candidates[k]), np.atleast_1d(distances[k]), strict=True):
            limit = 2.0 * size[facet] if reach is None else real_number("reach", reach)
            # A point of the facet is at most its size away from its middle; 1 % is more than rounding.
            if distance > 1.01 * (size[facet] + limit):
                continue
            foot = _foot(point, corners[facet], second.normals[second.facets[facet]])
            if foot is None:
                continue
            shape, normal, gap = foot
            if abs(gap) <= limit and (best is None or abs(gap) < best[0]):
                nodes = second.facets[facet]
                kept: Weights = [(int(n), float(w)) for n, w in zip(nodes, shape, strict=True) if w]
                best = (abs(gap), kept, normal, gap)
        if best is None:
            weights.append([])
        else:
            weights.append(best[1])
            normals[k], gaps[k] = best[2], best[3]
    return weights, normals, gaps


def _foot(point: Real, corners: Real, normals: Real) -> tuple[Real, Real, float] | None:
    """Return shape functions, unit normal and gap where the normal through a point meets a facet.

    ``point = sum_k w_k(r) (corner_k + gap normal_k)``: Newton's method on the d unknowns (r, gap) with the
    normals interpolated, so that neighbouring facets meet without a jump; None where it is outside.
    """
    unknowns = np.zeros(point.size)
    scale = np.abs(corners - corners.mean(axis=0)).max()
    for _ in range(20):
        shape, slopes = _shape(unknowns[:-1], len(corners))
        normal = shape @ normals
        length = np.linalg.norm(normal)
        normal = normal / length
        turns = (slopes @ normals - np.outer(slopes @ normals @ normal, normal)) / length
        residual = shape @ corners + unknowns[-1] * normal - point
        jacobian = np.column_stack([*(slopes @ corners + unknowns[-1] * turns), normal])
        try:
            step = np.linalg.solve(jacobian, residual)
        except np.linalg.LinAlgError:
            return None
        unknowns = unknowns - step
        if not np.abs(unknowns[:-1]).max() < 10.0:
            return None
        if np.abs(residual).max() <= 1e-14 * scale:
            break
    shape, _ = _shape(unknowns[:-1], len(corners))
    if np.abs(residual).max() > 1e-9 * scale or shape.min() < -ON_EDGE:
        return None
    # On an edge or on a node, what is rounding of zero is zero.
    shape = np.where(np.abs(shape) <= ON_EDGE, 0.0, shape)
    gap = float(unknowns[-1])
    return shape / shape.sum(), normal, 0.0 if abs(gap) <= TOUCHING * scale else gap


def _shape(place: Real, count: int) -> tuple[Real, Real]:
    """Return shape functions (count,) and their slopes (d - 1, count) of a facet; zero is its middle."""
    if count == 2:
        return np.array([0.5 - 0.5 * place[0], 0.5 + 0.5 * place[0]]), np.array([[-0.5, 0.5]])
    r, s = place
    if count == 3:
        shape = np.array([1.0 / 3.0 - r - s, 1.0 / 3.0 + r, 1.0 / 3.0 + s])
        return shape, np.array([[-1.0, 1.0, 0.0], [-1.0, 0.0, 1.0]])
    # Bilinear: differences of a unit step are the slopes, at the same other coordinate.
    along = 0.5 * (bilinear(1.0, s) - bilinear(-1.0, s))
    return bilinear(r, s), np.array([along, 0.5 * (bilinear(r, 1.0) - bilinear(r, -1.0))])


def _sliding(
    velocity: Velocity, nodes: Sequence[int] | Any, points: Real, normals: Real
) -> tuple[Real, Real]:
    """Return slider speeds and unit tangents."""
    if callable(velocity):
        field = real_array("velocity", velocity(points), 2)
    else:
        field = np.tile(real_array("velocity", velocity, 1), (len(points), 1))
    if field.shape != points.shape:
        raise InputError(
            f"velocity: expected {points.shape[1]} components at each of {len(points)} points, "
            f"got shape {field.shape}"
        )
    along = field - np.einsum("ij,ij->i", field, normals)[:, None] * normals
    speeds, whole = np.linalg.norm(along, axis=1), np.linalg.norm(field, axis=1)
    if not (np.isfinite(whole) & (whole > 0.0)).all():
        k = int(np.flatnonzero(~(np.isfinite(whole) & (whole > 0.0)))[0])
        raise InputError(f"velocity: must be finite and not zero, got {field[k]} at node {nodes[k]}")
    if (speeds < 0.5 * whole).any():
        k = int(np.flatnonzero(speeds < 0.5 * whole)[0])
        raise InputError(
            f"velocity: {field[k]} at node {nodes[k]} leaves the surface, whose normal is {normals[k]}"
        )
    return speeds, along / speeds[:, None]


def _entries(
    first: Surface, second: Surface | None, node: int, weights: Weights, direction: Real
) -> dict[str, float]:
    """Return a direction between a node and what it faces, by the names of dofs."""
    parts = [(first.body, node, 1.0)]
    if second is not None:
        parts += [(second.body, int(second.numbers[k]), -weight) for k, weight in weights]
    entries: dict[str, float] = {}
    for body, number, weight in parts:
        for k, component in enumerate(direction):
            if abs(component) <= ROUNDING:
                continue
            for name, part in body.displacement(f"first: pair of node {node}", number, k + 1).items():
                entries[name] = entries.get(name, 0.0) + float(weight * component) * part
    return entries
