from __future__ import annotations

import asyncio

import pytest

from bunraku.http import problem_details
from bunraku.http.problem_details import ProblemError
from bunraku.messaging.bus import MemoryBus
from bunraku.runtime import request_id


@pytest.mark.parametrize("given", ["a1b2c3d4", "A" * 64, "3f2a4c1e-8b7d-4e6f-9a01-23456789abcd", "under_score"])
def test_a_name_that_is_well_formed_is_kept(given: str) -> None:
    assert request_id.accept_or_generate([given]) == given


@pytest.mark.parametrize(
    "given",
    [[], [""], ["short"], ["a" * 65], ["has space1"], ["new\nline12"], ["semi;colon"], ["ünïcödé12"], ["a" * 8] * 2],
)
def test_one_that_is_not_gets_another(given: list[str]) -> None:
    made = request_id.accept_or_generate(given)
    assert made not in given
    assert request_id.accept_or_generate([made]) == made
    assert request_id.accept_or_generate(given) != made


def test_it_is_at_work_for_a_while() -> None:
    assert request_id.current() == ""
    assert request_id.message_headers() == {}
    with request_id.bind("one-12345"):
        with request_id.bind(""):
            assert request_id.current() == ""
        assert request_id.message_headers() == {"X-Request-Id": "one-12345"}
    assert request_id.current() == ""


@pytest.mark.parametrize(
    ("head", "name"),
    [
        (b"NATS/1.0\r\nX-Request-Id: one-12345\r\n\r\n", "one-12345"),
        (b"NATS/1.0\r\nOther: x\r\nX-Request-Id: one-12345\r\n\r\n", "one-12345"),
        (b"NATS/1.0\r\nX-Request-Id: short\r\n\r\n", ""),
        (b"NATS/1.0\r\nX-Request-Id: a b c d e f g\r\n\r\n", ""),
        (b"NATS/1.0\r\nNot-X-Request-Id: one-12345\r\n\r\n", ""),
        (b"", ""),
    ],
)
def test_it_is_read_from_a_message(head: bytes, name: str) -> None:
    assert request_id.from_message_headers(head) == name


async def test_a_question_within_a_process_has_the_name_of_who_asks() -> None:
    bus = MemoryBus()

    async def answer(_: bytes) -> bytes:
        await asyncio.sleep(0)
        return request_id.current().encode()

    bus.serve("who", answer)
    with request_id.bind("one-12345"):
        assert await bus.request("who") == b"one-12345"
    assert await bus.request("who") == b""


def test_a_problem_says_the_name() -> None:
    problem = ProblemError(404, "No such motion", "there is none")
    assert b"request_id" not in problem_details.problem_response(problem).body
    with request_id.bind("one-12345"):
        assert b'"request_id":"one-12345"' in problem_details.problem_response(problem).body
