"""The one place that checks: before a request or a socket reaches its route, whether it may (docs/safety.md).

Each route declares beside its definition what it needs (`bunraku.backing.access.needs`). A path of the API that no
route has is not there, and an app with a route that declares nothing does not start.
"""

from __future__ import annotations

import asyncio
import logging
import re
import time
from collections import Counter
from collections.abc import Iterable
from typing import Any, NamedTuple
from urllib.parse import parse_qsl

from fastapi import FastAPI
from fastapi.routing import APIRoute
from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.routing import BaseRoute, Route, WebSocketRoute
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocket

from bunraku.backing import problems, sockets
from bunraku.backing.access import KEY, Access, Needs, Role, needed
from bunraku.backing.bodies import bounded, too_large
from bunraku.backing.bucket import Buckets, network
from bunraku.backing.gate import Gate, refused
from bunraku.backing.metrics import Metrics
from bunraku.backing.missing import no_such_motion, no_such_session
from bunraku.backing.origins import allowed, local, read_origins
from bunraku.backing.problems import ProblemError
from bunraku.backing.requests import ROUTE
from bunraku.backing.settings import Settings
from bunraku.backing.sockets import Refusal
from bunraku.backing.unavailable import Unavailable

API = "/v1/"
READING = ("GET", "HEAD", "OPTIONS")
"""Methods that change nothing."""
AT_ONCE = 10
"""Seconds' worth of connections that an address may open at once."""

_log = logging.getLogger(__name__)


class Way(NamedTuple):
    """A route as the guard sees it: `methods` are empty for a socket."""

    path: re.Pattern[str]
    methods: frozenset[str]
    needs: Needs
    name: str


class Undeclared(TypeError):
    """A route that does not say what it needs."""


def ways(routes: Iterable[BaseRoute]) -> list[Way]:
    """The routes of the API; raises `Undeclared`."""
    found = []
    for route in routes:
        if not isinstance(route, Route | WebSocketRoute):
            raise Undeclared(f"{route} is neither a route nor a socket: what it needs is not known")
        # FastAPI's own pages say what routes there are, and nothing else
        own = type(route) is Route and route.endpoint.__module__.startswith("fastapi.")
        what = Needs(None) if own else needed(route.endpoint)
        if what is None:
            raise Undeclared(f"{route.path} does not say what it needs: put @needs(...) beneath its decorator")
        if isinstance(route, APIRoute) and what.role is not None:
            # for those who read the API's description
            route.openapi_extra = {**(route.openapi_extra or {}), "x-role": what.role.word, "security": [{"token": []}]}
        methods = frozenset(route.methods or ()) if isinstance(route, Route) else frozenset()
        found.append(Way(route.path_regex, methods, what, route.path))
    return found


def describe(app: FastAPI) -> None:
    """Have the API's description say how tokens are sent."""
    plain = app.openapi

    def openapi() -> dict[str, Any]:
        described = plain()
        scheme = {"type": "http", "scheme": "bearer", "bearerFormat": "JWT"}
        described.setdefault("components", {})["securitySchemes"] = {"token": scheme}
        return described

    app.openapi = openapi  # type: ignore[method-assign]


class Guard:
    """Stands before an app whose API has these `ways`; what is beside the API, the page, is for everybody."""

    def __init__(self, app: ASGIApp, gate: Gate, ways: list[Way], settings: Settings, metrics: Metrics) -> None:
        self._app = app
        self._refused: Counter[tuple[str, ...]] = Counter()
        metrics.counter(
            "refusals_total",
            "Requests and sockets that the guard turned away, by the problem's title and status",
            self._refused.copy,
            ("reason", "status"),
        )
        self._gate = gate
        self._ways = ways
        self._origins = read_origins(settings.origins)
        self._patience = settings.body_seconds
        limited = gate.closed and settings.connects > 0
        self._connects = Buckets(settings.connects, settings.connects * AT_ONCE) if limited else None

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """As ASGI has it."""
        if scope["type"] == "websocket":
            await self._socket(scope, receive, send)
        elif scope["type"] == "http":
            await self._request(scope, receive, send)
        else:
            await self._app(scope, receive, send)

    async def _request(self, scope: Scope, receive: Receive, send: Send) -> None:
        headers = Headers(scope=scope)
        try:
            self._place(headers, changes=scope["method"] not in READING)
            way, parts = self._way(scope["path"], scope["method"])
            if way is not None:
                scope[ROUTE] = way.name
            elif scope["path"].startswith(API):
                raise ProblemError(404, "Not Found", f"{scope['method']} {scope['path']}: Not Found")
            most: int | None = 0
            if way is not None:
                if way.needs.counted:
                    self._often(scope)
                scope[KEY] = await self._access(scope, headers, way.needs, parts, None)
                most = way.needs.body
            announced = headers.get("content-length", "")
            if most is not None and announced.isdecimal() and int(announced[:18]) > most:
                raise too_large(most)
        except ProblemError as problem:
            self._note(scope, problem)
            await problems.response(problem, _headers(problem))(scope, receive, send)
        except HTTPException as error:
            large = ProblemError(error.status_code, "Content Too Large", str(error.detail))
            self._note(scope, large)
            await problems.response(large, dict(error.headers or {}))(scope, receive, send)
        except Unavailable as error:
            await problems.unavailable(error)(scope, receive, send)
        else:
            bound = bounded(receive, most, self._patience, asyncio.get_running_loop().time)
            private = way is not None and way.needs.role is not None and self._gate.closed
            await self._app(scope, bound, _private(send) if private else send)

    async def _socket(self, scope: Scope, receive: Receive, send: Send) -> None:
        headers = Headers(scope=scope)
        try:
            # a page elsewhere, and who comes too often, are not even shaken hands with
            self._place(headers, changes=True)
            self._often(scope)
        except ProblemError as problem:
            self._note(scope, problem)
            await WebSocket(scope, receive, send).send_denial_response(problems.response(problem, _headers(problem)))
            return
        way, parts = self._way(scope["path"], None)
        try:
            if way is None:
                raise ProblemError(404, "Not Found", f"no socket is at {scope['path'][:80]}")
            scope[ROUTE] = way.name
            query = dict(parse_qsl(scope["query_string"].decode("ascii", "replace"), max_num_fields=20))
            scope[KEY] = await self._access(scope, headers, way.needs, parts, query.get("ticket"))
        except (ProblemError, ValueError) as error:
            refusal = _refusal(error)
            self._note(scope, error if isinstance(error, ProblemError) else ProblemError(400, refusal.title, ""))
        except Unavailable as error:
            refusal = Refusal(sockets.TOO_SLOW, "Not now", f"{error.what} does not answer; come again")
        else:
            await self._app(scope, receive, send)
            return
        await sockets.close(WebSocket(scope, receive, send), refusal)

    def _note(self, scope: Scope, problem: ProblemError) -> None:
        """Count one who is turned away, and say so; the path alone, as a query may have a ticket."""
        self._refused[problem.title, str(problem.status)] += 1
        _log.info("refused %r: %s", scope["path"], problem.title)

    def _place(self, headers: Headers, *, changes: bool) -> None:
        """Refuse what another site sends; raises `ProblemError`."""
        host, origin = headers.get("host", ""), headers.get("origin")
        if not self._gate.closed and not local(host, self._origins):
            detail = f"a server without a secret answers to this machine's names, not to {host[:80]!r}"
            raise ProblemError(403, "Not by this name", detail, hint="set BUNRAKU_SECRET, or BUNRAKU_ORIGINS")
        if changes and not allowed(origin, host, self._origins):
            detail = f"pages of {(origin or '')[:80]!r} may not do this here"
            raise ProblemError(403, "Another site", detail, hint="BUNRAKU_ORIGINS names other sites that may")

    def _often(self, scope: Scope) -> None:
        """Count one connection; raises `ProblemError` where there are too many."""
        if self._connects is None or not scope.get("client"):
            return
        if not self._connects.take(network(scope["client"][0]), time.monotonic()):
            raise ProblemError(
                429, "Too many connections", "your address connects too often", hint="try again in a second"
            )

    def _way(self, path: str, method: str | None) -> tuple[Way | None, dict[str, str]]:
        """The route to a path, and the parts of the path that it names; of several with this path that of the method,
        if there is one: what else is asked with is refused by the app."""
        other: tuple[Way | None, dict[str, str]] = None, {}
        for way in self._ways:
            if bool(way.methods) == (method is not None) and (match := way.path.match(path)):
                if method is None or method in way.methods:
                    return way, match.groupdict()
                other = way, match.groupdict()
        return other

    async def _access(
        self, scope: Scope, headers: Headers, what: Needs, parts: dict[str, str], ticket: str | None
    ) -> Access:
        """The access of who comes; raises `ProblemError` where it is not enough."""
        if what.role is None:
            return Access(Role.VIEW)
        try:
            access = await self._who(headers, ticket)
        except ProblemError:
            if scope["type"] == "http" and not what.counted:
                self._often(scope)
            raise
        if access.role < what.role:
            detail = f"this needs the role {what.role.word}, and yours is {access.role.word}"
            raise ProblemError(
                403, "Not allowed", detail, needed=what.role.word, hint="ask for a link that may do this"
            )
        if access.bound and not what.all:
            await self._sees(access, parts)
        return access

    async def _who(self, headers: Headers, ticket: str | None) -> Access:
        scheme, _, token = headers.get("authorization", "").partition(" ")
        if ticket is not None:
            return await self._gate.by_ticket(ticket)
        if scheme.lower() == "bearer" and token:
            return await self._gate.by_token(token.strip())
        if self._gate.closed:
            raise refused("A link is needed", "this stage is shown to those who have a link", "ask its host for a link")
        return await self._gate.by_token("")

    async def _sees(self, access: Access, parts: dict[str, str]) -> None:
        """Raise `ProblemError` where one who is bound asks for something else: as if that were not there."""
        if "session" in parts and not await self._gate.sees(access, "session", parts["session"]):
            raise no_such_session(parts["session"])
        if "motion" in parts and not await self._gate.sees(access, "motion", parts["motion"]):
            raise no_such_motion(parts["motion"])
        if "session" not in parts and "motion" not in parts:
            raise ProblemError(403, "Not allowed", "your link is for one session or motion, this is for all")


def _headers(problem: ProblemError) -> dict[str, str]:
    """What goes with a problem (RFC 6750, 3; RFC 9110, 10.2.3)."""
    if problem.status == 401:
        known = problem.title == "A link is needed"
        error = "" if known else f', error="invalid_token", error_description="{problem.title}"'
        return {"WWW-Authenticate": f'Bearer realm="bunraku"{error}'}
    if problem.extra.get("needed"):
        scope = problem.extra["needed"]
        return {"WWW-Authenticate": f'Bearer realm="bunraku", error="insufficient_scope", scope="{scope}"'}
    return {"Retry-After": "1"} if problem.status == 429 else {}


def _refusal(error: ProblemError | ValueError) -> Refusal:
    """What a socket is told."""
    if not isinstance(error, ProblemError):
        return Refusal(sockets.BROKEN, "Unreadable query", str(error)[:80])
    codes = {401: sockets.DENIED, 403: sockets.NOT_ALLOWED, 404: sockets.NOT_FOUND, 429: sockets.TOO_SLOW}
    return Refusal(codes[error.status], error.title, error.detail)


def _private(send: Send) -> Send:
    """What needs a token is kept by the browser that has it, and by no cache on the way."""

    async def sending(message: Message) -> None:
        if message["type"] == "http.response.start":
            message["headers"] = [
                (name, value.replace(b"public", b"private") if name.lower() == b"cache-control" else value)
                for name, value in message["headers"]
            ]
        await send(message)

    return sending
