"""Key-value store between processes: a bucket of NATS JetStream (NATS ADR-8).

A bucket is a stream that keeps the last message of each subject `$KV.{bucket}.{key}`; a revision is the sequence number
of that message. Requests use the connection of the bus.
"""

from __future__ import annotations

import asyncio
import base64
import contextlib
import json
from collections import deque
from collections.abc import Mapping
from typing import Any, NamedTuple

from bunraku.messaging.bus import NoResponse
from bunraku.messaging.bus_nats import NatsBus
from bunraku.messaging.key_value import KeyValueEntry, KeyValueView, RevisionConflict
from bunraku.messaging.key_value_watch_nats import OPERATION_HEADER, Bucket, NatsKeyValueWatch
from bunraku.runtime.availability import BackendUnavailable

BUCKET_NAME = "bunraku"
MARKER_LIFETIME_S = 60.0
"""Time after which the message that marks a key as removed is purged, in seconds: every watch has received it or has
begun again."""
MAX_MARKERS = 10_000
"""Number of removed keys that a process remembers for the purge."""
MAX_PURGES = 2
"""Number of messages that are purged with each removal."""
MAX_CREATE_ATTEMPTS = 3
"""Number of attempts to create a key that was removed before."""
_STREAM_NAME = f"KV_{BUCKET_NAME}"
_API_PREFIX = "$JS.API.STREAM"
_EXPECTED_SEQUENCE_HEADER = "Nats-Expected-Last-Subject-Sequence"
_STREAM_CONFIG = {
    "name": _STREAM_NAME,
    "subjects": [f"$KV.{BUCKET_NAME}.>"],
    "max_msgs_per_subject": 1,
    "discard": "new",
    "allow_rollup_hdrs": True,
    "deny_delete": True,
    "storage": "file",
    "retention": "limits",
}
_NO_MESSAGE_ERROR, _WRONG_LAST_SEQUENCE_ERROR, _NO_STREAM_ERROR, _STREAM_EXISTS_ERROR = 10037, 10071, 10059, 10058


class _LastMessage(NamedTuple):
    """Last message of a key, which may mark the key as removed."""

    entry: KeyValueEntry
    is_removed: bool


class _JetStreamError(Exception):
    """An error response of JetStream, with its error code."""

    def __init__(self, code: int, description: str) -> None:
        super().__init__(description)
        self.code = code


class NatsKeyValueStore:
    """Key-value store on NATS servers with JetStream."""

    def __init__(self, bus: NatsBus, replicas: int = 1) -> None:
        """`replicas` is the number of servers that store the bucket, applied when it is created."""
        self._bus = bus
        self._replicas = replicas
        self._stream_created = False
        self._watch: NatsKeyValueWatch | None = None
        # time of the purge, key and revision of messages that mark keys as removed
        self._markers: deque[tuple[float, str, int]] = deque(maxlen=MAX_MARKERS)

    async def get(self, key: str) -> KeyValueEntry | None:
        last = await self._get_last_message(_subject(key))
        return None if last is None or last.is_removed else last.entry

    async def put(self, key: str, value: bytes, revision: int | None = None) -> int:
        expected = revision
        for _ in range(MAX_CREATE_ATTEMPTS):
            try:
                return await self._put(key, value, expected)
            except RevisionConflict:
                if revision != 0:
                    raise
                # a removed key may have a message that marks the removal, until it is purged
                last = await self._get_last_message(_subject(key))
                if last is not None and not last.is_removed:
                    raise
                expected = 0 if last is None else last.entry.revision
        raise RevisionConflict(key)

    async def remove(self, key: str, revision: int | None = None) -> None:
        marker = await self._put(key, b"", revision, {OPERATION_HEADER: "DEL"})
        now_s = asyncio.get_running_loop().time()
        self._markers.append((now_s + MARKER_LIFETIME_S, key, marker))
        with contextlib.suppress(BackendUnavailable):
            await self._purge_markers(now_s)

    def watch(self) -> KeyValueView:
        if self._watch is None:
            self._watch = NatsKeyValueWatch(self._bus, Bucket(_STREAM_NAME, _subject(""), self._request_or_unavailable))
        return self._watch.view

    async def synchronise(self) -> None:
        info = await self._request_or_unavailable(f"{_API_PREFIX}.INFO.{_STREAM_NAME}", b"")
        await self.watch().wait_for(int(info["state"]["last_seq"]))

    async def close(self) -> None:
        """End the watch; the owner of the bus closes it."""
        if self._watch is not None:
            await self._watch.close()

    async def _purge_markers(self, now_s: float) -> None:
        """Purge the oldest messages of this store that mark keys as removed: the stream would grow for ever."""
        for _ in range(MAX_PURGES):
            if not self._markers or self._markers[0][0] > now_s:
                return
            _, key, marker = self._markers.popleft()
            # up to the marker only: the key may exist again
            query = json.dumps({"filter": _subject(key), "seq": marker + 1}).encode()
            await self._request_or_unavailable(f"{_API_PREFIX}.PURGE.{_STREAM_NAME}", query)

    async def _put(self, key: str, value: bytes, revision: int | None, headers: Mapping[str, str] | None = None) -> int:
        expected = {} if revision is None else {_EXPECTED_SEQUENCE_HEADER: str(revision)}
        try:
            response = await self._request(_subject(key), value, {**(headers or {}), **expected})
        except _JetStreamError as error:
            if error.code != _WRONG_LAST_SEQUENCE_ERROR:
                raise BackendUnavailable("the register", str(error)) from None
            raise RevisionConflict(key) from None
        return int(response["seq"])

    async def _get_last_message(self, subject: str) -> _LastMessage | None:
        query = json.dumps({"last_by_subj": subject}).encode()
        try:
            message = (await self._request(f"{_API_PREFIX}.MSG.GET.{_STREAM_NAME}", query))["message"]
        except _JetStreamError as error:
            if error.code != _NO_MESSAGE_ERROR:
                raise BackendUnavailable("the register", str(error)) from None
            return None
        removed = f"{OPERATION_HEADER}:".encode() in base64.b64decode(message.get("hdrs", ""))
        return _LastMessage(KeyValueEntry(base64.b64decode(message.get("data", "")), int(message["seq"])), removed)

    async def _request_or_unavailable(self, subject: str, data: bytes) -> dict[str, Any]:
        """Return a response of JetStream; raise `BackendUnavailable` also for an error response."""
        try:
            return await self._request(subject, data)
        except _JetStreamError as error:
            raise BackendUnavailable("the register", str(error)) from None

    async def _request(self, subject: str, data: bytes, headers: Mapping[str, str] | None = None) -> dict[str, Any]:
        """Return a response of JetStream, creating the bucket if needed; raise `_JetStreamError`."""
        if not self._stream_created:
            await self._create_stream()
        try:
            return await self._request_once(subject, data, headers)
        except _JetStreamError as error:
            if error.code != _NO_STREAM_ERROR:
                raise
        # the server has lost its data
        await self._create_stream()
        return await self._request_once(subject, data, headers)

    async def _create_stream(self) -> None:
        try:
            await self._request_once(
                f"{_API_PREFIX}.CREATE.{_STREAM_NAME}",
                json.dumps(_STREAM_CONFIG | {"num_replicas": self._replicas}).encode(),
            )
        except _JetStreamError as error:
            # a bucket with other settings, for example more replicas, is used as it is
            if error.code != _STREAM_EXISTS_ERROR:
                raise BackendUnavailable("the register", str(error)) from None
        self._stream_created = True

    async def _request_once(
        self, subject: str, data: bytes, headers: Mapping[str, str] | None = None
    ) -> dict[str, Any]:
        try:
            response: dict[str, Any] = json.loads(await self._bus.request(subject, data, headers=headers or {}))
        except NoResponse:
            # the server responds, but JetStream is off or has no leader, or the stream does not exist
            self._stream_created = False
            raise BackendUnavailable(
                "the register", "JetStream does not answer; check that it is enabled and has a leader"
            ) from None
        error = response.get("error")
        if error is not None:
            raise _JetStreamError(
                int(error.get("err_code", 0)), str(error.get("description", "unknown JetStream error"))
            )
        return response


def _subject(key: str) -> str:
    return f"$KV.{BUCKET_NAME}.{key}"
