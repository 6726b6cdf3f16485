"""Puppeteer of the Python SDK: claims limbs of a session and moves them."""

from __future__ import annotations

import asyncio
import contextlib
import math
import time
from collections.abc import Callable
from typing import Any, Self
from urllib.parse import quote

from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed

from bunraku.client.api import Client
from bunraku.client.authorization import authorization
from bunraku.client.one_euro import OneEuro
from bunraku.wire.limbs import limb_number
from bunraku.wire.messages import (
    MAX_SERVER_MESSAGE_BYTES,
    SUBPROTOCOL,
    Alive,
    Ask,
    Bond,
    BondEnd,
    Claim,
    Grant,
    Input,
    Notice,
    Presence,
    Problem,
    PropRefusal,
    Put,
    Refusal,
    Release,
    Welcome,
    unpack,
)

ALIVE_INTERVAL_S = 0.1
"""Interval of keep-alive messages while limbs are held."""
ASK_TIMEOUT_S = 20.0
"""Default time to wait for a limb that was asked for."""
ANSWER_TIMEOUT_S = 5.0
"""Time to wait for an answer of the server."""


class ControlRefused(Exception):
    """Limb held by another puppeteer, or closed session; the message has the reason."""


class Puppeteer:
    """Puppeteer of a session. Use as an async context manager.

    Limbs are named as in `wire.limbs.LIMBS`, or numbered: limb l of performer k is 4 k + l. While limbs are held, a
    keep-alive message is sent 10 times per second. A limb that was lost because this process was suspended is claimed
    again, its last target is sent again, and then the bonds that ended with it are requested again.
    """

    def __init__(self, client: Client, session: str, name: str = "Someone") -> None:
        self._url = client.socket_url(f"/v1/sessions/{quote(session, safe='')}/control") + f"?name={quote(name)}"
        self._headers = authorization(client.token)
        self.id: str | None = None
        self.presence: Presence | None = None
        self.notice: Notice | None = None
        """Last notice about an input that was changed or refused."""
        self.bond_end: BondEnd | None = None
        """Last refusal or end of a bond, with the reason."""
        self._epochs: dict[int, int] = {}
        self._last_inputs: dict[int, tuple[int, tuple[float, float, float]]] = {}
        """Last input of each held limb: kind and values."""
        self._lost_limbs: set[int] = set()
        """Lost limbs with a pending claim."""
        self._prop_refusals: dict[int, str] = {}
        """Reason of the last refusal to move each prop, by number."""
        self._requested_bonds: set[tuple[int, int]] = set()
        """Bonds at the request of this puppeteer, until they end otherwise than by a loss of its limbs."""
        self._lost_bonds: set[tuple[int, int]] = set()
        self._sequence = 0
        self._answers: asyncio.Queue[Grant | Refusal] = asyncio.Queue(64)
        self._presence_changed = asyncio.Condition()
        self._welcome = asyncio.Event()
        self._connection: ClientConnection | None = None
        self._tasks: list[asyncio.Task[None]] = []
        self._close_reason = "the session is not open"

    async def __aenter__(self) -> Self:
        self._connection = await connect(
            self._url,
            subprotocols=[SUBPROTOCOL],  # type: ignore[list-item]
            additional_headers=self._headers,
            compression=None,
            max_size=MAX_SERVER_MESSAGE_BYTES,
            open_timeout=ANSWER_TIMEOUT_S,
            close_timeout=1,
        )
        self._tasks = [asyncio.create_task(self._receive()), asyncio.create_task(self._send_alive())]
        try:
            async with asyncio.timeout(ANSWER_TIMEOUT_S):
                await self._welcome.wait()
        except TimeoutError:
            await self.__aexit__()
            raise ControlRefused(self._close_reason) from None
        if self.id is None:
            await self.__aexit__()
            raise ControlRefused(self._close_reason)
        return self

    async def __aexit__(self, *_: object) -> None:
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        if self._connection is not None:
            await self._connection.close()

    async def claim(self, limb: str | int) -> None:
        """Claim a limb; raise `ControlRefused` if another puppeteer holds it."""
        number = limb_number(limb)
        self._last_inputs.pop(number, None)
        await self._send(Claim(number).pack())
        try:
            async with asyncio.timeout(ANSWER_TIMEOUT_S):
                while (answer := await self._answers.get()).limb != number:
                    continue
        except TimeoutError:
            raise ControlRefused(f"no answer for {limb}: {self._close_reason}") from None
        if isinstance(answer, Refusal):
            raise ControlRefused(
                f"{limb} is {answer.reason} by {answer.holder}" if answer.holder else f"{limb}: {answer.reason}"
            )

    async def ask(self, limb: str | int, seconds: float = ASK_TIMEOUT_S) -> None:
        """Ask the holder of a limb for it and wait; raise `ControlRefused` if it is not granted within `seconds`.

        A free limb is claimed at once.
        """
        number = limb_number(limb)
        try:
            await self.claim(limb)
        except ControlRefused:
            await self._send(Ask(number, True).pack())
        else:
            return
        try:
            async with asyncio.timeout(seconds):
                while not isinstance(answer := await self._answers.get(), Grant) or answer.limb != number:
                    continue
        except TimeoutError:
            await self._send(Ask(number, False).pack())
            raise ControlRefused(f"{limb} was asked for and not given") from None

    async def release(self, limb: str | int) -> None:
        """Release a limb."""
        number = limb_number(limb)
        self._forget_bonds_of(number)
        if number in self._epochs:
            await self._send(Release(number, self._epochs.pop(number)).pack())

    @property
    def bonds(self) -> tuple[tuple[int, int], ...]:
        """Bonded hands by their limb numbers, the lower one first."""
        pairs = self.presence.bonds if self.presence is not None else None
        return tuple(_ordered(*pair) for pair in pairs or ())

    async def bond(self, limb: str | int, other: str | int) -> None:
        """Bond two hands, so that their tips stay together; raise `ControlRefused` if the session refuses.

        One must be held; the other is held as well, or free: then it is led. Both return from the bond by `unbond`, by
        a release, or when the performers move too far apart: `bond_end` has the reason.
        """
        first, second = pair = _ordered(limb, other)
        self.bond_end = None
        await self._send(Bond([first, second], True).pack())
        await self._wait_until(lambda: pair in self.bonds or self._bond_end_reason(pair) is not None)
        if (reason := self._bond_end_reason(pair)) is not None:
            raise ControlRefused(f"{limb} and {other} are not bonded: {reason}")
        self._requested_bonds.add(pair)

    async def unbond(self, limb: str | int, other: str | int) -> None:
        """End the bond of two hands; those that are held stay so."""
        pair = _ordered(limb, other)
        self._requested_bonds.discard(pair)
        self._lost_bonds.discard(pair)
        if pair in self.bonds:
            await self._send(Bond(list(pair), False).pack())
            await self._wait_until(lambda: pair not in self.bonds)

    async def _wait_until(self, is_settled: Callable[[], bool]) -> None:
        """Wait for a message after which a request is settled; raise `ControlRefused` if none comes."""
        try:
            async with asyncio.timeout(ANSWER_TIMEOUT_S), self._presence_changed:
                await self._presence_changed.wait_for(is_settled)
        except TimeoutError:
            raise ControlRefused(f"no answer: {self._close_reason}") from None

    async def put(self, prop: int, limb: str | int) -> None:
        """Put a prop of the session (`presence.props`) into a hand; raise `ControlRefused` if the session refuses.

        The prop must be free or in a held hand. The hand must be held or free, or any to pass on what is in a held one.
        """
        number = limb_number(limb)
        await self._put(Put(prop, limb=number), lambda entry: entry["limb"] == number)

    async def lay_down(self, prop: int, x: float, z: float, turn: float = 0.0) -> None:
        """Lay a prop on the floor; raise `ControlRefused` if the session refuses.

        `x` and `z` in metres, `turn` in radians about y from z towards x; stage frame.
        """
        place = [x, z, math.remainder(turn, math.tau)]
        await self._put(
            Put(prop, place=place),
            lambda entry: entry["limb"] is None and all(map(math.isclose, entry["place"], place)),
        )

    async def _put(self, request: Put, is_there: Callable[[dict[str, Any]], bool]) -> None:
        def has_arrived() -> bool:
            props = (self.presence.props if self.presence is not None else None) or []
            return any(entry["prop"] == request.prop and is_there(entry) for entry in props)

        self._prop_refusals.pop(request.prop, None)
        await self._send(request.pack())
        await self._wait_until(lambda: request.prop in self._prop_refusals or has_arrived())
        if (reason := self._prop_refusals.get(request.prop)) is not None:
            raise ControlRefused(f"prop {request.prop} stays where it is: {reason}")

    def _bond_end_reason(self, pair: tuple[int, int]) -> str | None:
        end = self.bond_end
        return end.reason if end is not None and _ordered(*end.limbs) == pair else None

    async def target(
        self, limb: str | int, x: float, y: float = 0.0, z: float = 0.0, *, smooth: OneEuro | None = None
    ) -> None:
        """Move the tip of a held hand to a position in the shoulder's frame, arm lengths; for a leg, set the thigh
        angle `x`.

        `smooth`, one filter per limb that is kept between calls, smooths a noisy source.
        """
        if smooth is not None:
            x, y, z = smooth.filter((x, y, z), time.monotonic())
        await self._set_input(limb, Input.TARGET, (x, y, z))

    async def velocity(self, limb: str | int, x: float, y: float = 0.0, z: float = 0.0) -> None:
        """Move a held limb at -1..1 of full speed along each axis until further notice."""
        await self._set_input(limb, Input.VELOCITY, (x, y, z))

    async def _set_input(self, limb: str | int, kind: int, values: tuple[float, float, float]) -> None:
        number = limb_number(limb)
        if number not in self._epochs:
            raise ControlRefused(f"{limb} is not held: claim it first")
        self._last_inputs[number] = kind, values
        await self._send_input(number)

    async def _send_input(self, number: int) -> None:
        kind, values = self._last_inputs[number]
        self._sequence += 1
        sampled = time.time_ns() // 1000
        await self._send(Input(number, kind, self._epochs[number], self._sequence, sampled, values).pack())

    async def _send(self, data: bytes) -> None:
        if self._connection is None:
            raise ControlRefused(self._close_reason)
        try:
            await self._connection.send(data)
        except ConnectionClosed:
            raise ControlRefused(self._close_reason) from None

    async def _receive(self) -> None:
        assert self._connection is not None
        with contextlib.suppress(ConnectionClosed, ControlRefused):
            async for data in self._connection:
                message = unpack(data) if isinstance(data, bytes) else None
                if isinstance(message, Welcome):
                    self.id = message.id
                    self._welcome.set()
                elif isinstance(message, Grant):
                    await self._on_grant(message)
                elif isinstance(message, Refusal):
                    await self._on_refusal(message)
                elif isinstance(message, Notice):
                    self.notice = message
                elif isinstance(message, Presence | BondEnd | PropRefusal):
                    await self._on_change(message)
                elif isinstance(message, Problem):
                    self._close_reason = f"{message.title}: {message.detail}"
        self._welcome.set()

    async def _on_change(self, message: Presence | BondEnd | PropRefusal) -> None:
        async with self._presence_changed:
            if isinstance(message, Presence):
                self.presence = message
            elif isinstance(message, PropRefusal):
                self._prop_refusals[message.prop] = message.reason
            else:
                self.bond_end = message
                self._on_bond_end(_ordered(*message.limbs), message.reason)
            self._presence_changed.notify_all()

    def _on_bond_end(self, pair: tuple[int, int], reason: str) -> None:
        """Keep a bond that was lost with a limb of this puppeteer, which is claimed again; forget all others."""
        if pair in self._requested_bonds and reason == "lost" and self._lost_limbs.intersection(pair):
            self._lost_bonds.add(pair)
        else:
            self._lost_bonds.discard(pair)
        self._requested_bonds.discard(pair)

    def _forget_bonds_of(self, limb: int) -> None:
        for bonds in (self._requested_bonds, self._lost_bonds):
            bonds.difference_update([pair for pair in bonds if limb in pair])

    async def _renew_bonds_of(self, limb: int) -> None:
        """Request the lost bonds of a limb that is granted again, unless the other hand still waits for its grant."""
        for pair in [pair for pair in self._lost_bonds if limb in pair]:
            if not self._lost_limbs.intersection(pair):
                self._lost_bonds.discard(pair)
                self._requested_bonds.add(pair)
                await self._send(Bond(list(pair), True).pack())

    async def _on_grant(self, grant: Grant) -> None:
        limb, reclaimed = grant.limb, grant.limb in self._lost_limbs
        self._lost_limbs.discard(limb)
        if reclaimed and limb not in self._epochs:
            # released before the answer arrived
            await self._send(Release(limb, grant.epoch).pack())
            return
        self._epochs[limb] = grant.epoch
        if not reclaimed:
            self._answers.put_nowait(grant)
            return
        if limb in self._last_inputs:
            await self._send_input(limb)
        await self._renew_bonds_of(limb)

    async def _on_refusal(self, refusal: Refusal) -> None:
        limb = refusal.limb
        if refusal.reason == "lost":
            if limb in self._epochs:
                self._lost_limbs.add(limb)
                await self._send(Claim(limb).pack())
            return
        self._epochs.pop(limb, None)
        self._forget_bonds_of(limb)
        if limb in self._lost_limbs:
            self._lost_limbs.discard(limb)
        else:
            self._answers.put_nowait(refusal)

    async def _send_alive(self) -> None:
        while True:
            await asyncio.sleep(ALIVE_INTERVAL_S)
            if self._epochs:
                with contextlib.suppress(ControlRefused):
                    await self._send(Alive(list(self._epochs)).pack())


def _ordered(limb: str | int, other: str | int) -> tuple[int, int]:
    first, second = limb_number(limb), limb_number(other)
    return (first, second) if first < second else (second, first)
