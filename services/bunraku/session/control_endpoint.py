"""WebSocket endpoint of a puppeteer (proto/server.md, 6.1).

The stage may be on another replica: messages travel to and from it over the bus.
"""

from __future__ import annotations

from contextlib import ExitStack
from http import HTTPStatus

from starlette.websockets import WebSocket

from bunraku.http.access_control import access_of
from bunraku.runtime.availability import BackendUnavailable
from bunraku.runtime.context import ServiceContext
from bunraku.runtime.display_text import clean_text
from bunraku.runtime.problem import ProblemError
from bunraku.session.counters import SessionCounters
from bunraku.session.puppeteer_connection import PUPPETEER_FRAMES, PuppeteerConnection
from bunraku.session.stage_proxy import StageProxy
from bunraku.websocket import subprotocol
from bunraku.websocket.handoff import detach, reject
from bunraku.websocket.subprotocol import CloseConnection

MAX_NAME_CHARACTERS = 40
"""Longest name of a puppeteer."""


async def serve_puppeteer(
    socket: WebSocket, stage: StageProxy, context: ServiceContext, name: str, counters: SessionCounters
) -> None:
    """Connect a puppeteer to the stage until one of them ends or the access expires.

    `counters` count the inputs that the rate limit drops.
    """
    connection = PuppeteerConnection(stage, counters, context.clock)
    try:
        with ExitStack() as stack:
            stack.callback(context.bus.subscribe(stage.outgoing_subject(connection), connection.send).unsubscribe)
            await _join_stage(stage, connection, name)
            stack.callback(stage.send, connection, None)
            await subprotocol.accept(socket)
            accepted = detach(socket, connection, context.clock, PUPPETEER_FRAMES)
            stack.callback(context.authenticator.register_connection(access_of(socket), connection.close))
            accepted.on_ended = stack.pop_all().close
        connection.open(accepted)
    except CloseConnection as reason:
        await reject(socket, reason)


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


def _display_name(name: str) -> str:
    """Return a name that is safe to display and not empty."""
    return clean_text(name, MAX_NAME_CHARACTERS) or "Someone"
