"""Readers of motion files against each other: `make bench-read`. The last line printed is one JSON object.

Each open clip is written in every format and read again; the time of an upload, without sending and storing, is
measured for a dance of 30 s at 60 frames/s, in turn. FBX files are in ASCII, which takes longer to read than binary.
Figures whose part of the product does not exist yet are null. Export and reading of the page's own files are compared
in `services/web/tests/export/round-trip.test.ts`.
"""

from __future__ import annotations

import json
import os
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from statistics import median

import numpy as np

from bunraku.ingest.jobs.motion import encode_file
from bunraku.ingest.result import JobResult
from bunraku.motion.analysis import Analysis, analyse
from bunraku.motion.bvh_writer import write_bvh
from bunraku.motion.readers.bvh import Bvh, parse_bvh
from bunraku.motion.readers.motion_file import read_motion
from bunraku.motion.rest_pose import REFERENCE_LEG_M
from bunraku.motion.skeleton import world_transforms
from tests.motion.readers.fbx_writer import write_fbx
from tests.motion.readers.sources import write_acclaim, write_glb, write_zip
from tests.motion.synthetic_motion import export_bvh, smooth_motion

CLIPS = ("cmu_12_01_walk", "mass_cart", "mass_dance", "mass_walk", "perfume_A", "perfume_C")
MAX_SECONDS = 8.0
"""Length to which clips are cut for the comparison of formats."""
UPLOAD_FRAMES, UPLOAD_FPS = 1_800, 60.0
REPEATS = 5
MISSING = ("body_share", "fingers_kbps", "face_kbps")

FORMATS: dict[str, Callable[[Bvh], bytes]] = {
    "fbx": write_fbx,
    "glb": write_glb,
    "amc": lambda source: write_zip(dict(zip(("a.asf", "a.amc"), write_acclaim(source, source.names), strict=True))),
}


def compare_formats(clip: Bvh) -> dict[str, tuple[float, float]]:
    """Return the largest distance of the file's joints, mm of a body, and of the ends, ms, by format."""
    cut = replace(clip, frames=clip.frames[1 : 1 + int(MAX_SECONDS * clip.fps)])
    expected, _ = cut.world_transforms(list(range(len(cut.names))))
    leg = analyse(cut).joint_fits["l_hip"].source, analyse(cut).joint_fits["l_ankle"].source
    to_mm = 1000.0 * REFERENCE_LEG_M / float(np.median(np.linalg.norm(np.diff(expected[:, leg], axis=1), axis=-1)))
    found: dict[str, tuple[float, float]] = {}
    for name, write in FORMATS.items():
        motion = read_motion(write(cut))
        # AMC has no frame rate, and a root of its own name
        fps = cut.fps if name == "amc" else motion.fps
        joints = [
            motion.names.index("root" if name == "amc" and joint == 0 else own) for joint, own in enumerate(cut.names)
        ]
        positions = motion.world_transforms(joints)[0][:, joints]
        apart = np.linalg.norm(positions - expected[: len(positions)], axis=-1)
        late_ms = 1000.0 * abs(motion.frame_count / fps - cut.frame_count / cut.fps)
        found[name] = to_mm * float(apart.max()), late_ms
    return found


def round_trip_mm(analysis: Analysis) -> float:
    """Return the mean distance of the joints after export as BVH and another upload."""
    motion = analysis.motion
    again = analyse(read_motion(write_bvh(motion))).motion
    placed = [world_transforms(each.figure, each.root, each.rotations)[0] for each in (motion, again)]
    return 1000.0 * float(np.linalg.norm(placed[0] - placed[1], axis=-1).mean())


def upload_seconds() -> dict[str, float]:
    """Return the median time of reading, analysing and encoding a dance, by format, measured in turn."""
    source = parse_bvh(export_bvh(smooth_motion(frames=UPLOAD_FRAMES, fps=UPLOAD_FPS)))
    files = {"bvh": export_bvh(smooth_motion(frames=UPLOAD_FRAMES, fps=UPLOAD_FPS))}
    files |= {name: FORMATS[name](source) for name in ("fbx", "glb")}
    seconds: dict[str, list[float]] = {name: [] for name in files}
    with tempfile.TemporaryDirectory() as folder:
        for name, data in files.items():
            (Path(folder) / name).write_bytes(data)
        for repeat in range(REPEATS + 1):
            for name in files:
                begin = time.perf_counter()
                result = encode_file("bench", Path(folder) / name)
                if repeat:
                    seconds[name].append(time.perf_counter() - begin)
                assert isinstance(result, JobResult), result
    return {name: median(times) for name, times in seconds.items()}


def main() -> None:
    shared = Path(os.environ.get("BUNRAKU_SHARED") or Path(__file__).resolve().parents[3] / "shared")
    agree: list[tuple[float, float]] = []
    fits, trips = [], []
    print(f"{'clip':<18}{'fit, mm: mean':>14}{'max':>8}{'round trip':>12}" + "".join(f"{name:>16}" for name in FORMATS))
    for name in CLIPS:
        clip = parse_bvh((shared / "mocap" / "bvh" / f"{name}.bvh").read_bytes())
        analysis = analyse(clip)
        found = compare_formats(clip)
        agree += found.values()
        fits.append((analysis.mean_fit_error_mm, analysis.max_fit_error_mm))
        trips.append(round_trip_mm(analysis))
        cells = "".join(f"{mm:9.4f} {ms:3.1f} ms" for mm, ms in found.values())
        print(f"{name:<18}{fits[-1][0]:14.2f}{fits[-1][1]:8.1f}{trips[-1]:12.4f}{cells}")
    seconds = upload_seconds()
    print(", ".join(f"{name}: {taken:.2f} s" for name, taken in seconds.items()), "for 30 s at 60 frames/s")
    figures: dict[str, float | None] = {
        "agree_mm_max": round(max(mm for mm, _ in agree), 4),
        "agree_ms_max": round(max(ms for _, ms in agree), 3),
        "times_bvh_fbx": round(seconds["fbx"] / seconds["bvh"], 3),
        "times_bvh_glb": round(seconds["glb"] / seconds["bvh"], 3),
        "round_trip_mm_mean": round(max(trips), 4),
        "fit_mean_mm_max": round(max(mean for mean, _ in fits), 2),
        "fit_max_mm_max": round(max(largest for _, largest in fits), 1),
        **dict.fromkeys(MISSING),
    }
    print(json.dumps(figures))


if __name__ == "__main__":
    main()
