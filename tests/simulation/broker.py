"""Simulated message broker with the semantics of NATS: a bus, and a key-value store on the same connections.

A connection that is cut for longer than `OUTAGE_DETECTION_US` is closed at both ends; what was sent meanwhile is lost.
The client reconnects once the connection can be made again, restores its subscriptions and calls its handlers.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from functools import partial
from itertools import count
from random import Random
from typing import Any, TypeVar

from bunraku.messaging.bus import (
    CallbackSubscription,
    MessageHandler,
    NoResponse,
    Responder,
    ResponderFailed,
    Subscription,
    call_responder,
    deliver,
    validate_subject,
)
from bunraku.messaging.key_value import KeyValueEntry, KeyValueView, MemoryKeyValueStore
from bunraku.messaging.nats_connection import HEARTBEAT_INTERVAL_S, MAX_MISSED_HEARTBEATS
from bunraku.runtime.availability import BACKEND_TIMEOUT_S, BackendUnavailable
from tests.simulation.link import GOOD_LINK, Link, LinkQuality
from tests.simulation.node import Node

OUTAGE_DETECTION_US = round(MAX_MISSED_HEARTBEATS * HEARTBEAT_INTERVAL_S * 1e6)
"""Silence after which both ends close a connection."""
RECONNECT_DELAY_US = (100_000, 400_000)
LOSSY_SUBJECT = ".overlay"
"""End of the subjects whose messages the broker may lose or repeat: each replaces the one before it."""

T = TypeVar("T")


class Broker:
    """Server of the bus and of the key-value store; it outlives all its clients."""

    def __init__(self, node: Node, random: Random) -> None:
        self.node = node
        self.random = random
        self.store = MemoryKeyValueStore()
        self.loss = 0.0
        """Share of the messages to lossy subjects that get lost, and that arrive twice."""
        self.max_answer_delay_us = 0
        """Longest time for which an answer of the key-value store is late, after the operation was carried out."""
        self.on_publish: Callable[[BrokerClient, str, bytes], None] = lambda _client, _subject, _data: None
        """Observer of all published messages."""
        self._watches: dict[BrokerClient, Subscription] = {}
        self._subscribers: dict[str, dict[tuple[BrokerClient, int], None]] = {}
        self._responders: dict[str, dict[tuple[BrokerClient, int], None]] = {}

    def register(self, client: BrokerClient, subject: str, number: int, responds: bool) -> None:
        """Add a subscription of a client."""
        table = self._responders if responds else self._subscribers
        table.setdefault(subject, {})[client, number] = None

    def unregister(self, client: BrokerClient, number: int | None = None) -> None:
        """Remove a subscription of a client, or all."""
        if number is None and client in self._watches:
            self._watches.pop(client).unsubscribe()
        for table in (self._subscribers, self._responders):
            for subject, entries in tuple(table.items()):
                for entry in tuple(entries):
                    if entry[0] is client and number in (None, entry[1]):
                        del entries[entry]
                if not entries:
                    del table[subject]

    def route(self, subject: str, data: bytes) -> None:
        """Pass a message to all subscribers."""
        for client, number in tuple(self._subscribers.get(subject, ())):
            copies = 1
            if self.loss and subject.endswith(LOSSY_SUBJECT):
                chance = self.random.random()
                copies = 0 if chance < self.loss else 2 if chance < 2 * self.loss else 1
            for _ in range(copies):
                client.downlink.send(partial(client.on_message, number, data))

    def route_request(self, subject: str, data: bytes, sender: BrokerClient, token: int) -> None:
        """Pass a request to one of the responders."""
        responders = tuple(self._responders.get(subject, ()))
        if not responders:
            self.route_response(sender, token, NoResponse("no responder"))
            return
        client, number = self.random.choice(responders)
        client.downlink.send(partial(client.on_request, number, data, sender, token))

    def route_response(self, client: BrokerClient, token: int, response: object) -> None:
        """Pass a response or an exception to the client that waits for it."""
        client.downlink.send(partial(client.on_response, token, response))

    def watch(self, client: BrokerClient, view: KeyValueView) -> None:
        """Send a client a snapshot of the key-value store, then every change."""
        if client in self._watches:
            self._watches.pop(client).unsubscribe()
        store, is_live = self.store.watch(), False
        client.downlink.send(partial(view.replace, dict(store.entries), store.revision))

        def send_change(key: str, entry: KeyValueEntry | None) -> None:
            if is_live:
                client.downlink.send(partial(view.apply, key, entry, store.revision))

        self._watches[client] = store.on_change(send_change)
        is_live = True

    def answer(self, client: BrokerClient, token: int, operation: Callable[[], Coroutine[Any, Any, object]]) -> None:
        """Run an operation of the key-value store and send its result."""
        try:
            result: object = run_at_once(operation())
        except Exception as error:
            result = error
        if self.max_answer_delay_us:
            delay_us = self.random.randrange(self.max_answer_delay_us)
            self.node.call_later(delay_us, self.route_response, client, token, result)
        else:
            self.route_response(client, token, result)


def run_at_once(coroutine: Coroutine[Any, Any, T]) -> T:
    """Return the result of a coroutine that never waits."""
    try:
        coroutine.send(None)
    except StopIteration as finished:
        result: T = finished.value
        return result
    raise AssertionError(f"{coroutine} waits")


class BrokerClient:
    """Connection of a process to the broker, as a `Bus`."""

    def __init__(self, node: Node, broker: Broker, random: Random, quality: LinkQuality = GOOD_LINK) -> None:
        self.reconnects = 0
        self.is_connected = True
        self._node = node
        self._broker = broker
        self._random = random
        self.uplink = Link(broker.node, random, quality)
        self.downlink = Link(node, random, quality)
        self._numbers = count(1)
        self._handlers: dict[int, tuple[str, MessageHandler]] = {}
        self._responders: dict[int, tuple[str, Responder]] = {}
        self._reconnect_handlers: dict[int, Callable[[], None]] = {}
        self.pending: dict[int, asyncio.Future[Any]] = {}
        """Requests without a response."""
        self._cut_count = 0
        node.on_kill.append(self._on_killed)

    # faults

    def cut(self, up: bool = True, down: bool = True) -> None:
        """Cut one or both directions of the connection; after the detection time both ends close it."""
        self._cut_count += 1
        self.uplink.is_cut |= up
        self.downlink.is_cut |= down
        self._broker.node.call_later(OUTAGE_DETECTION_US, self._on_outage_detected, self._cut_count)

    def heal(self) -> None:
        """Restore the connection: what waited arrives, or the client reconnects."""
        self._cut_count += 1
        self.uplink.heal()
        self.downlink.heal()
        if not self.is_connected and self._node.is_alive:
            self._node.call_later(self._random.randrange(*RECONNECT_DELAY_US), self._reconnect, self._cut_count)

    def _on_outage_detected(self, cut: int) -> None:
        if cut == self._cut_count and self._node.is_alive:
            self._node.call(self._disconnect)

    def _disconnect(self) -> None:
        self.is_connected = False
        self._broker.unregister(self)
        for link in (self.uplink, self.downlink):
            link.reset()
        for pending in self.pending.values():
            if not pending.done():
                pending.set_exception(BackendUnavailable("the bus", "the connection closed during a request"))

    def _reconnect(self, cut: int) -> None:
        if cut != self._cut_count:
            return
        self.is_connected = True
        self.reconnects += 1
        for table, responds in ((self._handlers, False), (self._responders, True)):
            for number, (subject, _) in table.items():
                self.uplink.send(partial(self._broker.register, self, subject, number, responds))
        for handler in tuple(self._reconnect_handlers.values()):
            handler()

    def _on_killed(self) -> None:
        self.uplink.reset()
        self.downlink.reset()
        self._broker.unregister(self)

    # bus

    def on_reconnect(self, handler: Callable[[], None]) -> Subscription:
        number = next(self._numbers)
        self._reconnect_handlers[number] = handler
        return CallbackSubscription(lambda: self._reconnect_handlers.pop(number, None) and None)

    def publish(self, subject: str, data: bytes) -> None:
        validate_subject(subject)
        if self._node.is_alive:
            self._broker.on_publish(self, subject, data)
        self._send(partial(self._broker.route, subject, data))

    def subscribe(self, subject: str, handler: MessageHandler) -> Subscription:
        number = next(self._numbers)
        self._handlers[number] = validate_subject(subject), handler
        return self._register(subject, number, responds=False)

    def serve(self, subject: str, responder: Responder) -> Subscription:
        number = next(self._numbers)
        self._responders[number] = validate_subject(subject), responder
        return self._register(subject, number, responds=True)

    async def request(self, subject: str, data: bytes = b"", timeout_s: float = BACKEND_TIMEOUT_S) -> bytes:
        response: bytes = await self.call(
            lambda token: partial(self._broker.route_request, subject, data, self, token), timeout_s
        )
        return response

    async def close(self) -> None:
        self._handlers.clear()
        self._responders.clear()
        self._reconnect_handlers.clear()
        self._send(partial(self._broker.unregister, self))

    def _register(self, subject: str, number: int, responds: bool) -> Subscription:
        self._send(partial(self._broker.register, self, subject, number, responds))

        def unsubscribe() -> None:
            self._handlers.pop(number, None)
            self._responders.pop(number, None)
            self._send(partial(self._broker.unregister, self, number))

        return CallbackSubscription(unsubscribe)

    def _send(self, arrive: Callable[[], None]) -> None:
        if self._node.is_alive and self.is_connected:
            self.uplink.send(arrive)

    async def call(self, make_request: Callable[[int], Callable[[], None]], timeout_s: float) -> Any:
        """Send a request to the broker and return the response; raise as `Bus.request` does."""
        self._node.require_alive()
        if not self.is_connected:
            raise BackendUnavailable("the bus", "no server responds")
        token = next(self._numbers)
        response = self.pending[token] = asyncio.get_running_loop().create_future()
        self.uplink.send(make_request(token))
        try:
            async with asyncio.timeout(timeout_s):
                return await response
        except TimeoutError:
            raise NoResponse("no response in time") from None
        finally:
            del self.pending[token]

    # arrivals

    def on_message(self, number: int, data: bytes) -> None:
        """Handle a published message."""
        if number in self._handlers:
            subject, handler = self._handlers[number]
            deliver(handler, subject, data)

    def on_request(self, number: int, data: bytes, sender: BrokerClient, token: int) -> None:
        """Handle a request: its responder runs as a task of this process."""
        if number not in self._responders:
            return
        subject, responder = self._responders[number]

        async def respond() -> None:
            response: object
            try:
                response = await call_responder(responder, subject, data)
            except (ResponderFailed, BackendUnavailable) as error:
                response = error
            self._send(partial(self._broker.route_response, sender, token, response))

        self._node.start(respond(), f"response to {subject}")

    def on_response(self, token: int, response: object) -> None:
        """Handle a response to a request of this process."""
        pending = self.pending.get(token)
        if pending is None or pending.done():
            return
        if isinstance(response, Exception):
            pending.set_exception(response)
        else:
            pending.set_result(response)


class BrokerKeyValueStore:
    """The broker's key-value store as a process uses it."""

    def __init__(self, client: BrokerClient, broker: Broker) -> None:
        self._client = client
        self._view: KeyValueView | None = None
        self._store = broker.store
        self._broker = broker

    async def get(self, key: str) -> KeyValueEntry | None:
        entry: KeyValueEntry | None = await self._call(lambda: self._store.get(key))
        return entry

    async def put(self, key: str, value: bytes, revision: int | None = None) -> int:
        written: int = await self._call(lambda: self._store.put(key, value, revision))
        return written

    async def remove(self, key: str, revision: int | None = None) -> None:
        await self._call(lambda: self._store.remove(key, revision))

    def watch(self) -> KeyValueView:
        if self._view is None:
            self._view = KeyValueView()
            self._start_watch(self._view)
            self._client.on_reconnect(partial(self._start_watch, self._view))
        return self._view

    async def synchronise(self) -> None:
        await self.watch().wait_for(await self._call(self._read_revision))

    async def close(self) -> None:
        """Do nothing: the owner of the connection closes it."""

    async def _read_revision(self) -> int:
        return self._store.watch().revision

    def _start_watch(self, view: KeyValueView) -> None:
        view.suspend()
        self._client.uplink.send(partial(self._broker.watch, self._client, view))

    async def _call(self, operation: Callable[[], Coroutine[Any, Any, object]]) -> Any:
        broker, client = self._broker, self._client
        try:
            return await client.call(lambda token: partial(broker.answer, client, token, operation), BACKEND_TIMEOUT_S)
        except NoResponse:
            raise BackendUnavailable("the register", "no answer in time") from None
