from __future__ import annotations

import base64
import json

import numpy as np
import pytest

from bunraku.codec.errors import DamagedBlock
from bunraku.codec.extension.track import decode_extension_block
from bunraku.motion.face import EXPRESSIONS, Face, face_expressions
from bunraku.motion.hands import Hands, pose_hands
from tests.vectors import hands_face
from tests.vectors.extension import block_vector
from tests.vectors.test_golden import close, committed

OURS = committed("hands_face.json")
TRACKS = [hands_face.load_track(track) for track in OURS["tracks"]]


@pytest.mark.parametrize("valid", OURS["valid"])
def test_golden_block_decodes_as_recorded(valid: dict[str, object]) -> None:
    number = valid["track"]
    assert isinstance(number, int)
    data = base64.b64decode(str(valid["block"]))
    assert close(valid, json.loads(json.dumps(block_vector(TRACKS[number], number, data))))


def test_golden_fingers_are_posed_as_recorded() -> None:
    for vector in OURS["hands"]:
        hands = TRACKS[vector["track"]].extension
        assert isinstance(hands, Hands)
        places = np.array(vector["wrist_positions"]).reshape(1, 2, 3)
        turns = np.array(vector["wrist_orientations"]).reshape(1, 2, 4)
        pose = pose_hands(hands, places, turns, np.array(vector["values"]).reshape(1, -1, 3))
        np.testing.assert_allclose(pose.positions.ravel(), vector["positions"], atol=1e-12)
        np.testing.assert_allclose(pose.orientations.ravel(), vector["orientations"], atol=1e-12)


def test_golden_faces_have_the_recorded_expressions() -> None:
    assert OURS["expressions"] == list(EXPRESSIONS)
    for vector in OURS["faces"]:
        face = TRACKS[vector["track"]].extension
        assert isinstance(face, Face)
        weights = face_expressions(face, np.array(vector["values"]).reshape(1, -1, 3))
        np.testing.assert_allclose(weights[0], vector["weights"], atol=1e-12)


@pytest.mark.parametrize("invalid", OURS["invalid"], ids=lambda invalid: invalid["why"])
def test_invalid_block_is_refused(invalid: dict[str, str]) -> None:
    with pytest.raises(DamagedBlock):
        decode_extension_block(TRACKS[0], base64.b64decode(invalid["block"]))


@pytest.mark.parametrize("invalid", OURS["invalid_tracks"], ids=lambda invalid: invalid["why"])
def test_invalid_description_is_refused(invalid: dict[str, dict[str, object]]) -> None:
    with pytest.raises(DamagedBlock):
        hands_face.load_track(invalid["track"])


def test_vectors_are_made_by_their_generator() -> None:
    made = json.loads(json.dumps(hands_face.make_vectors()))
    assert OURS["invalid"] == made["invalid"]
    assert len(OURS["valid"]) == len(made["valid"])
