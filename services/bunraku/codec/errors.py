"""What goes wrong with a block."""


class DamagedBlock(ValueError):
    """A block that cannot be decoded: truncated, damaged, hostile, or of another format. The message says why."""
