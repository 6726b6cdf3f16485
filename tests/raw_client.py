"""Requests for tests that drive a socket byte by byte."""

from __future__ import annotations

from websockets.client import ClientProtocol
from websockets.typing import Subprotocol
from websockets.uri import parse_uri

from bunraku.wire.messages import SUBPROTOCOL


def upgrade_request(url: str) -> bytes:
    """Return the handshake request of a client at a `ws:` URL."""
    protocol = ClientProtocol(parse_uri(url), subprotocols=[Subprotocol(SUBPROTOCOL)])
    protocol.send_request(protocol.connect())
    return b"".join(protocol.data_to_send())
