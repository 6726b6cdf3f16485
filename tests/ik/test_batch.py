from __future__ import annotations

import json

import msgpack
import numpy as np
import pytest

from bunraku.ik import batch
from bunraku.marionette import bend_table
from bunraku.marionette.proportions import Proportions
from bunraku.runtime.problem import ProblemError

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
    assert batch.parse_content_type(header) == kind


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
    assert batch.negotiate_media_type(header, batch.MSGPACK) == kind


def test_kinds_not_spoken_are_refused() -> None:
    with pytest.raises(ProblemError) as refused:
        batch.parse_content_type("text/csv")
    assert refused.value.status == 415
    with pytest.raises(ProblemError) as refused:
        batch.negotiate_media_type("text/csv", batch.JSON)
    assert refused.value.status == 406


def test_decode_says_where_a_request_is_wrong() -> None:
    asked = batch.decode_request(msgpack.packb({"proportions": IDENTITY, "legs": [1], "unknown": 3}), batch.MSGPACK)
    assert asked.legs == [1.0]
    assert asked.targets == []
    with pytest.raises(ProblemError) as refused:
        batch.decode_request(b'{"proportions": "x", "targets": [[0, 0, 1e300]]}', batch.JSON)
    assert refused.value.status == 422
    assert refused.value.extra["field"] == "targets[0][2]"
    with pytest.raises(ProblemError) as refused:
        batch.decode_request(b"{", batch.JSON)
    assert refused.value.status == 400


def test_solve_answers_alike_in_both_forms() -> None:
    asked = batch.SolveRequest(proportions=IDENTITY, targets=[(0.1, -0.4, 0.5)], legs=[0.5])
    proportions = Proportions.parse(IDENTITY)
    data = bend_table.pack_bend_table(bend_table.build_bend_table(proportions))
    said = json.loads(batch.solve_batch(asked, proportions, data, batch.JSON))
    packed = msgpack.unpackb(batch.solve_batch(asked, proportions, data, batch.MSGPACK))
    assert said == packed
    batch.SolveAnswer.model_validate(said)
    np.testing.assert_allclose(said["arms"]["tip"], [[0.1, -0.4, 0.5]], atol=1e-12)
    assert said["legs"] == {"hip": [0.5], "knee": [0.5]}
