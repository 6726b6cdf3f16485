"""Limit on concurrent operations of one kind."""

from __future__ import annotations

from types import TracebackType

from bunraku.runtime.problem import ProblemError

MAX_ACTIVE_OPERATIONS = 16
"""Uploads, scene edits or performer edits in progress at the same time, of each kind; further ones get 503."""


class AdmissionLimit:
    """Context manager that admits a limited number of concurrent operations and rejects others with 503."""

    def __init__(self, operations: str, max_active: int = MAX_ACTIVE_OPERATIONS) -> None:
        """`operations` names them in the problem's detail, in the plural."""
        self._operations = operations
        self._max_active = max_active
        self.active_count = 0

    def __enter__(self) -> None:
        if self.active_count >= self._max_active:
            detail = f"{self._max_active} {self._operations} are in progress"
            raise ProblemError(503, "Busy", detail, hint="try again in a few seconds")
        self.active_count += 1

    def __exit__(self, *_: type[BaseException] | BaseException | TracebackType | None) -> None:
        self.active_count -= 1
