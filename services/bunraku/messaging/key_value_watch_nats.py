"""Watch of a JetStream bucket: an ordered consumer that keeps a local copy current (NATS ADR-8, ADR-15, ADR-17).

The server pushes the last message of each key, then every change. Each message has a consecutive number: after a gap,
a reconnection or silence, a new consumer begins with a new snapshot.
"""

from __future__ import annotations

import asyncio
import json
import logging
from collections.abc import Awaitable, Callable
from typing import Any, NamedTuple

from bunraku.messaging.bus_nats import NatsBus
from bunraku.messaging.key_value import KeyValueEntry, KeyValueView
from bunraku.messaging.nats_connection import NatsMessage
from bunraku.runtime.availability import BackendUnavailable

HEARTBEAT_INTERVAL_S = 1.0
"""Interval between the server's signs of life while there are no changes, in seconds."""
MAX_MISSED_HEARTBEATS = 3
"""Number of intervals without a message after which the consumer counts as lost."""
RESTART_DELAY_S = 0.25
"""Delay before a new consumer, in seconds."""
OPERATION_HEADER = "KV-Operation"
"""Header of a message that marks a key as removed."""
_CONTROL_STATUS = b"100"
_LAST_CONSUMER_HEADER, _STALLED_HEADER = b"nats-last-consumer", b"nats-consumer-stalled"

_log = logging.getLogger(__name__)


class Bucket(NamedTuple):
    """Stream of a bucket."""

    stream: str
    subject_prefix: str
    """Beginning of the subjects of all keys, with its dot."""
    request: Callable[[str, bytes], Awaitable[dict[str, Any]]]
    """Function that sends a request to JetStream and returns the response; it raises `BackendUnavailable`."""


class _Delivery(NamedTuple):
    """Numbers in the reply subject of a pushed message (NATS ADR-15)."""

    stream_sequence: int
    consumer_sequence: int
    pending: int

    @classmethod
    def parse(cls, reply: str) -> _Delivery:
        """Parse `$JS.ACK.[domain.account.]stream.consumer.deliveries.stream_seq.consumer_seq.time.pending[.token]`."""
        tokens = reply.split(".")
        first = 5 if len(tokens) == 9 else 7
        return cls(int(tokens[first]), int(tokens[first + 1]), int(tokens[first + 3]))


class NatsKeyValueWatch:
    """Task that keeps a view of a bucket current, until `close`."""

    def __init__(self, bus: NatsBus, bucket: Bucket) -> None:
        self.view = KeyValueView()
        self._bus = bus
        self._bucket = bucket
        self._task = asyncio.create_task(self._run(), name="watch of the key-value store")

    async def close(self) -> None:
        """End the watch."""
        self._task.cancel()
        await asyncio.wait((self._task,))

    async def _run(self) -> None:
        while True:
            try:
                await self._consume()
            except BackendUnavailable as error:
                _log.debug("%s; watching again", error)
            except Exception:
                _log.exception("The watch of the key-value store failed; watching again")
            await asyncio.sleep(RESTART_DELAY_S)

    async def _consume(self) -> None:
        """Follow one consumer until it must be replaced."""
        consumer = _Consumer(self._bus, self._bucket, self.view)
        reconnection = self._bus.on_reconnect(consumer.stop)
        try:
            await consumer.start()
            while not consumer.stopped.is_set():
                heard = consumer.received
                try:
                    async with asyncio.timeout(MAX_MISSED_HEARTBEATS * HEARTBEAT_INTERVAL_S):
                        await consumer.stopped.wait()
                except TimeoutError:
                    # lets the event loop read what arrived while it was blocked
                    await asyncio.sleep(0)
                    if consumer.received == heard:
                        return
        finally:
            reconnection.unsubscribe()
            # without a consumer nobody learns of changes, nor that the server has lost its data
            consumer.stop()
            consumer.close()


class _Consumer:
    """One ephemeral consumer: first a snapshot, then changes.

    The server removes it some seconds after its subscription has ended.
    """

    def __init__(self, bus: NatsBus, bucket: Bucket, view: KeyValueView) -> None:
        self._bus = bus
        self._bucket = bucket
        self._view = view
        self._snapshot: dict[str, KeyValueEntry] | None = {}
        self._snapshot_revision = 0
        self._expected = 1
        self.received = 0
        """Number of messages, signs of life included."""
        self.stopped = asyncio.Event()
        """Set when messages were lost: the consumer must be replaced."""
        self._inbox = bus.new_inbox()
        self._subscription = bus.subscribe_messages(self._inbox, self._on_message)
        view.suspend()

    async def start(self) -> None:
        """Create the consumer; raise `BackendUnavailable`."""
        bucket = self._bucket
        info = await bucket.request(f"$JS.API.STREAM.INFO.{bucket.stream}", b"")
        self._snapshot_revision = int(info["state"]["last_seq"])
        config = {
            "deliver_subject": self._inbox,
            "deliver_policy": "last_per_subject",
            "filter_subject": f"{bucket.subject_prefix}>",
            "ack_policy": "none",
            "max_deliver": 1,
            "flow_control": True,
            "idle_heartbeat": round(HEARTBEAT_INTERVAL_S * 1e9),
            "mem_storage": True,
            "num_replicas": 1,
        }
        request = json.dumps({"stream_name": bucket.stream, "config": config}).encode()
        created = await bucket.request(f"$JS.API.CONSUMER.CREATE.{bucket.stream}", request)
        if int(created.get("num_pending", 0)) + int(created["delivered"]["consumer_seq"]) == 0:
            self._finish_snapshot()

    def stop(self) -> None:
        """Request another consumer."""
        self._view.suspend()
        self.stopped.set()

    def close(self) -> None:
        """End the subscription."""
        self._subscription.unsubscribe()

    def _on_message(self, message: NatsMessage) -> None:
        self.received += 1
        if self.stopped.is_set():
            return
        if message.status == _CONTROL_STATUS:
            self._on_control(message)
            return
        delivery = _Delivery.parse(message.reply)
        if delivery.consumer_sequence != self._expected:
            _log.debug("message %d of the watch is missing", self._expected)
            self.stop()
            return
        self._expected += 1
        self._on_entry(message, delivery)
        if self._snapshot is not None and delivery.pending == 0:
            self._snapshot_revision = max(self._snapshot_revision, delivery.stream_sequence)
            self._finish_snapshot()

    def _on_entry(self, message: NatsMessage, delivery: _Delivery) -> None:
        key = message.subject.removeprefix(self._bucket.subject_prefix)
        is_removed = OPERATION_HEADER.encode() in message.headers
        entry = None if is_removed else KeyValueEntry(message.data, delivery.stream_sequence)
        if self._snapshot is None:
            self._view.apply(key, entry, delivery.stream_sequence)
        elif entry is not None:
            self._snapshot[key] = entry
        else:
            self._snapshot.pop(key, None)

    def _finish_snapshot(self) -> None:
        if self._snapshot is not None:
            snapshot, self._snapshot = self._snapshot, None
            self._view.replace(snapshot, self._snapshot_revision)

    def _on_control(self, message: NatsMessage) -> None:
        """Answer flow control, and compare the number of the last message with that of a sign of life."""
        headers = _parse_headers(message.headers)
        reply = message.reply or headers.get(_STALLED_HEADER, b"").decode("ascii", "replace")
        if reply:
            self._bus.publish(reply, b"")
        last = headers.get(_LAST_CONSUMER_HEADER)
        if last is not None and int(last) != self._expected - 1:
            _log.debug("the watch has %s messages, expected %d", last, self._expected - 1)
            self.stop()


def _parse_headers(headers: bytes) -> dict[bytes, bytes]:
    """Return the headers of a message by name in lower case."""
    pairs = (line.partition(b":") for line in headers.split(b"\r\n")[1:])
    return {name.strip().lower(): value.strip() for name, colon, value in pairs if colon}
