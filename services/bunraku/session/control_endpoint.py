"""A puppeteer's socket: what the controller says, and what it is told (SPEC.md, Sockets).

The stage may be at another replica: whole messages go there and come from there over the bus.
"""

from __future__ import annotations

import asyncio
from http import HTTPStatus

from starlette.websockets import WebSocket

from bunraku.http.access_control import access_of
from bunraku.runtime.availability import BackendUnavailable
from bunraku.runtime.clock import clock
from bunraku.runtime.context import ServiceContext
from bunraku.runtime.problem import ProblemError
from bunraku.session.counters import RATE_LIMITED, SessionCounters
from bunraku.session.puppeteer_connection import MAX_QUEUED_MESSAGES, PuppeteerConnection
from bunraku.session.stage_endpoint import PUPPETEER_HEARTBEAT_S
from bunraku.session.stage_proxy import StageProxy
from bunraku.websocket import subprotocol
from bunraku.websocket.subprotocol import CloseConnection
from bunraku.wire.errors import MalformedMessage
from bunraku.wire.messages import Input, Ping, Pong, unpack

RATE_LIMIT_DELAY_S = 0.004
"""Seconds that one who says too much waits for each message: the line fills, and the sender's own writes wait."""
MAX_NAME_CHARACTERS = 40
"""Characters of a puppeteer's name."""


async def serve_puppeteer(
    socket: WebSocket, stage: StageProxy, context: ServiceContext, name: str, counters: SessionCounters
) -> None:
    """Bring a puppeteer to the stage until either ends, or what they came with; `tally` counts what is dropped here."""
    try:
        await subprotocol.accept(socket)
        visitor = PuppeteerConnection()
        ended = context.authenticator.register_connection(access_of(socket), visitor.close)
        listening = context.bus.subscribe(stage.outgoing_subject(visitor), visitor.send)
        try:
            await _join_stage(stage, visitor, name)
            try:
                await subprotocol.run_until_first_ends(
                    _receive_messages(socket, stage, visitor, counters),
                    _send_messages(socket, visitor),
                    _send_heartbeats(stage, visitor),
                )
            finally:
                stage.send(visitor, None)
        finally:
            listening.unsubscribe()
            ended()
    except CloseConnection as refusal:
        await subprotocol.close_with_problem(socket, refusal)


async def _join_stage(stage: StageProxy, connection: PuppeteerConnection, name: str) -> None:
    try:
        await stage.join(connection, _display_name(name))
    except ProblemError as error:
        if error.status == HTTPStatus.NOT_FOUND:
            detail = "there is no such session; it may have ended"
            raise CloseConnection(subprotocol.NOT_FOUND, error.title, detail) from None
        raise CloseConnection(subprotocol.TRY_AGAIN_LATER, error.title, error.detail) from None
    except BackendUnavailable as error:
        raise CloseConnection(
            subprotocol.TRY_AGAIN_LATER, "Not now", f"{error.backend} cannot be used now; come again"
        ) from None


async def _receive_messages(
    socket: WebSocket, stage: StageProxy, connection: PuppeteerConnection, counters: SessionCounters
) -> None:
    while True:
        data = await subprotocol.receive(socket)
        try:
            message = unpack(data)
        except MalformedMessage as error:
            raise CloseConnection(subprotocol.POLICY_VIOLATION, "Malformed message", str(error)) from None
        now = clock()
        if not connection.may_send(now):
            if isinstance(message, Input):
                connection.send_notice(message.limb, "rate", now)
                counters.inputs[RATE_LIMITED] += 1
                await asyncio.sleep(RATE_LIMIT_DELAY_S)
                continue
            await asyncio.sleep(RATE_LIMIT_DELAY_S)
        if isinstance(message, Ping):
            connection.send(Pong(message.sequence, message.sent, now, now).pack())
        else:
            stage.send(connection, data)


async def _send_messages(socket: WebSocket, connection: PuppeteerConnection) -> None:
    while True:
        await connection.has_messages.wait()
        connection.has_messages.clear()
        if connection.is_overrun:
            raise CloseConnection(
                subprotocol.TRY_AGAIN_LATER, "Too slow", f"{MAX_QUEUED_MESSAGES} messages waited; come again"
            )
        while connection.queued:
            await socket.send_bytes(connection.queued.popleft())
        if connection.close_reason is not None:
            raise connection.close_reason
        if connection.is_unknown:
            raise CloseConnection(
                subprotocol.TRY_AGAIN_LATER, "Session elsewhere", "the session went on at another server; come again"
            )


async def _send_heartbeats(stage: StageProxy, connection: PuppeteerConnection) -> None:
    """The stage hears that its puppeteer is still there."""
    while True:
        await asyncio.sleep(PUPPETEER_HEARTBEAT_S)
        stage.send(connection, b"")


def _display_name(name: str) -> str:
    """A name as it may be shown: printable, trimmed, not empty."""
    return "".join(c for c in name if c.isprintable()).strip()[:MAX_NAME_CHARACTERS] or "Someone"
