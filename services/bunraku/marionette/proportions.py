"""Proportions of an arm, which determine its bend table, and the identity of that table.

Lengths are in arm lengths (upper arm + forearm + hand = 1) and masses are fractions of their sum, so that one table
fits every arm of the same shape, whatever its size.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from math import atan2, cos, hypot, radians, sin

from bunraku.marionette.constants import (
    ARM_LENGTH_RATIOS,
    ARM_MASS_RATIOS,
    MAX_ELBOW_BEND_RAD,
    MAX_WRIST_BEND_RAD,
    MIN_TIP_DISTANCE,
    MIN_TIP_DISTANCE_FACTOR,
)

_PART_NAMES = ("L0", "L1", "L2", "M0", "M1", "M2")
_MIN_PARTS = (100, 100, 20, 1, 1, 1)
"""Minimum of each part, of a thousand."""
_TOTAL_PARTS = 10_000


class ProportionsError(ValueError):
    """Proportions outside the supported range; `field` names the part, `hint` the remedy."""

    def __init__(self, message: str, field: str, hint: str) -> None:
        super().__init__(message)
        self.field = field
        self.hint = hint


@dataclass(frozen=True, slots=True)
class Proportions:
    """Link `lengths` (upper arm, forearm, hand; sum 1) and link `masses` (sum 1) of one arm."""

    lengths: tuple[float, float, float]
    masses: tuple[float, float, float]

    @classmethod
    def from_links(
        cls, lengths: tuple[float, float, float], masses: tuple[float, float, float] | None = None
    ) -> Proportions:
        """Return the proportions of links with these lengths and masses in any unit.

        Without masses, each link has the mass per length of Winter's. Raises `ProportionsError` if a link is too short
        for a table.
        """
        if masses is None:
            a, b, c = (
                length * mass / reference
                for length, mass, reference in zip(lengths, ARM_MASS_RATIOS, ARM_LENGTH_RATIOS, strict=True)
            )
            masses = (a, b, c)
        total_length, total_mass = sum(lengths), sum(masses)
        if not (total_length > 0.0 and total_mass > 0.0):
            raise ProportionsError(
                "the lengths or masses of the arm sum to zero", "L0", "give each of the three links a length above zero"
            )
        a, b, c = (float(length / total_length) for length in lengths)
        d, e, f = (float(mass / total_mass) for mass in masses)
        proportions = cls((a, b, c), (d, e, f))
        proportions.rounded()
        return proportions

    @classmethod
    def parse(cls, identity: str) -> Proportions:
        """Parse `L0-L1-L2-M0-M1-M2`, integers all in thousandths or all in ten-thousandths.

        Raises `ProportionsError`.
        """
        if not re.fullmatch(r"[0-9]{1,4}(-[0-9]{1,4}){5}", identity):
            raise ProportionsError(
                f"proportions {identity[:60]!r} are not six integers",
                "proportions",
                "write L0-L1-L2-M0-M1-M2, such as 393-351-256-560-320-120",
            )
        return _validate_parts(tuple(int(part) for part in identity.split("-")))

    @property
    def parts(self) -> tuple[int, ...]:
        """The six numbers in ten-thousandths; lengths and masses sum to 10,000 each (largest remainder)."""
        return (*_apportion(self.lengths), *_apportion(self.masses))

    @property
    def identity(self) -> str:
        """`L0-L1-L2-M0-M1-M2`: name of the arm's table, in thousandths if that loses nothing."""
        parts = self.parts
        if all(part % 10 == 0 for part in parts):
            parts = tuple(part // 10 for part in parts)
        return "-".join(str(part) for part in parts)

    def rounded(self) -> Proportions:
        """Return the proportions that the identity names. Raises `ProportionsError` as `parse` does."""
        return _validate_parts(self.parts)

    @property
    def min_tip_distance(self) -> float:
        """Smallest solved distance of the hand tip from the shoulder, in arm lengths.

        1.25 times the smallest distance that the limits of elbow and wrist allow (the wrist in steps of a degree), and
        at least 0.1: nearer in, the shoulder would have to whirl.
        """
        upper, fore, hand = self.lengths
        nearest = 1.0
        for degrees in range(round(MAX_WRIST_BEND_RAD / radians(1.0)) + 1):
            bend = radians(degrees)
            x, y = fore + hand * cos(bend), hand * sin(bend)
            elbow = min(MAX_ELBOW_BEND_RAD, radians(180.0) - atan2(y, x))
            lower = hypot(x, y)
            turn = elbow + atan2(y, x)
            nearest = min(nearest, hypot(upper + lower * cos(turn), lower * sin(turn)))
        return max(MIN_TIP_DISTANCE, MIN_TIP_DISTANCE_FACTOR * nearest)


def _validate_parts(parts: tuple[int, ...]) -> Proportions:
    whole = 1000 if sum(parts[:3]) < 5000 else _TOTAL_PARTS
    for name, part, least in zip(_PART_NAMES, parts, _MIN_PARTS, strict=True):
        if part * 1000 < least * whole:
            raise ProportionsError(
                f"{name} is {part} of {whole}, too little for an arm", name, f"use at least {least * whole // 1000}"
            )
    for kind, numbers in (("L", parts[:3]), ("M", parts[3:])):
        if sum(numbers) != whole:
            raise ProportionsError(
                f"{kind}0 + {kind}1 + {kind}2 is {sum(numbers)}", f"{kind}0", f"make the three sum to {whole}"
            )
    a, b, c, d, e, f = (part / whole for part in parts)
    return Proportions((a, b, c), (d, e, f))


def _apportion(shares: tuple[float, float, float]) -> list[int]:
    floors = [int(share * _TOTAL_PARTS) for share in shares]
    remainders = [share * _TOTAL_PARTS - floor for share, floor in zip(shares, floors, strict=True)]
    # 1e-6 keeps 0.393 * 10000 = 3929.9999999999995 from losing a part to another number
    whole = [floor + (remainder > 1.0 - 1e-6) for floor, remainder in zip(floors, remainders, strict=True)]
    order = sorted(range(3), key=lambda i: (-(remainders[i] % (1.0 - 1e-6)), i))
    for i in order[: _TOTAL_PARTS - sum(whole)]:
        whole[i] += 1
    return whole
