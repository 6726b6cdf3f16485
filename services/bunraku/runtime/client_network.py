"""Network of a client's address, by which limits per address count."""

from __future__ import annotations

import asyncio
import ipaddress


def client_network(address: str) -> str:
    """Return the rate-limiting key of an address: an IPv4 address itself, the /64 network of an IPv6 address."""
    try:
        parsed = ipaddress.ip_address(address)
    except ValueError:
        return address
    if parsed.version == 6:
        if parsed.ipv4_mapped is not None:
            return str(parsed.ipv4_mapped)
        return str(ipaddress.ip_network((parsed, 64), strict=False).network_address)
    return str(parsed)


def peer_network(transport: asyncio.BaseTransport) -> str:
    """Return the network of the peer of a connection, the empty string for a peer without an address."""
    peer = transport.get_extra_info("peername")
    return client_network(peer[0]) if isinstance(peer, tuple | list) else ""
