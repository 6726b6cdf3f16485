from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from bunraku.motion import rotation
from bunraku.playout.overlay_buffer import LIMB_JOINTS, OVERLAY_HOLD_US, OverlayBuffer, pack_joints, unpack_joints
from bunraku.wire.overlay import Overlay

MOTION_POSE = rotation.from_rotation_vector(np.random.default_rng(1).uniform(-1, 1, (18, 3)))
CONTROLLED_POSE = rotation.from_rotation_vector(np.random.default_rng(2).uniform(-1, 1, (3, 3)))


def rotation_angle(a: rotation.Array, b: rotation.Array) -> float:
    return float(
        np.linalg.norm(rotation.to_rotation_vector(rotation.multiply(rotation.conjugate(a), b)), axis=-1).max()
    )


@given(st.integers(0, 1000))
def test_packed_joints_round_trip(seed: int) -> None:
    vectors = np.random.default_rng(seed).normal(size=(3, 3))
    joints = rotation.from_rotation_vector(vectors)
    assert rotation_angle(unpack_joints(pack_joints(joints.tolist())), joints) < 2e-4


def test_overlay_applies_from_due_time_until_hold_ends() -> None:
    overlays = OverlayBuffer()
    assert overlays.apply(MOTION_POSE, 5) is MOTION_POSE
    overlays.put(Overlay(0, 1_000, {0: pack_joints(CONTROLLED_POSE.tolist())}))
    assert overlays.apply(MOTION_POSE, 999) is MOTION_POSE
    assert (
        rotation_angle(overlays.apply(MOTION_POSE, 1_000 + OVERLAY_HOLD_US)[list(LIMB_JOINTS[0])], CONTROLLED_POSE)
        < 2e-4
    )
    assert overlays.apply(MOTION_POSE, 1_001 + OVERLAY_HOLD_US) is MOTION_POSE


def test_only_joints_of_limbs_in_later_overlay_change() -> None:
    overlays = OverlayBuffer()
    overlays.put(Overlay(0, 0, {}))
    overlays.put(Overlay(1, 100, {2: pack_joints(CONTROLLED_POSE.tolist())}))
    overlays.put(Overlay(2, 200, {}))
    joints = list(LIMB_JOINTS[2])
    others = [k for k in range(18) if k not in joints]
    merged = overlays.apply(MOTION_POSE, 50)
    np.testing.assert_array_equal(merged[others], MOTION_POSE[others])
    assert (
        abs(
            rotation_angle(MOTION_POSE[joints], merged[joints])
            - rotation_angle(MOTION_POSE[joints], CONTROLLED_POSE) / 2
        )
        < 1e-3
    )
    np.testing.assert_array_equal(overlays.apply(MOTION_POSE, 150), MOTION_POSE)


def test_late_and_repeated_overlays_are_ignored() -> None:
    overlays = OverlayBuffer()
    overlays.put(Overlay(5, 500, {0: pack_joints(CONTROLLED_POSE.tolist())}))
    overlays.put(Overlay(4, 400, {}))
    overlays.put(Overlay(5, 500, {}))
    assert rotation_angle(overlays.apply(MOTION_POSE, 500)[list(LIMB_JOINTS[0])], CONTROLLED_POSE) < 2e-4


def test_overlay_after_gap_applies_when_due() -> None:
    overlays = OverlayBuffer()
    overlays.put(Overlay(0, 0, {}))
    overlays.put(Overlay(1, 10 * OVERLAY_HOLD_US, {0: pack_joints(CONTROLLED_POSE.tolist())}))
    for clock in (1, OVERLAY_HOLD_US, 2 * OVERLAY_HOLD_US, 10 * OVERLAY_HOLD_US - 1):
        np.testing.assert_array_equal(overlays.apply(MOTION_POSE, clock), MOTION_POSE)
    assert (
        rotation_angle(overlays.apply(MOTION_POSE, 10 * OVERLAY_HOLD_US)[list(LIMB_JOINTS[0])], CONTROLLED_POSE) < 2e-4
    )


def test_limbs_of_other_performers_do_not_change_pose() -> None:
    overlays = OverlayBuffer()
    overlays.put(
        Overlay(0, 0, {2: pack_joints(CONTROLLED_POSE.tolist()), 9: pack_joints(CONTROLLED_POSE[::-1].tolist())})
    )
    assert rotation_angle(overlays.apply(MOTION_POSE, 1)[list(LIMB_JOINTS[2])], CONTROLLED_POSE) < 2e-4
    np.testing.assert_array_equal(overlays.apply(MOTION_POSE, 1, 1), MOTION_POSE)
    third = overlays.apply(MOTION_POSE, 1, 2)
    assert rotation_angle(third[list(LIMB_JOINTS[1])], CONTROLLED_POSE[::-1]) < 2e-4
    others = [k for k in range(18) if k not in LIMB_JOINTS[1]]
    np.testing.assert_array_equal(third[others], MOTION_POSE[others])
