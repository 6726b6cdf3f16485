from __future__ import annotations

import json
from pathlib import Path

import pytest

from bunraku.codec.container import unpack_motion
from bunraku.demo import choreography
from bunraku.demo.bootstrap import DESCRIPTION_FILE, MOTION_FILE
from bunraku.demo.build import build_demo


def test_code_makes_the_files_of_the_package(tmp_path: Path) -> None:
    packed, values = build_demo(tmp_path)
    kept = json.loads(DESCRIPTION_FILE.read_bytes())
    hint = "run `make demo-data` and commit its files"
    # the id is a digest of the dance, the music and the staging
    assert values["id"] == kept["id"], hint
    made, stored = unpack_motion(kept["id"], packed), unpack_motion(kept["id"], MOTION_FILE.read_bytes())
    for number, kind in enumerate(kept["description"]["tracks"]):
        if kind == "audio":
            # the sound encoder's arithmetic depends on the processor
            sizes = [sum(map(len, packets[number][-1])) for packets in (made.packets, stored.packets)]
            assert sizes[0] == pytest.approx(sizes[1], rel=0.02), hint
        else:
            assert made.packets[number] == stored.packets[number], hint
    del values["description"]["audio"], kept["description"]["audio"]
    assert values == kept, hint


def test_description_fits_the_motion() -> None:
    values = json.loads(DESCRIPTION_FILE.read_bytes())
    stored = unpack_motion(values["id"], MOTION_FILE.read_bytes())
    description = values["description"]
    assert description["name"] == choreography.TITLE
    assert description["duration"] == stored.first_track.duration_us * 1e-6 >= 20
    assert description["tracks"] == ["motion", "audio", "camera", "light", "light", "light", "extension"]
    assert description["audio"]["seconds"] == pytest.approx(description["duration"])
    assert [len(rates[0]) for rates in stored.packets if rates] == [track.block_count for track in stored.tracks]
