"""Authorization of every request and WebSocket before it reaches its route (docs/security.md).

Each route declares its requirement with `bunraku.http.access_control.requires`. API paths without a route are answered
with 404, and an app with a route without a declared requirement does not start.
"""

from __future__ import annotations

import logging
import re
from collections import Counter
from collections.abc import Iterable
from contextlib import ExitStack
from typing import Any, NamedTuple
from urllib.parse import parse_qsl

from fastapi import FastAPI
from fastapi.routing import APIRoute
from starlette.datastructures import Headers
from starlette.requests import HTTPConnection
from starlette.routing import BaseRoute, Route, WebSocketRoute
from starlette.types import ASGIApp, Receive, Scope, Send
from starlette.websockets import WebSocket

from bunraku.http.access_control import ACCESS_SCOPE_KEY, Access, Requirement, Role, requirement_of
from bunraku.http.access_log import API_PREFIX, ROUTE_SCOPE_KEY
from bunraku.http.admission import AdmissionLimit, holder_of
from bunraku.http.authentication import unauthorized
from bunraku.http.origin import is_allowed_origin, is_local_host, parse_origins
from bunraku.http.problem_details import (
    RETRY_AFTER_S,
    motion_not_found,
    problem_response,
    session_not_found,
    unavailable_response,
)
from bunraku.http.request_body import limit_body, too_large_detail
from bunraku.http.response_headers import mark_cache_private
from bunraku.http.token_bucket import KeyedTokenBuckets
from bunraku.runtime.availability import BackendUnavailable
from bunraku.runtime.client_network import client_network
from bunraku.runtime.context import ServiceContext
from bunraku.runtime.problem import ProblemError
from bunraku.websocket import subprotocol
from bunraku.websocket.handoff import reject
from bunraku.websocket.subprotocol import CloseConnection

SAFE_METHODS = ("GET", "HEAD", "OPTIONS")
"""HTTP methods that change nothing (RFC 9110, section 9.2.1)."""
UNLIMITED_METHODS = (*SAFE_METHODS, "DELETE")
"""Methods without a limit per subject: what is removed was created within limits, and links must be revocable."""
CONNECT_BURST_S = 10
"""An address may open as many connections at once as the rate limit allows in this time, in seconds."""
CHANGES_PER_S, CHANGE_BURST = 20.0, 200
"""Rate of the requests of one subject that create or edit something, at one process, and their number at once."""
MAX_REQUESTS_WITH_BODY = 1_000
"""Requests with a body that are received or processed at the same time; further ones get 503. Each needs 40 kB."""
MAX_REQUESTS_WITH_BODY_PER_HOLDER = 64
"""Requests with a body of one subject, or one address without a subject, at the same time."""
_LINK_NEEDED = "A link is needed"

_log = logging.getLogger(__name__)


class RouteRule(NamedTuple):
    """Requirement of a route. `methods` is empty for a WebSocket route; `route` is the path template."""

    path: re.Pattern[str]
    methods: frozenset[str]
    requirement: Requirement
    route: str


class UndeclaredRequirement(TypeError):
    """Route without a declared requirement."""


def collect_route_rules(routes: Iterable[BaseRoute]) -> list[RouteRule]:
    """Return the rules of all routes, and add the required roles to the API description.

    Raises `UndeclaredRequirement`.
    """
    rules = []
    for route in routes:
        if not isinstance(route, Route | WebSocketRoute):
            raise UndeclaredRequirement(
                f"{route} is neither an HTTP route nor a WebSocket route, so it cannot declare a requirement"
            )
        requirement = requirement_of(route.endpoint)
        if requirement is None:
            raise UndeclaredRequirement(
                f"{route.path} declares no requirement: put @requires(...) below the decorator of its route, or create "
                "the app without FastAPI's own documentation pages (openapi_url=None)"
            )
        if isinstance(route, APIRoute) and requirement.role is not None:
            route.openapi_extra = {
                **(route.openapi_extra or {}),
                "x-role": requirement.role.label,
                "security": [{"token": []}],
            }
        methods = frozenset(route.methods or ()) if isinstance(route, Route) else frozenset()
        rules.append(RouteRule(route.path_regex, methods, requirement, route.path))
    return rules


def add_security_scheme(app: FastAPI) -> None:
    """Add bearer tokens to the API description of `app`."""
    describe = app.openapi

    def openapi() -> dict[str, Any]:
        description = describe()
        scheme = {"type": "http", "scheme": "bearer", "bearerFormat": "JWT"}
        description.setdefault("components", {})["securitySchemes"] = {"token": scheme}
        return description

    app.openapi = openapi  # type: ignore[method-assign]


class AuthorizationMiddleware:
    """Middleware that rejects requests and WebSockets that do not meet the requirement of their route.

    Paths outside the API are public.
    """

    def __init__(self, app: ASGIApp, context: ServiceContext, rules: list[RouteRule]) -> None:
        self._app = app
        self._rules = rules
        self._authenticator = context.authenticator
        self._clock = context.clock
        self._rejections: Counter[tuple[str, ...]] = Counter()
        context.metrics.counter(
            "refusals_total",
            "Rejected requests and WebSockets, by title and status of the problem",
            self._rejections.copy,
            ("reason", "status"),
        )
        settings = context.settings
        self._allowed_origins = parse_origins(settings.origins)
        self._body_timeout_s = settings.body_seconds
        self._bodies = AdmissionLimit("requests with a body", MAX_REQUESTS_WITH_BODY, MAX_REQUESTS_WITH_BODY_PER_HOLDER)
        limited = self._authenticator.requires_token and settings.connects > 0
        self._connect_buckets = (
            KeyedTokenBuckets(settings.connects, settings.connects * CONNECT_BURST_S) if limited else None
        )
        self._change_buckets = KeyedTokenBuckets(CHANGES_PER_S, CHANGE_BURST)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "websocket":
            await self._handle_websocket(scope, receive, send)
        elif scope["type"] == "http":
            await self._handle_request(scope, receive, send)
        else:
            await self._app(scope, receive, send)

    async def _handle_request(self, scope: Scope, receive: Receive, send: Send) -> None:
        with ExitStack() as stack:
            try:
                requirement = await self._authorize_request(scope)
                if _has_body(Headers(scope=scope)):
                    stack.enter_context(self._bodies.admit(holder_of(HTTPConnection(scope))))
            except ProblemError as problem:
                self._record_rejection(scope, problem)
                await problem_response(problem, _problem_headers(problem))(scope, receive, send)
                return
            except BackendUnavailable as error:
                await unavailable_response(error)(scope, receive, send)
                return
            limit = requirement.max_body_bytes
            limited_receive = limit_body(receive, limit, self._body_timeout_s, self._monotonic_seconds)
            is_private = requirement.role is not None and self._authenticator.requires_token
            await self._app(scope, limited_receive, mark_cache_private(send) if is_private else send)

    async def _authorize_request(self, scope: Scope) -> Requirement:
        """Return the requirement of the route, after checking that the request meets it. Raises `ProblemError`."""
        headers = Headers(scope=scope)
        self._check_origin(headers, unsafe=scope["method"] not in SAFE_METHODS)
        rule, path_params = self._match_route(scope["path"], scope["method"])
        if rule is not None:
            requirement = rule.requirement
            scope[ROUTE_SCOPE_KEY] = rule.route
            if requirement.rate_limited:
                self._limit_connect_rate(scope)
            scope[ACCESS_SCOPE_KEY] = await self._authorize(scope, headers, requirement, path_params, None)
            if scope["method"] not in UNLIMITED_METHODS:
                self._limit_change_rate(scope[ACCESS_SCOPE_KEY], requirement)
        elif scope["path"].startswith(API_PREFIX):
            raise ProblemError(404, "Not Found", f"{scope['method']} {scope['path']}: Not Found")
        else:
            # a file of the page
            requirement = Requirement(None, max_body_bytes=0)
        limit, content_length = requirement.max_body_bytes, headers.get("content-length", "")
        if limit is not None and content_length.isdecimal() and int(content_length[:18]) > limit:
            raise ProblemError(413, "Content Too Large", too_large_detail(limit))
        return requirement

    async def _handle_websocket(self, scope: Scope, receive: Receive, send: Send) -> None:
        headers = Headers(scope=scope)
        try:
            # other sites and clients that connect too often do not even get a handshake
            self._check_origin(headers, unsafe=True)
            self._limit_connect_rate(scope)
        except ProblemError as problem:
            self._record_rejection(scope, problem)
            await WebSocket(scope, receive, send).send_denial_response(
                problem_response(problem, _problem_headers(problem))
            )
            return
        rule, path_params = self._match_route(scope["path"], None)
        try:
            if rule is None:
                raise ProblemError(404, "Not Found", f"there is no WebSocket endpoint at {scope['path'][:80]}")
            scope[ROUTE_SCOPE_KEY] = rule.route
            query = dict(parse_qsl(scope["query_string"].decode("ascii", "replace"), max_num_fields=20))
            ticket = query.get("ticket")
            scope[ACCESS_SCOPE_KEY] = await self._authorize(scope, headers, rule.requirement, path_params, ticket)
        except ProblemError as problem:
            self._record_rejection(scope, problem)
            reason = CloseConnection(_CLOSE_CODES[problem.status], problem.title, problem.detail)
        except ValueError as error:
            reason = CloseConnection(subprotocol.POLICY_VIOLATION, "Unreadable query", str(error)[:80])
            self._record_rejection(scope, ProblemError(400, reason.title, reason.detail))
        except BackendUnavailable as error:
            reason = CloseConnection.unavailable(error)
        else:
            await self._app(scope, receive, send)
            return
        await reject(WebSocket(scope, receive, send), reason)

    def _monotonic_seconds(self) -> float:
        return self._clock() / 1e6

    def _record_rejection(self, scope: Scope, problem: ProblemError) -> None:
        """Count and log a rejection. The query is not logged, because it may contain a ticket."""
        self._rejections[problem.title, str(problem.status)] += 1
        _log.info("refused %r: %s", scope["path"], problem.title)

    def _check_origin(self, headers: Headers, *, unsafe: bool) -> None:
        """Raise `ProblemError` for a request of another site, and for a suspicious host name."""
        host, origin = headers.get("host", ""), headers.get("origin")
        if not self._authenticator.requires_token and not is_local_host(host, self._allowed_origins):
            raise ProblemError(
                403,
                "Not by this name",
                f"a server without a secret accepts only local host names, not {host[:80]!r}",
                hint="set BUNRAKU_SECRET, or add the address of the page to BUNRAKU_ORIGINS",
            )
        if unsafe and not is_allowed_origin(origin, host, self._allowed_origins):
            raise ProblemError(
                403,
                "Another site",
                f"pages of {(origin or '')[:80]!r} may not send this request",
                hint="add the site to BUNRAKU_ORIGINS to allow it",
            )

    def _limit_connect_rate(self, scope: Scope) -> None:
        """Count a connection of the client's address. Raises `ProblemError` 429 above the limit."""
        if self._connect_buckets is None or not scope.get("client"):
            return
        if not self._connect_buckets.take(client_network(scope["client"][0]), self._monotonic_seconds()):
            raise ProblemError(
                429, "Too many connections", "your address connects too often", hint="try again in a second"
            )

    def _limit_change_rate(self, access: Access, requirement: Requirement) -> None:
        """Count a request that creates or edits something. Raises `ProblemError` 429 above the limit of its subject.

        Requests of the role view change nothing that others share: they compute, or issue tickets.
        """
        if requirement.role in (None, Role.VIEW) or not self._authenticator.requires_token:
            return
        if not self._change_buckets.take(access.subject, self._monotonic_seconds()):
            raise ProblemError(
                429, "Too many changes", "your link or token sends changes too fast", hint="try again in a second"
            )

    def _match_route(self, path: str, method: str | None) -> tuple[RouteRule | None, dict[str, str]]:
        """Return the rule for a path and its path parameters. `method` is None for a WebSocket.

        If routes match the path only with another method, return one of them: the app answers with 405.
        """
        other: tuple[RouteRule | None, dict[str, str]] = None, {}
        for rule in self._rules:
            if bool(rule.methods) == (method is not None) and (match := rule.path.match(path)):
                if method is None or method in rule.methods:
                    return rule, match.groupdict()
                other = rule, match.groupdict()
        return other

    async def _authorize(
        self, scope: Scope, headers: Headers, requirement: Requirement, path_params: dict[str, str], ticket: str | None
    ) -> Access:
        """Return the access of the client. Raises `ProblemError` if it does not meet the requirement."""
        if requirement.role is None:
            return Access(Role.VIEW)
        try:
            access = await self._authenticate(headers, ticket)
        except ProblemError:
            if scope["type"] == "http" and not requirement.rate_limited:
                self._limit_connect_rate(scope)
            raise
        if access.role < requirement.role:
            raise ProblemError(
                403,
                "Not allowed",
                f"this request needs the role {requirement.role.label}; your role is {access.role.label}",
                needed=requirement.role.label,
                hint="ask for a link with this role",
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
                _LINK_NEEDED, "this server accepts only clients with a link or token", "ask its host for a link"
            )
        return await self._authenticator.authenticate_token("")

    async def _check_bound_resource(self, access: Access, path_params: dict[str, str]) -> None:
        """Raise `ProblemError` if bound access does not include the resource.

        The response does not reveal whether a hidden resource exists.
        """
        session, motion = path_params.get("session"), path_params.get("motion")
        if session is not None and not await self._authenticator.can_view(access, "session", session):
            raise session_not_found(session)
        if motion is not None and not await self._authenticator.can_view(access, "motion", motion):
            raise motion_not_found(motion)
        if session is None and motion is None:
            raise ProblemError(
                403, "Not allowed", "your link is limited to one session or motion; this request is about all of them"
            )


_CLOSE_CODES = {
    401: subprotocol.UNAUTHORIZED,
    403: subprotocol.FORBIDDEN,
    404: subprotocol.NOT_FOUND,
    429: subprotocol.TRY_AGAIN_LATER,
}


def _has_body(headers: Headers) -> bool:
    return "transfer-encoding" in headers or headers.get("content-length", "0").strip("0") != ""


def _problem_headers(problem: ProblemError) -> dict[str, str]:
    """Return the response headers for a problem (RFC 6750, section 3; RFC 9110, section 10.2.3)."""
    if problem.status == 401:
        error = "" if problem.title == _LINK_NEEDED else f', error="invalid_token", error_description="{problem.title}"'
        return {"WWW-Authenticate": f'Bearer realm="bunraku"{error}'}
    if problem.extra.get("needed"):
        scope = problem.extra["needed"]
        return {"WWW-Authenticate": f'Bearer realm="bunraku", error="insufficient_scope", scope="{scope}"'}
    if problem.status == 413:
        return {"Connection": "close"}
    if problem.status == 503:
        return {"Retry-After": str(RETRY_AFTER_S)}
    return {"Retry-After": "1"} if problem.status == 429 else {}
