from __future__ import annotations

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from bunraku.delivery.allocation import (
    BitrateAllocation,
    build_allocations,
    fallback_index,
    filter_by_motion_level,
    initial_index,
)

MOTION = (1.5, 2.5, 4.0, 7.0, 15.0)
AUDIO = (9.0, 24.0, 64.0)
ladders = st.lists(st.floats(0.1, 100.0), min_size=1, max_size=8).map(sorted)


def test_order_is_base_motion_audio_better_motion_better_audio() -> None:
    allocations = [step[:2] for step in build_allocations(MOTION, AUDIO)]
    assert allocations == [(0, -1), (0, 0), (1, 0), (2, 0), (3, 0), (4, 0), (4, 1), (4, 2)]


@given(ladders, ladders)
def test_each_allocation_raises_one_level_and_the_bitrate(motion: list[float], audio: list[float]) -> None:
    allocations = build_allocations(motion, audio)
    assert allocations[0][:2] == (0, -1)
    assert allocations[-1][:2] == (len(motion) - 1, len(audio) - 1)
    for before, after in pairwise(allocations):
        assert after.motion_level + after.audio_level == before.motion_level + before.audio_level + 1
        assert after.motion_level >= before.motion_level
        assert after.audio_level >= before.audio_level
        assert after.kbps >= before.kbps
    for step in allocations:
        assert step.kbps == motion[step.motion_level] + (audio[step.audio_level] if step.audio_level >= 0 else 0)


def test_single_type_has_one_allocation_per_level() -> None:
    assert build_allocations(MOTION) == tuple(BitrateAllocation(n, -1, kbps) for n, kbps in enumerate(MOTION))
    assert build_allocations((), AUDIO) == tuple(BitrateAllocation(n, n, kbps) for n, kbps in enumerate(AUDIO))


def test_initial_and_fallback_allocations() -> None:
    both, motion, audio = build_allocations(MOTION, AUDIO), build_allocations(MOTION), build_allocations((), AUDIO)
    assert both[initial_index(both)][:2] == (4, 0)
    assert [initial_index(motion), initial_index(audio)] == [4, 0]
    assert both[fallback_index(both)][:2] == (0, 0)
    assert [fallback_index(motion), fallback_index(audio)] == [0, 0]


def test_pinned_motion_keeps_its_audio_levels() -> None:
    both, motion, audio = build_allocations(MOTION, AUDIO), build_allocations(MOTION), build_allocations((), AUDIO)
    assert filter_by_motion_level(both, None) == both
    assert [step[:2] for step in filter_by_motion_level(both, 0)] == [(0, -1), (0, 0)]
    assert [step[:2] for step in filter_by_motion_level(both, 3)] == [(3, 0)]
    assert [step[:2] for step in filter_by_motion_level(both, 15)] == [(4, 0), (4, 1), (4, 2)]
    assert filter_by_motion_level(motion, 3) == motion[3:4]
    assert filter_by_motion_level(motion, 15) == motion[4:]
    assert filter_by_motion_level(audio, 7) == audio[2:]
