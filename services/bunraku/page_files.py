"""ASGI app that serves the built web page, and the reference page of the HTTP API."""

from __future__ import annotations

import os
from email.utils import formatdate
from functools import lru_cache
from mimetypes import guess_type
from pathlib import Path

from starlette.datastructures import Headers
from starlette.responses import FileResponse, PlainTextResponse, Response
from starlette.staticfiles import NotModifiedResponse, PathLike, StaticFiles
from starlette.types import ASGIApp, Receive, Scope, Send

from bunraku.runtime.problem import ProblemError

PAGE_HEADERS = {
    "Content-Security-Policy": "default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; "
    "style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; media-src 'self' data: blob:; "
    # The worker reads the textures of an avatar from memory.
    "connect-src 'self' data: blob:; worker-src 'self' blob:; "
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
PIECE_BYTES = 16 << 10
"""Bytes of a file that are sent at once."""
ENCODINGS = {"br": ".br", "gzip": ".gz"}
"""Content encodings, the best one first, and the suffixes of the copies that `services/web/compress_page.py` makes."""


class PageFile(Response):
    """A file of the page, sent from memory in pieces: clients that do not read keep no more than a piece each."""

    def __init__(
        self,
        path: PathLike,
        status: os.stat_result,
        name: PathLike,
        status_code: int = 200,
        encoding: str | None = None,
    ) -> None:
        """Send the file at `path` as the content of `name`, which has an encoding if that is another file."""
        self._content = _read_file(os.fspath(path), status.st_mtime_ns, status.st_size)
        headers = {"Last-Modified": formatdate(status.st_mtime, usegmt=True), "ETag": _entity_tag(status, encoding)}
        if encoding is not None:
            headers["Content-Encoding"] = encoding
        super().__init__(None, status_code, headers, guess_type(os.fspath(name))[0] or "application/octet-stream")
        self.headers["Content-Length"] = str(len(self._content))

    async def __call__(self, scope: Scope, _receive: Receive, send: Send) -> None:
        await send({"type": "http.response.start", "status": self.status_code, "headers": self.raw_headers})
        pieces = range(0, 0 if scope["method"] == "HEAD" else len(self._content), PIECE_BYTES)
        for start in pieces:
            body = self._content[start : start + PIECE_BYTES]
            await send({"type": "http.response.body", "body": body, "more_body": True})
        await send({"type": "http.response.body", "body": b""})


@lru_cache(maxsize=512)
def _read_file(path: str, _modified_ns: int, _size: int) -> bytes:
    """Return the content of a file, which is read again when it has changed."""
    return Path(path).read_bytes()


def _entity_tag(status: os.stat_result, encoding: str | None) -> str:
    return f'"{status.st_mtime_ns:x}-{status.st_size:x}{"-" + encoding if encoding else ""}"'


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
            return self._respond(PageFile(copy, stat_result, full_path, status_code, encoding), headers)
        return self._respond(PageFile(full_path, stat_result, full_path, status_code), headers)

    def _respond(self, response: Response, headers: Headers) -> Response:
        return NotModifiedResponse(response.headers) if self.is_not_modified(response.headers, headers) else response


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
