"""The ways of a `bunraku.v1` socket that every service shares: accept, read, and close with a reason (SPEC.md)."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Coroutine
from typing import Any

from starlette.websockets import WebSocket, WebSocketDisconnect, WebSocketState

from bunraku.wire.messages import MAX_CLIENT_MESSAGE_BYTES, SUBPROTOCOL, Problem

UNAUTHORIZED = 4401
FORBIDDEN = 4403
NOT_FOUND = 4404
UNSUPPORTED_SUBPROTOCOL = 4406
POLICY_VIOLATION = 1008
MESSAGE_TOO_BIG = 1009
INTERNAL_ERROR = 1011
TRY_AGAIN_LATER = 1013


class CloseConnection(Exception):
    """The socket is to be closed with `code`; `title` and `detail` go to the client as a Problem first."""

    def __init__(self, code: int, title: str, detail: str) -> None:
        super().__init__(f"{title}: {detail}")
        self.code, self.title, self.detail = code, title, detail


async def accept(socket: WebSocket) -> None:
    """Accept a socket that speaks `bunraku.v1`; another is told so and closed, and `Refusal` raised."""
    if SUBPROTOCOL not in socket.scope.get("subprotocols", []):
        await socket.accept()
        raise CloseConnection(UNSUPPORTED_SUBPROTOCOL, "Subprotocol", f"offer the WebSocket subprotocol {SUBPROTOCOL}")
    await socket.accept(SUBPROTOCOL)


async def run_until_first_ends(*coroutines: Coroutine[Any, Any, None]) -> None:
    """Run both ways of a socket until one ends; what ended it is raised, but for the client's going away."""
    tasks = [asyncio.create_task(way) for way in coroutines]
    try:
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks:
            task.cancel()
        ends = await asyncio.gather(*tasks, return_exceptions=True)
    for end in ends:
        if isinstance(end, BaseException) and not isinstance(end, asyncio.CancelledError | WebSocketDisconnect):
            raise end


async def close_with_problem(socket: WebSocket, reason: CloseConnection) -> None:
    """Tell the client why, and close; a client that is gone already is no trouble."""
    with contextlib.suppress(WebSocketDisconnect, RuntimeError):
        if socket.application_state is WebSocketState.CONNECTING:
            try:
                await accept(socket)
            except CloseConnection as other:
                reason = other
        await socket.send_bytes(Problem(reason.title, reason.detail).pack())
        await socket.close(reason.code, f"{reason.title}: {reason.detail}"[:120])


async def receive(socket: WebSocket) -> bytes:
    """The client's next message; raises `Refusal` for text and for one that is too long, `WebSocketDisconnect` at the
    end."""
    event = await socket.receive()
    if event["type"] == "websocket.disconnect":
        raise WebSocketDisconnect(event.get("code", 1005))
    data = event.get("bytes")
    if data is None:
        raise CloseConnection(POLICY_VIOLATION, "Text", "messages are binary")
    if len(data) > MAX_CLIENT_MESSAGE_BYTES:
        raise CloseConnection(MESSAGE_TOO_BIG, "Too large", f"a message may have {MAX_CLIENT_MESSAGE_BYTES} bytes")
    return bytes(data)
