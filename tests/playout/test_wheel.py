from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from bunraku.playout.wheel import SPOKE, Wheel


@given(
    st.lists(
        st.one_of(
            st.tuples(st.just("put"), st.integers(0, 9), st.integers(0, 40 * SPOKE)),
            st.tuples(st.just("remove"), st.integers(0, 9), st.just(0)),
            st.tuples(st.just("turn"), st.integers(1, 5), st.integers(0, 40 * SPOKE)),
        ),
        max_size=60,
    )
)
def test_everyone_has_one_turn_in_time_and_none_before(steps: list[tuple[str, int, int]]) -> None:
    wheel: Wheel[int] = Wheel()
    model: dict[int, int] = {}
    for step, number, time in steps:
        if step == "put":
            wheel.put(number, time)
            model[number] = time
        elif step == "remove":
            wheel.remove(number)
            model.pop(number, None)
        else:
            for who in wheel.turn(time, number):
                assert model.pop(who) <= time
            if (due := wheel.next()) is not None and due <= time:
                continue
            assert all(waits > time - SPOKE for waits in model.values())
        assert len(wheel) == len(model)
        first = wheel.next()
        assert (first is None) == (not model)
        if first is not None:
            assert min(model.values()) <= first < min(model.values()) + SPOKE


def test_no_more_than_is_asked_for_have_a_turn() -> None:
    wheel: Wheel[int] = Wheel()
    for number in range(10):
        wheel.put(number, number)
    assert len(wheel.turn(SPOKE, 4)) == 4
    assert len(wheel.turn(SPOKE, 100)) == 6
    assert wheel.turn(SPOKE, 100) == []
    assert wheel.next() is None
