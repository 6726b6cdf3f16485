"""The command `bunraku`."""

from __future__ import annotations

import asyncio
import socket
import sys
import webbrowser
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Annotated, Any
from urllib.parse import urlsplit

import typer

from bunraku import __version__
from bunraku.cli_access import (
    DEFAULT_TOKEN_HOURS,
    describe_setting_error,
    ensure_secret,
    make_operator_link,
    share,
    token,
)
from bunraku.terminal import (
    DEFAULT_SERVER,
    JsonOption,
    ServerOption,
    TokenOption,
    err,
    find_resource_kind,
    out,
    parse_resource_address,
    print_plain,
    print_statistics,
    run_request,
)

app = typer.Typer(
    help="A humanoid dances in the browser, and the people watching pull its strings.", no_args_is_help=True
)
app.command()(token)
app.command()(share)


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
    from bunraku.runtime import log
    from bunraku.runtime.metrics import MetricsListenError
    from bunraku.runtime.settings import Settings
    from bunraku.serve import SERVICES, serve

    services = SERVICES if service is None else tuple(service)
    if unknown := [name for name in services if name not in SERVICES]:
        raise typer.BadParameter(f"{unknown[0]!r} is none of {', '.join(SERVICES)}", param_hint="--service")
    if demo and "session" not in services:
        raise typer.BadParameter("the demo's stage is opened where sessions are", param_hint="--demo")

    try:
        settings = Settings() if data is None else Settings(data=data)
    except ValueError as error:
        err.print(describe_setting_error(error), markup=False)
        raise typer.Exit(1) from None
    log.configure_logging(settings.logs, settings.log_level, "all" if service is None else ",".join(services))
    own = ensure_secret(settings, host)
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
        guarded = bool(settings.secret.get_secret_value()) and "page" in services
        link = make_operator_link(settings, url) if guarded else url
        if guarded and (own or out.is_terminal):
            print_plain(f"Who comes needs a link. Yours, for {DEFAULT_TOKEN_HOURS:g} hours:\n{link}")
        elif guarded:
            out.print(f"Who comes needs a link: `bunraku token --server {url}` makes one.", soft_wrap=True)
        if open_page:
            webbrowser.open(link)

    out.print("Setting the stage ..." if demo else "Starting ...")
    serving = serve(settings, listening, demo=demo, on_ready=ready, services=services)
    try:
        if sys.platform == "win32":
            asyncio.run(serving)
        else:
            import uvloop

            uvloop.run(serving)
    except MetricsListenError as error:
        err.print(str(error), markup=False)
        raise typer.Exit(1) from None
    out.print("The curtain falls.")


@app.command()
def upload(
    file: Annotated[Path, typer.Argument(exists=True, dir_okay=False, readable=True)],
    server: ServerOption = DEFAULT_SERVER,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Upload a motion file, and say what was made of it."""
    from rich.table import Table

    motion = _send_file(file, server, token, as_json, lambda client, *told: client.upload(file, *told))
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
    server: ServerOption = DEFAULT_SERVER,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Make a new motion of one and a sound, which begins with it."""
    base, identity = _parse_motion_address(motion, "sound is added to a motion: give one")
    made = _send_file(
        file, base or server, token, as_json, lambda client, *told: client.add_audio(identity, file, *told)
    )
    if as_json:
        out.print_json(data=made)
        return
    rates = ", ".join(f"{rate['kbps']:.0f}" for rate in made["audio"]["rates"])
    print_plain(f"{made['audio']['seconds']:.1f} s of sound at {rates} kbit/s beside {made['name']}: {made['id']}")


@app.command()
def scene(
    motion: Annotated[str, typer.Argument(help="A motion: its id, its page, or its API address.")],
    file: Annotated[Path, typer.Argument(exists=True, dir_okay=False, readable=True, help="JSON: camera, lights.")],
    server: ServerOption = DEFAULT_SERVER,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Make a new motion of one with a camera and lights, from keyframes."""
    import json

    from bunraku.client.api import Client

    base, identity = _parse_motion_address(motion, "a scene is added to a motion: give one")
    try:
        staging = json.loads(file.read_bytes())
    except ValueError as error:
        raise typer.BadParameter(f"{file.name} is no JSON: {error}", param_hint="FILE") from None

    async def run() -> dict[str, Any]:
        async with Client(base or server, token) as client:
            return await client.add_scene(identity, staging)

    made = run_request(run, base or server)
    if as_json:
        out.print_json(data=made)
        return
    print_plain(f"{', '.join(made['tracks'])} of {made['name']}: {made['id']}")


@app.command()
def perform(
    motion: Annotated[str, typer.Argument(help="A motion: its id, its page, or its API address.")],
    others: Annotated[
        list[str], typer.Argument(help="Ids of motions that dance beside it; the same one may come again.")
    ],
    server: ServerOption = DEFAULT_SERVER,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Make a new motion in which several dance side by side, four at most."""
    from bunraku.client.api import Client

    base, identity = _parse_motion_address(motion, "motions dance side by side: give one")

    async def run() -> dict[str, Any]:
        async with Client(base or server, token) as client:
            return await client.add_performers(identity, others)

    made = run_request(run, base or server)
    if as_json:
        out.print_json(data=made)
        return
    print_plain(f"{made['performers']} performers, {made['name']}: {made['id']}")


@app.command(name="list")
def list_motions(server: ServerOption = DEFAULT_SERVER, token: TokenOption = None, as_json: JsonOption = False) -> None:
    """List the motions of a server."""
    from rich.table import Table

    from bunraku.client.api import Client

    async def run() -> list[dict[str, Any]]:
        async with Client(server, token) as client:
            return await client.motions()

    motions = run_request(run, server)
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
    server: ServerOption = DEFAULT_SERVER,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Watch without a screen, and print how it went."""
    from bunraku.client import Client, StreamEnded, Viewer

    async def run() -> dict[str, Any]:
        async with Client(server, token) as client:
            viewer = Viewer(await _resolve_stream_url(client, url), token=token)
        return (await viewer.watch(seconds)).as_json()

    try:
        figures = run_request(run, server)
    except StreamEnded as error:
        err.print(f"The stream ended: {error}")
        raise typer.Exit(1) from None
    print_statistics(figures, as_json)


@app.command()
def keep(
    session: Annotated[str, typer.Argument(help="A session: its id, its page, or its API address.")],
    name: Annotated[
        str | None, typer.Option(help="What the motion is called; default: as the dance, and kept.")
    ] = None,
    seconds: Annotated[
        float | None, typer.Option(help="How much of what was shown last; default: all that can be kept.", min=0.1)
    ] = None,
    server: ServerOption = DEFAULT_SERVER,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Keep what a session has shown as a new motion, pulled limbs and all."""
    from bunraku.client.api import Client

    async def run() -> dict[str, Any]:
        base, kind, identity = parse_resource_address(session)
        if kind == "motions":
            raise typer.BadParameter("a motion is kept already: give a session", param_hint="SESSION")
        async with Client(base or server, token) as client:
            return await client.record(identity, name, seconds)

    motion = run_request(run, server)
    if as_json:
        out.print_json(data=motion)
        return
    print_plain(f"Kept {motion['duration']:.1f} s as {motion['id']}: {motion['name']}")


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
    server: ServerOption = DEFAULT_SERVER,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Have many viewers watch at once, and print how they fared."""
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

    from bunraku.client.api import Client
    from bunraku.client.load_generator import FileLimitExceeded, run_load

    async def run() -> dict[str, Any]:
        async with Client(server, token) as client:
            found = url or await client.first_session()
            if found is None:
                raise typer.BadParameter(f"no session is open at {server}: name a motion", param_hint="--url")
            stream = await _resolve_stream_url(client, found)
        columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn())
        with Progress(*columns, console=err, disable=as_json or not err.is_terminal, transient=True) as progress:
            task = progress.add_task("joining", total=1)

            def told(stage: str, share: float) -> None:
                progress.update(task, description=stage, completed=share)

            return (
                await run_load(stream, viewers, seconds, joins_per_second=joins, token=token, on_progress=told)
            ).as_json()

    try:
        figures = run_request(run, server)
    except FileLimitExceeded as error:
        err.print(f"Too many viewers for one process: {error}")
        raise typer.Exit(1) from None
    print_statistics(figures, as_json)
    if figures["joined"] == 0:
        raise typer.Exit(1)


@app.command()
def version(as_json: JsonOption = False) -> None:
    """Print the version."""
    out.print_json(data={"version": __version__}) if as_json else out.print(__version__)


@app.command()
def warm() -> None:
    """Compile reader, codec and what moves limbs once, so that nobody waits for it (done by `make setup`)."""
    from bunraku.ingest.jobs import motion  # noqa: F401 - importing it loads, and the first time compiles, what a job uses
    from bunraku.session import limb_solver

    limb_solver.load_compiled_solver()


def _parse_motion_address(address: str, error_message: str) -> tuple[str | None, str]:
    """The server, if it is named, and the id of a motion; `otherwise` is said where a session is given."""
    base, kind, identity = parse_resource_address(address)
    if kind == "sessions":
        raise typer.BadParameter(error_message, param_hint="MOTION")
    return base, identity


def _send_file(
    file: Path, server: str, token: str | None, quiet: bool, send: Callable[..., Awaitable[dict[str, Any]]]
) -> dict[str, Any]:
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

            async with Client(server, token) as client:
                return await send(client, lambda sent, size: at("sending", sent / size), at)

    made: dict[str, Any] = run_request(run, server)
    return made


async def _resolve_stream_url(client: Any, address: str) -> str:
    """The socket of a motion or session, given by its address, its page or its id."""
    from bunraku.client.api import Client

    if urlsplit(address).scheme in ("ws", "wss"):
        return address
    base, kind, identity = parse_resource_address(address)
    if base is not None:
        return Client(base).socket_url(f"/v1/{kind}/{identity}/stream")
    socket_url: str = client.socket_url(f"/v1/{await find_resource_kind(client, identity)}/{identity}/stream")
    return socket_url


if __name__ == "__main__":
    sys.exit(app())
