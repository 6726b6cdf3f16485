"""The committed vectors are those that the code makes, and invalid data in them is refused."""

from __future__ import annotations

import base64
import json
from typing import Any

import pytest

from bunraku.codec import coefficients
from bunraku.codec.errors import DamagedBlock
from bunraku.codec.motion_decoder import decode_motion_block
from bunraku.codec.motion_track import MOTION_CODEC, parse_motion_track
from bunraku.codec.prior import load_shipped_prior
from bunraku.codec.skeleton_description import SkeletonDescription
from bunraku.wire.errors import MalformedMessage
from bunraku.wire.messages import unpack
from tests.vectors import blocks, golden, live
from tests.vectors.messages import to_json


def close(a: Any, b: Any) -> bool:
    """Compare JSON values; numbers with a fraction to 1e-9, absolute or relative, as their last digits vary."""
    if isinstance(a, dict):
        return isinstance(b, dict) and a.keys() == b.keys() and all(close(a[k], b[k]) for k in a)
    if isinstance(a, list):
        return isinstance(b, list) and len(a) == len(b) and all(map(close, a, b))
    if isinstance(a, float) and isinstance(b, float):
        return abs(a - b) <= 1e-9 * max(1.0, abs(a))
    return bool(a == b)


def committed(name: str) -> Any:
    """Return the content of a committed vector file."""
    return json.loads((golden.VECTORS_FOLDER / name).read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", sorted(set(golden.GENERATORS) - {"blocks.json", "scene.json", "extension.json"}))
def test_golden_file_is_what_the_code_makes(name: str) -> None:
    assert close(committed(name), json.loads(golden.render_vectors(name))), (
        f"{name} differs: run `make vectors` and review the change"
    )


def test_asyncapi_document_matches_the_declarations() -> None:
    assert golden.ASYNCAPI_FILE.read_text(encoding="utf-8") == golden.render_asyncapi(), "run `make vectors`"


def test_names_of_fingers_and_expressions_match_the_readers() -> None:
    text = golden.HAND_FACE_NAMES_FILE.read_text(encoding="utf-8")
    assert text == golden.render_hand_face_names(), "run `make vectors`"


def test_joint_names_match_the_profiles() -> None:
    assert golden.JOINT_NAMES_FILE.read_text(encoding="utf-8") == golden.render_joint_names(), "run `make vectors`"


def test_typescript_message_types_match_the_declarations() -> None:
    assert golden.TYPESCRIPT_FILE.read_text(encoding="utf-8") == golden.render_typescript(), "run `make vectors`"


def test_golden_blocks_decode_as_recorded_and_encode_to_the_same_bytes() -> None:
    """Check decoded values and re-encoding only: the encoder's choice of coefficients uses floating point, so it varies
    between machines."""
    made, ours = blocks.make_vectors(), committed("blocks.json")
    assert close(ours["tracks"], json.loads(json.dumps(made["tracks"])))
    assert ours["invalid"] == made["invalid"]
    assert len(ours["valid"]) == len(made["valid"])
    tracks = [
        parse_motion_track({"codec": MOTION_CODEC, **t, "dancer": base64.b64decode(t["dancer"])})
        for t in ours["tracks"]
    ]
    for valid in ours["valid"]:
        track, data = tracks[valid["track"]], base64.b64decode(valid["block"])
        assert close(valid, json.loads(json.dumps(blocks.block_vector(track, valid["track"], data))))
        header, q = coefficients.decode_coefficients(load_shipped_prior(), data, track.block_frames, track.fps)
        assert coefficients.encode_coefficients(load_shipped_prior(), header, q, track.block_frames, track.fps) == data


def test_invalid_blocks_are_refused() -> None:
    vectors = committed("blocks.json")
    entry = vectors["tracks"][0]
    track = parse_motion_track({"codec": MOTION_CODEC, **entry, "dancer": base64.b64decode(entry["dancer"])})
    for invalid in vectors["invalid"]:
        with pytest.raises(DamagedBlock):
            decode_motion_block(track, base64.b64decode(invalid["block"]))


def test_invalid_live_blocks_are_refused() -> None:
    vectors = committed("live.json")
    track = live.make_live_track(base64.b64decode(vectors["dancer"]))
    for invalid in vectors["invalid"]:
        with pytest.raises(DamagedBlock):
            track.decode(invalid["frames"], base64.b64decode(invalid["block"]))


def test_invalid_skeleton_descriptions_are_refused() -> None:
    for invalid in committed("skeletons.json")["invalid"]:
        with pytest.raises(DamagedBlock):
            SkeletonDescription.unpack(base64.b64decode(invalid["dancer"]))


def test_traced_block_and_skeleton_equal_the_decoder() -> None:
    vectors = committed("trace.json")
    block, skeleton = vectors["block"], vectors["skeleton"]
    header, q = coefficients.decode_coefficients(
        load_shipped_prior(), base64.b64decode(block["block"]), block["block_frames"], block["fps"]
    )
    assert (header.frames, header.step, header.heading) == (block["frames"], block["step"], block["heading"])
    assert q.ravel().tolist() == block["q"]
    # the block reaches low bits, an escape and both signs
    assert max(each["h"] for each in block["coefficients"]) > 0
    assert max(map(abs, block["q"])) > 1_000
    unpacked = SkeletonDescription.unpack(base64.b64decode(skeleton["dancer"]))
    values = [number["value"] for number in skeleton["numbers"]]
    assert unpacked.reference.ravel().tolist() == values[-54:]
    unit = 1e-4 * 2.0 ** skeleton["grid"]
    assert close(unpacked.figure.offsets.ravel().tolist(), [value * unit for value in values[:54]])


def test_invalid_messages_are_refused_and_unknown_types_skipped() -> None:
    vectors = committed("messages.json")
    for invalid in vectors["invalid"]:
        with pytest.raises(MalformedMessage):
            unpack(base64.b64decode(invalid["bytes"]))
    assert [unpack(base64.b64decode(data)) for data in vectors["skipped"]] == [None, None]


@pytest.mark.parametrize("kind", ["older", "tolerated"])
def test_older_and_tolerated_messages_are_decoded(kind: str) -> None:
    for vector in committed("messages.json")[kind]:
        message = unpack(base64.b64decode(vector["bytes"]))
        assert type(message).__name__ == vector["name"]
        for name, value in vector["fields"].items():
            assert close(json.loads(json.dumps(to_json(getattr(message, name)))), value)
