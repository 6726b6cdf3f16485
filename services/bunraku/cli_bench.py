"""Commands that load-test a server: `bunraku bench`."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from bunraku.terminal import (
    DEFAULT_SERVER,
    JsonOption,
    ServerOption,
    TokenOption,
    err,
    print_statistics,
    resolve_stream_url,
    run_request,
)

bench = typer.Typer(help="Load-test a server.", no_args_is_help=True)


@bench.callback()
def _bench() -> None:
    """Load-test a server."""
    # without a callback, typer turns a group with a single command into that command


@bench.command("viewers")
def bench_viewers(
    viewers: Annotated[int, typer.Option("--n", help="Number of viewers.", min=1, max=100_000)] = 200,
    url: Annotated[
        str | None,
        typer.Option("--url", help="Id or address of a motion or session; default: the first session."),
    ] = None,
    seconds: Annotated[float, typer.Option(help="Duration.", min=0.1, max=86400)] = 20.0,
    joins: Annotated[float, typer.Option(help="Viewers that connect per second.", min=0.1, max=10_000)] = 200.0,
    server: ServerOption = DEFAULT_SERVER,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Connect many viewers at once and print their statistics."""
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

    from bunraku.client.api import Client
    from bunraku.client.load_generator import FileLimitExceeded, run_load

    async def request() -> dict[str, Any]:
        async with Client(server, token) as client:
            address = url or await client.first_session()
            if address is None:
                raise typer.BadParameter(f"no session is open at {server}; name a motion", param_hint="--url")
            stream = await resolve_stream_url(client, address)
        columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn())
        with Progress(*columns, console=err, disable=as_json or not err.is_terminal, transient=True) as progress:
            task = progress.add_task("joining", total=1)

            def on_progress(stage: str, share: float) -> None:
                progress.update(task, description=stage, completed=share)

            return (
                await run_load(stream, viewers, seconds, joins_per_second=joins, token=token, on_progress=on_progress)
            ).as_json()

    try:
        statistics = run_request(request, server)
    except FileLimitExceeded as error:
        err.print(f"Too many viewers for one process: {error}")
        raise typer.Exit(1) from None
    print_statistics(statistics, as_json)
    if statistics["joined"] == 0:
        raise typer.Exit(1)
