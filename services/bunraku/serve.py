"""The only wiring: backing, services and page in one process, or those of them that one process is for."""

from __future__ import annotations

import asyncio
import gc
import logging
import socket
import sys
import threading
from collections.abc import AsyncIterator, Awaitable, Callable, Collection, Iterator, Mapping
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
from bunraku.codec import motion_decoder
from bunraku.demo.bootstrap import open_demo_stage
from bunraku.http import problem_details
from bunraku.http.access_control import requires
from bunraku.http.access_log import AccessLogMiddleware
from bunraku.http.authorization import AuthorizationMiddleware, add_security_scheme, collect_route_rules
from bunraku.http.cors import CorsMiddleware
from bunraku.http.header_timeout import MAX_HEADER_BYTES, HeaderTimeoutProtocol
from bunraku.http.origin import parse_origins
from bunraku.runtime import readiness
from bunraku.runtime.availability import BackendUnavailable
from bunraku.runtime.context import ServiceContext, open_context
from bunraku.runtime.readiness import Dependency, Readiness
from bunraku.runtime.settings import Settings
from bunraku.session import limb_solver
from bunraku.websocket import multicast
from bunraku.websocket.handoff import HandoffProtocol
from bunraku.wire.messages import MAX_CLIENT_MESSAGE_BYTES

PAGE_FOLDER = Path(__file__).parent / "page"
PAGE_HEADERS = {
    "Content-Security-Policy": "default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; "
    "style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; media-src 'self' data: blob:; "
    "worker-src 'self' blob:; "
    "object-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}
"""The page runs what this server has, stands in no other page's frame, and tells no other site where it is from."""
IMMUTABLE_PREFIXES = ("assets/", "embed/parts/")
"""Where the page's files have their content's hash in their names."""
CROSS_ORIGIN_PREFIX = "embed/"
"""The page's scripts that pages of every site may load: they are public, and what they then ask for is not."""
GC_THRESHOLDS = (20_000, 20, 50)
"""When the collector looks for cycles: vectors are many and short-lived, cycles few."""
SERVICES = ("stream", "ingest", "ik", "session", "page")
"""What a process may serve. Paths are looked up in this order: viewers come by the thousand."""
REQUIRED_BACKENDS: dict[str, tuple[Dependency, ...]] = {
    "stream": ("bus", "library"),
    "ingest": ("bus", "catalogue", "library"),
    "session": ("bus", "register", "library"),
}
"""What a service cannot work without."""
WARM_UP_DELAY_S = 1.5
"""Seconds in which the first page has the process to itself."""

_log = logging.getLogger(__name__)


class PageFiles(StaticFiles):
    """The built page: names with a hash in them are kept for ever, the rest is asked for anew."""

    async def get_response(self, path: str, scope: Scope) -> Response:
        """As `StaticFiles`, with caching."""
        response = await super().get_response(path, scope)
        response.headers["Cache-Control"] = (
            "public, max-age=31536000, immutable" if path.startswith(IMMUTABLE_PREFIXES) else "no-cache"
        )
        response.headers.update(PAGE_HEADERS)
        if path.startswith(CROSS_ORIGIN_PREFIX):
            response.headers["Access-Control-Allow-Origin"] = "*"
        return response


@asynccontextmanager
async def compose_app(
    settings: Settings, *, demo: bool = False, services: Collection[str] = SERVICES
) -> AsyncIterator[FastAPI]:
    """Services (of `SERVICES`) as one app, upon what `settings` name; with `demo`, a stage with our own dance."""
    async with AsyncExitStack() as stack:
        backing = await stack.enter_async_context(open_context(settings))
        stack.enter_context(backing.metrics.serve(settings.metrics))
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
        problem_details.install_problem_handlers(app)
        known = list(app.router.routes)
        state = Readiness(backing, [need for name in apps for need in REQUIRED_BACKENDS.get(name, ())])
        readiness.install_health_routes(app, state)
        for service in apps.values():
            await stack.enter_async_context(service.router.lifespan_context(service))
            app.include_router(service.router)
            known += service.router.routes

        @app.get("/v1/health", tags=["health"])
        @requires(None)
        async def health() -> dict[str, Any]:
            """Whether this process serves."""
            return {"status": "ok", "version": __version__}

        known.append(app.router.routes[-1])
        add_security_scheme(app)
        app.add_middleware(
            AuthorizationMiddleware,
            authenticator=backing.authenticator,
            rules=collect_route_rules(known),
            settings=settings,
            metrics=backing.metrics,
        )
        if origins := parse_origins(settings.origins):
            app.add_middleware(CorsMiddleware, origins=origins)
        app.add_middleware(AccessLogMiddleware, metrics=backing.metrics)
        if "page" in services:
            # the page goes with an account of the whole interface, whoever serves it
            whole = FastAPI(title=app.title, version=app.version)
            for service in (app, *(make() for name, make in made.items() if name not in apps)):
                whole.include_router(service.router)
                if service is not app:
                    # each says there, too, what it needs
                    collect_route_rules(service.router.routes)
            add_security_scheme(whole)
            app.openapi = whole.openapi  # type: ignore[method-assign]
            app.mount("/", _page_app())
        loading = asyncio.create_task(_warm_up(backing, apps), name="load what is needed later")
        stack.push_async_callback(_cancel_and_wait, loading)
        if demo:
            opening = open_demo_stage(backing, apps["session"].state.sessions)
            if settings.bus == "memory:":
                await opening
            else:
                # what the replicas share may be away: meanwhile this one says so
                setting = asyncio.create_task(
                    _complete_before_ready(opening, "the demo's stage", state), name="set the demo's stage"
                )
                stack.push_async_callback(_cancel_and_wait, setting)
        yield app


def uvicorn_protocol_options() -> dict[str, Any]:
    """uvicorn's options for what comes over the line."""
    return {
        "http": HeaderTimeoutProtocol,
        "h11_max_incomplete_event_size": MAX_HEADER_BYTES,
        "ws": HandoffProtocol,
        "ws_max_size": MAX_CLIENT_MESSAGE_BYTES,
        "ws_per_message_deflate": False,
    }


async def serve(
    settings: Settings,
    listening_socket: socket.socket,
    *,
    demo: bool,
    on_ready: Callable[[], None],
    services: Collection[str] = SERVICES,
) -> None:
    """Serve on a listening socket until SIGINT or SIGTERM; `ready` is called once requests are answered."""
    _raise_open_file_limit()

    class Server(uvicorn.Server):
        async def startup(self, sockets: list[socket.socket] | None = None) -> None:
            await super().startup(sockets)
            on_ready()

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

    with listening_socket:
        async with compose_app(settings, demo=demo, services=services) as app:
            config = uvicorn.Config(
                app,
                **uvicorn_protocol_options(),
                lifespan="off",
                # it tells of queries at INFO, and they may have tickets; how its log is written the command says
                log_config=None,
                log_level="warning",
                access_log=False,
                server_header=False,
                timeout_graceful_shutdown=2,
            )
            await Server(config).serve(sockets=[listening_socket])


def _raise_open_file_limit() -> None:
    """Each viewer is an open file, and many systems let a process have 1,024 of them until it asks for more."""
    if sys.platform == "win32":
        return
    import resource

    _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    # some say that there is no limit, and have one
    with suppress(ValueError):
        resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))


async def _complete_before_ready(work: Awaitable[None], task_name: str, readiness_state: Readiness) -> None:
    """Not ready until `work` is done."""
    readiness_state.pending_preparations.add(task_name)
    try:
        await work
    except Exception:
        _log.exception("%s is not there", task_name)
    else:
        readiness_state.pending_preparations.discard(task_name)


async def _warm_up(context: ServiceContext, apps: Mapping[str, FastAPI]) -> None:
    """Load what takes seconds, so that nobody waits for it: after the page, one after the other, in a thread."""
    await asyncio.sleep(WARM_UP_DELAY_S)
    # whoever comes by a link for viewers is looked up in it
    if "ingest" in apps or context.authenticator.requires_token:
        try:
            await context.catalogue.open()
        except BackendUnavailable as error:
            # it is tried again when it is used
            _log.warning("%s", error)
    if "stream" in apps:
        await asyncio.to_thread(multicast.warm_up)
    if "session" in apps:
        await asyncio.to_thread(motion_decoder.warm_up)
        solver = await asyncio.to_thread(limb_solver.load_compiled_solver)
        apps["session"].state.sessions.use_solver(solver)
    # what is loaded by now stays: the collector need not walk through it again and again while limbs are solved
    gc.freeze()
    gc.set_threshold(*GC_THRESHOLDS)


async def _cancel_and_wait(task: asyncio.Task[None]) -> None:
    task.cancel()
    await asyncio.wait((task,))


def _page_app() -> ASGIApp:
    if not (PAGE_FOLDER / "index.html").is_file():
        return PlainTextResponse("The page is not built here: run `make setup`. The API is at /v1/docs.\n", 503)
    return GZipMiddleware(PageFiles(directory=PAGE_FOLDER, html=True), minimum_size=1000)
