"""Subprotocol `bunraku.v1` on ASGI WebSockets: accept, receive, and close with a reason (proto/SPEC.md)."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Coroutine
from typing import Any

from starlette.websockets import WebSocket, WebSocketDisconnect, WebSocketState

from bunraku.runtime.availability import BackendUnavailable
from bunraku.websocket.frame import MESSAGE_TOO_BIG
from bunraku.wire.messages import MAX_CLIENT_MESSAGE_BYTES, SUBPROTOCOL, Problem

UNAUTHORIZED = 4401
FORBIDDEN = 4403
NOT_FOUND = 4404
UNSUPPORTED_SUBPROTOCOL = 4406
POLICY_VIOLATION = 1008
INTERNAL_ERROR = 1011
SERVICE_RESTART = 1012
TRY_AGAIN_LATER = 1013


class CloseConnection(Exception):
    """Reason to close a connection. The client receives `title` and `detail` in a Problem message before the Close."""

    def __init__(self, code: int, title: str, detail: str) -> None:
        super().__init__(f"{title}: {detail}")
        self.code, self.title, self.detail = code, title, detail

    @classmethod
    def unavailable(cls, error: BackendUnavailable) -> CloseConnection:
        """Return the reason for a connection that needs an unavailable backend."""
        return cls(TRY_AGAIN_LATER, "Not now", f"{error.backend} is unavailable; try again later")


async def accept(socket: WebSocket) -> None:
    """Accept a WebSocket. Raises `CloseConnection` if the client does not offer `bunraku.v1`."""
    if SUBPROTOCOL not in socket.scope.get("subprotocols", []):
        await socket.accept()
        raise CloseConnection(
            UNSUPPORTED_SUBPROTOCOL, "Subprotocol", f"connect with the WebSocket subprotocol {SUBPROTOCOL}"
        )
    await socket.accept(SUBPROTOCOL)


async def run_until_first_ends(*coroutines: Coroutine[Any, Any, None]) -> None:
    """Run coroutines until one ends, then cancel the others.

    Raises the exception of the one that ended, except `WebSocketDisconnect`.
    """
    tasks = [asyncio.create_task(coroutine) for coroutine in coroutines]
    try:
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks:
            task.cancel()
        results = await asyncio.gather(*tasks, return_exceptions=True)
    for result in results:
        if isinstance(result, BaseException) and not isinstance(result, asyncio.CancelledError | WebSocketDisconnect):
            raise result


async def close_with_problem(socket: WebSocket, reason: CloseConnection) -> None:
    """Send a Problem message and close the connection. Accept it first if necessary.

    Does nothing if the client has already disconnected.
    """
    with contextlib.suppress(WebSocketDisconnect, RuntimeError):
        if socket.application_state is WebSocketState.CONNECTING:
            try:
                await accept(socket)
            except CloseConnection as unsupported:
                reason = unsupported
        await socket.send_bytes(Problem(reason.title, reason.detail).pack())
        await socket.close(reason.code, f"{reason.title}: {reason.detail}"[:120])


async def receive(socket: WebSocket) -> bytes:
    """Return the next message of the client.

    Raises `CloseConnection` for a text message and for one that is too long, `WebSocketDisconnect` when the connection
    has ended.
    """
    event = await socket.receive()
    if event["type"] == "websocket.disconnect":
        raise WebSocketDisconnect(event.get("code", 1005))
    data = event.get("bytes")
    if data is None:
        raise CloseConnection(POLICY_VIOLATION, "Text", "received a text message; messages are binary")
    if len(data) > MAX_CLIENT_MESSAGE_BYTES:
        raise CloseConnection(
            MESSAGE_TOO_BIG, "Too large", f"a message has {len(data)} bytes; the limit is {MAX_CLIENT_MESSAGE_BYTES}"
        )
    return bytes(data)
