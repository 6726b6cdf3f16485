"""The register between processes: a key-value bucket of NATS JetStream, through nats-py.

A connection of its own, apart from the bus: a question here may wait, and nothing live waits behind it. After whatever
goes wrong the connection is given up, and the next question makes another.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import nats
from nats.aio.client import Client
from nats.errors import Error
from nats.js.api import KeyValueConfig
from nats.js.errors import BadRequestError, KeyNotFoundError, KeyWrongLastSequenceError, NoKeysError
from nats.js.kv import KV_DEL, KV_PURGE, KeyValue

from bunraku.backing.register import Conflict, Registered
from bunraku.backing.unavailable import ANSWERED, Unavailable

BUCKET = "bunraku"
_WRONG_LAST_SEQUENCE = 10071
CONNECTING = 1.0
"""Seconds that a server has to answer a connection."""


class NatsRegister:
    """The register at some servers, of which any one will do. JetStream must be on there."""

    def __init__(self, url: str) -> None:
        """`url` as `NatsBus` has it."""
        self._servers = [f"nats://{part.removeprefix('nats://')}" for part in url.split(",")]
        self._client: Client | None = None
        self._bucket: KeyValue | None = None
        self._connecting = asyncio.Lock()

    async def get(self, key: str) -> Registered | None:
        """As `Register.get`."""
        async with self._opened() as bucket:
            try:
                entry = await bucket.get(key)
            except KeyNotFoundError:
                return None
            return Registered(entry.value or b"", entry.revision or 0)

    async def all(self, prefix: str) -> dict[str, Registered]:
        """As `Register.all`."""
        found: dict[str, Registered] = {}
        async with self._opened() as bucket:
            watching: Any = await bucket.watch(f"{prefix}.>", ignore_deletes=True)
            try:
                # None comes after what there was
                while (entry := await watching.updates()) is not None:
                    if entry.operation not in (KV_DEL, KV_PURGE):
                        found[entry.key] = Registered(entry.value or b"", entry.revision or 0)
            except NoKeysError:
                return {}
            finally:
                await watching.stop()
        return found

    async def put(self, key: str, value: bytes, revision: int | None = None) -> int:
        """As `Register.put`."""
        async with self._opened() as bucket:
            try:
                if revision is None:
                    return await bucket.put(key, value)
                if revision == 0:
                    return await bucket.create(key, value)
                return await bucket.update(key, value, last=revision)
            except KeyWrongLastSequenceError:
                raise Conflict(key) from None

    async def remove(self, key: str, revision: int | None = None) -> None:
        """As `Register.remove`."""
        async with self._opened() as bucket:
            try:
                await bucket.delete(key, last=revision)
            except BadRequestError as error:
                if error.err_code != _WRONG_LAST_SEQUENCE:
                    raise
                raise Conflict(key) from None

    async def close(self) -> None:
        """As `Register.close`."""
        client, self._client, self._bucket = self._client, None, None
        if client is not None:
            with contextlib.suppress(Error, OSError, TimeoutError, asyncio.InvalidStateError):
                async with asyncio.timeout(CONNECTING):
                    await client.close()

    @asynccontextmanager
    async def _opened(self) -> AsyncIterator[KeyValue]:
        """The bucket; raises `Unavailable` where it does not answer within `ANSWERED` seconds."""
        try:
            async with asyncio.timeout(ANSWERED):
                yield await self._open()
        except Conflict:
            raise
        except (Error, OSError, TimeoutError) as error:
            await self.close()
            raise Unavailable("the register", str(error) or "no answer") from None

    async def _open(self) -> KeyValue:
        async with self._connecting:
            if self._bucket is None or self._client is None or not self._client.is_connected:
                await self.close()
                self._client = await nats.connect(
                    self._servers, name="bunraku register", allow_reconnect=False, connect_timeout=CONNECTING
                )
                stream = self._client.jetstream(timeout=ANSWERED)
                self._bucket = await stream.create_key_value(KeyValueConfig(BUCKET, history=1))
            return self._bucket
