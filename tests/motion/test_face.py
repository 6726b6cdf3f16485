from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.motion.face import AXIS_COUNT, EXPRESSION_INDEX, EXPRESSIONS, GAZE, TERMS, face_expressions, face_of
from bunraku.motion.mirror import mirror_face

EXCLUDED = [term[1] for terms in TERMS for term in terms if len(term) > 1]
names = st.lists(st.sampled_from([name for name in EXPRESSIONS if name not in EXCLUDED]), min_size=1, unique=True)


def test_arkit_and_vrm_are_complete() -> None:
    assert len(EXPRESSIONS) == len(set(EXPRESSIONS)) == 52 + 18 + len(GAZE)
    assert AXIS_COUNT == 64
    vrm = EXPRESSIONS[52:70]
    assert {"happy", "angry", "sad", "relaxed", "surprised", "neutral", "aa", "ih", "ou", "ee", "oh"} < set(vrm)
    assert {"blink", "blinkLeft", "blinkRight", "lookUp", "lookDown", "lookLeft", "lookRight"} < set(vrm)


@given(names, st.integers(0, 1000))
def test_expressions_that_do_not_exclude_each_other_round_trip(chosen: list[str], seed: int) -> None:
    weights = np.random.default_rng(seed).uniform(0.01, 1.0, (5, len(chosen)))
    face, values = face_of(dict(zip(chosen, weights.T, strict=True)))
    restored = face_expressions(face, values)
    np.testing.assert_allclose(restored[:, [EXPRESSION_INDEX[name] for name in chosen]], weights, atol=1e-12)
    assert set(chosen) <= set(face.names)
    others = [index for name, index in EXPRESSION_INDEX.items() if name not in chosen]
    assert np.abs(restored[:, others]).max() < 1e-12


def test_the_larger_of_two_opposites_remains() -> None:
    face, values = face_of({"jawLeft": np.array([0.7, 0.0]), "jawRight": np.array([0.2, 0.4])})
    restored = face_expressions(face, values)
    np.testing.assert_allclose(restored[:, EXPRESSION_INDEX["jawLeft"]], [0.5, 0.0])
    np.testing.assert_allclose(restored[:, EXPRESSION_INDEX["jawRight"]], [0.0, 0.4])


def test_equal_sides_take_one_axis() -> None:
    blink = np.array([0.0, 1.0])
    face, values = face_of({"eyeBlinkLeft": blink, "eyeBlinkRight": blink})
    assert len(face.axes) == 1
    assert values.shape == (2, 1, 3)


def test_weights_are_clipped_and_unknown_names_refused() -> None:
    face, values = face_of({"aa": np.array([-1.0, 7.0]), "gazeYaw": np.array([-9.0, 1.0])})
    restored = face_expressions(face, values)
    np.testing.assert_allclose(restored[:, EXPRESSION_INDEX["aa"]], [0.0, 1.0])
    np.testing.assert_allclose(restored[:, EXPRESSION_INDEX["gazeYaw"]], [-np.pi / 2, 1.0])
    with pytest.raises(KeyError):
        face_of({"wink": np.ones(2)})


@given(names, st.integers(0, 1000))
def test_mirrored_face_has_the_expressions_of_the_other_side(chosen: list[str], seed: int) -> None:
    weights = np.random.default_rng(seed).uniform(0.01, 1.0, (3, len(chosen)))
    face, values = face_of(dict(zip(chosen, weights.T, strict=True)))
    restored, image = face_expressions(face, values), face_expressions(*mirror_face(face, values))
    for name, index in EXPRESSION_INDEX.items():
        other = name.replace("Left", "_").replace("Right", "Left").replace("_", "Right")
        sign = -1.0 if name == "gazeYaw" else 1.0
        np.testing.assert_allclose(image[:, EXPRESSION_INDEX[other]], sign * restored[:, index], atol=1e-12)
