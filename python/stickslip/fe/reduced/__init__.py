"""Reduced models with the same contacts, and how well they agree with the full ones."""
