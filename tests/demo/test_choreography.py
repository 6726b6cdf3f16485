"""Requirements on the demo dance, measured on the generated motion."""

import numpy as np
import numpy.typing as npt
import pytest

from bunraku.demo import choreography, footwork, mass
from bunraku.demo.score import SIDES, Side, Step
from bunraku.motion import rotation, skeleton
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_INDEX, JOINTS, Motion

Mask = npt.NDArray[np.bool_]
SCORE = choreography.SCORE
FPS = 60.0
SOLE_HALF_WIDTH_M = 0.038
"""Half the breadth of a foot, metres; a sole runs from its heel to its toe tips."""


@pytest.fixture(scope="module")
def motion() -> Motion:
    return choreography.animate_dance(FPS)


@pytest.fixture(scope="module")
def points(motion: Motion) -> Array:
    return skeleton.joint_and_tip_positions(motion.figure, motion.root, motion.rotations)


@pytest.fixture(scope="module")
def orientation(motion: Motion) -> Array:
    return skeleton.world_transforms(motion.figure, motion.root, motion.rotations)[1]


@pytest.fixture(scope="module")
def beat(motion: Motion) -> Array:
    return np.arange(motion.frame_count) / FPS / SCORE.seconds_per_beat


def is_airborne(beat: Array) -> Mask:
    up: Mask = np.any([(hop.takeoff_beat < beat) & (beat < hop.beat) for hop in SCORE.hops], axis=0)
    return up


def is_planted(beat: Array, side: Side) -> Mask:
    """Frames in which the score has this foot on the floor (n,)."""
    swings = [(f.takeoff_beat < beat) & (beat < f.beat) for f in SCORE.list_footfalls() if side in f.targets]
    down: Mask = ~np.any(swings, axis=0)
    return down


def sole_points(points: Array, orientation: Array, side: Side) -> Array:
    """The four corners of a sole in the world (n, 4, 3)."""
    ankle = JOINT_INDEX[f"{side[0]}_ankle"]
    toes = 0.1104 + 0.07
    corners = [
        (x, -0.0796, z) for x in (-SOLE_HALF_WIDTH_M, SOLE_HALF_WIDTH_M) for z in (-footwork.HEEL_OFFSET_M, toes)
    ]
    turned = [rotation.rotate(orientation[:, ankle], np.array(corner)) for corner in corners]
    return points[:, ankle, None] + np.stack(turned, axis=1)


def angular_speed(motion: Motion) -> Array:
    """Angular velocities (n, 18, 3) of the joints from each frame to the next and round, radians a second."""
    q = motion.rotations
    return rotation.to_rotation_vector(rotation.multiply(rotation.conjugate(q), np.roll(q, -1, axis=0))) * FPS


def joint_flexion(motion: Motion, joint: str) -> Array:
    """The turn about x (n,), degrees, of a joint that turns about nothing else."""
    vector = rotation.to_rotation_vector(motion.rotations[:, JOINT_INDEX[joint]])
    assert np.allclose(vector[:, 1:], 0.0, rtol=0, atol=1e-9)
    return np.degrees(vector[:, 0])


def test_motion_lasts_its_beats(motion: Motion) -> None:
    assert motion.duration == SCORE.duration == 30.0
    assert choreography.BEAT_COUNT % choreography.BEATS_PER_PHRASE == 0


@pytest.mark.parametrize("side", SIDES)
def test_planted_foot_does_not_slide(points: Array, beat: Array, side: Side) -> None:
    down = is_planted(beat, side)
    edges = np.flatnonzero(np.diff(down.astype(int))) + 1
    stands = [stand for stand in np.split(np.arange(len(down)), edges) if down[stand[0]]]
    assert len(stands) > 10
    for stand in stands:
        for joint in (f"{side[0]}_ankle", f"{side[0]}_midtarsal"):
            assert np.ptp(points[stand, JOINT_INDEX[joint]], axis=0).max() < 0.002


@pytest.mark.parametrize("side", SIDES)
def test_foot_on_the_floor_is_planted(points: Array, beat: Array, side: Side) -> None:
    # seen from the motion alone: where ankle and toes are both at their height of standing, nothing moves
    ankle, midtarsal = JOINT_INDEX[f"{side[0]}_ankle"], JOINT_INDEX[f"{side[0]}_midtarsal"]
    low = np.all(np.abs(points[:, [ankle, midtarsal], 1] - [0.0656, 0.0001]) < 1e-4, axis=1)
    both = low[1:] & low[:-1]
    assert np.abs(np.diff(points[:, ankle], axis=0)[both]).max() < 0.002
    assert np.all(low[is_planted(beat, side)])


def test_no_foot_goes_through_the_floor(points: Array, orientation: Array) -> None:
    for side in SIDES:
        corners = sole_points(points, orientation, side)
        heels = corners[:, [0, 2], 1]
        toes = points[
            :, [JOINT_INDEX[f"{side[0]}_midtarsal"], mass.LEFT_TOES if side == "left" else mass.RIGHT_TOES], 1
        ]
        assert heels.min() > footwork.FLOOR_HEIGHT_M - 0.005
        # the bones of the toes run 14 mm above the sole
        assert toes.min() - 0.0141 > footwork.FLOOR_HEIGHT_M - 0.005


def test_one_foot_is_down_except_in_hops(points: Array, beat: Array) -> None:
    ankles = points[:, [JOINT_INDEX["l_ankle"], JOINT_INDEX["r_ankle"]], 1]
    floating = np.all(ankles > 0.0656 + 0.001, axis=1)
    assert np.all(is_airborne(beat)[floating])
    assert floating.sum() > 20
    assert len(SCORE.hops) == 3


def test_weight_is_over_the_planted_feet(points: Array, orientation: Array, beat: Array) -> None:
    centre = mass.centre_of_mass(points)[:, [0, 2]]
    down = {side: is_planted(beat, side) for side in SIDES}
    angle = np.linspace(0.0, 2.0 * np.pi, 72, endpoint=False)
    ways = np.stack([np.cos(angle), np.sin(angle)])
    farthest = np.full((len(beat), 72), -np.inf)
    for side in SIDES:
        corners = np.max(sole_points(points, orientation, side)[..., [0, 2]] @ ways, axis=1)
        farthest[down[side]] = np.maximum(farthest[down[side]], corners[down[side]])
    standing = down["left"] | down["right"]
    outside = (centre @ ways - farthest)[standing].max(axis=1)
    assert standing.sum() + is_airborne(beat).sum() == len(beat)
    # inside the hull of the soles, by some millimetres at least
    assert outside.max() < -0.002


def test_knees_and_elbows_bend_the_right_way(motion: Motion) -> None:
    for joint in ("l_knee", "r_knee"):
        bend = joint_flexion(motion, joint)
        assert bend.min() > 0.0
        assert 60.0 < bend.max() < 150.0
    for joint in ("l_elbow", "r_elbow"):
        bend = -joint_flexion(motion, joint)
        assert bend.min() >= 0.0
        assert 60.0 < bend.max() < 150.0


def test_joint_speeds_are_bounded(motion: Motion) -> None:
    speed = angular_speed(motion)
    fastest = np.linalg.norm(speed, axis=-1).max(axis=0)
    assert fastest.max() < 12.0, JOINTS[int(np.argmax(fastest))]
    jerked = np.linalg.norm(np.diff(speed, axis=0, append=speed[:1]), axis=-1).max(axis=0) * FPS
    assert jerked.max() < 550.0, JOINTS[int(np.argmax(jerked))]


def test_the_hips_move_smoothly(motion: Motion) -> None:
    speed = np.diff(motion.root, axis=0, append=motion.root[:1]) * FPS
    assert np.abs(speed).max() < 1.5
    assert np.abs(np.diff(speed, axis=0)).max() * FPS < 25.0


def test_motion_loops(points: Array) -> None:
    assert np.linalg.norm(points[0] - points[-1], axis=-1).max() < 0.002
    seam, before = points[0] - points[-1], points[-1] - points[-2]
    assert np.linalg.norm(seam - before, axis=-1).max() < 0.0005


def test_motion_stays_on_stage_and_faces_the_audience(motion: Motion, points: Array, orientation: Array) -> None:
    ankles = points[:, [JOINT_INDEX["l_ankle"], JOINT_INDEX["r_ankle"]]]
    assert np.linalg.norm(motion.root[:, [0, 2]], axis=-1).max() < 0.6
    assert np.linalg.norm(ankles[..., [0, 2]], axis=-1).max() < 0.6
    ahead = rotation.rotate(orientation[:, 0], np.array([0.0, 0.0, 1.0]))
    assert np.mean(ahead[:, 2] > 0.5) > 0.75


def test_motion_turns_in_place_and_around_the_stage(orientation: Array, motion: Motion, beat: Array) -> None:
    ahead = rotation.rotate(orientation[:, 0], np.array([0.0, 0.0, 1.0]))
    facing = np.degrees(np.unwrap(np.arctan2(ahead[:, 0], ahead[:, 2])))

    def between(first: float, last: float) -> tuple[float, float]:
        part = (first <= beat) & (beat <= last)
        return float(facing[part][-1] - facing[part][0]), float(np.ptp(motion.root[part][:, [0, 2]], axis=0).max())

    left, near = between(24.0, 32.5)
    right, far = between(35.0, 42.0)
    assert left == pytest.approx(360.0, abs=8.0)
    assert near < 0.25
    assert right == pytest.approx(-360.0, abs=8.0)
    assert far > 0.35
    assert facing[-1] == pytest.approx(facing[0], abs=1.0)


def test_arms_spread_rise_and_cross(points: Array, orientation: Array) -> None:
    left, right = points[:, mass.LEFT_HAND], points[:, mass.RIGHT_HAND]
    assert np.linalg.norm(left - right, axis=-1).max() > 1.6
    crown = points[:, mass.CROWN, 1]
    assert np.max(np.minimum(left[:, 1], right[:, 1]) - crown) > 0.15
    chest = JOINT_INDEX["vl5"]
    way = rotation.rotate(rotation.conjugate(orientation[:, chest]), left - right)
    assert way[:, 0].min() < -0.15


def test_hands_pass_through_neither_body_nor_each_other(points: Array, orientation: Array) -> None:
    chest = JOINT_INDEX["vl5"]
    along = np.linspace(0.0, 1.0, 7)[:, None, None]
    lines = []
    for side, tip in (("l", mass.LEFT_HAND), ("r", mass.RIGHT_HAND)):
        elbow, wrist, hand = (
            points[:, JOINT_INDEX[f"{side}_elbow"]],
            points[:, JOINT_INDEX[f"{side}_wrist"]],
            points[:, tip],
        )
        line = np.concatenate([elbow + along * (wrist - elbow), wrist + along * (hand - wrist)])
        lines.append(line)
        local = rotation.rotate(rotation.conjugate(orientation[:, chest]), line - points[:, chest])
        # the bodice is an oval of 154 by 116 mm half axes about 40 mm before vl5
        beside = (local[..., 0] / 0.154) ** 2 + ((local[..., 2] - 0.04) / 0.116) ** 2
        assert beside[(local[..., 1] > -0.05) & (local[..., 1] < 0.4)].min() > 1.2
        skull = 0.5 * (points[:, JOINT_INDEX["skullbase"]] + points[:, mass.CROWN])
        assert np.linalg.norm(line - skull, axis=-1).min() > 0.13
    gap = np.linalg.norm(lines[0][:, None] - lines[1][None], axis=-1)
    assert gap.min() > 0.08


def test_the_feet_pass_without_touching(points: Array) -> None:
    between = np.linalg.norm(points[:, JOINT_INDEX["l_ankle"]] - points[:, JOINT_INDEX["r_ankle"]], axis=-1)
    assert between.min() > 2.0 * 0.035


def test_steps_are_on_half_beats_and_stamps_on_beats() -> None:
    halves = np.array(choreography.footfall_times()) * 2.0 * choreography.BEATS_PER_MINUTE / 60.0
    assert len(halves) == len(SCORE.steps) + 3
    assert np.allclose(halves, np.round(halves), rtol=0, atol=1e-9)
    beats = np.array(choreography.stamp_times()) * choreography.BEATS_PER_MINUTE / 60.0
    assert np.allclose(beats, np.round(beats), rtol=0, atol=1e-9)
    assert len(beats) >= 8


def test_foot_lands_on_its_beat(points: Array) -> None:
    for step in SCORE.steps:
        height = points[:, JOINT_INDEX[f"{step.side[0]}_ankle"], 1]
        landing = step.beat * SCORE.seconds_per_beat * FPS
        assert height[round(landing) + 1] == pytest.approx(0.0656, abs=1e-4)
        assert height[int(landing - 0.06 * FPS)] > 0.0656 + 0.001


def test_mie_raises_the_knee_and_holds_the_pose(points: Array, beat: Array) -> None:
    raised = [footfall for footfall in SCORE.list_footfalls() if isinstance(footfall, Step) and footfall.lift > 0.2]
    assert len(raised) == 2
    for step in raised:
        letter = step.side[0]
        rise = (step.takeoff_beat < beat) & (beat < step.beat)
        other = "r" if letter == "l" else "l"
        lift = points[rise][:, JOINT_INDEX[f"{letter}_knee"], 1] - points[rise][:, JOINT_INDEX[f"{other}_knee"], 1]
        assert lift.max() > 0.1
        held = (step.beat + 0.65 < beat) & (beat < step.beat + 1.4)
        hands = points[held][:, [mass.LEFT_HAND, mass.RIGHT_HAND]]
        assert np.ptp(hands, axis=0).max() < 0.04


def test_motion_starts_and_ends_with_a_bow(points: Array, beat: Array) -> None:
    for first, last, depth in ((0.0, 3.0, 0.06), (45.0, 48.0, 0.15)):
        part = (first <= beat) & (beat < last)
        assert points[0, mass.CROWN, 1] - points[part, mass.CROWN, 1].min() > depth
    assert points[-1, mass.CROWN, 1] == pytest.approx(points[0, mass.CROWN, 1], abs=0.003)


@pytest.mark.parametrize("fps", [24.0, 120.0])
def test_motion_is_independent_of_frame_rate(motion: Motion, fps: float) -> None:
    other = choreography.animate_dance(fps)
    assert other.frame_count == 30 * fps
    common = int(np.gcd(int(fps), int(FPS)))
    ours, theirs = motion.root[:: int(FPS) // common], other.root[:: int(fps) // common]
    assert np.allclose(ours, theirs, rtol=0, atol=1e-9)
