"""Bunraku: streams humanoid motion to browsers and lets several people control the limbs at the same time."""

__version__ = "0.1.0"
