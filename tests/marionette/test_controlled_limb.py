from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from bunraku.marionette.constants import HAND_ACCELERATION, MAX_REACH, MIN_REACH
from bunraku.marionette.controlled_limb import ControlledHand, ControlledLeg
from bunraku.marionette.handover import Handover
from bunraku.marionette.limb_rig import Limb
from bunraku.marionette.solver import shoulder, vector
from bunraku.marionette.solver.vector import Vector
from bunraku.motion.skeleton import standard_figure
from tests.bench import smoothness
from tests.marionette.fixtures import random_motion

FIGURE = standard_figure()
FRAME_S = 1.0 / 60.0
POSES = random_motion(400, seed=5)


@settings(max_examples=30, deadline=None)
@given(st.integers(3, 200), st.tuples(*[st.floats(-0.15, 0.15)] * 3))
def test_claimed_hand_reaches_its_target_with_bounded_acceleration(begin_frame: int, offset: Vector) -> None:
    poses = POSES[begin_frame - 3 : begin_frame + 60].tolist()
    hand, handover = ControlledHand(FIGURE, Limb.LEFT_HAND), Handover()
    for pose in poses[:3]:
        hand.observe_pose(pose, FRAME_S)
    target = vector.add(hand.motion_position, offset)
    reach = vector.length(target)
    positions: list[Vector] = []
    for pose in poses[3:]:
        handover.advance(True, FRAME_S)
        hand.observe_pose(pose, FRAME_S)
        joints = hand.solve_joints(pose, target, handover.weight, FRAME_S)
        assert joints is not None
        positions.append(hand.position)
        # the joints put the tip exactly there, except near the limit of the shoulder and at full stretch
        if (
            shoulder.depth_in_caps(hand.rig.shoulder, hand.rig.target_direction(hand.position)) < -0.3
            and vector.length(hand.position) < 0.9
        ):
            np.testing.assert_allclose(hand.rig.tip_target(joints), hand.position, atol=1e-6)
    if MIN_REACH < reach < MAX_REACH:
        assert vector.length(vector.subtract(positions[-1], target)) < 1e-9
    speeds = np.diff(np.array(positions), axis=0) / FRAME_S
    if min(vector.length(position) for position in positions) > 0.2 and max(vector.length(p) for p in positions) < 0.98:
        assert np.linalg.norm(np.diff(speeds, axis=0), axis=1).max() / FRAME_S <= HAND_ACCELERATION * 1.001


def test_released_limb_returns_to_the_motion_within_400_ms() -> None:
    for limb in (Limb.RIGHT_HAND, Limb.RIGHT_LEG):
        controlled = ControlledHand(FIGURE, limb) if limb.is_hand else ControlledLeg(FIGURE, limb)
        handover = Handover()
        returned_at = None
        for frame, pose in enumerate(POSES[:120].tolist()):
            is_held = 5 <= frame < 60
            handover.advance(is_held, FRAME_S)
            controlled.observe_pose(pose, FRAME_S)
            if frame < 5 or returned_at is not None:
                continue
            target: Vector | None = ((-0.4, 0.3, 0.4) if limb.is_hand else (1.2, 0.0, 0.0)) if is_held else None
            joints = controlled.solve_joints(pose, target, handover.weight, FRAME_S)
            assert joints is not None or not is_held
            if joints is None:
                returned_at = frame
                controlled.reset()
                assert controlled.position == controlled.motion_position
        assert returned_at is not None
        assert 0.35 <= (returned_at - 59) * FRAME_S <= 0.401


def test_hand_overs_of_the_demo_motion_are_within_bounds() -> None:
    """A few of the hand-overs that `make bench-ik` measures."""
    handovers = smoothness.measure_handovers(10, 0.25)
    assert max(one.taking for one in handovers) <= 80.0
    assert sorted(one.taken_ms for one in handovers)[8] <= 120.0
    assert max(one.back_ms for one in handovers) <= 400.0


@settings(max_examples=20, deadline=None)
@given(st.tuples(*[st.floats(-0.5, 0.5)] * 3), st.tuples(*[st.floats(-0.5, 0.5)] * 3))
def test_upper_arm_stays_within_the_shoulder_limit(first: Vector, second: Vector) -> None:
    hand = ControlledHand(FIGURE, Limb.RIGHT_HAND)
    pose = [[1.0, 0.0, 0.0, 0.0]] * 18
    hand.observe_pose(pose, FRAME_S)
    for frame in range(140):
        hand.observe_pose(pose, FRAME_S)
        joints = hand.solve_joints(pose, first if frame < 90 else second, 1.0, FRAME_S)
        assert joints is not None
        elbow = hand.rig.target_direction(hand.rig.joint_positions(joints)[0])
        assert shoulder.depth_in_caps(hand.rig.shoulder, elbow) <= 1e-6
