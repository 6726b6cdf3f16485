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


def test_base_motion_comes_first_then_sound_then_better_motion_then_better_sound() -> None:
    shared = [step[:2] for step in build_allocations(MOTION, AUDIO)]
    assert shared == [(0, -1), (0, 0), (1, 0), (2, 0), (3, 0), (4, 0), (4, 1), (4, 2)]


@given(ladders, ladders)
def test_each_step_costs_more_and_raises_one_of_the_two_by_one(motion: list[float], audio: list[float]) -> None:
    shared = build_allocations(motion, audio)
    assert shared[0][:2] == (0, -1)
    assert shared[-1][:2] == (len(motion) - 1, len(audio) - 1)
    for before, after in pairwise(shared):
        assert after.motion_level + after.audio_level == before.motion_level + before.audio_level + 1
        assert after.motion_level >= before.motion_level
        assert after.audio_level >= before.audio_level
        assert after.kbps >= before.kbps
    for step in shared:
        assert step.kbps == motion[step.motion_level] + (audio[step.audio_level] if step.audio_level >= 0 else 0)


def test_without_one_of_the_two_they_are_the_others_rates() -> None:
    assert build_allocations(MOTION) == tuple(BitrateAllocation(n, -1, kbps) for n, kbps in enumerate(MOTION))
    assert build_allocations((), AUDIO) == tuple(BitrateAllocation(n, n, kbps) for n, kbps in enumerate(AUDIO))


def test_where_one_begins_what_is_safe_and_what_is_pinned() -> None:
    both, motion, audio = build_allocations(MOTION, AUDIO), build_allocations(MOTION), build_allocations((), AUDIO)
    assert both[initial_index(both)][:2] == (4, 0)
    assert [initial_index(motion), initial_index(audio)] == [4, 0]
    assert both[fallback_index(both)][:2] == (0, 0)
    assert [fallback_index(motion), fallback_index(audio)] == [0, 0]


def test_a_pinned_motion_leaves_what_the_sound_may_get() -> None:
    both, motion, audio = build_allocations(MOTION, AUDIO), build_allocations(MOTION), build_allocations((), AUDIO)
    assert filter_by_motion_level(both, None) == both
    assert [step[:2] for step in filter_by_motion_level(both, 0)] == [(0, -1), (0, 0)]
    assert [step[:2] for step in filter_by_motion_level(both, 3)] == [(3, 0)]
    assert [step[:2] for step in filter_by_motion_level(both, 15)] == [(4, 0), (4, 1), (4, 2)]
    assert filter_by_motion_level(motion, 3) == motion[3:4]
    assert filter_by_motion_level(motion, 15) == motion[4:]
    assert filter_by_motion_level(audio, 7) == audio[2:]
