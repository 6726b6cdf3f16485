"""Poses of an OSC sender that is described by a mapping file (`osc_mapping`)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import isfinite, radians

from bunraku.capture.errors import UnreadableCapture
from bunraku.capture.frame import (
    MAX_BLENDSHAPES,
    CapturedFrame,
    CaptureSkeleton,
    check_position,
    check_rotation,
    check_weight,
    date_frame,
)
from bunraku.capture.humanoid import PARENTS_BY_BONE, standard_t_pose
from bunraku.capture.osc import OscMessage, parse_packet
from bunraku.capture.osc_mapping import (
    JOINT_PLACEHOLDER,
    METRES_PER_UNIT,
    MappingEntry,
    OscMapping,
    find_bone,
    parse_axes,
)
from bunraku.marionette.solver.vector import IDENTITY, Quaternion, Vector, from_axis_angle, multiply

MAX_ANGLE_RAD = 1e6
_AXES: dict[str, Vector] = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


@dataclass(slots=True)
class _PendingFrame:
    positions: dict[str, Vector] = field(default_factory=dict)
    rotations: dict[str, Quaternion] = field(default_factory=dict)
    blendshapes: dict[str, float] = field(default_factory=dict)
    time_s: float | None = None
    ends: bool = False


class OscAssembler:
    """Parser of messages by a mapping.

    A frame ends with the address of kind `frame_end`, when a joint's rotation or position repeats, and with a bundle
    that completes the rotations seen so far.
    """

    def __init__(self, mapping: OscMapping) -> None:
        self.skeleton = CaptureSkeleton(PARENTS_BY_BONE, mapping.in_world, standard_t_pose())
        self._literal: dict[str, list[MappingEntry]] = {}
        self._patterns: list[tuple[str, str, MappingEntry]] = []
        for entry in mapping.entries:
            before, placeholder, after = entry.address.partition(JOINT_PLACEHOLDER)
            if placeholder:
                self._patterns.append((before, after, entry))
            else:
                self._literal.setdefault(entry.address, []).append(entry)
        self._pending = _PendingFrame()
        self._seen: set[str] = set()

    def feed(self, datagram: bytes) -> list[CapturedFrame]:
        """Return the frames that `datagram` ends; raise `UnreadableCapture`, with no effect, if it is invalid."""
        messages = parse_packet(datagram)
        parts = [part for message in messages for part in self._read_message(message)]
        names = {name for part in parts for name in part.blendshapes}
        if len(names | self._pending.blendshapes.keys()) > MAX_BLENDSHAPES:
            raise UnreadableCapture("Too many blendshapes", f"more than {MAX_BLENDSHAPES} names")
        closed: list[CapturedFrame] = []
        for part in parts:
            repeats = (
                part.rotations.keys() & self._pending.rotations.keys()
                or part.positions.keys() & self._pending.positions.keys()
            )
            if repeats:
                self._close_frame(closed)
            self._pending.positions |= part.positions
            self._pending.rotations |= part.rotations
            self._pending.blendshapes |= part.blendshapes
            if part.time_s is not None:
                self._pending.time_s = part.time_s
            if part.ends:
                self._close_frame(closed)
        if len(messages) > 1 and self._seen and self._seen <= self._pending.rotations.keys():
            self._close_frame(closed)
        return closed

    def _read_message(self, message: OscMessage) -> list[_PendingFrame]:
        """Return what one message contributes by each entry of its address."""
        parts = [_read_entry(entry, entry.joint or "", message) for entry in self._literal.get(message.address, ())]
        for before, after, entry in self._patterns:
            address = message.address
            if (
                len(address) > len(before) + len(after)
                and address.startswith(before)
                and address.endswith(after)
                and "/" not in (name := address[len(before) : len(address) - len(after)])
            ):
                parts.append(_read_entry(entry, name, message))
        return parts

    def _close_frame(self, closed: list[CapturedFrame]) -> None:
        pending = self._pending
        if not pending.rotations:
            return
        frame = CapturedFrame(pending.positions, pending.rotations, blendshapes=pending.blendshapes)
        closed.append(date_frame(frame, pending.time_s))
        self._seen |= pending.rotations.keys()
        self._pending = _PendingFrame(blendshapes=dict(pending.blendshapes))


def _read_entry(entry: MappingEntry, name: str, message: OscMessage) -> _PendingFrame:
    """Return the contribution of a message with the sender's `name` of a joint or blendshape."""
    match entry.kind:
        case "frame_end":
            return _PendingFrame(ends=True)
        case "time":
            (time_s,) = _take_numbers(entry, message, 1)
            return _PendingFrame(time_s=time_s)
        case "blendshape":
            (weight,) = _take_numbers(entry, message, 1)
            name = entry.names.get(name, name)
            return _PendingFrame(blendshapes={name: check_weight(name, weight, 1)})
    bone = find_bone(entry.names.get(name, name))
    if bone is None:
        return _PendingFrame()
    if entry.kind == "position":
        factor = METRES_PER_UNIT[entry.unit or "m"]
        x, y, z = (factor * number for number in _take_numbers(entry, message, 3))
        return _PendingFrame(positions={bone: check_position(_convert_axes(entry, (x, y, z)), bone)})
    return _PendingFrame(rotations={bone: _read_rotation(entry, bone, message)})


def _read_rotation(entry: MappingEntry, bone: str, message: OscMessage) -> Quaternion:
    order = entry.order or "xyzw"
    numbers = _take_numbers(entry, message, len(order))
    if len(order) == 4:
        w, x, y, z = (numbers[order.index(component)] for component in "wxyz")
        turn = check_rotation((w, x, y, z), bone)
    else:
        to_radians: Callable[[float], float] = float if entry.unit == "radians" else radians
        turn = IDENTITY
        for axis, angle in zip(order, map(to_radians, numbers), strict=True):
            if abs(angle) > MAX_ANGLE_RAD:
                raise UnreadableCapture("Invalid rotation", f"the angle {angle:g} is out of range", field=bone)
            turn = multiply(turn, from_axis_angle(_AXES[axis], angle))
    axes = parse_axes(entry.axes)
    a, b, c = (index for index, _ in axes)
    even = (a, b, c) in ((0, 1, 2), (1, 2, 0), (2, 0, 1))
    hand = axes[0][1] * axes[1][1] * axes[2][1] * (1.0 if even else -1.0)
    # the axis of a rotation keeps its direction under rotations and changes it under reflections
    x, y, z = _convert_axes(entry, turn[1:])
    return (turn[0], hand * x, hand * y, hand * z)


def _convert_axes(entry: MappingEntry, values: Vector) -> Vector:
    (i, r), (j, s), (k, t) = parse_axes(entry.axes)
    return (r * values[i], s * values[j], t * values[k])


def _take_numbers(entry: MappingEntry, message: OscMessage, count: int) -> list[float]:
    found = message.arguments[entry.first_argument : entry.first_argument + count]
    numbers = [float(n) for n in found if type(n) is float or type(n) is int]
    if len(numbers) != count or not all(map(isfinite, numbers)):
        raise UnreadableCapture(
            "Invalid OSC message",
            f"expected {count} finite numbers from argument {entry.first_argument} on",
            field=message.address[:200],
            hint="compare the message with order and first_argument of the mapping",
        )
    return numbers
