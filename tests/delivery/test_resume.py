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
def test_query_round_trip(motion: str, first: int, levels: list[int], track_count: int | None) -> None:
    resume_state = ResumeState(motion, first, tuple(levels), track_count)
    assert ResumeState.parse(resume_state.to_query()) == resume_state


def test_only_first_blocks_are_listed() -> None:
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
def test_query_round_trip_of_all_performers(
    levels: list[int], track_count: int, others: list[tuple[int, list[int]]]
) -> None:
    resume_state = ResumeState(
        "m", 4, tuple(levels), track_count, tuple((first, tuple(held_levels)) for first, held_levels in others)
    )
    assert ResumeState.parse(resume_state.to_query()) == resume_state
    assert resume_state.performers == [(4, tuple(levels)), *resume_state.other_performers]
    assert len(resume_state.to_query()) <= 400


def test_run_lengths_are_used_for_other_performers_only() -> None:
    runs = [2] * 30 + [0] + [-1] * 2 + [10] * 3
    assert ResumeState("m", 7, [2] * 6, 3, [(41, runs), (0, ())]).to_query() == "m.7.222222.3.41.2z2n0-gah.0."


def test_other_performers_are_omitted_without_track_count() -> None:
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
def test_malformed_query_is_rejected_with_format(text: str) -> None:
    with pytest.raises(ValueError, match=r"have=MOTION\.FIRST\.RATES"):
        ResumeState.parse(text)
