"""Objects by path, in a folder or in an object store."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Awaitable
from datetime import timedelta
from typing import Any, TypeVar

import obstore
from obstore.exceptions import BaseError
from obstore.store import LocalStore, ObjectStore, from_url

from bunraku.runtime.availability import BACKEND_TIMEOUT_S, BackendTimeout, BackendUnavailable
from bunraku.runtime.insufficient_storage import insufficient_storage, is_disk_full

MIN_THROUGHPUT_BYTES_PER_S = 1 << 20
"""Throughput below which an object store counts as unavailable, in bytes per second."""

Result = TypeVar("Result")


class ObjectStorage:
    """Objects at `file:///folder`, `s3://bucket/prefix` or another URL that obstore supports.

    Methods raise `BackendUnavailable` if a remote store does not respond, denies access or has no such bucket. Endpoint
    and keys of S3 come from the environment (`AWS_ENDPOINT_URL`, `AWS_ACCESS_KEY_ID` ...).
    """

    def __init__(self, url: str) -> None:
        """Raise ValueError, or an error of obstore, for an invalid URL."""
        self._timeout = BackendTimeout("the library")
        self._is_local = url.startswith("file://")
        self._store: ObjectStore
        if self._is_local:
            self._folder = url.removeprefix("file://")
            self._store = LocalStore(self._folder, mkdir=True)
        elif url.startswith("memory:"):
            self._store = from_url(url)
        else:
            # http:// is used only if the endpoint's URL has it
            client_options: Any = {"allow_http": True, "connect_timeout": timedelta(seconds=BACKEND_TIMEOUT_S / 2)}
            retry_config: Any = {"max_retries": 3, "retry_timeout": timedelta(seconds=BACKEND_TIMEOUT_S / 2)}
            self._store = from_url(url, client_options=client_options, retry_config=retry_config)

    async def put(self, path: str, data: bytes) -> None:
        """Store an object durably.

        Raise `ProblemError` (507) if there is no space; the previous object of this path then stays.
        """
        try:
            await self._run_request(obstore.put_async(self._store, path, data), len(data))
        except FileNotFoundError as error:
            if self._is_local:
                raise
            raise BackendUnavailable("the library", _error_detail(error)) from error

    async def get(self, path: str) -> bytes | None:
        """Return an object, None if it does not exist."""
        try:
            response = await self._run_request(obstore.get_async(self._store, path))
            return bytes(await self._run_request(response.bytes_async(), response.meta["size"]))
        except FileNotFoundError:
            return None

    async def delete(self, path: str) -> None:
        """Remove an object if it exists."""
        try:
            await self._run_request(obstore.delete_async(self._store, path))
        except FileNotFoundError:
            return

    async def check(self) -> None:
        """Raise `BackendUnavailable` if the store cannot be used now."""
        if self._is_local:
            if not await asyncio.to_thread(os.access, self._folder, os.R_OK | os.W_OK | os.X_OK):
                raise BackendUnavailable("the library", f"the folder {self._folder} does not exist or is not writable")
        else:
            await self.get("readyz")

    async def _run_request(self, request: Awaitable[Result], transfer_bytes: int = 0) -> Result:
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
    # the first line: obstore appends a debug dump
    return str(error).partition("\n")[0]
