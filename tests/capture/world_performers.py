"""Performers of MVN and Rokoko: the performance of a clip as the packets of their tools."""

from __future__ import annotations

import json

import numpy as np

from bunraku.capture.humanoid import PARENTS_BY_BONE
from bunraku.capture.mvn import HEADER, LAST_DATAGRAM, SEGMENT, SEGMENTS
from bunraku.capture.rokoko import BONES, T_POSE
from bunraku.motion import rotation
from bunraku.motion.rotation import Array
from bunraku.motion.unity_axes import mirror_rotations, mirror_vectors
from tests.capture.vmc_performer import Performance

MVN_BONES = {
    "Pelvis": "Hips",
    "L5": "Spine",
    "T8": "Chest",
    "Neck": "Neck",
    "Head": "Head",
    "LeftForeArm": "LeftLowerArm",
    "RightForeArm": "RightLowerArm",
    "LeftToe": "LeftToes",
    "RightToe": "RightToes",
}
"""Bones whose segment has another name."""


def world_transforms(performance: Performance) -> tuple[dict[str, Array], dict[str, Array]]:
    """Return world positions (n, 3) and rotations (n, 4) by bone, in Unity's axes."""
    positions: dict[str, Array] = {}
    rotations: dict[str, Array] = {}
    for index, bone in enumerate(performance.bones):
        place, turn = performance.positions[:, index], performance.rotations[:, index]
        parent = PARENTS_BY_BONE[bone]
        while parent is not None and parent not in positions:
            parent = PARENTS_BY_BONE[parent]
        if parent is not None:
            place = positions[parent] + rotation.rotate(rotations[parent], place)
            turn = rotation.multiply(rotations[parent], turn)
        positions[bone], rotations[bone] = place, turn
    return positions, rotations


def mvn_datagrams(performance: Performance, split: int = 1, character: int = 0) -> list[list[bytes]]:
    """Return the datagrams of each frame, `split` of them, in MVN's axes: x forwards, y left, z up."""
    positions, rotations = world_transforms(performance)
    frames = []
    for frame in range(performance.frame_count):
        items = []
        for number, segment in enumerate(SEGMENTS, start=1):
            bone = MVN_BONES.get(segment, segment)
            if bone in positions:
                x, y, z = mirror_vectors(positions[bone][frame]).tolist()
                w, i, j, k = mirror_rotations(rotations[bone][frame]).tolist()
                items.append(SEGMENT.pack(number, z, x, y, w, k, i, j))
        parts = np.array_split(np.arange(len(items)), split)
        datagrams = []
        for index, part in enumerate(parts):
            payload = b"".join(items[item] for item in part)
            counter = index | (LAST_DATAGRAM if index == split - 1 else 0)
            time_ms = round(1000 * frame / performance.fps)
            header = HEADER.pack(
                b"MXTP02", frame + 1, counter, len(part), time_ms, character, 23, 0, 0, 0, len(payload)
            )
            datagrams.append(header + payload)
        frames.append(datagrams)
    return frames


def rokoko_datagrams(performance: Performance) -> list[bytes]:
    """Return the JSON of each frame."""
    positions, rotations = world_transforms(performance)
    frames = []
    for frame in range(performance.frame_count):
        body = {}
        for joint, bone in BONES.items():
            if bone in positions:
                turn = rotation.multiply(rotations[bone][frame], np.array(T_POSE[bone]))
                body[joint] = {
                    "position": dict(zip("xyz", positions[bone][frame].tolist(), strict=True)),
                    "rotation": dict(zip("wxyz", turn.tolist(), strict=True)),
                }
        actor = {"name": "Ada", "meta": {"hasBody": True}, "body": body, "face": {"faceId": "f", "jawOpen": 25.0}}
        scene = {"timestamp": frame / performance.fps, "actors": [actor]}
        frames.append(json.dumps({"version": 3, "fps": 30, "scene": scene}).encode())
    return frames
