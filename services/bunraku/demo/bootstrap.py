"""Installation of the demo: original motion, music, camera and lights, ingested like an upload, and its session.

Several replicas may start at once. One creates the motion while the others wait; the session's id follows from the
motion, so that the key-value store lets only one replica open it.
"""

from __future__ import annotations

import asyncio
import hashlib
import json
import logging
from pathlib import Path

from bunraku.ingest.audio import AudioOperation
from bunraku.ingest.motion import MotionOperation
from bunraku.ingest.motion_id import derive_motion_id
from bunraku.ingest.scene import SceneOperation
from bunraku.ingest.source_file import SourceFile
from bunraku.ingest.worker_slots import WorkerSlots
from bunraku.messaging.key_value import RevisionConflict
from bunraku.messaging.lease import hold_lease
from bunraku.runtime.availability import BackendUnavailable
from bunraku.runtime.context import ServiceContext
from bunraku.runtime.problem import ProblemError
from bunraku.runtime.temporary_folder import temporary_folder
from bunraku.session.session_manager import SessionManager

DEMO_NOTE_KEY = "demo"
"""Name of the note in the object store about the demo motion, and prefix of the lease for creating it."""
RETRY_INTERVAL_S = 1.0
"""Interval between attempts while a backend is unavailable."""

_PACKAGE_DIR = Path(__file__).parents[1]
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
    """Return the id of the demo motion in the store.

    The motion is created only if the code that creates it has changed, or if it was removed: this takes some seconds,
    which the next start should not. Raises `BackendUnavailable`.
    """
    made_by = await asyncio.to_thread(_code_fingerprint)
    if (existing := await _find_current_motion(context, made_by)) is not None:
        return existing
    async with hold_lease(context.key_values, f"{DEMO_NOTE_KEY}.making"):
        # another replica may have created it meanwhile
        return await _find_current_motion(context, made_by) or await _create_motion(context, made_by)


async def _find_current_motion(context: ServiceContext, fingerprint: str) -> str | None:
    """Return the id of the motion that this code has created before, if it still exists."""
    motion_id, maker = await _read_note(context)
    return (
        motion_id
        if motion_id is not None and maker == fingerprint and await context.motion_store.get(motion_id) is not None
        else None
    )


async def _read_note(context: ServiceContext) -> tuple[str | None, str]:
    """Return the id of the motion created last, and the fingerprint of its code."""
    try:
        note = json.loads(await context.motion_store.get_note(DEMO_NOTE_KEY) or b"")
        return str(note["motion"]), str(note["made_by"])
    except (ValueError, KeyError, TypeError):
        # no note yet, or a foreign one: it is replaced
        return None, ""


async def _create_motion(context: ServiceContext, fingerprint: str) -> str:
    previous, _ = await _read_note(context)
    with temporary_folder("demo") as folder:
        source = folder / "source"
        song = folder / "song"
        (motion, title), digest = await asyncio.gather(
            asyncio.to_thread(_write_motion, source), asyncio.to_thread(_write_music, song)
        )
        if previous is not None:
            # made by other code: its blocks differ from those that this code would send
            await context.catalogue.remove_motion(previous)
            await context.motion_store.remove(previous)
        slots = WorkerSlots()
        await MotionOperation(context, slots).ingest_file(motion, SourceFile(source, f"{title}.bvh"))
        with_music, _ = await AudioOperation(context, slots).add_audio(motion, SourceFile(song, f"{title}.wav"), digest)
        staging = Path(folder) / "staging"
        await asyncio.to_thread(_write_staging, staging)
        staged, _ = await SceneOperation(context, slots).add_scene(with_music.id, staging)
        for intermediate in (motion, with_music.id):
            await context.catalogue.remove_motion(intermediate)
            await context.motion_store.remove(intermediate)
    await context.motion_store.put_note(
        DEMO_NOTE_KEY, json.dumps({"motion": staged.id, "made_by": fingerprint}).encode()
    )
    return staged.id


def _write_motion(path: Path) -> tuple[str, str]:
    from bunraku.demo import choreography
    from bunraku.motion.bvh_writer import write_bvh

    data = write_bvh(choreography.animate_dance())
    path.write_bytes(data)
    return derive_motion_id(hashlib.sha256(data).digest()), choreography.TITLE


def _write_music(path: Path) -> bytes:
    from bunraku.demo.music import render_music
    from bunraku.demo.wav import write_wav

    data = write_wav(render_music())
    path.write_bytes(data)
    return hashlib.sha256(data).digest()


def _write_staging(path: Path) -> None:
    from bunraku.demo.choreography import SCORE
    from bunraku.demo.staging import camera_keyframes, light_keyframes

    path.write_text(json.dumps({"camera": camera_keyframes(SCORE), "lights": light_keyframes(SCORE)}))


def _code_fingerprint() -> str:
    """Return a digest of all code that contributes to the stored motion."""
    digest = hashlib.sha256()
    for package in ("motion", "demo", "codec", "ingest"):
        for source in sorted([*(_PACKAGE_DIR / package).rglob("*.py"), *(_PACKAGE_DIR / package).glob("*.json")]):
            digest.update(source.read_bytes())
    return digest.hexdigest()
