"""Commands `bunraku token` and `bunraku share`, and the access settings of `bunraku up` (docs/security.md)."""

from __future__ import annotations

import time
from datetime import datetime
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


def token(
    role: Annotated[str, typer.Option(help="Role of the holder: view, control, ingest or admin.")] = "admin",
    hours: Annotated[float, typer.Option(help="Lifetime.", min=0.01, max=168)] = DEFAULT_TOKEN_HOURS,
    name: Annotated[str, typer.Option(help="Name of the holder, used for quotas and in the log.")] = "operator",
    session: Annotated[str | None, typer.Option(help="Limit the token to this session.")] = None,
    motion: Annotated[str | None, typer.Option(help="Limit the token to this motion.")] = None,
    data: Annotated[Path | None, typer.Option(help="Data folder with the server's secret; default .bunraku.")] = None,
    server: Annotated[str | None, typer.Option(help="Print a link to the page of this server instead.")] = None,
    as_json: JsonOption = False,
) -> None:
    """Create a token, signed with BUNRAKU_SECRET or with the secret in the server's data folder."""
    from bunraku.http.access_control import Access, Role
    from bunraku.http.access_token import MAX_SUBJECT_CHARACTERS, TokenSigner
    from bunraku.http.secret import load_secret
    from bunraku.http.timestamp import format_timestamp
    from bunraku.runtime.display_text import clean_text
    from bunraku.runtime.settings import Settings

    try:
        settings = Settings() if data is None else Settings(data=data)
        secret = settings.secret.get_secret_value() or load_secret(settings.data)
        if secret is None:
            err.print(
                f"No secret found. Set BUNRAKU_SECRET, or start a server that is reachable from other machines: it "
                f"creates a secret in {settings.data}."
            )
            raise typer.Exit(1)
        now = time.time()
        subject = clean_text(name, MAX_SUBJECT_CHARACTERS) or "operator"
        access = Access(Role.parse(role), subject, session, motion, int(now + hours * 3600))
        signed = TokenSigner(secret).mint(access, now)
    except ValueError as error:
        err.print(describe_setting_error(error))
        raise typer.Exit(1) from None
    link = f"{server.rstrip('/')}/{f'?session={session}' if session else ''}#token={signed}" if server else None
    if as_json:
        out.print_json(
            data={"token": signed, "role": role, "expires": format_timestamp(access.expires or 0), "link": link}
        )
    else:
        print_plain(link or signed)


def share(
    what: Annotated[str | None, typer.Argument(help="Id or address of a motion or session.")] = None,
    days: Annotated[float, typer.Option(help="Lifetime of the link.", min=0.001, max=31)] = 7.0,
    revoke: Annotated[str | None, typer.Option(help="Revoke the link with this id.")] = None,
    server: ServerOption = DEFAULT_SERVER,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Create a link with which others can watch a motion or session. Without an argument, list the links."""
    from bunraku.client.api import Client

    base, kind, resource_id = parse_resource_address(what) if what is not None else (None, None, "")
    address, seconds = base or server, max(round(days * 86_400), 60)

    async def request() -> dict[str, Any]:
        async with Client(address, token) as client:
            if revoke is not None:
                await client.revoke_share(revoke)
                return {"revoked": revoke}
            if what is None:
                return {"items": await client.shares()}
            found_kind = kind or await find_resource_kind(client, resource_id)
            resource = {found_kind.removesuffix("s"): resource_id}
            created = await client.share(**resource, seconds=seconds)
            return {**created, "link": f"{client.url}{created['link']}"}

    result = run_request(request, address)
    if as_json:
        out.print_json(data=result)
    elif "items" in result:
        for one in result["items"]:
            print_plain(f"{one['id']}  {one['session'] or one['motion']}  until {one['expires']}")
    else:
        print_plain(f"Revoked {revoke}" if revoke is not None else result["link"])
        if "expires" in result and _lifetime_s(result) < seconds:
            err.print(f"The link ends with your token, at {result['expires']}.")


def _lifetime_s(share: dict[str, Any]) -> float:
    created, expires = (datetime.fromisoformat(share[name]) for name in ("created", "expires"))
    return (expires - created).total_seconds()


def ensure_secret(settings: Settings, host: str) -> bool:
    """Create a secret if the server is reachable from other machines and has none. Return whether it did.

    The server is reachable if `host`, or the address at which it is published, is not a loopback address. Raises
    `typer.Exit` if the server needs a secret that it cannot create.
    """
    from pydantic import SecretStr

    from bunraku.http.secret import is_loopback, load_or_create_secret

    reachable_host = settings.published or host
    if settings.secret.get_secret_value() or is_loopback(reachable_host):
        return False
    if settings.bus != "memory:":
        err.print(
            f"{reachable_host} is reachable from other machines: set BUNRAKU_SECRET to the same value for all "
            "processes (docs/security.md)."
        )
        raise typer.Exit(1)
    try:
        settings.secret = SecretStr(load_or_create_secret(settings.data))
    except (ValueError, OSError) as error:
        err.print(str(error))
        raise typer.Exit(1) from None
    return True


def make_operator_link(settings: Settings, url: str) -> str:
    """Return a link with the role admin for the operator of the server at `url`."""
    from bunraku.http.access_control import Access, Role
    from bunraku.http.access_token import TokenSigner

    now = time.time()
    access = Access(Role.ADMIN, "operator", expires=int(now + DEFAULT_TOKEN_HOURS * 3600))
    return f"{url}#token={TokenSigner(settings.secret.get_secret_value()).mint(access, now)}"


def describe_setting_error(error: ValueError) -> str:
    """Return a message about an invalid setting that does not contain its value."""
    from pydantic import ValidationError

    if isinstance(error, ValidationError):
        return "; ".join(f"BUNRAKU_{'_'.join(map(str, e['loc'])).upper()}: {e['msg']}" for e in error.errors())
    return str(error)
