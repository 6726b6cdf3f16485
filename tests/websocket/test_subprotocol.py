from __future__ import annotations

from bunraku.runtime.availability import BackendUnavailable
from bunraku.websocket.subprotocol import TRY_AGAIN_LATER, CloseConnection


def test_unavailable_backend_asks_the_client_to_try_again_later() -> None:
    reason = CloseConnection.unavailable(BackendUnavailable("the bus", "connection refused by 10.0.0.7"))
    assert (reason.code, reason.title) == (TRY_AGAIN_LATER, "Not now")
    assert "the bus" in reason.detail
    assert "10.0.0.7" not in reason.detail
