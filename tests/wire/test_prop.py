from __future__ import annotations

from typing import Any

import pytest

from bunraku.motion.placement import Placement
from bunraku.wire.prop import Prop, PropKind, PropState, is_stored_prop


@pytest.mark.parametrize("state", [PropState(), PropState(5, Placement(0.5, -2.0, 1.0))])
def test_prop_is_restored_from_its_values(state: PropState) -> None:
    prop = Prop("fan", state)
    assert Prop.from_values(prop.to_values()) == prop
    assert Prop.from_values([*prop.to_values(), "later"]) == prop


@pytest.mark.parametrize(
    "values",
    [None, [], ["fan"], ["fan", 1], [1, 1, [0, 0, 0]], ["fan", -1, [0, 0, 0]], ["fan", "left", [0, 0, 0]]]
    + [["fan", None, place] for place in (None, [0, 0], [0, 0, float("nan")], [0, 101, 0])],
)
def test_values_of_no_prop_are_refused(values: Any) -> None:
    with pytest.raises(ValueError, match=r"prop|placement"):
        Prop.from_values(values)


def test_ids_of_stored_props_are_told_from_built_in_kinds() -> None:
    assert is_stored_prop("abcdefghij234567abcd")
    others = [
        *PropKind,
        "",
        "abcdefghij234567abc",
        "abcdefghij234567abcde",
        "Abcdefghij234567abcd",
        "abcdefghij234567abc1",
    ]
    assert not any(map(is_stored_prop, others))
