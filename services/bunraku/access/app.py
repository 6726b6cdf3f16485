"""The access service: tickets for sockets, and links for viewers. Every process has it; it keeps nothing itself."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import FastAPI, Path, Query, Request
from fastapi.responses import JSONResponse
from pydantic import BaseModel, ConfigDict, Field

from bunraku.backing import problems
from bunraku.backing.access import Role, access_of, needs
from bunraku.backing.backing import Backing
from bunraku.backing.catalogue import Share
from bunraku.backing.instants import instant
from bunraku.backing.missing import no_such_motion, no_such_session
from bunraku.backing.problems import ProblemError
from bunraku.backing.tickets import LASTS, TooManyTickets

WEEK = 7 * 86_400
LONGEST = 31 * 86_400
"""Seconds that a link for viewers may last."""

Identity = Annotated[str | None, Field(max_length=64, pattern=r"^[A-Za-z0-9_-]+$")]


class NewShare(BaseModel):
    """What a link shows: one session, or one motion."""

    model_config = ConfigDict(extra="forbid")
    session: Identity = None
    motion: Identity = None
    seconds: Annotated[int, Field(ge=60, le=LONGEST, description="how long it is good")] = WEEK


def create_app(backing: Backing) -> FastAPI:
    """The service upon `backing`."""
    app = FastAPI(title="Bunraku access")
    problems.install(app)
    gate, catalogue = backing.gate, backing.catalogue

    @app.post("/v1/tickets", status_code=201, tags=["access"])
    @needs(Role.VIEW, all=True, counted=True)
    async def ticket(request: Request) -> JSONResponse:
        """A ticket, to be put into the query of a socket's URL as `ticket`: good once, for half a minute."""
        try:
            given = gate.tickets.give(access_of(request))
        except TooManyTickets:
            raise ProblemError(
                429, "Too many tickets", "more sockets are about to open than this server takes"
            ) from None
        return JSONResponse({"ticket": given, "seconds": LASTS}, 201, {"Cache-Control": "no-store"})

    @app.post("/v1/shares", status_code=201, tags=["access"])
    @needs(Role.CONTROL, all=True)
    async def share(new: NewShare, request: Request) -> JSONResponse:
        """A link for viewers of a session or a motion. `link` follows the page's address; it is told this once."""
        if (new.session is None) == (new.motion is None):
            raise ProblemError(422, "Invalid request", "a link is for one session or one motion", field="session")
        by = access_of(request)
        if new.session is not None and not (
            await gate.sees(by, "session", new.session) and await gate.on_show(new.session) is not None
        ):
            raise no_such_session(new.session)
        if new.motion is not None and not (
            await gate.sees(by, "motion", new.motion) and await catalogue.get(new.motion) is not None
        ):
            raise no_such_motion(new.motion)
        made, token = await gate.share(by, new.session, new.motion, new.seconds)
        kind = "session" if made.session is not None else "motion"
        told = {**share_json(made), "token": token, "link": f"/?{kind}={made.session or made.motion}#share={token}"}
        return JSONResponse(told, 201, {"Location": f"/v1/shares/{made.id}", "Cache-Control": "no-store"})

    @app.get("/v1/shares", tags=["access"])
    @needs(Role.CONTROL, all=True)
    async def page(request: Request, limit: Annotated[int, Query(ge=1, le=200)] = 50) -> dict[str, Any]:
        """The newest links that one has made, or, as admin, all."""
        by = access_of(request)
        shares = await catalogue.shares(None if by.role is Role.ADMIN else by.subject, limit)
        return {"items": [share_json(one) for one in shares]}

    @app.delete("/v1/shares/{share}", status_code=204, tags=["access"])
    @needs(Role.CONTROL, all=True)
    async def revoke(share: Annotated[str, Path(pattern=r"^[0-9a-f]{18}$")], request: Request) -> None:
        """Revoke a link: it is good no more, and what is open with it is ended."""
        by, found = access_of(request), await catalogue.share(share)
        if found is None or (by.role is not Role.ADMIN and found.subject != by.subject):
            raise ProblemError(404, "No such link", f"there is no link {share!r}")
        await gate.revoke(share)

    return app


def share_json(share: Share) -> dict[str, Any]:
    """A link as the API shows it; its token is told once alone."""
    return {
        "id": share.id,
        "session": share.session,
        "motion": share.motion,
        "by": share.subject,
        "created": instant(share.created),
        "expires": instant(share.expires),
    }
