"""The golden files are what the code makes today, and what is broken in them is refused."""

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
from bunraku.wire.errors import MalformedMessage
from bunraku.wire.messages import unpack
from tests.vectors import blocks, golden


def close(a: Any, b: Any) -> bool:
    """Equal, numbers that are not whole to 1e-9, or that part of large ones: their last digits are the machine's."""
    if isinstance(a, dict):
        return isinstance(b, dict) and a.keys() == b.keys() and all(close(a[k], b[k]) for k in a)
    if isinstance(a, list):
        return isinstance(b, list) and len(a) == len(b) and all(map(close, a, b))
    if isinstance(a, float) and isinstance(b, float):
        return abs(a - b) <= 1e-9 * max(1.0, abs(a))
    return bool(a == b)


def committed(name: str) -> Any:
    return json.loads((golden.VECTORS_FOLDER / name).read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", sorted(set(golden.GENERATORS) - {"blocks.json", "scene.json"}))
def test_golden_files_are_what_the_code_makes(name: str) -> None:
    assert close(committed(name), json.loads(golden.render_files()[name])), (
        f"{name} differs: run `make vectors` and look at the change"
    )


def test_golden_blocks_are_what_the_code_makes_of_them() -> None:
    """The encoder weighs floating-point numbers, so another machine may choose other coefficients; what a block says is
    the same everywhere, and so are its bytes once the coefficients are chosen."""
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
        head, q = coefficients.decode_coefficients(load_shipped_prior(), data, track.block_frames, track.fps)
        assert coefficients.encode_coefficients(load_shipped_prior(), head, q, track.block_frames, track.fps) == data


def test_broken_blocks_are_refused() -> None:
    vectors = committed("blocks.json")
    head = vectors["tracks"][0]
    track = parse_motion_track({"codec": MOTION_CODEC, **head, "dancer": base64.b64decode(head["dancer"])})
    for broken in vectors["invalid"]:
        with pytest.raises(DamagedBlock):
            decode_motion_block(track, base64.b64decode(broken["block"]))


def test_broken_messages_are_refused_and_unknown_ones_skipped() -> None:
    vectors = committed("messages.json")
    for broken in vectors["invalid"]:
        with pytest.raises(MalformedMessage):
            unpack(base64.b64decode(broken["bytes"]))
    assert [unpack(base64.b64decode(data)) for data in vectors["skipped"]] == [None, None]


def test_messages_that_say_less_are_read() -> None:
    for older in committed("messages.json")["older"]:
        message = unpack(base64.b64decode(older["bytes"]))
        assert type(message).__name__ == older["name"]
        assert {name: getattr(message, name) for name in older["fields"]} == older["fields"]
