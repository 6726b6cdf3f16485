from __future__ import annotations

import json
from typing import Any

import pytest
from pydantic import ValidationError

from bunraku.ingest.keyframe import (
    MAX_BODY_BYTES,
    MAX_KEYFRAMES,
    MAX_LIGHTS,
    KeyframeOrderError,
    Staging,
    check_keyframe_order,
    digest_staging,
    parse_staging,
)
from bunraku.runtime.problem import ProblemError
from bunraku.storage.motion_id import derive_digest

CAMERA = {"time": 0, "position": [0, 1, 4], "gaze": [0, 1, 0], "fov": 0.5}
LIGHT = {"time": 0, "position": [0, 3, 4], "colour": [1, 1, 1], "intensity": 90}


def test_omitted_parts_are_none() -> None:
    assert Staging().camera is None
    assert Staging(lights=[]).lights == []


@pytest.mark.parametrize(
    ("staging", "field"),
    [
        ({"camera": [{**CAMERA, "time": 5}, CAMERA]}, "camera[1].time"),
        ({"lights": [[LIGHT], [LIGHT, LIGHT]]}, "lights[1][1].time"),
    ],
)
def test_unordered_keyframes_are_rejected(staging: dict[str, Any], field: str) -> None:
    with pytest.raises(KeyframeOrderError, match="not after the one before") as raised:
        check_keyframe_order(Staging.model_validate(staging))
    assert raised.value.field == field


@pytest.mark.parametrize(
    "staging",
    [
        {"camera": []},
        {"camera": [{**CAMERA, "fov": 4.0}]},
        {"camera": [{**CAMERA, "fov": "nan"}]},
        {"camera": [{**CAMERA, "position": [0, 1]}]},
        {"camera": [{**CAMERA, "time": -1}]},
        {"camera": [{**CAMERA, "ease": "bounce"}]},
        {"camera": [{**CAMERA, "zoom": 1}]},
        {"lights": [[{**LIGHT, "intensity": -1}]]},
        {"lights": [[{**LIGHT, "colour": [1, 1, -1]}]]},
        {"lights": [[LIGHT]] * 9},
        {"lights": [[]]},
        {"sound": []},
    ],
)
def test_invalid_keyframe_is_rejected(staging: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        Staging.model_validate(staging)


@pytest.mark.parametrize(
    ("body", "status", "field"),
    [
        (json.dumps({"camera": [CAMERA, CAMERA]}).encode(), 422, "camera[1].time"),
        (json.dumps({"lights": [[{**LIGHT, "intensity": -1}]]}).encode(), 422, "lights[0][0].intensity"),
        (b"{}", 422, "camera"),
        (b"[]", 422, None),
        (b"", 400, None),
        (b"[" * 100_000, 400, None),
        (b"{}," * 1_000_000, 413, None),
    ],
)
def test_invalid_body_is_a_problem(body: bytes, status: int, field: str | None) -> None:
    with pytest.raises(ProblemError) as raised:
        parse_staging(body)
    assert (raised.value.status, raised.value.extra.get("field")) == (status, field)


def test_most_keyframes_fit_into_a_request() -> None:
    camera = [{**CAMERA, "time": 33_333 * index} for index in range(MAX_KEYFRAMES)]
    light = [{**LIGHT, "time": 33_333 * index} for index in range(MAX_KEYFRAMES)]
    body = json.dumps({"camera": camera, "lights": [light] * MAX_LIGHTS}, separators=(",", ":")).encode()
    assert len(body) < MAX_BODY_BYTES
    staging = parse_staging(body)
    assert [len(staging.camera or []), len(staging.lights or [])] == [MAX_KEYFRAMES, MAX_LIGHTS]


def test_digest_depends_on_the_keyframes_and_not_on_their_form() -> None:
    spaced, compact = (
        json.dumps({"camera": [CAMERA]}, indent=4),
        json.dumps({"camera": [CAMERA]}, separators=(",", ":")),
    )
    staging = Staging.model_validate({"camera": [CAMERA]})
    # the ids of stored motions depend on this text
    expected = derive_digest("m1", b" staged " + staging.model_dump_json().encode())
    assert digest_staging(spaced.encode(), "m1") == digest_staging(compact.encode(), "m1") == expected
    assert digest_staging(compact.encode(), "m2") != expected
