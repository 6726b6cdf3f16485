"""HTTP requests that break RFC 9112 or stretch it, and slow ones: rows 3 and 19."""

from __future__ import annotations

import asyncio
import time

from tests.attack.raw_socket import (
    ANSWER_TIMEOUT_S,
    CLOSED,
    OPEN,
    RawSocket,
    connect_websocket,
    handshake,
    open_socket,
    request,
)
from tests.attack.registry import Report, Target, attack

HEADER_TIMEOUT_S = 12.0
"""The server's time limit for request headers, with a margin."""
CONNECTIONS_BEYOND_LIMITS = 2_000
"""More connections than two replicas together permit an address."""
REFUSED = "400 or closed within the header timeout"


@attack(3, REFUSED, seconds=HEADER_TIMEOUT_S + 2)
async def upgrades_that_are_never_answered(target: Target, report: Report) -> None:
    """Send upgrade requests with a body, with too many or too large headers, or otherwise unusual, and wait."""
    plain = handshake(target, target.stream)
    path = target.stream.encode()
    variants = {
        "Content-Length": handshake(target, target.stream, None, "Content-Length: 5"),
        "Content-Length and body": handshake(target, target.stream, None, "Content-Length: 5") + b"hello",
        "Content-Length: 0": handshake(target, target.stream, None, "Content-Length: 0"),
        "Transfer-Encoding": handshake(target, target.stream, None, "Transfer-Encoding: chunked"),
        "Transfer-Encoding and body": handshake(target, target.stream, None, "Transfer-Encoding: chunked")
        + b"0\r\n\r\n",
        "129 headers": handshake(target, target.stream, None, *["a: b"] * 129),
        "1,000 headers": handshake(target, target.stream, None, *["a: b"] * 1_000),
        "header of 9 kB": handshake(target, target.stream, None, "a: " + "b" * 9_000),
        "header of 15 kB": handshake(target, target.stream, None, "a: " + "b" * 15_000),
        "path of 9 kB": handshake(target, target.stream + "?" + "a" * 9_000),
        "Expect": handshake(target, target.stream, None, "Expect: 100-continue"),
        "HTTP/1.0": plain.replace(b"HTTP/1.1", b"HTTP/1.0", 1),
        "POST": plain.replace(b"GET ", b"POST ", 1),
        "no key": b"\r\n".join(line for line in plain.split(b"\r\n") if not line.startswith(b"Sec-WebSocket-Key")),
        "bad key": plain.replace(b"Sec-WebSocket-Key: ", b"Sec-WebSocket-Key: !", 1),
        "two keys": handshake(target, target.stream, None, "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA=="),
        "version 12": plain.replace(b"Version: 13", b"Version: 12", 1),
        "two versions": handshake(target, target.stream, None, "Sec-WebSocket-Version: 8"),
        "folded header": plain.replace(b"Upgrade: websocket", b"Upgrade:\r\n websocket", 1),
        "NUL in a header": handshake(target, target.stream, None, "a: b\0c"),
        "Latin-1 in a header": handshake(target, target.stream, None, "a: \xff\xfe"),
        "absolute-form": plain.replace(path, b"http://evil.example" + path, 1),
        "percent in the path": plain.replace(path, b"/v1/sessions/%00%ff/stream", 1),
        "no Host": b"\r\n".join(line for line in plain.split(b"\r\n") if not line.startswith(b"Host")),
        "h2c": plain.replace(b"Upgrade: websocket", b"Upgrade: h2c", 1),
        "bad extension": handshake(target, target.stream, None, "Sec-WebSocket-Extensions: ;;;=,"),
        "bad subprotocol": handshake(target, target.stream, None, "Sec-WebSocket-Protocol: ,,\x7f"),
        "unfinished": plain[:-2],
    }

    async def run(name: str, data: bytes) -> None:
        async with open_socket(target, address=1 + hash(name) % 8) as opened:
            await opened.send(data)
            began = time.monotonic()
            # one that is accepted is closed with 4401, as it has no token
            closed = await opened.wait_until_closed(target.seconds - 1)
            report.count("closed" if closed else OPEN)
            if target.seconds > HEADER_TIMEOUT_S:
                report.require(
                    closed, f"upgrade with {name}: the connection is open after {time.monotonic() - began:.0f} s"
                )

    await asyncio.gather(*(run(name, data) for name, data in variants.items() for _ in range(4)))


@attack(3, f"{REFUSED}; all descriptors are free again", seconds=HEADER_TIMEOUT_S + 4)
async def many_unanswered_upgrades(target: Target, report: Report) -> None:
    """Open 400 connections with upgrade requests that have a body."""
    data = handshake(target, target.stream, None, "Content-Length: 5")
    opened = []
    for number in range(400):
        one = await asyncio.wait_for(_open_and_send(target, data, 1 + number % 8), 10.0)
        opened.append(one)
    until = time.monotonic() + target.seconds - 2
    closed = await asyncio.gather(*(one.wait_until_closed(until - time.monotonic()) for one in opened))
    report.count("closed", sum(closed))
    report.count(OPEN, len(closed) - sum(closed))
    if target.seconds > HEADER_TIMEOUT_S:
        report.require(all(closed), f"{len(closed) - sum(closed)} of {len(closed)} connections are still open")
    for one in opened:
        one.close()


@attack(3, REFUSED, seconds=HEADER_TIMEOUT_S + 3)
async def slow_headers(target: Target, report: Report) -> None:
    """Send the headers of requests and upgrades byte by byte, or not at all, on 200 connections."""
    heads = (b"GET /v1/health HTTP/1.1\r\nHost: a\r\nX: ", handshake(target, target.stream)[:-2] + b"X: ", b"")

    async def run(number: int) -> None:
        opened = await _open_and_send(target, heads[number % 3], 1 + number % 8)
        until = time.monotonic() + target.seconds - 1
        while time.monotonic() < until and not opened.is_closed:
            if number % 3 < 2:
                await opened.send(b"a")
            await opened.receive(0.5)
        report.count("closed" if opened.is_closed else OPEN)
        opened.close()

    await asyncio.gather(*(run(number) for number in range(200)))
    if target.seconds > HEADER_TIMEOUT_S + 1:
        report.require(not report.answers[OPEN], f"{report.answers[OPEN]} connections with slow headers are open")


@attack(3, "the connection is closed", seconds=HEADER_TIMEOUT_S + 3)
async def slow_second_request(target: Target, report: Report) -> None:
    """Send a complete request, and after its response half of another on the same connection."""

    async def run() -> None:
        opened = await _open_and_send(target, request(target, "GET", "/v1/health"), 3)
        report.count(await opened.describe_reaction())
        await opened.send(b"GET /v1/health HT")
        closed = await opened.wait_until_closed(target.seconds - 1)
        if target.seconds > HEADER_TIMEOUT_S + 1:
            report.require(closed, "a connection with half a second request stays open")
        opened.close()

    await asyncio.gather(*(run() for _ in range(20)))


@attack(19, "400, or 431, and the connection is closed", quick=True)
async def large_headers_in_one_segment(target: Target, report: Report) -> None:
    """Send headers of 17 to 120 kB in one segment, as a request and as an upgrade."""
    for kilobytes in (17, 40, 60, 120):
        lines = ["a: " + "b" * 990] * kilobytes
        for name, data in (
            ("request", request(target, "GET", "/v1/health", *lines)),
            ("request with one header", request(target, "GET", "/v1/health", "a: " + "b" * kilobytes * 1_000)),
            ("path", request(target, "GET", "/v1/health?" + "a" * kilobytes * 1_000)),
            ("upgrade", handshake(target, target.stream, None, *lines)),
        ):
            async with open_socket(target) as opened:
                await opened.send(data)
                reaction = await opened.describe_reaction(ANSWER_TIMEOUT_S)
                report.count(reaction)
                report.require(reaction in ("400", "414", "431", CLOSED), f"{name} with {kilobytes} kB: {reaction}")


@attack(19, "400 and the connection is closed", quick=True)
async def request_smuggling(target: Target, report: Report) -> None:
    """Send requests whose length is ambiguous, side by side, with a second request hidden behind each."""
    hidden = request(target, "GET", "/v1/openapi.json")
    token = target.tokens["view"]

    def post(*lines: str) -> bytes:
        return request(target, "POST", "/v1/tickets", *lines, token=token)

    variants = {
        "CL and TE": post("Content-Length: 5", "Transfer-Encoding: chunked") + b"0\r\n\r\n",
        "TE and CL": post("Transfer-Encoding: chunked", "Content-Length: 5") + b"0\r\n\r\n",
        "two CL": post("Content-Length: 0", f"Content-Length: {len(hidden)}"),
        "CL list": post(f"Content-Length: 0, {len(hidden)}"),
        "CL with a sign": post("Content-Length: +0"),
        "CL with an underscore": post("Content-Length: 1_0"),
        "negative CL": post("Content-Length: -1"),
        "hexadecimal CL": post("Content-Length: 0x10"),
        "CL of 100 digits": post("Content-Length: " + "9" * 100),
        "two TE": post("Transfer-Encoding: chunked", "Transfer-Encoding: identity") + b"0\r\n\r\n",
        "TE list": post("Transfer-Encoding: gzip, chunked") + b"0\r\n\r\n",
        "unknown TE": post("Transfer-Encoding: xchunked") + b"0\r\n\r\n",
        "TE with a space": post("Transfer-Encoding : chunked") + b"0\r\n\r\n",
        "TE with a tab": post("Transfer-Encoding:\tchunked\x0b") + b"0\r\n\r\n",
        "TE in HTTP/1.0": post("Transfer-Encoding: chunked").replace(b"HTTP/1.1", b"HTTP/1.0", 1) + b"0\r\n\r\n",
        "negative chunk": post("Transfer-Encoding: chunked") + b"-1\r\n\r\n",
        "chunk with 0x": post("Transfer-Encoding: chunked") + b"0x0\r\n\r\n",
        "chunk of 17 digits": post("Transfer-Encoding: chunked") + b"F" * 17 + b"\r\n\r\n",
        "chunk without an end": post("Transfer-Encoding: chunked") + b"1\r\nab0\r\n\r\n",
        "NUL in a header": post("X: a\0b"),
        "bare CR in a header": post("X: a\rContent-Length: 9"),
        "space in a name": post("X Y: a"),
        "two hosts": post("Host: evil.example"),
    }

    async def run(name: str, data: bytes) -> None:
        async with open_socket(target) as opened:
            await opened.send(data + hidden)
            first = await opened.read_response(ANSWER_TIMEOUT_S)
            report.count(str(first.status) if first else "closed without an answer")
            second = await opened.read_response(1.5) if first is not None else None
            status = first.status if first else 400
            # a gateway removes a length beside chunks, and reports a broken body that it has begun to pass on
            is_cleaned = target.is_behind_gateway and name in ("CL and TE", "TE and CL")
            is_passed_on = target.is_behind_gateway and "chunk" in name
            # "two hosts" and the like may be answered, but the hidden request of an ambiguous length may not
            is_refused = status in (400, 413, 431, 501) or (status == 502 and is_passed_on)
            report.require(is_refused or is_cleaned or second is None, f"{name}: {status}, connection kept")
            report.require(status < 500 or is_refused, f"{name}: {status}")

    await asyncio.gather(*(run(*variant) for variant in variants.items()))


@attack(19, "no 5xx; the connection is answered or closed", quick=True)
async def unusual_requests(target: Target, report: Report) -> None:
    """Send requests that are legal, obsolete or nonsense, side by side."""
    health = request(target, "GET", "/v1/health")
    chunked = request(target, "POST", "/v1/solve", "Transfer-Encoding: chunked", token=target.tokens["view"])
    variants = {
        "absolute-form": health.replace(b"/v1/health", b"http://evil.example/v1/health", 1),
        "asterisk-form": health.replace(b"GET /v1/health", b"OPTIONS *", 1),
        "CONNECT": health.replace(b"GET /v1/health", b"CONNECT a:443", 1),
        "TRACE": health.replace(b"GET", b"TRACE", 1),
        "unknown method": health.replace(b"GET", b"BREW", 1),
        "method of 5 kB": health.replace(b"GET", b"G" * 5_000, 1),
        "lower-case method": health.replace(b"GET", b"get", 1),
        "HTTP/0.9": b"GET /v1/health\r\n\r\n",
        "HTTP/1.0": request(target, "GET", "/v1/health", "Connection: keep-alive").replace(b"1.1", b"1.0", 1),
        "HTTP/2 preface": b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
        "HTTP/9.9": health.replace(b"1.1", b"9.9", 1),
        "TLS hello": bytes.fromhex("1603010200010001fc0303") + bytes(500),
        "bare LF": health.replace(b"\r\n", b"\n"),
        "obsolete folding": request(target, "GET", "/v1/health", "X: a\r\n b\r\n\tc"),
        "empty lines first": b"\r\n" * 1_000 + health,
        "no Host": b"GET /v1/health HTTP/1.1\r\n\r\n",
        "Host with a path": b"GET /v1/health HTTP/1.1\r\nHost: a/b@c\r\n\r\n",
        "traversal": health.replace(b"/v1/health", b"/../../../../etc/passwd", 1),
        "encoded traversal": health.replace(b"/v1/health", b"/%2e%2e/%2e%2e/%2e%2e/etc/passwd", 1),
        "backslash": health.replace(b"/v1/health", b"/..\\..\\..\\etc\\passwd", 1),
        "NUL in the path": health.replace(b"/v1/health", b"/v1/motions/%00", 1),
        "bad UTF-8 in the path": health.replace(b"/v1/health", b"/v1/motions/%ff%fe", 1),
        "raw bytes in the path": health.replace(b"/v1/health", b"/v1/\xff\xfe", 1),
        "surrogate in the path": health.replace(b"/v1/health", b"/v1/motions/%ed%a0%80", 1),
        "long file name": health.replace(b"/v1/health", b"/" + b"a" * 5_000, 1),
        "1,000 ranges": request(target, "GET", "/", "Range: bytes=" + ",".join(["0-1"] * 1_000)),
        "bad range": request(target, "GET", "/", "Range: bytes=9-1,-5,a"),
        "bad date": request(target, "GET", "/", "If-Modified-Since: Thu, 99 Foo 99999 00:00:00 GMT"),
        "1,000 encodings": request(target, "GET", "/", "Accept-Encoding: " + ",".join(["gzip;q=0.5"] * 1_000)),
        "1,000 media types": request(target, "GET", "/v1/openapi.json", "Accept: " + ",".join(["a/b;q=2"] * 1_000)),
        "bad content type": request(
            target, "POST", "/v1/solve", "Content-Type: ;;;;", token=target.tokens["view"], body=b"{}"
        ),
        "multipart": request(
            target, "POST", "/v1/solve", "Content-Type: multipart/form-data; boundary=" + "a" * 3_000,
            token=target.tokens["view"], body=b"--a",
        ),
        "expect 100": request(target, "POST", "/v1/solve", "Expect: 100-continue", "Content-Length: 5", token="bad"),
        "unknown expectation": request(target, "GET", "/v1/health", "Expect: 200-maybe"),
        "trailers": chunked + b"1\r\n{\r\n0\r\n" + b"a: b\r\n" * 100 + b"\r\n",
        "limit of 0": request(target, "GET", "/v1/motions?limit=0", token=target.tokens["view"]),
        "limit of 10^30": request(target, "GET", "/v1/motions?limit=1" + "0" * 30, token=target.tokens["view"]),
        "bad cursor": request(target, "GET", "/v1/motions?cursor=%00%ff", token=target.tokens["view"]),
        "huge block": request(
            target, "GET", f"/v1/motions/{target.motion}/blocks/{9 ** 40}/{9 ** 40}?track={9 ** 40}",
            token=target.tokens["view"],
        ),
        "huge digits": request(
            target, "GET", f"/v1/motions/{target.motion}/blocks/{'9' * 5_000}/0", token=target.tokens["view"]
        ),
        "many parameters": request(target, "GET", "/v1/motions?" + "a=1&" * 3_000, token=target.tokens["view"]),
    }  # fmt: skip

    async def run(name: str, data: bytes) -> None:
        async with open_socket(target) as opened:
            await opened.send(data)
            # the server waits for the body of some
            reaction = await opened.describe_reaction(2.0)
            report.count(reaction)
            report.require(not reaction.startswith("5") or reaction in ("501", "505"), f"{name}: {reaction}")

    await asyncio.gather(*(run(*variant) for variant in variants.items()))


@attack(3, "others' overlay gap p99 <= 1.3x calm; bounded memory")
async def pipelined_requests(target: Target, report: Report) -> None:
    """Send thousands of requests without reading a response, on four connections."""
    data = request(target, "GET", "/v1/openapi.json") * 50 + request(target, "GET", "/v1/health") * 500

    async def run(address: int) -> None:
        async with open_socket(target, receive_buffer_bytes=4_096, address=address) as opened:
            until = time.monotonic() + target.seconds
            while time.monotonic() < until and not opened.is_closed:
                await opened.send(data, 0.5)
            report.count("closed" if opened.is_closed else OPEN)

    await asyncio.gather(*(run(address) for address in range(1, 5)))


@attack(3, "400 or 413, or closed; bounded memory")
async def endless_chunk_framing(target: Target, report: Report) -> None:
    """Send chunk extensions, chunk sizes and trailers without end."""
    head = request(target, "POST", "/v1/solve", "Transfer-Encoding: chunked", token=target.tokens["view"])
    variants = {
        "extension": (head + b"1;a=", b"b" * 65_536),
        "zeros": (head, b"0" * 65_536),
        "trailers": (head + b"0\r\n", b"a: b\r\n" * 10_000),
        "one trailer": (head + b"0\r\na: ", b"b" * 65_536),
        "one header": (b"GET /v1/health HTTP/1.1\r\na: ", b"b" * 65_536),
        "headers": (b"GET /v1/health HTTP/1.1\r\n", b"a: b\r\n" * 10_000),
        "no line end": (b"", b"A" * 65_536),
        "empty lines": (b"", b"\r\n" * 32_768),
        "extensions of chunks": (head, (b"1;" + b"e" * 2_000 + b"\r\n \r\n") * 32),
    }

    async def run(name: str, first: bytes, rest: bytes) -> None:
        async with open_socket(target) as opened:
            await opened.send(first)
            until = time.monotonic() + target.seconds
            sent = 0
            while time.monotonic() < until and not opened.is_closed and sent < 64 << 20:
                sent += len(rest) * await opened.send(rest, 0.5)
            response = await opened.read_response(1.0)
            report.count(str(response.status) if response else "closed" if opened.is_closed else OPEN)
            report.require(response is None or response.status < 500, f"{name}: a 5xx")
            report.require(
                response is not None or opened.is_closed or sent < 4 << 20, f"{name}: {sent >> 20} MB were accepted"
            )

    await asyncio.gather(*(run(name, *data) for name, data in variants.items()))


@attack(3, "429 for connections beyond the limit")
async def forged_forwarded_for(target: Target, report: Report) -> None:
    """Open sockets with a different X-Forwarded-For each, to evade the limit per address."""
    for number in range(CONNECTIONS_BEYOND_LIMITS):
        forged = f"X-Forwarded-For: 203.0.{number % 250}.{number // 250 + 1}"
        async with open_socket(target, address=200) as opened:
            await opened.send(handshake(target, target.stream, None, forged))
            reaction = await opened.describe_reaction()
        report.count(reaction)
        if reaction == "429":
            return
    report.require(False, f"{CONNECTIONS_BEYOND_LIMITS} connections with forged addresses were not limited")


@attack(3, "others' overlay gap p99 <= 1.3x calm; 429 at the gateway", seconds=0.0)
async def failed_tokens(target: Target, report: Report) -> None:
    """Guess tokens as fast as possible from four addresses."""

    async def run(address: int) -> None:
        until = time.monotonic() + target.seconds
        while time.monotonic() < until:
            async with open_socket(target, address=address) as opened:
                for number in range(100):
                    guess = f"eyJhbGciOiJIUzI1NiJ9.eyJzdWIiOiJ7{number}fQ.{'x' * 1_500}"
                    if not await opened.send(request(target, "GET", "/v1/motions", token=guess)):
                        break
                    report.count(await opened.describe_reaction())

    await asyncio.gather(*(run(address) for address in range(1, 5) for _ in range(4)))


@attack(10, "the server closes idle and half-closed connections", seconds=HEADER_TIMEOUT_S + 4)
async def half_closed_connections(target: Target, report: Report) -> None:
    """Open WebSockets, end the sending direction, and keep the other open."""

    async def run() -> None:
        opened = await connect_websocket(target, target.stream, target.tokens["view"])
        if opened is None:
            report.count("refused")
            return
        opened.end_sending()
        closed = await opened.wait_until_closed(target.seconds - 1)
        report.count("closed" if closed else OPEN)
        report.require(closed or target.seconds <= HEADER_TIMEOUT_S, "a half-closed connection stays open")
        opened.close()

    await asyncio.gather(*(run() for _ in range(20)))


async def _open_and_send(target: Target, data: bytes, address: int) -> RawSocket:
    opened = await RawSocket.connect(target, address=address)
    if data:
        await opened.send(data)
    return opened
