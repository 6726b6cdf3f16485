"""The bus between processes: NATS core. Whenever a connection ends another is made, with every subscription, for ever.

The client is our own (proto/NOTES.md says why): what is published leaves at once, and comes in its order.
"""

from __future__ import annotations

import asyncio
import logging
import random
import secrets
from collections.abc import Callable, Mapping, Set
from itertools import count, cycle

from bunraku.http import request_id
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
from bunraku.messaging.nats_connection import (
    CONNECT_TIMEOUT_S,
    HEARTBEAT_INTERVAL_S,
    MAX_MISSED_HEARTBEATS,
    NatsConnection,
    parse_servers,
)
from bunraku.runtime.availability import BACKEND_TIMEOUT_S, BackendUnavailable

RECONNECT_DELAY_RANGE_S = (0.1, 0.4)
"""Seconds between two tries to connect, at random between these so that not all come at once."""
_INBOX_SUBSCRIPTION_ID = 0
"""The number of the subscription that answers come to."""
_NO_RESPONDERS_STATUS, _FAILED_STATUS = b"503", b"500"
_DeliveryCallback = Callable[[str, bytes, bytes], None]
"""Takes the reply's subject, the message, and its headers as they came."""

_log = logging.getLogger(__name__)


class NatsBus:
    """The bus at some servers, of which any one will do."""

    def __init__(self, url: str) -> None:
        """`url` is `nats://host:port` or `nats://user:password@host:port`, more servers after commas; raises ValueError
        for another. `open` connects."""
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
        """As `Bus.returns`."""
        self._run_task: asyncio.Task[None] | None = None
        self._response_tasks: set[asyncio.Task[None]] = set()

    async def open(self, timeout_s: float = 2 * CONNECT_TIMEOUT_S) -> None:
        """Connect. Where no server answers within `seconds` the bus is not `up`, and goes on trying."""
        self._run_task = asyncio.create_task(self._maintain_connection(), name="the bus")
        try:
            async with asyncio.timeout(timeout_s):
                await self._connected.wait()
        except TimeoutError:
            self._was_disconnected = True

    async def close(self) -> None:
        """As `Bus.close`; what was published before is sent, if that takes no longer than a second."""
        self._subscriptions.clear()
        self._reconnect_handlers.clear()
        self._connected.set()
        ending = [task for task in (self._run_task, *self._response_tasks) if task is not None]
        for task in ending:
            task.cancel()
        await asyncio.gather(*ending, return_exceptions=True)

    @property
    def is_connected(self) -> bool:
        """As `Bus.up`: a server has answered within the last two seconds."""
        return self._connection is not None

    def on_reconnect(self, handler: Callable[[], None]) -> Subscription:
        """As `Bus.on_return`."""
        number = next(self._subscription_ids)
        self._reconnect_handlers[number] = handler

        def end() -> None:
            self._reconnect_handlers.pop(number, None)

        return CallbackSubscription(end)

    def publish(self, subject: str, data: bytes) -> None:
        """As `Bus.publish`."""
        validate_subject(subject)
        if self._connection is None:
            return
        if len(data) > self._connection.max_payload:
            most = self._connection.max_payload
            _log.error("%d bytes to %s: the bus takes %d, see its max_payload", len(data), subject, most)
            return
        self._connection.publish(subject, data)

    def subscribe(self, subject: str, handler: MessageHandler) -> Subscription:
        """As `Bus.subscribe`. Order holds for all subjects of one publisher."""
        return self._subscribe_raw(subject, "", lambda _, data, __: deliver(handler, subject, data))

    def serve(self, subject: str, responder: Responder) -> Subscription:
        """As `Bus.answer`."""

        async def answer(reply: str, data: bytes, request: str) -> None:
            try:
                with request_id.bind(request):
                    said = await call_responder(responder, subject, data)
                self.publish(reply, said)
            except (ResponderFailed, BackendUnavailable) as error:
                if self._connection is not None:
                    self._connection.respond_error(
                        reply, error.backend if isinstance(error, BackendUnavailable) else ""
                    )

        def asked(reply: str, data: bytes, head: bytes) -> None:
            if reply:
                request = request_id.from_message_headers(head)
                replying = asyncio.create_task(answer(reply, data, request), name=f"answer to {subject}")
                self._response_tasks.add(replying)
                replying.add_done_callback(self._response_tasks.discard)

        # members of a queue group, of whom one gets each question
        return self._subscribe_raw(subject, "answer", asked)

    async def request(
        self,
        subject: str,
        data: bytes = b"",
        timeout_s: float = BACKEND_TIMEOUT_S,
        headers: Mapping[str, str] | None = None,
    ) -> bytes:
        """As `Bus.ask`; `headers` are by default the name of the request that is at work. Raises ValueError for more
        bytes than the server takes in one message."""
        if not is_subject(subject):
            raise NoResponse(subject)
        link = self._connection
        if link is None:
            raise BackendUnavailable("the bus", "no server answers")
        if len(data) > link.max_payload:
            raise ValueError(f"a question has {len(data)} bytes: the bus takes {link.max_payload}, see its max_payload")
        token = str(next(self._subscription_ids))
        answer: asyncio.Future[bytes] = asyncio.get_running_loop().create_future()
        self._pending_requests[token] = answer
        heard = link.receive_count
        try:
            if not link.publish(
                subject, data, f"{self._inbox}.{token}", request_id.message_headers() if headers is None else headers
            ):
                raise BackendUnavailable("the bus", "the server does not keep up")
            async with asyncio.timeout(timeout_s):
                return await answer
        except TimeoutError:
            # what came while this process stood still is not looked at yet
            await asyncio.sleep(0)
            if link.receive_count == heard and timeout_s > MAX_MISSED_HEARTBEATS * HEARTBEAT_INTERVAL_S:
                # beats in between were not answered either
                link.abort("the server is silent")
                if self._connection is link:
                    self._connection = None
                raise BackendUnavailable("the bus", "the server is silent") from None
            raise NoResponse(subject) from None
        finally:
            del self._pending_requests[token]

    def on_message(
        self, subscription_id: int, subject: str, reply: str, data: bytes, headers: bytes, status: bytes
    ) -> None:
        """As `Listener`."""
        if subscription_id != _INBOX_SUBSCRIPTION_ID:
            # one that has ended may still hear what was on the way
            if subscription_id in self._subscriptions:
                self._subscriptions[subscription_id][1](reply, data, headers)
            return
        question = self._pending_requests.get(subject.rpartition(".")[2])
        if question is None or question.done():
            return
        if status == _NO_RESPONDERS_STATUS:
            question.set_exception(NoResponse("nobody is there"))
        elif status == _FAILED_STATUS and data:
            question.set_exception(BackendUnavailable(data.decode(), "so says who was asked"))
        elif status == _FAILED_STATUS:
            question.set_exception(ResponderFailed("who was asked could not answer"))
        else:
            question.set_result(data)

    def _subscribe_raw(self, subject: str, group: str, on_delivery: _DeliveryCallback) -> Subscription:
        number = next(self._subscription_ids)
        command = f"SUB {validate_subject(subject)} {group} {number}\r\n".encode()
        self._subscriptions[number] = command, on_delivery
        self._send_command(command)

        def end() -> None:
            if self._subscriptions.pop(number, None) is not None:
                self._send_command(b"UNSUB %d\r\n" % number)

        return CallbackSubscription(end)

    def _send_command(self, command: bytes) -> None:
        # without room for it the connection begins anew, with what holds then
        if self._connection is not None and not self._connection.send_command(command):
            self._connection.abort("the server does not keep up")

    async def _maintain_connection(self) -> None:
        """Connect to one server after the other, for ever."""
        told = False
        for server in cycle(random.sample(self._servers, len(self._servers))):
            known = dict(self._subscriptions)
            first = [
                b"SUB %b.* %d\r\n" % (self._inbox.encode(), _INBOX_SUBSCRIPTION_ID),
                *(command for command, _ in known.values()),
            ]
            try:
                link = await NatsConnection.open(server, self, first)
            except OSError as error:
                if not told:
                    _log.warning("the bus is away: %s", error)
                told, self._was_disconnected = True, True
            else:
                told = False
                try:
                    self._on_connected(link, known.keys())
                    await asyncio.wait((link.closed,))
                    _log.warning("the bus is away: %s", link.closed.result())
                finally:
                    self._on_disconnected()
                    await link.close()
            await asyncio.sleep(random.uniform(*RECONNECT_DELAY_RANGE_S))

    def _on_connected(self, connection: NatsConnection, subscribed_ids: Set[int]) -> None:
        """The bus is up, with a connection that has the subscriptions `known`; what changed meanwhile is caught up."""
        self._connection = connection
        for number in subscribed_ids - self._subscriptions.keys():
            self._send_command(b"UNSUB %d\r\n" % number)
        for number in self._subscriptions.keys() - subscribed_ids:
            self._send_command(self._subscriptions[number][0])
        self._connected.set()
        if not self._was_disconnected:
            return
        self.reconnects += 1
        _log.warning("the bus is back")
        for handler in tuple(self._reconnect_handlers.values()):
            try:
                handler()
            except Exception:
                _log.exception("the bus is back, and somebody could not take it")

    def _on_disconnected(self) -> None:
        """The bus is away."""
        self._connection, self._was_disconnected = None, True
        for question in self._pending_requests.values():
            if not question.done():
                question.set_exception(BackendUnavailable("the bus", "the connection ended while a question was asked"))
