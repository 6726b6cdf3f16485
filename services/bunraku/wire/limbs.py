"""Limbs by number (proto/SPEC.md, 1.4): limb l of performer k is 4 k + l."""

LIMBS: tuple[str, ...] = ("left_hand", "right_hand", "left_leg", "right_leg")
"""Limbs of one performer."""
MAX_PERFORMERS = 4
MAX_LIMBS = len(LIMBS) * MAX_PERFORMERS
MAX_BONDS = MAX_LIMBS // 4
"""Most bonds of a stage: half of a performer's limbs are hands, and each is in one bond."""

MAX_SHOWN_PULLS = 16
"""Most pulls of a crowd on one limb that viewers are sent."""


def is_hand(limb: int) -> bool:
    """Return whether the limb of this number is a hand."""
    return limb % len(LIMBS) < 2


def limb_number(limb: str | int) -> int:
    """Return the number of a limb of the first performer by its name; a number is returned unchanged.

    Raises ValueError for a name that is not in `LIMBS`.
    """
    return limb if isinstance(limb, int) else LIMBS.index(limb)
