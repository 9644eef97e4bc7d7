"""One sample of a study: its scene, what is computed of it, and what identifies the functions involved."""
