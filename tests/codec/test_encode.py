from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bunraku.codec.decode import decode_block
from bunraku.codec.encode import STEPS, encode_motion
from bunraku.motion.skeleton import Figure, Motion, points
from tests.vectors.blocks import wandering_motion


def real(shared: Path, name: str) -> Motion:
    clip = np.load(shared / "mocap" / "hanim19" / f"{name}.npz")
    parts = {key: clip[key].astype(np.float64) for key in ("off", "tip", "root", "Q")}
    return Motion(Figure(parts["off"], parts["tip"]), float(clip["fps"]), parts["root"], parts["Q"])


def test_finer_rates_cost_more_and_err_less() -> None:
    rates = encode_motion(wandering_motion(3.2, 30.0, 5)).rates
    assert len(rates) == len(STEPS) >= 3
    assert [r.kbps for r in rates] == sorted(r.kbps for r in rates)
    assert [r.mean for r in rates] == sorted((r.mean for r in rates), reverse=True)


@pytest.mark.parametrize("fps", [24.0, 29.97, 120.0])
@pytest.mark.parametrize("block_seconds", [0.25, 1.0, 2.0])
def test_stated_errors_are_those_of_the_decoded_motion(fps: float, block_seconds: float) -> None:
    motion = wandering_motion(2.3, fps, 6)
    encoded = encode_motion(motion, block_seconds, steps=(12,))
    blocks = [decode_block(encoded.track, data) for data in encoded.rates[0].blocks]
    poses = [block.at(np.arange(block.frames, dtype=np.float64)) for block in blocks]
    root = np.concatenate([pose[0] for pose in poses])
    rotations = np.concatenate([pose[1] for pose in poses])
    truth = points(encoded.track.figure, motion.root, motion.rotations)
    error = np.linalg.norm(points(encoded.track.figure, root, rotations) - truth, axis=-1) * 1e3
    assert encoded.rates[0].mean == pytest.approx(error.mean())
    assert encoded.rates[0].most == pytest.approx(error.max())
    assert error.mean() < 2.0


def test_a_single_frame_and_a_still_figure_are_cheap() -> None:
    motion = wandering_motion(4.0, 30.0, 5)
    still = Motion(motion.figure, 30.0, np.tile(motion.root[:1], (90, 1)), np.tile(motion.rotations[:1], (90, 1, 1)))
    assert encode_motion(Motion(motion.figure, 30.0, motion.root[:1], motion.rotations[:1])).track.blocks == 1
    lowest = encode_motion(still).rates[0]
    assert max(map(len, lowest.blocks)) < 90


def test_real_dance_is_small_and_near(shared: Path) -> None:
    rates = encode_motion(real(shared, "perfume_A")).rates
    assert rates[0].kbps < 1.6
    assert rates[2].kbps < 6.0
    assert rates[2].mean < 2.0
    assert rates[3].mean < 0.7
