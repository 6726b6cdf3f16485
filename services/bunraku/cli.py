"""Command line of Bunraku."""

from __future__ import annotations

import asyncio
import socket
import sys
import webbrowser
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.text import Text

from bunraku import __version__
from bunraku.cli_access import (
    DEFAULT_TOKEN_HOURS,
    describe_setting_error,
    ensure_secret,
    make_operator_link,
    share,
    token,
)
from bunraku.cli_bench import bench
from bunraku.cli_capture import capture
from bunraku.cli_crowd import crowd
from bunraku.cli_inspect import inspect
from bunraku.cli_library import edit, list_motions, reencode, rename, tag
from bunraku.cli_props import props
from bunraku.cli_send import send
from bunraku.runtime.display_text import escape_text
from bunraku.terminal import (
    DEFAULT_SERVER,
    JsonOption,
    MotionArgument,
    ServerOption,
    TokenOption,
    err,
    out,
    parse_motion_address,
    parse_resource_address,
    print_plain,
    print_statistics,
    resolve_stream_url,
    run_request,
)

if TYPE_CHECKING:
    from bunraku.client.api import Client

app = typer.Typer(
    help="Stream humanoid motion to browsers, and let viewers control the limbs.",
    no_args_is_help=True,
    # they may be tokens
    pretty_exceptions_show_locals=False,
)
app.command()(token)
app.command()(share)
app.command()(crowd)
app.command()(props)
app.command()(inspect)
app.command(name="list")(list_motions)
app.command()(rename)
app.command()(tag)
app.command()(edit)
app.command()(reencode)
app.add_typer(bench, name="bench")
app.add_typer(capture, name="capture")
app.add_typer(send, name="send")

ResourceArgument = Annotated[str, typer.Argument(help="Id or address of a motion or session.")]
SessionArgument = Annotated[str, typer.Argument(help="Id or address of a session.")]


@app.command()
def up(
    host: Annotated[str, typer.Option(help="Address to listen on.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="Port to listen on; 0 selects a free port.", min=0, max=65535)] = 8000,
    data: Annotated[Path | None, typer.Option(help="Data folder; default .bunraku.")] = None,
    demo: Annotated[bool, typer.Option("--demo", help="Open a stage with Bunraku's demo dance.")] = False,
    service: Annotated[
        list[str] | None, typer.Option(help="Run only this service: stream, ingest, ik, session or page. Repeatable.")
    ] = None,
    open_page: Annotated[bool, typer.Option("--open", help="Open the page in a browser.")] = False,
) -> None:
    """Run the server until Ctrl-C. Several processes can share the work over a bus: BUNRAKU_BUS=nats://..."""
    from bunraku.runtime import log
    from bunraku.runtime.context import DataFolderError
    from bunraku.runtime.metrics import MetricsListenError
    from bunraku.runtime.settings import Settings
    from bunraku.serve import SERVICES, serve

    services = SERVICES if service is None else tuple(service)
    if unknown := [name for name in services if name not in SERVICES]:
        raise typer.BadParameter(f"unknown service {unknown[0]!r}; use {', '.join(SERVICES)}", param_hint="--service")
    if demo and "session" not in services:
        raise typer.BadParameter("the demo needs the service session: add --service session", param_hint="--demo")

    try:
        settings = Settings() if data is None else Settings(data=data)
    except ValueError as error:
        err.print(describe_setting_error(error))
        raise typer.Exit(1) from None
    log.configure_logging(settings.logs, settings.log_level, "all" if service is None else ",".join(services))
    created_secret = ensure_secret(settings, host)
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        listening = socket.create_server((host, port), family=family, backlog=1024)
    except OSError as error:
        err.print(f"Cannot listen on {host}, port {port}: {error.strerror}. Choose another port with --port.")
        raise typer.Exit(1) from None
    url_host = f"[{host}]" if ":" in host else {"0.0.0.0": "127.0.0.1"}.get(host, host)
    url = f"http://{url_host}:{listening.getsockname()[1]}/"

    def print_address() -> None:
        out.print(Text.assemble(f"Bunraku {__version__} is at ", (url, f"link {url}")), soft_wrap=True)
        out.print(f"Data is stored in {settings.data}. Press Ctrl-C to stop.", soft_wrap=True)
        is_protected = bool(settings.secret.get_secret_value()) and "page" in services
        link = make_operator_link(settings, url) if is_protected else url
        if is_protected and (created_secret or out.is_terminal):
            print_plain(f"Clients need a link. Yours, valid for {DEFAULT_TOKEN_HOURS:g} hours:")
            print_plain(link)
        elif is_protected:
            out.print(f"Clients need a link: create one with `bunraku token --server {url}`.", soft_wrap=True)
        if open_page:
            webbrowser.open(link)

    out.print("Preparing the demo ..." if demo else "Starting ...")
    serving = serve(settings, listening, demo=demo, on_ready=print_address, services=services)
    try:
        if sys.platform == "win32":
            asyncio.run(serving)
        else:
            import uvloop

            uvloop.run(serving)
    except (MetricsListenError, DataFolderError) as error:
        err.print(str(error))
        raise typer.Exit(1) from None
    out.print("Stopped.")


@app.command()
def upload(
    file: Annotated[Path, typer.Argument(exists=True, dir_okay=False, readable=True)],
    server: ServerOption = DEFAULT_SERVER,
    token: TokenOption = None,
    as_json: JsonOption = False,
    take: Annotated[str | None, typer.Option(help="Only this motion of a file that has several.")] = None,
) -> None:
    """Upload a motion file (BVH, FBX, GLB, VRMA, or a zip archive) and print the analysed motions.

    With --json, a file of one motion gives that motion, and a file of several an object with its `items`.
    """

    async def send(client: Client, *callbacks: Any) -> dict[str, Any]:
        if take is None:
            return await client.upload_takes(file, *callbacks)
        return {"items": [await client.upload(file, *callbacks, take=take)], "skipped": [], "pending": []}

    stored = _send_file(file, server, token, as_json, send)
    is_single = len(stored["items"]) == 1 and not stored["skipped"] and not stored["pending"]
    if as_json:
        out.print_json(data=stored["items"][0] if is_single else stored)
    elif is_single:
        _print_motion(stored["items"][0])
    else:
        _print_takes(stored)


def _print_motion(motion: dict[str, Any]) -> None:
    from rich.table import Table

    table = Table(show_header=False, box=None)
    table.add_row("id", motion["id"])
    table.add_row("length", f"{motion['duration']:.2f} s, {motion['frames']} frames at {motion['fps']:g} fps")
    table.add_row("joints", f"{len(motion['joints'])} of 18, names: {motion['profile']}")
    table.add_row("fit", _describe_fit(motion["fit"]))
    if extension := motion.get("extension"):
        table.add_row("extended", ", ".join(extension["joints"]))
        table.add_row("", _describe_fit(extension["fit"]))
    if fingers := motion.get("fingers"):
        table.add_row("fingers", f"{len(fingers['joints'])} joints, {_describe_fit(fingers['fit'])}")
    if face := motion.get("face"):
        table.add_row("face", f"{len(face['expressions'])} expressions")
    table.add_row("rates", ", ".join(f"{rate['kbps']:.1f} kbit/s" for rate in motion["rates"]))
    for assumption in motion["guessed"]:
        table.add_row("assumed", assumption)
    out.print(table)


def _describe_fit(fit: dict[str, float]) -> str:
    return f"{fit['mean_mm']:.1f} mm mean, {fit['max_mm']:.1f} mm maximum"


def _print_takes(stored: dict[str, Any]) -> None:
    """Print what became of the takes of a file: a line for each motion, and for each take without one the reason."""
    from rich.table import Table

    table = Table("id", "name", "length", box=None)
    for motion in stored["items"]:
        table.add_row(motion["id"], motion["name"], f"{motion['duration']:.2f} s")
    if stored["items"]:
        out.print(table)
    for skipped in stored["skipped"]:
        reason = ": ".join(skipped[name] for name in ("take", "title", "detail") if skipped[name])
        err.print(f"Left out: {reason}" + (f" ({skipped['hint']})" if skipped["hint"] else ""), soft_wrap=True)
    if stored["pending"]:
        names = ", ".join(stored["pending"])
        err.print(f"The server goes on with {names}; they follow in the library.", soft_wrap=True)


@app.command()
def audio(
    motion: MotionArgument,
    file: Annotated[Path, typer.Argument(exists=True, dir_okay=False, readable=True, help="WAV, FLAC, MP3 or Ogg.")],
    server: ServerOption = DEFAULT_SERVER,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Create a motion from another one and a sound that starts with it."""
    base, motion_id = parse_motion_address(motion)
    created = _send_file(
        file, base or server, token, as_json, lambda client, *callbacks: client.add_audio(motion_id, file, *callbacks)
    )
    if as_json:
        out.print_json(data=created)
        return
    rates = ", ".join(f"{rate['kbps']:.0f}" for rate in created["audio"]["rates"])
    seconds = created["audio"]["seconds"]
    print_plain(f"{seconds:.1f} s of sound at {rates} kbit/s with {created['name']}: {created['id']}")


@app.command()
def scene(
    motion: MotionArgument,
    file: Annotated[Path, typer.Argument(exists=True, dir_okay=False, readable=True, help="JSON with keyframes.")],
    server: ServerOption = DEFAULT_SERVER,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Create a motion from another one with a camera and lights from keyframes."""
    import json

    from bunraku.client.api import Client

    base, motion_id = parse_motion_address(motion)
    try:
        staging = json.loads(file.read_bytes())
    except ValueError as error:
        raise typer.BadParameter(f"{file.name} is not JSON: {error}", param_hint="FILE") from None

    async def request() -> dict[str, Any]:
        async with Client(base or server, token) as client:
            return await client.add_scene(motion_id, staging)

    created = run_request(request, base or server)
    if as_json:
        out.print_json(data=created)
        return
    print_plain(f"{', '.join(created['tracks'])} of {created['name']}: {created['id']}")


@app.command()
def perform(
    motion: MotionArgument,
    others: Annotated[list[str], typer.Argument(help="Ids of the motions of the other performers; repeatable.")],
    server: ServerOption = DEFAULT_SERVER,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Create a motion with up to four performers side by side."""
    from bunraku.client.api import Client

    base, motion_id = parse_motion_address(motion)

    async def request() -> dict[str, Any]:
        async with Client(base or server, token) as client:
            return await client.add_performers(motion_id, others)

    created = run_request(request, base or server)
    if as_json:
        out.print_json(data=created)
        return
    print_plain(f"{created['performers']} performers, {created['name']}: {created['id']}")


@app.command()
def watch(
    url: ResourceArgument,
    seconds: Annotated[float, typer.Option(help="Duration.", min=0.1, max=86400)] = 10.0,
    server: ServerOption = DEFAULT_SERVER,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Watch a stream without rendering and print statistics."""
    from bunraku.client import Client, StreamEnded, Viewer

    async def request() -> dict[str, Any]:
        async with Client(server, token) as client:
            viewer = Viewer(await resolve_stream_url(client, url), token=token)
        return (await viewer.watch(seconds)).as_json()

    try:
        statistics = run_request(request, server)
    except StreamEnded as error:
        err.print(f"The stream ended: {error}")
        raise typer.Exit(1) from None
    print_statistics(statistics, as_json)


@app.command()
def keep(
    session: SessionArgument,
    name: Annotated[
        str | None, typer.Option(help="Name of the motion; default: derived from the session's motion.")
    ] = None,
    seconds: Annotated[
        float | None, typer.Option(help="Length of the recording up to now; default: as long as possible.", min=0.1)
    ] = None,
    server: ServerOption = DEFAULT_SERVER,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Record a session, including the controlled limbs, as a new motion."""
    from bunraku.client.api import Client

    async def request() -> dict[str, Any]:
        base, kind, resource_id = parse_resource_address(session)
        if kind == "motions":
            raise typer.BadParameter("this is the address of a motion; give a session", param_hint="SESSION")
        async with Client(base or server, token) as client:
            return await client.record(resource_id, name, seconds)

    motion = run_request(request, server)
    if as_json:
        out.print_json(data=motion)
        return
    print_plain(f"Recorded {motion['duration']:.1f} s as {motion['id']}: {motion['name']}")


@app.command()
def version(as_json: JsonOption = False) -> None:
    """Print the version."""
    out.print_json(data={"version": __version__}) if as_json else out.print(__version__)


@app.command()
def warm() -> None:
    """Compile the kernels ahead of time, so that the first requests do not wait (part of `make setup`)."""
    from bunraku.ingest.jobs import motion  # noqa: F401 - importing it compiles the kernels of an upload
    from bunraku.session import limb_solver

    limb_solver.load_compiled_solver()


def _send_file(
    file: Path, server: str, token: str | None, quiet: bool, send: Callable[..., Awaitable[dict[str, Any]]]
) -> dict[str, Any]:
    """Send a file with a progress bar and return the created motion.

    `send` gets the client, a callback for the sent and total bytes, and a callback for the stage of the processing and
    its completed share.
    """
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

    from bunraku.client.api import Client

    async def request() -> dict[str, Any]:
        columns = (
            TextColumn("{task.fields[name]}", markup=False),
            BarColumn(),
            TaskProgressColumn(),
            TextColumn("{task.description}", markup=False),
        )
        with Progress(*columns, console=err, disable=quiet or not err.is_terminal, transient=True) as progress:
            task = progress.add_task("sending", name=escape_text(file.name), total=1)

            def on_progress(stage: str, share: float) -> None:
                progress.update(task, description=escape_text(stage), completed=share)

            async with Client(server, token) as client:
                return await send(client, lambda sent, size: on_progress("sending", sent / size), on_progress)

    return run_request(request, server)


if __name__ == "__main__":
    sys.exit(app())
