from __future__ import annotations

from typing import Any

import pytest
from pydantic import ValidationError

from bunraku.ingest.keyframe import KeyframeOrderError, Staging, check_keyframe_order

CAMERA = {"time": 0, "position": [0, 1, 4], "gaze": [0, 1, 0], "fov": 0.5}
LIGHT = {"time": 0, "position": [0, 3, 4], "colour": [1, 1, 1], "intensity": 90}


def test_what_is_left_out_is_not_asked_for() -> None:
    assert Staging().camera is None
    assert Staging(lights=[]).lights == []


@pytest.mark.parametrize(
    ("asked", "field"),
    [
        ({"camera": [{**CAMERA, "time": 5}, CAMERA]}, "camera[1].time"),
        ({"lights": [[LIGHT], [LIGHT, LIGHT]]}, "lights[1][1].time"),
    ],
)
def test_keyframes_come_in_order_of_time(asked: dict[str, Any], field: str) -> None:
    with pytest.raises(KeyframeOrderError, match="not after the one before") as raised:
        check_keyframe_order(Staging.model_validate(asked))
    assert raised.value.field == field


@pytest.mark.parametrize(
    "asked",
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
def test_what_is_no_keyframe_is_refused(asked: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        Staging.model_validate(asked)
