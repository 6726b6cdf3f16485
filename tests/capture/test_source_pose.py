from __future__ import annotations

import numpy as np
import pytest

from bunraku.capture.frame import CapturedFrame, CaptureSkeleton
from bunraku.capture.source_pose import SourcePose, find_parents
from bunraku.marionette.solver.vector import IDENTITY, Quaternion, Vector, multiply

QUARTER: Quaternion = (0.5**0.5, 0.0, 0.0, 0.5**0.5)
"""90 degrees about z."""
PARENTS = {"a": None, "b": "a", "c": "b"}


def make_pose(in_world: bool, joints: tuple[str, ...] = ("a", "b", "c")) -> SourcePose:
    offsets: list[Vector] = [(0.0, 1.0, 0.0), *[(1.0, 0.0, 0.0)] * (len(joints) - 1)]
    return SourcePose(CaptureSkeleton(PARENTS, in_world), joints, offsets, [IDENTITY] * len(joints))


def test_parents_skip_absent_joints() -> None:
    assert find_parents(CaptureSkeleton(PARENTS, False), ["a", "c"]) == [-1, 0]
    assert find_parents(CaptureSkeleton(PARENTS, False), ["b", "c"]) == [-1, 0]


def test_local_transforms_are_chained() -> None:
    pose = make_pose(in_world=False)
    np.testing.assert_allclose(pose.positions, [(0, 1, 0), (1, 1, 0), (2, 1, 0)])
    pose.update(CapturedFrame({}, {"b": QUARTER}))
    np.testing.assert_allclose(pose.positions, [(0, 1, 0), (1, 1, 0), (1, 2, 0)], atol=1e-12)
    pose.update(CapturedFrame({"c": (2.0, 0.0, 0.0)}, {"a": QUARTER}))
    np.testing.assert_allclose(pose.positions, [(0, 1, 0), (0, 2, 0), (-2, 2, 0)], atol=1e-12)


def test_world_transforms_are_taken_and_missing_joints_follow_their_parent() -> None:
    pose = make_pose(in_world=True)
    pose.update(CapturedFrame({"c": (5.0, 5.0, 5.0)}, {"a": QUARTER, "b": IDENTITY}))
    np.testing.assert_allclose(pose.positions, [(0, 1, 0), (0, 2, 0), (5, 5, 5)], atol=1e-12)
    np.testing.assert_allclose(pose.rotations, [QUARTER, IDENTITY, IDENTITY], atol=1e-12)
    offsets, turns = pose.local_transforms()
    pose.update(CapturedFrame({}, {"a": multiply(QUARTER, QUARTER)}))
    kept_offsets, kept_turns = pose.local_transforms()
    np.testing.assert_allclose(kept_offsets, offsets, atol=1e-12)
    np.testing.assert_allclose(kept_turns[1:], turns[1:], atol=1e-12)


@pytest.mark.parametrize("in_world", [False, True])
def test_empty_frame_changes_nothing(in_world: bool) -> None:
    pose = make_pose(in_world)
    before = list(pose.positions), list(pose.rotations)
    pose.update(CapturedFrame({}, {}))
    np.testing.assert_allclose(pose.positions, before[0], atol=1e-12)
    np.testing.assert_allclose(pose.rotations, before[1], atol=1e-12)
