"""Xsens MVN real-time network streaming: pose data as quaternions, message type 02.

Source: Xsens, "MVN real-time network streaming protocol specification", MV0305P, 2.4 and 2.5.3. All values are
big-endian. Positions and orientations of segments are in the world, right-handed with z up; segments have no rotation
in the T-pose. A frame may be split over several datagrams with the same sample counter.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, field

from bunraku.capture.errors import UnreadableCapture, quote_excerpt
from bunraku.capture.frame import CapturedFrame, CaptureSkeleton, check_position, check_rotation, check_size
from bunraku.marionette.solver.vector import Quaternion, Vector

DEFAULT_PORT = 9763
"""Port of MVN's network streamer."""
MAX_PENDING_FRAMES = 8
"""Incomplete frames kept: their other datagrams are late or lost."""
MAX_DATAGRAMS_PER_FRAME = 128
"""The datagram counter has seven bits."""

_SEGMENTS: tuple[tuple[str, str | None], ...] = (
    ("Pelvis", None),
    ("L5", "Pelvis"),
    ("L3", "L5"),
    ("T12", "L3"),
    ("T8", "T12"),
    ("Neck", "T8"),
    ("Head", "Neck"),
    ("RightShoulder", "T8"),
    ("RightUpperArm", "RightShoulder"),
    ("RightForeArm", "RightUpperArm"),
    ("RightHand", "RightForeArm"),
    ("LeftShoulder", "T8"),
    ("LeftUpperArm", "LeftShoulder"),
    ("LeftForeArm", "LeftUpperArm"),
    ("LeftHand", "LeftForeArm"),
    ("RightUpperLeg", "Pelvis"),
    ("RightLowerLeg", "RightUpperLeg"),
    ("RightFoot", "RightLowerLeg"),
    ("RightToe", "RightFoot"),
    ("LeftUpperLeg", "Pelvis"),
    ("LeftLowerLeg", "LeftUpperLeg"),
    ("LeftFoot", "LeftLowerLeg"),
    ("LeftToe", "LeftFoot"),
)
SEGMENTS: tuple[str, ...] = tuple(name for name, _ in _SEGMENTS)
"""Body segments by index; segment ids count from 1. Props and fingers, with higher ids, are skipped."""

HEADER = struct.Struct(">6sIBBIBBBBHH")
"""Id string, sample counter, datagram counter, items, time code in ms, character, body segments, props, finger
segments, reserved, payload size."""
SEGMENT = struct.Struct(">i3f4f")
"""Segment id, position x y z, quaternion w x y z."""
LAST_DATAGRAM = 0x80
"""Flag of the datagram counter."""
_PREFIX, _POSE_QUATERNIONS = b"MXTP", b"MXTP02"


@dataclass(slots=True)
class _PendingFrame:
    datagrams: set[int] = field(default_factory=set)
    datagram_count: int | None = None
    positions: dict[str, Vector] = field(default_factory=dict)
    rotations: dict[str, Quaternion] = field(default_factory=dict)


class MvnAssembler:
    """Parser of MVN datagrams for one character: `character`, or the first one that is received."""

    skeleton = CaptureSkeleton(dict(_SEGMENTS), in_world=True)

    def __init__(self, character: int | None = None) -> None:
        self._character = character
        self._pending: dict[int, _PendingFrame] = {}

    def feed(self, datagram: bytes) -> list[CapturedFrame]:
        """Return the frame that `datagram` completes, if any. Messages of other types are skipped.

        Raises `UnreadableCapture` if the datagram is damaged.
        """
        check_size(datagram)
        if not datagram.startswith(_PREFIX) or len(datagram) < HEADER.size:
            raise UnreadableCapture(
                "Not an MVN datagram",
                f"it begins with {quote_excerpt(datagram[:6])} and has {len(datagram)} bytes",
                hint="check which program sends to this port",
            )
        kind, sample, counter, items, time_ms, character, _, _, _, _, _ = HEADER.unpack_from(datagram)
        if kind != _POSE_QUATERNIONS:
            return []
        positions, rotations = _read_segments(datagram, items)
        if self._character is None:
            self._character = character
        if character != self._character:
            return []
        frame = self._add_part(sample, counter)
        frame.positions |= positions
        frame.rotations |= rotations
        if frame.datagram_count is None or len(frame.datagrams) < frame.datagram_count:
            return []
        del self._pending[sample]
        return (
            [CapturedFrame(frame.positions, frame.rotations, time_ms / 1000.0, sample, time_resolution_s=0.001)]
            if frame.rotations
            else []
        )

    def _add_part(self, sample: int, counter: int) -> _PendingFrame:
        """Return the pending frame of a sample, with the datagram `counter` noted; drop the oldest of too many."""
        index = counter & ~LAST_DATAGRAM
        frame = self._pending.get(sample)
        if frame is None:
            if len(self._pending) >= MAX_PENDING_FRAMES:
                del self._pending[next(iter(self._pending))]
            frame = self._pending[sample] = _PendingFrame()
        frame.datagrams.add(index)
        if counter & LAST_DATAGRAM:
            frame.datagram_count = index + 1
        return frame


def _read_segments(datagram: bytes, items: int) -> tuple[dict[str, Vector], dict[str, Quaternion]]:
    """Return the positions and rotations of the body segments of a pose message."""
    payload = len(datagram) - HEADER.size
    if payload != items * SEGMENT.size:
        raise UnreadableCapture(
            "Truncated MVN datagram",
            f"{items} items take {items * SEGMENT.size} bytes, and the payload has {payload}",
            hint="check the path MTU of the network",
        )
    positions, rotations = {}, {}
    for offset in range(HEADER.size, len(datagram), SEGMENT.size):
        number, *values = SEGMENT.unpack_from(datagram, offset)
        if 1 <= number <= len(SEGMENTS):
            name = SEGMENTS[number - 1]
            positions[name] = check_position(values[:3], name)
            rotations[name] = check_rotation(values[3:], name)
    return positions, rotations
