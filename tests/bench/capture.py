"""Cost of live capture per frame, CPU time: `make bench-capture`. The last line printed is one JSON object.

The clips are those of the shared folder, as VMC bundles (21 or 22 bones).
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable
from pathlib import Path

from bunraku.capture.calibration import calibrate
from bunraku.capture.frame import CapturedFrame
from bunraku.capture.reorder import ReorderBuffer
from bunraku.capture.retarget import Retargeter
from bunraku.capture.vmc import VmcAssembler
from bunraku.motion.analysis import analyse
from bunraku.motion.readers.bvh import parse_bvh
from tests.capture.samples import joint_distances_mm
from tests.capture.vmc_performer import make_bundle, make_messages, perform

CLIPS = ("cmu_12_01_walk", "mass_cart", "mass_dance", "mass_walk", "perfume_A", "perfume_C")
REPEATS = 3


def best_milliseconds(function: Callable[[], object], count: int) -> float:
    """Return the CPU time of the fastest of `REPEATS` runs, per frame."""
    times = []
    for _ in range(REPEATS):
        begin = time.process_time()
        function()
        times.append(time.process_time() - begin)
    return 1000.0 * min(times) / count


def measure_clip(path: Path) -> dict[str, float]:
    """Return the cost of each stage in ms per frame, that of the calibration in ms, and the distances in mm."""
    bvh = parse_bvh(path.read_bytes())
    performance = perform(bvh)
    count = performance.frame_count
    bundles = [make_bundle(make_messages(performance, n, n / performance.fps)) for n in range(count)]

    def parse() -> list[CapturedFrame]:
        assembler = VmcAssembler()
        return [frame for bundle in bundles for frame in assembler.feed(bundle)]

    def order() -> None:
        buffer = ReorderBuffer()
        for number, frame in enumerate(frames):
            buffer.push(frame, number / performance.fps)

    frames = parse()
    first = frames[: round(performance.fps)]
    retargeter = Retargeter(calibrate(VmcAssembler.skeleton, first))
    poses = [retargeter.retarget(frame) for frame in frames]
    distances = joint_distances_mm(retargeter.figure, poses, analyse(bvh))
    return {
        "parse_ms": best_milliseconds(parse, count),
        "order_ms": best_milliseconds(order, count),
        "retarget_ms": best_milliseconds(lambda: [retargeter.retarget(frame) for frame in frames], count),
        "calibration_ms": best_milliseconds(lambda: calibrate(VmcAssembler.skeleton, first), 1),
        "mean_mm": float(distances.mean()),
        "max_mm": float(distances.max()),
    }


def main() -> None:
    shared = Path(os.environ.get("BUNRAKU_SHARED") or Path(__file__).resolve().parents[3] / "shared")
    results = {}
    print("clip             parse  order  retarget ms/frame   calibration ms   mean  max mm")
    for clip in CLIPS:
        path = shared / "mocap" / "bvh" / f"{clip}.bvh"
        if not path.is_file():
            continue
        row = results[clip] = measure_clip(path)
        print(
            f"{clip:15} {row['parse_ms']:6.3f} {row['order_ms']:6.3f} {row['retarget_ms']:9.3f}"
            f" {row['calibration_ms']:22.0f} {row['mean_mm']:8.2f} {row['max_mm']:5.1f}"
        )
    print(json.dumps({clip: {key: round(value, 4) for key, value in row.items()} for clip, row in results.items()}))


if __name__ == "__main__":
    main()
