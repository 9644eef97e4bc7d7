"""Complex modes of one status combination: eigenvalues, shapes, powers, tables over all statuses."""
