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


def claim_epoch(puppet: Marionette, limb: int, who: str, now: int) -> int:
    answer = puppet.ownership.claim(limb, who, now)
    assert isinstance(answer, LimbGrant)
    return answer.epoch


def joint_steps(merged: Array) -> Array:
    """How far each joint turns from frame to frame, degrees, (frames - 1, 18)."""
    turned = rotation.multiply(rotation.conjugate(merged[:-1]), merged[1:])
    angles: Array = np.degrees(np.linalg.norm(rotation.to_rotation_vector(turned), axis=-1))
    return angles


def test_without_a_hand_on_it_the_dance_is_untouched() -> None:
    poses = random_motion(30, seed=1)
    puppet = Marionette(FIGURE)
    for i, pose in enumerate(poses):
        overlay = puppet.compute_overlay(pose, i * FRAME_INTERVAL_US)
        assert overlay is None
        assert apply_overlay(pose, overlay).tobytes() == pose.tobytes()


@settings(max_examples=20, deadline=None)
@given(st.sets(st.sampled_from(list(Limb)), min_size=1), st.integers(0, 1000))
def test_only_the_pulled_limbs_joints_change(pulled: set[Limb], seed: int) -> None:
    poses = random_motion(40, seed)
    puppet = Marionette(FIGURE)
    for limb in pulled:
        puppet.ownership.apply_input(
            "ada", LimbInput(limb, 1, claim_epoch(puppet, limb, "ada", 0), 1, 0, (0.4, 0.1, 0.3)), 0
        )
    theirs = sorted(joint for limb in pulled for joint in limb.joint_indices)
    others = [joint for joint in range(18) if joint not in theirs]
    for i, pose in enumerate(poses):
        overlay = puppet.compute_overlay(pose, i * FRAME_INTERVAL_US)
        assert overlay is not None
        assert overlay.limbs == tuple(sorted(pulled))
        merged = apply_overlay(pose, overlay)
        assert merged[others].tobytes() == pose[others].tobytes()
        np.testing.assert_allclose(np.linalg.norm(merged, axis=1), 1.0, atol=1e-9)


def test_a_held_hand_is_where_it_is_put_and_a_leg_too() -> None:
    poses = random_motion(40, seed=4)
    puppet = Marionette(FIGURE)
    hand, leg = claim_epoch(puppet, 1, "ada", 0), claim_epoch(puppet, 2, "bo", 0)
    target = (-0.5, 0.2, 0.4)
    puppet.ownership.apply_input("ada", LimbInput(1, 1, hand, 1, 0, target), 0)
    puppet.ownership.apply_input("bo", LimbInput(2, 1, leg, 1, 0, (0.9, 0.0, 0.0)), 0)
    for i in range(29):
        puppet.compute_overlay(poses[i], i * FRAME_INTERVAL_US)
    merged = apply_overlay(poses[29], puppet.compute_overlay(poses[29], 29 * FRAME_INTERVAL_US)).tolist()
    rig = ArmRig(FIGURE, Limb.RIGHT_HAND)
    np.testing.assert_allclose(rig.tip_target(rig.pose_joints(merged)), target, atol=1e-9)
    assert abs(LegRig(FIGURE, Limb.LEFT_LEG).thigh_angle(merged) - 0.9) < 1e-9


def run_claim_and_release(seed: int, hold: int, gap: int) -> tuple[Array, Array]:
    """All limbs pulled twice for `hold` frames at up to one arm length a second, `gap` frames between: how far each
    joint turned from frame to frame, and in the dance alone, degrees.

    Not counted is an arm whose hand flies past its shoulder within a quarter of an arm: it has to whirl."""
    poses = random_motion(2 * (hold + gap) + 30, seed)
    random = np.random.default_rng(seed)
    puppet = Marionette(FIGURE)
    merged, epochs, sequence = [], dict.fromkeys(Limb, 0), 0
    for i, pose in enumerate(poses):
        now = i * FRAME_INTERVAL_US
        if i < 2:
            puppet.observe_pose(pose, now)
            merged.append(pose)
            continue
        phase = (i - 2) % (hold + gap)
        if phase == 0:
            epochs = {limb: claim_epoch(puppet, limb, "ada", now) for limb in Limb}
            speed = random.uniform(-1.0, 1.0, 3) / np.sqrt(3.0)
        if phase < hold:
            sequence += 1
            for limb, epoch in epochs.items():
                x, y, z = speed.tolist()
                given = LimbInput(limb, 0, epoch, sequence, now, (x, y, z))
                assert puppet.ownership.apply_input("ada", given, now) is InputOutcome.ACCEPTED
        if phase == hold:
            puppet.ownership.leave("ada", now)
        merged.append(apply_overlay(pose, puppet.compute_overlay(pose, now)))
    turned = joint_steps(np.array(merged))
    for limb in (Limb.LEFT_HAND, Limb.RIGHT_HAND):
        rig = ArmRig(FIGURE, limb)
        near = np.array([np.linalg.norm(rig.tip_target(rig.pose_joints(pose.tolist()))) < 0.25 for pose in merged])
        turned[np.ix_(near[1:] | near[:-1], limb.joint_indices)] = 0.0
    return turned, joint_steps(poses)


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 10_000), st.integers(1, 120), st.integers(24, 60))
def test_nothing_pops_when_a_limb_is_taken_dragged_and_let_go(seed: int, hold: int, gap: int) -> None:
    """A hard switch turns joints by up to 180 degrees in one frame; the dance itself by up to ten."""
    turned, own = run_claim_and_release(seed, hold, gap)
    assert float(turned.max()) < 60.0
    first = np.abs(turned[1] - own[1])
    pose = random_motion(3, seed)[2].tolist()
    for limb in Limb:
        joints = list(limb.joint_indices)
        rig = ArmRig(FIGURE, limb) if limb.is_hand else None
        # an arm that is all but straight bends by ten degrees where its hand comes a hundredth nearer
        straight = rig is not None and float(np.linalg.norm(rig.tip_target(rig.pose_joints(pose)))) > 0.93
        assert float(first[joints].max()) < (20.0 if straight else 4.0)


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 10_000), st.integers(1, 60), st.integers(1, 23))
def test_nor_when_it_is_taken_again_before_it_is_back(seed: int, hold: int, gap: int) -> None:
    turned, _ = run_claim_and_release(seed, hold, gap)
    assert float(turned.max()) < 60.0


def test_a_jump_of_the_target_does_not_throw_the_limb() -> None:
    poses = random_motion(200, seed=11)
    random = np.random.default_rng(11)
    puppet = Marionette(FIGURE)
    epochs = {limb: claim_epoch(puppet, limb, "ada", 0) for limb in Limb}
    merged = []
    for i, pose in enumerate(poses):
        for limb, epoch in epochs.items():
            if i % 15 == 0:
                x, y, z = random.uniform(-1.5, 1.5, 3).tolist()
                puppet.ownership.apply_input(
                    "ada", LimbInput(limb, 1, epoch, i + 1, i * FRAME_INTERVAL_US, (x, y, z)), i * FRAME_INTERVAL_US
                )
        puppet.ownership.keep_alive("ada", list(Limb), i * FRAME_INTERVAL_US)
        merged.append(apply_overlay(pose, puppet.compute_overlay(pose, i * FRAME_INTERVAL_US)))
    assert float(joint_steps(np.array(merged)).max()) < 60.0


def test_a_silent_puppeteer_holds_still_then_loses_the_limb_which_goes_back_to_the_dance() -> None:
    pose = random_motion(1, seed=3)[0]
    puppet = Marionette(FIGURE)
    epoch = claim_epoch(puppet, 0, "ada", 0)
    puppet.ownership.apply_input("ada", LimbInput(0, 0, epoch, 1, 0, (0.5, 0.5, 0.5)), 0)
    shown: list[JointOverlay | None] = []
    lost = []
    for i in range(70):
        lost += puppet.ownership.expire(i * FRAME_INTERVAL_US)
        shown.append(puppet.compute_overlay(pose, i * FRAME_INTERVAL_US))
    assert lost == [(Limb.LEFT_HAND, "ada")]
    assert puppet.ownership.holders() == (None, None, None, None)
    rig = ArmRig(FIGURE, Limb.LEFT_HAND)
    places = [rig.tip_target(rig.pose_joints(apply_overlay(pose, overlay).tolist())) for overlay in shown]
    np.testing.assert_allclose(places[29], places[18], atol=1e-3)
    assert shown[-1] is None
    back = [i for i, overlay in enumerate(shown) if overlay is None]
    assert 500_000 + 350_000 - FRAME_INTERVAL_US <= back[0] * FRAME_INTERVAL_US <= 500_000 + 400_000
    assert (
        puppet.ownership.apply_input("ada", LimbInput(0, 1, epoch, 2, 0, (0.0, 0.0, 0.0)), 60 * FRAME_INTERVAL_US)
        is InputOutcome.NOT_OWNER
    )


def test_the_same_inputs_give_the_same_dance_again() -> None:
    poses = random_motion(60, seed=2)

    def run() -> bytes:
        puppet = Marionette(FIGURE)
        epoch = claim_epoch(puppet, 0, "ada", 0)
        out = []
        for i, pose in enumerate(poses):
            puppet.ownership.apply_input(
                "ada",
                LimbInput(0, i % 2, epoch, i + 1, i * FRAME_INTERVAL_US, (0.3, 0.01 * i, 0.2)),
                i * FRAME_INTERVAL_US,
            )
            out.append(apply_overlay(pose, puppet.compute_overlay(pose, i * FRAME_INTERVAL_US)))
        return np.array(out).tobytes()

    assert run() == run()


def test_another_dancer_stays_in_the_hands_the_limbs_are_in() -> None:
    pose = random_motion(1, seed=6)[0]
    puppet = Marionette(FIGURE)
    epoch = claim_epoch(puppet, 0, "ada", 0)
    puppet.ownership.apply_input("ada", LimbInput(0, 1, epoch, 1, 0, (0.4, 0.2, 0.3)), 0)
    puppet.compute_overlay(pose, 0)
    longer = Figure(FIGURE.offsets * 1.1, FIGURE.tips * 1.4)
    puppet.set_figure(longer)
    assert puppet.ownership.holders() == ("ada", None, None, None)
    for i in range(1, 40):
        puppet.ownership.keep_alive("ada", [0], i * FRAME_INTERVAL_US)
        merged = apply_overlay(pose, puppet.compute_overlay(pose, i * FRAME_INTERVAL_US))
    rig = ArmRig(longer, Limb.LEFT_HAND)
    np.testing.assert_allclose(rig.tip_target(rig.pose_joints(merged.tolist())), (0.4, 0.2, 0.3), atol=1e-9)
    with pytest.raises(ProportionsError):
        puppet.set_figure(Figure(FIGURE.offsets, FIGURE.tips * 0.0))
    assert puppet.compute_overlay(pose, 40 * FRAME_INTERVAL_US) is not None


def test_a_puppet_is_lively_while_a_limb_goes_over_or_fast() -> None:
    pose = random_motion(1, seed=3)[0]
    puppet = Marionette(FIGURE)
    assert not puppet.needs_full_rate
    epoch = claim_epoch(puppet, 0, "ada", 0)
    seen: list[bool] = []
    for i in range(60):
        if i in (1, 40):
            target = (0.4, 0.2 if i == 1 else -0.4, 0.4)
            puppet.ownership.apply_input(
                "ada", LimbInput(0, 1, epoch, i, i * FRAME_INTERVAL_US, target), i * FRAME_INTERVAL_US
            )
        puppet.ownership.keep_alive("ada", [0], i * FRAME_INTERVAL_US)
        puppet.compute_overlay(pose, i * FRAME_INTERVAL_US)
        seen.append(puppet.needs_full_rate)
    assert seen[2]
    assert not any(seen[25:40])
    assert any(seen[40:50])
    assert not seen[59]
