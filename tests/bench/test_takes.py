from __future__ import annotations

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.face import face_of
from bunraku.motion.hands import pose_hands
from tests.bench.takes import FACE_NOISE, face_take, hands_take


def test_takes_repeat_and_differ_by_seed() -> None:
    np.testing.assert_array_equal(hands_take(2.0)[1], hands_take(2.0)[1])
    assert np.abs(hands_take(4.0)[1] - hands_take(4.0, seed=1)[1]).max() > 0.1
    one, same, other = face_take(2.0), face_take(2.0), face_take(2.0, seed=1)
    assert all((one[name] == same[name]).all() for name in one)
    assert any((one[name] != other[name]).any() for name in one)


def test_fingers_bend_towards_the_palm() -> None:
    hands, values = hands_take(10.0)
    assert values.shape == (600, 30, 3)
    wrists = np.zeros((600, 2, 3)), np.tile(rotation.IDENTITY, (600, 2, 1))
    tips = pose_hands(hands, *wrists, values).tips
    # palms face the body: the left hand's to -x, the right hand's to x
    assert tips[:, 1:5, 0].mean() < -0.02
    assert tips[:, 6:, 0].mean() > 0.02
    assert np.abs(np.diff(values, axis=0)).max() < 0.4


def test_face_has_all_expressions_of_arkit_in_their_range() -> None:
    take = face_take(60.0)
    assert len(take) == 52
    face, values = face_of(take)
    assert len(values) == 3600
    assert len(face.axes) > 40
    assert all(weights.min() >= 0.0 and weights.max() <= 1.0 for weights in take.values())
    used = [name for name, weights in take.items() if weights.max() > 10 * FACE_NOISE]
    assert {"jawOpen", "mouthSmileLeft", "eyeBlinkRight", "eyeLookInLeft", "browDownRight"} <= set(used)
    assert np.abs(take["mouthSmileLeft"] - take["mouthSmileRight"]).max() > 0.02
