"""A band of modes of a large scene along one parameter."""
