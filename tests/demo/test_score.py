from dataclasses import replace

import pytest

from bunraku.demo.score import Arm, FootPlacement, Hop, Pose, PoseKey, Score, Step

DOWN, OUT = Arm((0.1, -0.9, 0.2), (1.0, 0.0, -1.0)), Arm((0.9, 0.0, 0.2), (0.0, -1.0, -1.0))
REST = Pose(DOWN, DOWN)
POSE = Pose(OUT, DOWN, depth=0.1, bow=5, lean=3, twist=-10, look=20, nod=4, tilt=-2)
LEFT, RIGHT = FootPlacement(0.08, 0.0, 8), FootPlacement(-0.08, 0.0, -8)
SCORE = Score(
    beats_per_minute=96.0,
    beat_count=8,
    rest_pose=REST,
    left_foot=LEFT,
    right_foot=RIGHT,
    keys=(PoseKey(2, POSE, 1.5), PoseKey(7, REST, 2)),
    steps=(Step(2, "left", FootPlacement(0.2, 0.0)), Step(6, "left", LEFT)),
    hops=(Hop(4, FootPlacement(0.2, 0.0), RIGHT),),
)


def test_mirroring_twice_gives_the_same_pose() -> None:
    mirrored = POSE.mirror()
    assert (mirrored.left, mirrored.right) == (DOWN, OUT)
    assert (mirrored.lean, mirrored.twist, mirrored.look, mirrored.tilt) == (-3, 10, -20, 2)
    assert (mirrored.depth, mirrored.bow, mirrored.nod) == (0.1, 5, 4)
    assert mirrored.mirror() == POSE


def test_score_has_duration_and_ordered_footfalls() -> None:
    assert SCORE.seconds_per_beat == 0.625
    assert SCORE.duration == 5.0
    assert [footfall.beat for footfall in SCORE.list_footfalls()] == [2, 4, 6]
    assert [footfall.takeoff_beat for footfall in SCORE.list_footfalls()] == [1.5, 3.58, 5.5]
    assert [set(footfall.targets) for footfall in SCORE.list_footfalls()] == [{"left"}, {"left", "right"}, {"left"}]


def test_score_that_does_not_end_in_rest_pose_is_rejected() -> None:
    with pytest.raises(ValueError, match="rest pose by beat 8"):
        replace(SCORE, keys=(PoseKey(2, POSE, 1.5),))
    with pytest.raises(ValueError, match="rest pose by beat 8"):
        replace(SCORE, keys=(PoseKey(2, POSE, 1.5), PoseKey(9, REST, 2)))


def test_score_whose_feet_do_not_return_is_rejected() -> None:
    with pytest.raises(ValueError, match="at beat 4 the feet are at"):
        replace(SCORE, steps=SCORE.steps[:1])


def test_step_while_a_foot_is_in_the_air_is_rejected() -> None:
    with pytest.raises(ValueError, match=r"step to beat 4 begins before beat 3\.7"):
        replace(SCORE, steps=(*SCORE.steps, Step(3.7, "right", RIGHT)))


def test_keys_out_of_order_are_rejected() -> None:
    with pytest.raises(ValueError, match="beat 1 must follow beat 2"):
        replace(SCORE, keys=(PoseKey(2, POSE, 1.5), PoseKey(1, POSE, 1), PoseKey(7, REST, 1)))
    with pytest.raises(ValueError, match="set out after beat 0"):
        replace(SCORE, keys=(PoseKey(2, POSE, 3), PoseKey(7, REST, 1)))
