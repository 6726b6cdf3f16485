"""Props: things that performers hold in a hand, or that lie on the floor of the stage (proto/playback.md, 4.12)."""

from __future__ import annotations

import re
from enum import StrEnum
from typing import Any, NamedTuple, Self

from bunraku.motion.placement import STAGE_CENTRE, Placement

MAX_PROPS = 8
"""Most props of a session, and of a stored motion."""


class PropKind(StrEnum):
    """Props that every client can draw."""

    FAN = "fan"
    UMBRELLA = "umbrella"
    BALL = "ball"
    BRANCH = "branch"


STORED_PROP_PATTERN = r"[a-z2-7]{20}"
"""Ids of stored props, which are kinds too (proto/http.md, 7.10)."""


def is_stored_prop(kind: str) -> bool:
    """Return whether a kind is the id of a stored prop."""
    return re.fullmatch(STORED_PROP_PATTERN, kind) is not None


class PropState(NamedTuple):
    """Where a prop is: in the hand of number `limb`, or, if that is None, on the floor at `place`.

    A prop in a hand keeps the place where it lay before.
    """

    limb: int | None = None
    place: Placement = STAGE_CENTRE


class Prop(NamedTuple):
    """A prop of a session."""

    kind: str
    state: PropState = PropState()

    def to_values(self) -> list[Any]:
        """Return kind, limb and place for MessagePack."""
        return [self.kind, self.state.limb, list(self.state.place)]

    @classmethod
    def from_values(cls, values: Any) -> Self:
        """Return the prop of `to_values`; raise ValueError if it is invalid."""
        if not isinstance(values, list) or len(values) < 3 or not isinstance(values[0], str):
            raise ValueError("a prop is a kind, a limb and a place")
        limb = values[1]
        if limb is not None and not (isinstance(limb, int) and limb >= 0):
            raise ValueError("the limb of a prop is a number or None")
        return cls(values[0], PropState(limb, Placement.parse(values[2])))
