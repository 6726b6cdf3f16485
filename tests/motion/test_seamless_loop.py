from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bunraku.motion import rotation
from bunraku.motion.rotation import Array
from bunraku.motion.seamless_loop import BLEND_S, MAX_DRIFT_M, close_loop, close_value_loop
from bunraku.motion.skeleton import JOINT_COUNT, Motion, joint_and_tip_positions, standard_figure
from tests.vectors.blocks import random_motion

FPS = 60.0


def smooth_motion(seconds: float, seed: int, travel_m_per_s: float = 0.0) -> Motion:
    """Return a random motion on the spot, or one that also travels along x."""
    motion = random_motion(seconds, FPS, seed)
    root = motion.root * [0.02, 0.1, 0.02]
    root[:, 0] += np.arange(len(root)) / FPS * travel_m_per_s
    return Motion(motion.figure, FPS, root, motion.rotations)


def positions_of(motion: Motion) -> Array:
    return joint_and_tip_positions(motion.figure, motion.root, motion.rotations)


def velocity_jump(points: Array, travel: Array) -> float:
    """Return the largest change of velocity at the seam, in metres per second, with the travel taken out."""
    into = points[0] + travel - points[-1]
    return float(np.linalg.norm(into - (points[1] - points[0]), axis=-1).max() * FPS)


def largest_velocity_change(points: Array) -> float:
    """Return the largest change of velocity between two frames, in metres per second."""
    return float(np.linalg.norm(np.diff(points, 2, axis=0), axis=-1).max() * FPS)


@given(st.integers(0, 10_000), st.integers(0, 60), st.integers(40, 58), st.sampled_from([0.0, 1.4]))
@settings(deadline=None, max_examples=60)
def test_seam_has_no_jump_in_position_or_velocity(seed: int, first: int, count: int, speed: float) -> None:
    motion, end = smooth_motion(2.0, seed, speed), first + count
    closed = close_loop(motion, first, end)
    assert closed.frame_count == count
    travel = motion.root[end] - motion.root[first]
    travel[1] = 0.0
    if np.hypot(travel[0], travel[2]) <= MAX_DRIFT_M:
        travel[:] = 0.0
    points, source = positions_of(closed), positions_of(motion)
    # about what the motion itself does from one frame to the next
    step = np.linalg.norm(np.diff(source, axis=0), axis=-1).max()
    assert np.linalg.norm(points[0] + travel - points[-1], axis=-1).max() < 1.2 * step
    assert velocity_jump(points, travel) < 1.5 * largest_velocity_change(source)


@given(st.integers(0, 10_000))
@settings(deadline=None, max_examples=30)
def test_frames_before_the_blend_are_those_of_the_motion(seed: int) -> None:
    motion = smooth_motion(3.0, seed)
    closed = close_loop(motion, 40, 150)
    kept = 110 - round(BLEND_S * FPS)
    np.testing.assert_array_equal(closed.root[:kept], motion.root[40 : 40 + kept])
    np.testing.assert_array_equal(closed.rotations[:kept], motion.rotations[40 : 40 + kept])
    np.testing.assert_allclose(np.linalg.norm(closed.rotations, axis=-1), 1.0, atol=1e-9)


def test_travel_is_kept_and_drift_is_led_back() -> None:
    walk = smooth_motion(3.0, 5, travel_m_per_s=1.0)
    closed = close_loop(walk, 30, 150)
    travelled = walk.root[150] - walk.root[30]
    assert closed.root[-1][0] - closed.root[0][0] == pytest.approx(travelled[0] * 119 / 120, abs=0.02)
    drift = smooth_motion(3.0, 5, travel_m_per_s=0.1)
    closed = close_loop(drift, 30, 150)
    assert abs(closed.root[-1][0] - closed.root[0][0]) < 0.01


def test_turning_figure_keeps_its_direction_of_turning_in_the_blend() -> None:
    frames = np.arange(180)
    rotations = np.tile(rotation.IDENTITY, (180, JOINT_COUNT, 1))
    # a turn of 200 degrees: the shorter way from the end to the start changes within the blend
    rotations[:, 0] = rotation.from_coordinate_axis(1, np.radians(200.0) * frames / 120)
    motion = Motion(standard_figure(), FPS, np.zeros((180, 3)), rotations)
    closed = close_loop(motion, 40, 160)
    step = rotation.to_rotation_vector(
        rotation.multiply(rotation.conjugate(closed.rotations[:-1, 0]), closed.rotations[1:, 0])
    )
    assert np.abs(np.diff(step[:, 1])).max() < np.radians(3.0)


@pytest.mark.parametrize(("first", "end"), [(0, 1), (0, 2), (0, 3), (2, 5), (4, 5)])
def test_short_part_is_closed_with_a_short_blend(first: int, end: int) -> None:
    motion = smooth_motion(5 / FPS, 3)
    closed = close_loop(motion, first, end)
    assert closed.frame_count == end - first
    assert np.isfinite(closed.rotations).all()


def test_still_motion_stays_still() -> None:
    still = Motion(standard_figure(), FPS, np.ones((90, 3)), np.tile(rotation.IDENTITY, (90, JOINT_COUNT, 1)))
    closed = close_loop(still, 0, 90)
    np.testing.assert_allclose(closed.root, still.root, atol=1e-12)
    np.testing.assert_allclose(closed.rotations, still.rotations, atol=1e-12)


def test_single_frame_is_closed() -> None:
    single = Motion(standard_figure(), FPS, np.ones((1, 3)), np.tile(rotation.IDENTITY, (1, JOINT_COUNT, 1)))
    assert close_loop(single, 0, 1).frame_count == 1


def test_values_of_a_loop_meet_their_start() -> None:
    t = np.arange(120)[:, None, None] / 30.0
    values = np.sin(t * [[1.0, 2.0, 3.0]]) + t
    part = close_value_loop(values, 40, 100, 30.0)
    np.testing.assert_array_equal(part[:40], values[40:80])
    jump = np.abs(part[0] - part[-1]).max()
    assert jump < 2 * np.abs(np.diff(values, axis=0)).max()
    assert np.isfinite(close_value_loop(values, 0, 60, 30.0)).all()
