from __future__ import annotations

import json

import msgpack
import numpy as np
import pytest

from bunraku.backing.problems import ProblemError
from bunraku.ik import batch
from bunraku.marionette import table
from bunraku.marionette.proportions import Proportions

IDENTITY = "396-352-252-560-320-120"


@pytest.mark.parametrize(
    ("header", "kind"),
    [
        (None, batch.JSON),
        ("application/json; charset=utf-8", batch.JSON),
        ("Application/MsgPack", batch.MSGPACK),
        ("application/vnd.msgpack", batch.MSGPACK),
    ],
)
def test_content_kind(header: str | None, kind: str) -> None:
    assert batch.content_kind(header) == kind


@pytest.mark.parametrize(
    ("header", "kind"),
    [
        (None, batch.MSGPACK),
        ("*/*", batch.MSGPACK),
        ("text/html, application/*;q=0.5", batch.MSGPACK),
        ("text/html, application/json;q=0.9", batch.JSON),
    ],
)
def test_accepted_kind_of_a_messagepack_request(header: str | None, kind: str) -> None:
    assert batch.accepted_kind(header, batch.MSGPACK) == kind


def test_kinds_not_spoken_are_refused() -> None:
    with pytest.raises(ProblemError) as refused:
        batch.content_kind("text/csv")
    assert refused.value.status == 415
    with pytest.raises(ProblemError) as refused:
        batch.accepted_kind("text/csv", batch.JSON)
    assert refused.value.status == 406


def test_decode_says_where_a_request_is_wrong() -> None:
    asked = batch.decode(msgpack.packb({"proportions": IDENTITY, "legs": [1], "unknown": 3}), batch.MSGPACK)
    assert asked.legs == [1.0]
    assert asked.targets == []
    with pytest.raises(ProblemError) as refused:
        batch.decode(b'{"proportions": "x", "targets": [[0, 0, 1e300]]}', batch.JSON)
    assert refused.value.status == 422
    assert refused.value.extra["field"] == "targets[0][2]"
    with pytest.raises(ProblemError) as refused:
        batch.decode(b"{", batch.JSON)
    assert refused.value.status == 400


def test_solve_answers_alike_in_both_forms() -> None:
    asked = batch.SolveRequest(proportions=IDENTITY, targets=[(0.1, -0.4, 0.5)], legs=[0.5])
    proportions = Proportions.parse(IDENTITY)
    data = table.to_bytes(table.build_table(proportions))
    said = json.loads(batch.solve(asked, proportions, data, batch.JSON))
    packed = msgpack.unpackb(batch.solve(asked, proportions, data, batch.MSGPACK))
    assert said == packed
    batch.SolveAnswer.model_validate(said)
    np.testing.assert_allclose(said["arms"]["tip"], [[0.1, -0.4, 0.5]], atol=1e-12)
    assert said["legs"] == {"hip": [0.5], "knee": [0.5]}
