"""The command `bunraku`."""

from __future__ import annotations

import asyncio
import re
import socket
import sys
import webbrowser
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Annotated, Any
from urllib.parse import unquote, urlsplit

import typer
from rich.console import Console

from bunraku import __version__

app = typer.Typer(
    help="A humanoid dances in the browser, and the people watching pull its strings.", no_args_is_help=True
)
out = Console()
err = Console(stderr=True)

Json = Annotated[bool, typer.Option("--json", help="Print JSON.")]
Server = Annotated[str, typer.Option("--server", envvar="BUNRAKU_SERVER", help="Address of a running Bunraku.")]
HERE = "http://127.0.0.1:8000"


@app.command()
def up(
    host: Annotated[str, typer.Option(help="Address to listen at.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="Port to listen at; 0: any free one.", min=0, max=65535)] = 8000,
    data: Annotated[Path | None, typer.Option(help="Folder for what is kept; default .bunraku.")] = None,
    demo: Annotated[bool, typer.Option("--demo", help="Open a stage with Bunraku's own dance.")] = False,
    service: Annotated[
        list[str] | None, typer.Option(help="Serve this alone, of stream, ingest, ik, session, page; may be repeated.")
    ] = None,
    open_page: Annotated[bool, typer.Option("--open", help="Open the page in a browser.")] = False,
) -> None:
    """Run everything in one process, until Ctrl-C. Several processes meet over a bus: BUNRAKU_BUS=nats://..."""
    from bunraku.backing.settings import Settings
    from bunraku.serve import SERVICES, serve

    services = SERVICES if service is None else tuple(service)
    if unknown := [name for name in services if name not in SERVICES]:
        raise typer.BadParameter(f"{unknown[0]!r} is none of {', '.join(SERVICES)}", param_hint="--service")
    if demo and "session" not in services:
        raise typer.BadParameter("the demo's stage is opened where sessions are", param_hint="--demo")

    settings = Settings() if data is None else Settings(data=data)
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        listening = socket.create_server((host, port), family=family, backlog=1024)
    except OSError as error:
        err.print(f"Cannot listen at {host}, port {port}: {error.strerror}. Another port: PORT={port + 1} make demo")
        raise typer.Exit(1) from None
    shown = f"[{host}]" if ":" in host else {"0.0.0.0": "127.0.0.1"}.get(host, host)
    url = f"http://{shown}:{listening.getsockname()[1]}/"

    def ready() -> None:
        out.print(f"Bunraku {__version__} is at [link={url}]{url}[/link]", soft_wrap=True)
        out.print(f"It keeps its motions in {settings.data}. Ctrl-C ends it.", soft_wrap=True)
        if open_page:
            webbrowser.open(url)

    out.print("Setting the stage ..." if demo else "Starting ...")
    serving = serve(settings, listening, demo=demo, ready=ready, services=services)
    if sys.platform == "win32":
        asyncio.run(serving)
    else:
        import uvloop

        uvloop.run(serving)
    out.print("The curtain falls.")


@app.command()
def upload(
    file: Annotated[Path, typer.Argument(exists=True, dir_okay=False, readable=True)],
    server: Server = HERE,
    as_json: Json = False,
) -> None:
    """Upload a motion file, and say what was made of it."""
    from rich.table import Table

    motion = _send(file, server, as_json, lambda client, *told: client.upload(file, *told))
    if as_json:
        out.print_json(data=motion)
        return
    table = Table(show_header=False, box=None)
    table.add_row("id", motion["id"])
    table.add_row("length", f"{motion['duration']:.2f} s, {motion['frames']} frames at {motion['fps']:g} fps")
    table.add_row("joints", f"{len(motion['joints'])} of 18, names: {motion['profile']}")
    table.add_row("fit", f"{motion['fit']['mean_mm']:.1f} mm mean, {motion['fit']['max_mm']:.1f} mm at most")
    table.add_row("rates", ", ".join(f"{rate['kbps']:.1f} kbit/s" for rate in motion["rates"]))
    for guess in motion["guessed"]:
        table.add_row("guessed", guess)
    out.print(table)


@app.command()
def audio(
    motion: Annotated[str, typer.Argument(help="A motion: its id, its page, or its API address.")],
    file: Annotated[Path, typer.Argument(exists=True, dir_okay=False, readable=True, help="WAV, FLAC, MP3 or Ogg.")],
    server: Server = HERE,
    as_json: Json = False,
) -> None:
    """Make a new motion of one and a sound, which begins with it."""
    base, kind, identity = _address(motion)
    if kind == "sessions":
        raise typer.BadParameter("sound is added to a motion: give one", param_hint="MOTION")
    made = _send(file, base or server, as_json, lambda client, *told: client.add_audio(identity, file, *told))
    if as_json:
        out.print_json(data=made)
        return
    rates = ", ".join(f"{rate['kbps']:.0f}" for rate in made["audio"]["rates"])
    said = f"{made['audio']['seconds']:.1f} s of sound at {rates} kbit/s beside {made['name']}: {made['id']}"
    out.print(said, markup=False, highlight=False, soft_wrap=True)


@app.command()
def scene(
    motion: Annotated[str, typer.Argument(help="A motion: its id, its page, or its API address.")],
    file: Annotated[Path, typer.Argument(exists=True, dir_okay=False, readable=True, help="JSON: camera, lights.")],
    server: Server = HERE,
    as_json: Json = False,
) -> None:
    """Make a new motion of one with a camera and lights, from keyframes."""
    import json

    from bunraku.client.api import Client

    base, kind, identity = _address(motion)
    if kind == "sessions":
        raise typer.BadParameter("a scene is added to a motion: give one", param_hint="MOTION")
    try:
        staging = json.loads(file.read_bytes())
    except ValueError as error:
        raise typer.BadParameter(f"{file.name} is no JSON: {error}", param_hint="FILE") from None

    async def run() -> dict[str, Any]:
        async with Client(base or server) as client:
            return await client.add_scene(identity, staging)

    made = _ask(run, base or server)
    if as_json:
        out.print_json(data=made)
        return
    said = f"{', '.join(made['tracks'])} of {made['name']}: {made['id']}"
    out.print(said, markup=False, highlight=False, soft_wrap=True)


@app.command(name="list")
def list_motions(server: Server = HERE, as_json: Json = False) -> None:
    """List the motions of a server."""
    from rich.table import Table

    from bunraku.client.api import Client

    async def run() -> list[dict[str, Any]]:
        async with Client(server) as client:
            return await client.motions()

    motions = _ask(run, server)
    if as_json:
        out.print_json(data=motions)
        return
    table = Table("id", "name", "length", "fps", "rates, kbit/s", "tracks", box=None, header_style="bold")
    for motion in motions:
        rates = " ".join(f"{rate['kbps']:.1f}" for rate in motion["rates"])
        length, tracks = f"{motion['duration']:.1f} s", " ".join(motion["tracks"])
        table.add_row(motion["id"], motion["name"], length, f"{motion['fps']:g}", rates, tracks)
    out.print(table)


@app.command()
def watch(
    url: Annotated[str, typer.Argument(help="A motion or session: its id, its page, or its API address.")],
    seconds: Annotated[float, typer.Option(help="How long.", min=0.1, max=86400)] = 10.0,
    server: Server = HERE,
    as_json: Json = False,
) -> None:
    """Watch without a screen, and print how it went."""
    from rich.table import Table

    from bunraku.client import Client, StreamEnded, Viewer

    async def run() -> dict[str, Any]:
        async with Client(server) as client:
            viewer = Viewer(await _stream_url(client, url))
        return (await viewer.watch(seconds)).as_json()

    try:
        figures = _ask(run, server)
    except StreamEnded as error:
        err.print(f"The stream ended: {error}")
        raise typer.Exit(1) from None
    if as_json:
        out.print_json(data=figures)
        return
    table = Table(show_header=False, box=None)
    for key, value in figures.items():
        table.add_row(key.replace("_", " "), str(value))
    out.print(table)


@app.command()
def keep(
    session: Annotated[str, typer.Argument(help="A session: its id, its page, or its API address.")],
    name: Annotated[
        str | None, typer.Option(help="What the motion is called; default: as the dance, and kept.")
    ] = None,
    seconds: Annotated[
        float | None, typer.Option(help="How much of what was shown last; default: all that can be kept.", min=0.1)
    ] = None,
    server: Server = HERE,
    as_json: Json = False,
) -> None:
    """Keep what a session has shown as a new motion, pulled limbs and all."""
    from bunraku.client.api import Client

    async def run() -> dict[str, Any]:
        base, kind, identity = _address(session)
        if kind == "motions":
            raise typer.BadParameter("a motion is kept already: give a session", param_hint="SESSION")
        async with Client(base or server) as client:
            return await client.keep(identity, name, seconds)

    motion = _ask(run, server)
    if as_json:
        out.print_json(data=motion)
        return
    out.print(f"Kept {motion['duration']:.1f} s as {motion['id']}: {motion['name']}", markup=False, highlight=False)


bench = typer.Typer(help="Load-test a server.", no_args_is_help=True)
app.add_typer(bench, name="bench")


@bench.callback()
def _bench() -> None:
    """Commands of their own below, also while there is but one."""


@bench.command("viewers")
def bench_viewers(
    viewers: Annotated[int, typer.Option("--n", help="How many viewers.", min=1, max=100_000)] = 200,
    url: Annotated[
        str | None,
        typer.Option("--url", help="A motion or session: its id, page or API address; default: the first session."),
    ] = None,
    seconds: Annotated[float, typer.Option(help="How long they watch.", min=0.1, max=86400)] = 20.0,
    joins: Annotated[float, typer.Option(help="How many join in a second.", min=0.1, max=10_000)] = 200.0,
    server: Server = HERE,
    as_json: Json = False,
) -> None:
    """Have many viewers watch at once, and print how they fared."""
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn
    from rich.table import Table

    from bunraku.client.api import Client
    from bunraku.client.crowd import TooMany, watch_together

    async def run() -> dict[str, Any]:
        async with Client(server) as client:
            found = url or await client.first_session()
            if found is None:
                raise typer.BadParameter(f"no session is open at {server}: name a motion", param_hint="--url")
            stream = await _stream_url(client, found)
        columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn())
        with Progress(*columns, console=err, disable=as_json or not err.is_terminal, transient=True) as progress:
            task = progress.add_task("joining", total=1)

            def told(stage: str, share: float) -> None:
                progress.update(task, description=stage, completed=share)

            return (await watch_together(stream, viewers, seconds, joins=joins, told=told)).as_json()

    try:
        figures = _ask(run, server)
    except TooMany as error:
        err.print(f"Too many viewers for one process: {error}")
        raise typer.Exit(1) from None
    if as_json:
        out.print_json(data=figures)
    else:
        table = Table(show_header=False, box=None)
        for key, value in figures.items():
            table.add_row(key.replace("_", " "), "-" if value is None else str(value))
        out.print(table)
    if figures["joined"] == 0:
        raise typer.Exit(1)


@app.command()
def version(as_json: Json = False) -> None:
    """Print the version."""
    out.print_json(data={"version": __version__}) if as_json else out.print(__version__)


@app.command()
def warm() -> None:
    """Compile reader, codec and what moves limbs once, so that nobody waits for it (done by `make setup`)."""
    from bunraku.backing.cache import cache_of
    from bunraku.ingest import making  # noqa: F401 - importing it loads, and the first time compiles, what a job uses
    from bunraku.marionette import compiled

    compiled.load(cache_of("marionette"))


def _send(file: Path, server: str, quiet: bool, send: Callable[..., Awaitable[dict[str, Any]]]) -> dict[str, Any]:
    """What the server makes of a file; `send` is told the client, and what to tell how far it is."""
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

    from bunraku.client.api import Client

    async def run() -> dict[str, Any]:
        columns = (
            TextColumn("{task.fields[name]}", markup=False),
            BarColumn(),
            TaskProgressColumn(),
            TextColumn("{task.description}"),
        )
        with Progress(*columns, console=err, disable=quiet or not err.is_terminal, transient=True) as progress:
            task = progress.add_task("sending", name=file.name, total=1)

            def at(stage: str, share: float) -> None:
                progress.update(task, description=stage, completed=share)

            async with Client(server) as client:
                return await send(client, lambda sent, size: at("sending", sent / size), at)

    made: dict[str, Any] = _ask(run, server)
    return made


async def _stream_url(client: Any, address: str) -> str:
    """The socket of a motion or session, given by its address, its page or its id."""
    from bunraku.client.api import Client, ServerProblem

    if urlsplit(address).scheme in ("ws", "wss"):
        return address
    base, kind, identity = _address(address)
    if base is not None:
        return Client(base).socket_url(f"/v1/{kind}/{identity}/stream")
    try:
        await client.session(identity)
        kind = "sessions"
    except ServerProblem:
        await client.motion(identity)
        kind = "motions"
    socket_url: str = client.socket_url(f"/v1/{kind}/{identity}/stream")
    return socket_url


def _address(address: str) -> tuple[str | None, str | None, str]:
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


def _ask(run: Any, server: str) -> Any:
    """The result of `run`, its failures said in words."""
    import httpx2
    from websockets.exceptions import WebSocketException

    from bunraku.client.api import ServerProblem

    try:
        return asyncio.run(run())
    except ServerProblem as problem:
        err.print(str(problem))
    except (httpx2.TransportError, OSError, WebSocketException) as error:
        err.print(f"No Bunraku answers at {server}: {error}. Is `bunraku up` running?")
    raise typer.Exit(1)


if __name__ == "__main__":
    sys.exit(app())
