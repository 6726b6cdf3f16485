"""What replicas must agree on: small values under keys, each changed only by who has seen its newest revision.

The shape is that of a key-value bucket of NATS JetStream, so that a broker can take the place of this process's own.
Keys are words of A-Z a-z 0-9 _ - joined by dots.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import count
from typing import Protocol

SESSION_KEY_PREFIX = "sessions"
"""`sessions.{id}` has what another replica needs to go on with a session, as long as it is open."""


class RevisionConflict(Exception):
    """The value has changed since it was read."""


@dataclass(frozen=True, slots=True)
class KeyValueEntry:
    """A value and its revision, a number that each change makes greater."""

    value: bytes
    revision: int


class KeyValueStore(Protocol):
    """The register as the services see it. Each call raises `Unavailable` where the broker is gone."""

    async def get(self, key: str) -> KeyValueEntry | None:
        """What is under a key."""

    async def list_prefix(self, prefix: str) -> dict[str, KeyValueEntry]:
        """Everything under keys that begin with `prefix` and a dot, in no order."""

    async def put(self, key: str, value: bytes, revision: int | None = None) -> int:
        """Its new revision. With `revision` only where that is still the newest, 0 where nothing is there; raises
        `Conflict`."""

    async def remove(self, key: str, revision: int | None = None) -> None:
        """Remove a key; nothing happens where there is none. `revision` as in `put`."""

    async def close(self) -> None:
        """Nothing is asked after this."""


class MemoryKeyValueStore:
    """The register within one process."""

    def __init__(self) -> None:
        self._entries: dict[str, KeyValueEntry] = {}
        self._revisions = count(1)

    async def get(self, key: str) -> KeyValueEntry | None:
        """As `Register.get`."""
        return self._entries.get(key)

    async def list_prefix(self, prefix: str) -> dict[str, KeyValueEntry]:
        """As `Register.all`."""
        return {key: value for key, value in self._entries.items() if key.startswith(f"{prefix}.")}

    async def put(self, key: str, value: bytes, revision: int | None = None) -> int:
        """As `Register.put`."""
        self._check_revision(key, revision)
        new = next(self._revisions)
        self._entries[key] = KeyValueEntry(value, new)
        return new

    async def remove(self, key: str, revision: int | None = None) -> None:
        """As `Register.remove`."""
        self._check_revision(key, revision)
        self._entries.pop(key, None)

    async def close(self) -> None:
        """As `Register.close`."""
        self._entries.clear()

    def _check_revision(self, key: str, revision: int | None) -> None:
        here = self._entries.get(key)
        if revision is not None and revision != (here.revision if here else 0):
            raise RevisionConflict(key)
