from __future__ import annotations

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.analysis import analyse
from bunraku.motion.readers import bvh
from bunraku.motion.skeleton import JOINT_COUNT
from bunraku.motion.source_motion import SampledMotion, SourceMotion, bone_lengths, chain_transforms
from tests.motion.synthetic_motion import export_bvh, smooth_motion


def sampled(source: SourceMotion) -> SampledMotion:
    positions, orientations = source.world_transforms(list(range(len(source.names))))
    return SampledMotion(
        source.names,
        source.parents,
        source.ends,
        source.fps,
        source.rest_positions,
        source.rest_orientations,
        positions,
        orientations,
    )


def test_sampled_motion_is_analysed_as_the_file_it_is_from() -> None:
    source = bvh.parse_bvh(export_bvh(smooth_motion(frames=20)))
    expected, analysis = analyse(source), analyse(sampled(source))
    np.testing.assert_array_equal(analysis.motion.rotations, expected.motion.rotations)
    assert (analysis.assumptions, analysis.unit) == (expected.assumptions, expected.unit)


def test_rest_orientations_do_not_matter() -> None:
    source = sampled(bvh.parse_bvh(export_bvh(smooth_motion(frames=20))))
    turns = rotation.normalise(np.random.default_rng(1).normal(size=(JOINT_COUNT, 4)))
    turned = SampledMotion(
        source.names,
        source.parents,
        (),
        source.fps,
        source.rest_positions,
        rotation.multiply(source.rest_orientations, turns),
        source.positions,
        rotation.multiply(source.orientations, turns),
    )
    made, expected = analyse(turned).motion, analyse(source).motion
    assert np.abs(np.sum(made.rotations * expected.rotations, axis=-1)).min() > 1.0 - 1e-9


def test_selected_frames_are_returned() -> None:
    source = sampled(bvh.parse_bvh(export_bvh(smooth_motion(frames=5))))
    positions, orientations = source.world_transforms([0], np.array([3, 1]))
    np.testing.assert_array_equal(positions, source.positions[[3, 1]])
    np.testing.assert_array_equal(orientations, source.orientations[[3, 1]])
    assert (source.frame_count, set(source.joint_lines)) == (5, {None})


def test_chained_transforms_turn_what_is_below() -> None:
    quarter = rotation.from_coordinate_axis(2, np.array(np.pi / 2))
    offsets, rotations = np.array([[1.0, 0.0, 0.0]] * 3), np.array([quarter] * 3)
    positions, orientations = chain_transforms([-1, 0, 1], offsets, rotations)
    np.testing.assert_allclose(positions, [[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]], atol=1e-12)
    np.testing.assert_allclose(orientations[1], [0.0, 0.0, 0.0, 1.0], atol=1e-12)


def test_bone_lengths_are_those_at_rest() -> None:
    source = bvh.parse_bvh(export_bvh(smooth_motion(frames=2)))
    expected = np.linalg.norm(source.offsets, axis=1)
    np.testing.assert_allclose(bone_lengths(source)[1:], expected[1:])
    assert bone_lengths(source)[0] == 0.0
