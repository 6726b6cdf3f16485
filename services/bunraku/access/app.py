"""Access service: tickets for WebSockets, and links for viewers. Every process runs it, because it has no state."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import FastAPI, Path, Query, Request, Response
from fastapi.responses import JSONResponse
from pydantic import BaseModel, ConfigDict, Field

from bunraku.http.access_control import Access, Role, access_of, requires
from bunraku.http.access_token import MAX_SHARE_LIFETIME_S
from bunraku.http.admission import network_of
from bunraku.http.problem_details import install_problem_handlers, motion_not_found, session_not_found
from bunraku.http.ticket_store import TICKET_LIFETIME_S, TooManyTickets
from bunraku.http.timestamp import format_timestamp
from bunraku.runtime.availability import BackendUnavailable
from bunraku.runtime.context import ServiceContext
from bunraku.runtime.problem import ProblemError
from bunraku.storage.record import Share, ShareScope

DEFAULT_SHARE_LIFETIME_S = 7 * 86_400
NO_STORE = {"Cache-Control": "no-store"}
"""Header of responses with tickets and links."""

ResourceId = Annotated[str | None, Field(max_length=64, pattern=r"^[A-Za-z0-9_-]+$")]


class NewShare(BaseModel):
    """Request for a link to one session or one motion."""

    model_config = ConfigDict(extra="forbid")
    session: ResourceId = None
    motion: ResourceId = None
    seconds: Annotated[
        int,
        Field(
            ge=60,
            le=MAX_SHARE_LIFETIME_S,
            description="lifetime of the link; without the role admin, it ends at the latest with the creating token",
        ),
    ] = DEFAULT_SHARE_LIFETIME_S


def create_app(context: ServiceContext) -> FastAPI:
    """Create the access service."""
    app = FastAPI(title="Bunraku access", openapi_url=None)
    install_problem_handlers(app)
    authenticator, catalogue = context.authenticator, context.catalogue

    @app.post("/v1/tickets", status_code=201, tags=["access"])
    @requires(Role.VIEW, allow_bound=True, rate_limited=True)
    async def ticket(request: Request) -> JSONResponse:
        """Create a ticket for the query parameter `ticket` of a WebSocket URL. It is valid once, for 30 seconds."""
        network = network_of(request)
        try:
            issued = authenticator.tickets.issue(access_of(request), network)
        except TooManyTickets:
            raise ProblemError(
                429,
                "Too many tickets",
                "your link or token has too many unused tickets",
                hint=f"open a WebSocket with each ticket, or try again in {TICKET_LIFETIME_S:g} seconds",
            ) from None
        return JSONResponse({"ticket": issued, "seconds": TICKET_LIFETIME_S}, 201, NO_STORE)

    @app.post("/v1/shares", status_code=201, tags=["access"])
    @requires(Role.CONTROL, allow_bound=True)
    async def share(new: NewShare, request: Request) -> JSONResponse:
        """Create a link for viewers of one session or one motion.

        Append `link` to the address of the page. `token` and `link` cannot be retrieved again. The link ends with the
        token that creates it at the latest, unless that has the role admin. A token that is bound to a session or
        motion creates links to that one only.
        """
        if (new.session is None) == (new.motion is None):
            raise ProblemError(422, "Invalid request", "give either a session or a motion", field="session")
        access = access_of(request)
        if new.session is not None and not (
            await authenticator.can_view(access, "session", new.session)
            and await authenticator.get_session_motion(new.session) is not None
        ):
            raise session_not_found(new.session)
        if new.motion is not None and not (
            await authenticator.can_view(access, "motion", new.motion)
            and await catalogue.get_motion(new.motion) is not None
        ):
            raise motion_not_found(new.motion)
        if new.motion is not None and access.is_bound and new.motion != access.motion:
            # a session's motion is visible to its guests only as long as it plays; the link might last longer
            raise ProblemError(
                403,
                "Not allowed",
                "your link is limited to one session, so it creates links to that session only",
                hint=f"create a link to session {access.session}",
            )
        created, token = await authenticator.create_share(access, new.session, new.motion, new.seconds)
        kind = "session" if created.session is not None else "motion"
        link = f"/?{kind}={created.session or created.motion}#share={token}"
        return JSONResponse(
            {**share_to_json(created), "token": token, "link": link},
            201,
            {"Location": f"/v1/shares/{created.id}", **NO_STORE},
        )

    @app.get("/v1/shares", tags=["access"])
    @requires(Role.CONTROL, allow_bound=True)
    async def page(
        request: Request, response: Response, limit: Annotated[int, Query(ge=1, le=200)] = 50
    ) -> dict[str, Any]:
        """List the newest links of the client; with the role admin, those of all clients.

        A client that is bound to a session or motion sees the links to that one only.
        """
        response.headers.update(NO_STORE)
        shares = await catalogue.list_shares(share_scope(access_of(request)), limit)
        return {"items": [share_to_json(one) for one in shares]}

    @app.delete("/v1/shares/{share}", status_code=204, tags=["access"])
    @requires(Role.CONTROL, allow_bound=True)
    async def revoke(share: Annotated[str, Path(pattern=r"^[0-9a-f]{18}$")], request: Request) -> None:
        """Revoke a link. Connections that were opened with it are closed.

        With 503 and 507 the link grants nothing any more, but its removal is not stored yet.
        """
        scope = share_scope(access_of(request))
        try:
            existing = await catalogue.get_share(share)
        except BackendUnavailable as error:
            raise authenticator.revocations.revoke_unverified(share, scope, error) from error
        if existing is None or not scope.includes(existing):
            raise ProblemError(404, "No such link", f"there is no link {share!r}")
        await authenticator.revocations.revoke(share)

    return app


def share_scope(access: Access) -> ShareScope:
    """Return the links that a client may list and revoke."""
    return ShareScope() if access.role is Role.ADMIN else ShareScope(access.subject, access.session, access.motion)


def share_to_json(share: Share) -> dict[str, Any]:
    """Return a link as the API represents it, without its token."""
    return {
        "id": share.id,
        "session": share.session,
        "motion": share.motion,
        "by": share.subject,
        "created": format_timestamp(share.created),
        "expires": format_timestamp(share.expires),
    }
