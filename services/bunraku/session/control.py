"""A puppeteer's socket: what the controller says, and what it is told (SPEC.md, Sockets).

The stage may be at another replica: whole messages go there and come from there over the bus.
"""

from __future__ import annotations

import asyncio
from http import HTTPStatus

from starlette.websockets import WebSocket

from bunraku.backing import sockets
from bunraku.backing.access import access_of
from bunraku.backing.backing import Backing, clock
from bunraku.backing.problems import ProblemError
from bunraku.backing.sockets import Refusal
from bunraku.backing.unavailable import Unavailable
from bunraku.session.distant import DistantStage
from bunraku.session.stage_door import PRESENT
from bunraku.session.tally import RATE, Tally
from bunraku.session.visitor import QUEUE, Visitor
from bunraku.wire.errors import MalformedMessage
from bunraku.wire.messages import Input, Ping, Pong, unpack

EXCESS = 0.004
"""Seconds that one who says too much waits for each message: the line fills, and the sender's own writes wait."""
NAME = 40
"""Characters of a puppeteer's name."""


async def serve(socket: WebSocket, stage: DistantStage, backing: Backing, name: str, tally: Tally) -> None:
    """Bring a puppeteer to the stage until either ends, or what they came with; `tally` counts what is dropped here."""
    try:
        await sockets.accept(socket)
        visitor = Visitor()
        ended = backing.gate.stay(access_of(socket), visitor.turn_out)
        listening = backing.bus.subscribe(stage.told(visitor), visitor.tell)
        try:
            await _join(stage, visitor, name)
            try:
                await sockets.converse(
                    _listen(socket, stage, visitor, tally), _tell(socket, visitor), _remind(stage, visitor)
                )
            finally:
                stage.say(visitor, None)
        finally:
            listening.end()
            ended()
    except Refusal as refusal:
        await sockets.close(socket, refusal)


async def _join(stage: DistantStage, visitor: Visitor, name: str) -> None:
    try:
        await stage.join(visitor, _shown(name))
    except ProblemError as error:
        if error.status == HTTPStatus.NOT_FOUND:
            detail = "there is no such session; it may have ended"
            raise Refusal(sockets.NOT_FOUND, error.title, detail) from None
        raise Refusal(sockets.TOO_SLOW, error.title, error.detail) from None
    except Unavailable as error:
        raise Refusal(sockets.TOO_SLOW, "Not now", f"{error.what} cannot be used now; come again") from None


async def _listen(socket: WebSocket, stage: DistantStage, visitor: Visitor, tally: Tally) -> None:
    while True:
        data = await sockets.receive(socket)
        try:
            message = unpack(data)
        except MalformedMessage as error:
            raise Refusal(sockets.BROKEN, "Malformed message", str(error)) from None
        now = clock()
        if not visitor.may_speak(now):
            if isinstance(message, Input):
                visitor.notice(message.limb, "rate", now)
                tally.inputs[RATE] += 1
                await asyncio.sleep(EXCESS)
                continue
            await asyncio.sleep(EXCESS)
        if isinstance(message, Ping):
            visitor.tell(Pong(message.sequence, message.sent, now, now).pack())
        else:
            stage.say(visitor, data)


async def _tell(socket: WebSocket, visitor: Visitor) -> None:
    while True:
        await visitor.wake.wait()
        visitor.wake.clear()
        if visitor.overrun:
            raise Refusal(sockets.TOO_SLOW, "Too slow", f"{QUEUE} messages waited; come again")
        while visitor.waiting:
            await socket.send_bytes(visitor.waiting.popleft())
        if visitor.turned_out is not None:
            raise visitor.turned_out
        if visitor.gone:
            raise Refusal(sockets.TOO_SLOW, "Session elsewhere", "the session went on at another server; come again")


async def _remind(stage: DistantStage, visitor: Visitor) -> None:
    """The stage hears that its puppeteer is still there."""
    while True:
        await asyncio.sleep(PRESENT)
        stage.say(visitor, b"")


def _shown(name: str) -> str:
    """A name as it may be shown: printable, trimmed, not empty."""
    return "".join(c for c in name if c.isprintable()).strip()[:NAME] or "Someone"
