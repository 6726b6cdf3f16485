from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bunraku.motion.skeleton import JOINT_INDEX, world_transforms
from tests.vectors.blocks import random_motion
from training import corpus


def test_mirrored_motion_has_mirrored_positions() -> None:
    motion = random_motion(0.5, 30.0, 3)
    mirrored = corpus.mirror_motion(motion)
    positions = world_transforms(motion.figure, motion.root, motion.rotations)[0]
    mirrored_positions = world_transforms(mirrored.figure, mirrored.root, mirrored.rotations)[0]
    flip = np.array([-1.0, 1.0, 1.0])
    np.testing.assert_allclose(
        mirrored_positions[:, JOINT_INDEX["l_wrist"]], positions[:, JOINT_INDEX["r_wrist"]] * flip, atol=1e-9
    )
    np.testing.assert_allclose(
        mirrored_positions[:, JOINT_INDEX["skullbase"]], positions[:, JOINT_INDEX["skullbase"]] * flip, atol=1e-9
    )


def test_clips_without_a_licence_are_excluded(tmp_path: Path) -> None:
    (tmp_path / "CORPUS.csv").write_text(
        "clip,licence_as_stated\na,MIT\nb,repo LICENSE Apache-2.0; motion origin not stated\nc,\n", encoding="utf-8"
    )
    assert corpus.licensed_clips(tmp_path) == {"a"}


def test_performers_have_only_licensed_clips(tmp_path: Path) -> None:
    (tmp_path / "CORPUS.csv").write_text(
        "clip,licence_as_stated,family\na,MIT,x\nb,,x\nc,MIT,y\nd,MIT,x\n", encoding="utf-8"
    )
    assert corpus.read_performers(tmp_path) == {"x": ["a", "d"], "y": ["c"]}


def test_reduced_frame_rate_keeps_the_duration() -> None:
    motion = random_motion(1.0, 120.0, 3)
    reduced = corpus.reduce_frame_rate(motion, 4)
    assert reduced.fps == 30
    assert reduced.duration == pytest.approx(motion.duration)
    np.testing.assert_array_equal(reduced.root[3], motion.root[12])


def test_families_and_empty_folder(tmp_path: Path) -> None:
    assert [corpus.clip_family(name) for name in ("perfume_A", "isaac_01_01", "mass_cart", "13_07")] == [
        "perfume",
        "isaac",
        "mass",
        "cmu",
    ]
    with pytest.raises(FileNotFoundError, match="hanim19"):
        corpus.list_clips(tmp_path)


def test_recorded_clip_is_loaded(shared: Path) -> None:
    folder = shared / "mocap"
    assert corpus.licensed_clips(folder) < set(corpus.list_clips(folder))
    motion = corpus.load_clip(folder, "perfume_C")
    assert (motion.fps, motion.frame_count) == (40.0, 1299)
    np.testing.assert_allclose(np.linalg.norm(motion.rotations, axis=-1), 1, atol=1e-9)
