"""Throughput of the BVH parser: `make bench-bvh`. The last line printed is one JSON object."""

from __future__ import annotations

import json
import os
import time
from pathlib import Path

import numpy as np

from bunraku.motion.bvh_writer import write_bvh
from bunraku.motion.readers.bvh import parse_bvh
from bunraku.motion.rotation import from_rotation_vector
from bunraku.motion.skeleton import JOINT_COUNT, Motion, standard_figure

FILE_BYTES = 15_000_000
REPEATS = 5


def generate_bvh() -> bytes:
    """Generate a BVH file of at least `FILE_BYTES` bytes: one random second, repeated."""
    random = np.random.default_rng(1)
    rotations = from_rotation_vector(random.uniform(-1.0, 1.0, (120, JOINT_COUNT, 3)))
    text = write_bvh(Motion(standard_figure(), 120.0, random.normal(0.0, 1.0, (120, 3)), rotations))
    body = text[text.index(b"\n", text.index(b"Frame Time")) + 1 :]
    seconds = FILE_BYTES // len(body) + 1
    return text[: -len(body)].replace(b"Frames: 120", b"Frames: %d" % (120 * seconds)) + body * seconds


def best_parse_seconds(data: bytes) -> tuple[float, tuple[int, ...]]:
    """Return the seconds of the fastest of `REPEATS` runs, and the shape of the frames."""
    seconds = []
    for _ in range(REPEATS):
        begin = time.perf_counter()
        frames = parse_bvh(data).frames
        seconds.append(time.perf_counter() - begin)
    return min(seconds), frames.shape


def main() -> None:
    shared = Path(os.environ.get("BUNRAKU_SHARED") or Path(__file__).resolve().parents[3] / "shared")
    large = generate_bvh()
    cases = {"generated": large, "generated, CRLF": large.replace(b"\n", b"\r\n")}
    clips = sorted((shared / "mocap" / "bvh").glob("*.bvh"), key=lambda clip: clip.stat().st_size)
    cases |= {clip.stem: clip.read_bytes() for clip in clips[-1:]}
    parse_bvh(large[:100_000])
    print(f"{'file':<20}{'MB':>8}{'frames':>9}{'channels':>10}{'seconds':>9}{'MB/s':>7}")
    figures = {}
    for name, data in cases.items():
        figures[name], (frames, channels) = best_parse_seconds(data)
        size = len(data) / 1e6
        print(f"{name:<20}{size:8.2f}{frames:9}{channels:10}{figures[name]:9.4f}{size / figures[name]:7.0f}")
    print(json.dumps({"seconds_15mb": round(figures["generated"], 4), "seconds": figures}))


if __name__ == "__main__":
    main()
