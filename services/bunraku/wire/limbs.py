"""The limbs that are pulled, by number (SPEC.md, Conventions)."""

LIMBS: tuple[str, ...] = ("left_hand", "right_hand", "left_leg", "right_leg")
"""Of each performer."""
MOST_PERFORMERS = 4
MOST_LIMBS = len(LIMBS) * MOST_PERFORMERS
