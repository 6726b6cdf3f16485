"""Installation of the demo, whose motion is part of the package (`demo/build.py`), and of its session.

Several replicas may start at once. One stores the motion while the others wait; the session's id follows from the
motion, so that the key-value store lets only one replica open it.
"""

from __future__ import annotations

import asyncio
import json
import logging
from pathlib import Path
from typing import Any

from bunraku.ingest.persistence import store_motion
from bunraku.ingest.result import JobResult
from bunraku.messaging.key_value import RevisionConflict
from bunraku.messaging.lease import hold_lease
from bunraku.runtime.availability import BackendUnavailable
from bunraku.runtime.context import ServiceContext
from bunraku.runtime.problem import ProblemError
from bunraku.session.session_manager import SessionManager

MOTION_FILE = Path(__file__).parent / "dance.bunraku"
"""Motion with music, camera and lights, as an object of the motion store."""
DESCRIPTION_FILE = Path(__file__).parent / "dance.json"
"""Id and description of the motion."""
DEMO_NOTE_KEY = "demo"
"""Name of the note in the object store about the demo's motion, and prefix of the lease for storing it."""
RETRY_INTERVAL_S = 1.0
"""Interval between attempts while a backend is unavailable."""

_log = logging.getLogger(__name__)


async def open_demo_stage(context: ServiceContext, sessions: SessionManager) -> None:
    """Open the demo's session, on this replica or another; retry until the backends are available."""
    while True:
        try:
            motion = await ensure_demo_motion(context)
            await sessions.open_session(motion, session=f"demo-{motion}")
        except RevisionConflict:
            return
        except BackendUnavailable as error:
            _log.warning("demo stage not ready: %s; retrying", error)
        except ProblemError as error:
            if error.status < 500:
                raise
            _log.warning("demo stage not ready: %s; retrying", error.detail)
        else:
            return
        await asyncio.sleep(RETRY_INTERVAL_S)


async def ensure_demo_motion(context: ServiceContext) -> str:
    """Return the id of the demo's motion, stored unless it is there already. Raises `BackendUnavailable`."""
    values: dict[str, Any] = json.loads(await asyncio.to_thread(DESCRIPTION_FILE.read_bytes))
    motion_id = str(values["id"])
    if not await _is_stored(context, motion_id):
        async with hold_lease(context.key_values, f"{DEMO_NOTE_KEY}.making"):
            # another replica may have stored it meanwhile
            if not await _is_stored(context, motion_id):
                await _store_motion(context, motion_id, values["description"])
    return motion_id


async def _is_stored(context: ServiceContext, motion_id: str) -> bool:
    return (
        await context.catalogue.get_motion(motion_id) is not None
        and await context.motion_store.get(motion_id) is not None
    )


async def _store_motion(context: ServiceContext, motion_id: str, description: dict[str, Any]) -> None:
    """Store the motion, in place of that of another release and of an entry that has lost its object."""
    previous = await _read_note(context)
    for outdated in (motion_id,) if previous is None else (motion_id, previous):
        await context.catalogue.remove_motion(outdated)
        await context.motion_store.remove(outdated)
    packed = await asyncio.to_thread(MOTION_FILE.read_bytes)
    await store_motion(context, motion_id, JobResult(packed, {}), description, "")
    await context.motion_store.put_note(DEMO_NOTE_KEY, json.dumps({"motion": motion_id}).encode())


async def _read_note(context: ServiceContext) -> str | None:
    """Return the id of the motion that was stored last."""
    try:
        return str(json.loads(await context.motion_store.get_note(DEMO_NOTE_KEY) or b"")["motion"])
    except (ValueError, KeyError, TypeError):
        # no note yet, or a foreign one: it is replaced
        return None
