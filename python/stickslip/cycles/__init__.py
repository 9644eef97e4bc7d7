"""What motions settle to: limit cycles, their stability, branches and bifurcations, basins."""
