"""The limbs that are pulled, by number (SPEC.md, Conventions)."""

LIMBS: tuple[str, ...] = ("left_hand", "right_hand", "left_leg", "right_leg")
"""Of each performer."""
MAX_PERFORMERS = 4
MAX_LIMBS = len(LIMBS) * MAX_PERFORMERS


def limb_number(limb: str | int) -> int:
    """The number of one of `LIMBS` of the first performer, or the number itself; raises ValueError for another name."""
    return limb if isinstance(limb, int) else LIMBS.index(limb)
