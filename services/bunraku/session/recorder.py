"""Recording of a session: the ingest service makes a motion of the session's log."""

from __future__ import annotations

from typing import Annotated, Any

import msgpack
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat

from bunraku.messaging.bus import NoResponse
from bunraku.messaging.recording_request import MAX_CAMERA_KEYFRAMES, MAX_RECORDING_S
from bunraku.runtime.context import ServiceContext
from bunraku.runtime.problem import ProblemError
from bunraku.session.stage_proxy import StageProxy

INGEST_TIMEOUT_S = 120.0
"""Timeout of the ingest service."""

PointCoordinates = Annotated[list[FiniteFloat], Field(min_length=3, max_length=3, description="x, y, z, metres, y up")]


class Keyframe(BaseModel):
    """Camera at a clock time; it moves linearly between two keyframes."""

    model_config = ConfigDict(extra="forbid")
    time: Annotated[int, Field(ge=0, lt=1 << 53, description="clock time, microseconds")]
    position: PointCoordinates
    gaze: PointCoordinates
    fov: Annotated[FiniteFloat, Field(gt=0.0, lt=3.14, description="vertical field of view, radians")]


class Recording(BaseModel):
    """Part of a session to record."""

    model_config = ConfigDict(extra="forbid")
    name: Annotated[str | None, Field(max_length=200)] = None
    seconds: Annotated[
        FiniteFloat | None,
        Field(gt=0.0, le=MAX_RECORDING_S, description="seconds up to now; the motion's duration by default"),
    ] = None
    camera: Annotated[list[Keyframe], Field(max_length=MAX_CAMERA_KEYFRAMES)] = []


async def record_session(
    stage: StageProxy, recording: Recording, context: ServiceContext, subject: str = ""
) -> dict[str, Any]:
    """Record a session as a motion of `subject` and return it as the API shows it; raises `ProblemError`.

    Log and request travel through the motion store, because either may exceed the largest message of the bus.
    """
    motion_store, log = context.motion_store, await stage.store_log(recording.seconds)
    request = {
        **log,
        "name": recording.name,
        "subject": subject,
        "camera": [[key.time, *key.position, *key.gaze, key.fov] for key in recording.camera],
    }
    name = f"{log['log']}-order"
    try:
        await motion_store.put_log(name, msgpack.packb(request))
        answer = msgpack.unpackb(await context.bus.request("ingest.keep", name.encode(), INGEST_TIMEOUT_S))
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
