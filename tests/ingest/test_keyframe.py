from __future__ import annotations

from typing import Any

import pytest
from pydantic import ValidationError

from bunraku.ingest.keyframe import KeyframeOrderError, Staging, check_keyframe_order

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
