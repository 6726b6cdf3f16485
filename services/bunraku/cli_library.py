"""Commands for the motions of a server: `bunraku list`, `rename`, `tag`, `edit` and `reencode`."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bunraku.terminal import (
    DEFAULT_SERVER,
    JsonOption,
    MotionArgument,
    ServerOption,
    TokenOption,
    out,
    parse_motion_address,
    print_plain,
    run_request,
)

if TYPE_CHECKING:
    from bunraku.client.api import Client


def list_motions(
    search: Annotated[str, typer.Option(help="Only motions whose name has every word of this text.")] = "",
    tag: Annotated[str, typer.Option(help="Only motions with this tag.")] = "",
    server: ServerOption = DEFAULT_SERVER,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """List the motions of a server, newest first."""
    from rich.table import Table

    from bunraku.client.api import Client

    async def request() -> list[dict[str, Any]]:
        async with Client(server, token) as client:
            return await client.motions(search, tag)

    motions = run_request(request, server)
    if as_json:
        out.print_json(data=motions)
        return
    # a column that no motion needs would narrow the others
    has_tags = any(motion.get("tags") for motion in motions)
    columns = ["id", "name", "length", "fps", "rates, kbit/s", "tracks", *(["tags"] if has_tags else [])]
    table = Table(*columns, box=None, header_style="bold")
    for motion in motions:
        rates = " ".join(f"{rate['kbps']:.1f}" for rate in motion["rates"])
        length, tracks = f"{motion['duration']:.1f} s", " ".join(motion["tracks"])
        tags = [", ".join(motion.get("tags") or [])] if has_tags else []
        table.add_row(motion["id"], motion["name"], length, f"{motion['fps']:g}", rates, tracks, *tags)
    out.print(table)


def rename(
    motion: MotionArgument,
    name: Annotated[str, typer.Argument(help="New name.")],
    server: ServerOption = DEFAULT_SERVER,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Change the name of a motion."""
    renamed = _request(motion, server, token, lambda client, motion_id: client.update_motion(motion_id, name=name))
    if as_json:
        out.print_json(data=renamed)
        return
    print_plain(f"{renamed['id']}: {renamed['name']}")


def tag(
    motion: MotionArgument,
    tags: Annotated[
        list[str] | None, typer.Argument(help="Tags, in place of the present ones; none removes all.")
    ] = None,
    server: ServerOption = DEFAULT_SERVER,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Set the tags of a motion."""
    tagged = _request(motion, server, token, lambda client, motion_id: client.update_motion(motion_id, tags=tags or []))
    if as_json:
        out.print_json(data=tagged)
        return
    print_plain(f"{tagged['name']}: {', '.join(tagged['tags']) or 'no tags'}")


def edit(
    motion: MotionArgument,
    start: Annotated[float, typer.Option(help="Begin of the part, seconds.", min=0.0)] = 0.0,
    end: Annotated[
        float | None, typer.Option(help="End of the part, seconds; default: that of the motion.", min=0.0)
    ] = None,
    mirror: Annotated[bool, typer.Option("--mirror", help="Exchange left and right.")] = False,
    loop: Annotated[bool, typer.Option("--loop", help="Make the repetition seamless.")] = False,
    name: Annotated[str | None, typer.Option(help="Name; default: that of the motion and what was done.")] = None,
    server: ServerOption = DEFAULT_SERVER,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Create a motion from another one: a part of it, its mirror image, or a seamless loop."""
    created = _request(
        motion,
        server,
        token,
        lambda client, motion_id: client.edit_motion(
            motion_id, start=start, end=end, mirror=mirror, loop=loop, name=name
        ),
    )
    if as_json:
        out.print_json(data=created)
        return
    print_plain(f"{created['duration']:.2f} s, {created['name']}: {created['id']}")


def reencode(
    motions: Annotated[list[str] | None, typer.Argument(help="Ids or addresses of motions.")] = None,
    all_motions: Annotated[bool, typer.Option("--all", help="All motions of the server.")] = False,
    server: ServerOption = DEFAULT_SERVER,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Encode motions of an older release again, in place: their lower bitrate levels get smaller."""
    from bunraku.client.api import Client
    from bunraku.client.server_problem import ServerProblem

    if bool(motions) == all_motions:
        raise typer.BadParameter("give motions, or --all for every motion of the server")
    addresses = [parse_motion_address(motion) for motion in motions or []]
    bases = {base or server for base, _ in addresses} or {server}
    if len(bases) > 1:
        raise typer.BadParameter("give motions of one server at a time")
    (base,) = bases

    async def reencode_one(client: Client, before: dict[str, Any]) -> dict[str, Any]:
        result = {"id": before["id"], "name": before["name"], "before": before["rates"]}
        try:
            return result | {"after": (await client.reencode_motion(before["id"]))["rates"]}
        except ServerProblem as problem:
            return result | {"problem": str(problem)}

    async def request() -> list[dict[str, Any]]:
        results = []
        async with Client(base, token) as client:
            entries = [await client.motion(motion_id) for _, motion_id in addresses] or await client.motions()
            for number, before in enumerate(entries, 1):
                results.append(await reencode_one(client, before))
                if not as_json:
                    print_plain(f"{number} of {len(entries)}, {_describe_reencoding(results[-1])}")
        return results

    results = run_request(request, base)
    if as_json:
        out.print_json(data=results)
    if any("problem" in result for result in results):
        raise typer.Exit(1)


def _describe_reencoding(result: dict[str, Any]) -> str:
    if "problem" in result:
        return f"{result['name']}: {result['problem']}"
    before, after = (" ".join(f"{rate['kbps']:.2f}" for rate in result[key]) for key in ("before", "after"))
    return f"{result['name']}: {before} kbit/s" + (f" -> {after} kbit/s" if after != before else ", as before")


def _request(
    motion: str, server: str, token: str | None, call: Callable[[Client, str], Awaitable[dict[str, Any]]]
) -> dict[str, Any]:
    """Return the result of a call for a motion, given by its id or address."""
    from bunraku.client.api import Client

    base, motion_id = parse_motion_address(motion)

    async def request() -> dict[str, Any]:
        async with Client(base or server, token) as client:
            return await call(client, motion_id)

    return run_request(request, base or server)
