from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bunraku.messaging.recording_request import MAX_CAMERA_KEYFRAMES, RecordingRequest
from bunraku.runtime.problem import ProblemError
from bunraku.session.recording import MAX_BODY_BYTES, PackedRecording, parse_recording

KEY = {"time": 1, "position": [0.1, 1, 4], "gaze": [0, 1, 0], "fov": 0.5}


def test_recording_is_packed() -> None:
    packed = parse_recording(json.dumps({"name": "Ours", "seconds": 2, "camera": [KEY, KEY | {"time": 2}]}).encode())
    assert (packed.name, packed.seconds) == ("Ours", 2.0)
    request = RecordingRequest(log="l", begin=1, end=2, camera=packed.camera)
    assert request.camera_keyframes.tolist() == [[1, 0.1, 1, 4, 0, 1, 0, 0.5], [2, 0.1, 1, 4, 0, 1, 0, 0.5]]
    assert parse_recording(b"{}") == PackedRecording(None, None, b"")


def test_longest_camera_fits_into_a_request(tmp_path: Path) -> None:
    values = np.random.default_rng(1).uniform(-1, 1, (MAX_CAMERA_KEYFRAMES, 6)).tolist()
    camera = [
        {
            "time": 1_700_000_000_000_000 + 16_667 * index,
            "position": row[:3],
            "gaze": row[3:],
            "fov": 0.7853981633974483,
        }
        for index, row in enumerate(values)
    ]
    body = tmp_path / "body"
    body.write_text(json.dumps({"name": "n" * 200, "camera": camera}, separators=(",", ":")))
    assert body.stat().st_size < MAX_BODY_BYTES
    assert len(parse_recording(body).camera) == 64 * MAX_CAMERA_KEYFRAMES


@pytest.mark.parametrize(
    ("content", "field"),
    [
        ({"camera": [KEY, KEY | {"fov": 4}]}, "camera[1].fov"),
        ({"camera": [KEY | {"position": [0, 1]}]}, "camera[0].position"),
        ({"camera": [KEY | {"zoom": 1}]}, "camera[0].zoom"),
        ({"camera": [KEY] * (MAX_CAMERA_KEYFRAMES + 1)}, "camera"),
        ({"seconds": 0}, "seconds"),
        ({"name": "n" * 201}, "name"),
        ({"colour": 1}, "colour"),
        ([], None),
    ],
)
def test_invalid_recording_names_its_field(content: Any, field: str | None) -> None:
    with pytest.raises(ProblemError) as raised:
        parse_recording(json.dumps(content).encode())
    assert (raised.value.status, raised.value.extra.get("field")) == (422, field)


@pytest.mark.parametrize(("body", "status"), [(b"", 400), (b"{", 400), (b"[" * 5_000, 400), (b"{}," * 10**6, 413)])
def test_malformed_recording_is_a_problem(body: bytes, status: int) -> None:
    with pytest.raises(ProblemError) as raised:
        parse_recording(body)
    assert raised.value.status == status
