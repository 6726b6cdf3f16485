"""Key-value store for state on which replicas must agree, with optimistic concurrency by revisions.

The interface is that of a NATS JetStream key-value bucket, so that a broker (`bunraku.messaging.key_value_nats`) can
replace the store of one process. Keys are tokens of A-Z a-z 0-9 _ - joined by dots.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import count
from types import MappingProxyType
from typing import Protocol

from bunraku.messaging.bus import CallbackSubscription, Subscription
from bunraku.runtime.availability import BACKEND_TIMEOUT_S, BackendUnavailable

SESSION_KEY_PREFIX = "sessions"
"""Prefix of `sessions.{id}`: the state with which another replica can take over an open session."""

_log = logging.getLogger(__name__)


class RevisionConflict(Exception):
    """A write whose expected revision is not the current one."""


@dataclass(frozen=True, slots=True)
class KeyValueEntry:
    """A value and its revision, a number that increases with each write."""

    value: bytes
    revision: int


ChangeHandler = Callable[[str, KeyValueEntry | None], None]
"""Function that is called with a key and its new entry, None if it was removed; it must return at once."""


class KeyValueView:
    """Local copy of all entries of a store, which a watch keeps current.

    The copy may lag behind the store, but it follows the order of the writes: it contains every write up to `revision`.
    """

    def __init__(self) -> None:
        self._entries: dict[str, KeyValueEntry] = {}
        self._handlers: dict[int, ChangeHandler] = {}
        self._handler_numbers = count()
        self._waiters: dict[asyncio.Future[None], int] = {}
        self.revision = 0
        """Revision of the last write that is contained; 0 before the first snapshot."""
        self._is_suspended = False

    @property
    def entries(self) -> Mapping[str, KeyValueEntry]:
        """Entries by key."""
        return MappingProxyType(self._entries)

    def on_change(self, handler: ChangeHandler) -> Subscription:
        """Call `handler` with each present entry now, and with every change from now on."""
        number = next(self._handler_numbers)
        self._handlers[number] = handler
        for key, entry in tuple(self._entries.items()):
            _notify(handler, key, entry)

        def unsubscribe() -> None:
            self._handlers.pop(number, None)

        return CallbackSubscription(unsubscribe)

    def apply(self, key: str, entry: KeyValueEntry | None, revision: int) -> None:
        """Apply one write, a removal if `entry` is None; the watch calls this."""
        # a store that has lost its data begins again with a lower revision
        self.revision = revision
        self._set(key, entry)
        self._wake_waiters()

    def replace(self, entries: Mapping[str, KeyValueEntry], revision: int) -> None:
        """Replace everything by a snapshot that contains all writes up to `revision`; the watch calls this."""
        self.revision = revision
        self._is_suspended = False
        for key in self._entries.keys() - entries.keys():
            self._set(key, None)
        for key, entry in entries.items():
            if self._entries.get(key) != entry:
                self._set(key, entry)
        self._wake_waiters()

    def suspend(self) -> None:
        """Let `wait_for` wait for the next snapshot: changes may be missing; the watch calls this."""
        self._is_suspended = True

    async def wait_for(self, revision: int, timeout_s: float = BACKEND_TIMEOUT_S) -> None:
        """Wait until every write up to `revision` is contained; raise `BackendUnavailable` after `timeout_s`."""
        if self.revision >= revision and not self._is_suspended:
            return
        reached: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._waiters[reached] = revision
        try:
            async with asyncio.timeout(timeout_s):
                await reached
        except TimeoutError:
            raise BackendUnavailable(
                "the register", f"the watch is at revision {self.revision}, expected {revision}"
            ) from None
        finally:
            self._waiters.pop(reached, None)

    def _set(self, key: str, entry: KeyValueEntry | None) -> None:
        if entry is None:
            if self._entries.pop(key, None) is None:
                return
        else:
            self._entries[key] = entry
        for handler in tuple(self._handlers.values()):
            _notify(handler, key, entry)

    def _wake_waiters(self) -> None:
        for reached, expected in tuple(self._waiters.items()):
            if expected <= self.revision and not reached.done():
                reached.set_result(None)


def _notify(handler: ChangeHandler, key: str, entry: KeyValueEntry | None) -> None:
    try:
        handler(key, entry)
    except Exception:
        _log.exception("Handler of changes failed at key %s", key)


class KeyValueStore(Protocol):
    """Key-value store as services use it. Methods raise `BackendUnavailable` if the broker does not respond."""

    async def get(self, key: str) -> KeyValueEntry | None:
        """Return the entry of a key, None if it does not exist."""

    async def put(self, key: str, value: bytes, revision: int | None = None) -> int:
        """Write a value and return its revision.

        With `revision`, raise `RevisionConflict` unless it is the current one; 0 means that the key must not exist.
        """

    async def remove(self, key: str, revision: int | None = None) -> None:
        """Remove a key if it exists; `revision` as in `put`."""

    def watch(self) -> KeyValueView:
        """Return the local copy of all entries, and keep it current from the first call on.

        All callers of one process share it. After an outage it is restored from a new snapshot, so that no change is
        missed.
        """

    async def synchronise(self) -> None:
        """Wait until the local copy contains every write that was completed before this call."""

    async def close(self) -> None:
        """End the use of the store."""


class MemoryKeyValueStore:
    """Key-value store within one process."""

    def __init__(self) -> None:
        self._view = KeyValueView()
        self._revisions = count(1)

    async def get(self, key: str) -> KeyValueEntry | None:
        return self._view.entries.get(key)

    async def put(self, key: str, value: bytes, revision: int | None = None) -> int:
        self._check_revision(key, revision)
        new_revision = next(self._revisions)
        self._view.apply(key, KeyValueEntry(value, new_revision), new_revision)
        return new_revision

    async def remove(self, key: str, revision: int | None = None) -> None:
        self._check_revision(key, revision)
        self._view.apply(key, None, next(self._revisions))

    def watch(self) -> KeyValueView:
        return self._view

    async def synchronise(self) -> None:
        """Do nothing: the copy is the store itself."""

    async def close(self) -> None:
        self._view.replace({}, next(self._revisions))

    def _check_revision(self, key: str, revision: int | None) -> None:
        current = self._view.entries.get(key)
        if revision is not None and revision != (current.revision if current else 0):
            raise RevisionConflict(key)
