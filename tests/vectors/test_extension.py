from __future__ import annotations

import base64
import json

import numpy as np
import pytest

from bunraku.codec import coefficients
from bunraku.codec.errors import DamagedBlock
from bunraku.codec.extension.track import decode_extension_block
from bunraku.codec.prior import load_shipped_prior
from bunraku.motion.extension import extend_pose
from bunraku.motion.skeleton import Figure, world_transforms
from tests.vectors import extension
from tests.vectors.test_golden import close, committed


def test_golden_blocks_decode_as_recorded_and_encode_to_the_same_bytes() -> None:
    ours = committed("extension.json")
    tracks = [extension.load_track(track) for track in ours["tracks"]]
    for valid in ours["valid"]:
        track, data = tracks[valid["track"]], base64.b64decode(valid["block"])
        assert close(valid, json.loads(json.dumps(extension.block_vector(track, valid["track"], data))))
        header, q = coefficients.decode_coefficients(
            load_shipped_prior(), data, track.block_frames, track.fps, track.layout
        )
        timing = track.block_frames, track.fps
        assert coefficients.encode_coefficients(load_shipped_prior(), header, q, *timing, track.layout) == data


def test_golden_poses_are_extended_as_recorded() -> None:
    ours = committed("extension.json")
    tracks = [extension.load_track(track) for track in ours["tracks"]]
    assert [list(track.extension.names) for track in tracks] == [track["names"] for track in ours["tracks"]]
    for vector in ours["poses"]:
        figure = Figure(np.array(vector["offsets"]).reshape(18, 3), np.zeros((18, 3)))
        rotations = np.array(vector["rotations"]).reshape(1, 18, 4)
        placed = world_transforms(figure, np.array(vector["root"])[None], rotations)
        values = np.array(vector["values"]).reshape(1, -1, 3)
        pose = extend_pose(figure, tracks[vector["track"]].extension, *placed, values)
        for name in ("positions", "orientations", "extra_positions", "extra_orientations"):
            np.testing.assert_allclose(getattr(pose, name)[0].ravel(), vector[name], atol=1e-12)


def test_invalid_blocks_and_tracks_are_refused() -> None:
    ours = committed("extension.json")
    track = extension.load_track(ours["tracks"][0])
    for invalid in ours["invalid"]:
        with pytest.raises(DamagedBlock):
            decode_extension_block(track, base64.b64decode(invalid["block"]))
    for invalid in ours["invalid_tracks"]:
        with pytest.raises(DamagedBlock):
            extension.load_track(invalid["track"])


def test_vectors_are_made_by_their_generator() -> None:
    made, ours = json.loads(json.dumps(extension.make_vectors())), committed("extension.json")
    assert ours["invalid"] == made["invalid"]
    assert len(ours["valid"]) == len(made["valid"])
    assert len(ours["poses"]) == len(made["poses"])
