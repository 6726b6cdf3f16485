"""Small pictures of motions: all performers in the middle of the motion, in SVG.

A picture is drawn from one block of each performer, in a worker process, when it is first requested; then it is cached.
Starting the process takes a hundred times as long as drawing, so one process draws all pictures that are wanted.
"""

from __future__ import annotations

import asyncio
import base64
import hashlib
from collections import OrderedDict

from starlette.requests import Request

from bunraku.codec.container import PerformerTracks, StoredMotion
from bunraku.codec.errors import DamagedBlock
from bunraku.http.admission import AdmissionLimit, holder_of
from bunraku.http.problem_details import motion_not_found
from bunraku.motion.brush_drawing import STYLE
from bunraku.runtime import worker_process
from bunraku.runtime.context import ServiceContext
from bunraku.runtime.problem import ProblemError
from bunraku.runtime.worker_process import WorkerFailed, WorkerTimedOut, run_in_worker

DRAWING_VERSION = 1
"""Number in the entity tags, which changes when the same motion gets another picture."""
CONTENT_SECURITY_POLICY = (
    "default-src 'none'; frame-ancestors 'none'; "
    f"style-src 'sha256-{base64.b64encode(hashlib.sha256(STYLE.encode()).digest()).decode()}'"
)
"""Policy of a picture: only its own style sheet, nothing else."""
MAX_CACHED_THUMBNAILS = 1_000
"""Cached pictures: at most 5 MB."""
MAX_DRAWINGS = 64
"""Pictures that are being drawn or wait for it at the same time; further ones get 503."""
MAX_DRAWINGS_PER_HOLDER = 16
MAX_BATCH = 16
"""Pictures that one worker process draws."""
DRAWING_TIMEOUT_S = 20.0
"""Time limit for one worker process, in seconds."""

worker_process.preload_modules("bunraku.ingest.jobs.thumbnail")


class Thumbnails:
    """The most recently used pictures of one replica."""

    def __init__(self, context: ServiceContext) -> None:
        self._context = context
        self._cached: OrderedDict[str, bytes] = OrderedDict()
        # ids of the motions whose pictures wait, in order
        self._wanted: dict[str, None] = {}
        self._limit = AdmissionLimit("thumbnails", MAX_DRAWINGS, MAX_DRAWINGS_PER_HOLDER)
        # one at a time: the other processor is for the service
        self._drawing = asyncio.Semaphore(1)

    async def etag(self, motion_id: str) -> str:
        """Return the strong entity tag of a motion's picture; raise `ProblemError` (404) without the motion."""
        if await self._context.catalogue.get_motion(motion_id) is None:
            raise motion_not_found(motion_id)
        return f'"{motion_id}-{DRAWING_VERSION}"'

    async def get(self, motion_id: str, request: Request) -> bytes:
        """Return a picture as SVG; raise `ProblemError` (404, 503)."""
        if motion_id not in self._cached:
            if not self._context.kernels_compiled.is_set():
                raise ProblemError(503, "Preparing", "this server is preparing its kernels", hint="try again later")
            with self._limit.admit(holder_of(request)):
                self._wanted[motion_id] = None
                async with self._drawing:
                    # another request may have drawn it together with its own
                    if motion_id not in self._cached:
                        await self._draw(motion_id)
        self._cached.move_to_end(motion_id)
        return self._cached[motion_id]

    async def _draw(self, motion_id: str) -> None:
        """Draw and cache a picture, and others that are wanted; raise `ProblemError` if this one cannot be drawn."""
        self._wanted.pop(motion_id, None)
        own = await self._context.motion_store.get(motion_id)
        if own is None:
            raise motion_not_found(motion_id)
        motions = {motion_id: middle_blocks(own)}
        for other in list(self._wanted)[: MAX_BATCH - 1]:
            del self._wanted[other]
            stored = None if other in self._cached else await self._context.motion_store.get(other)
            if stored is not None:
                motions[other] = middle_blocks(stored)
        try:
            pictures = await run_in_worker(_call_draw, (list(motions.values()),), DRAWING_TIMEOUT_S)
        except WorkerTimedOut as error:
            # pictures take milliseconds: the machine is busy
            raise ProblemError(503, "Busy", str(error), hint="try again in a few seconds") from None
        except WorkerFailed:
            pictures = []
        for each, picture in zip(motions, pictures, strict=False):
            if picture:
                self._store(each, picture)
        if motion_id not in self._cached:
            detail = f"the picture of {motion_id} cannot be drawn; its object may be damaged"
            raise ProblemError(422, "Unreadable motion", detail, hint="upload its file again")

    def _store(self, motion_id: str, picture: bytes) -> None:
        if len(self._cached) >= MAX_CACHED_THUMBNAILS:
            self._cached.popitem(last=False)
        self._cached[motion_id] = picture


MiddleBlock = tuple[PerformerTracks, bytes, float]
"""A performer without packets, the Data message with the middle of the motion, and the middle in frames within it."""


def middle_blocks(stored: StoredMotion) -> list[MiddleBlock]:
    """Return what a picture needs of a motion: one message of each performer, of the highest level."""
    middle_us = stored.first_track.duration_us / 2
    blocks = []
    for performer in stored.performers:
        track = performer.track
        # a performer whose motion has ended stands still
        frame = min(middle_us * track.fps / 1e6, track.frames - 1.0)
        index = track.block_at(frame * 1e6 / track.fps)
        within = min(frame - track.first_frame(index), track.frames_in(index) - 0.5)
        bare = PerformerTracks(track, [], performer.front, performer.placement)
        blocks.append((bare, performer.packets[-1][index], within))
    return blocks


def _call_draw(motions: list[list[MiddleBlock]]) -> list[bytes]:
    """Draw pictures, in the worker process; that of a damaged motion is empty."""
    from bunraku.ingest.jobs.thumbnail import draw_thumbnail

    pictures = []
    for blocks in motions:
        try:
            pictures.append(draw_thumbnail(blocks))
        except DamagedBlock:
            pictures.append(b"")
    return pictures
