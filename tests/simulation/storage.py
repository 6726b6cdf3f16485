"""Simulated disks: objects and the catalogue's database outlive the processes that use them."""

from __future__ import annotations

import asyncio
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from random import Random
from typing import Any, cast
from unittest.mock import patch
from weakref import WeakSet

import aiosqlite.core

from bunraku.storage.object_storage import ObjectStorage
from tests.simulation.node import Node, current_node

LOCK_RETRY_US = 5_000
"""Interval at which a statement waits for the lock of another connection."""
MAX_LOCK_RETRIES = 1_000
"""Number of attempts within the five seconds for which SQLite waits by default."""


class Disk:
    """Objects by path, and the duration of an access."""

    def __init__(self, random: Random) -> None:
        self.objects: dict[str, bytes] = {}
        self.max_access_us = 2_000
        self._random = random

    def access_us(self) -> int:
        """Return the duration of an access."""
        return self._random.randrange(100, self.max_access_us)

    def objects_of(self, node: Node) -> ObjectStorage:
        """Return the storage as a process uses it."""
        return cast(ObjectStorage, NodeObjects(self, node))


class NodeObjects:
    """`ObjectStorage` of one process; what it has begun to write when it is killed is not written."""

    def __init__(self, disk: Disk, node: Node) -> None:
        self._disk = disk
        self._node = node

    async def put(self, path: str, data: bytes) -> None:
        await self._access()
        self._disk.objects[path] = data

    async def put_file(self, path: str, source: Path) -> None:
        await self.put(path, await asyncio.to_thread(source.read_bytes))

    async def get(self, path: str) -> bytes | None:
        await self._access()
        return self._disk.objects.get(path)

    async def copy(self, path: str, target: Path) -> bool:
        contents = await self.get(path)
        if contents is not None:
            await asyncio.to_thread(target.write_bytes, contents)
        return contents is not None

    async def delete(self, path: str) -> None:
        await self._access()
        self._disk.objects.pop(path, None)

    async def sizes(self, paths: list[str]) -> list[int | None]:
        await self._access()
        return [None if (data := self._disk.objects.get(path)) is None else len(data) for path in paths]

    async def check(self) -> None:
        self._node.require_alive()

    async def _access(self) -> None:
        self._node.require_alive()
        await asyncio.sleep(self._disk.access_us() * 1e-6)
        self._node.require_alive()


class Databases:
    """SQLite connections of all processes, used in the event loop instead of in threads."""

    def __init__(self, disk: Disk) -> None:
        self._disk = disk
        self._connections: dict[Node, list[aiosqlite.core.Connection]] = {}
        self._handles: dict[Node, list[_Handle]] = {}

    def close(self, node: Node) -> None:
        """Close the connections of a process that was killed: its open transactions are rolled back."""
        for connection in self._connections.pop(node, ()):
            connection._connection, connection._running = None, False
        for handle in self._handles.pop(node, ()):
            handle.release()

    def close_all(self) -> None:
        """Close all connections."""
        for node in tuple(self._connections):
            self.close(node)

    @contextmanager
    def installed(self) -> Iterator[None]:
        """Let aiosqlite run its functions in the event loop."""
        databases = self

        class InlineConnection(aiosqlite.core.Connection):
            def __init__(self, *arguments: Any, **options: Any) -> None:
                super().__init__(*arguments, **options)
                node = current_node()
                assert node is not None
                databases._connections.setdefault(node, []).append(self)

        class InlineQueue:
            def put_nowait(self, item: tuple[asyncio.Future[Any] | None, Callable[[], Any]]) -> None:
                node, (future, function) = current_node(), item
                if node is not None and node.is_alive:
                    node.call_later(databases._disk.access_us(), _run_function, node, future, function)
                elif future is not None:
                    future.cancel()

        class NoThread:
            daemon = True

            def __init__(self, **_: object) -> None: ...

            def start(self) -> None: ...

        with (
            patch("aiosqlite.core.Connection", InlineConnection),
            patch("aiosqlite.core.SimpleQueue", InlineQueue),
            patch("aiosqlite.core.Thread", NoThread),
            patch("sqlite3.connect", self._connect),
        ):
            yield

    def _connect(self, *arguments: Any, **options: Any) -> sqlite3.Connection:
        # a statement must not wait for a lock in real time
        handle = _sqlite_connect(*arguments, **{**options, "timeout": 0.0, "factory": _Handle})
        assert isinstance(handle, _Handle)
        node = current_node()
        assert node is not None
        self._handles.setdefault(node, []).append(handle)
        handle.execute("PRAGMA synchronous = OFF")
        return handle


_sqlite_connect = sqlite3.connect


class _Handle(sqlite3.Connection):
    """Connection that releases its locks when it is closed, although statements may still be referenced."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._cursors: WeakSet[sqlite3.Cursor] = WeakSet()

    def cursor(self, *arguments: Any, **options: Any) -> Any:
        cursor = super().cursor(*arguments, **options)
        self._cursors.add(cursor)
        return cursor

    def release(self) -> None:
        """Roll back and close."""
        with suppress(sqlite3.ProgrammingError):
            for cursor in tuple(self._cursors):
                cursor.close()
            self.rollback()
            self.close()


def _run_function(
    node: Node, future: asyncio.Future[Any] | None, function: Callable[[], Any], retries: int = MAX_LOCK_RETRIES
) -> None:
    """Run a function of aiosqlite; try again later while another connection holds the lock."""
    try:
        result = function()
    except Exception as error:
        if future is None or future.done():
            return
        if isinstance(error, sqlite3.OperationalError) and "locked" in str(error) and retries:
            node.call_later(LOCK_RETRY_US, _run_function, node, future, function, retries - 1)
        else:
            future.set_exception(error)
    else:
        if future is not None and not future.done():
            future.set_result(result)


def copy_database(template: Path, folder: Path) -> str:
    """Copy an empty, migrated database into `folder` and return its URL."""
    path = folder / "catalogue.sqlite"
    path.write_bytes(template.read_bytes())
    return f"sqlite:///{path}"
