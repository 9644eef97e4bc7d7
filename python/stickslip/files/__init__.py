"""Scenes, cases, studies and datasets as files."""
