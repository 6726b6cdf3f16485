"""What the commands share: where they print, which server they ask, and how they say that it went wrong."""

from __future__ import annotations

import asyncio
import re
from typing import Annotated, Any
from urllib.parse import unquote, urlsplit

import typer
from rich.console import Console

out = Console()
err = Console(stderr=True)

JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON.")]
ServerOption = Annotated[str, typer.Option("--server", envvar="BUNRAKU_SERVER", help="Address of a running Bunraku.")]
TokenOption = Annotated[
    str | None,
    typer.Option("--token", envvar="BUNRAKU_TOKEN", show_envvar=True, help="What lets in, if the server asks for it."),
]
DEFAULT_SERVER = "http://127.0.0.1:8000"


def print_plain(text: str) -> None:
    """Print words as they stand."""
    out.print(text, markup=False, highlight=False, soft_wrap=True)


def print_statistics(statistics: dict[str, Any], as_json: bool) -> None:
    """Print figures by their names."""
    from rich.table import Table

    if as_json:
        out.print_json(data=statistics)
        return
    table = Table(show_header=False, box=None)
    for name, value in statistics.items():
        table.add_row(name.replace("_", " "), "-" if value is None else str(value))
    out.print(table)


def parse_resource_address(address: str) -> tuple[str | None, str | None, str]:
    """Server, kind (`motions` or `sessions`) and id of what is given by its page or its API address; of a mere id only
    that. Raises `typer.BadParameter` for an address of something else."""
    parts = urlsplit(address)
    if parts.scheme not in ("http", "https", "ws", "wss"):
        return None, None, address
    base = f"{parts.scheme.replace('ws', 'http')}://{parts.netloc}"
    query = dict(pair.partition("=")[::2] for pair in parts.query.split("&"))
    if "session" in query:
        return base, "sessions", unquote(query["session"])
    found = re.fullmatch(r"(.*)/v1/(motions|sessions)/([^/]+)(?:/(?:stream)?)?", parts.path)
    if found is None:
        raise typer.BadParameter(f"no motion and no session is at {address}")
    return base + found[1], found[2], unquote(found[3])


async def find_resource_kind(client: Any, resource_id: str) -> str:
    """Whether an id is of `sessions` or `motions`; raises `ServerProblem` where it is of neither."""
    from bunraku.client.api import ServerProblem

    try:
        await client.session(resource_id)
    except ServerProblem as problem:
        if problem.status != 404:
            raise
        await client.motion(resource_id)
        return "motions"
    return "sessions"


def run_request(request: Any, server: str) -> Any:
    """The result of `run`, its failures said in words."""
    import httpx2
    from websockets.exceptions import WebSocketException

    from bunraku.client.api import ServerProblem

    try:
        return asyncio.run(request())
    except ServerProblem as problem:
        err.print(str(problem))
    except (httpx2.TransportError, OSError, WebSocketException) as error:
        err.print(f"No Bunraku answers at {server}: {error}. Is `bunraku up` running?")
    raise typer.Exit(1)
