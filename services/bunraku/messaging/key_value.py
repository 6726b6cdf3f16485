"""Key-value store for state on which replicas must agree, with optimistic concurrency by revisions.

The interface is that of a NATS JetStream key-value bucket, so that a broker (`bunraku.messaging.key_value_nats`) can
replace the store of one process. Keys are tokens of A-Z a-z 0-9 _ - joined by dots.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import count
from typing import Protocol

SESSION_KEY_PREFIX = "sessions"
"""Prefix of `sessions.{id}`: the state with which another replica can take over an open session."""


class RevisionConflict(Exception):
    """A write whose expected revision is not the current one."""


@dataclass(frozen=True, slots=True)
class KeyValueEntry:
    """A value and its revision, a number that increases with each write."""

    value: bytes
    revision: int


class KeyValueStore(Protocol):
    """Key-value store as services use it. Methods raise `BackendUnavailable` if the broker does not respond."""

    async def get(self, key: str) -> KeyValueEntry | None:
        """Return the entry of a key, None if it does not exist."""

    async def list_prefix(self, prefix: str) -> dict[str, KeyValueEntry]:
        """Return all entries whose keys begin with `prefix` and a dot, in no order."""

    async def put(self, key: str, value: bytes, revision: int | None = None) -> int:
        """Write a value and return its revision.

        With `revision`, raise `RevisionConflict` unless it is the current one; 0 means that the key must not exist.
        """

    async def remove(self, key: str, revision: int | None = None) -> None:
        """Remove a key if it exists; `revision` as in `put`."""

    async def close(self) -> None:
        """End the use of the store."""


class MemoryKeyValueStore:
    """Key-value store within one process."""

    def __init__(self) -> None:
        self._entries: dict[str, KeyValueEntry] = {}
        self._revisions = count(1)

    async def get(self, key: str) -> KeyValueEntry | None:
        return self._entries.get(key)

    async def list_prefix(self, prefix: str) -> dict[str, KeyValueEntry]:
        return {key: value for key, value in self._entries.items() if key.startswith(f"{prefix}.")}

    async def put(self, key: str, value: bytes, revision: int | None = None) -> int:
        self._check_revision(key, revision)
        new_revision = next(self._revisions)
        self._entries[key] = KeyValueEntry(value, new_revision)
        return new_revision

    async def remove(self, key: str, revision: int | None = None) -> None:
        self._check_revision(key, revision)
        self._entries.pop(key, None)

    async def close(self) -> None:
        self._entries.clear()

    def _check_revision(self, key: str, revision: int | None) -> None:
        current = self._entries.get(key)
        if revision is not None and revision != (current.revision if current else 0):
            raise RevisionConflict(key)
