from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bunraku.marionette.limb_rig import ArmRig, LegRig, Limb
from bunraku.marionette.merge import JointOverlay, Marionette, apply_overlay
from bunraku.marionette.ownership import InputOutcome, LimbGrant, LimbInput
from bunraku.marionette.proportions import ProportionsError
from bunraku.motion import rotation
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import Figure, standard_figure
from tests.marionette.fixtures import random_motion

FIGURE = standard_figure()
FRAME_INTERVAL_US = 16_667


def claim_epoch(marionette: Marionette, limb: int, puppeteer: str, now: int) -> int:
    answer = marionette.ownership.claim(limb, puppeteer, now)
    assert isinstance(answer, LimbGrant)
    return answer.epoch


def joint_steps(merged: Array) -> Array:
    """Return the rotation of each joint from frame to frame, degrees, (frames - 1, 18)."""
    steps = rotation.multiply(rotation.conjugate(merged[:-1]), merged[1:])
    angles: Array = np.degrees(np.linalg.norm(rotation.to_rotation_vector(steps), axis=-1))
    return angles


def test_motion_without_controlled_limbs_is_unchanged() -> None:
    poses = random_motion(30, seed=1)
    marionette = Marionette(FIGURE)
    for i, pose in enumerate(poses):
        overlay = marionette.compute_overlay(pose, i * FRAME_INTERVAL_US)
        assert overlay is None
        assert apply_overlay(pose, overlay).tobytes() == pose.tobytes()


@settings(max_examples=20, deadline=None)
@given(st.sets(st.sampled_from(list(Limb)), min_size=1), st.integers(0, 1000))
def test_overlay_changes_only_joints_of_controlled_limbs(controlled: set[Limb], seed: int) -> None:
    poses = random_motion(40, seed)
    marionette = Marionette(FIGURE)
    for limb in controlled:
        marionette.ownership.apply_input(
            "ada", LimbInput(limb, 1, claim_epoch(marionette, limb, "ada", 0), 1, 0, (0.4, 0.1, 0.3)), 0
        )
    controlled_joints = sorted(joint for limb in controlled for joint in limb.joint_indices)
    others = [joint for joint in range(18) if joint not in controlled_joints]
    for i, pose in enumerate(poses):
        overlay = marionette.compute_overlay(pose, i * FRAME_INTERVAL_US)
        assert overlay is not None
        assert overlay.limbs == tuple(sorted(controlled))
        merged = apply_overlay(pose, overlay)
        assert merged[others].tobytes() == pose[others].tobytes()
        np.testing.assert_allclose(np.linalg.norm(merged, axis=1), 1.0, atol=1e-9)


def test_held_hand_and_leg_reach_their_targets() -> None:
    poses = random_motion(40, seed=4)
    marionette = Marionette(FIGURE)
    hand, leg = claim_epoch(marionette, 1, "ada", 0), claim_epoch(marionette, 2, "bo", 0)
    target = (-0.5, 0.2, 0.4)
    marionette.ownership.apply_input("ada", LimbInput(1, 1, hand, 1, 0, target), 0)
    marionette.ownership.apply_input("bo", LimbInput(2, 1, leg, 1, 0, (0.9, 0.0, 0.0)), 0)
    for i in range(29):
        marionette.compute_overlay(poses[i], i * FRAME_INTERVAL_US)
    merged = apply_overlay(poses[29], marionette.compute_overlay(poses[29], 29 * FRAME_INTERVAL_US)).tolist()
    rig = ArmRig(FIGURE, Limb.RIGHT_HAND)
    np.testing.assert_allclose(rig.tip_target(rig.pose_joints(merged)), target, atol=1e-9)
    assert abs(LegRig(FIGURE, Limb.LEFT_LEG).thigh_angle(merged) - 0.9) < 1e-9


def run_claim_and_release(seed: int, hold: int, gap: int) -> tuple[Array, Array]:
    """Control all limbs twice for `hold` frames at up to one arm length per second, with `gap` frames between.

    Return the rotation of each joint from frame to frame in the merged motion and in the motion alone, degrees. Frames
    in which a hand is within a quarter of an arm length of its shoulder count as 0, as there the arm has to turn fast.
    """
    poses = random_motion(2 * (hold + gap) + 30, seed)
    random = np.random.default_rng(seed)
    marionette = Marionette(FIGURE)
    merged, epochs, sequence = [], dict.fromkeys(Limb, 0), 0
    for i, pose in enumerate(poses):
        now = i * FRAME_INTERVAL_US
        if i < 2:
            marionette.observe_pose(pose, now)
            merged.append(pose)
            continue
        phase = (i - 2) % (hold + gap)
        if phase == 0:
            epochs = {limb: claim_epoch(marionette, limb, "ada", now) for limb in Limb}
            speed = random.uniform(-1.0, 1.0, 3) / np.sqrt(3.0)
        if phase < hold:
            sequence += 1
            for limb, epoch in epochs.items():
                x, y, z = speed.tolist()
                limb_input = LimbInput(limb, 0, epoch, sequence, now, (x, y, z))
                assert marionette.ownership.apply_input("ada", limb_input, now) is InputOutcome.ACCEPTED
        if phase == hold:
            marionette.ownership.leave("ada", now)
        merged.append(apply_overlay(pose, marionette.compute_overlay(pose, now)))
    steps = joint_steps(np.array(merged))
    for limb in (Limb.LEFT_HAND, Limb.RIGHT_HAND):
        rig = ArmRig(FIGURE, limb)
        is_near_shoulder = np.array(
            [np.linalg.norm(rig.tip_target(rig.pose_joints(pose.tolist()))) < 0.25 for pose in merged]
        )
        steps[np.ix_(is_near_shoulder[1:] | is_near_shoulder[:-1], limb.joint_indices)] = 0.0
    return steps, joint_steps(poses)


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 10_000), st.integers(1, 120), st.integers(24, 60))
def test_claim_drag_and_release_cause_no_jump(seed: int, hold: int, gap: int) -> None:
    """A hard switch rotates joints by up to 180 degrees per frame, the motion itself by up to 10."""
    steps, motion_steps = run_claim_and_release(seed, hold, gap)
    assert float(steps.max()) < 60.0
    extra_steps = np.abs(steps[1] - motion_steps[1])
    pose = random_motion(3, seed)[2].tolist()
    for limb in Limb:
        joints = list(limb.joint_indices)
        rig = ArmRig(FIGURE, limb) if limb.is_hand else None
        # an almost straight arm bends by 10 degrees when its hand comes 1 % of its length nearer
        is_straight = rig is not None and float(np.linalg.norm(rig.tip_target(rig.pose_joints(pose)))) > 0.93
        assert float(extra_steps[joints].max()) < (20.0 if is_straight else 4.0)


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 10_000), st.integers(1, 60), st.integers(1, 23))
def test_claim_during_the_return_causes_no_jump(seed: int, hold: int, gap: int) -> None:
    steps, _ = run_claim_and_release(seed, hold, gap)
    assert float(steps.max()) < 60.0


def test_jump_of_the_target_causes_no_jump_of_the_limb() -> None:
    poses = random_motion(200, seed=11)
    random = np.random.default_rng(11)
    marionette = Marionette(FIGURE)
    epochs = {limb: claim_epoch(marionette, limb, "ada", 0) for limb in Limb}
    merged = []
    for i, pose in enumerate(poses):
        for limb, epoch in epochs.items():
            if i % 15 == 0:
                x, y, z = random.uniform(-1.5, 1.5, 3).tolist()
                marionette.ownership.apply_input(
                    "ada", LimbInput(limb, 1, epoch, i + 1, i * FRAME_INTERVAL_US, (x, y, z)), i * FRAME_INTERVAL_US
                )
        marionette.ownership.keep_alive("ada", list(Limb), i * FRAME_INTERVAL_US)
        merged.append(apply_overlay(pose, marionette.compute_overlay(pose, i * FRAME_INTERVAL_US)))
    assert float(joint_steps(np.array(merged)).max()) < 60.0


def test_silent_puppeteer_loses_the_limb_which_returns_to_the_motion() -> None:
    pose = random_motion(1, seed=3)[0]
    marionette = Marionette(FIGURE)
    epoch = claim_epoch(marionette, 0, "ada", 0)
    marionette.ownership.apply_input("ada", LimbInput(0, 0, epoch, 1, 0, (0.5, 0.5, 0.5)), 0)
    shown: list[JointOverlay | None] = []
    lost = []
    for i in range(70):
        lost += marionette.ownership.expire(i * FRAME_INTERVAL_US)
        shown.append(marionette.compute_overlay(pose, i * FRAME_INTERVAL_US))
    assert lost == [(Limb.LEFT_HAND, "ada")]
    assert marionette.ownership.holders() == (None, None, None, None)
    rig = ArmRig(FIGURE, Limb.LEFT_HAND)
    positions = [rig.tip_target(rig.pose_joints(apply_overlay(pose, overlay).tolist())) for overlay in shown]
    np.testing.assert_allclose(positions[29], positions[18], atol=1e-3)
    assert shown[-1] is None
    rest_frames = [i for i, overlay in enumerate(shown) if overlay is None]
    assert 500_000 + 350_000 - FRAME_INTERVAL_US <= rest_frames[0] * FRAME_INTERVAL_US <= 500_000 + 400_000
    assert (
        marionette.ownership.apply_input("ada", LimbInput(0, 1, epoch, 2, 0, (0.0, 0.0, 0.0)), 60 * FRAME_INTERVAL_US)
        is InputOutcome.NOT_OWNER
    )


def test_equal_inputs_give_equal_merged_motion() -> None:
    poses = random_motion(60, seed=2)

    def run() -> bytes:
        marionette = Marionette(FIGURE)
        epoch = claim_epoch(marionette, 0, "ada", 0)
        merged = []
        for i, pose in enumerate(poses):
            marionette.ownership.apply_input(
                "ada",
                LimbInput(0, i % 2, epoch, i + 1, i * FRAME_INTERVAL_US, (0.3, 0.01 * i, 0.2)),
                i * FRAME_INTERVAL_US,
            )
            merged.append(apply_overlay(pose, marionette.compute_overlay(pose, i * FRAME_INTERVAL_US)))
        return np.array(merged).tobytes()

    assert run() == run()


def test_change_of_figure_keeps_limbs_held() -> None:
    pose = random_motion(1, seed=6)[0]
    marionette = Marionette(FIGURE)
    epoch = claim_epoch(marionette, 0, "ada", 0)
    marionette.ownership.apply_input("ada", LimbInput(0, 1, epoch, 1, 0, (0.4, 0.2, 0.3)), 0)
    marionette.compute_overlay(pose, 0)
    longer = Figure(FIGURE.offsets * 1.1, FIGURE.tips * 1.4)
    marionette.set_figure(longer)
    assert marionette.ownership.holders() == ("ada", None, None, None)
    for i in range(1, 40):
        marionette.ownership.keep_alive("ada", [0], i * FRAME_INTERVAL_US)
        merged = apply_overlay(pose, marionette.compute_overlay(pose, i * FRAME_INTERVAL_US))
    rig = ArmRig(longer, Limb.LEFT_HAND)
    np.testing.assert_allclose(rig.tip_target(rig.pose_joints(merged.tolist())), (0.4, 0.2, 0.3), atol=1e-9)
    with pytest.raises(ProportionsError):
        marionette.set_figure(Figure(FIGURE.offsets, FIGURE.tips * 0.0))
    assert marionette.compute_overlay(pose, 40 * FRAME_INTERVAL_US) is not None


def test_full_rate_is_needed_during_hand_over_and_fast_movement() -> None:
    pose = random_motion(1, seed=3)[0]
    marionette = Marionette(FIGURE)
    assert not marionette.needs_full_rate
    epoch = claim_epoch(marionette, 0, "ada", 0)
    needs_full_rate: list[bool] = []
    for i in range(60):
        if i in (1, 40):
            target = (0.4, 0.2 if i == 1 else -0.4, 0.4)
            marionette.ownership.apply_input(
                "ada", LimbInput(0, 1, epoch, i, i * FRAME_INTERVAL_US, target), i * FRAME_INTERVAL_US
            )
        marionette.ownership.keep_alive("ada", [0], i * FRAME_INTERVAL_US)
        marionette.compute_overlay(pose, i * FRAME_INTERVAL_US)
        needs_full_rate.append(marionette.needs_full_rate)
    assert needs_full_rate[2]
    assert not any(needs_full_rate[25:40])
    assert any(needs_full_rate[40:50])
    assert not needs_full_rate[59]
