"""Golden motion blocks, valid and invalid."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np

from bunraku.codec import coefficients
from bunraku.codec.decode import FORMAT, HEADER, decode_block
from bunraku.codec.encode import encode_block
from bunraku.codec.track import pack_figure, pack_reference, plan
from bunraku.motion import rotation
from bunraku.motion.skeleton import JOINT_COUNT, Motion, standard_figure


def text(data: bytes) -> str:
    """Bytes in base64."""
    return base64.b64encode(data).decode()


def wandering_motion(seconds: float, fps: float, seed: int) -> Motion:
    """Smooth arbitrary movement of every channel, whole turns of the root included."""
    random = np.random.default_rng(seed)
    frames = round(seconds * fps)
    t = np.arange(frames)[:, None, None] / fps
    rate = random.uniform(0.2, 2.5, (4, JOINT_COUNT + 1, 3))
    phase = random.uniform(0, 2 * np.pi, rate.shape)
    size = random.normal(0, 0.25, rate.shape) / rate
    tracks = sum(size[i] * np.sin(2 * np.pi * rate[i] * t + phase[i]) for i in range(4))
    assert isinstance(tracks, np.ndarray)
    tracks[:, 1, 1] += 4.0 * t[:, 0, 0]
    root = tracks[:, 0] + [0.3, 0.9, -2.0]
    return Motion(standard_figure(), fps, root, rotation.from_rotation_vector(tracks[:, 1:]))


def make() -> dict[str, Any]:
    """Blocks of several lengths and steps with their coefficients and poses, and broken ones with the reason."""
    motion = wandering_motion(2.6, 30.0, 7)
    track, motion = plan(motion)
    valid = []
    for start, frames, step in (
        (0, 30, 9),
        (0, 30, 30),
        (30, 30, 17),
        (60, 18, 24),
        (5, 1, 12),
        (3, 2, 0),
        (0, 78, 40),
    ):
        data = encode_block(track, motion.root[start : start + frames], motion.rotations[start : start + frames], step)
        block = decode_block(track, data)
        poses = []
        for instant in (0.0, frames / 3 - 0.5, frames - 1.0, frames - 0.5):
            root, rotations = block.at(instant)
            poses.append({"instant": instant, "root": root[0].tolist(), "rotations": rotations[0].ravel().tolist()})
        valid.append(
            {"block": text(data), "frames": frames, "step": step, "q": block.q.ravel().tolist(), "poses": poses}
        )
    good = base64.b64decode(str(valid[0]["block"]))
    many = HEADER.pack(FORMAT, 9, 4, 0, 0, 0) + coefficients.encode(np.ones((19, 3, 5), dtype=np.int64))
    invalid = {
        "empty": b"",
        "shorter than its header": good[:6],
        "another format": b"\x02" + good[1:],
        "no frames": HEADER.pack(FORMAT, 9, 0, 0, 0, 0) + good[7:],
        "too many frames": HEADER.pack(FORMAT, 9, 1001, 0, 0, 0) + good[7:],
        "more frequencies than frames": many,
        "an escape too long": HEADER.pack(FORMAT, 9, 30, 0, 0, 0) + bytes([0, 63]) + bytes(30),
        "too large": good + bytes(65_536),
    }
    return {
        "track": {
            "fps": track.fps,
            "frames": track.frames,
            "block_frames": track.block_frames,
            "figure": text(pack_figure(track.figure)),
            "reference": text(pack_reference(track.reference)),
            "levers": track.levers.tolist(),
        },
        "valid": valid,
        "invalid": [{"why": why, "block": text(data)} for why, data in invalid.items()],
    }
