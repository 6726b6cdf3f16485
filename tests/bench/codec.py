"""Compression of motion, compared with other codecs: `make bench-codec CORPUS=../shared/mocap`.

The last line printed is one JSON object. Every clip is encoded for a mean or maximum error with a prior that was not
trained on its family. The bitrate counts all bytes that a viewer receives for the motion: blocks, headers of Data
messages, WebSocket frames, and the skeleton description (limb lengths and references) of the Description. Tails are the
bitrate of the worst clip, and p95 of the bytes of a block. `served_ratio_...` compares each level of the ladder, as an
upload is stored, with an encoding for that bound alone. `--quick` takes every third clip. With PICTURE=FILE further
error bounds are measured, and a chart of bitrate over error is written (SVG).
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np

from bunraku.codec.motion_decoder import decode_motion_block
from bunraku.codec.motion_encoder import ERROR_BOUNDS_MM, encode_motion, encode_motion_to_mean_error, warm_up
from bunraku.motion.skeleton import Motion
from tests.bench import chart, peer_results
from tests.bench.error_goals import (
    ErrorGoal,
    GoalEncoding,
    encode_as_served,
    encode_to_goal,
    geometric_mean,
    summarise_tails,
)
from training import corpus as clips
from training import entropy_study

ERROR_GOALS = (("mean", 1.0), ("mean", 5.0), ("max", 10.0), ("max", 2.0))
PEERS = {"acl": "acl", "meshopt": "meshopt_brotli"}
ERROR_COLUMNS = {"mean": peer_results.MEAN, "max": peer_results.MAX}
CHART_ERRORS_MM = {"mean": (0.3, 0.5, 1.0, 2.0, 3.0, 5.0, 10.0), "max": (0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 60.0)}


def draw_chart(
    motions: dict[str, Motion],
    measured: dict[str, dict[str, peer_results.Rows]],
    rates: dict[ErrorGoal, list[float]],
    block_seconds: float,
) -> str:
    """Draw the chart of bitrate over error; missing errors are measured and added to `rates` (kbit/s of each clip)."""
    panels = []
    for kind, title in (("mean", "Mean error"), ("max", "Largest error, held in every block")):
        for error in CHART_ERRORS_MM[kind]:
            goal = kind, error
            if goal not in rates:
                rates[goal] = [
                    encode_to_goal(motion, goal, entropy_study.load_held_out_prior(name), block_seconds).kbps
                    for name, motion in motions.items()
                ]
            print(f"drawn: {kind} {error:g} mm, {geometric_mean(rates[goal]):.2f} kbit/s", flush=True)
        points = [(error, geometric_mean(rates[kind, error])) for error in CHART_ERRORS_MM[kind]]
        curves = [chart.Curve("Bunraku", "#b3301f", points, measured=True)]
        for name, peer, colour in (("meshoptimizer + brotli", "meshopt", "#27418f"), ("ACL", "acl", "#7d5a14")):
            rows = [measured[clip][PEERS[peer]] for clip in motions]
            peer_points = peer_results.mean_curve(rows, ERROR_COLUMNS[kind], points[0][0], points[-1][0])
            curves.append(chart.Curve(name, colour, peer_points))
        panels.append(chart.Panel(title, curves, tuple(error for of, error in ERROR_GOALS if of == kind)))
    note = (
        f"Geometric means over {len(motions)} clips. Ours: all that a viewer receives, in independent blocks of "
        f"{block_seconds:g} s. The others: whole clips at once."
    )
    return chart.draw_chart((panels[0], panels[1]), note)


def measure_served_ladder(motions: dict[str, Motion]) -> dict[str, float]:
    """Compare each level of the served ladder with an encoding for its bound alone, in blocks of one second.

    Returns:
        By level: bitrate and tails as served, and the ratio of the bitrates, of all clips and of the worst one.
    """
    served: dict[float, list[GoalEncoding]] = {bound: [] for bound in ERROR_BOUNDS_MM}
    ratios: dict[float, list[float]] = {bound: [] for bound in ERROR_BOUNDS_MM}
    for name, motion in motions.items():
        prior = entropy_study.load_held_out_prior(name)
        for bound, encoding in encode_as_served(motion, prior).items():
            served[bound].append(encoding)
            ratios[bound].append(encoding.kbps / encode_to_goal(motion, ("max", bound), prior, 1.0).kbps)
        print(
            f"{name:<16}served" + "".join(f"{served[b][-1].kbps:9.2f}{ratios[b][-1]:7.3f}" for b in ratios), flush=True
        )
    figures: dict[str, float] = {}
    for bound, encodings in served.items():
        level = {
            "kbps": geometric_mean([encoding.kbps for encoding in encodings]),
            **summarise_tails(encodings),
            "ratio": geometric_mean(ratios[bound]),
            "ratio_worst_clip": max(ratios[bound]),
        }
        figures |= {f"served_{key}_{bound:g}mm": round(value, 3) for key, value in level.items()}
    return figures


def measure_speeds(motions: dict[str, Motion]) -> dict[str, float]:
    """Measure the encoder's speed relative to real time, and the decoding time of a block in milliseconds.

    Clips have 30 to 60 frames per second; encoded are one live bitrate level and the whole ladder, live and best."""
    clips_30_to_60_fps = [motion for motion in motions.values() if 30 <= motion.fps <= 60]
    figures = {}
    seconds = sum(motion.duration for motion in clips_30_to_60_fps)
    warm_up()
    for key, grade, ladder in (
        ("encode_times_real_time", "live", ERROR_BOUNDS_MM[2:3]),
        ("encode_ladder_live_times_real_time", "live", ERROR_BOUNDS_MM),
        ("encode_best_times_real_time", "best", ERROR_BOUNDS_MM),
    ):
        began = time.perf_counter()
        for motion in clips_30_to_60_fps:
            encode_motion(motion, grade=grade, error_bounds_mm=ladder)  # type: ignore[arg-type]
        figures[key] = seconds / (time.perf_counter() - began)
    spent = []
    for motion in motions.values():
        track, rate = encode_motion_to_mean_error(motion, 1.0)
        for block in rate.blocks:
            # best of three, as other processes share the machine
            tries = []
            for _ in range(3):
                began = time.perf_counter()
                decode_motion_block(track, block)
                tries.append(time.perf_counter() - began)
            spent.append(min(tries))
    figures["decode_ms_python"] = float(np.median(spent)) * 1e3
    return figures


def measure_typescript_decode_ms(motions: dict[str, Motion]) -> float | None:
    """Return the median decoding time of a block at 1 mm in Node, milliseconds; None if there is no Node."""
    web = Path(__file__).resolve().parents[2] / "services/web"
    encoded_clips = []
    for motion in motions.values():
        track, rate = encode_motion_to_mean_error(motion, 1.0)
        described = {
            "fps": track.fps,
            "frames": track.frames,
            "blockFrames": track.block_frames,
            "firstFrames": track.first_frames,
            "dancer": track.skeleton.pack().hex(),
        }
        encoded_clips.append({"track": described, "blocks": [block.hex() for block in rate.blocks]})
    with tempfile.TemporaryDirectory() as folder:
        script = str(Path(folder) / "decode.mjs")
        bundle = ["npx", "rolldown", "tests/bench/decode.ts", "--file", script, "--platform", "node", "--format", "esm"]
        try:
            subprocess.run(bundle, cwd=web, capture_output=True, timeout=120, check=True)
            result = subprocess.run(
                ["node", script],
                input=json.dumps(encoded_clips),
                capture_output=True,
                text=True,
                timeout=300,
                check=True,
            )
        except (FileNotFoundError, subprocess.SubprocessError):
            return None
    return float(json.loads(result.stdout.splitlines()[-1])["median_ms"])


def main() -> None:
    parser = argparse.ArgumentParser(prog="bench-codec", description=__doc__)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--block-seconds", type=float, default=1.0)
    options = parser.parse_args()
    folder = Path(os.environ.get("CORPUS") or os.environ.get("BUNRAKU_SHARED", "../shared") + "/mocap")
    measured = peer_results.load_peer_results(folder)
    names = [name for name in clips.list_clips(folder) if name in measured][:: 3 if options.quick else 1]
    motions = {name: clips.load_clip(folder, name) for name in names}
    ratios: dict[str, list[float]] = {}
    encodings: dict[ErrorGoal, list[GoalEncoding]] = {goal: [] for goal in ERROR_GOALS}
    print(
        f"{'clip':<16}"
        + "".join(f"{kind} {error:g} mm".rjust(12) + f"{'acl':>8}{'meshopt':>9}" for kind, error in ERROR_GOALS)
    )
    for name, motion in motions.items():
        row = f"{name:<16}"
        for kind, error in ERROR_GOALS:
            key = f"{kind}_{error:g}mm"
            encoding = encode_to_goal(
                motion, (kind, error), entropy_study.load_held_out_prior(name), options.block_seconds
            )
            encodings[kind, error].append(encoding)
            kbps = encoding.kbps
            row += f"{kbps:12.2f}"
            for peer, column in PEERS.items():
                peer_points = peer_results.interpolate_kbps(measured[name][column], ERROR_COLUMNS[kind], error)
                ratios.setdefault(f"{peer}_{key}", []).append(peer_points / kbps)
                row += f"{peer_points / kbps:8.2f}" if peer == "acl" else f"{peer_points / kbps:9.2f}"
        print(row, flush=True)
    rates = {goal: [encoding.kbps for encoding in of_clips] for goal, of_clips in encodings.items()}
    values_by_key = ratios | {f"kbps_{kind}_{error:g}mm": values for (kind, error), values in rates.items()}
    figures = {key: round(geometric_mean(values), 3) for key, values in values_by_key.items()}
    for (kind, error), of_clips in encodings.items():
        tails = summarise_tails(of_clips) | {
            f"{peer}_worst_clip": min(ratios[f"{peer}_{kind}_{error:g}mm"]) for peer in PEERS
        }
        figures |= {f"{key}_{kind}_{error:g}mm": round(value, 3) for key, value in tails.items()}
    figures |= measure_served_ladder(motions)
    if os.environ.get("PICTURE"):
        drawn = draw_chart(motions, measured, rates, options.block_seconds)
        Path(os.environ["PICTURE"]).write_text(drawn, encoding="utf-8", newline="\n")
    figures |= {key: round(value, 3) for key, value in measure_speeds(motions).items()}
    typescript = measure_typescript_decode_ms(motions)
    figures["decode_ms_typescript"] = round(typescript, 3) if typescript is not None else -1.0
    print(
        json.dumps(
            figures | {"clips": len(names), "ladder_mm": list(ERROR_BOUNDS_MM), "block_seconds": options.block_seconds}
        )
    )


if __name__ == "__main__":
    main()
