from __future__ import annotations

from bunraku.marionette.bond.bonded_arm import BondedArm, settle
from bunraku.marionette.controlled_limb import ControlledHand
from bunraku.marionette.limb_rig import Limb
from bunraku.marionette.solver import vector
from bunraku.motion.skeleton import standard_figure
from tests.marionette.fixtures import random_motion

FIGURE = standard_figure()
POSE = random_motion(2, seed=5)[0].tolist()
FRAME_S = 1.0 / 60.0


def arm(limb: Limb) -> BondedArm:
    hand = ControlledHand(FIGURE, limb)
    hand.observe_pose(POSE, FRAME_S)
    return BondedArm(hand, POSE, (0.0, 0.9, 0.0), FRAME_S)


def test_hand_that_nothing_moves_stays_in_the_motion() -> None:
    hand = ControlledHand(FIGURE, Limb.LEFT_HAND)
    hand.observe_pose(POSE, FRAME_S)
    assert BondedArm(hand, POSE, (0.0, 0.9, 0.0), FRAME_S).motion.place == hand.motion_position


def test_position_that_both_arms_reach_is_settled_at_once() -> None:
    arms = (arm(Limb.LEFT_HAND), arm(Limb.RIGHT_HAND))
    ahead = vector.scale(vector.add(arms[0].shoulder.position, arms[1].shoulder.position), 0.5)
    position = vector.add(ahead, vector.rotate(arms[0].shoulder.rotation, (0.0, 0.0, 0.35)))
    assert settle(*arms, position) == position


def test_arms_agree_on_a_position_within_the_limits_of_the_shoulders() -> None:
    arms = (arm(Limb.LEFT_HAND), arm(Limb.RIGHT_HAND))
    behind = arms[0].shoulder.to_world((0.1, -0.2, -0.6))
    position = settle(*arms, behind)
    assert vector.length(vector.subtract(position, behind)) > 1e-3
    for one in arms:
        assert vector.length(vector.subtract(one.reachable_position(position), position)) < 1e-3
