"""Slide of planted feet: the six open clips on the puppet and on avatars (part of `make bench-contact`)."""

from __future__ import annotations

import json
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from bunraku.ingest.jobs.motion import encode_file
from bunraku.ingest.result import JobResult

CLIPS = ("cmu_12_01_walk", "mass_cart", "mass_dance", "mass_walk", "perfume_A", "perfume_C")
MEAN_ERROR_MM = 1.0
"""Mean error of the level that is played."""
_WEB = Path(__file__).resolve().parents[2] / "services" / "web"
_SCRIPT = """
import { runnerImport } from "vite";
await runnerImport("./tests/bench/contact-feet.ts");
"""


def measure_feet(shared: Path) -> dict[str, float]:
    """Print the slide of each figure's steps, and return the figures of this part.

    A step is one contact of a foot; its slide is the largest distance over the floor of the ball of the foot from where
    it was put. `feet_slide_mm_p95` is that of the worst figure. The table also has how far the correction moves planted
    feet, and its largest change from one frame to the next (60 frames/s), in millimetres.
    """
    results = _play_clips(shared)
    print(
        f"{'feet: slide of a step, mm':<32}{'steps':>6}{'before p50':>12}{'p95':>7}{'after p50':>11}"
        f"{'p95':>7}{'max':>7}{'correction p95':>16}{'change':>8}{'us a frame':>12}"
    )
    rows: dict[str, list[dict[str, Any]]] = {}
    for result in results:
        rows.setdefault(result["figure"], []).append(result)
    before, after, costs = [], [], []
    for figure, parts in rows.items():
        slid, kept, corrected = (
            np.concatenate([part[key] for part in parts]) for key in ("before", "after", "corrections")
        )
        before.append(np.quantile(slid, 0.95))
        after.append(np.quantile(kept, 0.95))
        costs.append(max(part["correctionUs"] for part in parts))
        change = max(part["maxChange"] for part in parts)
        print(
            f"{figure:<32}{len(kept):>6}{np.median(slid):>12.1f}{before[-1]:>7.1f}{np.median(kept):>11.2f}"
            f"{after[-1]:>7.2f}{kept.max():>7.1f}{np.quantile(corrected, 0.95):>16.1f}{change:>8.1f}{costs[-1]:>12.1f}"
        )
    return {
        "feet_slide_mm_p95": round(float(max(after)), 2),
        "feet_slide_before_mm_p95": round(float(max(before)), 1),
        "feet_correction_us": round(float(max(costs)), 1),
    }


def _play_clips(shared: Path) -> list[dict[str, Any]]:
    with tempfile.TemporaryDirectory() as folder:
        clips = []
        for name in CLIPS:
            result = encode_file(name, shared / "mocap" / "bvh" / f"{name}.bvh")
            assert isinstance(result, JobResult), result
            file = Path(folder) / name
            file.write_bytes(result.packed)
            clips.append({"name": name, "file": str(file)})
        done = subprocess.run(
            ["node", "--input-type=module", "--eval", _SCRIPT],
            cwd=_WEB,
            input=json.dumps({"clips": clips, "meanErrorMm": MEAN_ERROR_MM}),
            stdout=subprocess.PIPE,
            text=True,
            timeout=600,
            check=True,
        )
    found: list[dict[str, Any]] = json.loads(done.stdout.splitlines()[-1])
    return found
