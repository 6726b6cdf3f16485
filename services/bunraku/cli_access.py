"""The commands `bunraku token` and `bunraku share`: who may come in, and by which link (docs/safety.md)."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bunraku.terminal import HERE, Json, Server, Token, ask, err, kind_of, out, read_address, say

if TYPE_CHECKING:
    from bunraku.backing.settings import Settings

HOURS = 12.0
"""That a token is good for, if nothing else is said."""


def token(
    role: Annotated[str, typer.Option(help="What it allows: view, control, ingest or admin.")] = "admin",
    hours: Annotated[float, typer.Option(help="How long it is good.", min=0.01, max=168)] = HOURS,
    name: Annotated[str, typer.Option(help="Whose it is: quotas and the log go by it.")] = "operator",
    session: Annotated[str | None, typer.Option(help="Bind it to this session.")] = None,
    motion: Annotated[str | None, typer.Option(help="Bind it to this motion.")] = None,
    data: Annotated[Path | None, typer.Option(help="Folder with the server's own secret; default .bunraku.")] = None,
    server: Annotated[str | None, typer.Option(help="Print a link to the page of this server in its place.")] = None,
    as_json: Json = False,
) -> None:
    """Make a token with the server's secret: BUNRAKU_SECRET, or the one that it made for itself."""
    from bunraku.backing.access import Access, Role
    from bunraku.backing.instants import instant
    from bunraku.backing.secret import kept_secret
    from bunraku.backing.settings import Settings
    from bunraku.backing.tokens import Tokens

    try:
        settings = Settings() if data is None else Settings(data=data)
        secret = settings.secret.get_secret_value() or kept_secret(settings.data)
        if secret is None:
            err.print(
                f"There is no secret: set BUNRAKU_SECRET. A server that others reach makes one in {settings.data}."
            )
            raise typer.Exit(1)
        now = time.time()
        access = Access(Role.of(role), name[:64] or "operator", session, motion, int(now + hours * 3600))
        made = Tokens(secret).mint(access, now)
    except ValueError as error:
        err.print(wrong_setting(error), markup=False)
        raise typer.Exit(1) from None
    link = f"{server.rstrip('/')}/{f'?session={session}' if session else ''}#token={made}" if server else None
    if as_json:
        out.print_json(data={"token": made, "role": role, "expires": instant(access.expires or 0), "link": link})
    else:
        say(link or made)


def share(
    what: Annotated[str | None, typer.Argument(help="A session or motion: its id, its page, or its address.")] = None,
    days: Annotated[float, typer.Option(help="How long the link is good.", min=0.001, max=31)] = 7.0,
    revoke: Annotated[str | None, typer.Option(help="Revoke the link of this id.")] = None,
    server: Server = HERE,
    token: Token = None,
    as_json: Json = False,
) -> None:
    """Make a link by which others may watch, and nothing else; without an argument, list the links."""
    from bunraku.client.api import Client

    base, kind, identity = read_address(what) if what is not None else (None, None, "")
    at = base or server

    async def run() -> dict[str, Any]:
        async with Client(at, token) as client:
            if revoke is not None:
                await client.revoke_share(revoke)
                return {"revoked": revoke}
            if what is None:
                return {"items": await client.shares()}
            found = kind or await kind_of(client, identity)
            one = {found.removesuffix("s"): identity}
            made = await client.share(**one, seconds=max(round(days * 86_400), 60))
            return {**made, "link": f"{client.url}{made['link']}"}

    told = ask(run, at)
    if as_json:
        out.print_json(data=told)
    elif "items" in told:
        for one in told["items"]:
            shown = one["session"] or one["motion"]
            say(f"{one['id']}  {shown}  until {one['expires']}")
    else:
        say(f"Revoked {revoke}" if revoke is not None else told["link"])


def secure(settings: Settings, host: str) -> bool:
    """See to it that what others reach asks who they are: where `host`, or where it is published, is not this machine's
    alone and there is no secret, the server has its own. Whether that is so; raises `typer.Exit` where it cannot be."""
    from pydantic import SecretStr

    from bunraku.backing.secret import is_loopback, own_secret

    reached = settings.published or host
    if settings.secret.get_secret_value() or is_loopback(reached):
        return False
    if settings.bus != "memory:":
        err.print(f"Others reach {reached}: set BUNRAKU_SECRET, the same at all processes (docs/safety.md).")
        raise typer.Exit(1)
    try:
        settings.secret = SecretStr(own_secret(settings.data))
    except (ValueError, OSError) as error:
        err.print(str(error), markup=False)
        raise typer.Exit(1) from None
    return True


def operator_link(settings: Settings, url: str) -> str:
    """The link by which who runs the server at `url` comes in."""
    from bunraku.backing.access import Access, Role
    from bunraku.backing.tokens import Tokens

    now = time.time()
    access = Access(Role.ADMIN, "operator", expires=int(now + HOURS * 3600))
    return f"{url}#token={Tokens(settings.secret.get_secret_value()).mint(access, now)}"


def wrong_setting(error: ValueError) -> str:
    """What is wrong with a setting, without its value."""
    from pydantic import ValidationError

    if isinstance(error, ValidationError):
        return "; ".join(f"BUNRAKU_{'_'.join(map(str, e['loc'])).upper()}: {e['msg']}" for e in error.errors())
    return str(error)
