"""Private interfaces of libraries that Bunraku overrides or uses.

If a test fails after an upgrade of a library, adapt the code that it names before raising the upper bound of the
library in `pyproject.toml`.
"""

from __future__ import annotations

import inspect
import re
import tomllib
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

import h11
import httpx2
import pytest
import uvicorn
from fastapi import FastAPI
from fastapi.routing import APIRoute
from httpx2._config import DEFAULT_TIMEOUT_CONFIG
from numba import config as numba_config
from numba import types as numba_types
from packaging.requirements import Requirement
from starlette.routing import Route
from uvicorn.protocols.http.h11_impl import H11Protocol, RequestResponseCycle
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from uvicorn.server import ServerState
from websockets.streams import StreamReader

from bunraku.serve import uvicorn_protocol_options
from tests.time_limit import HANG_TIMEOUT_S

PYPROJECT = Path(__file__).parents[1] / "pyproject.toml"
BOUNDED_LIBRARIES = ("fastapi", "h11", "httpx2", "numba", "uvicorn", "websockets")


def parameter_names(function: Callable[..., Any]) -> list[str]:
    return list(inspect.signature(function).parameters)


def dependencies() -> dict[str, Requirement]:
    project = tomllib.loads(PYPROJECT.read_text())["project"]
    return {one.name: one for one in map(Requirement, project["dependencies"])}


@pytest.mark.parametrize("library", BOUNDED_LIBRARIES)
def test_library_has_an_upper_bound_that_includes_the_installed_version(library: str) -> None:
    specifier = dependencies()[library].specifier
    assert any(one.operator in ("<", "<=", "==", "~=") for one in specifier), f"{library} has no upper bound"
    assert specifier.contains(version(library)), f"{library} {version(library)} is outside {specifier}"


@pytest.mark.parametrize(
    ("method", "parameters"),
    [
        (H11Protocol.connection_made, ["self", "transport"]),
        (H11Protocol.data_received, ["self", "data"]),
        (H11Protocol.on_response_complete, ["self"]),
        (H11Protocol.handle_websocket_upgrade, ["self", "event"]),
        (H11Protocol.connection_lost, ["self", "exc"]),
        (WebSocketsSansIOProtocol.handle_connect, ["self", "event"]),
        (WebSocketsSansIOProtocol.stop_keepalive, ["self"]),
        (uvicorn.Server.startup, ["self", "sockets"]),
        (uvicorn.Server.capture_signals, ["self"]),
        (uvicorn.Server.handle_exit, ["self", "sig", "frame"]),
    ],
    ids=lambda value: value.__qualname__ if callable(value) else "",
)
def test_uvicorn_method_has_the_expected_parameters(method: Callable[..., Any], parameters: list[str]) -> None:
    assert parameter_names(method) == parameters


def protocol_arguments() -> tuple[uvicorn.Config, ServerState, dict[str, Any]]:
    config = uvicorn.Config(FastAPI(), **uvicorn_protocol_options(), lifespan="off", log_config=None)
    config.load()
    return config, ServerState(), {}


async def test_http_protocol_has_the_attributes_that_the_header_timeout_uses() -> None:
    protocol = H11Protocol(*protocol_arguments())
    assert isinstance(protocol.conn, h11.Connection)
    assert protocol.conn.their_state is h11.IDLE
    assert len({h11.IDLE, h11.SEND_BODY, h11.DONE}) == 3
    assert hasattr(protocol.loop, "call_later")
    # set by connection_made
    assert protocol.transport is None


def test_http_response_uses_the_transport_only_as_its_substitute_allows() -> None:
    used = set(re.findall(r"self\.transport\.(\w+)", inspect.getsource(RequestResponseCycle)))
    assert used == {"write", "close", "is_closing"}


async def test_websocket_protocol_has_the_attributes_that_the_handoff_uses() -> None:
    protocol = WebSocketsSansIOProtocol(*protocol_arguments())
    assert (protocol.handshake_complete, protocol.close_sent, protocol.disconnected) == (False, False, False)
    assert protocol.queue.empty()
    assert protocol.connections == set()
    assert "self.scope" in inspect.getsource(WebSocketsSansIOProtocol.handle_connect)
    # set by connection_made
    assert protocol.transport is None


async def test_websockets_reader_exposes_its_buffer() -> None:
    protocol = WebSocketsSansIOProtocol(*protocol_arguments())
    assert isinstance(protocol.conn.reader, StreamReader)
    assert len(protocol.conn.reader.buffer) == 0
    protocol.conn.reader.feed_data(b"unread")
    assert bytes(protocol.conn.reader.buffer) == b"unread"


def test_fastapi_documentation_routes_are_recognised_by_their_module() -> None:
    routes = FastAPI().router.routes
    assert routes
    assert all(type(route) is Route and route.endpoint.__module__.startswith("fastapi.") for route in routes)


def test_fastapi_route_has_the_attributes_that_authorization_uses() -> None:
    app = FastAPI()

    @app.get("/v1/motions/{motion}")
    async def motion() -> None: ...

    route = app.router.routes[-1]
    assert isinstance(route, APIRoute)
    assert route.openapi_extra is None
    match = route.path_regex.match("/v1/motions/m1")
    assert match is not None
    assert match.groupdict() == {"motion": "m1"}


def test_numba_has_external_functions_and_a_cache_folder() -> None:
    assert parameter_names(numba_types.ExternalFunction.__init__) == ["self", "symbol", "sig"]
    assert hasattr(numba_config, "CACHE_DIR")


def test_httpx2_clients_share_the_default_timeout() -> None:
    # tests/conftest.py raises the read timeout for slow machines
    assert DEFAULT_TIMEOUT_CONFIG.read == HANG_TIMEOUT_S
    with httpx2.Client() as client:
        assert client.timeout.read == HANG_TIMEOUT_S
