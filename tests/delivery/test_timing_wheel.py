from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from bunraku.delivery.timing_wheel import SLOT_US, TimingWheel


@given(
    st.lists(
        st.one_of(
            st.tuples(st.just("put"), st.integers(0, 9), st.integers(0, 40 * SLOT_US)),
            st.tuples(st.just("remove"), st.integers(0, 9), st.just(0)),
            st.tuples(st.just("turn"), st.integers(1, 5), st.integers(0, 40 * SLOT_US)),
        ),
        max_size=60,
    )
)
def test_everyone_has_one_turn_in_time_and_none_before(steps: list[tuple[str, int, int]]) -> None:
    wheel: TimingWheel[int] = TimingWheel()
    model: dict[int, int] = {}
    for step, number, time in steps:
        if step == "put":
            wheel.schedule(number, time)
            model[number] = time
        elif step == "remove":
            wheel.cancel(number)
            model.pop(number, None)
        else:
            for who in wheel.pop_due(time, number):
                assert model.pop(who) <= time
            if (due := wheel.next_due()) is not None and due <= time:
                continue
            assert all(waits > time - SLOT_US for waits in model.values())
        assert len(wheel) == len(model)
        first = wheel.next_due()
        assert (first is None) == (not model)
        if first is not None:
            assert min(model.values()) <= first < min(model.values()) + SLOT_US


def test_no_more_than_is_asked_for_have_a_turn() -> None:
    wheel: TimingWheel[int] = TimingWheel()
    for number in range(10):
        wheel.schedule(number, number)
    assert len(wheel.pop_due(SLOT_US, 4)) == 4
    assert len(wheel.pop_due(SLOT_US, 100)) == 6
    assert wheel.pop_due(SLOT_US, 100) == []
    assert wheel.next_due() is None
