from __future__ import annotations

import json

import msgpack
import numpy as np
import pytest

from bunraku.http.openapi import JSON
from bunraku.ik import batch
from bunraku.marionette import bend_table
from bunraku.marionette.proportions import Proportions
from bunraku.runtime.problem import ProblemError

IDENTITY = "396-352-252-560-320-120"


@pytest.mark.parametrize(
    ("header", "media_type"),
    [
        (None, JSON),
        ("application/json; charset=utf-8", JSON),
        ("Application/MsgPack", batch.MSGPACK),
        ("application/vnd.msgpack", batch.MSGPACK),
    ],
)
def test_content_type_is_parsed(header: str | None, media_type: str) -> None:
    assert batch.parse_content_type(header) == media_type


@pytest.mark.parametrize(
    ("header", "media_type"),
    [
        (None, batch.MSGPACK),
        ("*/*", batch.MSGPACK),
        ("text/html, application/*;q=0.5", batch.MSGPACK),
        ("text/html, application/json;q=0.9", JSON),
    ],
)
def test_accept_header_of_a_messagepack_request(header: str | None, media_type: str) -> None:
    assert batch.negotiate_media_type(header, batch.MSGPACK) == media_type


def test_unsupported_media_types_give_415_and_406() -> None:
    with pytest.raises(ProblemError) as refused:
        batch.parse_content_type("text/csv")
    assert refused.value.status == 415
    with pytest.raises(ProblemError) as refused:
        batch.negotiate_media_type("text/csv", JSON)
    assert refused.value.status == 406


def test_decode_error_names_the_field() -> None:
    request = batch.decode_request(msgpack.packb({"proportions": IDENTITY, "legs": [1], "unknown": 3}), batch.MSGPACK)
    assert request.legs == [1.0]
    assert request.targets == []
    with pytest.raises(ProblemError) as refused:
        batch.decode_request(b'{"proportions": "x", "targets": [[0, 0, 1e300]]}', JSON)
    assert refused.value.status == 422
    assert refused.value.extra["field"] == "targets[0][2]"
    with pytest.raises(ProblemError) as refused:
        batch.decode_request(b"{", JSON)
    assert refused.value.status == 400


def test_json_and_messagepack_solutions_are_equal() -> None:
    request = batch.SolveRequest(proportions=IDENTITY, targets=[(0.1, -0.4, 0.5)], legs=[0.5])
    proportions = Proportions.parse(IDENTITY)
    data = bend_table.pack_bend_table(bend_table.build_bend_table(proportions))
    solution = json.loads(batch.solve_batch(request, proportions, data, JSON))
    packed = msgpack.unpackb(batch.solve_batch(request, proportions, data, batch.MSGPACK))
    assert solution == packed
    batch.SolveAnswer.model_validate(solution)
    np.testing.assert_allclose(solution["arms"]["tip"], [[0.1, -0.4, 0.5]], atol=1e-12)
    assert solution["legs"] == {"hip": [0.5], "knee": [0.5]}
