"""ASGI app that serves the built web page, and the reference page of the HTTP API."""

from __future__ import annotations

import os
from mimetypes import guess_type
from pathlib import Path

from starlette.datastructures import Headers
from starlette.responses import FileResponse, PlainTextResponse, Response
from starlette.staticfiles import NotModifiedResponse, PathLike, StaticFiles
from starlette.types import ASGIApp, Scope

from bunraku.runtime.problem import ProblemError

PAGE_HEADERS = {
    "Content-Security-Policy": "default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; "
    "style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; media-src 'self' data: blob:; "
    "worker-src 'self' blob:; "
    "object-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}
"""The page runs only files of this server, cannot be framed, and sends no referrer."""
REFERENCE_FILE = Path("v1", "docs.html")
"""Reference page of the HTTP API in the folder of the page."""
REFERENCE_HEADERS = {
    **PAGE_HEADERS,
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
    "img-src 'self' data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "Cache-Control": "no-cache",
}
IMMUTABLE_PREFIXES = ("assets/", "embed/parts/")
"""Folders whose file names contain a hash of the content."""
CROSS_ORIGIN_PREFIX = "embed/"
"""Folder of the scripts that pages of every site may load. The scripts are public; their API requests are not."""
ENCODINGS = {"br": ".br", "gzip": ".gz"}
"""Content encodings, the best one first, and the suffixes of the copies that `services/web/compress-page.mjs` makes."""


class PageFiles(StaticFiles):
    """Static files of the page, compressed when it is built.

    Files with a hash in their name are cached for ever, others are revalidated.
    """

    async def get_response(self, path: str, scope: Scope) -> Response:
        response = await super().get_response(path, scope)
        response.headers["Cache-Control"] = (
            "public, max-age=31536000, immutable" if path.startswith(IMMUTABLE_PREFIXES) else "no-cache"
        )
        response.headers["Vary"] = "Accept-Encoding"
        response.headers.update(PAGE_HEADERS)
        if path.startswith(CROSS_ORIGIN_PREFIX):
            response.headers["Access-Control-Allow-Origin"] = "*"
        return response

    def file_response(
        self, full_path: PathLike, stat_result: os.stat_result, scope: Scope, status_code: int = 200
    ) -> Response:
        headers = Headers(scope=scope)
        for encoding in accepted_encodings(headers.get("accept-encoding", "")):
            copy = Path(f"{os.fspath(full_path)}{ENCODINGS[encoding]}")
            try:
                stat_result = copy.stat()
            except OSError:
                # too small to be compressed, or no text
                continue
            response = FileResponse(
                copy,
                status_code,
                {"Content-Encoding": encoding},
                guess_type(os.fspath(full_path))[0],
                stat_result=stat_result,
            )
            if self.is_not_modified(response.headers, headers):
                return NotModifiedResponse(response.headers)
            return response
        return super().file_response(full_path, stat_result, scope, status_code)


def accepted_encodings(header: str) -> list[str]:
    """Return those of `ENCODINGS` that an Accept-Encoding header accepts, the best one first (RFC 9110, 12.5.3)."""
    weights = {}
    for part in header.lower().split(","):
        name, _, weight = part.partition(";")
        weights[name.strip()] = weight.replace(" ", "")
    return [name for name in ENCODINGS if name in weights and weights[name].rstrip("0.") != "q="]


def create_page_app(folder: Path) -> ASGIApp:
    """Return an app that serves the page in `folder`, or a 503 with instructions if the page is not built."""
    if not (folder / "index.html").is_file():
        return PlainTextResponse("The page is not built: run `make setup`. The API is at /v1/docs.\n", 503)
    return PageFiles(directory=folder, html=True)


def reference_response(folder: Path) -> Response:
    """Return the reference page of the HTTP API; raise `ProblemError` 503 if the page is not built."""
    path = folder / REFERENCE_FILE
    if not path.is_file():
        raise ProblemError(
            503,
            "Page not built",
            "the reference of the API is part of the page, which is not built",
            hint="run `make setup`, or read /v1/openapi.json",
        )
    return FileResponse(path, headers=REFERENCE_HEADERS)
