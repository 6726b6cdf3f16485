from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bunraku.motion import rotation
from bunraku.motion.analysis import analyse, fit_source
from bunraku.motion.hands import FINGERS, WRISTS, pose_hands
from bunraku.motion.hands_fit import USUAL_RATIO, fit_hands, measure_hands
from bunraku.motion.readers.bvh import parse_bvh
from bunraku.motion.source_motion import EndSite
from tests.motion.extended_source import extended_source, write_source_bvh
from tests.motion.hand_source import BONES_M, hand_source, standard_hands
from tests.motion.synthetic_motion import export_bvh, smooth_motion


@pytest.mark.parametrize("has_plain_axes", [True, False])
@pytest.mark.parametrize("bend", [0.0, 0.5])
@pytest.mark.parametrize("rest", ["T", "A", "I"])
def test_joints_coincide_with_those_of_the_source(rest: str, bend: float, has_plain_axes: bool) -> None:
    source = hand_source(60, rest=rest, bend=bend, fan=0.1, has_plain_axes=has_plain_axes)
    fit = fit_source(source).fit
    hands = fit_hands(fit)
    assert hands is not None
    assert hands.hands.counts == (3,) * 10
    assert [source.names[joint] for joint in hands.sources[:4]] == [
        *(f"LeftHandThumb{number}" for number in (1, 2, 3)),
        "LeftHandIndex1",
    ]
    wrists = fit.position[:, [fit.joints[wrist] for wrist in WRISTS]]
    apart = measure_hands(fit, hands, wrists)
    assert apart.shape == (60, 30 + 10)
    assert apart.max() < 1e-6


def test_joints_coincide_in_a_file_whose_bones_all_lie_along_one_axis() -> None:
    source = hand_source(90)
    aligned = replace(
        source,
        rest_orientations=np.tile(rotation.IDENTITY, (len(source.names), 1)),
        rest_positions=_lay_along_y(source.rest_positions, source.parents),
    )
    fit = fit_source(aligned).fit
    hands = fit_hands(fit)
    assert hands is not None
    # the file's own joints move apart if its rest is replaced: they keep their positions in the frames
    wrists = fit.position[:, [fit.joints[wrist] for wrist in WRISTS]]
    assert measure_hands(fit, hands, wrists).max() < 1e-6


def _lay_along_y(positions: np.ndarray, parents: tuple[int, ...]) -> np.ndarray:
    laid = np.zeros_like(positions)
    for joint, parent in enumerate(parents):
        if parent >= 0:
            laid[joint] = laid[parent] + [0.0, np.linalg.norm(positions[joint] - positions[parent]), 0.0]
    return laid


def test_figure_has_the_bones_of_the_source() -> None:
    hands = analyse(hand_source()).hands
    assert hands is not None
    expected = standard_hands()
    np.testing.assert_allclose(hands.hands.lengths, expected.lengths, atol=1e-9)
    np.testing.assert_allclose(hands.hands.bases, expected.bases, atol=0.005)


def test_straight_fingers_have_no_rotation() -> None:
    source = hand_source(60)
    frames = np.concatenate([[0], np.arange(60)])
    positions, orientations = source.positions[frames], source.orientations[frames]
    hand_joints = [joint for joint, name in enumerate(source.names) if "Hand" in name and name[-1].isdigit()]
    for joint in hand_joints:
        parent = source.parents[joint]
        offset = source.rest_positions[joint] - source.rest_positions[parent]
        positions[0, joint] = positions[0, parent] + rotation.rotate(orientations[0, parent], offset)
        orientations[0, joint] = orientations[0, parent]
    hands = analyse(replace(source, positions=positions, orientations=orientations)).hands
    assert hands is not None
    fingers = [index for index, (chain, _) in enumerate(hands.hands.joints) if chain % len(FINGERS)]
    later = [index for index in fingers if hands.hands.joints[index][1] > 0]
    assert np.abs(hands.values[0, later]).max() < 1e-9
    # the hand hangs from wrist to middle finger, so that the others deviate by their places only
    assert np.abs(hands.values[0, fingers]).max() < 0.1


def test_bend_of_fingers_does_not_depend_on_the_rest_pose() -> None:
    straight, bent = (analyse(hand_source(60, bend=bend, rest="T")).hands for bend in (0.0, 0.5))
    assert straight is not None
    assert bent is not None
    joints = [index for index, (chain, place) in enumerate(straight.hands.joints) if place and chain % len(FINGERS)]
    turns = [rotation.from_rotation_vector(each.values[:, joints]) for each in (straight, bent)]
    apart = rotation.to_rotation_vector(rotation.multiply(rotation.conjugate(turns[0]), turns[1]))
    assert np.linalg.norm(apart, axis=-1).max() < 0.05


def test_values_are_continuous() -> None:
    hands = analyse(hand_source(240, bend=0.3)).hands
    assert hands is not None
    assert np.abs(np.diff(hands.values, axis=0)).max() < 0.6


def test_analysis_measures_joints_on_the_extended_figure() -> None:
    analysis = analyse(hand_source())
    assert analysis.extension is not None
    assert analysis.hands is not None
    assert analysis.hands_mean_error_mm < 1.0
    assert analysis.hands_max_error_mm < 15.0


def test_fingers_change_nothing_else() -> None:
    body, whole = analyse(extended_source()), analyse(hand_source(fingers=()))
    assert whole.hands is None
    with_fingers = analyse(hand_source())
    np.testing.assert_array_equal(whole.motion.root, with_fingers.motion.root)
    wrist_joints = list(WRISTS)
    others = [joint for joint in range(18) if joint not in wrist_joints]
    np.testing.assert_array_equal(whole.motion.rotations[:, others], with_fingers.motion.rotations[:, others])
    np.testing.assert_allclose(body.motion.root, whole.motion.root, atol=1e-12)


def test_still_fingers_are_left_out() -> None:
    assert analyse(hand_source(moves=False)).hands is None


def test_source_without_fingers_has_no_hands() -> None:
    assert analyse(parse_bvh(export_bvh(smooth_motion()))).hands is None


def test_metacarpals_are_no_finger_joints() -> None:
    source = hand_source(has_metacarpals=True)
    hands = analyse(source).hands
    assert hands is not None
    assert hands.hands.counts == (3,) * 10
    assert not any("InHand" in source.names[joint] for joint in hands.sources)


def test_last_bone_without_an_end_has_a_usual_length() -> None:
    hands = analyse(hand_source(has_tips=False)).hands
    assert hands is not None
    assert hands.hands.lengths[1, 2] == pytest.approx(USUAL_RATIO * BONES_M["index"][1])


def test_end_site_gives_the_length_of_the_last_bone() -> None:
    source = hand_source(has_tips=False)
    ends = tuple(
        EndSite(joint, np.array([0.018 if name.startswith("Left") else -0.018, 0.0, 0.0]))
        for joint, name in enumerate(source.names)
        if name.endswith("3")
    )
    hands = analyse(replace(source, ends=ends)).hands
    assert hands is not None
    assert hands.hands.lengths[1, 2] == pytest.approx(0.018)


def test_finger_with_bones_of_metres_is_left_out() -> None:
    source = hand_source()
    far = source.positions.copy()
    far[:, source.names.index("LeftHandIndex2")] += 3.0
    hands = analyse(replace(source, positions=far)).hands
    assert hands is not None
    assert hands.hands.counts == (3, 0, 3, 3, 3, 3, 3, 3, 3, 3)


def test_calibration_frame_is_dropped_from_fingers() -> None:
    source = hand_source(60)
    frames = np.concatenate([[0], np.arange(60)])
    positions, orientations = source.positions[frames], source.orientations[frames]
    positions[0] = source.rest_positions + np.array([0.0, 5.0, 0.0])
    orientations[0] = source.rest_orientations
    arms = [joint for joint, name in enumerate(source.names) if "Arm" in name or "Hand" in name]
    positions[0, arms] += [0.0, 1.0, 0.0]
    analysis = analyse(replace(source, positions=positions, orientations=orientations))
    assert any("first frame" in each for each in analysis.assumptions)
    assert analysis.hands is not None
    assert len(analysis.hands.values) == analysis.motion.frame_count == 60


def test_fingers_survive_a_bvh_file() -> None:
    analysis = analyse(parse_bvh(write_source_bvh(hand_source(30))))
    assert analysis.hands is not None
    assert analysis.hands.hands.counts == (3,) * 10
    assert analysis.hands_mean_error_mm < 1.0


def test_pose_without_joints_has_its_tips_at_the_wrist() -> None:
    hands = analyse(hand_source(fingers=("index",))).hands
    assert hands is not None
    assert hands.hands.counts == (0, 3, 0, 0, 0, 0, 3, 0, 0, 0)
    still = np.zeros((1, 2, 3)), np.tile(rotation.IDENTITY, (1, 2, 1))
    assert not pose_hands(hands.hands, *still, hands.values[:1]).tips[0, 0].any()
