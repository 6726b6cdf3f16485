"""Bonds of two hands."""
