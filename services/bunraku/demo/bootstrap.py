"""The demo: our own dance with its music, camera and lights, taken in like any upload the first time, and its stage.

Several replicas may start at once. One of them makes the dance while the others wait; the stage has a name that follows
from the dance, so that the register lets one of them open it.
"""

from __future__ import annotations

import asyncio
import hashlib
import json
import logging
import tempfile
from pathlib import Path

from bunraku.http.problem_details import ProblemError
from bunraku.ingest.audio import AudioOperation
from bunraku.ingest.keyframe import Staging
from bunraku.ingest.motion import UploadOperation, derive_motion_id
from bunraku.ingest.scene import SceneOperation
from bunraku.messaging.key_value import RevisionConflict
from bunraku.messaging.lease import hold_lease
from bunraku.runtime.availability import BackendUnavailable
from bunraku.runtime.context import ServiceContext
from bunraku.session.session_manager import SessionManager

DEMO_NOTE_KEY = "demo"
"""The library's note of what was made, and the register's word for who makes it."""
RETRY_INTERVAL_S = 1.0
"""Seconds after which what is away is asked again."""

_PACKAGE_DIR = Path(__file__).parents[1]
_log = logging.getLogger(__name__)


async def open_demo_stage(context: ServiceContext, sessions: SessionManager) -> None:
    """The demo's stage, there once this returns, by this replica or another; tried until what it takes is there."""
    while True:
        try:
            motion = await ensure_demo_motion(context)
            await sessions.open_session(motion, session=f"demo-{motion}")
        except RevisionConflict:
            return
        except BackendUnavailable as error:
            _log.warning("the demo's stage: %s; trying again", error)
        except ProblemError as error:
            if error.status < 500:
                raise
            _log.warning("the demo's stage: %s; trying again", error.detail)
        else:
            return
        await asyncio.sleep(RETRY_INTERVAL_S)


async def ensure_demo_motion(context: ServiceContext) -> str:
    """The id of the dance in the library.

    It is danced, played and taken in anew only when the code that makes it has changed since, or it was removed: this
    takes some seconds, which the next start should not. Raises `Unavailable`.
    """
    made_by = await asyncio.to_thread(_code_fingerprint)
    if (noted := await _find_current_motion(context, made_by)) is not None:
        return noted
    async with hold_lease(context.key_values, f"{DEMO_NOTE_KEY}.making"):
        # another replica may have made it meanwhile
        return await _find_current_motion(context, made_by) or await _create_motion(context, made_by)


async def _find_current_motion(context: ServiceContext, fingerprint: str) -> str | None:
    """The id of the dance that this code has made already, if it is there."""
    noted, maker = await _read_note(context)
    return (
        noted
        if noted is not None and maker == fingerprint and await context.motion_store.get(noted) is not None
        else None
    )


async def _read_note(context: ServiceContext) -> tuple[str | None, str]:
    """The dance that was made last, and of which code."""
    try:
        note = json.loads(await context.motion_store.get_note(DEMO_NOTE_KEY) or b"")
        return str(note["motion"]), str(note["made_by"])
    except (ValueError, KeyError, TypeError):
        # the first time, or not ours: it is written anew
        return None, ""


async def _create_motion(context: ServiceContext, fingerprint: str) -> str:
    before, _ = await _read_note(context)
    with tempfile.TemporaryDirectory(prefix="bunraku-demo-") as folder:
        source = Path(folder) / "source"
        song = Path(folder) / "song"
        (motion, title), digest = await asyncio.gather(
            asyncio.to_thread(_write_motion, source), asyncio.to_thread(_write_music, song)
        )
        if before is not None:
            # made by other code: its blocks are not what this code would send
            await context.catalogue.remove_motion(before)
            await context.motion_store.remove(before)
        uploads = UploadOperation(context)
        await uploads.ingest_file(motion, source, f"{title}.bvh")
        sung, _ = await AudioOperation(context, uploads).add_audio(motion, digest, song, f"{title}.wav")
        staged, _ = await SceneOperation(context, uploads).add_scene(sung.id, await asyncio.to_thread(_build_staging))
        for on_the_way in (motion, sung.id):
            await context.catalogue.remove_motion(on_the_way)
            await context.motion_store.remove(on_the_way)
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


def _build_staging() -> Staging:
    from bunraku.demo.choreography import SCORE
    from bunraku.demo.staging import camera_keyframes, light_keyframes

    return Staging.model_validate({"camera": camera_keyframes(SCORE), "lights": light_keyframes(SCORE)})


def _code_fingerprint() -> str:
    """Of all code on the dance's way into the library."""
    digest = hashlib.sha256()
    for package in ("motion", "demo", "codec", "ingest"):
        for source in sorted([*(_PACKAGE_DIR / package).rglob("*.py"), *(_PACKAGE_DIR / package).glob("*.json")]):
            digest.update(source.read_bytes())
    return digest.hexdigest()
