from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from bunraku.marionette import shoulder as limit
from bunraku.marionette import vector
from bunraku.marionette.handover import HAND_ACCELERATION, Handover
from bunraku.marionette.limbs import Limb
from bunraku.marionette.pulled import LEAST_REACH, MOST_REACH, PulledHand, PulledLeg
from bunraku.marionette.vector import Vector
from bunraku.motion.skeleton import standard_figure
from tests.bench import smoothness
from tests.marionette.arms import dance

FIGURE = standard_figure()
FRAME = 1.0 / 60.0
POSES = dance(400, seed=5)


@settings(max_examples=30, deadline=None)
@given(st.integers(3, 200), st.tuples(*[st.floats(-0.15, 0.15)] * 3))
def test_a_hand_taken_in_the_dance_is_soon_where_it_is_wanted_without_a_jerk(begin: int, aside: Vector) -> None:
    poses = POSES[begin - 3 : begin + 60].tolist()
    hand, handover = PulledHand(FIGURE, Limb.LEFT_HAND), Handover()
    for pose in poses[:3]:
        hand.see(pose, FRAME)
    wanted = vector.add(hand.own, aside)
    reach = vector.length(wanted)
    places: list[Vector] = []
    for pose in poses[3:]:
        handover.advance(True, FRAME)
        hand.see(pose, FRAME)
        joints = hand.pull(pose, wanted, handover.weight, FRAME)
        assert joints is not None
        places.append(hand.place)
        # the arm is where its hand is, the whole way, wherever the shoulder lets it
        if limit.depth(hand.rig.shoulder, hand.rig.direction(hand.place)) < -0.3 and vector.length(hand.place) < 0.9:
            np.testing.assert_allclose(hand.rig.target(joints), hand.place, atol=1e-6)
    if LEAST_REACH < reach < MOST_REACH:
        assert vector.length(vector.subtract(places[-1], wanted)) < 1e-9
    speeds = np.diff(np.array(places), axis=0) / FRAME
    if min(vector.length(place) for place in places) > 0.2 and max(vector.length(p) for p in places) < 0.98:
        assert np.linalg.norm(np.diff(speeds, axis=0), axis=1).max() / FRAME <= HAND_ACCELERATION * 1.001


def test_what_is_let_go_comes_back_to_the_dance_and_rests() -> None:
    for limb in (Limb.RIGHT_HAND, Limb.RIGHT_LEG):
        pulled = PulledHand(FIGURE, limb) if limb.is_hand else PulledLeg(FIGURE, limb)
        handover = Handover()
        back = None
        for frame, pose in enumerate(POSES[:120].tolist()):
            held = 5 <= frame < 60
            handover.advance(held, FRAME)
            pulled.see(pose, FRAME)
            if frame < 5 or back is not None:
                continue
            wanted: Vector | None = ((-0.4, 0.3, 0.4) if limb.is_hand else (1.2, 0.0, 0.0)) if held else None
            joints = pulled.pull(pose, wanted, handover.weight, FRAME)
            assert joints is not None or not held
            if joints is None:
                back = frame
                pulled.rest()
                assert pulled.place == pulled.own
        assert back is not None
        assert 0.35 <= (back - 59) * FRAME <= 0.401


def test_hand_overs_of_the_demos_dance_are_within_their_bounds() -> None:
    """As `make bench-ik` measures them, a few."""
    found = smoothness.handovers(10, 0.25)
    assert max(one.taking for one in found) <= 80.0
    assert sorted(one.taken_ms for one in found)[8] <= 120.0
    assert max(one.back_ms for one in found) <= 400.0


@settings(max_examples=20, deadline=None)
@given(st.tuples(*[st.floats(-0.5, 0.5)] * 3), st.tuples(*[st.floats(-0.5, 0.5)] * 3))
def test_no_upper_arm_goes_where_no_shoulder_does_past_the_shoulder_too(one: Vector, other: Vector) -> None:
    hand = PulledHand(FIGURE, Limb.RIGHT_HAND)
    pose = [[1.0, 0.0, 0.0, 0.0]] * 18
    hand.see(pose, FRAME)
    for frame in range(140):
        hand.see(pose, FRAME)
        joints = hand.pull(pose, one if frame < 90 else other, 1.0, FRAME)
        assert joints is not None
        elbow = hand.rig.direction(hand.rig.places(joints)[0])
        assert limit.depth(hand.rig.shoulder, elbow) <= 1e-6
