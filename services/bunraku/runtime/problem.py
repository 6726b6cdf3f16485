"""Problems that a request can fail with, in the fields of an RFC 9457 document."""

from __future__ import annotations

from typing import Any


class ProblemError(Exception):
    """A failed request: HTTP status, title of the kind of problem, detail of this one.

    `extra` holds further members of the document that help the client (`field`, `hint`, `line` ...).
    """

    def __init__(self, status: int, title: str, detail: str, **extra: Any) -> None:
        super().__init__(detail)
        self.status = status
        self.title = title
        self.detail = detail
        self.extra = extra

    def to_dict(self) -> dict[str, Any]:
        """Return the problem as plain values, for messages on the bus; members that are None are left out."""
        extra = {name: value for name, value in self.extra.items() if value is not None}
        return {"status": self.status, "title": self.title, "detail": self.detail, **extra}

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> ProblemError:
        """Rebuild a problem from the values that another service returned."""
        return cls(**values)
