"""Problem that a server answers with."""

from __future__ import annotations

from typing import Any


class ServerProblem(Exception):
    """Error answer of the server: an RFC 9457 problem document, `body`, with its HTTP `status`."""

    def __init__(self, status: int, body: dict[str, Any]) -> None:
        line = f"line {body['line']}: " if body.get("line") else ""
        hint = f" ({body['hint']})" if body.get("hint") else ""
        super().__init__(f"{body.get('title', 'Problem')}: {line}{body.get('detail', '')}{hint}")
        self.status = status
        self.body = body
