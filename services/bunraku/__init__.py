"""Bunraku: a humanoid dances in the browser, and the people watching pull its strings."""

__version__ = "0.1.0"
