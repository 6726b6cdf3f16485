"""Composition root: opens the backends, creates the selected services and the page, and serves them as one app."""

from __future__ import annotations

import asyncio
import gc
import logging
import socket
import sys
import threading
from collections.abc import AsyncIterator, Awaitable, Callable, Collection, Iterator, Mapping
from contextlib import AsyncExitStack, asynccontextmanager, contextmanager, suppress
from functools import partial
from pathlib import Path
from signal import SIGINT, SIGTERM
from typing import Any

import uvicorn
from fastapi import FastAPI, Response
from fastapi.responses import JSONResponse
from starlette.routing import BaseRoute

import bunraku.access.app
import bunraku.ik.app
import bunraku.ingest.app
import bunraku.session.app
import bunraku.stream.app
from bunraku import __version__
from bunraku.codec import motion_decoder
from bunraku.compilation import compile_kernels
from bunraku.demo.bootstrap import open_demo_stage
from bunraku.http.access_control import requires
from bunraku.http.access_log import AccessLogMiddleware
from bunraku.http.authorization import AuthorizationMiddleware, add_security_scheme, collect_route_rules
from bunraku.http.client_address import ClientAddressMiddleware, TrustedProxies
from bunraku.http.cors import CorsMiddleware
from bunraku.http.origin import parse_origins
from bunraku.http.problem_details import install_problem_handlers
from bunraku.http.protocol import HttpLoad, HttpProtocol
from bunraku.http.response_headers import ContentSecurityMiddleware
from bunraku.http.unhandled_error import UnhandledErrorMiddleware
from bunraku.page_files import create_page_app, reference_response
from bunraku.runtime.availability import BackendUnavailable
from bunraku.runtime.context import ServiceContext, open_context
from bunraku.runtime.housekeeping import Housekeeping
from bunraku.runtime.input_scheduler import TURN_US, InputScheduler
from bunraku.runtime.open_connections import OpenConnections
from bunraku.runtime.readiness import Dependency, Readiness, install_health_routes
from bunraku.runtime.settings import Settings
from bunraku.session import limb_solver
from bunraku.websocket.handoff import HandoffProtocol
from bunraku.wire.messages import MAX_CLIENT_MESSAGE_BYTES

PAGE_FOLDER = Path(__file__).parent / "page"
GC_THRESHOLDS = (20_000, 20, 50)
"""Thresholds of the garbage collector: numeric code creates many short-lived objects and few cycles."""
SERVICES = ("stream", "ingest", "ik", "session", "page")
"""Services that a process may run. Routes are matched in this order; viewers are the most frequent clients."""
ACCESS_SERVICE = "access"
"""Service that every process runs, because it has no state."""
REQUIRED_BACKENDS: dict[str, tuple[Dependency, ...]] = {
    "stream": ("bus", "library"),
    "ingest": ("bus", "catalogue", "library"),
    "session": ("bus", "register", "library"),
}
"""Backends without which a service is not ready."""
KERNEL_SERVICES = frozenset({"session", "ingest"})
"""Services that need compiled kernels."""
WARM_UP_DELAY_S = 1.5
"""Time after the start in which the process only serves, so that the first page loads quickly."""
SHUTDOWN_TIMEOUT_S = 2
MAX_FILES = 50_000
"""Most files that a process opens, connections included, even if the system permits more."""
RESERVED_FILES = 256
"""Files that are not used for clients' connections: backends, motions, uploads and worker processes."""

ServiceFactory = Callable[[], FastAPI]

_log = logging.getLogger(__name__)


@asynccontextmanager
async def compose_app(
    settings: Settings, *, demo: bool = False, services: Collection[str] = SERVICES
) -> AsyncIterator[FastAPI]:
    """Open the backends of `settings` and yield one app with the given services of `SERVICES`.

    With `demo`, also open a stage with Bunraku's own dance.
    """
    async with AsyncExitStack() as stack:
        context = await stack.enter_async_context(open_context(settings))
        stack.enter_context(context.metrics.serve(settings.metrics))
        factories = _service_factories(context)
        apps = {name: create() for name, create in factories.items() if name in (*services, ACCESS_SERVICE)}
        readiness = Readiness(context, [backend for name in apps for backend in REQUIRED_BACKENDS.get(name, ())])

        app = FastAPI(title="Bunraku", version=__version__, openapi_url=None)
        install_problem_handlers(app)
        install_health_routes(app, readiness)
        routes: list[BaseRoute] = []
        for service in apps.values():
            await stack.enter_async_context(service.router.lifespan_context(service))
            app.include_router(service.router)
            routes += service.router.routes
        routes += _add_public_routes(app)
        add_security_scheme(app)
        _add_middleware(app, context, routes)
        if "page" in services:
            _describe_all_services(app, [create for name, create in factories.items() if name not in apps])
            app.mount("/", create_page_app(PAGE_FOLDER))

        housekeeping = Housekeeping(context, has_library="ingest" in apps)
        stack.push_async_callback(
            _cancel_and_wait, asyncio.create_task(housekeeping.run(WARM_UP_DELAY_S), name="housekeeping")
        )
        stack.push_async_callback(_cancel_and_wait, asyncio.create_task(_warm_up(context, apps), name="warm up"))
        if demo:
            opening = open_demo_stage(context, apps["session"].state.sessions)
            if settings.bus == "memory:":
                await opening
            else:
                # shared backends may be unavailable; the process serves meanwhile and reports that it is not ready
                task = asyncio.create_task(
                    _complete_before_ready(opening, "the demo's stage", readiness), name="open the demo's stage"
                )
                stack.push_async_callback(_cancel_and_wait, task)
        yield app


def _service_factories(context: ServiceContext) -> dict[str, ServiceFactory]:
    """Return the factory of each service, in the order in which routes are matched."""
    return {
        "stream": lambda: bunraku.stream.app.create_app(context),
        "ingest": lambda: bunraku.ingest.app.create_app(context),
        "ik": bunraku.ik.app.create_app,
        "session": lambda: bunraku.session.app.create_app(context),
        ACCESS_SERVICE: lambda: bunraku.access.app.create_app(context),
    }


def _add_public_routes(app: FastAPI) -> list[BaseRoute]:
    """Add the routes of the version and of the API's description, and return them."""
    first = len(app.router.routes)

    @app.get("/v1/openapi.json", include_in_schema=False)
    @requires(None)
    async def openapi() -> JSONResponse:
        return JSONResponse(app.openapi())

    @app.get("/v1/docs", include_in_schema=False)
    @requires(None)
    async def reference() -> Response:
        return reference_response(PAGE_FOLDER)

    @app.get("/v1/health", tags=["health"])
    @requires(None)
    async def health() -> dict[str, Any]:
        """Return the version of the running process."""
        return {"status": "ok", "version": __version__}

    return app.router.routes[first:]


def _add_middleware(app: FastAPI, context: ServiceContext, routes: list[BaseRoute]) -> None:
    """Add the middleware of all services. The last one added is the outermost."""
    app.add_middleware(AuthorizationMiddleware, context=context, rules=collect_route_rules(routes))
    app.add_middleware(UnhandledErrorMiddleware)
    if origins := parse_origins(context.settings.origins):
        app.add_middleware(CorsMiddleware, origins=origins)
    app.add_middleware(ContentSecurityMiddleware)
    app.add_middleware(AccessLogMiddleware, metrics=context.metrics, clock=context.clock)
    app.add_middleware(ClientAddressMiddleware, proxies=TrustedProxies.parse(context.settings.trusted_proxies))


def _describe_all_services(app: FastAPI, other_services: list[ServiceFactory]) -> None:
    """Make the API description of `app` include the services that other processes run."""
    description = FastAPI(title=app.title, version=app.version, openapi_url=None)
    description.include_router(app.router)
    for create in other_services:
        router = create().router
        description.include_router(router)
        # adds the required roles to the description
        collect_route_rules(router.routes)
    add_security_scheme(description)
    app.openapi = description.openapi  # type: ignore[method-assign]


def uvicorn_protocol_options() -> dict[str, Any]:
    """Return uvicorn's options for the HTTP and WebSocket protocols."""
    return {
        "http": partial(HttpProtocol, HttpLoad()),
        "ws": partial(HandoffProtocol, InputScheduler(TURN_US)),
        "ws_max_size": MAX_CLIENT_MESSAGE_BYTES,
        "ws_per_message_deflate": False,
    }


class _Server(uvicorn.Server):
    """uvicorn server that reports its start, bounds its connections, and ends without raising the signal again."""

    def __init__(self, config: uvicorn.Config, max_connections: int, on_ready: Callable[[], None]) -> None:
        super().__init__(config)
        self._connections = self.server_state.connections = OpenConnections(max_connections)
        self._on_ready = on_ready

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets)
        self._on_ready()

    def abort_connections(self) -> None:
        """End the connections that remain: those accepted while it stopped, and all if it was cancelled."""
        for connection in tuple(self._connections):
            connection.abort()

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        # uvicorn's own method raises the signal again before the services have closed
        loop = asyncio.get_running_loop()
        signals = (SIGINT, SIGTERM) if threading.current_thread() is threading.main_thread() else ()
        for number in signals:
            loop.add_signal_handler(number, self.handle_exit, number, None)
        try:
            yield
        finally:
            for number in signals:
                loop.remove_signal_handler(number)


async def serve(
    settings: Settings,
    listening_socket: socket.socket,
    *,
    demo: bool,
    on_ready: Callable[[], None],
    services: Collection[str] = SERVICES,
) -> None:
    """Serve on a listening socket until SIGINT or SIGTERM. Call `on_ready` once requests are accepted."""
    max_files = _raise_open_file_limit()
    max_connections = max(max_files - RESERVED_FILES, max_files // 2)
    with listening_socket:
        async with compose_app(settings, demo=demo, services=services) as app:
            config = uvicorn.Config(
                app,
                **uvicorn_protocol_options(),
                lifespan="off",
                # ClientAddressMiddleware takes the client's address from the header
                proxy_headers=False,
                # the command configures logging; at level INFO uvicorn would log queries, which may contain tickets
                log_config=None,
                log_level="warning",
                access_log=False,
                server_header=False,
                timeout_graceful_shutdown=SHUTDOWN_TIMEOUT_S,
            )
            server = _Server(config, max_connections, on_ready)
            try:
                await server.serve(sockets=[listening_socket])
            finally:
                server.abort_connections()


def _raise_open_file_limit() -> int:
    """Raise the limit on open files, as each viewer needs one and the default is often 1,024, and return it.

    Of an unlimited number, `MAX_FILES` are used.
    """
    if sys.platform == "win32":
        return MAX_FILES
    import resource

    _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    # some systems report no limit and reject it
    with suppress(ValueError):
        resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    soft, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    return MAX_FILES if soft == resource.RLIM_INFINITY else min(soft, MAX_FILES)


async def _complete_before_ready(work: Awaitable[None], name: str, readiness: Readiness) -> None:
    """Report that the process is not ready until `work` has completed."""
    readiness.pending_preparations.add(name)
    try:
        await work
    except Exception:
        _log.exception("cannot prepare %s", name)
    else:
        readiness.pending_preparations.discard(name)


async def _warm_up(context: ServiceContext, apps: Mapping[str, FastAPI]) -> None:
    """Load in a thread what takes seconds to load, so that no request waits for it."""
    if apps.keys() & KERNEL_SERVICES and not await asyncio.to_thread(limb_solver.is_compiled):
        context.kernels_compiled.clear()
    await asyncio.sleep(WARM_UP_DELAY_S)
    if not context.kernels_compiled.is_set():
        try:
            await compile_kernels()
        finally:
            context.kernels_compiled.set()
    # the catalogue is needed for uploads and to check links for viewers
    if "ingest" in apps or context.authenticator.requires_token:
        try:
            await context.catalogue.open()
        except BackendUnavailable as error:
            # each use of the catalogue tries again
            _log.warning("%s", error)
    if "stream" in apps:
        await asyncio.to_thread(apps["stream"].state.multicast_sender.load)
    if "session" in apps:
        await asyncio.to_thread(motion_decoder.warm_up)
        solver = await asyncio.to_thread(limb_solver.load_compiled_solver)
        apps["session"].state.sessions.use_solver(solver)
    # the objects loaded so far are permanent: exclude them from collections
    gc.freeze()
    gc.set_threshold(*GC_THRESHOLDS)


async def _cancel_and_wait(task: asyncio.Task[None]) -> None:
    task.cancel()
    await asyncio.wait((task,))
