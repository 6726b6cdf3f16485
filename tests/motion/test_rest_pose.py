from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.motion import rotation
from bunraku.motion.naming.name_mapping import SHAPE_PROFILE, JointMapping
from bunraku.motion.readers import bvh
from bunraku.motion.rest_pose import METRES_PER_UNIT, RestPose, find_rest_pose, resolve_sides, sample_frames
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_INDEX, JOINTS, Motion
from tests.motion.synthetic_motion import bone_aligned, export_bvh, pose_with_arms, smooth_motion, straight_figure

JOINTS_BY_NAME = dict(JOINT_INDEX)
UP: Array = np.array([0.0, 1.0, 0.0])


def rest_pose_of(data: bytes) -> tuple[RestPose, bvh.Bvh]:
    source = bvh.parse_bvh(data)
    frames = sample_frames(source)
    position, orientation = source.world_transforms(list(range(len(source.names))), frames)
    return find_rest_pose(source, dict(JOINTS_BY_NAME), frames, position, orientation), source


@pytest.mark.parametrize(
    ("unit", "per_metre"),
    [("m", 1.0), ("cm", 100.0), ("mm", 1000.0), ("inch", 1 / 0.0254), ("CMU unit (0.45 scaled inch)", 0.45 / 0.0254)],
)
def test_units(unit: str, per_metre: float) -> None:
    rest, _ = rest_pose_of(export_bvh(smooth_motion(frames=5), units_per_metre=per_metre))
    assert rest.unit == unit
    assert rest.scale == METRES_PER_UNIT[unit] == pytest.approx(1.0 / per_metre)


@pytest.mark.parametrize(("per_metre", "unit"), [(0.7, "m"), (1.4, "m"), (70.0, "cm"), (140.0, "cm")])
def test_child_and_giant_have_the_same_unit(per_metre: float, unit: str) -> None:
    rest, _ = rest_pose_of(export_bvh(smooth_motion(frames=5), units_per_metre=per_metre))
    assert rest.unit == unit


@pytest.mark.parametrize(
    ("degrees", "name"), [(0, "I"), (15, "I"), (30, "A"), (45, "A"), (60, "A"), (75, "T"), (90, "T"), (140, "other")]
)
def test_rest_poses(degrees: int, name: str) -> None:
    rest, _ = rest_pose_of(export_bvh(smooth_motion(frames=5), pose_with_arms(degrees)))
    assert rest.pose == name
    assert any("neither T, A nor I" in sentence for sentence in rest.assumptions) == (name == "other")
    np.testing.assert_allclose(np.abs(rest.rest_to_figure @ rotation.IDENTITY), 1.0)


def test_arms_pointing_forwards_are_an_other_pose() -> None:
    at_rest = pose_with_arms(0.0)
    for name in JOINTS[12:]:
        at_rest[JOINT_INDEX[name]] = rotation.from_coordinate_axis(0, np.array(-np.pi / 2))
    rest, _ = rest_pose_of(export_bvh(smooth_motion(frames=5), at_rest))
    assert rest.pose == "other"


@pytest.mark.parametrize("swing", [0.0, 0.4])
def test_bone_aligned_rest_uses_the_straightest_frame(swing: float) -> None:
    motion = smooth_motion(frames=40, swing=swing)
    rest, _ = rest_pose_of(export_bvh(motion, bone_aligned(motion.figure)))
    assert rest.pose == "bone-aligned"
    # the dance begins at rest: no frame stands straighter
    expected = straight_figure().offsets
    assert any("frame 1," in sentence for sentence in rest.assumptions)
    thigh = rest.positions[JOINT_INDEX["l_knee"]] - rest.positions[JOINT_INDEX["l_hip"]]
    np.testing.assert_allclose(
        rotation.rotate(rest.rest_to_figure, thigh) * rest.scale, expected[JOINT_INDEX["l_knee"]], atol=1e-5
    )


@given(turn=st.floats(-3.1, 3.1), tilt=st.sampled_from([(0, 0.0), (0, np.pi / 2), (0, -np.pi / 2), (2, np.pi / 2)]))
def test_body_is_rotated_upright_and_to_the_front(turn: float, tilt: tuple[int, float]) -> None:
    lie = rotation.from_coordinate_axis(tilt[0], np.array(tilt[1]))
    axes = rotation.multiply(lie, rotation.from_coordinate_axis(1, np.array(turn)))
    rest, _ = rest_pose_of(export_bvh(smooth_motion(frames=3, swing=0.2), pose_with_arms(90.0), axes))
    apart = rotation.multiply(rest.rest_to_figure, axes)
    # within 10 degrees of an axis the axis is kept; else it is exact
    assert 2.0 * np.arccos(min(1.0, abs(float(apart[0])))) < np.radians(10.1)
    np.testing.assert_allclose(rotation.rotate(apart, UP), UP, atol=1e-6)


def test_motion_on_another_axis_than_its_rest_is_rotated() -> None:
    motion = smooth_motion(frames=30, swing=0.2)
    source = bvh.parse_bvh(export_bvh(motion))
    lie = rotation.from_coordinate_axis(0, np.array(np.pi / 2))
    position, orientation = source.world_transforms(list(range(18)), sample_frames(source))
    position, orientation = rotation.rotate(lie, position), rotation.multiply(lie, orientation)
    rest = find_rest_pose(source, dict(JOINTS_BY_NAME), sample_frames(source), position, orientation)
    assert "The motion stands on another axis than the rest pose." in rest.assumptions
    np.testing.assert_allclose(rotation.rotate(rest.motion_to_figure, np.array([0.0, 0.0, 1.0])), UP, atol=1e-9)


def lying_motion() -> Motion:
    """A dance on its back, on the floor."""
    motion = smooth_motion(frames=30, swing=0.2)
    back = rotation.from_coordinate_axis(0, np.array(-np.pi / 2))
    rotations = motion.rotations.copy()
    rotations[:, 0] = rotation.multiply(back, rotations[:, 0])
    return Motion(motion.figure, motion.fps, motion.root * [1.0, 0.1, 1.0], rotations)


def test_lying_body_stays_lying() -> None:
    rest, _ = rest_pose_of(export_bvh(lying_motion()))
    np.testing.assert_allclose(rotation.rotate(rest.motion_to_figure, UP), UP, atol=1e-9)
    assert any("lies" in sentence for sentence in rest.assumptions)


def sampled_positions(motion: Motion) -> Array:
    source = bvh.parse_bvh(export_bvh(motion))
    return source.world_transforms(list(range(18)), sample_frames(source))[0]


@pytest.mark.parametrize("profile", ["VRM", SHAPE_PROFILE])
@pytest.mark.parametrize("crossed", [("shoulder", "elbow", "wrist"), ("hip", "knee", "ankle", "midtarsal")])
def test_crossed_arms_and_legs_are_put_on_one_side(crossed: tuple[str, ...], profile: str) -> None:
    joints = dict(JOINTS_BY_NAME)
    for name in crossed:
        joints[f"l_{name}"], joints[f"r_{name}"] = joints[f"r_{name}"], joints[f"l_{name}"]
    found, said = resolve_sides(sampled_positions(smooth_motion(frames=20)), JointMapping(profile, joints))
    assert found == JOINTS_BY_NAME
    assert said


def test_named_sides_stay_without_the_evidence_of_feet() -> None:
    position = sampled_positions(smooth_motion(frames=20))
    other = {"l_": "r_", "r_": "l_"}
    swapped = {other.get(name[:2], name[:2]) + name[2:]: at for name, at in JOINTS_BY_NAME.items()}
    footless = {name: at for name, at in swapped.items() if not name.endswith(("midtarsal", "ankle"))}
    assert resolve_sides(position, JointMapping("VRM", footless)) == (footless, [])
    found, said = resolve_sides(position, JointMapping("VRM", swapped))
    assert (found, len(said)) == (JOINTS_BY_NAME, 1)


def test_correct_sides_stay_and_the_input_is_unchanged() -> None:
    given = dict(JOINTS_BY_NAME)
    found, said = resolve_sides(sampled_positions(smooth_motion(frames=20)), JointMapping("VRM", given))
    assert (found, said, given) == (JOINTS_BY_NAME, [], JOINTS_BY_NAME)


@pytest.mark.parametrize(("frames", "sampled_frames"), [(1, 1), (2, 2), (256, 256), (1000, 256)])
def test_sampled_frames_include_first_and_last(frames: int, sampled_frames: int) -> None:
    source = bvh.parse_bvh(export_bvh(smooth_motion(frames=frames)))
    chosen = sample_frames(source)
    assert len(chosen) == sampled_frames
    assert (chosen[0], chosen[-1]) == (0, frames - 1)
