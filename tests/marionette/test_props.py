from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from bunraku.marionette.props import PropRefusalReason, StageProps
from bunraku.motion.placement import Placement
from bunraku.wire.prop import MAX_PROPS, Prop, PropState

HERE, THERE = Placement(0.5, 1.0, 0.0), Placement(-1.0, 0.25, 2.0)
FREE = (None,) * 8
ADA_HOLDS_0_BO_HOLDS_4 = ("ada", None, None, None, "bo", None, None, None)


def new_props(*limbs: int | None) -> StageProps:
    return StageProps({number: Prop("fan", PropState(limb, HERE)) for number, limb in enumerate(limbs)})


def limbs_of(props: StageProps) -> list[int | None]:
    return [prop.state.limb for prop in props.all.values()]


def test_free_prop_is_taken_into_an_own_or_a_free_hand_and_laid_down() -> None:
    props = new_props(None, 5)
    assert props.put_in_hand(0, 0, "ada", ADA_HOLDS_0_BO_HOLDS_4) is None
    assert props.put_in_hand(1, 1, "ada", ADA_HOLDS_0_BO_HOLDS_4) is None
    assert limbs_of(props) == [0, 1]
    assert props.all[0].state.place == HERE
    assert props.lay_down(0, THERE, "ada", ADA_HOLDS_0_BO_HOLDS_4) is None
    assert props.all[0].state == PropState(None, THERE)


def test_free_prop_is_not_put_into_the_hand_of_another() -> None:
    props = new_props(None, 1)
    for number in (0, 1):
        assert props.put_in_hand(number, 4, "ada", ADA_HOLDS_0_BO_HOLDS_4) is PropRefusalReason.HELD
    assert limbs_of(props) == [None, 1]


def test_only_the_holder_takes_a_prop_out_of_a_hand_and_passes_it() -> None:
    props = new_props(0)
    assert props.lay_down(0, THERE, "bo", ADA_HOLDS_0_BO_HOLDS_4) is PropRefusalReason.HELD
    assert props.put_in_hand(0, 4, "bo", ADA_HOLDS_0_BO_HOLDS_4) is PropRefusalReason.HELD
    assert props.put_in_hand(0, 4, "ada", ADA_HOLDS_0_BO_HOLDS_4) is None
    assert limbs_of(props) == [4]
    assert props.put_in_hand(0, 0, "ada", ADA_HOLDS_0_BO_HOLDS_4) is PropRefusalReason.HELD


def test_hand_has_one_prop_and_a_leg_has_none() -> None:
    props = new_props(1, None)
    assert props.put_in_hand(1, 1, "ada", FREE) is PropRefusalReason.FULL
    assert props.put_in_hand(0, 1, "ada", FREE) is None
    assert props.put_in_hand(1, 2, "ada", FREE) is PropRefusalReason.LEG
    assert props.put_in_hand(1, 8, "ada", FREE) is PropRefusalReason.UNKNOWN
    assert props.put_in_hand(2, 0, "ada", FREE) is PropRefusalReason.UNKNOWN
    assert props.lay_down(7, THERE, "ada", FREE) is PropRefusalReason.UNKNOWN


def test_prop_of_a_performer_who_has_left_lies_where_it_lay_before() -> None:
    props = new_props(0, 5)
    assert not props.drop_beyond(8)
    assert props.drop_beyond(4)
    assert props.all[1].state == PropState(None, HERE)
    assert limbs_of(props) == [0, None]


def test_prop_that_stays_keeps_its_hand() -> None:
    props = new_props(0, 1)
    assert not props.bring(dict.fromkeys((0, 1), Prop("fan", PropState(None, THERE))))
    assert props.bring({1: Prop("ball", PropState(None, THERE)), 0: Prop("fan")})
    assert props.all == {0: Prop("fan", PropState(0, HERE)), 1: Prop("ball", PropState(None, THERE))}
    assert props.bring({})
    assert props.all == {}


REQUESTS = st.tuples(
    st.integers(0, MAX_PROPS - 1), st.one_of(st.none(), st.integers(0, 15)), st.sampled_from(["ada", "bo", "cy"])
)
HOLDERS = st.lists(st.sampled_from([None, "ada", "bo"]), min_size=4, max_size=16)
Step = tuple[tuple[int, int | None, str], list[str | None]]


@given(st.lists(st.tuples(REQUESTS, HOLDERS), max_size=40))
def test_no_request_fills_a_hand_twice_or_takes_from_a_holder(steps: list[Step]) -> None:
    props = new_props(*[None] * 6)
    for (number, limb, puppeteer), holders in steps:
        props.drop_beyond(len(holders))
        before = props.all
        if limb is None:
            refusal = props.lay_down(number, THERE, puppeteer, holders)
        else:
            refusal = props.put_in_hand(number, limb, puppeteer, holders)
        hands = [prop.state.limb for prop in props.all.values() if prop.state.limb is not None]
        assert len(set(hands)) == len(hands)
        assert all(hand % 4 < 2 and hand < len(holders) for hand in hands)
        if refusal is not None:
            assert props.all == before
        else:
            taken_from = before[number].state.limb
            assert taken_from is None or holders[taken_from] in (None, puppeteer)
