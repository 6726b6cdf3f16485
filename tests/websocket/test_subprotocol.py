from __future__ import annotations

from bunraku.runtime.availability import BackendUnavailable
from bunraku.websocket.subprotocol import NOT_FOUND, TRY_AGAIN_LATER, CloseConnection


def test_unavailable_backend_asks_the_client_to_try_again_later() -> None:
    reason = CloseConnection.unavailable(BackendUnavailable("the bus", "connection refused by 10.0.0.7"))
    assert (reason.code, reason.title) == (TRY_AGAIN_LATER, "Not now")
    assert "the bus" in reason.detail
    assert "10.0.0.7" not in reason.detail


def test_reason_quotes_no_unsafe_character_of_the_request() -> None:
    reason = CloseConnection(NOT_FOUND, "No such\nsession", "at /v1/\x1b]0;title\x07a\u202eb\x00" + 2_000 * "c")
    assert reason.title == "No such session"
    assert reason.detail == ("at /v1/ab" + 2_000 * "c")[:1_000]
    assert str(reason) == f"{reason.title}: {reason.detail}"
