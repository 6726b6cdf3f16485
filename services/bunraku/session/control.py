"""A puppeteer's socket: what the controller says, and what it is told (SPEC.md, Sockets)."""

from __future__ import annotations

import asyncio

from starlette.websockets import WebSocket

from bunraku.backing import sockets
from bunraku.backing.backing import clock
from bunraku.backing.sockets import Refusal
from bunraku.session.puppeteers import QUEUE, Full, Puppeteer
from bunraku.session.stage import Stage
from bunraku.wire.messages import Input, MalformedMessage, Ping, Pong, unpack

EXCESS = 0.004
"""Seconds that one who says too much waits for each message: the line fills, and the sender's own writes wait."""
NAME = 40
"""Characters of a puppeteer's name."""


async def serve(socket: WebSocket, stage: Stage | None, name: str) -> None:
    """Bring a puppeteer to the stage until either ends; None where there is no such session."""
    try:
        await sockets.accept(socket)
        if stage is None:
            raise Refusal(sockets.NOT_FOUND, "No such session", "there is no such session; it may have ended")
        try:
            puppeteer = stage.join(_shown(name))
        except Full as error:
            raise Refusal(sockets.TOO_SLOW, "Full", str(error)) from None
        try:
            await sockets.converse(_listen(socket, stage, puppeteer), _tell(socket, puppeteer))
        finally:
            stage.leave(puppeteer)
    except Refusal as refusal:
        await sockets.close(socket, refusal)


async def _listen(socket: WebSocket, stage: Stage, puppeteer: Puppeteer) -> None:
    while True:
        data = await sockets.receive(socket)
        try:
            message = unpack(data)
        except MalformedMessage as error:
            raise Refusal(sockets.BROKEN, "Malformed message", str(error)) from None
        now = clock()
        if not puppeteer.may_speak(now):
            if isinstance(message, Input):
                puppeteer.notice(message.limb, "rate", now)
                await asyncio.sleep(EXCESS)
                continue
            await asyncio.sleep(EXCESS)
        if isinstance(message, Ping):
            puppeteer.tell(Pong(message.sequence, message.sent, now, now).pack())
        else:
            stage.hear(puppeteer, message)


async def _tell(socket: WebSocket, puppeteer: Puppeteer) -> None:
    while True:
        await puppeteer.wake.wait()
        puppeteer.wake.clear()
        if puppeteer.overrun:
            raise Refusal(sockets.TOO_SLOW, "Too slow", f"{QUEUE} messages waited; come again")
        while puppeteer.waiting:
            await socket.send_bytes(puppeteer.waiting.popleft())


def _shown(name: str) -> str:
    """A name as it may be shown: printable, trimmed, not empty."""
    return "".join(c for c in name if c.isprintable()).strip()[:NAME] or "Someone"
