"""Subprotocol `bunraku.v1`: its acceptance, and the reasons to close a connection (proto/SPEC.md)."""

from __future__ import annotations

from starlette.websockets import WebSocket

from bunraku.runtime.availability import BackendUnavailable
from bunraku.runtime.display_text import MAX_PROBLEM_CHARACTERS, clean_text
from bunraku.wire.messages import SUBPROTOCOL

UNAUTHORIZED = 4401
FORBIDDEN = 4403
NOT_FOUND = 4404
UNSUPPORTED_SUBPROTOCOL = 4406
POLICY_VIOLATION = 1008
INTERNAL_ERROR = 1011
SERVICE_RESTART = 1012
TRY_AGAIN_LATER = 1013


class CloseConnection(Exception):
    """Reason to close a connection. The client receives `title` and `detail` in a Problem message before the Close.

    Both may quote the request: they are cleaned as names are.
    """

    def __init__(self, code: int, title: str, detail: str) -> None:
        self.code = code
        self.title, self.detail = (clean_text(text, MAX_PROBLEM_CHARACTERS) for text in (title, detail))
        super().__init__(f"{self.title}: {self.detail}")

    @classmethod
    def unavailable(cls, error: BackendUnavailable) -> CloseConnection:
        """Return the reason for a connection that needs an unavailable backend."""
        return cls(TRY_AGAIN_LATER, "Not now", f"{error.backend} is unavailable; try again later")


async def accept(socket: WebSocket) -> None:
    """Accept a WebSocket. Raises `CloseConnection` if the client does not offer `bunraku.v1`."""
    if SUBPROTOCOL not in socket.scope.get("subprotocols", []):
        await socket.accept()
        raise CloseConnection(
            UNSUPPORTED_SUBPROTOCOL, "Subprotocol", f"connect with the WebSocket subprotocol {SUBPROTOCOL}"
        )
    await socket.accept(SUBPROTOCOL)
