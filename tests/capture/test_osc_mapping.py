from __future__ import annotations

import json

import pytest

from bunraku.capture.errors import UnreadableCapture
from bunraku.capture.osc_mapping import MAX_MAPPING_BYTES, find_bone, parse_axes, parse_mapping

TOML = b"""version = 1
space = "world"
[[map]]
address = "/skeleton/{joint}/rotation"
kind = "rotation"
names = { arm_l = "LeftUpperArm", hip_l = "l_hip" }
order = "zxy"
unit = "degrees"
axes = "-x y z"
first_argument = 2
[[map]]
address = "/hips"
kind = "position"
joint = "Hips"
unit = "cm"
[[map]]
address = "/clock"
kind = "time"
"""


def test_toml_and_json_give_the_same_mapping() -> None:
    mapping = parse_mapping(TOML)
    assert mapping.in_world
    assert [entry.kind for entry in mapping.entries] == ["rotation", "position", "time"]
    rows = [entry.model_dump(exclude_none=True) for entry in mapping.entries]
    assert parse_mapping(json.dumps({"version": 1, "space": "world", "map": rows}).encode()) == mapping
    assert parse_mapping(b"\xef\xbb\xbf" + TOML.replace(b"\n", b"\r\n")) == mapping


def test_bones_are_found_by_unity_and_h_anim_names() -> None:
    assert find_bone("leftupperarm") == "LeftUpperArm"
    assert find_bone("l_shoulder") == "LeftUpperArm"
    assert find_bone("root") == "Root"
    assert find_bone("tail") is None


def test_axes_are_parsed() -> None:
    assert parse_axes("-x y z") == ((0, -1.0), (1, 1.0), (2, 1.0))
    assert parse_axes("+y -z x") == ((1, 1.0), (2, -1.0), (0, 1.0))
    for wrong in ("", "x y", "x x y", "x y z z", "-xy z", "x y w", "--x y z"):
        with pytest.raises(ValueError, match="axes"):
            parse_axes(wrong)


@pytest.mark.parametrize(
    ("data", "problem"),
    [
        (b"", "Invalid mapping: version"),
        (b"\xff", "not UTF-8"),
        (b'{"version": 1,\n "space"', "Invalid JSON: line 2"),
        (b"version = 1\nspace = world", "Invalid TOML: line 2"),
        (b'{"a":' * 10_000, "nested|Invalid JSON"),
        (b"a = " + b"[" * 20_000, "nested|Invalid TOML"),
        (b"#" * (MAX_MAPPING_BYTES + 1), "too large"),
        (TOML.replace(b"version = 1", b"version = 2"), "Invalid mapping: version"),
        (TOML.replace(b'"world"', b'"local"'), "Invalid mapping: space"),
        (TOML.replace(b'"zxy"', b'"zxz"'), "map.0: .*order"),
        (TOML.replace(b'"degrees"', b'"cm"'), "map.0: .*unit"),
        (TOML.replace(b'"cm"', b'"feet"'), "map.1.unit"),
        (TOML.replace(b'"-x y z"', b'"-x y"'), "map.0: .*axes"),
        (TOML.replace(b"first_argument = 2", b"first_argument = -2"), "map.0.first_argument"),
        (TOML.replace(b"first_argument", b"first"), "map.0.first"),
        (TOML.replace(b'"LeftUpperArm"', b'"Tail"'), "map.0: .*'Tail'"),
        (TOML.replace(b'"/hips"', b'"hips"'), "map.1.address"),
        (TOML.replace(b'"/hips"', b'"/{joint}/{joint}"'), "more than once"),
        (TOML.replace(b'joint = "Hips"\n', b""), "give either a joint"),
        (TOML.replace(b'"/hips"', b'"/{joint}"'), "give either a joint"),
        (TOML.replace(b'"/clock"', b'"/{joint}"'), "belongs to no joint"),
    ],
)
def test_errors_name_line_or_field(data: bytes, problem: str) -> None:
    with pytest.raises(UnreadableCapture, match=problem):
        parse_mapping(data)
