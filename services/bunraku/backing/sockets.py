"""The ways of a `bunraku.v1` socket that every service shares: accept, read, and close with a reason (SPEC.md)."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Coroutine
from typing import Any

from starlette.websockets import WebSocket, WebSocketDisconnect, WebSocketState

from bunraku.wire.messages import LARGEST_FROM_CLIENT, SUBPROTOCOL, Problem

DENIED = 4401
NOT_ALLOWED = 4403
NOT_FOUND = 4404
NOT_SPOKEN = 4406
BROKEN = 1008
TOO_LARGE = 1009
FAULT = 1011
TOO_SLOW = 1013


class Refusal(Exception):
    """The socket is to be closed with `code`; `title` and `detail` go to the client as a Problem first."""

    def __init__(self, code: int, title: str, detail: str) -> None:
        super().__init__(f"{title}: {detail}")
        self.code, self.title, self.detail = code, title, detail


async def accept(socket: WebSocket) -> None:
    """Accept a socket that speaks `bunraku.v1`; another is told so and closed, and `Refusal` raised."""
    if SUBPROTOCOL not in socket.scope.get("subprotocols", []):
        await socket.accept()
        raise Refusal(NOT_SPOKEN, "Subprotocol", f"offer the WebSocket subprotocol {SUBPROTOCOL}")
    await socket.accept(SUBPROTOCOL)


async def converse(*ways: Coroutine[Any, Any, None]) -> None:
    """Run both ways of a socket until one ends; what ended it is raised, but for the client's going away."""
    tasks = [asyncio.create_task(way) for way in ways]
    try:
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks:
            task.cancel()
        ends = await asyncio.gather(*tasks, return_exceptions=True)
    for end in ends:
        if isinstance(end, BaseException) and not isinstance(end, asyncio.CancelledError | WebSocketDisconnect):
            raise end


async def close(socket: WebSocket, refusal: Refusal) -> None:
    """Tell the client why, and close; a client that is gone already is no trouble."""
    with contextlib.suppress(WebSocketDisconnect, RuntimeError):
        if socket.application_state is WebSocketState.CONNECTING:
            try:
                await accept(socket)
            except Refusal as other:
                refusal = other
        await socket.send_bytes(Problem(refusal.title, refusal.detail).pack())
        await socket.close(refusal.code, f"{refusal.title}: {refusal.detail}"[:120])


async def receive(socket: WebSocket) -> bytes:
    """The client's next message; raises `Refusal` for text and for one that is too long, `WebSocketDisconnect` at the
    end."""
    event = await socket.receive()
    if event["type"] == "websocket.disconnect":
        raise WebSocketDisconnect(event.get("code", 1005))
    data = event.get("bytes")
    if data is None:
        raise Refusal(BROKEN, "Text", "messages are binary")
    if len(data) > LARGEST_FROM_CLIENT:
        raise Refusal(TOO_LARGE, "Too large", f"a message may have {LARGEST_FROM_CLIENT} bytes")
    return bytes(data)
