"""The golden scenes are what the code makes of them, and what is broken in them is refused."""

from __future__ import annotations

import base64
import json

import pytest

from bunraku.codec import coefficients
from bunraku.codec.coefficients import SCENE_CHANNELS
from bunraku.codec.errors import DamagedBlock
from bunraku.codec.prior import shipped
from bunraku.codec.scene import read_scene
from bunraku.codec.scene_decode import decode_scene
from tests.vectors import scene
from tests.vectors.test_golden import close, committed


def test_golden_scenes_are_what_the_code_makes_of_them() -> None:
    """As with the motion's blocks, another machine may choose other coefficients, but none reads them otherwise."""
    made, ours = json.loads(json.dumps(scene.make())), committed("scene.json")
    for new, old in zip(made["tracks"], ours["tracks"], strict=True):
        assert close(new | {"rates": []}, old | {"rates": []}), "run `make vectors` and look at the change"
    assert ours["invalid"] == made["invalid"]
    assert len(ours["valid"]) == len(made["valid"])
    tracks = [read_scene(track) for track in ours["tracks"]]
    for valid in ours["valid"]:
        track, data = tracks[valid["track"]], base64.b64decode(valid["block"])
        assert close(valid, json.loads(json.dumps(scene.vector(track, valid["track"], data))))
        head, q = coefficients.decode(shipped(), data, track.block_frames, track.fps, SCENE_CHANNELS)
        assert coefficients.encode(shipped(), head, q, track.block_frames, track.fps) == data


def test_broken_scenes_are_refused() -> None:
    vectors = committed("scene.json")
    track = read_scene(vectors["tracks"][0])
    for broken in vectors["invalid"]:
        with pytest.raises(DamagedBlock):
            decode_scene(track, base64.b64decode(broken["block"]))
