"""The commands `bunraku token` and `bunraku share`: who may come in, and by which link (docs/safety.md)."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

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
    run_request,
)

if TYPE_CHECKING:
    from bunraku.runtime.settings import Settings

DEFAULT_TOKEN_HOURS = 12.0
"""That a token is good for, if nothing else is said."""


def token(
    role: Annotated[str, typer.Option(help="What it allows: view, control, ingest or admin.")] = "admin",
    hours: Annotated[float, typer.Option(help="How long it is good.", min=0.01, max=168)] = DEFAULT_TOKEN_HOURS,
    name: Annotated[str, typer.Option(help="Whose it is: quotas and the log go by it.")] = "operator",
    session: Annotated[str | None, typer.Option(help="Bind it to this session.")] = None,
    motion: Annotated[str | None, typer.Option(help="Bind it to this motion.")] = None,
    data: Annotated[Path | None, typer.Option(help="Folder with the server's own secret; default .bunraku.")] = None,
    server: Annotated[str | None, typer.Option(help="Print a link to the page of this server in its place.")] = None,
    as_json: JsonOption = False,
) -> None:
    """Make a token with the server's secret: BUNRAKU_SECRET, or the one that it made for itself."""
    from bunraku.http.access_control import Access, Role
    from bunraku.http.access_token import TokenSigner
    from bunraku.http.secret import load_secret
    from bunraku.http.timestamp import format_timestamp
    from bunraku.runtime.settings import Settings

    try:
        settings = Settings() if data is None else Settings(data=data)
        secret = settings.secret.get_secret_value() or load_secret(settings.data)
        if secret is None:
            err.print(
                f"There is no secret: set BUNRAKU_SECRET. A server that others reach makes one in {settings.data}."
            )
            raise typer.Exit(1)
        now = time.time()
        access = Access(Role.parse(role), name[:64] or "operator", session, motion, int(now + hours * 3600))
        made = TokenSigner(secret).mint(access, now)
    except ValueError as error:
        err.print(describe_setting_error(error), markup=False)
        raise typer.Exit(1) from None
    link = f"{server.rstrip('/')}/{f'?session={session}' if session else ''}#token={made}" if server else None
    if as_json:
        out.print_json(
            data={"token": made, "role": role, "expires": format_timestamp(access.expires or 0), "link": link}
        )
    else:
        print_plain(link or made)


def share(
    what: Annotated[str | None, typer.Argument(help="A session or motion: its id, its page, or its address.")] = None,
    days: Annotated[float, typer.Option(help="How long the link is good.", min=0.001, max=31)] = 7.0,
    revoke: Annotated[str | None, typer.Option(help="Revoke the link of this id.")] = None,
    server: ServerOption = DEFAULT_SERVER,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Make a link by which others may watch, and nothing else; without an argument, list the links."""
    from bunraku.client.api import Client

    base, kind, identity = parse_resource_address(what) if what is not None else (None, None, "")
    at = base or server

    async def run() -> dict[str, Any]:
        async with Client(at, token) as client:
            if revoke is not None:
                await client.revoke_share(revoke)
                return {"revoked": revoke}
            if what is None:
                return {"items": await client.shares()}
            found = kind or await find_resource_kind(client, identity)
            one = {found.removesuffix("s"): identity}
            made = await client.share(**one, seconds=max(round(days * 86_400), 60))
            return {**made, "link": f"{client.url}{made['link']}"}

    told = run_request(run, at)
    if as_json:
        out.print_json(data=told)
    elif "items" in told:
        for one in told["items"]:
            shown = one["session"] or one["motion"]
            print_plain(f"{one['id']}  {shown}  until {one['expires']}")
    else:
        print_plain(f"Revoked {revoke}" if revoke is not None else told["link"])


def ensure_secret(settings: Settings, host: str) -> bool:
    """See to it that what others reach asks who they are: where `host`, or where it is published, is not this machine's
    alone and there is no secret, the server has its own. Whether that is so; raises `typer.Exit` where it cannot be."""
    from pydantic import SecretStr

    from bunraku.http.secret import is_loopback, load_or_create_secret

    reached = settings.published or host
    if settings.secret.get_secret_value() or is_loopback(reached):
        return False
    if settings.bus != "memory:":
        err.print(f"Others reach {reached}: set BUNRAKU_SECRET, the same at all processes (docs/safety.md).")
        raise typer.Exit(1)
    try:
        settings.secret = SecretStr(load_or_create_secret(settings.data))
    except (ValueError, OSError) as error:
        err.print(str(error), markup=False)
        raise typer.Exit(1) from None
    return True


def make_operator_link(settings: Settings, url: str) -> str:
    """The link by which who runs the server at `url` comes in."""
    from bunraku.http.access_control import Access, Role
    from bunraku.http.access_token import TokenSigner

    now = time.time()
    access = Access(Role.ADMIN, "operator", expires=int(now + DEFAULT_TOKEN_HOURS * 3600))
    return f"{url}#token={TokenSigner(settings.secret.get_secret_value()).mint(access, now)}"


def describe_setting_error(error: ValueError) -> str:
    """What is wrong with a setting, without its value."""
    from pydantic import ValidationError

    if isinstance(error, ValidationError):
        return "; ".join(f"BUNRAKU_{'_'.join(map(str, e['loc'])).upper()}: {e['msg']}" for e in error.errors())
    return str(error)
