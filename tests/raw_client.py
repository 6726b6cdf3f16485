"""Requests for tests that drive a socket byte by byte."""

from __future__ import annotations

import asyncio
import struct
from urllib.parse import urlsplit

from websockets.client import ClientProtocol
from websockets.typing import Subprotocol
from websockets.uri import parse_uri

from bunraku.websocket.frame import MAX_CONTROL_BYTES, Opcode
from bunraku.wire.messages import SUBPROTOCOL


def upgrade_request(url: str) -> bytes:
    """Return the handshake request of a client at a `ws:` URL."""
    protocol = ClientProtocol(parse_uri(url), subprotocols=[Subprotocol(SUBPROTOCOL)])
    protocol.send_request(protocol.connect())
    return b"".join(protocol.data_to_send())


async def open_raw(url: str) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    """Open a WebSocket at a `ws:` URL and return its streams after the response to the handshake."""
    parts = urlsplit(url)
    reader, writer = await asyncio.open_connection(parts.hostname, parts.port)
    writer.write(upgrade_request(url))
    assert (await reader.readuntil(b"\r\n\r\n")).startswith(b"HTTP/1.1 101")
    return reader, writer


def client_frame(opcode: Opcode, payload: bytes = b"", *, final: bool = True) -> bytes:
    """Return a frame of a client with less than 64 kB of payload, masked with zeros."""
    size = len(payload)
    length = bytes([0x80 | size]) if size <= MAX_CONTROL_BYTES else struct.pack(">BH", 0x80 | 126, size)
    return bytes([(0x80 if final else 0) | opcode]) + length + bytes(4) + payload
