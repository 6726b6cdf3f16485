"""Sessions that become motions: answers `ingest.keep` on the bus, bounded in number and time, never half stored."""

from __future__ import annotations

import asyncio
import secrets
from typing import Any

import msgpack
from pydantic import ValidationError

from bunraku.codec.container import StoredMotion
from bunraku.http.problem_details import ProblemError, invalid_field_problem
from bunraku.ingest.entry import entry_json
from bunraku.ingest.motion import derive_motion_id
from bunraku.ingest.persistence import check_quota, store_motion
from bunraku.ingest.result import JobRejection, JobResult
from bunraku.ingest.worker_slots import WorkerSlots
from bunraku.messaging.recording_request import MAX_RECORDING_S, RECORDING_FPS, RecordingRequest
from bunraku.runtime.context import ServiceContext
from bunraku.storage.catalogue import CatalogueEntry

RECORDING_SUBJECT = "ingest.keep"
MAX_ACTIVE_RECORDINGS = 8
"""Orders that may be under way; one more is told to come again."""
RECORDING_TIMEOUT_S = 100.0
"""The longest that an order may take, its wait for a place counted: who asks waits for 120 s."""
INHERITED_FIELDS = ("profile", "joints", "rest_pose", "unit", "guessed", "fit")
"""What the catalogue says of a dance's figure, which is the kept motion's too."""


class RecordingOperation:
    """The orders of one replica. `places` bounds the jobs at work, those of uploads among them."""

    def __init__(self, backing: ServiceContext, worker_slots: WorkerSlots) -> None:
        self._backing = backing
        self._worker_slots = worker_slots
        self._active = 0

    async def handle_message(self, message: bytes) -> bytes:
        """The answer to a question on the bus, the name under which an order lies in the library: MessagePack of
        `{"motion": ...}` as `POST /v1/motions` gives it, or of `{"problem": ...}`, the arguments of `ProblemError`."""
        try:
            order = await self._backing.motion_store.get_log(message.decode("ascii", "replace"))
            if order is None:
                raise ProblemError(404, "No such order", f"the library has no order {message[:40]!r}")
            said: dict[str, Any] = {"motion": entry_json(await self.record_session(parse_recording_request(order)))}
        except ProblemError as error:
            said = {"problem": error.to_dict()}
        packed: bytes = msgpack.packb(said)
        return packed

    async def record_session(self, request: RecordingRequest) -> CatalogueEntry:
        """The motion that an order makes of a session's log; raises `ProblemError`."""
        if self._active >= MAX_ACTIVE_RECORDINGS:
            raise ProblemError(
                503, "Busy", f"{MAX_ACTIVE_RECORDINGS} sessions are being kept", hint="try again in a few seconds"
            )
        self._active += 1
        try:
            async with asyncio.timeout(RECORDING_TIMEOUT_S):
                return await self._record_session(request)
        except TimeoutError:
            raise ProblemError(
                503,
                "Busy",
                f"it could not be kept within {RECORDING_TIMEOUT_S:g} s",
                hint="keep a shorter part, or try again",
            ) from None
        finally:
            self._active -= 1

    async def _record_session(self, request: RecordingRequest) -> CatalogueEntry:
        log = await self._backing.motion_store.get_log(request.log)
        if log is None:
            raise ProblemError(404, "No such log", f"the library has no log {request.log[:40]!r}", field="log")
        await check_quota(self._backing, request.subject)
        dances = await self._load_motions(log)
        motion = derive_motion_id(secrets.token_bytes(32))
        async with self._worker_slots:
            made = await self._worker_slots.run_job("keep", (motion, request, log, dances), RECORDING_TIMEOUT_S)
        if isinstance(made, JobRejection):
            raise ProblemError(422, made.title, made.detail, field=made.field, hint=made.hint)
        described = await self._build_description(request, made, len(log))
        entry, _ = await store_motion(self._backing, motion, made, described, request.subject)
        return entry

    async def _load_motions(self, log: bytes) -> dict[str, StoredMotion]:
        """The dances that a log is over, by id; those that were removed are left out."""

        def motions() -> tuple[str, ...]:
            from bunraku.marionette.input_log import InputLog

            return InputLog.unpack(log).motions

        try:
            ids = await asyncio.to_thread(motions)
        except ValueError as error:
            raise ProblemError(422, "Unreadable log", f"the session's log cannot be read: {error}") from None
        found = [await self._backing.motion_store.get(motion) for motion in ids]
        return {dance.id: dance for dance in found if dance is not None}

    async def _build_description(self, request: RecordingRequest, result: JobResult, log_bytes: int) -> dict[str, Any]:
        """What the catalogue says of a kept motion: its figure is the dance's."""
        dance = await self._backing.catalogue.get_motion(result.description["kept_from"])
        known = dance.description if dance is not None else {}
        title = known.get("name") or "A dance"
        return {
            "name": (request.name or "").strip() or f"{title.removesuffix(', kept')}, kept",
            "filename": "",
            "bytes": log_bytes,
            "source": f"kept from a session of {title} ({result.description['kept_from']})",
            **{key: known[key] for key in INHERITED_FIELDS if key in known},
            **result.description,
        }


def parse_recording_request(message: bytes) -> RecordingRequest:
    """The order in a message of the bus; raises `ProblemError` with the field that is wrong."""
    try:
        order = RecordingRequest.model_validate(msgpack.unpackb(message))
    except ValidationError as error:
        first = error.errors()[0]
        raise invalid_field_problem(first["loc"], first["msg"]) from None
    except (ValueError, msgpack.UnpackException) as error:
        raise ProblemError(422, "Invalid request", f"not an order to keep a session: {error}") from None
    if order.frame_count < 1:
        raise ProblemError(422, "Nothing to keep", "the interval has no frame in it", field="seconds")
    if order.frame_count > MAX_RECORDING_S * RECORDING_FPS:
        raise ProblemError(
            422, "Too long", f"at most {MAX_RECORDING_S} seconds are kept", field="seconds", hint="keep a shorter part"
        )
    if any(after[0] <= before[0] for before, after in zip(order.camera, order.camera[1:], strict=False)):
        raise ProblemError(422, "Invalid request", "camera: its keyframes' times do not ascend", field="camera")
    return order
