from __future__ import annotations

import pytest

from bunraku.motion.errors import UnreadableFile
from bunraku.motion.readers.takes import MAX_NAME_CHARACTERS, choose_take, describe_choice, name_takes


@pytest.mark.parametrize(("sizes", "take", "chosen"), [([1, 3, 3], None, 1), ([1, 3, 3], "c", 2), ([5], None, 0)])
def test_largest_take_is_chosen_unless_one_is_named(sizes: list[int], take: str | None, chosen: int) -> None:
    assert choose_take(["a", "b", "c"][: len(sizes)], sizes, take) == chosen


def test_unknown_take_is_refused_with_the_known_ones() -> None:
    names = [f"take {number}" for number in range(30)]
    with pytest.raises(UnreadableFile) as caught:
        choose_take(names, [1] * 30, "walk")
    assert caught.value.field == "take"
    assert "'take 19' and 10 more" in caught.value.hint


def test_choice_among_several_is_described() -> None:
    assert describe_choice(["a"], 0) == []
    assert describe_choice(["a", "b"], 1) == ["Of 2 takes, 'b' was read; the others are 'a'."]


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        (["a", "b"], ["a", "b"]),
        (["a", "a", "a (2)", "a"], ["a", "a (2)", "a (2) (2)", "a (3)"]),
        (["x\0y\ud800"], ["x\ufffdy\ufffd"]),
        (["n" * 900, "n" * 901], ["n" * MAX_NAME_CHARACTERS, "n" * MAX_NAME_CHARACTERS + " (2)"]),
    ],
)
def test_names_are_made_unique_and_storable(names: list[str], expected: list[str]) -> None:
    assert name_takes(names) == expected
