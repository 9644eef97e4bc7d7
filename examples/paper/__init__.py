"""The published two-subsystem model: printed numbers, comparison with computed ones, figures of the paper."""
