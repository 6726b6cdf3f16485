"""Command that opens limbs of a session to its audience: `bunraku crowd`."""

from __future__ import annotations

from typing import Annotated, Any, Literal

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

CrowdPolicyName = Literal["median", "trimmed mean", "turns", "vote"]


def crowd(
    session: Annotated[str, typer.Argument(help="Id or address of a session.")],
    limbs: Annotated[list[str], typer.Argument(help="left_hand, right_hand, left_leg, right_leg, or numbers.")],
    policy: Annotated[
        CrowdPolicyName, typer.Option(help="How the pulls of all viewers become one target.")
    ] = "trimmed mean",
    close: Annotated[bool, typer.Option("--close", help="Close the limbs instead.")] = False,
    server: ServerOption = DEFAULT_SERVER,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Open limbs of a session to all its viewers, who then move them together."""
    from bunraku.client.api import Client

    base, kind, session_id = parse_resource_address(session)
    if kind == "motions":
        raise typer.BadParameter("this is the address of a motion; give a session", param_hint="SESSION")

    async def request() -> dict[str, Any]:
        async with Client(base or server, token) as client:
            return await client.edit_session(session_id, crowd=dict.fromkeys(limbs, None if close else policy))

    edited = run_request(request, base or server)
    if as_json:
        out.print_json(data=edited)
        return
    print_plain(f"{', '.join(limbs)}: {'closed' if close else f'open to all viewers, {policy}'}")
