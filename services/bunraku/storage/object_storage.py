"""Objects by name, in a folder or in an object store by URL."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Awaitable
from datetime import timedelta
from typing import Any, TypeVar

import obstore
from obstore.exceptions import BaseError
from obstore.store import LocalStore, ObjectStore, from_url

from bunraku.http.problem_details import insufficient_storage, is_disk_full
from bunraku.runtime.availability import BACKEND_TIMEOUT_S, BackendTimeout, BackendUnavailable

MIN_THROUGHPUT_BYTES_PER_S = 1 << 20
"""Bytes a second: a store that takes or gives fewer counts as gone."""

Found = TypeVar("Found")


class ObjectStorage:
    """Objects at `file:///folder`, `s3://bucket/prefix`, and what else obstore knows.

    Methods raise `Unavailable` where a store is not the machine's own and is away, refuses us, or has no such bucket.
    Endpoint and keys of S3 are those of the environment (`AWS_ENDPOINT_URL`, `AWS_ACCESS_KEY_ID` ...).
    """

    def __init__(self, url: str) -> None:
        """Raises ValueError, or what obstore raises, for what is no address."""
        self._timeout = BackendTimeout("the library")
        self._is_local = url.startswith("file://")
        self._store: ObjectStore
        if self._is_local:
            self._folder = url.removeprefix("file://")
            self._store = LocalStore(self._folder, mkdir=True)
        elif url.startswith("memory:"):
            self._store = from_url(url)
        else:
            # an endpoint without TLS is one only where somebody says so in its address
            patience: Any = {"allow_http": True, "connect_timeout": timedelta(seconds=BACKEND_TIMEOUT_S / 2)}
            again: Any = {"max_retries": 3, "retry_timeout": timedelta(seconds=BACKEND_TIMEOUT_S / 2)}
            self._store = from_url(url, client_options=patience, retry_config=again)

    async def put(self, path: str, data: bytes) -> None:
        """Store an object; once this returns it is there. Raises `ProblemError`, 507, where there is no room for it:
        what was there under its name stays."""
        try:
            await self._run_request(obstore.put_async(self._store, path, data), len(data))
        except FileNotFoundError as error:
            if self._is_local:
                raise
            raise BackendUnavailable("the library", _error_detail(error)) from error

    async def get(self, path: str) -> bytes | None:
        """The object, None where there is none."""
        try:
            found = await self._run_request(obstore.get_async(self._store, path))
            return bytes(await self._run_request(found.bytes_async(), found.meta["size"]))
        except FileNotFoundError:
            return None

    async def delete(self, path: str) -> None:
        """Remove an object; nothing happens where there is none."""
        try:
            await self._run_request(obstore.delete_async(self._store, path))
        except FileNotFoundError:
            return

    async def check(self) -> None:
        """Raises `Unavailable` where the store cannot be used now."""
        if self._is_local:
            if not await asyncio.to_thread(os.access, self._folder, os.R_OK | os.W_OK | os.X_OK):
                raise BackendUnavailable("the library", f"there is no folder {self._folder} to write in")
        else:
            await self.get("readyz")

    async def _run_request(self, request: Awaitable[Found], transfer_bytes: int = 0) -> Found:
        if self._is_local:
            try:
                return await request
            except BaseError as error:
                if is_disk_full(error):
                    raise insufficient_storage("the library") from error
                raise
        try:
            return await self._timeout.wait(request, BACKEND_TIMEOUT_S + transfer_bytes / MIN_THROUGHPUT_BYTES_PER_S)
        except BaseError as error:
            raise BackendUnavailable("the library", _error_detail(error)) from error


def _error_detail(error: Exception) -> str:
    """The first line of what obstore says at length."""
    return str(error).partition("\n")[0]
