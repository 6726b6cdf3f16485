"""Rehearsal: a BVH file, played in real time as a live performer."""

from __future__ import annotations

import asyncio
import contextlib
import math
import time
from collections.abc import Callable
from pathlib import Path

import typer
from rich.text import Text

from bunraku.capture.retarget import Pose
from bunraku.capture.session import TimedPose
from bunraku.capture_recorder import STATUS_INTERVAL_S, print_stage_address
from bunraku.capture_stream import MAX_STREAM_FPS, PerformanceStream, StreamOptions
from bunraku.motion.analysis import analyse
from bunraku.motion.errors import UnreadableFile
from bunraku.motion.readers.bvh import parse_bvh
from bunraku.motion.skeleton import Motion
from bunraku.terminal import call_when_stopped, err, print_statistics, run_request


def play_file(
    path: Path, make_options: Callable[[float], StreamOptions], *, loop: bool, seconds: float | None, as_json: bool
) -> None:
    """Play a BVH file as a live performer to its end, with `loop` until Ctrl-C, and print statistics.

    `make_options` receives the poses per second.
    """
    try:
        analysis = analyse(parse_bvh(path.read_bytes()))
    except UnreadableFile as error:
        raise typer.BadParameter(f"{path}: {error}", param_hint="FILE") from None
    motion = analysis.motion
    # of a file that is too fast, frames are left out
    stride = max(math.ceil(motion.fps / MAX_STREAM_FPS), 1)
    options = make_options(motion.fps / stride)
    stream = PerformanceStream(options, print_stage_address)
    run_request(stream.check, options.server)
    # Ctrl-C ends the performance
    with contextlib.suppress(KeyboardInterrupt):
        asyncio.run(_perform(motion, stride, stream, loop=loop, seconds=seconds, is_quiet=as_json))
    print_statistics({"file": str(path), **stream.statistics(), "assumptions": analysis.assumptions}, as_json)
    if stream.problem is not None:
        err.print(stream.problem)
        raise typer.Exit(1)


async def _perform(
    motion: Motion, stride: int, stream: PerformanceStream, *, loop: bool, seconds: float | None, is_quiet: bool
) -> None:
    stopped = asyncio.Event()
    call_when_stopped(stopped.set)
    streaming = asyncio.create_task(stream.run(motion.figure), name="performance")
    streaming.add_done_callback(lambda _: stopped.set())
    live = asyncio.create_task(stream.wait_until_live())
    status = err.status(Text("joining the stage")) if err.is_terminal and not is_quiet else None
    try:
        with status or contextlib.nullcontext():
            await asyncio.wait((live, asyncio.create_task(stopped.wait())), return_when=asyncio.FIRST_COMPLETED)
            begin = shown_at = time.monotonic()
            frame = 0
            while not stopped.is_set():
                at = begin + frame / motion.fps
                if (frame >= motion.frame_count and not loop) or (seconds is not None and at - begin > seconds):
                    break
                with contextlib.suppress(TimeoutError):
                    await asyncio.wait_for(stopped.wait(), max(at - time.monotonic(), 0.0))
                index = frame % motion.frame_count
                stream.offer([TimedPose(at, Pose(motion.root[index], motion.rotations[index], {}))])
                frame += stride
                if status is not None and at - shown_at >= STATUS_INTERVAL_S:
                    shown_at = at
                    status.update(Text(f"{at - begin:.1f} s, {stream.describe(motion.fps / stride)}. Ctrl-C ends."))
            sent = asyncio.create_task(stream.wait_until_sent())
            await asyncio.wait((sent, streaming), return_when=asyncio.FIRST_COMPLETED)
    finally:
        live.cancel()
        streaming.cancel()
        await asyncio.gather(live, streaming, return_exceptions=True)
