from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bunraku.motion import rotation
from bunraku.motion.analysis import analyse
from bunraku.motion.contact.foot_contact import (
    MAX_DRIFT_M,
    MIN_CONTACT_S,
    MIN_GAP_S,
    BoolArray,
    detect_contacts,
)
from bunraku.motion.mirror import mirror_motion
from bunraku.motion.readers.bvh import parse_bvh
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_COUNT, JOINT_INDEX, Figure, Motion, world_transforms
from tests.motion.synthetic_motion import smooth_motion, stepping_motion, straight_figure

BALLS = [JOINT_INDEX["l_midtarsal"], JOINT_INDEX["r_midtarsal"]]
FPS = 60.0


def carried(root: Array, fps: float = FPS, figure: Figure | None = None) -> Motion:
    """Return a figure at rest whose root, and so both feet, moves by `root` (n, 3)."""
    figure = figure or straight_figure()
    still = np.tile(rotation.IDENTITY, (len(root), JOINT_COUNT, 1))
    return Motion(figure, fps, figure.offsets[0] + root, still)


def wandering(seed: int, frames: int, fps: float) -> Motion:
    """Return a figure whose feet stop, slide, hop and jitter at random."""
    random = np.random.default_rng(seed)
    count = max(int(frames / fps * 3), 2)
    times, knots = np.sort(random.uniform(0, frames, count)), random.normal(0, 0.15, (count, 3))
    repeated = np.repeat(knots, 2, axis=0)[1:]
    at = np.sort(np.concatenate([times, random.uniform(0, frames, count - 1)]))
    root = np.stack([np.interp(np.arange(frames), at, repeated[:, axis]) for axis in range(3)], axis=1)
    root[:, 1] = np.abs(root[:, 1])
    return carried(root + random.normal(0, 1e-3, root.shape), fps)


def runs(foot: BoolArray) -> list[tuple[int, int]]:
    """Return the first frame of each contact of a foot, and the frame after its last."""
    ends = np.flatnonzero(np.diff(np.concatenate([[False], foot, [False]])))
    return list(zip(ends[::2].tolist(), ends[1::2].tolist(), strict=True))


def test_standing_feet_are_planted() -> None:
    assert detect_contacts(carried(np.zeros((60, 3)))).all()
    assert detect_contacts(carried(np.zeros((1, 3)), fps=5.0)).shape == (1, 2)


def test_moving_feet_are_not_planted() -> None:
    assert not detect_contacts(carried(np.linspace(0, 1, 60)[:, None] * [1.0, 0.0, 0.0])).any()


def test_foot_in_the_air_is_not_planted_even_if_it_rests() -> None:
    height = np.concatenate([np.zeros(60), np.full(60, 0.2)])[:, None] * [0.0, 1.0, 0.0]
    planted = detect_contacts(carried(height))
    assert planted[:55].all()
    assert not planted[65:].any()


def test_one_raised_foot_is_told_from_the_other() -> None:
    planted = detect_contacts(stepping_motion(120, FPS))
    assert planted[:, 0].all()
    assert runs(planted[:, 1]) == [(0, pytest.approx(42, abs=3)), (pytest.approx(78, abs=4), 120)]


def test_slow_slide_ends_a_contact() -> None:
    planted = detect_contacts(carried(np.linspace(0, 0.3, 180)[:, None] * [0.0, 0.0, 1.0]))[:, 0]
    assert all((end - begin) / FPS * 0.1 <= MAX_DRIFT_M + 1e-3 for begin, end in runs(planted))
    assert 2 < len(runs(planted)) < 8


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10**6), st.integers(2, 400), st.sampled_from([24.0, 30.0, 60.0, 120.0]))
def test_contacts_rest_last_and_lie_apart(seed: int, frames: int, fps: float) -> None:
    motion = wandering(seed, frames, fps)
    planted = detect_contacts(motion)
    assert planted.shape == (frames, 2)
    placed, _ = world_transforms(motion.figure, motion.root, motion.rotations)
    for foot, joint in enumerate(BALLS):
        found = runs(planted[:, foot])
        for begin, end in found:
            way = placed[begin:end, joint][:, [0, 2]] - placed[begin, joint, [0, 2]]
            assert np.hypot(*way.T).max() <= MAX_DRIFT_M + 1e-9
            assert end - begin >= round(MIN_CONTACT_S * fps)
        for (_, end), (begin, _) in pairwise(found):
            assert begin - end >= round(MIN_GAP_S * fps)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10**6), st.floats(-3.0, 3.0), st.floats(0.3, 3.0), st.tuples(*[st.floats(-5.0, 5.0)] * 3))
def test_contacts_do_not_depend_on_place_direction_and_size(
    seed: int, turn: float, scale: float, moved: tuple[float, float, float]
) -> None:
    motion = wandering(seed, 200, FPS)
    turned = rotation.from_coordinate_axis(1, np.array(turn))
    rotations = motion.rotations.copy()
    rotations[:, 0] = rotation.multiply(turned, rotations[:, 0])
    root = scale * rotation.rotate(turned, motion.root) + np.array(moved)
    figure = Figure(scale * motion.figure.offsets, scale * motion.figure.tips)
    same = detect_contacts(Motion(figure, FPS, root, rotations)) == detect_contacts(motion)
    # a value at a threshold may be rounded to its other side
    assert same.mean() > 0.98


@given(st.integers(0, 10**6))
@settings(max_examples=10, deadline=None)
def test_mirror_image_exchanges_the_feet(seed: int) -> None:
    motion = smooth_motion(120, seed)
    np.testing.assert_array_equal(detect_contacts(mirror_motion(motion)), detect_contacts(motion)[:, ::-1])


def test_noise_of_a_capture_does_not_make_contacts_flicker() -> None:
    random = np.random.default_rng(1)
    steps = np.repeat([0.0, 0.5, 1.0], 100)[:, None] * [0.0, 0.0, 1.0]
    clean, noisy = (
        detect_contacts(carried(steps + random.normal(0, sigma, steps.shape), 120.0)) for sigma in (0.0, 0.002)
    )
    assert len(runs(noisy[:, 0])) == len(runs(clean[:, 0])) == 3
    assert np.abs(noisy.astype(int) - clean.astype(int)).sum() <= 8


@pytest.mark.parametrize("name", ["cmu_12_01_walk", "mass_walk"])
def test_recorded_walk_has_a_foot_on_the_floor_and_steps_in_turn(shared: Path, name: str) -> None:
    motion = analyse(parse_bvh((shared / "mocap" / "bvh" / f"{name}.bvh").read_bytes())).motion
    planted = detect_contacts(motion)
    assert 0.25 < planted.mean() < 0.7
    begins = sorted((begin, foot) for foot in (0, 1) for begin, _ in runs(planted[:, foot]))
    feet = [foot for _, foot in begins]
    assert feet == [(feet[0] + nth) % 2 for nth in range(len(feet))]
