"""What a viewer is told before all else: which motion it sees, what there is of it, and the timeline."""

from __future__ import annotations

from bunraku import __version__
from bunraku.backing.backing import clock
from bunraku.backing.frames import frame
from bunraku.backing.library import StoredMotion
from bunraku.playout.held import Held
from bunraku.stream.playing import Playing
from bunraku.stream.tracks import channels
from bunraku.wire.messages import ChannelHeader, TimelineState


class Announcing:
    """To one viewer, who has `held` from before, if anything."""

    __slots__ = ("_held", "_told")

    def __init__(self, held: Held | None) -> None:
        self._held = held
        self._told: tuple[StoredMotion, TimelineState] | None = None

    def news(self, state: TimelineState, playing: Playing, far: bool) -> list[bytes]:
        """The framed timeline if it is new, after what says of a new motion what it is: of all of its tracks unless the
        line is `far`."""
        told, motion = self._told, playing.motion
        if told is not None and told[1] is state:
            return []
        messages = [state.pack()]
        if told is None or told[0] is not motion:
            held, self._held = self._held, None
            if not playing.has(held):
                messages.insert(0, playing.described(far))
            messages.insert(0, ChannelHeader(motion.id, clock(), channels(motion), __version__).pack())
        self._told = motion, state
        return [frame(message) for message in messages]
