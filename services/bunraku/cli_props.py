"""Command that brings props on the stage of a session: `bunraku props`."""

from __future__ import annotations

from typing import Annotated, Any

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


def props(
    session: Annotated[str, typer.Argument(help="Id or address of a session.")],
    kinds: Annotated[list[str] | None, typer.Argument(help="Props to bring: fan, umbrella, ball or branch.")] = None,
    remove: Annotated[list[int] | None, typer.Option(help="Number of a prop to remove; may be repeated.")] = None,
    server: ServerOption = DEFAULT_SERVER,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Bring props on the stage of a session, remove some, and list them. Puppeteers put them into hands."""
    from bunraku.client.api import Client
    from bunraku.wire.prop import MAX_PROPS

    base, kind, session_id = parse_resource_address(session)
    if kind == "motions":
        raise typer.BadParameter("this is the address of a motion; give a session", param_hint="SESSION")

    async def request() -> dict[str, Any]:
        async with Client(base or server, token) as client:
            described = await client.session(session_id)
            edit: dict[str, str | None] = {str(number): None for number in remove or []}
            taken = {entry["prop"] for entry in described["props"]} - set(remove or [])
            free = [number for number in range(MAX_PROPS) if number not in taken]
            if len(kinds or []) > len(free):
                raise typer.BadParameter(
                    f"a session has at most {MAX_PROPS} props, and {len(taken)} stay; --remove some", param_hint="KINDS"
                )
            edit |= {str(number): kind for number, kind in zip(free, kinds or [], strict=False)}
            return await client.edit_session(session_id, props=edit) if edit else described

    described = run_request(request, base or server)
    if as_json:
        out.print_json(data=described)
        return
    for entry in described["props"]:
        print_plain(f"{entry['prop']}  {entry['kind']} {_describe_place(entry['limb'])}")
    if not described["props"]:
        print_plain("no props")


def _describe_place(limb: int | None) -> str:
    from bunraku.wire.limbs import LIMBS

    if limb is None:
        return "on the floor"
    performer, number = divmod(limb, len(LIMBS))
    return f"in the {LIMBS[number].replace('_', ' ')}" + (f" of performer {performer + 1}" if performer else "")
