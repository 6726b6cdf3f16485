"""Address of the client behind reverse proxies, which limits per address count by.

A proxy appends the address of its peer to `X-Forwarded-For`. Only entries that a trusted proxy has appended are
believed: the header is read from its end, and entries before the first address that is not a proxy's may be forged.
"""

from __future__ import annotations

import ipaddress
from dataclasses import dataclass

from starlette.types import ASGIApp, Receive, Scope, Send

EVERY_PEER = "*"
"""Setting for servers that only a proxy can reach."""
MAX_HOPS = 16
"""Maximum number of addresses of the header that are read."""
_SCHEMES = ("http", "https")
_Address = ipaddress.IPv4Address | ipaddress.IPv6Address
_Network = ipaddress.IPv4Network | ipaddress.IPv6Network


@dataclass(frozen=True, slots=True)
class TrustedProxies:
    """Reverse proxies whose `X-Forwarded-For` is believed."""

    networks: tuple[_Network, ...] = ()
    every_peer: bool = False

    @classmethod
    def parse(cls, text: str) -> TrustedProxies:
        """Parse addresses, networks and `*`, separated by commas or spaces; raise ValueError."""
        networks, every_peer = [], False
        for word in text.replace(",", " ").split():
            if word == EVERY_PEER:
                every_peer = True
                continue
            try:
                networks.append(ipaddress.ip_network(word))
            except ValueError:
                raise ValueError(
                    f"invalid trusted proxy {word[:80]!r}, expected an address, a network such as 10.0.0.0/8, or *"
                ) from None
        return cls(tuple(networks), every_peer)

    def trusts(self, peer: str) -> bool:
        """Return whether the headers of a direct peer are believed."""
        address = _parse_address(peer)
        return self.every_peer or (address is not None and self._contains(address))

    def find_client(self, peer: str, forwarded_for: str) -> str:
        """Return the client's address: the last of `forwarded_for` that is not a proxy's, `peer` if there is none."""
        client = peer
        for entry in reversed(forwarded_for.split(",")[-MAX_HOPS:]):
            address = _parse_address(entry.strip())
            if address is None:
                break
            client = str(address)
            if not self._contains(address):
                break
        return client

    def _contains(self, address: _Address) -> bool:
        return any(address in network for network in self.networks)


class ClientAddressMiddleware:
    """Middleware that sets `client` and `scheme` of the ASGI scope from the headers of trusted proxies."""

    def __init__(self, app: ASGIApp, proxies: TrustedProxies) -> None:
        self._app = app
        self._proxies = proxies

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        client = scope.get("client")
        if scope["type"] in ("http", "websocket") and client and self._proxies.trusts(client[0]):
            forwarded_for = _header(scope, b"x-forwarded-for")
            if forwarded_for:
                scope["client"] = (self._proxies.find_client(client[0], forwarded_for), 0)
            scheme = _header(scope, b"x-forwarded-proto").strip()
            if scheme in _SCHEMES:
                scope["scheme"] = scheme.replace("http", "ws") if scope["type"] == "websocket" else scheme
        await self._app(scope, receive, send)


def _header(scope: Scope, name: bytes) -> str:
    """Return all fields of a header as one list (RFC 9110, section 5.3)."""
    return ",".join(value.decode("latin-1") for key, value in scope["headers"] if key == name)


def _parse_address(text: str) -> _Address | None:
    """Parse an address with or without a port; return None if it is none. IPv4-mapped addresses become IPv4."""
    if text.startswith("["):
        text = text[1:].partition("]")[0]
    elif text.count(":") == 1:
        text = text.partition(":")[0]
    try:
        address = ipaddress.ip_address(text.partition("%")[0])
    except ValueError:
        return None
    return getattr(address, "ipv4_mapped", None) or address
