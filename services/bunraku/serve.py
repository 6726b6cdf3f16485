"""The only wiring: backing, services and page in one process."""

from __future__ import annotations

import hashlib
import socket
import tempfile
from collections.abc import AsyncIterator, Callable
from contextlib import AsyncExitStack, asynccontextmanager
from pathlib import Path
from typing import Any

import anyio.to_thread
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
from bunraku.backing import problems
from bunraku.backing.backing import open_backing
from bunraku.backing.settings import Settings
from bunraku.ingest.uploads import Uploads, motion_id
from bunraku.motion import choreography
from bunraku.motion.writers import write_bvh
from bunraku.wire.messages import LARGEST_FROM_CLIENT

PAGE = Path(__file__).parent / "page"


class Page(StaticFiles):
    """The built page: names with a hash in them are kept for ever, the rest is asked for anew."""

    async def get_response(self, path: str, scope: Scope) -> Response:
        """As `StaticFiles`, with caching."""
        response = await super().get_response(path, scope)
        lasting = path.startswith("assets/") and response.status_code < 300
        response.headers["Cache-Control"] = "public, max-age=31536000, immutable" if lasting else "no-cache"
        return response


@asynccontextmanager
async def compose(settings: Settings, *, demo: bool = False) -> AsyncIterator[FastAPI]:
    """All four services and the page as one app, upon what `settings` name; with `demo`, a stage with our own dance."""
    async with AsyncExitStack() as stack:
        backing = await stack.enter_async_context(open_backing(settings))
        sessions = bunraku.session.app.create_app(backing)
        app = FastAPI(title="Bunraku", version=__version__, docs_url="/v1/docs", openapi_url="/v1/openapi.json")
        problems.install(app)
        for service in (
            bunraku.ingest.app.create_app(backing),
            bunraku.stream.app.create_app(backing),
            bunraku.ik.app.create_app(),
            sessions,
        ):
            await stack.enter_async_context(service.router.lifespan_context(service))
            app.include_router(service.router)

        @app.get("/v1/health", tags=["health"])
        async def health() -> dict[str, Any]:
            """Whether this process serves."""
            return {"status": "ok", "version": __version__}

        app.mount("/", _page())
        if demo:
            motion = await add_demo(Uploads(backing))
            await sessions.state.sessions.open(motion)
        yield app


async def add_demo(uploads: Uploads) -> str:
    """The id of the demo's own dance, taken in like any upload the first time."""
    data = await anyio.to_thread.run_sync(lambda: write_bvh(choreography.dance()))
    with tempfile.TemporaryDirectory(prefix="bunraku-demo-") as folder:
        path = Path(folder) / "source"
        path.write_bytes(data)
        entry, _ = await uploads.add(motion_id(hashlib.sha256(data).digest()), path, f"{choreography.TITLE}.bvh")
    return entry.id


async def serve(settings: Settings, listening: socket.socket, *, demo: bool, ready: Callable[[], None]) -> None:
    """Serve on a listening socket until SIGINT or SIGTERM; `ready` is called once requests are answered."""

    class Server(uvicorn.Server):
        async def startup(self, sockets: list[socket.socket] | None = None) -> None:
            await super().startup(sockets)
            ready()

    with listening:
        async with compose(settings, demo=demo) as app:
            config = uvicorn.Config(
                app,
                ws="websockets-sansio",
                ws_max_size=LARGEST_FROM_CLIENT,
                ws_per_message_deflate=False,
                lifespan="off",
                log_level="warning",
                access_log=False,
                server_header=False,
                timeout_graceful_shutdown=2,
            )
            await Server(config).serve(sockets=[listening])


def _page() -> ASGIApp:
    if not (PAGE / "index.html").is_file():
        return PlainTextResponse("The page is not built here: run `make setup`. The API is at /v1/docs.\n", 503)
    return GZipMiddleware(Page(directory=PAGE, html=True), minimum_size=1000)
