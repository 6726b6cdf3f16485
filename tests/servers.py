"""Servers for tests: the composed app on a free port, with its own data folder."""

from __future__ import annotations

import asyncio
import socket
import threading
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path

from bunraku.motion.bvh_writer import write_bvh
from bunraku.motion.skeleton import Motion
from bunraku.runtime.settings import Settings
from bunraku.serve import SERVICES, serve
from tests.time_limit import HANG_TIMEOUT_S
from tests.vectors.blocks import random_motion


@contextmanager
def run_server(
    data: Path,
    *,
    demo: bool = False,
    host: str = "127.0.0.1",
    services: Collection[str] = SERVICES,
    **settings: object,
) -> Iterator[str]:
    """Run a server in a thread and yield its address."""
    listening = socket.create_server((host, 0))
    url = f"http://127.0.0.1:{listening.getsockname()[1]}"
    started, ended = threading.Event(), threading.Event()
    failures: list[BaseException] = []

    def run() -> None:
        async def until_ended() -> None:
            server_settings = Settings(data=data, **settings)  # type: ignore[arg-type]
            serving = asyncio.create_task(
                serve(server_settings, listening, demo=demo, on_ready=started.set, services=services)
            )
            waiting = asyncio.create_task(asyncio.to_thread(ended.wait))
            await asyncio.wait((serving, waiting), return_when=asyncio.FIRST_COMPLETED)
            ended.set()
            serving.cancel()
            await asyncio.gather(serving, waiting, return_exceptions=True)
            if not serving.cancelled() and (error := serving.exception()) is not None:
                raise error

        try:
            asyncio.run(until_ended())
        except BaseException as error:
            failures.append(error)
        finally:
            started.set()

    thread = threading.Thread(target=run, name=f"server {url}")
    thread.start()
    try:
        assert started.wait(HANG_TIMEOUT_S), "the server did not start"
        assert not failures, failures
        yield url
    finally:
        ended.set()
        thread.join(HANG_TIMEOUT_S)
        assert not thread.is_alive(), "the server did not stop"
        assert not failures, failures


def make_bvh_clip(seconds: float = 3.4, seed: int = 3, fps: float = 30.0) -> bytes:
    """Return a small BVH file with random smooth motion."""
    motion = random_motion(seconds, fps, seed)
    return write_bvh(Motion(motion.figure, fps, motion.root * 0.1 + [0, 0.85, 0], motion.rotations))
