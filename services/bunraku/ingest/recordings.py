"""Sessions that become motions: answers `ingest.keep` on the bus, bounded in number and time, never half stored."""

from __future__ import annotations

import asyncio
import secrets
from typing import Any

import msgpack
from pydantic import ValidationError

from bunraku.backing.backing import Backing
from bunraku.backing.catalogue import Entry
from bunraku.backing.library import StoredMotion
from bunraku.backing.order import FPS, MOST_SECONDS, Order
from bunraku.backing.problems import ProblemError, invalid_field
from bunraku.ingest.entry import entry_json
from bunraku.ingest.places import Places
from bunraku.ingest.results import Made, Refused
from bunraku.ingest.storing import check_room, store
from bunraku.ingest.uploads import motion_id

SUBJECT = "ingest.keep"
WAITING = 8
"""Orders that may be under way; one more is told to come again."""
SECONDS = 100.0
"""The longest that an order may take, its wait for a place counted: who asks waits for 120 s."""
INHERITED = ("profile", "joints", "rest_pose", "unit", "guessed", "fit")
"""What the catalogue says of a dance's figure, which is the kept motion's too."""


class Recordings:
    """The orders of one replica. `places` bounds the jobs at work, those of uploads among them."""

    def __init__(self, backing: Backing, places: Places) -> None:
        self._backing = backing
        self._places = places
        self._under_way = 0

    async def answer(self, message: bytes) -> bytes:
        """The answer to a question on the bus, the name under which an order lies in the library: MessagePack of
        `{"motion": ...}` as `POST /v1/motions` gives it, or of `{"problem": ...}`, the arguments of `ProblemError`."""
        try:
            order = await self._backing.library.get_log(message.decode("ascii", "replace"))
            if order is None:
                raise ProblemError(404, "No such order", f"the library has no order {message[:40]!r}")
            said: dict[str, Any] = {"motion": entry_json(await self.keep(read_order(order)))}
        except ProblemError as error:
            said = {"problem": error.values()}
        packed: bytes = msgpack.packb(said)
        return packed

    async def keep(self, order: Order) -> Entry:
        """The motion that an order makes of a session's log; raises `ProblemError`."""
        if self._under_way >= WAITING:
            raise ProblemError(503, "Busy", f"{WAITING} sessions are being kept", hint="try again in a few seconds")
        self._under_way += 1
        try:
            async with asyncio.timeout(SECONDS):
                return await self._keep(order)
        except TimeoutError:
            raise ProblemError(
                503, "Busy", f"it could not be kept within {SECONDS:g} s", hint="keep a shorter part, or try again"
            ) from None
        finally:
            self._under_way -= 1

    async def _keep(self, order: Order) -> Entry:
        log = await self._backing.library.get_log(order.log)
        if log is None:
            raise ProblemError(404, "No such log", f"the library has no log {order.log[:40]!r}", field="log")
        await check_room(self._backing, order.subject)
        dances = await self._dances(log)
        motion = motion_id(secrets.token_bytes(32))
        async with self._places:
            made = await self._places.run("keep", (motion, order, log, dances), SECONDS)
        if isinstance(made, Refused):
            raise ProblemError(422, made.title, made.detail, field=made.field, hint=made.hint)
        described = await self._described(order, made, len(log))
        entry, _ = await store(self._backing, motion, made, described, order.subject)
        return entry

    async def _dances(self, log: bytes) -> dict[str, StoredMotion]:
        """The dances that a log is over, by id; those that were removed are left out."""

        def motions() -> tuple[str, ...]:
            from bunraku.marionette.log import Log

            return Log.unpack(log).motions

        try:
            ids = await asyncio.to_thread(motions)
        except ValueError as error:
            raise ProblemError(422, "Unreadable log", f"the session's log cannot be read: {error}") from None
        found = [await self._backing.library.get(motion) for motion in ids]
        return {dance.id: dance for dance in found if dance is not None}

    async def _described(self, order: Order, made: Made, size: int) -> dict[str, Any]:
        """What the catalogue says of a kept motion: its figure is the dance's."""
        dance = await self._backing.catalogue.get(made.described["kept_from"])
        known = dance.description if dance is not None else {}
        title = known.get("name") or "A dance"
        return {
            "name": (order.name or "").strip() or f"{title.removesuffix(', kept')}, kept",
            "filename": "",
            "bytes": size,
            "source": f"kept from a session of {title} ({made.described['kept_from']})",
            **{key: known[key] for key in INHERITED if key in known},
            **made.described,
        }


def read_order(message: bytes) -> Order:
    """The order in a message of the bus; raises `ProblemError` with the field that is wrong."""
    try:
        order = Order.model_validate(msgpack.unpackb(message))
    except ValidationError as error:
        first = error.errors()[0]
        raise invalid_field(first["loc"], first["msg"]) from None
    except (ValueError, msgpack.UnpackException) as error:
        raise ProblemError(422, "Invalid request", f"not an order to keep a session: {error}") from None
    if order.frames < 1:
        raise ProblemError(422, "Nothing to keep", "the interval has no frame in it", field="seconds")
    if order.frames > MOST_SECONDS * FPS:
        raise ProblemError(
            422, "Too long", f"at most {MOST_SECONDS} seconds are kept", field="seconds", hint="keep a shorter part"
        )
    if any(after[0] <= before[0] for before, after in zip(order.camera, order.camera[1:], strict=False)):
        raise ProblemError(422, "Invalid request", "camera: its keyframes' times do not ascend", field="camera")
    return order
