"""Requests to every route with hostile parameters, bodies and headers, one by one: row 19."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any
from urllib.parse import quote

from tests.attack.attack_access import HOSTILE_NAMES, unsafe_characters
from tests.attack.attack_body import JSON, MSGPACK, PROPORTIONS
from tests.attack.attack_reader import find_page_files
from tests.attack.raw_socket import Response, fetch
from tests.attack.registry import Report, Target, attack

ANSWERED = "no 5xx; answers are short and have no characters that a terminal acts on"
MAX_PROBLEM_BYTES = 8_000
"""Largest answer to a request that is refused, bytes."""
PATH_VALUES = (
    "%00",
    "%2F",
    "%2e%2e%2f%2e%2e",
    "%0a",
    "%0d%0aX:a",
    "%ff",
    "%ed%a0%80",
    "%E2%80%AE",
    "%1b%5d0;x%07",
    "..",
    "*",
    ">",
    "a.b",
    "%24JS",
    "a" * 7_000,
    "9" * 7_000,
    "-1",
    "1e9",
    "%D9%A1",
    "%F0%9F%91%BE" * 500,
    "null",
    "%7B%7B7*7%7D%7D",
)
"""Percent-encoded values of parameters in a path or a query."""
JSON_VALUES = (
    "null",
    "true",
    "-0",
    "1e400",
    "-1e400",
    "NaN",
    "Infinity",
    "9" * 3_000,
    "1e-400",
    "0.1",
    '""',
    '"\\ud800"',
    '"\\u0000"',
    '"\\u202e\\u001b[2J"',
    '"' + "a" * 3_000 + '"',
    "[" * 3_000,
    "[" * 1_500 + "]" * 1_500,
    "{}",
    "[]",
    '{"\\ud800":1}',
    "9007199254740993",
    "-9223372036854775809",
    "[[0,0,0]]",
    '[{"time":0}]',
)
"""JSON values in place of those that a field has."""
FIELDS = (
    "motion",
    "session",
    "seconds",
    "playing",
    "position",
    "motions",
    "places",
    "camera",
    "lights",
    "name",
    "proportions",
    "targets",
    "legs",
    "\\u202e",
    "__proto__",
    "__class__",
)


def _require_safe(report: Report, what: str, response: Response | None) -> None:
    """Require an answer that is no failure and is safe to print."""
    status = response.status if response is not None else None
    report.count(str(status))
    report.require(status is not None, f"{what}: no answer")
    if response is None or status is None:
        return
    report.require(status < 500, f"{what}: {status}")
    if status >= 400:
        report.require(len(response.body) <= MAX_PROBLEM_BYTES, f"{what}: the answer has {len(response.body)} bytes")
        is_json = response.body.startswith(b"{")
        # the texts behind the escapes of JSON
        text = json.dumps(response.json(), ensure_ascii=False) if is_json else response.body.decode(errors="replace")
        shown = unsafe_characters(text + "".join(response.headers.values()))
        report.require(not shown, f"{what}: the answer shows {shown}")


async def _operations(target: Target) -> list[tuple[str, str, dict[str, Any]]]:
    """Return method, path and description of every operation of the API."""
    response = await fetch(target, "GET", "/v1/openapi.json")
    assert response is not None
    paths: dict[str, dict[str, Any]] = response.json()["paths"]
    return [(method.upper(), path, operation) for path, one in paths.items() for method, operation in one.items()]


def _fill(path: str, target: Target, name: str = "", value: str = "") -> str:
    """Replace the parameters of a path: `name` by a value, the others by resources that exist."""
    known = {
        "motion": "none",
        "session": "none",
        "proportions": PROPORTIONS,
        "name": "circle",
        "rate": "0",
        "index": "0",
        "share": "f" * 18,
        "upload": "a" * 10,
    }
    if "{motion}/" in path:
        known["motion"] = target.motion
    for parameter, default in known.items():
        path = path.replace(f"{{{parameter}}}", value if parameter == name else default)
    return path


@attack(19, ANSWERED)
async def hostile_parameters(target: Target, report: Report) -> None:
    """Give every parameter of every route each of the hostile values, in the path and in the query."""
    token = target.tokens["ingest"]
    for method, path, operation in await _operations(target):
        for parameter in operation.get("parameters", []):
            name, place = parameter["name"], parameter["in"]
            for value in PATH_VALUES:
                if place == "path":
                    filled = _fill(path, target, name, value)
                elif place == "query":
                    filled = f"{_fill(path, target)}?{name}={value}"
                else:
                    continue
                response = await fetch(
                    target, method, filled, JSON, token=token, body=b"{}" if method == "POST" else None
                )
                _require_safe(report, f"{method} {path} {name}={value[:24]}", response)


@attack(19, ANSWERED)
async def hostile_fields(target: Target, report: Report) -> None:
    """Give every field of every small JSON body each of the hostile values, and repeat keys."""
    token = target.tokens["ingest"]
    session = await fetch(
        target, "POST", "/v1/sessions", JSON, token=token, body=json.dumps({"motion": target.motion}).encode()
    )
    assert session is not None
    own = f"/v1/sessions/{session.json()['id']}"
    routes = [("POST", "/v1/sessions"), ("POST", "/v1/shares"), ("POST", "/v1/solve"), ("PATCH", own)]
    routes += [("POST", f"/v1/motions/{target.motion}/{part}") for part in ("scene", "performers")]
    for method, path in routes:
        bodies: Iterator[str] = iter(
            [
                *JSON_VALUES,
                *(f'{{"{field}":{value}}}' for field in FIELDS for value in JSON_VALUES),
                *(
                    f'{{"proportions":"{PROPORTIONS}","{field}":{value}}}'
                    for field in ("targets", "legs")
                    for value in JSON_VALUES
                ),
                f'{{"motion":"a","motion":"{target.motion}","motion":5}}',
                '{"motion":"a"}' + " " * 3_000,
                "\ufeff{}",
                '{"motion":"a"}{"motion":"b"}',
                "{'motion':1}",
                "",
            ]
        )
        for body in bodies:
            response = await fetch(target, method, path, JSON, token=token, body=body.encode("utf-8", "surrogatepass"))
            _require_safe(report, f"{method} {path.replace(own, '/v1/sessions/ID')} {body[:60]}", response)
            if response is not None and response.status == 201 and (place := response.headers.get("location")):
                await fetch(target, "DELETE", place, token=token)
    await fetch(target, "DELETE", own, token=token)


@attack(19, ANSWERED, quick=True)
async def hostile_messagepack_keys(target: Target, report: Report) -> None:
    """Send MessagePack with keys, numbers and texts that JSON does not have."""
    name, arm = b"\xabproportions", b"\xb7" + PROPORTIONS.encode()
    bodies = {
        "array as key": b"\x81\x93\x01\x02\x03\xc0",
        "map as key": b"\x81\x81\xc0\xc0\xc0",
        "nil as key": b"\x81\xc0\xc0",
        "NaN as key": b"\x81\xcb\x7f\xf8" + bytes(6) + b"\xc0",
        "binary as key": b"\x81\xc4\x0bproportions" + arm,
        "key twice": b"\x82" + name + b"\x01" + name + arm,
        "bad UTF-8": b"\x81" + name + b"\xa2\xff\xfe",
        "surrogate": b"\x81" + name + b"\xa3\xed\xa0\x80",
        "binary text": b"\x81" + name + b"\xc4\x04\xff\xfe\0\x1b",
        "largest integers": b"\x82" + name + arm + b"\xa4legs\x92\xcf" + b"\xff" * 8 + b"\xd3\x80" + bytes(7),
        "NaN and infinities": b"\x82" + name + arm + b"\xa4legs\x92\xcb\x7f\xf0" + bytes(6) + b"\xca\x7f\xc0\0\0",
        "extension": b"\x82" + name + arm + b"\xa4legs\x91\xd4\x05\x00",
        "timestamp": b"\x82" + name + arm + b"\xa4legs\x91\xd7\xff" + b"\xff" * 8,
        "text as targets": b"\x82" + name + arm + b"\xa7targets\xa3abc",
        "map as targets": b"\x82" + name + arm + b"\xa7targets\x81\xa1a\x93\0\0\0",
        "nothing": b"",
    }
    for what, body in bodies.items():
        response = await fetch(target, "POST", "/v1/solve", MSGPACK, token=target.tokens["view"], body=body)
        _require_safe(report, what, response)


@attack(19, ANSWERED)
async def hostile_headers(target: Target, report: Report) -> None:
    """Send headers that a server parses itself, with hostile values, to each kind of resource."""
    script = (await find_page_files(target))[0]
    paths = ("/", script, "/v1/docs", "/v1/health", "/v1/motions", f"/v1/arms/{PROPORTIONS}/table", "/v1/tickets")
    many = ",".join(f"{number * 3}-{number * 3 + 1}" for number in range(900))
    lines = [
        f"Range: bytes={many}",
        "Range: bytes=" + ",".join(["0-"] * 1_500),
        "Range: bytes=-0",
        "Range: bytes=" + "9" * 7_000,
        "Range: bytes=0-" + "9" * 5_000,
        "Range: lines=0-1",
        "Range: bytes",
        "Range: bytes=a-b,\xb2-\xb3",
        "If-Range: " + "a" * 7_000,
        "If-None-Match: " + ",".join(['W/"a"'] * 1_100),
        'If-None-Match: "',
        "If-None-Match: *",
        "If-Modified-Since: " + "9" * 7_000,
        "If-Modified-Since: Thu, 01 Jan 9999999999999999999999 00:00:00 GMT",
        "If-Modified-Since: Thu, 01 Jan 1970 00:00:00 +99999999999999999999",
        "If-Unmodified-Since: \xff",
        "Accept-Encoding: " + ",".join(["gzip;q=0.00000001"] * 400),
        "Accept-Encoding: \xff",
        "Accept: \xff\xfe",
        "Accept-Language: " + "a-" * 3_900,
        "Origin: http://[",
        "Origin: http://[::1]:99999999",
        "Origin: http://a:b@c",
        "Origin: \xff",
        "Origin: http://" + "a" * 7_000,
        "Origin: null",
        "X-Request-Id: " + "\x80" * 60,
        "X-Request-Id: a\x1bb",
        "X-Forwarded-For: " + "1.2.3.4," * 900,
        "X-Forwarded-For: [::",
        'Forwarded: for="_\xff"',
        "Cookie: " + "a=b;" * 1_900,
        "Content-Type: \xff/\xff; charset=\xff",
        "Content-Type: " + "a/b;" * 1_900,
        "Content-Type: application/json; charset=utf-7",
        "Content-Encoding: gzip",
        "Content-Length: " + "0" * 6_000 + "2",
        "Content-Length: " + "9" * 6_000,
        "Expect: 100-continue",
        "Connection: " + "close," * 1_200,
        "Upgrade: websocket",
        "Upgrade: \xff",
        "Host: [",
        "Host: a:b:c",
        "Host: \xff",
        "TE: trailers, deflate;q=0.5",
        "Authorization: \xff \xff",
        "Authorization: Bearer",
        "Authorization: Basic " + "a" * 7_000,
        "Authorization: Bearer \xff.\xfe.\xfd",
        *(f"X-Name: {quote(name)}" for name in HOSTILE_NAMES.values()),
    ]
    for path in paths:
        for method in ("GET", "HEAD", "OPTIONS", "POST"):
            for line in lines:
                token = None if line.startswith("Authorization") else target.tokens["view"]
                body = b"{}" if method == "POST" and not line.startswith("Content-Length") else None
                response = await fetch(target, method, path, line, token=token, body=body, timeout_s=8.0)
                _require_safe(report, f"{method} {path.replace(script, 'SCRIPT')} {line[:48]!r}", response)
