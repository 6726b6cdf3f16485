from __future__ import annotations

from itertools import pairwise
from math import acos, pi

from hypothesis import given
from hypothesis import strategies as st

from bunraku.marionette import vector
from bunraku.marionette.spin import FASTEST, Spin
from bunraku.marionette.vector import IDENTITY, Quaternion, Vector

FRAME = 1.0 / 60.0
parts = st.floats(-1.0, 1.0)
directions = st.tuples(parts, parts, parts).filter(lambda v: vector.length(v) > 0.1)
orientations = st.tuples(parts, parts, parts, parts).filter(lambda q: sum(x * x for x in q) > 0.1)
LINK = (0.1, -0.3, 0.05)
ALONG = vector.unit(LINK, LINK)


def angle(a: Quaternion, b: Quaternion) -> float:
    return 2.0 * acos(min(abs(sum(x * y for x, y in zip(a, b, strict=True))), 1.0))


@given(st.lists(orientations, min_size=1, max_size=8), st.floats(0.0, 1.0))
def test_a_link_lies_where_it_is_wanted_however_it_is_turned(wanted: list[Quaternion], share: float) -> None:
    spin = Spin(LINK)
    for one in map(vector.normalise, wanted):
        shown = spin.follow(one, share, FRAME)
        off = vector.subtract(vector.rotate(shown, LINK), vector.rotate(one, LINK))
        assert vector.length(off) < 1e-7
        assert abs(angle(shown, one) - min(abs(spin.behind), 2.0 * pi - abs(spin.behind))) < 1e-6


@given(directions, st.floats(-3.0, 3.0), st.floats(0.0, 0.3))
def test_a_jump_about_itself_is_gone_through_at_a_bounded_speed(axis: Vector, jump: float, swing: float) -> None:
    spin = Spin(LINK)
    before = spin.follow(IDENTITY, 1.0, FRAME)
    aside = vector.unit(vector.square_to(axis, ALONG), vector.across(ALONG))
    moved = vector.about(aside, swing)
    wanted = vector.multiply(moved, vector.about(ALONG, jump))
    shown = spin.follow(wanted, 1.0, FRAME)
    # what it turns besides going where it is wanted by the shortest way
    turned = angle(vector.multiply(moved, before), shown)
    assert abs(turned - min(abs(jump), FASTEST * FRAME)) < 1e-6
    for _ in range(int(abs(jump) / (FASTEST * FRAME))):
        before, shown = shown, spin.follow(wanted, 1.0, FRAME)
        assert angle(before, shown) <= FASTEST * FRAME + 1e-6
    assert abs(spin.behind) < 1e-9
    assert angle(shown, wanted) < 1e-7


def test_what_is_wanted_evenly_round_and_round_is_kept_up_with_on_the_way_it_goes() -> None:
    """By the shortest way a link that is behind would turn back where half a circle is left."""
    spin = Spin(LINK)
    behind = []
    for frame in range(40):
        spin.follow(vector.about(ALONG, 0.4 * frame), 1.0, FRAME)
        behind.append(spin.behind)
    assert all(later <= sooner for sooner, later in pairwise(behind[:12]))
    assert min(behind) < -pi


@given(orientations, orientations)
def test_with_no_share_left_it_is_as_wanted(one: Quaternion, other: Quaternion) -> None:
    one, other = vector.normalise(one), vector.normalise(other)
    spin = Spin(LINK)
    spin.follow(one, 1.0, FRAME)
    assert angle(spin.follow(other, 0.0, FRAME), other) < 1e-7
