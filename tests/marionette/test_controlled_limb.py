from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from bunraku.marionette.constants import HAND_ACCELERATION, MAX_REACH, MIN_REACH
from bunraku.marionette.controlled_limb import ControlledHand, ControlledLeg
from bunraku.marionette.handover import Handover
from bunraku.marionette.limb_rig import Limb
from bunraku.marionette.solver import shoulder as limit
from bunraku.marionette.solver import vector
from bunraku.marionette.solver.vector import Vector
from bunraku.motion.skeleton import standard_figure
from tests.bench import smoothness
from tests.marionette.fixtures import random_motion

FIGURE = standard_figure()
FRAME_S = 1.0 / 60.0
POSES = random_motion(400, seed=5)


@settings(max_examples=30, deadline=None)
@given(st.integers(3, 200), st.tuples(*[st.floats(-0.15, 0.15)] * 3))
def test_a_hand_taken_in_the_dance_is_soon_where_it_is_wanted_without_a_jerk(begin: int, aside: Vector) -> None:
    poses = POSES[begin - 3 : begin + 60].tolist()
    hand, handover = ControlledHand(FIGURE, Limb.LEFT_HAND), Handover()
    for pose in poses[:3]:
        hand.observe_pose(pose, FRAME_S)
    wanted = vector.add(hand.motion_position, aside)
    reach = vector.length(wanted)
    places: list[Vector] = []
    for pose in poses[3:]:
        handover.advance(True, FRAME_S)
        hand.observe_pose(pose, FRAME_S)
        joints = hand.solve_joints(pose, wanted, handover.weight, FRAME_S)
        assert joints is not None
        places.append(hand.position)
        # the arm is where its hand is, the whole way, wherever the shoulder lets it
        if (
            limit.depth_in_caps(hand.rig.shoulder, hand.rig.target_direction(hand.position)) < -0.3
            and vector.length(hand.position) < 0.9
        ):
            np.testing.assert_allclose(hand.rig.tip_target(joints), hand.position, atol=1e-6)
    if MIN_REACH < reach < MAX_REACH:
        assert vector.length(vector.subtract(places[-1], wanted)) < 1e-9
    speeds = np.diff(np.array(places), axis=0) / FRAME_S
    if min(vector.length(place) for place in places) > 0.2 and max(vector.length(p) for p in places) < 0.98:
        assert np.linalg.norm(np.diff(speeds, axis=0), axis=1).max() / FRAME_S <= HAND_ACCELERATION * 1.001


def test_what_is_let_go_comes_back_to_the_dance_and_rests() -> None:
    for limb in (Limb.RIGHT_HAND, Limb.RIGHT_LEG):
        pulled = ControlledHand(FIGURE, limb) if limb.is_hand else ControlledLeg(FIGURE, limb)
        handover = Handover()
        back = None
        for frame, pose in enumerate(POSES[:120].tolist()):
            held = 5 <= frame < 60
            handover.advance(held, FRAME_S)
            pulled.observe_pose(pose, FRAME_S)
            if frame < 5 or back is not None:
                continue
            wanted: Vector | None = ((-0.4, 0.3, 0.4) if limb.is_hand else (1.2, 0.0, 0.0)) if held else None
            joints = pulled.solve_joints(pose, wanted, handover.weight, FRAME_S)
            assert joints is not None or not held
            if joints is None:
                back = frame
                pulled.reset()
                assert pulled.position == pulled.motion_position
        assert back is not None
        assert 0.35 <= (back - 59) * FRAME_S <= 0.401


def test_hand_overs_of_the_demos_dance_are_within_their_bounds() -> None:
    """As `make bench-ik` measures them, a few."""
    found = smoothness.measure_handovers(10, 0.25)
    assert max(one.taking for one in found) <= 80.0
    assert sorted(one.taken_ms for one in found)[8] <= 120.0
    assert max(one.back_ms for one in found) <= 400.0


@settings(max_examples=20, deadline=None)
@given(st.tuples(*[st.floats(-0.5, 0.5)] * 3), st.tuples(*[st.floats(-0.5, 0.5)] * 3))
def test_no_upper_arm_goes_where_no_shoulder_does_past_the_shoulder_too(one: Vector, other: Vector) -> None:
    hand = ControlledHand(FIGURE, Limb.RIGHT_HAND)
    pose = [[1.0, 0.0, 0.0, 0.0]] * 18
    hand.observe_pose(pose, FRAME_S)
    for frame in range(140):
        hand.observe_pose(pose, FRAME_S)
        joints = hand.solve_joints(pose, one if frame < 90 else other, 1.0, FRAME_S)
        assert joints is not None
        elbow = hand.rig.target_direction(hand.rig.joint_positions(joints)[0])
        assert limit.depth_in_caps(hand.rig.shoulder, elbow) <= 1e-6
