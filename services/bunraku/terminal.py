"""Functions that the commands share: output, addresses of motions and sessions, errors of requests."""

from __future__ import annotations

import asyncio
import contextlib
import os
import re
import signal
import sys
import threading
from collections.abc import Awaitable, Callable
from json import dumps
from typing import TYPE_CHECKING, Annotated, Any, TypeVar
from urllib.parse import unquote, urlsplit

import typer
from rich.console import Console
from rich.highlighter import JSONHighlighter
from rich.text import Text

from bunraku.runtime.display_text import escape_text

if TYPE_CHECKING:
    from bunraku.client.api import Client


class TerminalConsole(Console):
    """Console on which texts of servers and files have no effect but to be seen.

    Every string, also one in a table, is printed on one line, with characters that control a terminal or its reader as
    escapes and without the markup of rich.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__(markup=False, emoji=False, **options)

    def render_str(self, text: str, **options: Any) -> Text:
        return super().render_str(escape_text(text), **options)

    def print_json(self, json: str | None = None, *, data: Any = None, **options: Any) -> None:
        """Print `data` as indented JSON; the escapes keep it valid."""
        document = json if json is not None else dumps(data, indent=2, ensure_ascii=False, **options)
        self.print(JSONHighlighter()(Text(escape_text(document, keep="\n"))), soft_wrap=True)


out = TerminalConsole()
err = TerminalConsole(stderr=True)

JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON.")]
ServerOption = Annotated[str, typer.Option("--server", envvar="BUNRAKU_SERVER", help="Address of a running server.")]
TokenOption = Annotated[
    str | None,
    typer.Option("--token", envvar="BUNRAKU_TOKEN", show_envvar=True, help="Token, if the server requires one."),
]
MotionArgument = Annotated[str, typer.Argument(help="Id or address of a motion.")]
DEFAULT_SERVER = "http://127.0.0.1:8000"

Result = TypeVar("Result")


def print_plain(text: str) -> None:
    """Print a line of text without highlighting or wrapping."""
    out.print(text, highlight=False, soft_wrap=True)


def print_statistics(statistics: dict[str, Any], as_json: bool) -> None:
    """Print named values as a table or as JSON."""
    from rich.table import Table

    if as_json:
        out.print_json(data=statistics)
        return
    table = Table(show_header=False, box=None)
    for name, value in statistics.items():
        table.add_row(name.replace("_", " "), "-" if value is None else str(value))
    out.print(table)


def parse_resource_address(address: str) -> tuple[str | None, str | None, str]:
    """Return the server, kind (`motions` or `sessions`) and id of a motion or session.

    `address` is the URL of its page or of its API resource, or only its id; then server and kind are None. Raises
    `typer.BadParameter` for any other URL.
    """
    parts = urlsplit(address)
    if parts.scheme not in ("http", "https", "ws", "wss"):
        return None, None, address
    base = f"{parts.scheme.replace('ws', 'http')}://{parts.netloc}"
    query = dict(pair.partition("=")[::2] for pair in parts.query.split("&"))
    if "session" in query:
        return base, "sessions", unquote(query["session"])
    match = re.fullmatch(r"(.*)/v1/(motions|sessions)/([^/]+)(?:/(?:stream)?)?", parts.path)
    if match is None:
        raise typer.BadParameter(f"{address} is not the address of a motion or session")
    return base + match[1], match[2], unquote(match[3])


def parse_motion_address(address: str) -> tuple[str | None, str]:
    """Return the server, None if the address is only an id, and the id of a motion.

    Raises `typer.BadParameter` for the address of a session.
    """
    base, kind, motion_id = parse_resource_address(address)
    if kind == "sessions":
        raise typer.BadParameter("this is the address of a session; give a motion", param_hint="MOTION")
    return base, motion_id


async def find_resource_kind(client: Client, resource_id: str) -> str:
    """Return whether an id belongs to `sessions` or `motions`. Raises `ServerProblem` if it belongs to neither."""
    from bunraku.client.server_problem import ServerProblem

    try:
        await client.session(resource_id)
    except ServerProblem as problem:
        if problem.status != 404:
            raise
        await client.motion(resource_id)
        return "motions"
    return "sessions"


async def resolve_stream_url(client: Client, address: str) -> str:
    """Return the WebSocket URL of a motion or session, given by its id or address."""
    from bunraku.client.api import Client

    if urlsplit(address).scheme in ("ws", "wss"):
        return address
    base, kind, resource_id = parse_resource_address(address)
    if base is not None:
        return Client(base).socket_url(f"/v1/{kind}/{resource_id}/stream")
    return client.socket_url(f"/v1/{await find_resource_kind(client, resource_id)}/{resource_id}/stream")


def call_when_stopped(stop: Callable[[], object]) -> None:
    """Call `stop` in the running event loop at Ctrl-C, and if another process stops this one (SIGTERM).

    The next signal ends the process at once. On Windows, whose event loops handle no signals, Ctrl-C stays a
    KeyboardInterrupt.
    """
    if sys.platform == "win32":
        return
    loop, numbers = asyncio.get_running_loop(), (signal.SIGINT, signal.SIGTERM)

    def on_signal() -> None:
        for number in numbers:
            loop.remove_signal_handler(number)
        stop()

    for number in numbers:
        loop.add_signal_handler(number, on_signal)


def call_at_input(handle: Callable[[str], object]) -> None:
    """Call `handle` in the running event loop with each line of standard input, until the input or the loop ends.

    A command in the background of a terminal reads nothing, as the system would stop it.
    """
    if sys.platform != "win32" and os.isatty(0) and os.tcgetpgrp(0) != os.getpgrp():
        return
    loop = asyncio.get_running_loop()

    def read() -> None:
        unfinished = b""
        # not `sys.stdin`, whose lock would be held when Python ends
        with contextlib.suppress(OSError, RuntimeError):
            while data := os.read(0, 1024):
                *lines, unfinished = (unfinished + data)[-1024:].split(b"\n")
                for line in lines:
                    loop.call_soon_threadsafe(handle, line.decode(errors="replace").strip())

    threading.Thread(target=read, name="standard input", daemon=True).start()


def run_request(request: Callable[[], Awaitable[Result]], server: str) -> Result:
    """Return the result of `request`. If it fails, print the error and raise `typer.Exit`."""
    import httpx2
    from websockets.exceptions import WebSocketException

    from bunraku.client.server_problem import ServerProblem

    async def run() -> Result:
        return await request()

    try:
        return asyncio.run(run())
    except ServerProblem as problem:
        err.print(str(problem))
    except (httpx2.TransportError, OSError, WebSocketException) as error:
        err.print(f"Cannot reach Bunraku at {server}: {error}. Start it with `bunraku up`.")
    raise typer.Exit(1)
