"""Objects by path, in a folder or in an object store."""

from __future__ import annotations

import asyncio
import re
from collections.abc import AsyncIterator, Awaitable, Callable
from datetime import timedelta
from pathlib import Path
from typing import Any, TypeVar

import obstore
from obstore.exceptions import BaseError
from obstore.store import ObjectStore, from_url

from bunraku.runtime.availability import BACKEND_TIMEOUT_S, BackendTimeout, BackendUnavailable
from bunraku.runtime.insufficient_storage import insufficient_storage, is_disk_full
from bunraku.storage.object_folder import COPY_CHUNK_BYTES, LIST_CHUNK, ObjectFolder, StoredObject

MIN_THROUGHPUT_BYTES_PER_S = 1 << 20
"""Throughput below which an object store counts as unavailable, in bytes per second."""
CONCURRENT_HEAD_REQUESTS = 16
"""Requests for the sizes of objects that are sent to a remote store at the same time."""
_STORE_FULL = re.compile(r"status code: 507\b|<Code>\w*(?:QuotaExceeded|StorageFull)</Code>")
"""Errors of an S3 store without space: status 507 (RFC 4918, section 11.5), and codes of MinIO and Ceph."""

Result = TypeVar("Result")


class ObjectStorage:
    """Objects at `file:///folder`, `s3://bucket/prefix` or another URL that obstore supports.

    Methods raise `BackendUnavailable` if a store does not respond or denies access, a bucket does not exist, or a
    folder is missing or read-only. Endpoint and keys of S3 come from the environment (`AWS_ENDPOINT_URL`,
    `AWS_ACCESS_KEY_ID` ...).
    """

    def __init__(self, url: str) -> None:
        """Raise ValueError, or an error of obstore, for an invalid URL."""
        self._timeout = BackendTimeout("the library")
        self._folder = ObjectFolder(Path(url.removeprefix("file://"))) if url.startswith("file://") else None
        self._store: ObjectStore
        if self._folder is not None:
            return
        if url.startswith("memory:"):
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
        if self._folder is not None:
            await self._run_in_folder(lambda folder: folder.write(path, data))
        else:
            await self._put_remotely(path, data, len(data))

    async def put_file(self, path: str, source: Path) -> None:
        """Store the contents of a file as `put` does, without having all of it in memory."""
        if self._folder is not None:
            await self._run_in_folder(lambda folder: folder.write_file(path, source))
        else:
            await self._put_remotely(path, source, (await asyncio.to_thread(source.stat)).st_size)

    async def _put_remotely(self, path: str, contents: bytes | Path, size: int) -> None:
        try:
            await self._run_request(obstore.put_async(self._store, path, contents), size)
        except FileNotFoundError as error:
            raise BackendUnavailable("the library", _error_detail(error)) from error

    async def get(self, path: str) -> bytes | None:
        """Return an object, None if it does not exist."""
        if self._folder is not None:
            return await self._run_in_folder(lambda folder: folder.read(path))
        try:
            response = await self._run_request(obstore.get_async(self._store, path))
            return bytes(await self._run_request(response.bytes_async(), response.meta["size"]))
        except FileNotFoundError:
            return None

    async def copy(self, path: str, target: Path) -> bool:
        """Write an object to the file `target`, without having all of it in memory; return whether it exists."""
        if self._folder is not None:
            return await self._run_in_folder(lambda folder: folder.copy(path, target))
        try:
            response = await self._run_request(obstore.get_async(self._store, path))
        except FileNotFoundError:
            return False
        await self._run_request(_write_chunks(response, target), response.meta["size"])
        return True

    async def delete(self, path: str) -> None:
        """Remove an object if it exists."""
        if self._folder is not None:
            await self._run_in_folder(lambda folder: folder.remove(path))
            return
        try:
            await self._run_request(obstore.delete_async(self._store, path))
        except FileNotFoundError:
            return

    async def sizes(self, paths: list[str]) -> list[int | None]:
        """Return the sizes of objects in bytes, None for those that do not exist."""
        if self._folder is not None:
            return await self._run_in_folder(lambda folder: folder.sizes(paths))
        limit = asyncio.Semaphore(CONCURRENT_HEAD_REQUESTS)

        async def get_size(path: str) -> int | None:
            async with limit:
                try:
                    return (await self._run_request(obstore.head_async(self._store, path)))["size"]
                except FileNotFoundError:
                    return None

        return list(await asyncio.gather(*map(get_size, paths)))

    async def list_chunks(self, prefix: str) -> AsyncIterator[list[StoredObject]]:
        """Yield the objects of the folder `prefix` in chunks; in a local store also the files of unfinished writes."""
        if self._folder is not None:
            local = self._folder.list_chunks(prefix)
            while (objects := await self._run_in_folder(lambda _: next(local, None))) is not None:
                yield objects
            return
        stream = obstore.list(self._store, prefix, chunk_size=LIST_CHUNK)

        async def next_chunk() -> list[StoredObject]:
            return [
                StoredObject(item["path"], item["size"], item["last_modified"].timestamp())
                for item in await anext(stream, ())
            ]

        while remote := await self._run_request(next_chunk()):
            yield remote

    async def check(self) -> None:
        """Raise `BackendUnavailable` if the store cannot be used now."""
        if self._folder is None:
            await self.get("readyz")
        elif not await asyncio.to_thread(self._folder.is_usable):
            raise BackendUnavailable("the library", f"{self._folder} does not exist or is not writable")

    async def _run_in_folder(self, operation: Callable[[ObjectFolder], Result]) -> Result:
        assert self._folder is not None
        try:
            return await asyncio.to_thread(operation, self._folder)
        except OSError as error:
            if is_disk_full(error):
                raise insufficient_storage("the library") from error
            raise BackendUnavailable("the library", str(error)) from error

    async def _run_request(self, request: Awaitable[Result], transfer_bytes: int = 0) -> Result:
        try:
            return await self._timeout.wait(request, BACKEND_TIMEOUT_S + transfer_bytes / MIN_THROUGHPUT_BYTES_PER_S)
        except BaseError as error:
            if _STORE_FULL.search(str(error)):
                raise insufficient_storage("the library") from error
            raise BackendUnavailable("the library", _error_detail(error)) from error


async def _write_chunks(response: obstore.GetResult, target: Path) -> None:
    with await asyncio.to_thread(target.open, "wb") as file:
        async for chunk in response.stream(min_chunk_size=COPY_CHUNK_BYTES):
            await asyncio.to_thread(file.write, chunk)


def _error_detail(error: Exception) -> str:
    # the first line: obstore appends a debug dump
    return str(error).partition("\n")[0]
