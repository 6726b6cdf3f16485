from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.motion import bvh, rotation
from bunraku.motion.kinematics import pose
from bunraku.motion.rest import UNITS, Rest, find_rest, sample, sides
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import INDEX, JOINTS, Motion
from tests.motion.sources import bone_aligned, dance, pose_with_arms, straight_figure, told

NAMED = dict(INDEX)
UP: Array = np.array([0.0, 1.0, 0.0])


def rest_of(data: bytes) -> tuple[Rest, bvh.Bvh]:
    source = bvh.read(data)
    frames = sample(source)
    position, orientation = pose(source, list(range(len(source.names))), frames)
    return find_rest(source, dict(NAMED), frames, position, orientation), source


@pytest.mark.parametrize(
    ("unit", "per_metre"),
    [("m", 1.0), ("cm", 100.0), ("mm", 1000.0), ("inch", 1 / 0.0254), ("CMU unit (0.45 scaled inch)", 0.45 / 0.0254)],
)
def test_units(unit: str, per_metre: float) -> None:
    rest, _ = rest_of(told(dance(frames=5), per_metre=per_metre))
    assert rest.unit == unit
    assert rest.scale == UNITS[unit] == pytest.approx(1.0 / per_metre)


@pytest.mark.parametrize(("per_metre", "unit"), [(0.7, "m"), (1.4, "m"), (70.0, "cm"), (140.0, "cm")])
def test_a_child_and_a_giant_are_measured_in_the_same_unit(per_metre: float, unit: str) -> None:
    rest, _ = rest_of(told(dance(frames=5), per_metre=per_metre))
    assert rest.unit == unit


@pytest.mark.parametrize(
    ("degrees", "name"), [(0, "I"), (15, "I"), (30, "A"), (45, "A"), (60, "A"), (75, "T"), (90, "T"), (140, "other")]
)
def test_rest_poses(degrees: int, name: str) -> None:
    rest, _ = rest_of(told(dance(frames=5), pose_with_arms(degrees)))
    assert rest.pose == name
    assert any("neither T, A nor I" in sentence for sentence in rest.guessed) == (name == "other")
    np.testing.assert_allclose(np.abs(rest.upright @ rotation.IDENTITY), 1.0)


def test_arms_that_point_forwards_are_another_pose() -> None:
    at_rest = pose_with_arms(0.0)
    for name in JOINTS[12:]:
        at_rest[INDEX[name]] = rotation.about_axis(0, np.array(-np.pi / 2))
    rest, _ = rest_of(told(dance(frames=5), at_rest))
    assert rest.pose == "other"


@pytest.mark.parametrize("swing", [0.0, 0.4])
def test_a_bone_aligned_rest_takes_the_straightest_frame(swing: float) -> None:
    motion = dance(frames=40, swing=swing)
    rest, _ = rest_of(told(motion, bone_aligned(motion.figure)))
    assert rest.pose == "bone-aligned"
    # the dance begins at rest: no frame stands straighter
    expected = straight_figure().offsets
    assert any("frame 1," in sentence for sentence in rest.guessed)
    thigh = rest.positions[INDEX["l_knee"]] - rest.positions[INDEX["l_hip"]]
    np.testing.assert_allclose(rotation.rotate(rest.upright, thigh) * rest.scale, expected[INDEX["l_knee"]], atol=1e-5)


@given(turn=st.floats(-3.1, 3.1), tilt=st.sampled_from([(0, 0.0), (0, np.pi / 2), (0, -np.pi / 2), (2, np.pi / 2)]))
def test_the_body_is_turned_up_and_to_the_front_wherever_it_faces(turn: float, tilt: tuple[int, float]) -> None:
    lie = rotation.about_axis(tilt[0], np.array(tilt[1]))
    axes = rotation.multiply(lie, rotation.about_axis(1, np.array(turn)))
    rest, _ = rest_of(told(dance(frames=3, swing=0.2), pose_with_arms(90.0), axes))
    apart = rotation.multiply(rest.upright, axes)
    # within 10 degrees of an axis the axis is kept; else it is exact
    assert 2.0 * np.arccos(min(1.0, abs(float(apart[0])))) < np.radians(10.1)
    np.testing.assert_allclose(rotation.rotate(apart, UP), UP, atol=1e-6)


def test_a_motion_on_another_axis_than_its_rest_is_set_on_its_feet() -> None:
    motion = dance(frames=30, swing=0.2)
    source = bvh.read(told(motion))
    lie = rotation.about_axis(0, np.array(np.pi / 2))
    position, orientation = pose(source, list(range(18)), sample(source))
    position, orientation = rotation.rotate(lie, position), rotation.multiply(lie, orientation)
    rest = find_rest(source, dict(NAMED), sample(source), position, orientation)
    assert "The motion stands on another axis than the rest pose." in rest.guessed
    np.testing.assert_allclose(rotation.rotate(rest.world, np.array([0.0, 0.0, 1.0])), UP, atol=1e-9)


def lying() -> Motion:
    """A dance on its back, on the floor."""
    motion = dance(frames=30, swing=0.2)
    back = rotation.about_axis(0, np.array(-np.pi / 2))
    rotations = motion.rotations.copy()
    rotations[:, 0] = rotation.multiply(back, rotations[:, 0])
    return Motion(motion.figure, motion.fps, motion.root * [1.0, 0.1, 1.0], rotations)


def test_a_body_that_lies_is_left_lying() -> None:
    rest, _ = rest_of(told(lying()))
    np.testing.assert_allclose(rotation.rotate(rest.world, UP), UP, atol=1e-9)
    assert any("lies" in sentence for sentence in rest.guessed)


def sampled(motion: Motion) -> Array:
    source = bvh.read(told(motion))
    return pose(source, list(range(18)), sample(source))[0]


@pytest.mark.parametrize("crossed", [("shoulder", "elbow", "wrist"), ("hip", "knee", "ankle", "midtarsal")])
def test_arms_and_legs_named_crosswise_are_put_on_one_side(crossed: tuple[str, ...]) -> None:
    joints = dict(NAMED)
    for name in crossed:
        joints[f"l_{name}"], joints[f"r_{name}"] = joints[f"r_{name}"], joints[f"l_{name}"]
    found, said = sides(sampled(dance(frames=20)), joints)
    assert found == NAMED
    assert said


def test_sides_that_are_right_stay_and_the_mapping_given_is_not_changed() -> None:
    given = dict(NAMED)
    found, said = sides(sampled(dance(frames=20)), given)
    assert (found, said, given) == (NAMED, [], NAMED)


@pytest.mark.parametrize(("frames", "sampled_frames"), [(1, 1), (2, 2), (256, 256), (1000, 256)])
def test_sampled_frames_begin_and_end_with_the_clip(frames: int, sampled_frames: int) -> None:
    source = bvh.read(told(dance(frames=frames)))
    chosen = sample(source)
    assert len(chosen) == sampled_frames
    assert (chosen[0], chosen[-1]) == (0, frames - 1)
