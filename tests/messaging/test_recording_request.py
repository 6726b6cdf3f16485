from __future__ import annotations

import pickle

import pytest
from pydantic import ValidationError

from bunraku.messaging.recording_request import RECORDING_FPS, RecordingRequest, pack_camera


@pytest.mark.parametrize(
    ("length", "frames"), [(0, 0), (8_000, 0), (9_000, 1), (1_000_000, RECORDING_FPS), (600_000_000, 36_000)]
)
def test_frame_count_follows_the_interval(length: int, frames: int) -> None:
    assert RecordingRequest(log="l", begin=5, end=5 + length).frame_count == frames


def test_reversed_interval_has_no_frames() -> None:
    assert RecordingRequest(log="l", begin=9_000_000, end=1).frame_count == 0


def test_unknown_members_are_ignored_and_missing_ones_rejected() -> None:
    assert RecordingRequest.model_validate({"log": "l", "begin": 1, "end": 2, "later": 3}).camera == b""
    with pytest.raises(ValidationError, match="begin"):
        RecordingRequest.model_validate({"log": "l", "end": 2})


def test_request_can_be_pickled() -> None:
    request = RecordingRequest(log="l", name="n", begin=1, end=2, camera=pack_camera([[1.0] * 8]))
    assert pickle.loads(pickle.dumps(request)) == request


def test_camera_is_unchanged_as_bytes() -> None:
    keyframes = [[1_700_000_000_000_000 + 1, 0.1, 1, 2, 3, 4, 5, 0.5], [1_700_000_000_000_002, *range(7)]]
    request = RecordingRequest(log="l", begin=1, end=2, camera=pack_camera(keyframes))
    assert request.camera_keyframes.tolist() == keyframes
    assert RecordingRequest(log="l", begin=1, end=2).camera_keyframes.shape == (0, 8)
    with pytest.raises(ValueError, match="reshape"):
        _ = RecordingRequest(log="l", begin=1, end=2, camera=bytes(72)).camera_keyframes
