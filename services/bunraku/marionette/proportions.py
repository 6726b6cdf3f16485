"""The proportions of an arm: what its table of bends depends on, and by what name the table is known.

Lengths are in arm lengths (upper arm + forearm + hand = 1) and masses in parts of their sum, so that one table fits
every arm of the same shape, whatever its size.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from math import atan2, cos, hypot, radians, sin

MAX_ELBOW_BEND_RAD = radians(150.0)
"""The elbow bends from 0 to this."""
MAX_WRIST_BEND_RAD = radians(80.0)
"""The wrist bends from 0 to this."""
MAX_TIP_DISTANCE = 1.0 - 1e-6
"""The farthest a hand tip is solved for, in arm lengths: a fully straight arm has no bend left to choose."""

WINTER_MASSES = (0.028, 0.016, 0.006)
"""Masses of upper arm, forearm and hand as parts of the body's (Winter, Biomechanics and Motor Control, table 4.1)."""
WINTER_LENGTHS = (0.186, 0.146, 0.108)
"""Lengths of the same as parts of the body's height (Drillis and Contini 1966, in Winter, figure 4.1)."""

_PART_NAMES = ("L0", "L1", "L2", "M0", "M1", "M2")
_MIN_PARTS = (100, 100, 20, 1, 1, 1)
"""Of a thousand."""
_TOTAL_PARTS = 10_000


class ProportionsError(ValueError):
    """Proportions that no arm has; `field` says which part, `hint` what to do."""

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
        """From lengths and masses in any unit; without masses each link weighs by its length what Winter's does.

        Raises `ProportionsError` where a link is too short for a table.
        """
        if masses is None:
            a, b, c = (
                length * mass / reference
                for length, mass, reference in zip(lengths, WINTER_MASSES, WINTER_LENGTHS, strict=True)
            )
            masses = (a, b, c)
        whole, heavy = sum(lengths), sum(masses)
        if not (whole > 0.0 and heavy > 0.0):
            raise ProportionsError(
                "an arm needs lengths and masses above zero", "L0", "give the arm's three links lengths"
            )
        a, b, c = (float(length / whole) for length in lengths)
        d, e, f = (float(mass / heavy) for mass in masses)
        made = cls((a, b, c), (d, e, f))
        made.rounded()
        return made

    @classmethod
    def parse(cls, identity: str) -> Proportions:
        """From `L0-L1-L2-M0-M1-M2`, integers in thousandths or all in ten-thousandths. Raises `ProportionsError`."""
        if not re.fullmatch(r"[0-9]{1,4}(-[0-9]{1,4}){5}", identity):
            raise ProportionsError(
                f"proportions {identity[:60]!r} are not six integers",
                "proportions",
                "write L0-L1-L2-M0-M1-M2, such as 393-351-256-560-320-120",
            )
        return _validate_parts(tuple(int(part) for part in identity.split("-")))

    @property
    def parts(self) -> tuple[int, ...]:
        """The six numbers in ten-thousandths, rounded so that lengths and masses sum to 10,000 (largest remainder)."""
        return (*_apportion(self.lengths), *_apportion(self.masses))

    @property
    def identity(self) -> str:
        """`L0-L1-L2-M0-M1-M2`: the name of the arm's table, in thousandths where they say the same."""
        parts = self.parts
        if all(part % 10 == 0 for part in parts):
            parts = tuple(part // 10 for part in parts)
        return "-".join(str(part) for part in parts)

    def rounded(self) -> Proportions:
        """These proportions as their identity has them. Raises `ProportionsError` as `parse` does."""
        return _validate_parts(self.parts)

    @property
    def min_tip_distance(self) -> float:
        """The nearest to the shoulder that a hand tip is solved for, in arm lengths.

        A quarter farther than the nearest point the limits of elbow and wrist allow (the wrist taken degree by
        degree), and at least 0.1: nearer in, the shoulder would have to whirl.
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
        return max(0.1, 1.25 * nearest)


def _validate_parts(parts: tuple[int, ...]) -> Proportions:
    whole = 1000 if sum(parts[:3]) < 5000 else _TOTAL_PARTS
    for name, part, least in zip(_PART_NAMES, parts, _MIN_PARTS, strict=True):
        if part * 1000 < least * whole:
            raise ProportionsError(
                f"{name} is {part} of {whole}", name, f"at least {least * whole // 1000}: the link is too short"
            )
    for kind, numbers in (("L", parts[:3]), ("M", parts[3:])):
        if sum(numbers) != whole:
            raise ProportionsError(
                f"{kind}0 + {kind}1 + {kind}2 is {sum(numbers)}", f"{kind}0", f"the three must sum to {whole} exactly"
            )
    a, b, c, d, e, f = (part / whole for part in parts)
    return Proportions((a, b, c), (d, e, f))


def _apportion(shares: tuple[float, float, float]) -> list[int]:
    floors = [int(share * _TOTAL_PARTS) for share in shares]
    remainders = [share * _TOTAL_PARTS - floor for share, floor in zip(shares, floors, strict=True)]
    # 1e-6 keeps 0.393 * 10000 = 3929.9999999999995 from losing its part to another
    whole = [floor + (remainder > 1.0 - 1e-6) for floor, remainder in zip(floors, remainders, strict=True)]
    order = sorted(range(3), key=lambda i: (-(remainders[i] % (1.0 - 1e-6)), i))
    for i in order[: _TOTAL_PARTS - sum(whole)]:
        whole[i] += 1
    return whole
