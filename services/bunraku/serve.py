"""The only wiring: backing, services and page in one process, or those of them that one process is for."""

from __future__ import annotations

import asyncio
import gc
import logging
import socket
import threading
from collections.abc import AsyncIterator, Callable, Collection, Iterator
from contextlib import AsyncExitStack, asynccontextmanager, contextmanager
from pathlib import Path
from signal import SIGINT, SIGTERM
from typing import Any

import uvicorn
from fastapi import FastAPI
from starlette.middleware.gzip import GZipMiddleware
from starlette.responses import PlainTextResponse, Response
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp, Scope

import bunraku.ik.app
import bunraku.ingest.app
import bunraku.session.app
import bunraku.stream.app
from bunraku import __version__
from bunraku.backing import problems, together
from bunraku.backing.backing import Backing, open_backing
from bunraku.backing.cache import cache_of
from bunraku.backing.direct import DirectProtocol
from bunraku.backing.settings import Settings
from bunraku.backing.unavailable import Unavailable
from bunraku.codec import decode
from bunraku.demo import add_demo
from bunraku.wire.messages import LARGEST_FROM_CLIENT

PAGE = Path(__file__).parent / "page"
COLLECT = (20_000, 20, 50)
"""When the collector looks for cycles: vectors are many and short-lived, cycles few."""
SERVICES = ("stream", "ingest", "ik", "session", "page")
"""What a process may serve. Paths are looked up in this order: viewers come by the thousand."""
LOAD_AFTER = 1.5
"""Seconds in which the first page has the process to itself."""

_log = logging.getLogger(__name__)


class Page(StaticFiles):
    """The built page: names with a hash in them are kept for ever, the rest is asked for anew."""

    async def get_response(self, path: str, scope: Scope) -> Response:
        """As `StaticFiles`, with caching."""
        response = await super().get_response(path, scope)
        lasting = path.startswith("assets/")
        response.headers["Cache-Control"] = "public, max-age=31536000, immutable" if lasting else "no-cache"
        return response


@asynccontextmanager
async def compose(
    settings: Settings, *, demo: bool = False, services: Collection[str] = SERVICES
) -> AsyncIterator[FastAPI]:
    """Services (of `SERVICES`) as one app, upon what `settings` name; with `demo`, a stage with our own dance."""
    async with AsyncExitStack() as stack:
        backing = await stack.enter_async_context(open_backing(settings))
        made: dict[str, Callable[[], FastAPI]] = {
            "stream": lambda: bunraku.stream.app.create_app(backing),
            "ingest": lambda: bunraku.ingest.app.create_app(backing),
            "ik": bunraku.ik.app.create_app,
            "session": lambda: bunraku.session.app.create_app(backing),
        }
        apps = {name: make() for name, make in made.items() if name in services}
        app = FastAPI(title="Bunraku", version=__version__, docs_url="/v1/docs", openapi_url="/v1/openapi.json")
        problems.install(app)
        for service in apps.values():
            await stack.enter_async_context(service.router.lifespan_context(service))
            app.include_router(service.router)

        @app.get("/v1/health", tags=["health"])
        async def health() -> dict[str, Any]:
            """Whether this process serves."""
            return {"status": "ok", "version": __version__}

        if "page" in services:
            app.mount("/", _page())
        loading = asyncio.create_task(_load(backing, services), name="load what is needed later")
        stack.push_async_callback(_ended, loading)
        if demo:
            await apps["session"].state.sessions.open(await add_demo(backing))
        yield app


def protocol() -> dict[str, Any]:
    """uvicorn's options for sockets."""
    return {"ws": DirectProtocol, "ws_max_size": LARGEST_FROM_CLIENT, "ws_per_message_deflate": False}


async def serve(
    settings: Settings,
    listening: socket.socket,
    *,
    demo: bool,
    ready: Callable[[], None],
    services: Collection[str] = SERVICES,
) -> None:
    """Serve on a listening socket until SIGINT or SIGTERM; `ready` is called once requests are answered."""

    class Server(uvicorn.Server):
        async def startup(self, sockets: list[socket.socket] | None = None) -> None:
            await super().startup(sockets)
            ready()

        @contextmanager
        def capture_signals(self) -> Iterator[None]:
            # uvicorn's own raises the signal again before the services have closed; here it only ends the serving
            loop = asyncio.get_running_loop()
            signals = (SIGINT, SIGTERM) if threading.current_thread() is threading.main_thread() else ()
            for number in signals:
                loop.add_signal_handler(number, self.handle_exit, number, None)
            try:
                yield
            finally:
                for number in signals:
                    loop.remove_signal_handler(number)

    with listening:
        async with compose(settings, demo=demo, services=services) as app:
            config = uvicorn.Config(
                app,
                **protocol(),
                lifespan="off",
                log_level="warning",
                access_log=False,
                server_header=False,
                timeout_graceful_shutdown=2,
            )
            await Server(config).serve(sockets=[listening])


async def _load(backing: Backing, services: Collection[str]) -> None:
    """Load what takes seconds, so that nobody waits for it: after the page, one after the other, in a thread."""
    await asyncio.sleep(LOAD_AFTER)
    if "ingest" in services:
        try:
            await backing.catalogue.open()
        except Unavailable as error:
            # it is tried again when it is used
            _log.warning("%s", error)
    if "stream" in services:
        await asyncio.to_thread(together.warm)
    if "session" in services:
        await asyncio.to_thread(decode.warm)
        await asyncio.to_thread(_load_solving)
    # what is loaded by now stays: the collector need not walk through it again and again while limbs are solved
    gc.freeze()
    gc.set_threshold(*COLLECT)


def _load_solving() -> None:
    # imported here, as it brings the compiler along
    from bunraku.marionette import compiled

    compiled.load(cache_of("marionette"))


async def _ended(task: asyncio.Task[None]) -> None:
    task.cancel()
    await asyncio.wait((task,))


def _page() -> ASGIApp:
    if not (PAGE / "index.html").is_file():
        return PlainTextResponse("The page is not built here: run `make setup`. The API is at /v1/docs.\n", 503)
    return GZipMiddleware(Page(directory=PAGE, html=True), minimum_size=1000)
