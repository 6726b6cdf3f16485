"""The access service: tickets for sockets, and links for viewers. Every process has it; it keeps nothing itself."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import FastAPI, Path, Query, Request
from fastapi.responses import JSONResponse
from pydantic import BaseModel, ConfigDict, Field

from bunraku.http import problem_details
from bunraku.http.access_control import Role, access_of, requires
from bunraku.http.not_found import motion_not_found, session_not_found
from bunraku.http.problem_details import ProblemError
from bunraku.http.ticket_store import TICKET_LIFETIME_S, TooManyTickets
from bunraku.http.timestamp import format_timestamp
from bunraku.runtime.context import ServiceContext
from bunraku.storage.record import Share

DEFAULT_SHARE_LIFETIME_S = 7 * 86_400
MAX_SHARE_LIFETIME_S = 31 * 86_400
"""Seconds that a link for viewers may last."""

ResourceId = Annotated[str | None, Field(max_length=64, pattern=r"^[A-Za-z0-9_-]+$")]


class NewShare(BaseModel):
    """What a link shows: one session, or one motion."""

    model_config = ConfigDict(extra="forbid")
    session: ResourceId = None
    motion: ResourceId = None
    seconds: Annotated[int, Field(ge=60, le=MAX_SHARE_LIFETIME_S, description="how long it is good")] = (
        DEFAULT_SHARE_LIFETIME_S
    )


def create_app(context: ServiceContext) -> FastAPI:
    """The service upon `backing`."""
    app = FastAPI(title="Bunraku access")
    problem_details.install_problem_handlers(app)
    gate, catalogue = context.authenticator, context.catalogue

    @app.post("/v1/tickets", status_code=201, tags=["access"])
    @requires(Role.VIEW, allow_bound=True, rate_limited=True)
    async def ticket(request: Request) -> JSONResponse:
        """A ticket, to be put into the query of a socket's URL as `ticket`: good once, for half a minute."""
        try:
            given = gate.tickets.issue(access_of(request))
        except TooManyTickets:
            raise ProblemError(
                429, "Too many tickets", "more sockets are about to open than this server takes"
            ) from None
        return JSONResponse({"ticket": given, "seconds": TICKET_LIFETIME_S}, 201, {"Cache-Control": "no-store"})

    @app.post("/v1/shares", status_code=201, tags=["access"])
    @requires(Role.CONTROL, allow_bound=True)
    async def share(new: NewShare, request: Request) -> JSONResponse:
        """A link for viewers of a session or a motion. `link` follows the page's address; it is told this once."""
        if (new.session is None) == (new.motion is None):
            raise ProblemError(422, "Invalid request", "a link is for one session or one motion", field="session")
        by = access_of(request)
        if new.session is not None and not (
            await gate.can_view(by, "session", new.session) and await gate.get_session_motion(new.session) is not None
        ):
            raise session_not_found(new.session)
        if new.motion is not None and not (
            await gate.can_view(by, "motion", new.motion) and await catalogue.get_motion(new.motion) is not None
        ):
            raise motion_not_found(new.motion)
        made, token = await gate.create_share(by, new.session, new.motion, new.seconds)
        kind = "session" if made.session is not None else "motion"
        told = {**share_to_json(made), "token": token, "link": f"/?{kind}={made.session or made.motion}#share={token}"}
        return JSONResponse(told, 201, {"Location": f"/v1/shares/{made.id}", "Cache-Control": "no-store"})

    @app.get("/v1/shares", tags=["access"])
    @requires(Role.CONTROL, allow_bound=True)
    async def page(request: Request, limit: Annotated[int, Query(ge=1, le=200)] = 50) -> dict[str, Any]:
        """The newest links that one has made, or, as admin, all."""
        by = access_of(request)
        shares = await catalogue.list_shares(None if by.role is Role.ADMIN else by.subject, limit)
        return {"items": [share_to_json(one) for one in shares]}

    @app.delete("/v1/shares/{share}", status_code=204, tags=["access"])
    @requires(Role.CONTROL, allow_bound=True)
    async def revoke(share: Annotated[str, Path(pattern=r"^[0-9a-f]{18}$")], request: Request) -> None:
        """Revoke a link: it is good no more, and what is open with it is ended."""
        by, found = access_of(request), await catalogue.get_share(share)
        if found is None or (by.role is not Role.ADMIN and found.subject != by.subject):
            raise ProblemError(404, "No such link", f"there is no link {share!r}")
        await gate.revoke_share(share)

    return app


def share_to_json(share: Share) -> dict[str, Any]:
    """A link as the API shows it; its token is told once alone."""
    return {
        "id": share.id,
        "session": share.session,
        "motion": share.motion,
        "by": share.subject,
        "created": format_timestamp(share.created),
        "expires": format_timestamp(share.expires),
    }
