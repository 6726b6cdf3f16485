from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bunraku.motion import rotation
from bunraku.motion.analysis import analyse
from bunraku.motion.errors import UnreadableFile
from bunraku.motion.readers.fbx import parse_fbx
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_INDEX, Motion, world_transforms
from tests.motion.readers.fbx_writer import write_fbx

CLIPS = ("cmu_135_01", "cmu_85_12", "isaac_01_01_cmu", "isaac_07_01_cmu", "isaac_09_11_cmu", "isaac_49_08_cmu")


@pytest.mark.parametrize("clip", CLIPS)
def test_real_files_are_read(clip: str, shared: Path) -> None:
    motion = parse_fbx((shared / "samples" / "fbx" / f"{clip}.fbx").read_bytes())
    analysis = analyse(motion)
    assert motion.fps == (120.0 if clip.startswith("isaac") else 30.0)
    assert analysis.profile in ("MotionBuilder", "CMU (cgspeed)")
    assert analysis.source_joints["l_knee"].endswith("LeftLeg")
    assert analysis.mean_fit_error_mm < 8.0


def leg_lengths(motion: Motion, side: str) -> Array:
    """Distances (n,) of hip and ankle as shares of the straight leg."""
    placed, _ = world_transforms(motion.figure, motion.root, motion.rotations)
    hip, knee, ankle = (placed[:, JOINT_INDEX[f"{side}_{name}"]] for name in ("hip", "knee", "ankle"))
    straight = np.linalg.norm(knee - hip, axis=-1) + np.linalg.norm(ankle - knee, axis=-1)
    bent: Array = np.linalg.norm(ankle - hip, axis=-1) / straight
    return bent


def reference_leg_lengths(path: Path, side: str) -> Array:
    clip = np.load(path)
    names, parents = [str(name) for name in clip["joints"]], clip["parents"]
    positions, orientations = clip["off"][None] + np.zeros((len(clip["root"]), 1, 1)), clip["Q"].copy()
    positions[:, 0] = clip["root"]
    for joint, parent in enumerate(parents):
        if parent >= 0:
            above = orientations[:, parent]
            positions[:, joint] = positions[:, parent] + rotation.rotate(above, positions[:, joint])
            orientations[:, joint] = rotation.multiply(above, orientations[:, joint])
    hip, knee, ankle = (positions[:, names.index(f"{side}_{name}")] for name in ("hip", "knee", "ankle"))
    straight = np.linalg.norm(knee - hip, axis=-1) + np.linalg.norm(ankle - knee, axis=-1)
    bent: Array = np.linalg.norm(ankle - hip, axis=-1) / straight
    return bent


@pytest.mark.parametrize("side", ["l", "r"])
def test_legs_bend_as_in_the_converted_clip(side: str, shared: Path) -> None:
    """The conversion has lost the times of the keys: each leg is compared at its own offset."""
    found = leg_lengths(analyse(parse_fbx((shared / "samples/fbx/cmu_85_12.fbx").read_bytes())).motion, side)
    expected = reference_leg_lengths(shared / "mocap/hanim19/cmu_85_12.npz", side)
    best = 0.0
    for shift in range(-100, 100):
        a, b = found[max(shift, 0) :], expected[max(-shift, 0) :]
        count = min(len(a), len(b))
        best = max(best, float(np.corrcoef(a[:count], b[:count])[0, 1]))
    assert best > 0.999


def test_pre_and_post_rotations_orders_and_units_are_applied() -> None:
    plain = analyse(parse_fbx(write_fbx()))
    for data in (
        write_fbx(pre_rotation=(10.0, 20.0, 30.0)),
        write_fbx(order="ZYX"),
        write_fbx(units_per_metre=1.0),
    ):
        other = analyse(parse_fbx(data))
        placed = [world_transforms(a.motion.figure, a.motion.root, a.motion.rotations)[0] for a in (plain, other)]
        assert np.abs(placed[0] - placed[1]).max() < 1e-3


def test_takes_are_chosen_by_name() -> None:
    data = write_fbx(takes=("walk", "run"))
    assert parse_fbx(data, "run").notes == ("Of 2 takes, 'run' was read; the others are 'walk'.",)
    assert parse_fbx(data).notes == ("Of 2 takes, 'walk' was read; the others are 'run'.",)
    with pytest.raises(UnreadableFile, match="No such take"):
        parse_fbx(data, "jump")


def test_files_without_animation_are_refused() -> None:
    with pytest.raises(UnreadableFile, match="No animation"):
        parse_fbx(write_fbx(takes=()))


@pytest.mark.parametrize("data", [b"", b"Kaydara FBX Binary  \0\x1a\0", b"; FBX 7.3.0\n{{{{", bytes(1000)])
def test_broken_files_are_refused(data: bytes) -> None:
    with pytest.raises(UnreadableFile) as caught:
        parse_fbx(data)
    assert caught.value.hint
