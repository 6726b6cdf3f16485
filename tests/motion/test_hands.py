from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from bunraku.motion import rotation
from bunraku.motion.hands import CHAIN_COUNT, HANIM_NAMES, VRM_NAMES, Hands, pose_hands
from bunraku.motion.mirror import mirror_hands, mirror_vectors
from tests.vectors.hands_face import make_hands

counts = st.tuples(*[st.integers(0, 3)] * CHAIN_COUNT).filter(any)
WRISTS = np.array([[[0.3, 1.2, 0.1], [-0.3, 1.2, 0.1]]])
STILL = np.tile(rotation.IDENTITY, (1, 2, 1))


def test_names_are_those_of_hanim_and_vrm() -> None:
    assert HANIM_NAMES[0] == ("l_carpometacarpal_1", "l_metacarpophalangeal_1", "l_carpal_interphalangeal_1")
    assert HANIM_NAMES[6][1] == "r_carpal_proximal_interphalangeal_2"
    assert VRM_NAMES[0] == ("leftThumbMetacarpal", "leftThumbProximal", "leftThumbDistal")
    assert VRM_NAMES[9] == ("rightLittleProximal", "rightLittleIntermediate", "rightLittleDistal")


@given(counts)
def test_fingers_at_rest_hang_below_the_wrist(numbers: tuple[int, ...]) -> None:
    hands, _ = make_hands(1, numbers)
    pose = pose_hands(hands, WRISTS, STILL, np.zeros((1, len(hands.joints), 3)))
    assert len(hands.names) == len(set(hands.names)) == sum(numbers)
    for joint, (chain, place) in enumerate(hands.joints):
        if place:
            down = pose.positions[0, joint - 1] - pose.positions[0, joint]
            assert np.isclose(np.linalg.norm(down), hands.lengths[chain, place - 1])
            assert down[1] > 0.7 * np.linalg.norm(down)
    assert np.allclose(pose.orientations, rotation.IDENTITY)


@given(counts, st.integers(0, 1000))
def test_bones_keep_their_lengths(numbers: tuple[int, ...], seed: int) -> None:
    hands, values = make_hands(seed, numbers, 4)
    pose = pose_hands(hands, np.repeat(WRISTS, 4, 0), np.repeat(STILL, 4, 0), values)
    for joint, (chain, place) in enumerate(hands.joints):
        last = place + 1 == numbers[chain]
        end = pose.tips[:, chain] if last else pose.positions[:, joint + 1]
        length = np.linalg.norm(end - pose.positions[:, joint], axis=-1)
        assert np.allclose(length, hands.lengths[chain, place])


@given(counts, st.integers(0, 1000))
def test_mirrored_fingers_are_at_mirrored_places(numbers: tuple[int, ...], seed: int) -> None:
    hands, values = make_hands(seed, numbers, 2)
    mirrored, opposite = mirror_hands(hands, values)
    wrists = np.repeat(WRISTS, 2, 0)
    pose = pose_hands(hands, wrists, np.repeat(STILL, 2, 0), values)
    image = pose_hands(mirrored, mirror_vectors(wrists)[:, ::-1], np.repeat(STILL, 2, 0), opposite)
    places = {name: pose.positions[:, joint] for joint, name in enumerate(hands.names)}
    for joint, name in enumerate(mirrored.names):
        other = ("r" if name.startswith("l") else "l") + name[1:]
        np.testing.assert_allclose(image.positions[:, joint], mirror_vectors(places[other]), atol=1e-12)
    again, same = mirror_hands(mirrored, opposite)
    assert again.counts == hands.counts
    np.testing.assert_allclose(same, values)


def test_a_hand_without_fingers_has_tips_at_the_wrist() -> None:
    hands = Hands((0,) * 9 + (1,), np.zeros((10, 3)), np.zeros((10, 3)))
    pose = pose_hands(hands, WRISTS, STILL, np.zeros((1, 1, 3)))
    np.testing.assert_allclose(pose.tips[0, 0], WRISTS[0, 0])
