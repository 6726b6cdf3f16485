"""Limits on concurrent operations, in total and per client."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager

from starlette.requests import HTTPConnection

from bunraku.http.access_control import access_of
from bunraku.runtime.client_network import client_network
from bunraku.runtime.problem import ProblemError


def holder_of(connection: HTTPConnection) -> str:
    """Return who holds the slots of a request: the subject of its token, or else its address (IPv6: /64)."""
    return access_of(connection).subject or network_of(connection)


def network_of(connection: HTTPConnection) -> str:
    """Return the address of a request (IPv6: /64), empty if it is unknown."""
    return client_network(connection.client.host) if connection.client is not None else ""


class AdmissionLimit:
    """Slots for concurrent operations of one kind. Further operations are rejected with 503."""

    def __init__(self, operations: str, max_active: int, max_per_holder: int) -> None:
        """`operations` names them in the problem's detail, in the plural."""
        self._operations = operations
        self._max_active = max_active
        self._max_per_holder = max_per_holder
        self._active = Counter[str]()

    @property
    def active_count(self) -> int:
        """Number of operations in progress."""
        return self._active.total()

    @contextmanager
    def admit(self, holder: str) -> Iterator[None]:
        """Hold a slot during the block; raise `ProblemError` (503) if all, or all of this holder, are in use.

        An operation of nobody in particular (empty `holder`) counts only in total.
        """
        if self.active_count >= self._max_active:
            raise self._busy(f"{self._max_active} {self._operations} are in progress")
        if holder and self._active[holder] >= self._max_per_holder:
            raise self._busy(f"you have {self._max_per_holder} {self._operations} in progress, the most at one time")
        self._active[holder] += 1
        try:
            yield
        finally:
            self._active[holder] -= 1
            if not self._active[holder]:
                del self._active[holder]

    def _busy(self, detail: str) -> ProblemError:
        return ProblemError(503, "Busy", detail, hint="try again in a few seconds")
