"""The golden scenes are what the code makes of them, and what is broken in them is refused."""

from __future__ import annotations

import base64
import json

import pytest

from bunraku.codec import coefficients
from bunraku.codec.errors import DamagedBlock
from bunraku.codec.prior import SCENE_CHANNEL_COUNT, load_shipped_prior
from bunraku.codec.scene import parse_scene_track
from bunraku.codec.scene_decoder import decode_scene_block
from tests.vectors import scene
from tests.vectors.test_golden import close, committed


def test_golden_scenes_are_what_the_code_makes_of_them() -> None:
    """As with the motion's blocks, another machine may choose other coefficients, but none reads them otherwise."""
    made, ours = json.loads(json.dumps(scene.make_vectors())), committed("scene.json")
    for new, old in zip(made["tracks"], ours["tracks"], strict=True):
        assert close(new | {"rates": []}, old | {"rates": []}), "run `make vectors` and look at the change"
    assert ours["invalid"] == made["invalid"]
    assert len(ours["valid"]) == len(made["valid"])
    tracks = [parse_scene_track(track) for track in ours["tracks"]]
    for valid in ours["valid"]:
        track, data = tracks[valid["track"]], base64.b64decode(valid["block"])
        assert close(valid, json.loads(json.dumps(scene.block_vector(track, valid["track"], data))))
        head, q = coefficients.decode_coefficients(
            load_shipped_prior(), data, track.block_frames, track.fps, SCENE_CHANNEL_COUNT
        )
        assert coefficients.encode_coefficients(load_shipped_prior(), head, q, track.block_frames, track.fps) == data


def test_broken_scenes_are_refused() -> None:
    vectors = committed("scene.json")
    track = parse_scene_track(vectors["tracks"][0])
    for broken in vectors["invalid"]:
        with pytest.raises(DamagedBlock):
            decode_scene_block(track, base64.b64decode(broken["block"]))
