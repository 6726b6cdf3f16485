from __future__ import annotations

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from bunraku.playout.sharing import Step, first_step, pinned, safe_step, steps

MOTION = (1.5, 2.5, 4.0, 7.0, 15.0)
AUDIO = (9.0, 24.0, 64.0)
ladders = st.lists(st.floats(0.1, 100.0), min_size=1, max_size=8).map(sorted)


def test_base_motion_comes_first_then_sound_then_better_motion_then_better_sound() -> None:
    shared = [step[:2] for step in steps(MOTION, AUDIO)]
    assert shared == [(0, -1), (0, 0), (1, 0), (2, 0), (3, 0), (4, 0), (4, 1), (4, 2)]


@given(ladders, ladders)
def test_each_step_costs_more_and_raises_one_of_the_two_by_one(motion: list[float], audio: list[float]) -> None:
    shared = steps(motion, audio)
    assert shared[0][:2] == (0, -1)
    assert shared[-1][:2] == (len(motion) - 1, len(audio) - 1)
    for before, after in pairwise(shared):
        assert after.motion + after.audio == before.motion + before.audio + 1
        assert after.motion >= before.motion
        assert after.audio >= before.audio
        assert after.kbps >= before.kbps
    for step in shared:
        assert step.kbps == motion[step.motion] + (audio[step.audio] if step.audio >= 0 else 0)


def test_without_one_of_the_two_they_are_the_others_rates() -> None:
    assert steps(MOTION) == tuple(Step(n, -1, kbps) for n, kbps in enumerate(MOTION))
    assert steps((), AUDIO) == tuple(Step(n, n, kbps) for n, kbps in enumerate(AUDIO))


def test_where_one_begins_what_is_safe_and_what_is_pinned() -> None:
    both, motion, audio = steps(MOTION, AUDIO), steps(MOTION), steps((), AUDIO)
    assert both[first_step(both)][:2] == (4, 0)
    assert [first_step(motion), first_step(audio)] == [4, 0]
    assert both[safe_step(both)][:2] == (0, 0)
    assert [safe_step(motion), safe_step(audio)] == [0, 0]


def test_a_pinned_motion_leaves_what_the_sound_may_get() -> None:
    both, motion, audio = steps(MOTION, AUDIO), steps(MOTION), steps((), AUDIO)
    assert pinned(both, None) == both
    assert [step[:2] for step in pinned(both, 0)] == [(0, -1), (0, 0)]
    assert [step[:2] for step in pinned(both, 3)] == [(3, 0)]
    assert [step[:2] for step in pinned(both, 15)] == [(4, 0), (4, 1), (4, 2)]
    assert pinned(motion, 3) == motion[3:4]
    assert pinned(motion, 15) == motion[4:]
    assert pinned(audio, 7) == audio[2:]
