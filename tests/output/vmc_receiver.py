"""Independent VMC receiver for tests: an OSC 1.0 parser, and forward kinematics of a Unity humanoid.

It shares no code with the sender: rotations are matrices, the hierarchy is written down again.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Matrix = npt.NDArray[np.float64]
Message = tuple[str, list[str | int | float]]

# Unity's HumanBodyBones with the parent that an avatar with all optional bones has
UNITY_PARENTS: dict[str, str | None] = {
    "Hips": None,
    "Spine": "Hips",
    "Chest": "Spine",
    "UpperChest": "Chest",
    "Neck": "UpperChest",
    "Head": "Neck",
} | {
    side + bone: parent if parent == "Hips" or parent == "UpperChest" else side + parent
    for side in ("Left", "Right")
    for bone, parent in (
        ("UpperLeg", "Hips"),
        ("LowerLeg", "UpperLeg"),
        ("Foot", "LowerLeg"),
        ("Toes", "Foot"),
        ("Shoulder", "UpperChest"),
        ("UpperArm", "Shoulder"),
        ("LowerArm", "UpperArm"),
        ("Hand", "LowerArm"),
    )
}


def _read_string(data: bytes, at: int) -> tuple[str, int]:
    end = data.index(0, at)
    padded = end + 4 - (end - at) % 4
    assert not any(data[end:padded]), "the padding of a string is zero"
    return data[at:end].decode(), padded


def parse_packet(data: bytes) -> list[Message]:
    """Return the messages of an OSC packet, those of bundles in order."""
    assert len(data) % 4 == 0
    if data.startswith(b"#bundle\0"):
        assert data[8:16] == b"\0\0\0\0\0\0\0\1", "takes effect immediately"
        messages, at = [], 16
        while at < len(data):
            (size,) = struct.unpack_from(">i", data, at)
            messages += parse_packet(data[at + 4 : at + 4 + size])
            at += 4 + size
        assert at == len(data)
        return messages
    address, at = _read_string(data, 0)
    tags, at = _read_string(data, at)
    assert address.startswith("/")
    assert tags.startswith(",")
    arguments: list[str | int | float] = []
    for tag in tags[1:]:
        if tag == "s":
            text, at = _read_string(data, at)
            arguments.append(text)
        else:
            arguments += struct.unpack_from({"f": ">f", "i": ">i"}[tag], data, at)
            at += 4
    assert at == len(data)
    return [(address, arguments)]


def _matrix(x: float, y: float, z: float, w: float) -> Matrix:
    """Return Unity's rotation matrix of a quaternion."""
    assert abs(x * x + y * y + z * z + w * w - 1) < 1e-5
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


@dataclass
class UnityPose:
    """World positions (3,) and orientations (3, 3) of the bones, in Unity's left-handed frame; `seconds` is the
    sender's time."""

    positions: dict[str, Matrix]
    orientations: dict[str, Matrix]
    seconds: float


def receive_frame(messages: list[Message], omitted: frozenset[str] = frozenset()) -> UnityPose:
    """Return the pose of one frame's messages for an avatar without the `omitted` bones."""
    addresses = [address for address, _ in messages]
    assert addresses[0] == "/VMC/Ext/Root/Pos"
    assert addresses[-2:] == ["/VMC/Ext/OK", "/VMC/Ext/T"]
    assert set(addresses[1:-2]) == {"/VMC/Ext/Bone/Pos"}
    assert messages[0][1][0] == "root"
    assert messages[-2][1] == [1]
    transforms: dict[str | None, tuple[Matrix, Matrix]] = {}
    for _, (name, *numbers) in messages[:-2]:
        values = [float(number) for number in numbers]
        assert len(values) == 7
        transforms[None if name == "root" else str(name)] = np.array(values[:3]), _matrix(*values[3:])
    assert transforms.keys() - {None} == UNITY_PARENTS.keys()
    positions: dict[str | None, Matrix] = {None: transforms[None][0]}
    orientations: dict[str | None, Matrix] = {None: transforms[None][1]}

    def place(bone: str) -> None:
        if bone in positions:
            return
        parent = UNITY_PARENTS[bone]
        while parent in omitted:
            parent = UNITY_PARENTS[parent]
        if parent is not None:
            place(parent)
        position, rotation = transforms[bone]
        positions[bone] = positions[parent] + orientations[parent] @ position
        orientations[bone] = orientations[parent] @ rotation

    for bone in UNITY_PARENTS.keys() - omitted:
        place(bone)
    (seconds,) = messages[-1][1]
    return UnityPose(
        {bone: place for bone, place in positions.items() if bone is not None},
        {bone: turn for bone, turn in orientations.items() if bone is not None},
        float(seconds),
    )
