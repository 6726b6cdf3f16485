"""The golden files are what the code makes today, and what is broken in them is refused."""

from __future__ import annotations

import base64
import json
from typing import Any

import pytest

from bunraku.codec.decode import decode_block
from bunraku.codec.errors import DamagedBlock
from bunraku.codec.track import CODEC, read_track
from bunraku.wire.messages import MalformedMessage, unpack
from tests.vectors import golden


def close(a: Any, b: Any) -> bool:
    """Equal, numbers that are not whole to 1e-9: their last digits are the machine's."""
    if isinstance(a, dict):
        return isinstance(b, dict) and a.keys() == b.keys() and all(close(a[k], b[k]) for k in a)
    if isinstance(a, list):
        return isinstance(b, list) and len(a) == len(b) and all(map(close, a, b))
    if isinstance(a, float) and isinstance(b, float):
        return abs(a - b) <= 1e-9
    return bool(a == b)


@pytest.mark.parametrize("name", golden.MAKERS)
def test_golden_files_are_what_the_code_makes(name: str) -> None:
    committed = json.loads((golden.FOLDER / name).read_text(encoding="utf-8"))
    assert close(committed, json.loads(golden.files()[name])), (
        f"{name} differs: run `make vectors` and look at the change"
    )


def test_broken_blocks_are_refused() -> None:
    vectors = json.loads((golden.FOLDER / "blocks.json").read_text(encoding="utf-8"))
    head = vectors["tracks"][0]
    described = head | {key: base64.b64decode(head[key]) for key in ("figure", "reference")}
    track = read_track({"codec": CODEC, **described})
    for broken in vectors["invalid"]:
        with pytest.raises(DamagedBlock):
            decode_block(track, base64.b64decode(broken["block"]))


def test_broken_messages_are_refused_and_unknown_ones_skipped() -> None:
    vectors = json.loads((golden.FOLDER / "messages.json").read_text(encoding="utf-8"))
    for broken in vectors["invalid"]:
        with pytest.raises(MalformedMessage):
            unpack(base64.b64decode(broken["bytes"]))
    assert [unpack(base64.b64decode(data)) for data in vectors["skipped"]] == [None, None]
