"""Access control of every route and WebSocket of a real server with a secret: all invalid tokens, and valid ones."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import httpx2
import pytest
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed
from websockets.typing import Subprotocol

from bunraku.client import Client
from bunraku.http.access_control import Role
from bunraku.wire.messages import SUBPROTOCOL, ChannelHeader, Ping, Pong, Problem, Welcome, unpack
from tests.credentials import OTHER_SECRET, SECRET, bearer_headers, make_token, make_unsigned_token, sign_token
from tests.servers import make_bvh_clip, run_server
from tests.time_limit import HANG_TIMEOUT_S

UNKNOWN_ID = "x" * 20
"""An id that does not exist."""

ROUTES: dict[tuple[str, str], Role | None] = {
    ("GET", "/livez"): None,
    ("GET", "/readyz"): None,
    ("GET", "/v1/health"): None,
    ("GET", "/v1/openapi.json"): None,
    ("GET", "/v1/docs"): None,
    ("GET", "/v1/motions"): Role.VIEW,
    ("GET", "/v1/motions/{motion}"): Role.VIEW,
    ("GET", "/v1/motions/{motion}/thumbnail"): Role.VIEW,
    ("GET", "/v1/motions/{motion}/description"): Role.VIEW,
    ("GET", "/v1/motions/{motion}/blocks/{rate}/{index}"): Role.VIEW,
    ("GET", "/v1/props"): Role.VIEW,
    ("GET", "/v1/props/{prop}"): Role.VIEW,
    ("GET", "/v1/props/{prop}/model"): Role.VIEW,
    ("GET", "/v1/sessions"): Role.VIEW,
    ("GET", "/v1/sessions/{session}"): Role.VIEW,
    ("GET", "/v1/arms/{proportions}/table"): Role.VIEW,
    ("GET", "/v1/arms/{proportions}/figures/{name}"): Role.VIEW,
    ("POST", "/v1/solve"): Role.VIEW,
    ("POST", "/v1/tickets"): Role.VIEW,
    ("POST", "/v1/sessions"): Role.CONTROL,
    ("PATCH", "/v1/sessions/{session}"): Role.CONTROL,
    ("DELETE", "/v1/sessions/{session}"): Role.CONTROL,
    ("POST", "/v1/shares"): Role.CONTROL,
    ("GET", "/v1/shares"): Role.CONTROL,
    ("DELETE", "/v1/shares/{share}"): Role.CONTROL,
    ("POST", "/v1/sessions/{session}/recordings"): Role.INGEST,
    ("POST", "/v1/motions"): Role.INGEST,
    ("POST", "/v1/motions/{motion}/audio"): Role.INGEST,
    ("POST", "/v1/motions/{motion}/scene"): Role.INGEST,
    ("POST", "/v1/motions/{motion}/performers"): Role.INGEST,
    ("POST", "/v1/motions/{motion}/edits"): Role.INGEST,
    ("POST", "/v1/motions/{motion}/encodings"): Role.INGEST,
    ("PATCH", "/v1/motions/{motion}"): Role.INGEST,
    ("POST", "/v1/performers"): Role.INGEST,
    ("GET", "/v1/performers/{performer}"): Role.INGEST,
    ("DELETE", "/v1/performers/{performer}"): Role.INGEST,
    ("GET", "/v1/uploads/{upload}"): Role.INGEST,
    ("DELETE", "/v1/motions/{motion}"): Role.INGEST,
    ("POST", "/v1/props"): Role.INGEST,
    ("DELETE", "/v1/props/{prop}"): Role.INGEST,
}
INPUT = "/v1/performers/{performer}/input"
WEBSOCKETS: dict[str, Role] = {
    "/v1/motions/{motion}/stream": Role.VIEW,
    "/v1/sessions/{session}/stream": Role.VIEW,
    "/v1/sessions/{session}/control": Role.CONTROL,
    INPUT: Role.INGEST,
}
INVALID_TOKENS: dict[str, Callable[[], str | None]] = {
    "none": lambda: None,
    "malformed": lambda: "not.a.token",
    "empty": lambda: ".",
    "expired": lambda: sign_token(exp=int(time.time()) - 1),
    "wrong audience": lambda: sign_token(aud="elsewhere"),
    "wrong issuer": lambda: sign_token(iss="elsewhere"),
    "wrong signature": lambda: sign_token(OTHER_SECRET),
    "alg none": make_unsigned_token,
    "other algorithm": lambda: sign_token(algorithm="HS512"),
    "no expiry": lambda: sign_token(exp=None),
    "expiry of text": lambda: sign_token(exp="2999"),
    "unknown role": lambda: sign_token(role="owner"),
    "no role": lambda: sign_token(role=None),
    "admin bound to a session": lambda: sign_token(session="s"),
    "too long": lambda: sign_token(more="x" * 3_000),
}


def body_without_request_id(response: httpx2.Response) -> str:
    """Return the body of a response without its request id."""
    return response.text.replace(response.headers["x-request-id"], "")


@dataclass
class GuardedServer:
    """A server with a secret, a motion, a session of it, and a link that was revoked."""

    url: str
    motion: str
    session: str
    revoked: str

    def fill_path(self, path: str) -> str:
        """Return `path` with its parameters replaced by existing ids."""
        parameters = {
            "motion": self.motion,
            "session": self.session,
            "rate": "0",
            "index": "0",
            "proportions": "393-351-256-560-320-120",
            "name": "circle",
            "upload": "unknown-upload",
            "prop": "unknown-prop",
            "share": "0" * 18,
            "performer": f"{self.session}-0000000000",
        }
        return path.format(**parameters)


@pytest.fixture(scope="module")
def guarded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[GuardedServer]:
    with run_server(tmp_path_factory.mktemp("guarded"), secret=SECRET, connects=0) as url:
        with httpx2.Client(
            base_url=url, headers=bearer_headers(make_token(subject="host")), timeout=HANG_TIMEOUT_S
        ) as http:
            motion = http.post("/v1/motions?filename=a.bvh", content=make_bvh_clip(2.0, 5)).json()["id"]
            session = http.post("/v1/sessions", json={"motion": motion}).json()["id"]
            share = http.post("/v1/shares", json={"session": session}).json()
            assert http.get("/v1/sessions", headers=bearer_headers(share["token"])).status_code == 200
            assert http.delete(f"/v1/shares/{share['id']}").status_code == 204
        yield GuardedServer(url, motion, session, share["token"])


def test_openapi_lists_every_route_with_its_role(guarded: GuardedServer) -> None:
    described = httpx2.get(f"{guarded.url}/v1/openapi.json").json()
    listed = {(method.upper(), path) for path, methods in described["paths"].items() for method in methods}
    assert listed == {key for key in ROUTES if key[1] not in ("/v1/openapi.json", "/v1/docs")}
    roles = {
        (method.upper(), path): operation.get("x-role")
        for path, methods in described["paths"].items()
        for method, operation in methods.items()
    }
    required_roles = {key: ROUTES[key] for key in listed}
    assert roles == {key: None if role is None else role.label for key, role in required_roles.items()}


@pytest.mark.parametrize("bad", [*INVALID_TOKENS, "revoked"])
def test_invalid_token_is_rejected_on_every_route(guarded: GuardedServer, bad: str) -> None:
    token = guarded.revoked if bad == "revoked" else INVALID_TOKENS[bad]()
    with httpx2.Client(base_url=guarded.url, headers=bearer_headers(token)) as http:
        for (method, path), role in ROUTES.items():
            response = http.request(method, guarded.fill_path(path))
            if role is None:
                assert response.status_code == 200, path
                continue
            assert response.status_code == 401, (method, path)
            assert response.headers["www-authenticate"].startswith("Bearer realm=")
            assert response.headers["content-type"] == "application/problem+json"
            # the response does not reveal whether the resource exists
            other = http.request(
                method, guarded.fill_path(path).replace(guarded.motion, UNKNOWN_ID).replace(guarded.session, UNKNOWN_ID)
            )
            assert (other.status_code, body_without_request_id(other)) == (401, body_without_request_id(response))
            title = {"none": "A link is needed", "expired": "Link expired", "revoked": "Link revoked"}
            assert response.json()["title"] == title.get(bad, "Link not valid")


@pytest.mark.parametrize("role", Role)
def test_role_grants_exactly_the_listed_routes(guarded: GuardedServer, role: Role) -> None:
    with httpx2.Client(base_url=guarded.url, headers=bearer_headers(make_token(role)), timeout=HANG_TIMEOUT_S) as http:
        for (method, path), required_role in ROUTES.items():
            if (method == "DELETE" or path.endswith("/encodings")) and role >= (required_role or Role.VIEW):
                continue  # those of others are refused: they have their own tests
            response = http.request(method, guarded.fill_path(path))
            if required_role is None or role >= required_role:
                assert response.status_code not in (401, 403), (method, path, response.text)
                assert response.status_code < 500
            else:
                assert response.status_code == 403, (method, path)
                assert response.json()["needed"] == required_role.label
                assert f'scope="{required_role.label}"' in response.headers["www-authenticate"]
                other = http.request(method, guarded.fill_path(path).replace(guarded.motion, UNKNOWN_ID))
                assert (other.status_code, body_without_request_id(other)) == (403, body_without_request_id(response))


@pytest.mark.parametrize(("role", "status"), [(Role.INGEST, 403), (Role.ADMIN, 200)])
def test_motion_of_another_subject_is_encoded_again_by_admins_only(
    guarded: GuardedServer, role: Role, status: int
) -> None:
    with httpx2.Client(base_url=guarded.url, headers=bearer_headers(make_token(role)), timeout=HANG_TIMEOUT_S) as http:
        assert http.post(f"/v1/motions/{guarded.motion}/encodings").status_code == status


async def read_until_closed(socket: ClientConnection) -> None:
    """Read until the server closes the connection."""
    async with asyncio.timeout(HANG_TIMEOUT_S):
        while True:
            await socket.recv()


async def first_message(url: str, request_headers: dict[str, str]) -> tuple[object, int | None]:
    """Return the first message of a connection, and its close code if that message was a `Problem`."""
    async with connect(
        url, subprotocols=[Subprotocol(SUBPROTOCOL)], compression=None, additional_headers=request_headers
    ) as socket:
        data = await socket.recv()
        assert isinstance(data, bytes)
        message = unpack(data)
        if not isinstance(message, Problem):
            return message, None
        try:
            await socket.recv()
        except ConnectionClosed as closed:
            return message, closed.rcvd.code if closed.rcvd else None
        raise AssertionError("the connection stayed open after a Problem")


@pytest.mark.parametrize("bad", [*INVALID_TOKENS, "revoked"])
async def test_invalid_token_closes_every_websocket_with_4401(guarded: GuardedServer, bad: str) -> None:
    token = guarded.revoked if bad == "revoked" else INVALID_TOKENS[bad]()
    for path in WEBSOCKETS:
        address = guarded.url.replace("http", "ws") + guarded.fill_path(path)
        existing = await first_message(address, bearer_headers(token))
        assert isinstance(existing[0], Problem)
        assert existing[1] == 4401
        missing = await first_message(
            address.replace(guarded.motion, UNKNOWN_ID).replace(guarded.session, UNKNOWN_ID), bearer_headers(token)
        )
        assert missing == existing


@pytest.mark.parametrize("role", Role)
async def test_websocket_accepts_token_or_single_use_ticket_by_role(guarded: GuardedServer, role: Role) -> None:
    async with httpx2.AsyncClient(base_url=guarded.url, headers=bearer_headers(make_token(role))) as http:
        for path, required_role in WEBSOCKETS.items():
            if path == INPUT:
                continue
            address = guarded.url.replace("http", "ws") + guarded.fill_path(path)
            ticket = (await http.post("/v1/tickets")).json()["ticket"]
            assert len(ticket) < 64
            by_token = await first_message(address, bearer_headers(make_token(role)))
            by_ticket = await first_message(f"{address}?ticket={ticket}", {})
            if role >= required_role:
                for message, _ in (by_token, by_ticket):
                    assert isinstance(message, ChannelHeader | Welcome)
                again = await first_message(f"{address}?ticket={ticket}", {})
                assert again[1] == 4401
            else:
                assert by_token[1] == by_ticket[1] == 4403


async def test_missing_subprotocol_closes_with_4406(guarded: GuardedServer) -> None:
    for path in WEBSOCKETS:
        if path == INPUT:
            continue
        async with connect(guarded.url.replace("http", "ws") + guarded.fill_path(path)) as socket:
            with pytest.raises(ConnectionClosed) as closed:
                await read_until_closed(socket)
        assert closed.value.rcvd is not None
        assert closed.value.rcvd.code == 4406


@pytest.mark.parametrize("role", Role)
async def test_input_socket_accepts_those_who_brought_the_performer(guarded: GuardedServer, role: Role) -> None:
    async with Client(guarded.url, token=make_token(Role.INGEST, "aiko")) as aiko, aiko.perform() as performer:
        path = performer.description["input"]
        address = guarded.url.replace("http", "ws") + path
        async with httpx2.AsyncClient(
            base_url=guarded.url, headers=bearer_headers(make_token(role, "aiko")), timeout=HANG_TIMEOUT_S
        ) as http:
            ticket = (await http.post("/v1/tickets")).json()["ticket"]
            for query, headers in (("", bearer_headers(make_token(role, "aiko"))), (f"?ticket={ticket}", {})):
                async with connect(address + query, subprotocols=[SUBPROTOCOL], additional_headers=headers) as socket:  # type: ignore[list-item]
                    if role >= Role.INGEST:
                        await socket.send(Ping(1, 2).pack())
                        assert isinstance(unpack(await socket.recv(decode=False)), Pong)
                        continue
                    with pytest.raises(ConnectionClosed) as closed:
                        await read_until_closed(socket)
                    assert closed.value.rcvd is not None
                    assert closed.value.rcvd.code == 4403
            async with connect(address, additional_headers=bearer_headers(make_token(Role.INGEST, "aiko"))) as plain:
                with pytest.raises(ConnectionClosed) as closed:
                    await read_until_closed(plain)
                assert closed.value.rcvd is not None
                assert closed.value.rcvd.code == 4406
        # another subject sees the performer on the stage, but cannot move or end it
        yuki = bearer_headers(make_token(Role.INGEST, "yuki"))
        async with httpx2.AsyncClient(base_url=guarded.url, headers=yuki, timeout=HANG_TIMEOUT_S) as http:
            for method in ("GET", "DELETE"):
                assert (await http.request(method, path.removesuffix("/input"))).status_code == 403
        async with connect(address, subprotocols=[SUBPROTOCOL], additional_headers=yuki) as socket:  # type: ignore[list-item]
            with pytest.raises(ConnectionClosed) as closed:
                await read_until_closed(socket)
            assert closed.value.rcvd is not None
            assert closed.value.rcvd.code == 4403


async def test_bound_token_sees_nothing_but_its_resource(guarded: GuardedServer) -> None:
    async with httpx2.AsyncClient(
        base_url=guarded.url, headers=bearer_headers(make_token()), timeout=HANG_TIMEOUT_S
    ) as host:
        other = (await host.post("/v1/motions?filename=b.bvh", content=make_bvh_clip(1.0, 6))).json()["id"]
        other_session = (await host.post("/v1/sessions", json={"motion": other})).json()["id"]
        for bound, bound_id in (("session", guarded.session), ("motion", guarded.motion)):
            guest = make_token(
                Role.CONTROL,
                session=bound_id if bound == "session" else None,
                motion=bound_id if bound == "motion" else None,
            )
            async with httpx2.AsyncClient(base_url=guarded.url, headers=bearer_headers(guest)) as http:
                motions = (await http.get("/v1/motions")).json()["items"]
                assert [one["id"] for one in motions] == [guarded.motion]
                sessions = (await http.get("/v1/sessions")).json()["items"]
                assert [one["id"] for one in sessions] == ([guarded.session] if bound == "session" else [])
                assert (await http.get(f"/v1/motions/{guarded.motion}")).status_code == 200
                existing = (await http.get(f"/v1/sessions/{guarded.session}")).status_code
                assert existing == (200 if bound == "session" else 404)
                for path, hidden in (
                    ("/v1/motions/{}", other),
                    ("/v1/motions/{}/description", other),
                    ("/v1/motions/{}/blocks/0/0", other),
                    ("/v1/sessions/{}", other_session),
                ):
                    seen, missing = await http.get(path.format(hidden)), await http.get(path.format(UNKNOWN_ID))
                    assert seen.status_code == missing.status_code == 404
                    assert body_without_request_id(seen).replace(hidden, UNKNOWN_ID) == body_without_request_id(missing)
                for body in ({"session": other_session}, {"motion": other}):
                    ((name, hidden),) = body.items()
                    seen, missing = [await http.post("/v1/shares", json={name: one}) for one in (hidden, UNKNOWN_ID)]
                    assert seen.status_code == missing.status_code == 404
                    assert body_without_request_id(seen).replace(hidden, UNKNOWN_ID) == body_without_request_id(missing)
                # a guest may not open or change a session
                assert (await http.post("/v1/sessions", json={"motion": guarded.motion})).status_code == 403
                edited = [
                    await http.patch(f"/v1/sessions/{guarded.session}", json={"motion": m}) for m in (other, UNKNOWN_ID)
                ]
                assert body_without_request_id(edited[0]) == body_without_request_id(edited[1])
                assert edited[0].status_code == (403 if bound == "session" else 404)
            for path, hidden in (("motions", other), ("sessions", other_session)):
                address = guarded.url.replace("http", "ws") + f"/v1/{path}/{{}}/stream"
                seen_there = await first_message(address.format(hidden), bearer_headers(guest))
                seen_not = await first_message(address.format(UNKNOWN_ID), bearer_headers(guest))
                assert seen_there[1] == seen_not[1] == 4404
                assert str(seen_there[0]).replace(hidden, UNKNOWN_ID) == str(seen_not[0])


def test_motion_is_changed_and_deleted_by_its_owner_or_an_admin(guarded: GuardedServer) -> None:
    with httpx2.Client(base_url=guarded.url, timeout=HANG_TIMEOUT_S) as http:
        mine, theirs = (bearer_headers(make_token(Role.INGEST, name)) for name in ("aiko", "ben"))
        made = http.post("/v1/motions?filename=c.bvh", content=make_bvh_clip(1.0, 7), headers=mine).json()["id"]
        assert http.patch(f"/v1/motions/{made}", json={"name": "mine"}, headers=mine).json()["name"] == "mine"
        refused = http.patch(f"/v1/motions/{made}", json={"name": "theirs"}, headers=theirs)
        assert (refused.status_code, refused.json()["needed"]) == (403, "admin")
        admin = bearer_headers(make_token())
        assert http.patch(f"/v1/motions/{made}", json={"tags": ["seen"]}, headers=admin).json()["name"] == "mine"
        assert http.get("/v1/motions?search=mine&tag=seen", headers=theirs).json()["items"][0]["id"] == made
        assert http.delete(f"/v1/motions/{made}", headers=theirs).status_code == 403
        assert http.delete(f"/v1/motions/{made}", headers=mine).status_code == 204
        again = http.post("/v1/motions?filename=c.bvh", content=make_bvh_clip(1.0, 7), headers=mine).json()["id"]
        assert http.delete(f"/v1/motions/{again}", headers=bearer_headers(make_token())).status_code == 204


def test_share_link_is_managed_by_its_creator_or_an_admin(guarded: GuardedServer) -> None:
    with httpx2.Client(base_url=guarded.url) as http:
        mine, theirs = (bearer_headers(make_token(Role.CONTROL, name)) for name in ("aiko", "ben"))
        share = http.post("/v1/shares", json={"session": guarded.session, "seconds": 60}, headers=mine).json()
        assert "token" not in http.get("/v1/shares", headers=mine).text
        assert [one["id"] for one in http.get("/v1/shares", headers=mine).json()["items"]] == [share["id"]]
        assert http.get("/v1/shares", headers=theirs).json()["items"] == []
        assert share["id"] in http.get("/v1/shares", headers=bearer_headers(make_token())).text
        hidden = http.delete(f"/v1/shares/{share['id']}", headers=theirs)
        missing = http.delete(f"/v1/shares/{'0' * 18}", headers=theirs)
        assert hidden.status_code == missing.status_code == 404
        assert body_without_request_id(hidden).replace(share["id"], "0" * 18) == body_without_request_id(missing)
        viewer = bearer_headers(share["token"])
        assert http.get(f"/v1/sessions/{guarded.session}", headers=viewer).status_code == 200
        assert http.patch(f"/v1/sessions/{guarded.session}", json={"playing": False}, headers=viewer).status_code == 403
        assert http.delete(f"/v1/shares/{share['id']}", headers=mine).status_code == 204
        assert http.get(f"/v1/sessions/{guarded.session}", headers=viewer).json()["title"] == "Link revoked"


async def test_revoking_a_link_closes_its_connections(guarded: GuardedServer) -> None:
    async with httpx2.AsyncClient(base_url=guarded.url, headers=bearer_headers(make_token())) as http:
        share = (await http.post("/v1/shares", json={"session": guarded.session})).json()
        ticket = (await http.post("/v1/tickets", headers=bearer_headers(share["token"]))).json()["ticket"]
        unused = (await http.post("/v1/tickets", headers=bearer_headers(share["token"]))).json()["ticket"]
        address = guarded.url.replace("http", "ws") + f"/v1/sessions/{guarded.session}/stream"
        async with connect(f"{address}?ticket={ticket}", subprotocols=[Subprotocol(SUBPROTOCOL)]) as socket:
            await socket.recv()
            assert (await http.delete(f"/v1/shares/{share['id']}")).status_code == 204
            with pytest.raises(ConnectionClosed) as closed:
                await read_until_closed(socket)
            assert closed.value.rcvd is not None
            assert (closed.value.rcvd.code, closed.value.rcvd.reason[:12]) == (4401, "Link revoked")
        # a ticket issued before the revocation is invalid
        assert (await first_message(f"{address}?ticket={unused}", {}))[1] == 4401


async def test_websocket_closes_when_its_token_expires(guarded: GuardedServer) -> None:
    token = bearer_headers(make_token(Role.CONTROL, lifetime_s=5))

    async def watch_until_closed(address: str, headers: dict[str, str]) -> int:
        async with connect(address, subprotocols=[Subprotocol(SUBPROTOCOL)], additional_headers=headers) as socket:
            with pytest.raises(ConnectionClosed) as closed:
                await read_until_closed(socket)
            assert closed.value.rcvd is not None
            return closed.value.rcvd.code

    connections = []
    async with httpx2.AsyncClient(base_url=guarded.url, headers=token) as http:
        for path in ("stream", "control"):
            address = guarded.url.replace("http", "ws") + f"/v1/sessions/{guarded.session}/{path}"
            ticket = (await http.post("/v1/tickets")).json()["ticket"]
            connections += [watch_until_closed(address, token), watch_until_closed(f"{address}?ticket={ticket}", {})]
    assert await asyncio.gather(*connections) == [4401] * 4


@pytest.mark.parametrize("role_or_token", [Role.ADMIN, Role.VIEW, None, "malformed"])
def test_no_response_of_a_protected_route_is_cached_by_proxies(
    guarded: GuardedServer, role_or_token: Role | str | None
) -> None:
    token = make_token(role_or_token) if isinstance(role_or_token, Role) else role_or_token
    with httpx2.Client(base_url=guarded.url, headers=bearer_headers(token), timeout=HANG_TIMEOUT_S) as http:
        for (method, path), role in ROUTES.items():
            if role is None or method == "DELETE":
                continue
            for used_method in (method, "HEAD", "PUT"):
                for ids in (guarded.fill_path(path), guarded.fill_path(path).replace(guarded.motion, UNKNOWN_ID)):
                    headers = http.request(used_method, ids).headers
                    directives = headers["cache-control"].split(", ")
                    assert "public" not in directives
                    assert "no-store" in directives or (
                        "private" in directives and "Authorization" in headers["vary"]
                    ), (used_method, ids, headers)


def test_immutable_resources_stay_in_private_caches(guarded: GuardedServer) -> None:
    with httpx2.Client(base_url=guarded.url, headers=bearer_headers(make_token())) as http:
        for path in (f"/v1/motions/{guarded.motion}/blocks/0/0", "/v1/arms/393-351-256-560-320-120/table"):
            assert http.get(path).headers["cache-control"] == "private, max-age=31536000, immutable"
        etag = http.get(path).headers["etag"]
        unchanged = http.get(path, headers={"If-None-Match": etag})
        assert (unchanged.status_code, unchanged.headers["vary"]) == (304, "Authorization")
        assert unchanged.headers["cache-control"] == "private, max-age=31536000, immutable"
        for path in ("/v1/shares", "/v1/uploads/unknown-upload"):
            assert http.get(path).headers["cache-control"] == "no-store"
        for path in ("/v1/motions", "/v1/sessions", f"/v1/motions/{guarded.motion}"):
            assert http.get(path).headers["cache-control"] == "private, no-cache"


def test_server_without_secret_allows_every_request(tmp_path: Path) -> None:
    with run_server(tmp_path) as url, httpx2.Client(base_url=url, headers=bearer_headers("whatever")) as http:
        assert http.post("/v1/motions?filename=a.bvh", content=make_bvh_clip(1.0, 8)).status_code == 201
        assert http.post("/v1/tickets").status_code == 201
        assert http.post("/v1/shares", json={"motion": "a"}).status_code == 404
