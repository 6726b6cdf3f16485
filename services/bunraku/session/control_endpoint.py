"""WebSocket endpoint of a puppeteer (proto/server.md, 6.1).

The stage may be on another replica: messages travel to and from it over the bus.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from http import HTTPStatus

from starlette.websockets import WebSocket

from bunraku.http.access_control import access_of
from bunraku.runtime.availability import BackendUnavailable
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
"""Delay of each message above the rate limit: the link fills, and the sender's writes block."""
MAX_NAME_CHARACTERS = 40
"""Longest name of a puppeteer."""


async def serve_puppeteer(
    socket: WebSocket, stage: StageProxy, context: ServiceContext, name: str, counters: SessionCounters
) -> None:
    """Connect a puppeteer to the stage until one of them ends or the access expires.

    `counters` count the inputs that the rate limit drops.
    """
    try:
        await subprotocol.accept(socket)
        connection = PuppeteerConnection()
        unregister = context.authenticator.register_connection(access_of(socket), connection.close)
        subscription = context.bus.subscribe(stage.outgoing_subject(connection), connection.send)
        try:
            await _join_stage(stage, connection, name)
            try:
                await subprotocol.run_until_first_ends(
                    _receive_messages(socket, stage, connection, counters, context.clock),
                    _send_messages(socket, connection),
                    _send_heartbeats(stage, connection),
                )
            finally:
                stage.send(connection, None)
        finally:
            subscription.unsubscribe()
            unregister()
    except CloseConnection as reason:
        await subprotocol.close_with_problem(socket, reason)


async def _join_stage(stage: StageProxy, connection: PuppeteerConnection, name: str) -> None:
    try:
        await stage.join(connection, _display_name(name))
    except ProblemError as error:
        if error.status == HTTPStatus.NOT_FOUND:
            detail = "there is no session with this id; it may have ended"
            raise CloseConnection(subprotocol.NOT_FOUND, error.title, detail) from None
        raise CloseConnection(subprotocol.TRY_AGAIN_LATER, error.title, error.detail) from None
    except BackendUnavailable as error:
        raise CloseConnection(
            subprotocol.TRY_AGAIN_LATER, "Not now", f"{error.backend} is unavailable; reconnect"
        ) from None


async def _receive_messages(
    socket: WebSocket,
    stage: StageProxy,
    connection: PuppeteerConnection,
    counters: SessionCounters,
    clock: Callable[[], int],
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
                subprotocol.TRY_AGAIN_LATER, "Too slow", f"{MAX_QUEUED_MESSAGES} messages were queued; reconnect"
            )
        while connection.queued:
            await socket.send_bytes(connection.queued.popleft())
        if connection.close_reason is not None:
            raise connection.close_reason
        if connection.is_unknown:
            raise CloseConnection(
                subprotocol.TRY_AGAIN_LATER, "Session elsewhere", "another server has taken over the session; reconnect"
            )


async def _send_heartbeats(stage: StageProxy, connection: PuppeteerConnection) -> None:
    """Send the stage heartbeats for the puppeteer, until cancelled."""
    while True:
        await asyncio.sleep(PUPPETEER_HEARTBEAT_S)
        stage.send(connection, b"")


def _display_name(name: str) -> str:
    """Return a name for display: printable, trimmed, not empty."""
    return "".join(c for c in name if c.isprintable()).strip()[:MAX_NAME_CHARACTERS] or "Someone"
