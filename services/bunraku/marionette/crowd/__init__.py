"""Limbs that a crowd moves together (proto/control.md, 5.11)."""
