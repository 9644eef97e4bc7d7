"""Complex modes of one status combination: eigenvalues, shapes, powers, comparisons, tables over statuses."""
