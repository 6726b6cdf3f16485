"""Recording of a session: the ingest service makes a motion of the session's log."""

from __future__ import annotations

import asyncio
from typing import Any

import msgpack

from bunraku.messaging.bus import NoResponse
from bunraku.messaging.lease import wait_until_abandoned
from bunraku.messaging.recording_request import RECORDING_KEY_PREFIX, RECORDING_SUBJECT
from bunraku.runtime.context import ServiceContext
from bunraku.runtime.problem import ProblemError
from bunraku.session.recording import PackedRecording
from bunraku.session.stage_proxy import StageProxy

INGEST_TIMEOUT_S = 120.0
"""Timeout of the ingest service; if the replica that records has died, the request ends with its lease."""


async def record_session(
    stage: StageProxy, recording: PackedRecording, context: ServiceContext, subject: str = ""
) -> dict[str, Any]:
    """Record a session as a motion of `subject` and return it as the API shows it; raises `ProblemError`.

    Log and request travel through the motion store, because either may exceed the largest message of the bus.
    """
    motion_store, log = context.motion_store, await stage.store_log(recording.seconds)
    request = {**log, "name": recording.name, "subject": subject, "camera": recording.camera}
    name = f"{log['log']}-order"
    try:
        await motion_store.put_log(name, msgpack.packb(request))
        answer = msgpack.unpackb(await _request_recording(context, name, log["log"]))
    except NoResponse:
        raise ProblemError(
            503, "Cannot keep now", "the ingest service does not respond", hint="try again in a minute"
        ) from None
    finally:
        await motion_store.remove_log(name)
        await motion_store.remove_log(log["log"])
    if "problem" in answer:
        raise ProblemError.from_dict(answer["problem"])
    motion: dict[str, Any] = answer["motion"]
    return motion


async def _request_recording(context: ServiceContext, name: str, log: str) -> bytes:
    """Return the response to the request that is stored as `name`.

    Raises `NoResponse` after `INGEST_TIMEOUT_S`, or when the replica that records the log has died.
    """
    response = asyncio.ensure_future(context.bus.request(RECORDING_SUBJECT, name.encode(), INGEST_TIMEOUT_S))
    abandonment = asyncio.ensure_future(wait_until_abandoned(context.key_values, f"{RECORDING_KEY_PREFIX}.{log}"))
    try:
        done, _ = await asyncio.wait((response, abandonment), return_when=asyncio.FIRST_COMPLETED)
        if response in done:
            return response.result()
        abandonment.result()
        raise NoResponse(RECORDING_SUBJECT)
    finally:
        for task in (response, abandonment):
            task.cancel()
        await asyncio.gather(response, abandonment, return_exceptions=True)
