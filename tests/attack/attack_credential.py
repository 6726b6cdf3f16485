"""Credentials used beyond what they grant: rows 15 and 17."""

from __future__ import annotations

import asyncio
import base64
import json
from typing import Any

from tests.attack.raw_socket import connect_websocket, fetch, fetch_json, handshake, open_socket
from tests.attack.registry import Report, Target, attack

UNAUTHORIZED, NOT_FOUND, FORBIDDEN = 4401, 4404, 4403


async def _share(target: Target, role: str, content: dict[str, Any]) -> dict[str, Any]:
    """Create a link and return it."""
    response = await fetch_json(target, "POST", "/v1/shares", content, token=target.tokens[role])
    assert response is not None, role
    assert response.status == 201, (role, response.body)
    created: dict[str, Any] = response.json()
    return created


@attack(15, "a bound token shows and changes nothing but its resource", quick=True)
async def bound_tokens_elsewhere(target: Target, report: Report) -> None:
    """Use a token and a link that are bound to a session with every other resource, also of the same subject."""
    control, bound = target.tokens["control"], target.tokens["bound control"]
    opened = await fetch_json(target, "POST", "/v1/sessions", {"motion": target.motion}, token=control)
    assert opened is not None
    other = opened.json()["id"]
    link = await _share(target, "control", {"session": other})
    guest = (await _share(target, "bound control", {"session": target.session}))["token"]
    visible = await fetch(target, "GET", "/v1/shares", token=bound)
    report.require(
        visible is not None and other not in visible.body.decode(), "a bound token lists links to other sessions"
    )
    requests = [
        ("GET", f"/v1/sessions/{other}", None),
        ("PATCH", f"/v1/sessions/{other}", {"playing": False}),
        ("DELETE", f"/v1/sessions/{other}", None),
        ("DELETE", f"/v1/sessions/{target.session}", None),
        ("PATCH", f"/v1/sessions/{target.session}", {"motion": target.motion}),
        ("POST", "/v1/sessions", {"motion": target.motion}),
        ("POST", "/v1/shares", {"session": other}),
        ("POST", "/v1/shares", {"motion": target.motion}),
        ("DELETE", f"/v1/shares/{link['id']}", None),
        ("DELETE", f"/v1/motions/{target.motion}", None),
        ("POST", f"/v1/sessions/{target.session}/recordings", {}),
        ("GET", "/v1/uploads/aaaaaaaaaa", None),
        ("POST", f"/v1/motions/{target.motion}/performers", {"motions": [target.motion]}),
    ]
    for name, token in (("token", bound), ("link", guest)):
        for method, path, content in requests:
            response = await fetch_json(target, method, path, content, token=token)
            status = response.status if response is not None else None
            report.count(str(status))
            what = f"{method} {path.replace(other, 'OTHER').replace(target.session, 'ID').replace(target.motion, 'ID')}"
            report.require(status in (403, 404), f"{what} with a bound {name}: {status}")
        for path in (f"/v1/sessions/{other}/stream", f"/v1/sessions/{other}/control", "/v1/motions/none/stream"):
            socket = await connect_websocket(target, path, token)
            code = await socket.read_close_code(5.0) if socket is not None else None
            report.count(f"close {code}")
            report.require(
                code in (NOT_FOUND, FORBIDDEN), f"{path.replace(other, 'OTHER')} with a bound {name}: {code}"
            )
            if socket is not None:
                socket.close()
    await fetch(target, "DELETE", f"/v1/shares/{link['id']}", token=control)
    await fetch(target, "DELETE", f"/v1/sessions/{other}", token=control)


@attack(17, "a ticket opens one socket, of what its token may see", quick=True)
async def tickets_used_again(target: Target, report: Report) -> None:
    """Use one ticket on ten sockets at once, one of a bound token elsewhere, and one of a revoked link."""

    async def get_ticket(token: str) -> str:
        response = await fetch(target, "POST", "/v1/tickets", token=token)
        assert response is not None
        ticket: str = response.json()["ticket"]
        return ticket

    async def use(path: str, ticket: str, number: int = 1) -> int | None:
        socket = await connect_websocket(target, f"{path}?ticket={ticket}", address=number)
        code = await socket.read_close_code(1.0) if socket is not None else None
        report.count(f"close {code}")
        if socket is not None:
            socket.close()
        return code

    ticket = await get_ticket(target.tokens["view"])
    codes = await asyncio.gather(*(use(target.stream, ticket, 1 + number) for number in range(10)))
    report.require(codes.count(UNAUTHORIZED) == 9, f"a ticket was used ten times: {codes}")
    bound = await get_ticket(target.tokens["bound control"])
    report.require(await use("/v1/motions/none/stream", bound) == NOT_FOUND, "the ticket of a bound token opens others")
    view = await get_ticket(target.tokens["view"])
    report.require(await use(target.control, view) == FORBIDDEN, "the ticket of role view controls")
    link = await _share(target, "control", {"session": target.session})
    left = await get_ticket(link["token"])
    await fetch(target, "DELETE", f"/v1/shares/{link['id']}", token=target.tokens["control"])
    report.require(await use(target.stream, left) == UNAUTHORIZED, "the ticket of a revoked link opens a stream")
    twice = f"{target.stream}?ticket={await get_ticket(target.tokens['view'])}&ticket={'0' * 48}"
    async with open_socket(target) as opened:
        await opened.send(handshake(target, twice, target.tokens["view"]))
        report.count(f"two tickets {await opened.describe_reaction()}")


@attack(17, "401 without a traceback", quick=True)
async def malformed_tokens(target: Target, report: Report) -> None:
    """Send tokens whose parts are nested, huge, empty or of the wrong type."""

    def encode(text: bytes) -> str:
        return base64.urlsafe_b64encode(text).rstrip(b"=").decode()

    header, payload, signature = target.tokens["view"].split(".")
    good = encode(json.dumps({"alg": "HS256", "typ": "JWT"}).encode())
    headers = [
        b"[" * 5_000,
        b"[" * 2_000 + b"]" * 2_000,
        b'{"alg":' * 700,
        b"{}",
        b"[]",
        b"null",
        b"9" * 5_000,
        b'"a"',
        b"\xff\xfe",
        b'{"alg":[]}',
        b'{"alg":{}}',
        b'{"alg":null}',
        b'{"alg":"none"}',
        b'{"alg":"HS256","crit":["exp"]}',
        b'{"alg":"HS256","b64":false}',
        b'{"alg":"HS256","kid":[]}',
        b'{"alg":"HS256","zip":"DEF"}',
        b'{"alg":"HS256","jku":"http://127.0.0.1:1/"}',
        b'{"alg":"HS256","typ":"\\ud800"}',
        b'{"alg":' + b"1" * 4_400 + b"}",
        b'{"alg":1e999}',
        b"\xef\xbb\xbf{}",
        b'{"enc":"A256GCM"}',
    ]
    tokens = [f"{encode(one)}.{payload}.{signature}" for one in headers]
    tokens += [f"{good}.{encode(one)}.{signature}" for one in headers]
    tokens += [
        ".",
        "..",
        "...",
        "a.b.c",
        "a" * 7_900,
        ".".join("a" * 3_900),
        f"{header}.{payload}",
        f"{header}.{payload}.",
        f" {header}",
        f"{header}.{payload}.{signature}A",
        f"{header}\0.{payload}.{signature}",
        f"{header}.{payload}.{signature}.a.b",
        f"{header}..{signature}",
        f"{header}.{payload}.{signature[:-1]}",
        "\xff" * 100,
        f"{header}. {payload}.{signature}",
        f"{header}.{payload}.{signature}\t{signature}",
        f"{header}+.{payload}/.{signature}",
    ]
    for number, token in enumerate(tokens):
        # a limit per address on failed tokens does not matter here
        response = await fetch(target, "GET", "/v1/motions", token=token, address=1 + number % 8)
        status = response.status if response is not None else None
        report.count(str(status))
        report.require(status in (400, 401, 431), f"token {number} {token[:40]!r}: {status}")
        socket = await connect_websocket(target, target.stream, token, address=1 + number % 8)
        code = await socket.read_close_code(5.0) if socket is not None else None
        report.require(code in (UNAUTHORIZED, None), f"socket with token {number} {token[:40]!r}: {code}")
        if socket is not None:
            socket.close()
