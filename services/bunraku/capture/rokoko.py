"""Rokoko Studio's live stream, JSON version 3, plain or as an LZ4 frame.

Source: Rokoko, "Custom Streaming" (JSON v3) and the data structures of its Unity plugin. Positions are metres and
rotations quaternions x y z w, all in the world and in Unity's left-handed axes. Bones have axes of their own: in the
T-pose they have the orientations of `T_POSE`.
"""

from __future__ import annotations

import json
from typing import Any, NoReturn

import lz4.frame

from bunraku.capture.errors import UnreadableCapture, quote_excerpt
from bunraku.capture.frame import (
    CapturedFrame,
    CaptureSkeleton,
    check_position,
    check_rotation,
    check_size,
    check_weight,
    mirror_position,
    mirror_rotation,
)
from bunraku.capture.humanoid import PARENTS_BY_BONE, ROOT_NAME
from bunraku.marionette.solver.vector import Quaternion, Vector, conjugate, multiply

DEFAULT_PORT = 14043
"""Port of Rokoko Studio's custom stream."""
MAX_JSON_BYTES = 1 << 20
"""Maximum size of the decompressed JSON. Five actors with hands and faces take less than 200 kB."""
VERSIONS = (3, 4)
"""Versions of the format with the same body."""

_LZ4_MAGIC = b"\x04\x22\x4d\x18"
_HALF = 0.5**0.5


def _list_bones() -> dict[str, str]:
    """Return the bone of Unity's humanoid for each joint of the stream."""
    bones = {"hip": "Hips", "spine": "Spine", "chest": "Chest", "neck": "Neck", "head": "Head"}
    limbs = {"UpLeg": "UpperLeg", "Leg": "LowerLeg", "Foot": "Foot", "Toe": "Toes"}
    limbs |= {name: name for name in ("Shoulder", "UpperArm", "LowerArm", "Hand")}
    for side in ("left", "right"):
        bones |= {side + joint: side.capitalize() + bone for joint, bone in limbs.items()}
    return bones


BONES: dict[str, str] = _list_bones()
"""Bones by the names of the stream; others, of the fingers, are skipped."""
_ABSENT = {ROOT_NAME: None, "UpperChest": "Chest"}
_PARENTS = {
    bone: _ABSENT.get(parent or "", parent) for bone, parent in PARENTS_BY_BONE.items() if bone in BONES.values()
}


def _list_t_pose() -> dict[str, Quaternion]:
    """Return the orientations w x y z of the bones in the T-pose, in Unity's axes."""
    pose: dict[str, Quaternion] = {"Hips": (1.0, 0.0, 0.0, 0.0)}
    pose |= dict.fromkeys(("Spine", "Chest", "Neck", "Head"), (0.0, 0.0, 0.0, 1.0))
    for side, s in (("Left", 1.0), ("Right", -1.0)):
        pose |= dict.fromkeys((f"{side}UpperLeg", f"{side}LowerLeg"), (_HALF, 0.0, s * _HALF, 0.0))
        pose |= dict.fromkeys((f"{side}Foot", f"{side}Toes"), (0.0, 0.0, s * _HALF, -s * _HALF))
        pose[f"{side}Shoulder"] = (-s * _HALF, 0.0, 0.0, _HALF)
        pose |= dict.fromkeys(
            (f"{side}{bone}" for bone in ("UpperArm", "LowerArm", "Hand")), (-s / 2, -s / 2, -0.5, 0.5)
        )
    return pose


T_POSE: dict[str, Quaternion] = _list_t_pose()
_FROM_T_POSE = {bone: conjugate(mirror_rotation(turn)) for bone, turn in T_POSE.items()}


class RokokoAssembler:
    """Parser of the stream for one actor: the one named `actor`, or the first with a body."""

    skeleton = CaptureSkeleton(_PARENTS, in_world=True)

    def __init__(self, actor: str | None = None) -> None:
        self._actor = actor

    def feed(self, datagram: bytes) -> list[CapturedFrame]:
        """Return the frame of the actor, none if it is not in the scene; raise `UnreadableCapture` if invalid."""
        check_size(datagram)
        scene = _parse_scene(_decompress(datagram))
        for actor in _take(scene, "actors", list, "scene"):
            if not isinstance(actor, dict) or not isinstance(actor.get("body"), dict):
                continue
            if self._actor in (None, actor.get("name")):
                return [_read_actor(actor, scene)]
        return []


def _decompress(datagram: bytes) -> bytes:
    if not datagram.startswith(_LZ4_MAGIC):
        return datagram
    try:
        decompressor = lz4.frame.LZ4FrameDecompressor()
        text: bytes = decompressor.decompress(datagram, max_length=MAX_JSON_BYTES)
    except (RuntimeError, ValueError, MemoryError) as error:
        raise UnreadableCapture("Damaged LZ4 frame", quote_excerpt(str(error), 200)) from error
    if not decompressor.eof:
        raise UnreadableCapture(
            "Damaged LZ4 frame", f"it is truncated, or has more than {MAX_JSON_BYTES} decompressed bytes"
        )
    return text


def _parse_scene(text: bytes) -> dict[str, Any]:
    try:
        frame = json.loads(text, parse_constant=_reject_constant)
    except UnreadableCapture:
        raise
    except (ValueError, RecursionError) as error:
        raise UnreadableCapture(
            "Not JSON",
            quote_excerpt(str(error), 200),
            hint="set the data format of the custom stream in Rokoko Studio to JSON v3",
        ) from error
    if not isinstance(frame, dict) or frame.get("version") not in VERSIONS:
        raise UnreadableCapture(
            "Unknown version",
            "the stream is not Rokoko's JSON of version 3",
            field="version",
            hint="set the data format of the custom stream in Rokoko Studio to JSON v3",
        )
    scene: dict[str, Any] = _take(frame, "scene", dict, "frame")
    return scene


def _reject_constant(name: str) -> NoReturn:
    raise UnreadableCapture("Not a finite number", f"the JSON contains {name}")


def _read_actor(actor: dict[str, Any], scene: dict[str, Any]) -> CapturedFrame:
    positions: dict[str, Vector] = {}
    rotations: dict[str, Quaternion] = {}
    for joint, transform in actor["body"].items():
        bone = BONES.get(joint)
        if bone is None or transform is None:
            continue
        if not isinstance(transform, dict):
            raise UnreadableCapture("Invalid joint", "it is not an object", field=joint)
        turn = check_rotation(_take_numbers(transform, "rotation", "wxyz", joint), joint)
        rotations[bone] = multiply(mirror_rotation(turn), _FROM_T_POSE[bone])
        positions[bone] = mirror_position(check_position(_take_numbers(transform, "position", "xyz", joint), joint))
    if not rotations:
        raise UnreadableCapture("No joints", "the body has no known joint", field="body")
    face = actor.get("face")
    weights: dict[str, float] = {}
    for name, weight in face.items() if isinstance(face, dict) else ():
        if type(weight) in (int, float):
            # percent
            weights[name] = check_weight(name, _to_float(weight, name) / 100.0, len(weights) + 1)
    time = scene.get("timestamp")
    return CapturedFrame(
        positions, rotations, _to_float(time, "timestamp") if type(time) in (int, float) else None, None, weights
    )


def _take(values: dict[str, Any], key: str, kind: type, field: str) -> Any:
    value = values.get(key)
    if not isinstance(value, kind):
        raise UnreadableCapture("Invalid frame", f"{key} is missing or not a JSON {kind.__name__}", field=field)
    return value


def _take_numbers(transform: dict[str, Any], key: str, components: str, joint: str) -> list[float]:
    value = _take(transform, key, dict, joint)
    numbers = [value.get(component) for component in components]
    if not all(type(number) in (int, float) for number in numbers):
        raise UnreadableCapture("Invalid joint", f"{key} does not have the numbers {' '.join(components)}", field=joint)
    return [_to_float(number, joint) for number in numbers]


def _to_float(number: Any, field: str) -> float:
    """Return a number as a float; raise `UnreadableCapture` if it is not finite as one."""
    try:
        value = float(number)
    except OverflowError:
        value = float("inf")
    if not abs(value) < float("inf"):
        raise UnreadableCapture("Not a finite number", "the number is too large", field=field)
    return value
