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
