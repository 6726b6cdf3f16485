from __future__ import annotations

import base64
import json
from typing import Any

import pytest

from bunraku.codec.errors import DamagedBlock
from bunraku.codec.extension.props import decode_prop_block, pack_prop_block, shift_limb
from bunraku.motion.readers.gltf_file import parse_gltf_file
from bunraku.playout.block_store import PropBlockStore
from tests.vectors import props
from tests.vectors.test_golden import committed

OURS = committed("props.json")
TRACKS = [props.load_track(track) for track in OURS["tracks"]]


def _unpack(vector: dict[str, Any]) -> bytes:
    return base64.b64decode(vector["block"])


def test_golden_blocks_decode_as_recorded_and_encode_to_the_same_bytes() -> None:
    for vector in OURS["valid"]:
        track, data = TRACKS[vector["track"]], _unpack(vector)
        assert props.block_vector(track, vector["track"], vector["index"], data) == vector
        states = decode_prop_block(data, len(track.kinds), vector["frames"]).states
        assert pack_prop_block(states) == data


def test_golden_positions_have_the_recorded_states() -> None:
    stores = [PropBlockStore(track) for track in TRACKS]
    for vector in OURS["valid"]:
        stores[vector["track"]].put_encoded(vector["index"], 0, _unpack(vector))
    for vector in OURS["positions"]:
        track = TRACKS[vector["track"]]
        found = stores[vector["track"]].states_at(vector["position"])
        assert found is not None
        assert [props.state_values(shift_limb(state, track.performer)) for state in found] == vector["states"]


def test_golden_models_have_the_recorded_values() -> None:
    for vector in OURS["models"]:
        file = parse_gltf_file(base64.b64decode(vector["model"]))
        (primitive,) = file.item("meshes", 0)["primitives"]
        accessors = primitive["attributes"]
        for name, accessor, width in (
            ("positions", accessors["POSITION"], 3),
            ("normals", accessors["NORMAL"], 3),
            ("colours", accessors["COLOR_0"], 4),
            ("finishes", accessors["_FINISH"], 4),
            ("indices", primitive["indices"], 1),
        ):
            values = file.read_accessor(accessor, width)[:, :3]
            assert values.reshape(-1) == pytest.approx(vector[name], abs=1e-9)
        form = file.item("nodes", 0)["extras"]
        assert form == {key: vector[key] for key in ("pitch", "height", "palmOffset")}


def test_invalid_blocks_and_tracks_are_refused() -> None:
    for invalid in OURS["invalid"]:
        with pytest.raises(DamagedBlock):
            decode_prop_block(_unpack(invalid), len(TRACKS[0].kinds), TRACKS[0].frames_in(invalid["index"]))
    for invalid in OURS["invalid_tracks"]:
        with pytest.raises(DamagedBlock):
            props.load_track(invalid["track"])


def test_vectors_are_made_by_their_generator() -> None:
    assert json.loads(json.dumps(props.make_vectors())) == OURS
