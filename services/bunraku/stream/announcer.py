"""What a viewer is told before all else: which motion it sees, what there is of it, and the timeline."""

from __future__ import annotations

from bunraku import __version__
from bunraku.codec.container import StoredMotion
from bunraku.delivery.resume import ResumeState
from bunraku.runtime.clock import clock
from bunraku.stream.motion_delivery import MotionDelivery
from bunraku.stream.track_selection import count_channels
from bunraku.websocket.frame import encode_frame
from bunraku.wire.messages import ChannelHeader, TimelineState


class MotionAnnouncer:
    """To one viewer, who has `held` from before, if anything."""

    __slots__ = ("_announced", "_resume_state")

    def __init__(self, resume_state: ResumeState | None) -> None:
        self._resume_state = resume_state
        self._announced: tuple[StoredMotion, TimelineState] | None = None

    def next_frames(self, state: TimelineState, delivery: MotionDelivery, is_high_rtt: bool) -> list[bytes]:
        """The framed timeline if it is new, after what says of a new motion what it is: of all of its tracks unless the
        line is `far`."""
        told, motion = self._announced, delivery.motion
        if told is not None and told[1] is state:
            return []
        messages = [state.pack()]
        if told is None or told[0] is not motion:
            held, self._resume_state = self._resume_state, None
            if not delivery.resume_from(held):
                messages.insert(0, delivery.initial_description(is_high_rtt))
            messages.insert(0, ChannelHeader(motion.id, clock(), count_channels(motion), __version__).pack())
        self._announced = motion, state
        return [encode_frame(message) for message in messages]
