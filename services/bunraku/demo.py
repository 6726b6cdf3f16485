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

from bunraku.backing.backing import Backing
from bunraku.backing.lease import alone
from bunraku.backing.problems import ProblemError
from bunraku.backing.register import Conflict
from bunraku.backing.unavailable import Unavailable
from bunraku.ingest.keyframes import Staging
from bunraku.ingest.soundtracks import Soundtracks
from bunraku.ingest.stagings import Stagings
from bunraku.ingest.uploads import Uploads, motion_id
from bunraku.session.sessions import Sessions

NOTE = "demo"
"""The library's note of what was made, and the register's word for who makes it."""
AGAIN = 1.0
"""Seconds after which what is away is asked again."""

_HERE = Path(__file__).parent
_log = logging.getLogger(__name__)


async def open_stage(backing: Backing, sessions: Sessions) -> None:
    """The demo's stage, there once this returns, by this replica or another; tried until what it takes is there."""
    while True:
        try:
            motion = await add_demo(backing)
            await sessions.open(motion, session=f"demo-{motion}")
        except Conflict:
            return
        except Unavailable as error:
            _log.warning("the demo's stage: %s; trying again", error)
        except ProblemError as error:
            if error.status < 500:
                raise
            _log.warning("the demo's stage: %s; trying again", error.detail)
        else:
            return
        await asyncio.sleep(AGAIN)


async def add_demo(backing: Backing) -> str:
    """The id of the dance in the library.

    It is danced, played and taken in anew only when the code that makes it has changed since, or it was removed: this
    takes some seconds, which the next start should not. Raises `Unavailable`.
    """
    made_by = await asyncio.to_thread(_fingerprint)
    if (noted := await _noted(backing, made_by)) is not None:
        return noted
    async with alone(backing.register, f"{NOTE}.making"):
        # another replica may have made it meanwhile
        return await _noted(backing, made_by) or await _make(backing, made_by)


async def _noted(backing: Backing, made_by: str) -> str | None:
    """The id of the dance that this code has made already, if it is there."""
    noted, maker = await _read_note(backing)
    return noted if noted is not None and maker == made_by and await backing.library.get(noted) is not None else None


async def _read_note(backing: Backing) -> tuple[str | None, str]:
    """The dance that was made last, and of which code."""
    try:
        note = json.loads(await backing.library.get_note(NOTE) or b"")
        return str(note["motion"]), str(note["made_by"])
    except (ValueError, KeyError, TypeError):
        # the first time, or not ours: it is written anew
        return None, ""


async def _make(backing: Backing, made_by: str) -> str:
    before, _ = await _read_note(backing)
    with tempfile.TemporaryDirectory(prefix="bunraku-demo-") as folder:
        source = Path(folder) / "source"
        song = Path(folder) / "song"
        (motion, title), digest = await asyncio.gather(
            asyncio.to_thread(_dance, source), asyncio.to_thread(_play, song)
        )
        if before is not None:
            # made by other code: its blocks are not what this code would send
            await backing.catalogue.remove(before)
            await backing.library.remove(before)
        uploads = Uploads(backing)
        await uploads.add(motion, source, f"{title}.bvh")
        sung, _ = await Soundtracks(backing, uploads).add(motion, digest, song, f"{title}.wav")
        staged, _ = await Stagings(backing, uploads).add(sung.id, await asyncio.to_thread(_stage))
        for on_the_way in (motion, sung.id):
            await backing.catalogue.remove(on_the_way)
            await backing.library.remove(on_the_way)
    await backing.library.put_note(NOTE, json.dumps({"motion": staged.id, "made_by": made_by}).encode())
    return staged.id


def _dance(source: Path) -> tuple[str, str]:
    from bunraku.motion import choreography
    from bunraku.motion.writers import write_bvh

    data = write_bvh(choreography.dance())
    source.write_bytes(data)
    return motion_id(hashlib.sha256(data).digest()), choreography.TITLE


def _play(song: Path) -> bytes:
    from bunraku.music.sanbaso import music
    from bunraku.music.wav import write_wav

    data = write_wav(music())
    song.write_bytes(data)
    return hashlib.sha256(data).digest()


def _stage() -> Staging:
    from bunraku.motion.choreography import SCORE
    from bunraku.show.staging import camera, lights

    return Staging.model_validate({"camera": camera(SCORE), "lights": lights(SCORE)})


def _fingerprint() -> str:
    """Of all code on the dance's way into the library."""
    digest = hashlib.sha256()
    for room in ("motion", "music", "show", "codec", "ingest"):
        for source in sorted([*(_HERE / room).glob("*.py"), *(_HERE / room).glob("*.json")]):
            digest.update(source.read_bytes())
    return digest.hexdigest()
