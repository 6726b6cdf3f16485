from __future__ import annotations

import pickle

import pytest
from pydantic import ValidationError

from bunraku.messaging.recording_request import RECORDING_FPS, RecordingRequest


@pytest.mark.parametrize(
    ("length", "frames"), [(0, 0), (8_000, 0), (9_000, 1), (1_000_000, RECORDING_FPS), (600_000_000, 36_000)]
)
def test_frames_are_counted_by_the_clock(length: int, frames: int) -> None:
    assert RecordingRequest(log="l", begin=5, end=5 + length).frame_count == frames


def test_an_interval_that_runs_back_has_no_frames() -> None:
    assert RecordingRequest(log="l", begin=9_000_000, end=1).frame_count == 0


def test_what_is_not_known_is_skipped_and_what_is_wrong_refused() -> None:
    assert RecordingRequest.model_validate({"log": "l", "begin": 1, "end": 2, "later": 3}).camera == []
    with pytest.raises(ValidationError, match="begin"):
        RecordingRequest.model_validate({"log": "l", "end": 2})


def test_it_goes_to_another_process_and_back() -> None:
    order = RecordingRequest(log="l", name="n", begin=1, end=2, camera=[[1.0] * 8])
    assert pickle.loads(pickle.dumps(order)) == order
