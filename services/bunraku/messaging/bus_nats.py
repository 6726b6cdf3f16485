"""Bus between processes over NATS core; it reconnects for ever and restores all subscriptions.

The client is our own (`proto/NOTES.md` gives the reasons): messages are sent at once and delivered in order.
"""

from __future__ import annotations

import asyncio
import logging
import random
import secrets
from collections.abc import Callable, Mapping, Set
from itertools import count, cycle

from bunraku.messaging.bus import (
    CallbackSubscription,
    MessageHandler,
    NoResponse,
    Responder,
    ResponderFailed,
    Subscription,
    call_responder,
    deliver,
    is_subject,
    validate_subject,
)
from bunraku.messaging.nats_address import parse_servers
from bunraku.messaging.nats_connection import (
    CONNECT_TIMEOUT_S,
    HEARTBEAT_INTERVAL_S,
    MAX_MISSED_HEARTBEATS,
    NatsConnection,
    NatsMessage,
)
from bunraku.runtime import request_id
from bunraku.runtime.availability import BACKEND_TIMEOUT_S, BackendUnavailable

RECONNECT_DELAY_RANGE_S = (0.1, 0.4)
"""Range of the random delay between attempts to connect, in seconds; it spreads the clients of a restarted server."""
MAX_LOGGED_REASONS = 8
"""Maximum number of log lines about failed attempts to connect, per outage."""
_INBOX_SUBSCRIPTION_ID = 0
"""Id of the subscription that receives responses."""
_NO_RESPONDERS_STATUS, _FAILED_STATUS = b"503", b"500"
_DeliveryCallback = Callable[[NatsMessage], None]

_log = logging.getLogger(__name__)


class NatsBus:
    """Bus on one of several equivalent servers."""

    def __init__(self, url: str) -> None:
        """`url` is `nats://host:port`, `nats://user:password@host:port` or `tls://host:port?ca=FILE`.

        More servers follow after commas. Raise ValueError for another URL. `open` connects.
        """
        self._servers = parse_servers(url)
        self._inbox = f"_INBOX.{secrets.token_hex(12)}"
        self._subscription_ids = count(_INBOX_SUBSCRIPTION_ID + 1)
        self._subscriptions: dict[int, tuple[bytes, _DeliveryCallback]] = {}
        self._pending_requests: dict[str, asyncio.Future[bytes]] = {}
        self._reconnect_handlers: dict[int, Callable[[], None]] = {}
        self._connection: NatsConnection | None = None
        self._connected = asyncio.Event()
        self._was_disconnected = False
        self.reconnects = 0
        self._run_task: asyncio.Task[None] | None = None
        self._response_tasks: set[asyncio.Task[None]] = set()

    async def open(self, timeout_s: float = 2 * CONNECT_TIMEOUT_S) -> None:
        """Connect; if no server responds within `timeout_s`, return and keep trying in the background."""
        self._run_task = asyncio.create_task(self._maintain_connection(), name="bus connection")
        try:
            async with asyncio.timeout(timeout_s):
                await self._connected.wait()
        except TimeoutError:
            self._was_disconnected = True

    async def close(self) -> None:
        # closing the connection sends unsent messages, within CONNECT_TIMEOUT_S
        self._subscriptions.clear()
        self._reconnect_handlers.clear()
        self._connected.set()
        ending = [task for task in (self._run_task, *self._response_tasks) if task is not None]
        for task in ending:
            task.cancel()
        await asyncio.gather(*ending, return_exceptions=True)

    @property
    def is_connected(self) -> bool:
        return self._connection is not None

    def on_reconnect(self, handler: Callable[[], None]) -> Subscription:
        number = next(self._subscription_ids)
        self._reconnect_handlers[number] = handler

        def unsubscribe() -> None:
            self._reconnect_handlers.pop(number, None)

        return CallbackSubscription(unsubscribe)

    def publish(self, subject: str, data: bytes) -> None:
        validate_subject(subject)
        if self._connection is None:
            return
        if len(data) > self._connection.max_payload:
            limit = self._connection.max_payload
            _log.error(
                "Message of %d bytes to %s dropped: max_payload of the NATS server is %d", len(data), subject, limit
            )
            return
        self._connection.publish(subject, data)

    def subscribe(self, subject: str, handler: MessageHandler) -> Subscription:
        return self._subscribe_raw(subject, "", lambda message: deliver(handler, subject, message.data))

    def serve(self, subject: str, responder: Responder) -> Subscription:
        async def respond(message: NatsMessage) -> None:
            try:
                with request_id.bind(request_id.from_message_headers(message.headers)):
                    response = await call_responder(responder, subject, message.data)
                self.publish(message.reply, response)
            except (ResponderFailed, BackendUnavailable) as error:
                if self._connection is not None:
                    backend = error.backend if isinstance(error, BackendUnavailable) else ""
                    self._connection.respond_error(message.reply, backend)

        def on_request(message: NatsMessage) -> None:
            if message.reply:
                task = asyncio.create_task(respond(message), name=f"response to {subject}")
                self._response_tasks.add(task)
                task.add_done_callback(self._response_tasks.discard)

        # a queue group: the server sends each request to one member
        return self._subscribe_raw(subject, "answer", on_request)

    async def request(
        self,
        subject: str,
        data: bytes = b"",
        timeout_s: float = BACKEND_TIMEOUT_S,
        headers: Mapping[str, str] | None = None,
    ) -> bytes:
        """Send a request as `Bus.request` does; `headers` default to the id of the current HTTP request.

        Raise ValueError if `data` is larger than the server's `max_payload`.
        """
        if not is_subject(subject):
            raise NoResponse(subject)
        connection = self._connection
        if connection is None:
            raise BackendUnavailable("the bus", "no server responds")
        if len(data) > connection.max_payload:
            raise ValueError(
                f"request of {len(data)} bytes: max_payload of the NATS server is {connection.max_payload}"
            )
        token = str(next(self._subscription_ids))
        response: asyncio.Future[bytes] = asyncio.get_running_loop().create_future()
        self._pending_requests[token] = response
        received_before = connection.receive_count
        try:
            sent_headers = request_id.message_headers() if headers is None else headers
            if not connection.publish(subject, data, f"{self._inbox}.{token}", sent_headers):
                raise BackendUnavailable("the bus", "the send buffer is full")
            async with asyncio.timeout(timeout_s):
                return await response
        except TimeoutError:
            # lets the event loop read data that arrived while it was blocked
            await asyncio.sleep(0)
            if connection.receive_count == received_before and timeout_s > MAX_MISSED_HEARTBEATS * HEARTBEAT_INTERVAL_S:
                # the PINGs of this time were not answered either
                connection.abort("the server does not respond")
                if self._connection is connection:
                    self._connection = None
                raise BackendUnavailable("the bus", "the server does not respond") from None
            raise NoResponse(subject) from None
        finally:
            del self._pending_requests[token]

    def on_message(self, message: NatsMessage) -> None:
        if message.subscription_id != _INBOX_SUBSCRIPTION_ID:
            # messages to an ended subscription may still arrive
            if message.subscription_id in self._subscriptions:
                self._subscriptions[message.subscription_id][1](message)
            return
        pending = self._pending_requests.get(message.subject.rpartition(".")[2])
        if pending is None or pending.done():
            return
        if message.status == _NO_RESPONDERS_STATUS:
            pending.set_exception(NoResponse("no responder"))
        elif message.status == _FAILED_STATUS and message.data:
            pending.set_exception(BackendUnavailable(message.data.decode(), "reported by the responder"))
        elif message.status == _FAILED_STATUS:
            pending.set_exception(ResponderFailed("the responder raised an exception"))
        else:
            pending.set_result(message.data)

    def _subscribe_raw(self, subject: str, group: str, on_delivery: _DeliveryCallback) -> Subscription:
        number = next(self._subscription_ids)
        command = f"SUB {validate_subject(subject)} {group} {number}\r\n".encode()
        self._subscriptions[number] = command, on_delivery
        self._send_command(command)

        def unsubscribe() -> None:
            if self._subscriptions.pop(number, None) is not None:
                self._send_command(b"UNSUB %d\r\n" % number)

        return CallbackSubscription(unsubscribe)

    def _send_command(self, command: bytes) -> None:
        # if the send buffer is full, reconnect: that restores the current subscriptions
        if self._connection is not None and not self._connection.send_command(command):
            self._connection.abort("the send buffer is full")

    async def _maintain_connection(self) -> None:
        """Connect to one server after the other, for ever."""
        logged_reasons: set[str] = set()
        for server in cycle(random.sample(self._servers, len(self._servers))):
            subscriptions = dict(self._subscriptions)
            initial_commands = [
                b"SUB %b.* %d\r\n" % (self._inbox.encode(), _INBOX_SUBSCRIPTION_ID),
                *(command for command, _ in subscriptions.values()),
            ]
            try:
                connection = await NatsConnection.open(server, self, initial_commands)
            except OSError as error:
                # once per reason: after a restart of the server, its certificate may be invalid
                if str(error) not in logged_reasons and len(logged_reasons) < MAX_LOGGED_REASONS:
                    _log.warning("Bus disconnected: %s; reconnecting", error)
                    logged_reasons.add(str(error))
                self._was_disconnected = True
            else:
                logged_reasons.clear()
                try:
                    self._on_connected(connection, subscriptions.keys())
                    await asyncio.wait((connection.closed,))
                    _log.warning("Bus disconnected: %s; reconnecting", connection.closed.result())
                finally:
                    self._on_disconnected()
                    await connection.close()
            await asyncio.sleep(random.uniform(*RECONNECT_DELAY_RANGE_S))

    def _on_connected(self, connection: NatsConnection, subscribed_ids: Set[int]) -> None:
        """Use a new connection, and send the changes of subscriptions since its initial commands."""
        self._connection = connection
        for number in subscribed_ids - self._subscriptions.keys():
            self._send_command(b"UNSUB %d\r\n" % number)
        for number in self._subscriptions.keys() - subscribed_ids:
            self._send_command(self._subscriptions[number][0])
        self._connected.set()
        if not self._was_disconnected:
            return
        self.reconnects += 1
        _log.warning("Bus reconnected")
        for handler in tuple(self._reconnect_handlers.values()):
            try:
                handler()
            except Exception:
                _log.exception("Reconnection handler failed")

    def _on_disconnected(self) -> None:
        self._connection, self._was_disconnected = None, True
        for pending in self._pending_requests.values():
            if not pending.done():
                pending.set_exception(BackendUnavailable("the bus", "the connection closed during a request"))
