"""Client addresses behind reverse proxies, and limits per address on a real server."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import httpx2
import pytest
from pydantic import ValidationError
from starlette.types import Receive, Scope, Send

from bunraku.http.client_address import MAX_HOPS, ClientAddressMiddleware, TrustedProxies
from bunraku.runtime.settings import Settings
from tests.connection_limit import limit_connections
from tests.credentials import SECRET
from tests.servers import run_server

BURST = 10


@pytest.mark.parametrize(
    ("proxies", "peer", "header", "client"),
    [
        # nobody is trusted: the header is ignored, also on loopback
        ("", "127.0.0.1", "192.0.2.1", "127.0.0.1"),
        ("10.0.0.1", "10.0.0.2", "192.0.2.1", "10.0.0.2"),
        ("10.0.0.1", "10.0.0.1", "192.0.2.1", "192.0.2.1"),
        # the client wrote the first address, the proxy the last
        ("10.0.0.1", "10.0.0.1", "198.51.100.7, 192.0.2.1", "192.0.2.1"),
        ("*", "172.18.0.3", "198.51.100.7,192.0.2.1", "192.0.2.1"),
        # a load balancer in front of the gateway
        ("* 10.0.0.0/8", "172.18.0.3", "198.51.100.7, 192.0.2.1, 10.1.2.3", "192.0.2.1"),
        ("*", "172.18.0.3", "192.0.2.1, 10.1.2.3", "10.1.2.3"),
        # the client is itself in the network of the proxies
        ("*,10.0.0.0/8", "172.18.0.3", "10.4.4.4, 10.1.2.3", "10.4.4.4"),
        # forged entries end the search at the last address that a proxy wrote
        ("*,10.0.0.0/8", "172.18.0.3", "192.0.2.1, unknown, 10.1.2.3", "10.1.2.3"),
        ("*", "172.18.0.3", "a client", "172.18.0.3"),
        ("*", "172.18.0.3", "", "172.18.0.3"),
        ("*", "172.18.0.3", ",".join(["192.0.2.1"] * 10_000), "192.0.2.1"),
        # notations
        ("::1", "::1", "[2001:db8::1]:4711", "2001:db8::1"),
        ("127.0.0.0/8", "::ffff:127.0.0.1", "192.0.2.1:80", "192.0.2.1"),
        ("fe80::/10", "fe80::1%eth0", "::ffff:192.0.2.1", "192.0.2.1"),
    ],
)
async def test_client_is_the_last_address_that_is_no_proxy(proxies: str, peer: str, header: str, client: str) -> None:
    scopes: list[Scope] = []

    async def app(scope: Scope, _receive: Receive, _send: Send) -> None:
        scopes.append(scope)

    middleware = ClientAddressMiddleware(app, TrustedProxies.parse(proxies))
    fields = [(b"x-forwarded-for", header.encode()), (b"x-forwarded-proto", b"https")]
    scope: dict[str, Any] = {"type": "websocket", "client": (peer, 5), "scheme": "ws", "headers": fields}
    await middleware(scope, None, None)  # type: ignore[arg-type]
    assert scopes[0]["client"][0] == client
    assert scopes[0]["scheme"] == ("wss" if client != peer or proxies.startswith("*") else "ws")
    # several fields are one list
    split = [(b"x-forwarded-for", part.encode()) for part in header.split(",")]
    await middleware({**scope, "client": (peer, 5), "headers": split}, None, None)  # type: ignore[arg-type]
    assert scopes[1]["client"][0] == client


def test_long_chains_of_trusted_proxies_are_bounded() -> None:
    proxies = TrustedProxies.parse("10.0.0.0/8")
    chain = ",".join(f"10.0.0.{number}" for number in range(1, 2 * MAX_HOPS + 1))
    assert proxies.find_client("10.0.0.99", f"192.0.2.1,{chain}") == f"10.0.0.{MAX_HOPS + 1}"


@pytest.mark.parametrize("proxies", ["gateway", "10.0.0.1/8", "10.0.0.0/33", "*.example.org", "10.0.0.1;10.0.0.2"])
def test_invalid_trusted_proxy_is_rejected_at_the_start(proxies: str) -> None:
    with pytest.raises(ValidationError, match="invalid trusted proxy"):
        Settings(trusted_proxies=proxies)


async def connect_statuses(url: str, forwarded: list[str]) -> list[int]:
    """Return the statuses of requests without a token, one per X-Forwarded-For."""
    async with httpx2.AsyncClient(base_url=url) as http:
        path = "/v1/motions/m1/description"
        return [(await http.get(path, headers={"X-Forwarded-For": one})).status_code for one in forwarded]


def addresses(last: str = "") -> list[str]:
    return [f"192.0.2.{number}{last}" for number in range(2 * BURST)]


@pytest.mark.parametrize(
    ("proxies", "forwarded", "limited"),
    [
        # a client without a proxy cannot forge another address, also on loopback
        ("", addresses(), True),
        # nor can a client behind a proxy, which appends the real one
        ("127.0.0.1", addresses(", 198.51.100.1"), True),
        ("*,198.51.100.0/24", addresses(", 203.0.113.9, 198.51.100.1"), True),
        # clients behind the proxy have a limit each
        ("127.0.0.1", addresses(), False),
    ],
)
async def test_limits_per_address_cannot_be_evaded(
    proxies: str, forwarded: list[str], limited: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    connects = limit_connections(monkeypatch, BURST)
    options: dict[str, Any] = {"secret": SECRET, "connects": connects, "trusted_proxies": proxies}
    with run_server(tmp_path, services=["stream"], **options) as url:
        statuses = await connect_statuses(url, forwarded)
    assert statuses[:BURST] == [401] * BURST
    assert (429 in statuses) is limited
