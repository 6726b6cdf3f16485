"""Keeping what a stage showed: the session's log goes to the ingest service, which makes a motion of it."""

from __future__ import annotations

import secrets
from typing import Annotated, Any

import msgpack
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat

from bunraku.backing.backing import Backing, clock
from bunraku.backing.bus import NobodyAnswers
from bunraku.backing.order import MOST_KEYFRAMES, MOST_SECONDS
from bunraku.backing.problems import ProblemError
from bunraku.session.stage import Stage

ANSWER = 120.0
"""Seconds to wait for the ingest service."""

Place = Annotated[list[FiniteFloat], Field(min_length=3, max_length=3, description="x, y, z, metres, y up")]


class Keyframe(BaseModel):
    """Where the camera was at a clock time; between two of them it moves evenly."""

    model_config = ConfigDict(extra="forbid")
    time: Annotated[int, Field(ge=0, lt=1 << 53, description="clock time, microseconds")]
    position: Place
    gaze: Place
    fov: Annotated[FiniteFloat, Field(gt=0.0, lt=3.14, description="vertical field of view, radians")]


class Recording(BaseModel):
    """What is to be kept of a session."""

    model_config = ConfigDict(extra="forbid")
    name: Annotated[str | None, Field(max_length=200)] = None
    seconds: Annotated[
        FiniteFloat | None,
        Field(gt=0.0, le=MOST_SECONDS, description="how much of what was shown last; the dance's length, if not said"),
    ] = None
    camera: Annotated[list[Keyframe], Field(max_length=MOST_KEYFRAMES)] = []


async def keep(stage: Stage, asked: Recording, backing: Backing) -> dict[str, Any]:
    """The new motion as the API shows it; raises `ProblemError`."""
    end = clock()
    seconds = asked.seconds or min(stage.timeline.duration * 1e-6, MOST_SECONDS)
    begin = max(end - round(seconds * 1e6), stage.created)
    name = f"{stage.id[:12]}-{secrets.token_hex(12)}"
    await backing.library.put_log(name, stage.log.pack())
    order = {
        "log": name,
        "name": asked.name,
        "begin": begin,
        "end": end,
        "camera": [[key.time, *key.position, *key.gaze, key.fov] for key in asked.camera],
    }
    try:
        answer = msgpack.unpackb(await backing.bus.ask("ingest.keep", msgpack.packb(order), ANSWER))
    except NobodyAnswers:
        raise ProblemError(
            503, "Cannot keep now", "the service that makes motions does not answer", hint="try again in a while"
        ) from None
    finally:
        await backing.library.remove_log(name)
    if "problem" in answer:
        raise ProblemError.of(answer["problem"])
    motion: dict[str, Any] = answer["motion"]
    return motion
