"""Matrices as the files that finite-element programs write: one function per format."""

import numpy as np
import scipy.sparse


def calculix(path, matrix):
    """Write the upper triangle column by column, 14 digits."""
    upper = scipy.sparse.triu(scipy.sparse.coo_array(matrix)).tocoo()
    order = np.lexsort(upper.coords)
    rows, columns = (c[order] for c in upper.coords)
    lines = [f"{i + 1} {j + 1} {v:20.13e}" for i, j, v in zip(rows, columns, upper.data[order], strict=True)]
    path.write_text("\n".join(lines) + "\n")


def names(path, dofs):
    """Write the names of dofs, one a line."""
    path.write_text("".join(f"{dof}\n" for dof in dofs))


def matrix_input(path, matrix, dofs, keep=np.tril):
    """Write lines of Abaqus' MATRIX INPUT, 15 digits."""
    part = np.where(keep(np.ones(matrix.shape, dtype=bool)), matrix, 0.0)
    text = [dof.split(".") for dof in dofs]
    path.write_text(
        "".join(
            f"{text[i][0]},{text[i][1]}, {text[j][0]},{text[j][1]}, {part[i, j]:.15e}\n"
            for i, j in np.argwhere(part)
        )
    )


def coordinate(path, matrix):
    """Write lines of Abaqus' COORDINATE, all entries, 15 digits."""
    path.write_text("".join(f"{i + 1} {j + 1} {matrix[i, j]:.15e}\n" for i, j in np.argwhere(matrix)))


def harwell_boeing(path, matrix, symmetric=True, each=4):
    """Write RSA (lower triangle) or RUA, 15 digits after the first."""
    columns = scipy.sparse.csc_array(np.tril(matrix) if symmetric else matrix)
    columns.sort_indices()

    def block(values, shape, per_line):
        fields = [shape.format(v) for v in values]
        return ["".join(fields[k : k + per_line]) for k in range(0, len(fields), per_line)]

    parts = [
        block(columns.indptr + 1, "{:10d}", 8),
        block(columns.indices + 1, "{:10d}", 8),
        block(columns.data, "{:25.15E}", each),
    ]
    counts = [len(part) for part in parts]
    kind = "RSA" if symmetric else "RUA"
    head = [
        f"{'a block':72}{'KEY':8}",
        "".join(f"{k:14d}" for k in (sum(counts), *counts, 0)),
        f"{kind:14}" + "".join(f"{k:14d}" for k in (*columns.shape, columns.nnz, 0)),
        f"{'(8I10)':16}{'(8I10)':16}{f'({each}E25.15)':20}{'':20}",
    ]
    path.write_text("\n".join([*head, *parts[0], *parts[1], *parts[2]]) + "\n")


def punch(path, matrices, dofs, fields="large", symmetric=True):
    """Write matrices by name as DMIG cards of Nastran, of symmetric ones the upper half."""
    lines = ["$TITLE   = PAD", "DTI     SELOADS        0       0"]
    for name, matrix in matrices.items():
        form = 6 if symmetric else 1
        lines.append(f"DMIG    {name:8s}{0:8d}{form:8d}{2:8d}{0:8d}{'':8s}{'':8s}{len(dofs):8d}")
        for j, column in enumerate(dofs):
            node, direction = column.split(".")
            rows = [i for i in range(j + 1 if symmetric else len(dofs)) if matrix[i, j] != 0.0]
            entries = [(*dofs[i].split("."), float(matrix[i, j])) for i in rows]
            if not entries:
                continue
            if fields == "large":
                lines.append(f"DMIG*   {name:16s}{node:>16s}{direction:>16s}")
                lines += [
                    f"*       {n:>16s}{c:>16s}{value:16.9E}".replace("E", "D") for n, c, value in entries
                ]
            elif fields == "free":
                (n, c, value), *others = entries
                lines.append(f"DMIG,{name},{node},{direction},,{n},{c},{value!r}")
                lines += [f",{n},{c},{value!r}" for n, c, value in others]
            else:
                (n, c, value), *others = entries
                small = f"DMIG    {name:8s}{node:>8s}{direction:>8s}{'':8s}{n:>8s}{c:>8s}"
                lines.append(small + f"{short(value):>8s}")
                lines += [f"        {n:>8s}{c:>8s}{short(value):>8s}" for n, c, value in others]
    path.write_text("\n".join([*lines, "ENDDATA", ""]))


def short(value):
    """Return a number in eight letters, whose exponent has none."""
    return f"{value:.2E}".replace("E", "")


def mapping(path, dofs):
    """Write the mapping file of Ansys."""
    labels = dict(zip("123456", ("UX", "UY", "UZ", "ROTX", "ROTY", "ROTZ"), strict=True))
    lines = ["   Matrix Eqn     Node      DOF"]
    for k, dof in enumerate(dofs, 1):
        node, direction = dof.split(".")
        lines.append(f"{k:12d} {node:>12s} {labels[direction]:>6s}")
    path.write_text("\n".join([*lines, ""]))
