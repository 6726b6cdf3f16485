"""Captured frames: what a capture tool says of one instant, in its own unit, in right-handed axes.

Parsers return frames with the joint names of their `CaptureSkeleton`. Quaternions are w x y z. Any right-handed axes
and any unit will do: the calibration detects them. Parsers of left-handed protocols convert.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import fsum, isfinite, sqrt
from typing import Protocol

from bunraku.capture.errors import UnreadableCapture
from bunraku.marionette.solver.vector import Quaternion, Vector

MAX_DATAGRAM_BYTES = 65_507
"""Largest payload of UDP over IPv4."""
MAX_COORDINATE = 1e6
"""Bound of coordinates in the sender's unit: a kilometre in millimetres."""
MAX_LENGTH_DEVIATION = 0.01
"""Largest deviation of a quaternion's length from one. Senders round to 32 bits or to four decimals."""
SINGLE_PRECISION = 2.0**-23
"""Resolution of a 32-bit float, as a share of its value."""
MAX_TIME_RESOLUTION_S = 0.004
"""Coarser times are no better than arrivals: those of 32-bit seconds after nine hours."""
MAX_BLENDSHAPES = 512
MAX_BLENDSHAPE_NAME_LENGTH = 128


@dataclass(frozen=True, slots=True)
class CaptureSkeleton:
    """Joints of a capture format, parents before children, each with its parent.

    Positions and rotations of frames are in the world if `in_world`, else relative to the parent. `t_pose` are the
    positions in the world, in the T-pose, of joints whose positions the sender may omit.
    """

    parents: Mapping[str, str | None]
    in_world: bool
    t_pose: Mapping[str, Vector] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class CapturedFrame:
    """One frame; joints that the sender omitted or the network lost are absent.

    `sender_time_s` is the sender's clock and `time_resolution_s` its resolution, `sequence` the sender's frame counter
    (modulo 2**32); None if the protocol has none or the message was lost. `blendshapes` are weights by name, passed
    through.
    """

    positions: dict[str, Vector]
    rotations: dict[str, Quaternion]
    sender_time_s: float | None = None
    sequence: int | None = None
    blendshapes: dict[str, float] = field(default_factory=dict)
    time_resolution_s: float = 0.0


class FrameAssembler(Protocol):
    """Parser of one protocol: datagrams in, complete frames out."""

    skeleton: CaptureSkeleton

    def feed(self, datagram: bytes) -> list[CapturedFrame]:
        """Return the frames that `datagram` completes.

        Raises `UnreadableCapture` if it is invalid; then it changes nothing.
        """


def check_size(datagram: bytes) -> None:
    """Raise `UnreadableCapture` if `datagram` is empty or larger than UDP can carry."""
    if not 0 < len(datagram) <= MAX_DATAGRAM_BYTES:
        raise UnreadableCapture("Invalid datagram", f"it has {len(datagram)} bytes, expected 1 to {MAX_DATAGRAM_BYTES}")


def check_position(values: Sequence[float], joint: str) -> Vector:
    """Return three coordinates; raise `UnreadableCapture` if one is not finite or out of range."""
    x, y, z = values
    if not (abs(x) <= MAX_COORDINATE and abs(y) <= MAX_COORDINATE and abs(z) <= MAX_COORDINATE):
        raise UnreadableCapture(
            "Invalid position",
            f"({x:g}, {y:g}, {z:g}) is not within {MAX_COORDINATE:g}",
            field=joint,
            hint="check the unit and the calibration of the capture tool",
        )
    return (x, y, z)


def check_rotation(values: Sequence[float], joint: str) -> Quaternion:
    """Return a quaternion at unit length; raise `UnreadableCapture` if it is not finite or not a rotation."""
    w, x, y, z = values
    size = sqrt(fsum((w * w, x * x, y * y, z * z))) if max(abs(w), abs(x), abs(y), abs(z)) < 2.0 else float("nan")
    if not abs(size - 1.0) <= MAX_LENGTH_DEVIATION:
        raise UnreadableCapture(
            "Invalid rotation",
            f"the quaternion ({w:g}, {x:g}, {y:g}, {z:g}) does not have length 1",
            field=joint,
            hint="send unit quaternions, and check that the tool tracks this joint",
        )
    return (w / size, x / size, y / size, z / size)


def check_weight(name: str, value: float, count: int) -> float:
    """Return the weight of a blendshape; raise `UnreadableCapture` if it is invalid or the `count`-th is too many."""
    if count > MAX_BLENDSHAPES or not 0 < len(name) <= MAX_BLENDSHAPE_NAME_LENGTH or not isfinite(value):
        raise UnreadableCapture(
            "Invalid blendshape",
            f"the weight is {value:g}, the name has {len(name)} characters, and it is number {count}",
            field=name[:MAX_BLENDSHAPE_NAME_LENGTH],
            hint=f"send at most {MAX_BLENDSHAPES} finite weights, names up to {MAX_BLENDSHAPE_NAME_LENGTH} long",
        )
    return value


def date_frame(frame: CapturedFrame, time_s: float | None) -> CapturedFrame:
    """Return `frame` with the sender's time in single precision, as OSC senders mostly send it.

    A time of None or too coarse a resolution is left out.
    """
    resolution_s = SINGLE_PRECISION * abs(time_s or 0.0)
    if time_s is None or resolution_s > MAX_TIME_RESOLUTION_S:
        return frame
    return replace(frame, sender_time_s=time_s, time_resolution_s=resolution_s)


def mirror_position(position: Vector) -> Vector:
    """Convert a position between Unity's left-handed axes and right-handed ones, as `motion.unity_axes` does."""
    return (-position[0], position[1], position[2])


def mirror_rotation(rotation: Quaternion) -> Quaternion:
    """Convert a quaternion w x y z between Unity's left-handed axes and right-handed ones."""
    return (rotation[0], rotation[1], -rotation[2], -rotation[3])
