"""The one place that checks: before a request or a socket reaches its route, whether it may (docs/safety.md).

Each route declares beside its definition what it needs (`bunraku.http.access_control.needs`). A path of the API that no
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

from bunraku.http import problem_details
from bunraku.http.access_control import ACCESS_SCOPE_KEY, Access, Requirement, Role, requirement_of
from bunraku.http.access_log import ROUTE_SCOPE_KEY
from bunraku.http.authentication import Authenticator, unauthorized
from bunraku.http.not_found import motion_not_found, session_not_found
from bunraku.http.origin import is_allowed_origin, is_local_host, parse_origins
from bunraku.http.problem_details import ProblemError
from bunraku.http.request_body import content_too_large, limit_body
from bunraku.http.token_bucket import KeyedTokenBuckets, client_network
from bunraku.runtime.availability import BackendUnavailable
from bunraku.runtime.metrics import Metrics
from bunraku.runtime.settings import Settings
from bunraku.websocket import subprotocol
from bunraku.websocket.subprotocol import CloseConnection

API_PREFIX = "/v1/"
SAFE_METHODS = ("GET", "HEAD", "OPTIONS")
"""Methods that change nothing."""
CONNECT_BURST_S = 10
"""Seconds' worth of connections that an address may open at once."""

_log = logging.getLogger(__name__)


class RouteRule(NamedTuple):
    """A route as the guard sees it: `methods` are empty for a socket."""

    path: re.Pattern[str]
    methods: frozenset[str]
    requirement: Requirement
    route: str


class UndeclaredRequirement(TypeError):
    """A route that does not say what it needs."""


def collect_route_rules(routes: Iterable[BaseRoute]) -> list[RouteRule]:
    """The routes of the API; raises `Undeclared`."""
    found = []
    for route in routes:
        if not isinstance(route, Route | WebSocketRoute):
            raise UndeclaredRequirement(f"{route} is neither a route nor a socket: what it needs is not known")
        # FastAPI's own pages say what routes there are, and nothing else
        own = type(route) is Route and route.endpoint.__module__.startswith("fastapi.")
        what = Requirement(None) if own else requirement_of(route.endpoint)
        if what is None:
            raise UndeclaredRequirement(
                f"{route.path} does not say what it needs: put @needs(...) beneath its decorator"
            )
        if isinstance(route, APIRoute) and what.role is not None:
            # for those who read the API's description
            route.openapi_extra = {
                **(route.openapi_extra or {}),
                "x-role": what.role.label,
                "security": [{"token": []}],
            }
        methods = frozenset(route.methods or ()) if isinstance(route, Route) else frozenset()
        found.append(RouteRule(route.path_regex, methods, what, route.path))
    return found


def add_security_scheme(app: FastAPI) -> None:
    """Have the API's description say how tokens are sent."""
    plain = app.openapi

    def openapi() -> dict[str, Any]:
        described = plain()
        scheme = {"type": "http", "scheme": "bearer", "bearerFormat": "JWT"}
        described.setdefault("components", {})["securitySchemes"] = {"token": scheme}
        return described

    app.openapi = openapi  # type: ignore[method-assign]


class AuthorizationMiddleware:
    """Stands before an app whose API has these `ways`; what is beside the API, the page, is for everybody."""

    def __init__(
        self, app: ASGIApp, authenticator: Authenticator, rules: list[RouteRule], settings: Settings, metrics: Metrics
    ) -> None:
        self._app = app
        self._rejections: Counter[tuple[str, ...]] = Counter()
        metrics.counter(
            "refusals_total",
            "Requests and sockets that the guard turned away, by the problem's title and status",
            self._rejections.copy,
            ("reason", "status"),
        )
        self._authenticator = authenticator
        self._rules = rules
        self._allowed_origins = parse_origins(settings.origins)
        self._body_timeout_s = settings.body_seconds
        limited = authenticator.requires_token and settings.connects > 0
        self._connect_buckets = (
            KeyedTokenBuckets(settings.connects, settings.connects * CONNECT_BURST_S) if limited else None
        )

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """As ASGI has it."""
        if scope["type"] == "websocket":
            await self._handle_websocket(scope, receive, send)
        elif scope["type"] == "http":
            await self._handle_request(scope, receive, send)
        else:
            await self._app(scope, receive, send)

    async def _handle_request(self, scope: Scope, receive: Receive, send: Send) -> None:
        headers = Headers(scope=scope)
        try:
            self._check_origin(headers, unsafe=scope["method"] not in SAFE_METHODS)
            way, parts = self._match_route(scope["path"], scope["method"])
            if way is not None:
                scope[ROUTE_SCOPE_KEY] = way.route
            elif scope["path"].startswith(API_PREFIX):
                raise ProblemError(404, "Not Found", f"{scope['method']} {scope['path']}: Not Found")
            most: int | None = 0
            if way is not None:
                if way.requirement.rate_limited:
                    self._limit_connect_rate(scope)
                scope[ACCESS_SCOPE_KEY] = await self._authorize(scope, headers, way.requirement, parts, None)
                most = way.requirement.max_body_bytes
            announced = headers.get("content-length", "")
            if most is not None and announced.isdecimal() and int(announced[:18]) > most:
                raise content_too_large(most)
        except ProblemError as problem:
            self._record_rejection(scope, problem)
            await problem_details.problem_response(problem, _problem_headers(problem))(scope, receive, send)
        except HTTPException as error:
            large = ProblemError(error.status_code, "Content Too Large", str(error.detail))
            self._record_rejection(scope, large)
            await problem_details.problem_response(large, dict(error.headers or {}))(scope, receive, send)
        except BackendUnavailable as error:
            await problem_details.unavailable_response(error)(scope, receive, send)
        else:
            bound = limit_body(receive, most, self._body_timeout_s, asyncio.get_running_loop().time)
            private = way is not None and way.requirement.role is not None and self._authenticator.requires_token
            await self._app(scope, bound, _mark_cache_private(send) if private else send)

    async def _handle_websocket(self, scope: Scope, receive: Receive, send: Send) -> None:
        headers = Headers(scope=scope)
        try:
            # a page elsewhere, and who comes too often, are not even shaken hands with
            self._check_origin(headers, unsafe=True)
            self._limit_connect_rate(scope)
        except ProblemError as problem:
            self._record_rejection(scope, problem)
            await WebSocket(scope, receive, send).send_denial_response(
                problem_details.problem_response(problem, _problem_headers(problem))
            )
            return
        way, parts = self._match_route(scope["path"], None)
        try:
            if way is None:
                raise ProblemError(404, "Not Found", f"no socket is at {scope['path'][:80]}")
            scope[ROUTE_SCOPE_KEY] = way.route
            query = dict(parse_qsl(scope["query_string"].decode("ascii", "replace"), max_num_fields=20))
            scope[ACCESS_SCOPE_KEY] = await self._authorize(scope, headers, way.requirement, parts, query.get("ticket"))
        except (ProblemError, ValueError) as error:
            refusal = _close_reason(error)
            self._record_rejection(
                scope, error if isinstance(error, ProblemError) else ProblemError(400, refusal.title, "")
            )
        except BackendUnavailable as error:
            refusal = CloseConnection(
                subprotocol.TRY_AGAIN_LATER, "Not now", f"{error.backend} does not answer; come again"
            )
        else:
            await self._app(scope, receive, send)
            return
        await subprotocol.close_with_problem(WebSocket(scope, receive, send), refusal)

    def _record_rejection(self, scope: Scope, problem: ProblemError) -> None:
        """Count one who is turned away, and say so; the path alone, as a query may have a ticket."""
        self._rejections[problem.title, str(problem.status)] += 1
        _log.info("refused %r: %s", scope["path"], problem.title)

    def _check_origin(self, headers: Headers, *, unsafe: bool) -> None:
        """Refuse what another site sends; raises `ProblemError`."""
        host, origin = headers.get("host", ""), headers.get("origin")
        if not self._authenticator.requires_token and not is_local_host(host, self._allowed_origins):
            detail = f"a server without a secret answers to this machine's names, not to {host[:80]!r}"
            raise ProblemError(403, "Not by this name", detail, hint="set BUNRAKU_SECRET, or BUNRAKU_ORIGINS")
        if unsafe and not is_allowed_origin(origin, host, self._allowed_origins):
            detail = f"pages of {(origin or '')[:80]!r} may not do this here"
            raise ProblemError(403, "Another site", detail, hint="BUNRAKU_ORIGINS names other sites that may")

    def _limit_connect_rate(self, scope: Scope) -> None:
        """Count one connection; raises `ProblemError` where there are too many."""
        if self._connect_buckets is None or not scope.get("client"):
            return
        if not self._connect_buckets.take(client_network(scope["client"][0]), time.monotonic()):
            raise ProblemError(
                429, "Too many connections", "your address connects too often", hint="try again in a second"
            )

    def _match_route(self, path: str, method: str | None) -> tuple[RouteRule | None, dict[str, str]]:
        """The route to a path, and the parts of the path that it names; of several with this path that of the method,
        if there is one: what else is asked with is refused by the app."""
        other: tuple[RouteRule | None, dict[str, str]] = None, {}
        for way in self._rules:
            if bool(way.methods) == (method is not None) and (match := way.path.match(path)):
                if method is None or method in way.methods:
                    return way, match.groupdict()
                other = way, match.groupdict()
        return other

    async def _authorize(
        self, scope: Scope, headers: Headers, requirement: Requirement, path_params: dict[str, str], ticket: str | None
    ) -> Access:
        """The access of who comes; raises `ProblemError` where it is not enough."""
        if requirement.role is None:
            return Access(Role.VIEW)
        try:
            access = await self._authenticate(headers, ticket)
        except ProblemError:
            if scope["type"] == "http" and not requirement.rate_limited:
                self._limit_connect_rate(scope)
            raise
        if access.role < requirement.role:
            detail = f"this needs the role {requirement.role.label}, and yours is {access.role.label}"
            raise ProblemError(
                403, "Not allowed", detail, needed=requirement.role.label, hint="ask for a link that may do this"
            )
        if access.is_bound and not requirement.allow_bound:
            await self._check_bound_resource(access, path_params)
        return access

    async def _authenticate(self, headers: Headers, ticket: str | None) -> Access:
        scheme, _, token = headers.get("authorization", "").partition(" ")
        if ticket is not None:
            return await self._authenticator.authenticate_ticket(ticket)
        if scheme.lower() == "bearer" and token:
            return await self._authenticator.authenticate_token(token.strip())
        if self._authenticator.requires_token:
            raise unauthorized(
                "A link is needed", "this stage is shown to those who have a link", "ask its host for a link"
            )
        return await self._authenticator.authenticate_token("")

    async def _check_bound_resource(self, access: Access, path_params: dict[str, str]) -> None:
        """Raise `ProblemError` where one who is bound asks for something else: as if that were not there."""
        if "session" in path_params and not await self._authenticator.can_view(
            access, "session", path_params["session"]
        ):
            raise session_not_found(path_params["session"])
        if "motion" in path_params and not await self._authenticator.can_view(access, "motion", path_params["motion"]):
            raise motion_not_found(path_params["motion"])
        if "session" not in path_params and "motion" not in path_params:
            raise ProblemError(403, "Not allowed", "your link is for one session or motion, this is for all")


def _problem_headers(problem: ProblemError) -> dict[str, str]:
    """What goes with a problem (RFC 6750, 3; RFC 9110, 10.2.3)."""
    if problem.status == 401:
        known = problem.title == "A link is needed"
        error = "" if known else f', error="invalid_token", error_description="{problem.title}"'
        return {"WWW-Authenticate": f'Bearer realm="bunraku"{error}'}
    if problem.extra.get("needed"):
        scope = problem.extra["needed"]
        return {"WWW-Authenticate": f'Bearer realm="bunraku", error="insufficient_scope", scope="{scope}"'}
    return {"Retry-After": "1"} if problem.status == 429 else {}


def _close_reason(error: ProblemError | ValueError) -> CloseConnection:
    """What a socket is told."""
    if not isinstance(error, ProblemError):
        return CloseConnection(subprotocol.POLICY_VIOLATION, "Unreadable query", str(error)[:80])
    codes = {
        401: subprotocol.UNAUTHORIZED,
        403: subprotocol.FORBIDDEN,
        404: subprotocol.NOT_FOUND,
        429: subprotocol.TRY_AGAIN_LATER,
    }
    return CloseConnection(codes[error.status], error.title, error.detail)


def _mark_cache_private(send: Send) -> Send:
    """What needs a token is kept by the browser that has it, and by no cache on the way."""

    async def sending(message: Message) -> None:
        if message["type"] == "http.response.start":
            message["headers"] = [
                (name, value.replace(b"public", b"private") if name.lower() == b"cache-control" else value)
                for name, value in message["headers"]
            ]
        await send(message)

    return sending
