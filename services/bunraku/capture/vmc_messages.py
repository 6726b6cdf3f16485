"""Messages of the Virtual Motion Capture protocol, checked and in right-handed axes (protocol.vmc.info, 2.7)."""

from __future__ import annotations

from math import isfinite
from typing import NamedTuple

from bunraku.capture.errors import UnreadableCapture
from bunraku.capture.frame import check_position, check_rotation, check_weight, mirror_position, mirror_rotation
from bunraku.capture.humanoid import BONE_BY_LOWER_NAME, ROOT_NAME
from bunraku.capture.osc import Argument, OscMessage
from bunraku.marionette.solver.vector import Quaternion, Vector, subtract

SCALE_RANGE = (1e-3, 1e3)
"""Range of the avatar's scale in /VMC/Ext/Root/Pos."""
_NUMBERS_WITH_SCALE = 13
"""Numbers of /VMC/Ext/Root/Pos since 2.1: position, quaternion, scale and offset."""


class Transform(NamedTuple):
    """Position in metres and rotation of a bone or of the root. `scale` is that of all bones; None for a bone."""

    bone: str
    position: Vector
    rotation: Quaternion
    scale: float | None


class Weight(NamedTuple):
    """Weight of a blendshape, valid from the next `FrameEnd` that applies weights."""

    name: str
    weight: float


class FrameEnd(NamedTuple):
    """Message that ends a frame: state, time in seconds (else None), or the application of weights."""

    time_s: float | None
    applies_weights: bool


def read_message(message: OscMessage) -> Transform | Weight | FrameEnd | None:
    """Return the contents of a message, None if it does not concern a pose; raise `UnreadableCapture` if invalid."""
    address, arguments = message
    match address:
        case "/VMC/Ext/Bone/Pos":
            name, numbers = _take_named_numbers(message, 7)
            # other bones, such as hair, belong to no humanoid
            bone = BONE_BY_LOWER_NAME.get(name.lower())
            return None if bone is None else Transform(bone, *_read_transform(bone, numbers), None)
        case "/VMC/Ext/Root/Pos":
            return _read_root(*_take_named_numbers(message, 7))
        case "/VMC/Ext/Blend/Val":
            name, numbers = _take_named_numbers(message, 1)
            return Weight(name, check_weight(name, numbers[0], 1))
        case "/VMC/Ext/Blend/Apply":
            return FrameEnd(None, applies_weights=True)
        case "/VMC/Ext/OK":
            return FrameEnd(None, applies_weights=False)
        case "/VMC/Ext/T":
            (time_s,) = _take_numbers(address, arguments[:1], 1)
            if not isfinite(time_s):
                raise UnreadableCapture("Invalid VMC message", "the time is not finite", field=address)
            return FrameEnd(time_s, applies_weights=False)
    return None


def _take_named_numbers(message: OscMessage, count: int) -> tuple[str, tuple[float, ...]]:
    """Return the name and at least `count` numbers of a message."""
    name = message.arguments[0] if message.arguments else None
    if not isinstance(name, str):
        raise UnreadableCapture("Invalid VMC message", "the first argument is not a name", field=message.address)
    return name, _take_numbers(message.address, message.arguments[1:], count)


def _take_numbers(address: str, arguments: tuple[Argument, ...], count: int) -> tuple[float, ...]:
    numbers = tuple(n for n in arguments if type(n) is float or type(n) is int)
    if len(numbers) < len(arguments) or len(numbers) < count:
        raise UnreadableCapture(
            "Invalid VMC message",
            f"{len(arguments)} arguments, expected {count} numbers",
            field=address,
            hint="check that the sender uses VMC 2.0 or later",
        )
    return numbers


def _read_transform(bone: str, numbers: tuple[float, ...]) -> tuple[Vector, Quaternion]:
    x, y, z, w = numbers[3:7]
    position = mirror_position(check_position(numbers[:3], bone))
    return position, mirror_rotation(check_rotation((w, x, y, z), bone))


def _read_root(_name: str, numbers: tuple[float, ...]) -> Transform:
    """Return the root's transform. Since 2.1 a scale and an offset fit the avatar to the performer's size.

    The avatar is divided by the scale, and the offset is subtracted from its position.
    """
    position, rotation = _read_transform(ROOT_NAME, numbers)
    if len(numbers) < _NUMBERS_WITH_SCALE:
        return Transform(ROOT_NAME, position, rotation, 1.0)
    height = numbers[8]
    if not SCALE_RANGE[0] <= height <= SCALE_RANGE[1]:
        raise UnreadableCapture(
            "Invalid VMC message", f"the scale {height:g} is not within {SCALE_RANGE}", field="/VMC/Ext/Root/Pos"
        )
    offset = mirror_position(check_position(numbers[10:13], ROOT_NAME))
    return Transform(ROOT_NAME, subtract(position, offset), rotation, 1.0 / height)
