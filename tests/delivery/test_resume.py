from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.delivery.resume import MAX_BLOCKS, ResumeState


@given(
    st.from_regex(r"[A-Za-z0-9]{1,64}", fullmatch=True),
    st.integers(0, 9_999_999),
    st.lists(st.integers(-1, 15), max_size=MAX_BLOCKS),
    st.none() | st.integers(0, 16),
)
def test_it_is_read_as_it_was_said(motion: str, first: int, rates: list[int], tracks: int | None) -> None:
    held = ResumeState(motion, first, tuple(rates), tracks)
    assert ResumeState.parse(held.to_query()) == held


def test_of_many_blocks_the_first_are_told() -> None:
    assert ResumeState("m", 7, [2] * 100).to_query() == "m.7." + "2" * MAX_BLOCKS
    (other,) = ResumeState.parse(ResumeState("m", 7, (), 2, [(9, [2] * 100)]).to_query()).other_performers
    assert other == (9, (2,) * MAX_BLOCKS)


@given(
    st.lists(st.integers(-1, 15), max_size=MAX_BLOCKS),
    st.integers(0, 16),
    st.lists(
        st.tuples(
            st.integers(0, 9_999_999),
            st.lists(st.sampled_from([-1, -1, 0, 3, 15]), max_size=MAX_BLOCKS)
            | st.builds(lambda *run: [run[0]] * run[1], st.integers(-1, 15), st.integers(0, MAX_BLOCKS)),
        ),
        max_size=3,
    ),
)
def test_all_performers_are_read_as_they_were_said(
    rates: list[int], tracks: int, others: list[tuple[int, list[int]]]
) -> None:
    held = ResumeState("m", 4, tuple(rates), tracks, tuple((first, tuple(told)) for first, told in others))
    assert ResumeState.parse(held.to_query()) == held
    assert held.performers == [(4, tuple(rates)), *held.other_performers]
    assert len(held.to_query()) <= 400


def test_of_other_performers_runs_are_told_in_short_and_the_first_as_it_always_was() -> None:
    runs = [2] * 30 + [0] + [-1] * 2 + [10] * 3
    assert ResumeState("m", 7, [2] * 6, 3, [(41, runs), (0, ())]).to_query() == "m.7.222222.3.41.2z2n0-gah.0."


def test_what_others_hold_is_not_said_without_the_number_of_tracks() -> None:
    assert ResumeState("m", 7, (2,), None, [(7, (2,))]).to_query() == "m.7.2"


@pytest.mark.parametrize(
    "text",
    [
        *("", "m", "m.1", "m.x.1", "../m.1.2", "m.1.g", "m.-1.2", "m.1." + "1" * 65, "m.1.2\n", "m.1.2.", "m.1.2.a"),
        *("m.1.2g.2", "m.1.2..1.2", "m.1.2.2.1", "m.1.2.2.1.2.", "m.1.2.2.-1.2", "m.1.2.2.1.g2", "m.1.2.2.1.2G"),
        *(
            "m.1.2.2.1." + "2z" * 4,
            "m.1.2.2.1." + "1" * 65,
            "m.1.2.2" + ".1.2" * 4,
            "m.1.2.2.1.\u0662",
            "m.1.2.2.1.2\n",
        ),
    ],
)
def test_anything_else_is_refused_in_words(text: str) -> None:
    with pytest.raises(ValueError, match=r"have=MOTION\.FIRST\.RATES"):
        ResumeState.parse(text)
