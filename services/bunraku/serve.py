"""The only wiring: backing, services and page in one process, or those of them that one process is for."""

from __future__ import annotations

import asyncio
import gc
import logging
import socket
import sys
import threading
from collections.abc import AsyncIterator, Awaitable, Callable, Collection, Iterator
from contextlib import AsyncExitStack, asynccontextmanager, contextmanager, suppress
from pathlib import Path
from signal import SIGINT, SIGTERM
from typing import Any

import uvicorn
from fastapi import FastAPI
from starlette.middleware.gzip import GZipMiddleware
from starlette.responses import PlainTextResponse, Response
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp, Scope

import bunraku.access.app
import bunraku.ik.app
import bunraku.ingest.app
import bunraku.session.app
import bunraku.stream.app
from bunraku import __version__
from bunraku.backing import problems, readiness, together
from bunraku.backing.access import needs
from bunraku.backing.backing import Backing, open_backing
from bunraku.backing.direct import DirectProtocol
from bunraku.backing.elsewhere import Elsewhere
from bunraku.backing.guard import Guard, describe, ways
from bunraku.backing.hasty import HEAD_BYTES, HastyProtocol
from bunraku.backing.origins import read_origins
from bunraku.backing.readiness import Need, Readiness
from bunraku.backing.requests import Requests
from bunraku.backing.settings import Settings
from bunraku.backing.unavailable import Unavailable
from bunraku.codec import decode
from bunraku.demo import open_stage
from bunraku.session import solving
from bunraku.wire.messages import LARGEST_FROM_CLIENT

PAGE = Path(__file__).parent / "page"
PAGE_HEADERS = {
    "Content-Security-Policy": "default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; "
    "style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; media-src 'self' data: blob:; "
    "worker-src 'self' blob:; "
    "object-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}
"""The page runs what this server has, stands in no other page's frame, and tells no other site where it is from."""
LASTING = ("assets/", "embed/parts/")
"""Where the page's files have their content's hash in their names."""
SHARED = "embed/"
"""The page's scripts that pages of every site may load: they are public, and what they then ask for is not."""
COLLECT = (20_000, 20, 50)
"""When the collector looks for cycles: vectors are many and short-lived, cycles few."""
SERVICES = ("stream", "ingest", "ik", "session", "page")
"""What a process may serve. Paths are looked up in this order: viewers come by the thousand."""
NEEDS: dict[str, tuple[Need, ...]] = {
    "stream": ("bus", "library"),
    "ingest": ("bus", "catalogue", "library"),
    "session": ("bus", "register", "library"),
}
"""What a service cannot work without."""
LOAD_AFTER = 1.5
"""Seconds in which the first page has the process to itself."""

_log = logging.getLogger(__name__)


class Page(StaticFiles):
    """The built page: names with a hash in them are kept for ever, the rest is asked for anew."""

    async def get_response(self, path: str, scope: Scope) -> Response:
        """As `StaticFiles`, with caching."""
        response = await super().get_response(path, scope)
        response.headers["Cache-Control"] = (
            "public, max-age=31536000, immutable" if path.startswith(LASTING) else "no-cache"
        )
        response.headers.update(PAGE_HEADERS)
        if path.startswith(SHARED):
            response.headers["Access-Control-Allow-Origin"] = "*"
        return response


@asynccontextmanager
async def compose(
    settings: Settings, *, demo: bool = False, services: Collection[str] = SERVICES
) -> AsyncIterator[FastAPI]:
    """Services (of `SERVICES`) as one app, upon what `settings` name; with `demo`, a stage with our own dance."""
    async with AsyncExitStack() as stack:
        backing = await stack.enter_async_context(open_backing(settings))
        stack.enter_context(backing.metrics.listening(settings.metrics))
        made: dict[str, Callable[[], FastAPI]] = {
            "stream": lambda: bunraku.stream.app.create_app(backing),
            "ingest": lambda: bunraku.ingest.app.create_app(backing),
            "ik": bunraku.ik.app.create_app,
            "session": lambda: bunraku.session.app.create_app(backing),
        }
        apps = {name: make() for name, make in made.items() if name in services}
        # every process has this one: it keeps nothing itself
        apps["access"] = bunraku.access.app.create_app(backing)
        app = FastAPI(title="Bunraku", version=__version__, docs_url="/v1/docs", openapi_url="/v1/openapi.json")
        problems.install(app)
        known = list(app.router.routes)
        state = Readiness(backing, [need for name in apps for need in NEEDS.get(name, ())])
        readiness.install(app, state)
        for service in apps.values():
            await stack.enter_async_context(service.router.lifespan_context(service))
            app.include_router(service.router)
            known += service.router.routes

        @app.get("/v1/health", tags=["health"])
        @needs(None)
        async def health() -> dict[str, Any]:
            """Whether this process serves."""
            return {"status": "ok", "version": __version__}

        known.append(app.router.routes[-1])
        describe(app)
        app.add_middleware(Guard, gate=backing.gate, ways=ways(known), settings=settings, metrics=backing.metrics)
        if origins := read_origins(settings.origins):
            app.add_middleware(Elsewhere, origins=origins)
        app.add_middleware(Requests, metrics=backing.metrics)
        if "page" in services:
            # the page goes with an account of the whole interface, whoever serves it
            whole = FastAPI(title=app.title, version=app.version)
            for service in (app, *(make() for name, make in made.items() if name not in apps)):
                whole.include_router(service.router)
                if service is not app:
                    # each says there, too, what it needs
                    ways(service.router.routes)
            describe(whole)
            app.openapi = whole.openapi  # type: ignore[method-assign]
            app.mount("/", _page())
        loading = asyncio.create_task(_load(backing, services), name="load what is needed later")
        stack.push_async_callback(_ended, loading)
        if demo:
            opening = open_stage(backing, apps["session"].state.sessions)
            if settings.bus == "memory:":
                await opening
            else:
                # what the replicas share may be away: meanwhile this one says so
                setting = asyncio.create_task(
                    _prepared(opening, "the demo's stage", state), name="set the demo's stage"
                )
                stack.push_async_callback(_ended, setting)
        yield app


def protocol() -> dict[str, Any]:
    """uvicorn's options for what comes over the line."""
    return {
        "http": HastyProtocol,
        "h11_max_incomplete_event_size": HEAD_BYTES,
        "ws": DirectProtocol,
        "ws_max_size": LARGEST_FROM_CLIENT,
        "ws_per_message_deflate": False,
    }


async def serve(
    settings: Settings,
    listening: socket.socket,
    *,
    demo: bool,
    ready: Callable[[], None],
    services: Collection[str] = SERVICES,
) -> None:
    """Serve on a listening socket until SIGINT or SIGTERM; `ready` is called once requests are answered."""
    _open_many()

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
                # it tells of queries at INFO, and they may have tickets; how its log is written the command says
                log_config=None,
                log_level="warning",
                access_log=False,
                server_header=False,
                timeout_graceful_shutdown=2,
            )
            await Server(config).serve(sockets=[listening])


def _open_many() -> None:
    """Each viewer is an open file, and many systems let a process have 1,024 of them until it asks for more."""
    if sys.platform == "win32":
        return
    import resource

    _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    # some say that there is no limit, and have one
    with suppress(ValueError):
        resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))


async def _prepared(work: Awaitable[None], what: str, state: Readiness) -> None:
    """Not ready until `work` is done."""
    state.waiting.add(what)
    try:
        await work
    except Exception:
        _log.exception("%s is not there", what)
    else:
        state.waiting.discard(what)


async def _load(backing: Backing, services: Collection[str]) -> None:
    """Load what takes seconds, so that nobody waits for it: after the page, one after the other, in a thread."""
    await asyncio.sleep(LOAD_AFTER)
    # whoever comes by a link for viewers is looked up in it
    if "ingest" in services or backing.gate.closed:
        try:
            await backing.catalogue.open()
        except Unavailable as error:
            # it is tried again when it is used
            _log.warning("%s", error)
    if "stream" in services:
        await asyncio.to_thread(together.warm)
    if "session" in services:
        await asyncio.to_thread(decode.warm)
        await asyncio.to_thread(solving.warm)
    # what is loaded by now stays: the collector need not walk through it again and again while limbs are solved
    gc.freeze()
    gc.set_threshold(*COLLECT)


async def _ended(task: asyncio.Task[None]) -> None:
    task.cancel()
    await asyncio.wait((task,))


def _page() -> ASGIApp:
    if not (PAGE / "index.html").is_file():
        return PlainTextResponse("The page is not built here: run `make setup`. The API is at /v1/docs.\n", 503)
    return GZipMiddleware(Page(directory=PAGE, html=True), minimum_size=1000)
