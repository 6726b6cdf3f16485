"""Command that stores props, and brings them on the stage of a session: `bunraku props`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bunraku.terminal import (
    DEFAULT_SERVER,
    JsonOption,
    ServerOption,
    TokenOption,
    out,
    parse_resource_address,
    print_plain,
    run_request,
)

if TYPE_CHECKING:
    from bunraku.client.api import Client

FILE_SUFFIXES = (".glb", ".gltf", ".vrm")
"""Endings of the names of files from which props are made."""


def props(
    session: Annotated[
        str | None, typer.Argument(help="Id or address of a session; without one, the stored props are listed.")
    ] = None,
    kinds: Annotated[
        list[str] | None,
        typer.Argument(help="Props to bring: fan, umbrella, ball, branch, a GLB file, or the id of a stored prop."),
    ] = None,
    remove: Annotated[list[int] | None, typer.Option(help="Number of a prop to remove; may be repeated.")] = None,
    delete: Annotated[list[str] | None, typer.Option(help="Id of a stored prop to delete; may be repeated.")] = None,
    length: Annotated[float | None, typer.Option(help="Longest side of props from files, in metres.")] = None,
    grip: Annotated[str | None, typer.Option(help="Where props from files are held: origin, middle or bottom.")] = None,
    server: ServerOption = DEFAULT_SERVER,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Bring props on the stage of a session, remove some, and list them. Puppeteers put them into hands.

    Files are stored on the server, for all sessions. Without a session, the stored props are listed.
    """
    from bunraku.client.api import Client

    base, kind, session_id = parse_resource_address(session) if session is not None else (None, "", "")
    if kind == "motions":
        raise typer.BadParameter("this is the address of a motion; give a session", param_hint="SESSION")
    if session is not None and Path(session).suffix.lower() in FILE_SUFFIXES:
        raise typer.BadParameter("this is a file; give a session before it", param_hint="SESSION")
    files = [Path(each) for each in kinds or [] if Path(each).suffix.lower() in FILE_SUFFIXES]
    for path in files:
        if not path.is_file():
            raise typer.BadParameter(f"there is no file {path}", param_hint="KINDS")

    async def request() -> tuple[list[dict[str, Any]], list[dict[str, Any]], dict[str, Any]]:
        """Return the stored props, those that were stored now, and the session if there is one."""
        async with Client(base or server, token) as client:
            for prop in delete or []:
                await client.delete_prop(prop)
            if session is None:
                return await client.props(), [], {}
            described = await client.session(session_id)
            free = _find_free_numbers(described, remove or [], len(kinds or []))
            added = {path: await client.add_prop(path, length=length, grip=grip) for path in files}
            chosen = [added[Path(each)]["id"] if Path(each) in added else each for each in kinds or []]
            edit: dict[str, str | None] = {str(number): None for number in remove or []}
            edit |= {str(number): each for number, each in zip(free, chosen, strict=False)}
            if edit:
                described = await client.edit_session(session_id, props=edit)
            return await _list_stored(client, described), list(added.values()), described

    stored, added, described = run_request(request, base or server)
    if as_json:
        out.print_json(data=described if session is not None else stored)
        return
    if session is None:
        for prop in stored:
            size = " x ".join(f"{extent:.2f}" for extent in prop["size"])
            print_plain(f"{prop['id']}  {prop['name']}, {size} m, {prop['triangles']:,} triangles")
        if not stored:
            print_plain("no stored props")
        return
    for prop in added:
        for guess in prop["guessed"]:
            print_plain(f"{prop['name']}: {guess}")
    names = {prop["id"]: prop["name"] for prop in stored}
    for entry in described["props"]:
        name = names.get(entry["kind"], entry["kind"])
        print_plain(f"{entry['prop']}  {name} {_describe_place(entry['limb'])}")
    if not described["props"]:
        print_plain("no props")


def _find_free_numbers(described: dict[str, Any], removed: list[int], wanted: int) -> list[int]:
    """Return the numbers that new props of a session may have."""
    from bunraku.wire.prop import MAX_PROPS

    taken = {entry["prop"] for entry in described["props"]} - set(removed)
    free = [number for number in range(MAX_PROPS) if number not in taken]
    if wanted > len(free):
        raise typer.BadParameter(
            f"a session has at most {MAX_PROPS} props, and {len(taken)} stay; --remove some", param_hint="KINDS"
        )
    return free


async def _list_stored(client: Client, described: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the stored props, if the session has some."""
    from bunraku.wire.prop import is_stored_prop

    return await client.props() if any(is_stored_prop(entry["kind"]) for entry in described["props"]) else []


def _describe_place(limb: int | None) -> str:
    from bunraku.wire.limbs import LIMBS

    if limb is None:
        return "on the floor"
    performer, number = divmod(limb, len(LIMBS))
    return f"in the {LIMBS[number].replace('_', ' ')}" + (f" of performer {performer + 1}" if performer else "")
