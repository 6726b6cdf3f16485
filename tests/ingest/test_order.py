from __future__ import annotations

from typing import Any

import msgpack
import pytest

from bunraku.backing.problems import ProblemError
from bunraku.ingest.order import MOST_SECONDS, Order

GOOD: dict[str, Any] = {"log": "l", "name": "Mine", "begin": 1_000_000, "end": 3_000_000, "camera": [[1, *range(7)]]}


def test_an_order_is_read_as_it_was_sent() -> None:
    order = Order.unpack(msgpack.packb(GOOD | {"later": "more"}))
    assert (order.log, order.name, order.begin, order.end) == ("l", "Mine", 1_000_000, 3_000_000)
    assert order.camera == [[1, 0, 1, 2, 3, 4, 5, 6]]
    assert order.frames == 120
    short = Order.unpack(msgpack.packb({key: GOOD[key] for key in ("log", "begin", "end")}))
    assert (short.name, short.camera) == (None, [])


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"log": None}, "log"),
        ({"begin": -1}, "begin"),
        ({"end": "late"}, "end"),
        ({"end": 1_000_000}, "seconds"),
        ({"end": 999}, "seconds"),
        ({"end": 2_000_000 + MOST_SECONDS * 1_000_000}, "seconds"),
        ({"name": "n" * 201}, "name"),
        ({"camera": [[1, 2]]}, "camera[0]"),
        ({"camera": [[1, *range(7)], [2, *range(6), float("nan")]]}, "camera[1][7]"),
        ({"camera": [[2, *range(7)], [2, *range(7)]]}, "camera"),
    ],
)
def test_what_is_wrong_is_said_with_its_field(change: dict[str, Any], field: str) -> None:
    with pytest.raises(ProblemError) as refused:
        Order.unpack(msgpack.packb(GOOD | change))
    assert refused.value.status == 422
    assert refused.value.extra["field"] == field


@pytest.mark.parametrize("data", [b"", b"\xc1", b"\x01", b"\x81\x01", msgpack.packb([1])])
def test_what_is_no_order_is_refused(data: bytes) -> None:
    with pytest.raises(ProblemError):
        Order.unpack(data)
