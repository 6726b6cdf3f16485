"""Errors of the codec."""


class DamagedBlock(ValueError):
    """Invalid bytes or description: truncated, damaged, hostile, or of another codec. The message gives the reason."""
