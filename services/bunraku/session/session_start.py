"""What a session starts from, when it is opened or taken over."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from bunraku.codec.container import StoredMotion
from bunraku.session.live.cast import EMPTY_CAST, Cast
from bunraku.wire.messages import TimelineState
from bunraku.wire.prop import Prop


class Fittings(NamedTuple):
    """What is on a stage beside its motion, and stays when the motion changes."""

    crowd: Mapping[int, str]
    """Merge policies of the limbs that are open to the crowd, by number."""
    props: Mapping[int, Prop]
    """Props by number."""


NO_FITTINGS = Fittings({}, {})


@dataclass(frozen=True, slots=True)
class SessionStart:
    """Session from which a stage starts: a new one, or one of another replica."""

    id: str
    motion: StoredMotion
    timeline: TimelineState
    """Timeline of the motion."""
    created_us: int
    """Clock time of the creation."""
    subject: str = ""
    """Subject of the token that opened the session."""
    cast: Cast = EMPTY_CAST
    """Live performers."""
    fittings: Fittings = NO_FITTINGS
    """Open limbs and props."""
