"""Frames of the Virtual Motion Capture protocol, performer to marionette (protocol.vmc.info, 2.7).

Bones are local transforms of Unity's `HumanBodyBones`, relative to the T-pose of an avatar whose bones have no rotation
there; the root moves the avatar.

A frame is assembled across datagrams. It ends with /VMC/Ext/Blend/Apply, /VMC/Ext/OK or /VMC/Ext/T, or when a bone or
the root repeats. Senders that begin frames with OK and T would be a frame late, so a bundle that completes the bones
seen so far also ends it.
"""

from __future__ import annotations

from bunraku.capture.errors import UnreadableCapture
from bunraku.capture.frame import MAX_BLENDSHAPES, CapturedFrame, CaptureSkeleton, date_frame
from bunraku.capture.humanoid import PARENTS_BY_BONE, ROOT_NAME
from bunraku.capture.osc import parse_packet
from bunraku.capture.vmc_messages import FrameEnd, Transform, Weight, read_message
from bunraku.marionette.solver.vector import Quaternion, Vector, scale

DEFAULT_PORT = 39539
"""Port of a marionette by the protocol's convention."""


class VmcAssembler:
    """Parser of VMC messages in any order; see the module for the end of a frame.

    The time of a frame is that of /VMC/Ext/T in its bundle, else of the last one since the previous frame.
    """

    skeleton = CaptureSkeleton(PARENTS_BY_BONE, in_world=False)

    def __init__(self) -> None:
        self._positions: dict[str, Vector] = {}
        self._rotations: dict[str, Quaternion] = {}
        self._time_s: float | None = None
        self._scale = 1.0
        self._bones_seen: set[str] = set()
        self._set_weights: dict[str, float] = {}
        self._applied_weights: dict[str, float] = {}

    def feed(self, datagram: bytes) -> list[CapturedFrame]:
        """Return the frames that `datagram` ends.

        Raises `UnreadableCapture`; then no message of the datagram counts.
        """
        messages = [read_message(message) for message in parse_packet(datagram)]
        self._check_blendshape_count(messages)
        closed: list[CapturedFrame] = []
        # the last of `closed` gets the time of a later message of this bundle, up to the next transform
        awaits_time = False
        for message in messages:
            match message:
                case Transform():
                    awaits_time = False
                    self._add_transform(message, closed)
                case Weight():
                    self._set_weights[message.name] = message.weight
                case FrameEnd(time_s=None):
                    if message.applies_weights:
                        self._applied_weights |= self._set_weights
                        self._set_weights = {}
                    awaits_time |= self._close_frame(closed)
                case FrameEnd(time_s=time_s):
                    self._add_time(time_s, closed, awaits_time)
                    awaits_time = False
        if len(messages) > 1 and self._is_complete():
            self._close_frame(closed)
        return closed

    def _add_transform(self, transform: Transform, closed: list[CapturedFrame]) -> None:
        """Add a bone, to the next frame if the pending one has it.

        A copy of the last bone, or any copy in an incomplete frame, is a duplicate.
        """
        bone, position, rotation, factor = transform
        if bone in self._rotations:
            copied = (position, rotation) == (self._positions[bone], self._rotations[bone])
            if not copied or (self._is_complete() and bone != next(reversed(self._rotations))):
                self._close_frame(closed)
        if factor is not None:
            self._scale = factor
        self._positions[bone] = position
        self._rotations[bone] = rotation

    def _add_time(self, time_s: float | None, closed: list[CapturedFrame], awaits_time: bool) -> None:
        """Date the pending frame, unless it has a time: then that of a closed frame, or of the next one."""
        if self._time_s is None and self._has_bones():
            self._time_s = time_s
            self._close_frame(closed)
        elif awaits_time and not self._has_bones() and closed[-1].sender_time_s is None:
            closed[-1] = date_frame(closed[-1], time_s)
        else:
            self._close_frame(closed)
            self._time_s = time_s

    def _check_blendshape_count(self, messages: list[Transform | Weight | FrameEnd | None]) -> None:
        names = {message.name for message in messages if isinstance(message, Weight)}
        count = len(names | self._set_weights.keys() | self._applied_weights.keys()) if names else 0
        if count > MAX_BLENDSHAPES:
            raise UnreadableCapture("Too many blendshapes", f"{count} names, expected at most {MAX_BLENDSHAPES}")

    def _has_bones(self) -> bool:
        return len(self._rotations) > (ROOT_NAME in self._rotations)

    def _is_complete(self) -> bool:
        """Return whether the pending frame has all bones seen so far."""
        return self._bones_seen <= self._rotations.keys()

    def _close_frame(self, closed: list[CapturedFrame]) -> bool:
        """Append the pending frame and return True, if it has a bone."""
        if not self._has_bones():
            return False
        positions = self._positions
        if self._scale != 1.0:
            positions = {b: p if b == ROOT_NAME else scale(p, self._scale) for b, p in positions.items()}
        frame = CapturedFrame(positions, self._rotations, blendshapes=dict(self._applied_weights))
        closed.append(date_frame(frame, self._time_s))
        self._bones_seen |= self._rotations.keys()
        self._positions, self._rotations, self._time_s = {}, {}, None
        return True
