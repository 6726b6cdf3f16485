from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.codec.errors import DamagedBlock
from bunraku.codec.timing import Timing, parse_timing, plan_timing


@given(st.floats(1, 240), st.integers(1, 5000), st.floats(0.1, 3), st.none() | st.floats(0.01, 5))
def test_blocks_cover_the_track_and_are_found_by_time(
    fps: float, frames: int, block: float, first: float | None
) -> None:
    timing = plan_timing(fps, frames, block, first)
    lengths = [timing.frames_in(index) for index in range(timing.block_count)]
    assert sum(lengths) == frames
    assert 1 <= min(lengths) <= max(lengths) <= 512
    for index in range(timing.block_count):
        assert timing.first_frame(index) == sum(lengths[:index])
        assert timing.block_at(timing.start_us(index)) == index
    assert timing.block_at(-5) == 0
    assert timing.block_at(timing.duration_us * 2) == timing.block_count - 1


@given(st.floats(20, 200), st.integers(1, 5000), st.floats(0.1, 0.5))
def test_short_first_block_adds_no_block(fps: float, frames: int, first: float) -> None:
    timing = plan_timing(fps, frames, first_seconds=first)
    assert timing.block_count <= max(1, round(frames / fps))
    assert timing.first_frames <= timing.block_frames
    assert timing.block_frames <= 2.5 * fps + 1


def test_first_block_of_half_a_second_is_followed_by_even_blocks() -> None:
    assert plan_timing(30.0, 300, first_seconds=0.5) == Timing(30.0, 300, 32, 15)
    assert plan_timing(30.0, 72, first_seconds=0.5) == Timing(30.0, 72, 57, 15)
    assert plan_timing(30.0, 42, first_seconds=0.5) == Timing(30.0, 42, 42, 42)


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("fps", "fast", "Invalid light track: fps must be a number"),
        ("frames", 2.5, "integers"),
        ("fps", 0, "above zero"),
        ("fps", float("nan"), "above zero"),
        ("fps", float("inf"), "above zero"),
        ("block_frames", 513, "1..512"),
        ("first_frames", 0, "1..512"),
        ("first_frames", 91, "1..512"),
    ],
)
def test_invalid_timing_is_refused(key: str, value: object, message: str) -> None:
    description: dict[str, object] = {"fps": 30, "frames": 90, "block_frames": 30, "first_frames": 15}
    assert parse_timing(description, "light") == Timing(30.0, 90, 30, 15)
    with pytest.raises(DamagedBlock, match=message):
        parse_timing(description | {key: value}, "light")
