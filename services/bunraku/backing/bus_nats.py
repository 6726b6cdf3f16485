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

from bunraku.backing import request_id
from bunraku.backing.bus import (
    Answerer,
    AnswerFailed,
    End,
    Handler,
    NobodyAnswers,
    Subscription,
    answered,
    checked,
    hand,
    sayable,
)
from bunraku.backing.nats_link import BEAT, BEATS, CONNECTING, Link, read_servers
from bunraku.backing.unavailable import ANSWERED, Unavailable

AGAIN = (0.1, 0.4)
"""Seconds between two tries to connect, at random between these so that not all come at once."""
_INBOX = 0
"""The number of the subscription that answers come to."""
_NOBODY, _FAILED = b"503", b"500"
_Heard = Callable[[str, bytes, bytes], None]
"""Takes the reply's subject, the message, and its headers as they came."""

_log = logging.getLogger(__name__)


class NatsBus:
    """The bus at some servers, of which any one will do."""

    def __init__(self, url: str) -> None:
        """`url` is `nats://host:port` or `nats://user:password@host:port`, more servers after commas; raises ValueError
        for another. `open` connects."""
        self._servers = read_servers(url)
        self._inbox = f"_INBOX.{secrets.token_hex(12)}"
        self._numbers = count(_INBOX + 1)
        self._subscriptions: dict[int, tuple[bytes, _Heard]] = {}
        self._questions: dict[str, asyncio.Future[bytes]] = {}
        self._on_return: dict[int, Callable[[], None]] = {}
        self._link: Link | None = None
        self._came = asyncio.Event()
        self._missed = False
        self.returns = 0
        """As `Bus.returns`."""
        self._running: asyncio.Task[None] | None = None
        self._replying: set[asyncio.Task[None]] = set()

    async def open(self, seconds: float = 2 * CONNECTING) -> None:
        """Connect. Where no server answers within `seconds` the bus is not `up`, and goes on trying."""
        self._running = asyncio.create_task(self._run(), name="the bus")
        try:
            async with asyncio.timeout(seconds):
                await self._came.wait()
        except TimeoutError:
            self._missed = True

    async def close(self) -> None:
        """As `Bus.close`; what was published before is sent, if that takes no longer than a second."""
        self._subscriptions.clear()
        self._on_return.clear()
        self._came.set()
        ending = [task for task in (self._running, *self._replying) if task is not None]
        for task in ending:
            task.cancel()
        await asyncio.gather(*ending, return_exceptions=True)

    @property
    def up(self) -> bool:
        """As `Bus.up`: a server has answered within the last two seconds."""
        return self._link is not None

    def on_return(self, handler: Callable[[], None]) -> Subscription:
        """As `Bus.on_return`."""
        number = next(self._numbers)
        self._on_return[number] = handler

        def end() -> None:
            self._on_return.pop(number, None)

        return End(end)

    def publish(self, subject: str, data: bytes) -> None:
        """As `Bus.publish`."""
        checked(subject)
        if self._link is None:
            return
        if len(data) > self._link.max_payload:
            most = self._link.max_payload
            _log.error("%d bytes to %s: the bus takes %d, see its max_payload", len(data), subject, most)
            return
        self._link.publish(subject, data)

    def subscribe(self, subject: str, handler: Handler) -> Subscription:
        """As `Bus.subscribe`. Order holds for all subjects of one publisher."""
        return self._listen(subject, "", lambda _, data, __: hand(handler, subject, data))

    def answer(self, subject: str, answerer: Answerer) -> Subscription:
        """As `Bus.answer`."""

        async def answer(reply: str, data: bytes, request: str) -> None:
            try:
                with request_id.at_work(request):
                    said = await answered(answerer, subject, data)
                self.publish(reply, said)
            except (AnswerFailed, Unavailable) as error:
                if self._link is not None:
                    self._link.fail(reply, error.what if isinstance(error, Unavailable) else "")

        def asked(reply: str, data: bytes, head: bytes) -> None:
            if reply:
                request = request_id.of_head(head)
                replying = asyncio.create_task(answer(reply, data, request), name=f"answer to {subject}")
                self._replying.add(replying)
                replying.add_done_callback(self._replying.discard)

        # members of a queue group, of whom one gets each question
        return self._listen(subject, "answer", asked)

    async def ask(
        self, subject: str, data: bytes = b"", seconds: float = ANSWERED, headers: Mapping[str, str] | None = None
    ) -> bytes:
        """As `Bus.ask`; `headers` are by default the name of the request that is at work. Raises ValueError for more
        bytes than the server takes in one message."""
        if not sayable(subject):
            raise NobodyAnswers(subject)
        link = self._link
        if link is None:
            raise Unavailable("the bus", "no server answers")
        if len(data) > link.max_payload:
            raise ValueError(f"a question has {len(data)} bytes: the bus takes {link.max_payload}, see its max_payload")
        token = str(next(self._numbers))
        answer: asyncio.Future[bytes] = asyncio.get_running_loop().create_future()
        self._questions[token] = answer
        heard = link.heard
        try:
            if not link.publish(
                subject, data, f"{self._inbox}.{token}", request_id.headers() if headers is None else headers
            ):
                raise Unavailable("the bus", "the server does not keep up")
            async with asyncio.timeout(seconds):
                return await answer
        except TimeoutError:
            # what came while this process stood still is not looked at yet
            await asyncio.sleep(0)
            if link.heard == heard and seconds > BEATS * BEAT:
                # beats in between were not answered either
                link.abort("the server is silent")
                if self._link is link:
                    self._link = None
                raise Unavailable("the bus", "the server is silent") from None
            raise NobodyAnswers(subject) from None
        finally:
            del self._questions[token]

    def hear(self, number: int, subject: str, reply: str, data: bytes, head: bytes, status: bytes) -> None:
        """As `Listener`."""
        if number != _INBOX:
            # one that has ended may still hear what was on the way
            if number in self._subscriptions:
                self._subscriptions[number][1](reply, data, head)
            return
        question = self._questions.get(subject.rpartition(".")[2])
        if question is None or question.done():
            return
        if status == _NOBODY:
            question.set_exception(NobodyAnswers("nobody is there"))
        elif status == _FAILED and data:
            question.set_exception(Unavailable(data.decode(), "so says who was asked"))
        elif status == _FAILED:
            question.set_exception(AnswerFailed("who was asked could not answer"))
        else:
            question.set_result(data)

    def _listen(self, subject: str, group: str, heard: _Heard) -> Subscription:
        number = next(self._numbers)
        command = f"SUB {checked(subject)} {group} {number}\r\n".encode()
        self._subscriptions[number] = command, heard
        self._command(command)

        def end() -> None:
            if self._subscriptions.pop(number, None) is not None:
                self._command(b"UNSUB %d\r\n" % number)

        return End(end)

    def _command(self, command: bytes) -> None:
        # without room for it the connection begins anew, with what holds then
        if self._link is not None and not self._link.say(command):
            self._link.abort("the server does not keep up")

    async def _run(self) -> None:
        """Connect to one server after the other, for ever."""
        told = False
        for server in cycle(random.sample(self._servers, len(self._servers))):
            known = dict(self._subscriptions)
            first = [b"SUB %b.* %d\r\n" % (self._inbox.encode(), _INBOX), *(command for command, _ in known.values())]
            try:
                link = await Link.open(server, self, first)
            except OSError as error:
                if not told:
                    _log.warning("the bus is away: %s", error)
                told, self._missed = True, True
            else:
                told = False
                try:
                    self._begin(link, known.keys())
                    await asyncio.wait((link.ended,))
                    _log.warning("the bus is away: %s", link.ended.result())
                finally:
                    self._end()
                    await link.close()
            await asyncio.sleep(random.uniform(*AGAIN))

    def _begin(self, link: Link, known: Set[int]) -> None:
        """The bus is up, with a connection that has the subscriptions `known`; what changed meanwhile is caught up."""
        self._link = link
        for number in known - self._subscriptions.keys():
            self._command(b"UNSUB %d\r\n" % number)
        for number in self._subscriptions.keys() - known:
            self._command(self._subscriptions[number][0])
        self._came.set()
        if not self._missed:
            return
        self.returns += 1
        _log.warning("the bus is back")
        for handler in tuple(self._on_return.values()):
            try:
                handler()
            except Exception:
                _log.exception("the bus is back, and somebody could not take it")

    def _end(self) -> None:
        """The bus is away."""
        self._link, self._missed = None, True
        for question in self._questions.values():
            if not question.done():
                question.set_exception(Unavailable("the bus", "the connection ended while a question was asked"))
