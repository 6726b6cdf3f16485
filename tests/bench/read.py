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

from bunraku.codec.extension.body_joints import pack_body
from bunraku.codec.extension.encoder import encode_extension
from bunraku.codec.extension.track import decode_extension_block
from bunraku.codec.motion_decoder import decode_motion_block
from bunraku.codec.motion_encoder import encode_motion
from bunraku.ingest.jobs.encoding import FIRST_BLOCK_S
from bunraku.ingest.jobs.motion import encode_file
from bunraku.ingest.result import JobResult
from bunraku.motion import rotation
from bunraku.motion.analysis import Analysis, analyse
from bunraku.motion.bvh_writer import write_bvh
from bunraku.motion.extension import ExtendedPose, extend_pose
from bunraku.motion.readers.bvh import Bvh, parse_bvh
from bunraku.motion.readers.motion_file import read_motion
from bunraku.motion.rest_pose import REFERENCE_LEG_M
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import TIP_JOINTS, Figure, world_transforms
from tests.bench.extension_rates import measure_face_kbps, measure_fingers_kbps
from tests.motion.readers.fbx_writer import write_fbx
from tests.motion.readers.sources import write_acclaim, write_glb, write_zip
from tests.motion.synthetic_motion import export_bvh, smooth_motion

CLIPS = ("cmu_12_01_walk", "mass_cart", "mass_dance", "mass_walk", "perfume_A", "perfume_C")
MAX_SECONDS = 8.0
"""Length to which clips are cut for the comparison of formats."""
UPLOAD_FRAMES, UPLOAD_FPS = 1_800, 60.0
REPEATS = 5
SHARE_MEAN_ERROR_MM = 1.0
"""Mean error at which the bytes of a motion with its extension are compared with those of the motion alone."""

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


def body_share(analysis: Analysis) -> float:
    """Return the share that an extension adds to the bytes of a motion, at the same mean error of all joints and tips.

    Bytes and errors of the served ladder are interpolated, the description of the joints included.
    """
    motion, extension = analysis.motion, analysis.extension
    assert extension is not None
    encoded = encode_motion(motion, first_seconds=FIRST_BLOCK_S)
    errors = [level.mean_error_mm for level in encoded.ladder]
    extended = encode_extension(extension.extension, extension.values, encoded.track, errors)
    placed = world_transforms(motion.figure, motion.root, motion.rotations)
    truth = _points(motion.figure, extend_pose(motion.figure, extension.extension, *placed, extension.values))
    sizes, extended_sizes, extended_errors = [], [], []
    for level, extended_level in zip(encoded.ladder, extended.ladder, strict=True):
        poses = [
            decode_motion_block(encoded.track, data).pose_at(np.arange(float(encoded.track.frames_in(index))))
            for index, data in enumerate(level.blocks)
        ]
        root, rotations = (np.concatenate(part) for part in zip(*poses, strict=True))
        values = np.concatenate(
            [
                decode_extension_block(extended.track, data).values_at(
                    np.arange(float(extended.track.frames_in(index)))
                )
                for index, data in enumerate(extended_level.blocks)
            ]
        )
        figure = encoded.track.figure
        pose = extend_pose(figure, extension.extension, *world_transforms(figure, root, rotations), values)
        extended_errors.append(1e3 * float(np.linalg.norm(_points(figure, pose) - truth, axis=-1).mean()))
        sizes.append(sum(map(len, level.blocks)))
        added = sum(map(len, extended_level.blocks)) + len(pack_body(extension.extension))
        extended_sizes.append(sizes[-1] + added)

    def bytes_at(mean_errors: list[float], all_bytes: list[int]) -> float:
        at = np.interp(np.log(SHARE_MEAN_ERROR_MM), np.log(mean_errors[::-1]), np.log(all_bytes[::-1]))
        return float(np.exp(at))

    return bytes_at(extended_errors, extended_sizes) / bytes_at(errors, sizes) - 1


def _points(figure: Figure, pose: ExtendedPose) -> Array:
    """Return the joints, the extension's joints, and the tips (n, m, 3) of an extended figure."""
    tips = [
        pose.positions[:, joint] + rotation.rotate(pose.orientations[:, joint], figure.tips[joint])
        for joint in TIP_JOINTS
    ]
    return np.concatenate([pose.positions, pose.extra_positions, np.stack(tips, axis=1)], axis=1)


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
    fits, trips, shares = [], [], []
    print(
        f"{'clip':<18}{'fit, mm: mean':>14}{'max':>8}{'extended':>10}{'max':>7}{'share':>8}{'round trip':>12}"
        + "".join(f"{name:>16}" for name in FORMATS)
    )
    for name in CLIPS:
        clip = parse_bvh((shared / "mocap" / "bvh" / f"{name}.bvh").read_bytes())
        analysis = analyse(clip)
        found = compare_formats(clip)
        agree += found.values()
        fits.append((analysis.extended_mean_error_mm, analysis.extended_max_error_mm))
        shares.append(body_share(analysis))
        trips.append(round_trip_mm(analysis))
        cells = "".join(f"{mm:9.4f} {ms:3.1f} ms" for mm, ms in found.values())
        figure = f"{analysis.mean_fit_error_mm:14.2f}{analysis.max_fit_error_mm:8.1f}"
        print(f"{name:<18}{figure}{fits[-1][0]:10.2f}{fits[-1][1]:7.1f}{shares[-1]:8.3f}{trips[-1]:12.4f}{cells}")
    seconds = upload_seconds()
    print(", ".join(f"{name}: {taken:.2f} s" for name, taken in seconds.items()), "for 30 s at 60 frames/s")
    fingers_kbps, face_kbps = measure_fingers_kbps(), measure_face_kbps()
    print(f"synthetic takes of 30 s at 60 frames/s: two hands {fingers_kbps:.3f} kbit/s, face {face_kbps:.3f} kbit/s")
    figures = {
        "agree_mm_max": round(max(mm for mm, _ in agree), 4),
        "agree_ms_max": round(max(ms for _, ms in agree), 3),
        "times_bvh_fbx": round(seconds["fbx"] / seconds["bvh"], 3),
        "times_bvh_glb": round(seconds["glb"] / seconds["bvh"], 3),
        "round_trip_mm_mean": round(max(trips), 4),
        "fit_mean_mm_max": round(max(mean for mean, _ in fits), 2),
        "fit_max_mm_max": round(max(largest for _, largest in fits), 1),
        "body_share": round(float(np.exp(np.mean(np.log1p(shares)))) - 1, 3),
        "fingers_kbps": round(fingers_kbps, 3),
        "face_kbps": round(face_kbps, 3),
    }
    print(json.dumps(figures))


if __name__ == "__main__":
    main()
