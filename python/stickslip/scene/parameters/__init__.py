"""Parameters: every number of a scene or a model by its name, and the values that calls take for them."""
