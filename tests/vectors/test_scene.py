"""Golden scene blocks decode as recorded, and invalid ones are refused."""

from __future__ import annotations

import base64
import json

import pytest

from bunraku.codec import coefficients
from bunraku.codec.channel_layout import SCENE_LAYOUT
from bunraku.codec.errors import DamagedBlock
from bunraku.codec.prior import load_shipped_prior
from bunraku.codec.scene import parse_scene_track
from bunraku.codec.scene_decoder import decode_scene_block
from tests.vectors import scene
from tests.vectors.test_golden import close, committed


def test_golden_scene_blocks_decode_as_recorded_and_encode_to_the_same_bytes() -> None:
    """Check decoded values and re-encoding only, as for motion blocks."""
    made, ours = json.loads(json.dumps(scene.make_vectors())), committed("scene.json")
    for new, old in zip(made["tracks"], ours["tracks"], strict=True):
        assert close(new | {"rates": []}, old | {"rates": []}), "run `make vectors` and review the change"
    assert ours["invalid"] == made["invalid"]
    assert len(ours["valid"]) == len(made["valid"])
    tracks = [parse_scene_track(track) for track in ours["tracks"]]
    for valid in ours["valid"]:
        track, data = tracks[valid["track"]], base64.b64decode(valid["block"])
        assert close(valid, json.loads(json.dumps(scene.block_vector(track, valid["track"], data))))
        header, q = coefficients.decode_coefficients(
            load_shipped_prior(), data, track.block_frames, track.fps, SCENE_LAYOUT
        )
        timing = track.block_frames, track.fps
        assert coefficients.encode_coefficients(load_shipped_prior(), header, q, *timing, SCENE_LAYOUT) == data


def test_invalid_scene_blocks_are_refused() -> None:
    vectors = committed("scene.json")
    track = parse_scene_track(vectors["tracks"][0])
    for invalid in vectors["invalid"]:
        with pytest.raises(DamagedBlock):
            decode_scene_block(track, base64.b64decode(invalid["block"]))
