"""A scene of meshed bodies and their contact pairs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import scipy.sparse
from numpy.typing import ArrayLike

from stickslip.faults import InputError
from stickslip.fe.body import Body
from stickslip.fe.pairs import Pairs
from stickslip.scene.checks import Real, described, real_array, real_number
from stickslip.scene.contact import Contact, nearest
from stickslip.scene.laws.damping import DampingLike, Rayleigh, rayleigh_matrix
from stickslip.scene.scene import Scene
from stickslip.show.mesh import Mesh

#: Forces by the names of dofs, several of them, or one per dof; N.
Force = Mapping[str, float] | Sequence[Mapping[str, float]] | ArrayLike | None


def assemble(
    bodies: Body | Sequence[Body],
    pairs: Pairs | Contact | Iterable[Pairs | Contact] = (),
    *,
    force: Force = None,
    damping: DampingLike | None = None,
    impact_friction: bool = False,
) -> Scene:
    """Return the scene of bodies and contacts: an ordinary `Scene` that knows its points.

    Parameters
    ----------
    bodies
        The bodies, one after the other in the dofs of the scene. Names of dofs must differ: give bodies
        names where node numbers meet.
    pairs
        The contacts: what `contact_pairs` returns, `Contact`, or several of them.
    force
        Constant forces, N: what `Surface.pressure` returns, any mapping from names of dofs, several of these
        (they add up), or a vector (n,).
    damping
        Damping of the whole scene, as in `Scene`; None: that of the bodies. If all bodies have the same
        `Rayleigh` damping, the scene has it too; otherwise their damping becomes a matrix.
    impact_friction
        As in `Scene`.

    Raises
    ------
    InputError
        If names of dofs meet, a force is on an unknown dof, or the scene is ill-posed.
    """
    listed = [bodies] if isinstance(bodies, Body) else list(bodies)
    if not listed or not all(isinstance(body, Body) for body in listed):
        raise InputError(f"bodies: expected at least one Body, got {described(bodies)}")
    dofs = [name for body in listed for name in body.names]
    if len(set(dofs)) != len(dofs):
        seen: set[str] = set()
        twice = next(dof for dof in dofs if dof in seen or seen.add(dof))  # type: ignore[func-returns-value]
        raise InputError(f"bodies: {twice!r} is a dof of two of them; give them names: Body(..., name='pad')")
    given: list[Any] = [pairs] if isinstance(pairs, Pairs | Contact) else list(pairs)
    if not all(isinstance(one, Pairs | Contact) for one in given):
        raise InputError(f"pairs: expected Pairs or contacts, got {described(pairs)}")
    contacts = [c for one in given for c in (one.contacts if isinstance(one, Pairs) else [one])]
    return Scene(
        _joined([body.mass for body in listed]),
        _joined([body.stiffness for body in listed]),
        damping=_damping(listed) if damping is None else damping,
        force=force_vector(force, dofs),
        contacts=contacts,
        dofs=dofs,
        impact_friction=impact_friction,
        gyroscopic=_optional(listed, "gyroscopic"),
        circulatory=_optional(listed, "circulatory"),
        mesh=_mesh(listed),
    )


def force_vector(force: Force, dofs: Sequence[str]) -> Real:
    """Return forces as a vector (n,).

    Raise `InputError` if a dof is unknown or a number is none.
    """
    parts: Sequence[Any] = [force] if isinstance(force, Mapping) else force  # type: ignore[assignment]
    if force is None:
        return np.zeros(len(dofs))
    if not (isinstance(parts, Sequence) and parts and all(isinstance(one, Mapping) for one in parts)):
        vector = real_array("force", force, 1)  # type: ignore[arg-type]
        if vector.shape != (len(dofs),):
            raise InputError(f"force: expected shape ({len(dofs)},), got {vector.shape}")
        return vector
    place = {dof: k for k, dof in enumerate(dofs)}
    total = np.zeros(len(dofs))
    for one in parts:
        for dof, value in one.items():
            if dof not in place:
                raise InputError(f"force: unknown dof {dof!r}{nearest(str(dof), dofs)}")
            total[place[dof]] += real_number(f"force[{dof!r}]", value)
    return total


def _joined(blocks: Sequence[Any]) -> scipy.sparse.csr_array:
    return scipy.sparse.csr_array(scipy.sparse.block_diag(blocks, format="csr"))


def _optional(bodies: Sequence[Body], name: str) -> scipy.sparse.csr_array | None:
    parts = [getattr(body, name) for body in bodies]
    if all(part is None for part in parts):
        return None
    return _joined(
        [
            scipy.sparse.csr_array((body.size, body.size)) if part is None else part
            for body, part in zip(bodies, parts, strict=True)
        ]
    )


def _damping(bodies: Sequence[Body]) -> Any:
    parts = [body.damping for body in bodies]
    if all(part is None for part in parts):
        return None
    if isinstance(parts[0], Rayleigh) and all(part == parts[0] for part in parts[1:]):
        return parts[0]
    blocks = []
    for body, part in zip(bodies, parts, strict=True):
        if part is None:
            blocks.append(scipy.sparse.csr_array((body.size, body.size)))
        elif isinstance(part, Rayleigh):
            blocks.append(rayleigh_matrix(part, body.mass, body.stiffness))
        else:
            blocks.append(part)
    return _joined(blocks)


def _mesh(bodies: Sequence[Body]) -> Mesh | None:
    """Return the points of all bodies, None where those of one are not known or of another dimension."""
    meshes = [body.mesh for body in bodies]
    known = [mesh for mesh in meshes if mesh is not None]
    if len(known) < len(bodies) or len({mesh.points.shape[1] for mesh in known}) > 1:
        return None
    cells: dict[str, list[Any]] = {}
    dofs, before, first = [], 0, 0
    sums = [
        scipy.sparse.csr_array((0, body.size)) if mesh.dependent is None else mesh.dependent
        for body, mesh in zip(bodies, known, strict=True)
    ]
    # Sums stand behind the dofs of all bodies.
    behind = sum(body.size for body in bodies)
    for body, mesh, rows in zip(bodies, known, sums, strict=True):
        own, others = mesh.dofs + before, mesh.dofs - body.size + behind
        dofs.append(np.where(mesh.dofs < 0, -1, np.where(mesh.dofs < body.size, own, others)))
        behind += rows.shape[0]
        for kind, nodes in mesh.cells.items():
            cells.setdefault(kind, []).append(nodes + first)
        before, first = before + body.size, first + len(mesh.points)
    return Mesh(
        np.concatenate([mesh.points for mesh in known]),
        np.concatenate(dofs),
        {kind: np.concatenate(nodes) for kind, nodes in cells.items()},
        _joined(sums) if any(rows.shape[0] for rows in sums) else None,
    )
