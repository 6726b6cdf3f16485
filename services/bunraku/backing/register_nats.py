"""The register between processes: a key-value bucket of NATS JetStream, as NATS ADR-8 lays it out.

A bucket is a stream that keeps the last message of each subject `$KV.{bucket}.{key}`; a revision is the number of that
message. All is asked over the bus's own connection.
"""

from __future__ import annotations

import asyncio
import base64
import json
from collections.abc import Mapping
from typing import Any, NamedTuple

from bunraku.backing.bus import NobodyAnswers
from bunraku.backing.bus_nats import NatsBus
from bunraku.backing.register import Conflict, Registered
from bunraku.backing.unavailable import Unavailable

BUCKET = "bunraku"
_STREAM = f"KV_{BUCKET}"
_API = "$JS.API.STREAM"
_EXPECTED = "Nats-Expected-Last-Subject-Sequence"
_OPERATION = "KV-Operation"
_CONFIG = {
    "name": _STREAM,
    "subjects": [f"$KV.{BUCKET}.>"],
    "max_msgs_per_subject": 1,
    "discard": "new",
    "allow_rollup_hdrs": True,
    "deny_delete": True,
    "storage": "file",
    "retention": "limits",
}
_NO_MESSAGE, _WRONG_LAST, _NO_STREAM, _OTHER_STREAM = 10037, 10071, 10059, 10058


class _Last(NamedTuple):
    """The last message under a key; `removed` where it says that nothing is there."""

    value: Registered
    removed: bool


class _Refused(Exception):
    """JetStream says no, for a reason with this number."""

    def __init__(self, number: int, why: str) -> None:
        super().__init__(why)
        self.number = number


class NatsRegister:
    """The register upon a bus to servers with JetStream."""

    def __init__(self, bus: NatsBus, replicas: int = 1) -> None:
        """`replicas` servers of a cluster keep it, where it is not there yet."""
        self._bus = bus
        self._replicas = replicas
        self._made = False

    async def get(self, key: str) -> Registered | None:
        """As `Register.get`."""
        last = await self._last(_subject(key))
        return None if last is None or last.removed else last.value

    async def all(self, prefix: str) -> dict[str, Registered]:
        """As `Register.all`."""
        asked = {"subjects_filter": _subject(f"{prefix}.>")}
        try:
            told = await self._request(f"{_API}.INFO.{_STREAM}", json.dumps(asked).encode())
        except _Refused as refused:
            raise Unavailable("the register", str(refused)) from None
        subjects = list(told["state"].get("subjects") or ())
        found = await asyncio.gather(*map(self._last, subjects))
        return {
            subject.removeprefix(_subject("")): last.value
            for subject, last in zip(subjects, found, strict=True)
            if last is not None and not last.removed
        }

    async def put(self, key: str, value: bytes, revision: int | None = None) -> int:
        """As `Register.put`."""
        try:
            return await self._put(key, value, revision)
        except Conflict:
            # what was removed leaves a message behind
            last = await self._last(_subject(key)) if revision == 0 else None
            if last is None or not last.removed:
                raise
            return await self._put(key, value, last.value.revision)

    async def remove(self, key: str, revision: int | None = None) -> None:
        """As `Register.remove`."""
        await self._put(key, b"", revision, {_OPERATION: "DEL"})

    async def close(self) -> None:
        """As `Register.close`; the bus is closed by who opened it."""

    async def _put(self, key: str, value: bytes, revision: int | None, headers: Mapping[str, str] | None = None) -> int:
        expected = {} if revision is None else {_EXPECTED: str(revision)}
        try:
            told = await self._request(_subject(key), value, {**(headers or {}), **expected})
        except _Refused as refused:
            if refused.number != _WRONG_LAST:
                raise Unavailable("the register", str(refused)) from None
            raise Conflict(key) from None
        return int(told["seq"])

    async def _last(self, subject: str) -> _Last | None:
        asked = json.dumps({"last_by_subj": subject}).encode()
        try:
            message = (await self._request(f"{_API}.MSG.GET.{_STREAM}", asked))["message"]
        except _Refused as refused:
            if refused.number != _NO_MESSAGE:
                raise Unavailable("the register", str(refused)) from None
            return None
        removed = f"{_OPERATION}:".encode() in base64.b64decode(message.get("hdrs", ""))
        return _Last(Registered(base64.b64decode(message.get("data", "")), int(message["seq"])), removed)

    async def _request(self, subject: str, data: bytes, headers: Mapping[str, str] | None = None) -> dict[str, Any]:
        """What JetStream answers, the bucket made where it is missing; raises `_Refused`."""
        if not self._made:
            await self._make()
        try:
            return await self._ask(subject, data, headers)
        except _Refused as refused:
            if refused.number != _NO_STREAM:
                raise
        # of a server that has lost everything
        await self._make()
        return await self._ask(subject, data, headers)

    async def _make(self) -> None:
        try:
            await self._ask(f"{_API}.CREATE.{_STREAM}", json.dumps(_CONFIG | {"num_replicas": self._replicas}).encode())
        except _Refused as refused:
            # one that was made with other settings, more replicas say, is as good
            if refused.number != _OTHER_STREAM:
                raise Unavailable("the register", str(refused)) from None
        self._made = True

    async def _ask(self, subject: str, data: bytes, headers: Mapping[str, str] | None = None) -> dict[str, Any]:
        try:
            told: dict[str, Any] = json.loads(await self._bus.ask(subject, data, headers=headers or {}))
        except NobodyAnswers:
            # the server is there, and what keeps things is not: off, or without a leader; a stream that is gone too
            self._made = False
            raise Unavailable("the register", "JetStream does not answer") from None
        error = told.get("error")
        if error is not None:
            raise _Refused(int(error.get("err_code", 0)), str(error.get("description", "JetStream says no")))
        return told


def _subject(key: str) -> str:
    return f"$KV.{BUCKET}.{key}"
