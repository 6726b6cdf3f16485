"""Checks of a request beyond those of h11, before anything acts on it."""

from __future__ import annotations

import h11

from bunraku.http.request_body import ChunkLimit

MAX_HEAD_BYTES = 16 << 10
"""Maximum size of the request line and header fields."""
MAX_TARGET_BYTES = 8_000
"""Maximum size of the request target, the least that RFC 9112, section 3, recommends to support."""
MAX_FIELD_BYTES = 8_000
"""Maximum size of one header field."""
MAX_FIELDS = 100
"""Maximum number of header fields."""
MAX_FRAMING_BYTES = 128 << 10
"""Maximum number of bytes received beyond the body, besides `MAX_FRAMING_SHARE`; it includes data not parsed yet."""
MAX_REST_BYTES = 64 << 10
"""Longest body of which the rest is read after the response, so that the connection can continue."""
MAX_FRAMING_SHARE = 8
"""Maximum size of the framing of a chunked body, in sizes of the body. Chunks of one byte need five."""


class BoundedConnection(h11.Connection):
    """Server side of an HTTP/1.1 connection that rejects heads which are too large or ambiguous, and endless framing.

    `next_event` raises `h11.RemoteProtocolError` with the status of the response, and `error` keeps it. A response to a
    body that is too long to be read to its end says that the connection closes (RFC 9112, section 9.3): otherwise a
    proxy would send the request of another client on it.
    """

    def __init__(self) -> None:
        super().__init__(h11.SERVER, MAX_HEAD_BYTES)
        self.error: h11.RemoteProtocolError | None = None
        self.is_head_request = False
        """True if the response to the present request has no body (RFC 9110, section 9.3.2)."""
        self._received_bytes = self._body_bytes = 0
        self._chunk_limit = ChunkLimit()
        self._is_body_short = True

    @property
    def has_long_rest(self) -> bool:
        """True while the rest of a request's body is missing and may be long."""
        return self.their_state is h11.SEND_BODY and not self._is_body_short

    def send(self, event: h11.Event) -> bytes | None:  # type: ignore[override]
        if isinstance(event, h11.Response) and self.has_long_rest:
            kept = [(name, value) for name, value in event.headers if name != b"connection"]
            event = h11.Response(
                status_code=event.status_code, headers=[*kept, (b"connection", b"close")], reason=event.reason
            )
        return super().send(event)

    def receive_data(self, data: bytes) -> None:
        self._received_bytes += len(data)
        super().receive_data(data)

    def next_event(self) -> h11.Event | type[h11.NEED_DATA] | type[h11.PAUSED]:
        try:
            event = super().next_event()
            if isinstance(event, h11.Data):
                self._body_bytes += len(event.data)
                if not self._chunk_limit.add_chunk(len(event.data)):
                    _reject("the body has too many small chunks", 400)
            self._check_framing()
            if isinstance(event, h11.Request):
                self._received_bytes = self._body_bytes = 0
                self._chunk_limit = ChunkLimit()
                self.is_head_request = event.method == b"HEAD"
                check_request_head(event)
                length = dict(event.headers).get(b"content-length", b"")
                self._is_body_short = length.isdigit() and int(length) <= MAX_REST_BYTES
                if _is_websocket_upgrade(event) and self.trailing_data[0]:
                    _reject("data follows a WebSocket handshake before its response", 400)
        except h11.RemoteProtocolError as error:
            self.error = error
            raise
        return event

    def start_next_cycle(self) -> None:
        super().start_next_cycle()
        self.is_head_request = False

    def _check_framing(self) -> None:
        """Reject chunk extensions and trailers without end (RFC 9112, section 7.1.1)."""
        if self._received_bytes > MAX_FRAMING_BYTES + (1 + MAX_FRAMING_SHARE) * self._body_bytes:
            _reject(f"the chunks of the body have more than {MAX_FRAMING_BYTES} bytes of framing", 400)


def check_request_head(request: h11.Request) -> None:
    """Raise `h11.RemoteProtocolError` for a head that is not acceptable."""
    names = [name for name, _ in request.headers]
    if len(names) > MAX_FIELDS:
        _reject(f"a request has at most {MAX_FIELDS} header fields", 431)
    if len(request.target) > MAX_TARGET_BYTES:
        _reject(f"a request target has at most {MAX_TARGET_BYTES} bytes", 414)
    sizes = [len(name) + len(value) for name, value in request.headers]
    if max(sizes, default=0) > MAX_FIELD_BYTES:
        _reject(f"a header field has at most {MAX_FIELD_BYTES} bytes", 431)
    if len(request.target) + sum(sizes) + 4 * len(sizes) > MAX_HEAD_BYTES:
        _reject(f"the head of a request has at most {MAX_HEAD_BYTES} bytes", 431)
    has_length, has_encoding = b"content-length" in names, b"transfer-encoding" in names
    if has_length and has_encoding:
        # proxies disagree about where such a request ends (RFC 9112, section 6.1)
        _reject("a request has either Content-Length or Transfer-Encoding", 400)
    if _is_websocket_upgrade(request) and (has_length or has_encoding):
        _reject("a WebSocket handshake has no body", 400)


def _is_websocket_upgrade(request: h11.Request) -> bool:
    return any(name == b"upgrade" and b"websocket" in value.lower() for name, value in request.headers)


def _reject(detail: str, status: int) -> None:
    raise h11.RemoteProtocolError(detail, error_status_hint=status)
