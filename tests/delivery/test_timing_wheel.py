from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from bunraku.delivery.timing_wheel import SLOT_US, TimingWheel


@given(
    st.lists(
        st.one_of(
            st.tuples(st.just("schedule"), st.integers(0, 9), st.integers(0, 40 * SLOT_US)),
            st.tuples(st.just("cancel"), st.integers(0, 9), st.just(0)),
            st.tuples(st.just("pop"), st.integers(1, 5), st.integers(0, 40 * SLOT_US)),
        ),
        max_size=60,
    )
)
def test_each_item_is_due_once_and_never_early(steps: list[tuple[str, int, int]]) -> None:
    wheel: TimingWheel[int] = TimingWheel()
    model: dict[int, int] = {}
    for step, number, time in steps:
        if step == "schedule":
            wheel.schedule(number, time)
            model[number] = time
        elif step == "cancel":
            wheel.cancel(number)
            model.pop(number, None)
        else:
            for item in wheel.pop_due(time, number):
                assert model.pop(item) <= time
            if (due := wheel.next_due()) is not None and due <= time:
                continue
            assert all(due_at > time - SLOT_US for due_at in model.values())
        assert len(wheel) == len(model)
        first = wheel.next_due()
        assert (first is None) == (not model)
        if first is not None:
            assert min(model.values()) <= first < min(model.values()) + SLOT_US


def test_pop_due_returns_at_most_max_items() -> None:
    wheel: TimingWheel[int] = TimingWheel()
    for number in range(10):
        wheel.schedule(number, number)
    assert len(wheel.pop_due(SLOT_US, 4)) == 4
    assert len(wheel.pop_due(SLOT_US, 100)) == 6
    assert wheel.pop_due(SLOT_US, 100) == []
    assert wheel.next_due() is None
