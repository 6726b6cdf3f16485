from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from bunraku.motion import rotation
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_INDEX, joint_and_tip_positions, standard_figure
from examples.robot.joints import HINGE_COUNT, HINGES, LOWER, UPPER
from examples.robot.targets import (
    LOWER_TARGETS,
    MAX_SPEED,
    UPPER_TARGETS,
    TargetFinder,
    angles_to_rotations,
    compose_hinges,
    decompose_hinges,
)

SEEDS = st.integers(0, 2**32 - 1)
ELBOWS_AND_KNEES = [
    nth for nth, hinge in enumerate(HINGES) if hinge.axis == 0 and hinge.joint in
    [JOINT_INDEX[side + name] for side in ("l_", "r_") for name in ("elbow", "knee")]
]  # fmt: skip


def bent_angles(seed: int) -> Array:
    """Return random angles within the ranges of the targets, elbows and knees bent by at least 20 degrees."""
    angles: Array = np.random.default_rng(seed).uniform(LOWER_TARGETS, UPPER_TARGETS)
    # beyond a right angle, the second hinge has another solution
    angles = np.where([hinge.axis == 1 for hinge in HINGES], np.clip(angles, -1.5, 1.5), angles)
    for nth in ELBOWS_AND_KNEES:
        angles[nth] = np.copysign(max(abs(angles[nth]), 0.35), LOWER[nth] + UPPER[nth])
    return angles


def places(rotations: Array) -> Array:
    return joint_and_tip_positions(standard_figure(), np.zeros(3), rotations)


@given(SEEDS)
def test_angles_of_a_composed_rotation_are_found(seed: int) -> None:
    a, b, c = np.random.default_rng(seed).uniform([-3.1, -1.5, -3.1], [3.1, 1.5, 3.1])
    assert np.allclose(decompose_hinges(compose_hinges(a, b, c)), [a, b, c], atol=1e-9)


@given(SEEDS)
def test_pose_within_the_ranges_is_reached(seed: int) -> None:
    rotations = angles_to_rotations(bent_angles(seed))
    found = angles_to_rotations(TargetFinder().update(rotations, 0.0))
    assert np.allclose(places(found), places(rotations), atol=1e-3)


@settings(max_examples=25)
@given(SEEDS, st.floats(-0.8, 0.8))
def test_elbow_that_bends_sideways_is_reached_by_twisting_the_upper_arm(seed: int, twist: float) -> None:
    angles = bent_angles(seed) * 0.4
    angles[ELBOWS_AND_KNEES] *= 2.5
    rotations = angles_to_rotations(angles)
    wanted = places(rotations)
    upper, lower = JOINT_INDEX["l_shoulder"], JOINT_INDEX["l_elbow"]
    turn = rotation.from_coordinate_axis(1, np.array(twist))
    rotations[upper] = rotation.multiply(rotations[upper], turn)
    rotations[lower] = rotation.multiply(rotation.conjugate(turn), rotations[lower])
    finder = TargetFinder()
    for _ in range(40):
        # the speed is limited, and the bending plane is a weighted mean with the last one
        found = finder.update(rotations, 0.1)
    assert np.allclose(places(angles_to_rotations(found)), wanted, atol=1e-3)


@given(SEEDS)
def test_any_pose_gives_targets_within_the_ranges_at_limited_speed(seed: int) -> None:
    generator, finder, last = np.random.default_rng(seed), TargetFinder(), None
    for _ in range(5):
        targets = finder.update(rotation.normalise(generator.normal(size=(18, 4))), 1 / 60)
        assert (targets >= LOWER_TARGETS - 1e-12).all()
        assert (targets <= UPPER_TARGETS + 1e-12).all()
        if last is not None:
            assert np.abs(targets - last).max() <= MAX_SPEED / 60 + 1e-12
        last = targets


def test_pose_that_is_not_finite_keeps_the_targets() -> None:
    finder = TargetFinder()
    targets = finder.update(angles_to_rotations(bent_angles(1)), 0.0)
    assert np.array_equal(finder.update(np.full((18, 4), np.nan), 0.1), targets)


def test_sides_are_mirror_images() -> None:
    assert HINGE_COUNT == 32
    left = sorted((hinge.axis, hinge.lower, hinge.upper) for hinge in HINGES if hinge.joint == JOINT_INDEX["l_hip"])
    right = sorted((hinge.axis, hinge.lower, hinge.upper) for hinge in HINGES if hinge.joint == JOINT_INDEX["r_hip"])
    assert [(a, -u, -low) if a else (a, low, u) for a, low, u in left] == right
