"""A finite-element body: sparse matrices, and where its dofs lie."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any, Literal

import numpy as np
import scipy.sparse
from numpy.typing import ArrayLike, NDArray

from stickslip.faults import InputError
from stickslip.fe.elastic import elastic_matrices, mesh_parts
from stickslip.fe.matrices import of_rows, square
from stickslip.fe.rotation import Rotation
from stickslip.fe.surface import Surface
from stickslip.scene.checks import MatrixLike, Real, described, real_array, real_number
from stickslip.scene.contact import nearest
from stickslip.scene.laws.damping import DampingLike, Rayleigh
from stickslip.show.mesh import Mesh
from stickslip.show.summary import Shown, Summary

#: The matrices of a body, by the names of `Scene`.
MATRICES = ("mass", "stiffness", "damping", "gyroscopic", "circulatory")


class Body(Shown):
    """The matrices of one meshed part, its dofs named "node.direction", and its points.

    Parameters
    ----------
    mass, stiffness
        M and K, (n, n) symmetric, dense or sparse, kg and N/m; a mass may be (n,).
    dofs
        Names "node.direction", n of them: "12.1" is the displacement of node 12 along x, "12.2" along y,
        "12.3" along z; directions 4 to 6 are rotations. None: every node of `points` has all directions, node
        by node.
    points
        Where the nodes lie, m: (p, d) for the nodes 1 to p, d = 2 or 3, or a mapping from node number to its
        d coordinates. None: not known; such a body has no surfaces.
    damping
        C: `Rayleigh`, an (n, n) symmetric matrix, or None.
    gyroscopic, circulatory
        G (skew-symmetric) and H as in `Scene`; None: no such forces.
    cells
        Node numbers of the elements by meshio's name of their kind, such as ``{"hexahedron": (m, 8)}``. They
        turn the normals of surfaces outward and are drawn.
    surfaces
        Parts of the boundary by name: facets as node numbers, (f, 2) in the plane and (f, 3) or (f, 4) in
        space, or a list of nodes, which has no normals. Without `cells`, the nodes of a facet run
        counterclockwise for one who looks at the body from outside; in the plane the body lies to the left
        of a facet. Facets of quadratic elements have the middles of their edges behind the corners; with
        `cells`, corners are enough.
    name
        Name with which the names of the dofs begin in a scene ("pad.12.1"); dofs of different bodies must
        have different names. None: the names of the dofs stay as they are.
    dependent
        Displacements "node.direction" that are no dofs because they depend on others (a tie, a rigid body),
        each with its weights by dof: ``{"4.1": {"3.1": 1.0}}``. Contacts, loads and drawings use them. A list
        alone says that the weights are not known; contacts and loads there are refused. All else that is
        missing among `dofs` is held.

    Attributes
    ----------
    notes
        What a reader did to the files: triangles that it mirrored, dofs that it left out, matrices that it
        split.

    Raises
    ------
    InputError
        If shapes do not fit, a matrix is not symmetric, a number is not finite, a name is no "node.direction"
        or comes twice, or a node is not known.
    """

    def __init__(
        self,
        mass: MatrixLike,
        stiffness: MatrixLike,
        *,
        points: ArrayLike | Mapping[int, ArrayLike] | None = None,
        dofs: Sequence[str] | None = None,
        damping: DampingLike | None = None,
        gyroscopic: MatrixLike | None = None,
        circulatory: MatrixLike | None = None,
        cells: Mapping[str, ArrayLike] | None = None,
        surfaces: Mapping[str, ArrayLike] | None = None,
        name: str | None = None,
        notes: Sequence[str] = (),
        dependent: Sequence[str] | Mapping[str, Mapping[str, float] | None] = (),
    ) -> None:
        if name is not None and not (isinstance(name, str) and name.strip()):
            raise InputError(f"name: expected a text that is not empty, or None, got {name!r}")
        self.name, self.notes = name, tuple(notes)
        self.stiffness = square("stiffness", stiffness, None, 1)
        size = self.stiffness.shape[0]
        lumped = not scipy.sparse.issparse(mass) and np.ndim(mass) == 1
        self.mass = square(
            "mass", scipy.sparse.diags_array(real_array("mass", mass, 1)) if lumped else mass, size, 1
        )
        proportional = damping is None or isinstance(damping, Rayleigh)
        self.damping = damping if proportional else square("damping", damping, size, 1)
        self.gyroscopic = None if gyroscopic is None else square("gyroscopic", gyroscopic, size, -1)
        self.circulatory = None if circulatory is None else square("circulatory", circulatory, size, 0)
        self.nodes, self.points = _nodes(points)
        if dofs is None and self.points is None and size:
            raise InputError("dofs: names are needed where no points are given")
        if dofs is None:
            assert self.points is not None
            dofs = [f"{node}.{k + 1}" for node in self.nodes for k in range(self.points.shape[1])]
        self.dofs = tuple(dofs)
        if len(self.dofs) != size:
            raise InputError(f"dofs: expected {size} names for matrices of {size} rows, got {len(self.dofs)}")
        self.place = {_split(dof): k for k, dof in enumerate(self.dofs)}
        if len(self.place) != size:
            twice = next(dof for k, dof in enumerate(self.dofs) if self.place[_split(dof)] != k)
            raise InputError(f"dofs: {twice!r} names more than one dof")
        self.dependent = self._checked(dependent)
        self._known = {int(node): k for k, node in enumerate(self.nodes)}
        if self.points is not None:
            for dof in self.dofs:
                if _split(dof)[0] not in self._known:
                    raise InputError(f"dofs: {dof!r} is of a node without a point")
        self.cells: dict[str, NDArray[np.int64]] = {
            kind: self.node_places(f"cells[{kind!r}]", nodes, 2) for kind, nodes in (cells or {}).items()
        }
        self._surfaces = {
            key: self.node_places(f"surfaces[{key!r}]", nodes, 1, 2)
            for key, nodes in (surfaces or {}).items()
        }

    @property
    def size(self) -> int:
        """Number of dofs, n."""
        return len(self.dofs)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the dofs in a scene: with the name of the body, if it has one."""
        return self.dofs if self.name is None else tuple(f"{self.name}.{dof}" for dof in self.dofs)

    def _checked(self, dependent: Any) -> dict[tuple[int, int], dict[tuple[int, int], float] | None]:
        """Return the weights of dependent displacements; None: they are not known."""
        weights: dict[tuple[int, int], dict[tuple[int, int], float] | None] = {}
        given = dependent if isinstance(dependent, Mapping) else dict.fromkeys(dependent)
        for name, parts in given.items():
            key = _split(name)
            if parts is not None and key in self.place:
                raise InputError(f"dependent: {name!r} is a dof")
            weights[key] = parts and {
                _split(dof): real_number(f"dependent[{name!r}]", w) for dof, w in parts.items()
            }
            for dof in weights[key] or ():
                if dof not in self.place:
                    raise InputError(f"dependent[{name!r}]: '{dof[0]}.{dof[1]}' is no dof")
        return weights

    def displacement(self, place: str, node: int, direction: int) -> dict[str, float]:
        """Return a displacement of a node as weights of dofs by their names in a scene; none: it is held.

        Raises
        ------
        InputError
            If it depends on others in a way that is not known; the message begins with `place`.
        """
        key = (node, direction)
        if key in self.dependent:
            weights = self.dependent[key]
            if weights is None:
                raise InputError(
                    f"{place}: displacement {node}.{direction} is no dof, it depends on others, and how "
                    "is not known; see body.notes"
                )
            return {self.names[self.place[dof]]: weight for dof, weight in weights.items()}
        k = self.place.get(key)
        return {} if k is None else {self.names[k]: 1.0}

    def node_places(self, argument: str, nodes: Any, *ranks: int) -> NDArray[np.int64]:
        """Return the places of nodes among the points, for an array of node numbers.

        Raises
        ------
        InputError
            If the points are not known or there is no node of a number.
        """
        if self.points is None:
            raise InputError(f"{argument}: the body has no points")
        numbers = np.asarray(nodes)
        if numbers.dtype.kind not in "iu" or numbers.ndim not in ranks or not numbers.size:
            raise InputError(
                f"{argument}: expected node numbers in {' or '.join(map(str, ranks))} dimensions, "
                f"got {described(nodes)}"
            )
        try:
            found = [self._known[int(number)] for number in numbers.flat]
        except KeyError as error:
            raise InputError(f"{argument}: there is no node {error.args[0]}") from None
        return np.array(found, dtype=np.int64).reshape(numbers.shape)

    def surface(self, surface: str | ArrayLike) -> Surface:
        """Return a part of the boundary by its name, or for node numbers as in `surfaces`.

        Raises
        ------
        InputError
            If the name or a node is unknown, a facet is of another kind or has no area.
        """
        if not isinstance(surface, str):
            return Surface(self, "given", self.node_places("surface", surface, 1, 2))
        if surface not in self._surfaces:
            known = nearest(surface, list(self._surfaces)) if self._surfaces else "; the body has none"
            raise InputError(f"surface: unknown {surface!r}{known}")
        return Surface(self, surface, self._surfaces[surface])

    def held(self, dofs: Iterable[str] | Surface, directions: Sequence[int] = (1, 2, 3)) -> Body:
        """Return the body with some dofs held at zero: their rows and columns are gone.

        Parameters
        ----------
        dofs
            Names of dofs, or a surface all of whose nodes are held.
        directions
            Directions in which the nodes of a surface are held.

        Raises
        ------
        InputError
            If a name is unknown, or the surface is not one of this body.
        """
        if isinstance(dofs, Surface):
            if dofs.body is not self:
                raise InputError(f"dofs: surface {dofs.name!r} is one of another body")
            asked = [(int(node), k) for node in dofs.numbers for k in directions]
            gone = [self.place[key] for key in asked if key in self.place and key not in self.dependent]
            for key in asked:
                others = self.displacement("dofs", *key).keys() - {self.names[k] for k in gone}
                if others:
                    raise InputError(
                        f"dofs: displacement {key[0]}.{key[1]} depends on {min(others)}, which stays free; "
                        "hold that too"
                    )
        else:
            table = {name: k for names in (self.dofs, self.names) for k, name in enumerate(names)}
            listed = list(dofs)
            unknown = [dof for dof in listed if dof not in table]
            if unknown:
                raise InputError(f"dofs: unknown dof {unknown[0]!r}{nearest(str(unknown[0]), self.dofs)}")
            gone = [table[dof] for dof in listed]
        kept = np.setdiff1d(np.arange(self.size), gone)
        dofs = tuple(self.dofs[k] for k in kept)
        place = {_split(dof): k for k, dof in enumerate(dofs)}
        dependent = {
            key: weights and {dof: weight for dof, weight in weights.items() if dof in place}
            for key, weights in self.dependent.items()
        }
        matrices = {key: getattr(self, key) for key in MATRICES}
        return self._with(
            {key: value[kept][:, kept] for key, value in matrices.items() if scipy.sparse.issparse(value)}
            | {"dofs": dofs, "place": place, "dependent": dependent}
        )

    def lumped(self) -> Body:
        """Return the body with all mass at its nodes: a diagonal M.

        Every entry is the sum of its row of M over the dofs of the same direction (row sums), so that rigid
        translations keep their kinetic energy; frequencies come out lower, by the square of the element size.
        The impact of one node then moves no other at that instant, and a transient has far fewer events. Call
        it before `held`, which takes away the mass between a node and held ones.

        All other matrices stay as they are. `Rayleigh` damping refers to the new M. The terms of a
        rotation (`elastic`) and damping matrices couple velocities, never impulses; G stays skew-symmetric
        and K symmetric, so that they do no work over a cycle, and waves move apart by less than with the
        consistent M, again by the square of the element size.

        Raises
        ------
        InputError
            If a sum is not positive, as at corners of quadratic elements.
        """
        direction = np.array([_split(dof)[1] for dof in self.dofs])
        entries = scipy.sparse.coo_array(self.mass)
        alike = direction[entries.row] == direction[entries.col]
        masses = np.bincount(entries.row[alike], entries.data[alike], self.size)
        if not (masses > 0.0).all():
            k = int(np.argmin(masses > 0.0))
            raise InputError(f"mass: the row of {self.dofs[k]!r} sums to {masses[k]:.4g} kg, not a mass")
        return self._with({"mass": scipy.sparse.csr_array(scipy.sparse.diags_array(masses))})

    def _with(self, changes: dict[str, Any]) -> Body:
        """Return the body with other attributes."""
        body = object.__new__(Body)
        body.__dict__.update(self.__dict__ | changes)
        for derived in ("mesh", "names"):
            body.__dict__.pop(derived, None)
        return body

    @cached_property
    def mesh(self) -> Mesh | None:
        """Points, the dofs that move them, and cells; None where no points are known."""
        if self.points is None:
            return None
        places = np.full(self.points.shape, -1, dtype=np.int64)
        for (node, direction), k in self.place.items():
            if direction <= self.points.shape[1]:
                places[self._known[node], direction - 1] = k
        rows: list[dict[int, float]] = []
        for (node, direction), weights in self.dependent.items():
            if weights and node in self._known and direction <= self.points.shape[1]:
                places[self._known[node], direction - 1] = self.size + len(rows)
                rows.append({self.place[dof]: weight for dof, weight in weights.items()})
        return Mesh(self.points, places, self.cells, of_rows(rows, self.size) if rows else None)

    @classmethod
    def elastic(
        cls,
        mesh: Any,
        *,
        young: float,
        poisson: float,
        density: float,
        plane: Literal["strain", "stress"] | None = None,
        thickness: float | None = None,
        rotation: Rotation | None = None,
        damping: DampingLike | None = None,
        name: str | None = None,
    ) -> Body:
        """Return the body of one isotropic elastic material on a mesh of scikit-fem.

        ``M = integral of rho N' N``, ``K = integral of (grad N)' C (grad N)`` with linear shape functions N,
        integrated exactly up to degree 2 by three points in a triangle, four in a tetrahedron, and by two
        Gauss points per direction in quadrilaterals and hexahedra (Hughes, The Finite Element Method, 2000,
        chapters 2, 3 and 7). Such cells are too stiff in bending unless several of them lie across it.

        Parameters
        ----------
        mesh
            ``skfem.MeshTri``, ``MeshQuad``, ``MeshTet`` or ``MeshHex``, m; its boundaries become surfaces.
            `ring` makes one, and ``skfem.Mesh.load`` reads those of gmsh and of other programs.
        young, poisson, density
            Pa, 1 and kg/m3.
        plane
            Of a mesh in the plane: no displacement across it (``"strain"``, the default) or no stress.
        thickness
            Of a mesh in the plane, m; None: 1 m.
        rotation
            How the material of a body of revolution turns about its axis. Displacements u are those of the
            points in space through which the material runs with v, and it moves with ``u' + (v . grad) u``:
            ``G = D - D'`` with ``D = integral of rho N' (v . grad) N``, and
            ``integral of rho ((v . grad) N)' ((v . grad) N)`` goes off K. The two waves with n nodal
            diameters and the frequency w at rest get ``w + n speed`` and ``w - n speed`` if all their motion
            is along the axis. For a thin ring that bends in its plane the same kinetic energy gives
            ``sqrt(w^2 - e^2) + n e`` and ``sqrt(w^2 - e^2) - n e`` with
            ``e = speed (n^2 - 1) / (n^2 + 1)`` (Bryan, Proceedings of the Cambridge Philosophical Society 7,
            1890, in the frame of the ring). The stress of the centrifugal force, which adds about speed^2 to
            squares of frequencies, is left out. Damping acts on u', not on the motion of the material.
        damping
            As above. `Rayleigh` damping of a body that rotates refers to its K at rest, and becomes a
            matrix.
        name
            As above.

        Raises
        ------
        InputError
            If scikit-fem is missing, the mesh is none of these, has a point in no cell, a folded cell or one
            without volume, a number is out of its range, or a body that rotates is no body of revolution.
        """
        basis, matrices = elastic_matrices(mesh, young, poisson, density, plane, thickness, rotation, damping)
        return cls.from_skfem(basis, **matrices, name=name)

    @classmethod
    def from_skfem(
        cls,
        basis: Any,
        mass: MatrixLike,
        stiffness: MatrixLike,
        *,
        damping: DampingLike | None = None,
        gyroscopic: MatrixLike | None = None,
        name: str | None = None,
    ) -> Body:
        """Return the body of a scikit-fem basis: points, cells and named boundaries of its mesh come along.

        Parameters
        ----------
        basis
            ``skfem.Basis(mesh, skfem.ElementVector(...))`` of an element with dofs at the corners only; the
            surfaces are ``mesh.with_boundaries(...)``.
        mass, stiffness, damping, gyroscopic, name
            As above; what a form of the basis assembles.

        Raises
        ------
        InputError
            If the element has other dofs, or anything is ill-posed.
        """
        parts = mesh_parts(basis)
        return cls(
            mass,
            stiffness,
            points=parts.points,
            dofs=parts.dofs,
            damping=damping,
            gyroscopic=gyroscopic,
            cells=parts.cells,
            surfaces=parts.surfaces,
            name=name,
        )

    def __repr__(self) -> str:
        return "\n".join(
            [f"Body({self.size} dofs)", *(f"  {name}: {what}" for name, what in self.summary().facts)]
        )

    def summary(self) -> Summary:
        """Return the size of the body, its surfaces, and what a reader did."""
        facts = [("dofs", str(self.size))]
        if self.points is not None:
            facts.append(("points", str(len(self.points))))
        facts += [("cells", f"{len(nodes)} {kind}") for kind, nodes in self.cells.items()]
        if self._surfaces:
            facts.append(("surfaces", ", ".join(self._surfaces)))
        return Summary(facts + [("note", note) for note in self.notes])


def _nodes(points: Any) -> tuple[NDArray[np.int64], Real | None]:
    """Return node numbers and coordinates."""
    if points is None:
        return np.zeros(0, dtype=np.int64), None
    if isinstance(points, Mapping):
        numbers = list(points)
        if not all(isinstance(n, int | np.integer) and not isinstance(n, bool) for n in numbers):
            raise InputError(f"points: expected node numbers as keys, got {described(numbers)}")
        nodes, rows = np.array(numbers, dtype=np.int64), real_array("points", list(points.values()), 2)
    else:
        rows = real_array("points", points, 2)
        nodes = np.arange(1, len(rows) + 1)
    if rows.shape[1] not in (2, 3):
        raise InputError(f"points: expected 2 or 3 coordinates per node, got {rows.shape[1]}")
    if not np.isfinite(rows).all():
        k = int(np.flatnonzero(~np.isfinite(rows).all(axis=1))[0])
        raise InputError(f"points: must be finite, got {rows[k]} at node {nodes[k]}")
    return nodes, rows


def _split(dof: str) -> tuple[int, int]:
    """Return node and direction of a name; 12.10 is no direction 1, names are text."""
    node, dot, direction = dof.partition(".") if isinstance(dof, str) else ("", "", "")
    if dot and node.lstrip("-").isdecimal() and direction in ("1", "2", "3", "4", "5", "6"):
        return int(node), int(direction)
    raise InputError(f"dofs: expected names 'node.direction' with a direction 1 to 6, got {dof!r}")
