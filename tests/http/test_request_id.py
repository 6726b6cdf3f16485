from __future__ import annotations

import asyncio

import pytest

from bunraku.http import problem_details
from bunraku.messaging.bus import MemoryBus
from bunraku.runtime import request_id
from bunraku.runtime.problem import ProblemError


@pytest.mark.parametrize("value", ["a1b2c3d4", "A" * 64, "3f2a4c1e-8b7d-4e6f-9a01-23456789abcd", "under_score"])
def test_valid_request_id_is_kept(value: str) -> None:
    assert request_id.accept_or_generate([value]) == value


@pytest.mark.parametrize(
    "values",
    [[], [""], ["short"], ["a" * 65], ["has space1"], ["new\nline12"], ["semi;colon"], ["ünïcödé12"], ["a" * 8] * 2],
)
def test_invalid_or_ambiguous_request_id_is_replaced(values: list[str]) -> None:
    generated = request_id.accept_or_generate(values)
    assert generated not in values
    assert request_id.accept_or_generate([generated]) == generated
    assert request_id.accept_or_generate(values) != generated


def test_bind_sets_the_request_id_of_its_block() -> None:
    assert request_id.current() == ""
    assert request_id.message_headers() == {}
    with request_id.bind("one-12345"):
        with request_id.bind(""):
            assert request_id.current() == ""
        assert request_id.message_headers() == {"X-Request-Id": "one-12345"}
    assert request_id.current() == ""


@pytest.mark.parametrize(
    ("raw_headers", "value"),
    [
        (b"NATS/1.0\r\nX-Request-Id: one-12345\r\n\r\n", "one-12345"),
        (b"NATS/1.0\r\nOther: x\r\nX-Request-Id: one-12345\r\n\r\n", "one-12345"),
        (b"NATS/1.0\r\nX-Request-Id: short\r\n\r\n", ""),
        (b"NATS/1.0\r\nX-Request-Id: a b c d e f g\r\n\r\n", ""),
        (b"NATS/1.0\r\nNot-X-Request-Id: one-12345\r\n\r\n", ""),
        (b"", ""),
    ],
)
def test_request_id_is_read_from_message_headers(raw_headers: bytes, value: str) -> None:
    assert request_id.from_message_headers(raw_headers) == value


async def test_bus_request_carries_the_request_id() -> None:
    bus = MemoryBus()

    async def answer(_: bytes) -> bytes:
        await asyncio.sleep(0)
        return request_id.current().encode()

    bus.serve("echo", answer)
    with request_id.bind("one-12345"):
        assert await bus.request("echo") == b"one-12345"
    assert await bus.request("echo") == b""


def test_problem_document_contains_the_request_id() -> None:
    problem = ProblemError(404, "No such motion", "there is none")
    assert b"request_id" not in problem_details.problem_response(problem).body
    with request_id.bind("one-12345"):
        assert b'"request_id":"one-12345"' in problem_details.problem_response(problem).body
