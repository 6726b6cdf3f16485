"""Responses that a browser or a shared cache would misuse, and costly public files: rows 1, 14 and 19."""

from __future__ import annotations

import asyncio
import time

from tests.attack.attack_reader import find_page_files
from tests.attack.raw_socket import fetch, open_socket, request
from tests.attack.registry import Report, Target, attack


@attack(14, "/redoc is gone; every page has a CSP and loads nothing from other sites", quick=True)
async def documentation_pages(target: Target, report: Report) -> None:
    """Look for pages that load scripts of other sites, or that may be framed."""
    for path in ("/redoc", "/docs", "/v1/redoc", "/docs/oauth2-redirect", "/v1/docs/oauth2-redirect", "/openapi.json"):
        response = await fetch(target, "GET", path)
        report.count(f"{path} {response.status if response else None}")
        report.require(response is not None and response.status == 404, f"{path} is public")
    for path in ("/", "/v1/docs", "/index.html", "/nothing"):
        response = await fetch(target, "GET", path)
        assert response is not None, path
        report.count(f"{path} {response.status}")
        text = response.body.decode(errors="replace")
        if "html" not in response.headers.get("content-type", ""):
            continue
        policy = response.headers.get("content-security-policy", "")
        report.require("default-src" in policy or "script-src" in policy, f"{path} has no Content-Security-Policy")
        report.require(
            "unsafe-inline" not in policy.partition("script-src")[2].partition(";")[0], f"{path}: inline scripts"
        )
        report.require("frame-ancestors" in policy, f"{path} may be framed")
        report.require(response.headers.get("x-content-type-options") == "nosniff", f"{path} lacks nosniff")
        external = [word for word in text.split('"') if word.startswith(("http://", "https://", "//"))]
        scripts = [one for one in external if one.endswith((".js", ".css", ".png")) or "cdn" in one]
        report.require(not scripts, f"{path} loads {scripts[:2]}")


@attack(19, "responses to requests with a token are private or not stored", quick=True)
async def cacheable_responses(target: Target, report: Report) -> None:
    """Look for responses with a token that a shared cache may store."""
    view, control, motion = target.tokens["view"], target.tokens["control"], target.motion
    requests = [
        ("GET", "/v1/motions", view), ("GET", f"/v1/motions/{motion}", view), ("GET", "/v1/sessions", view),
        ("GET", f"/v1/sessions/{target.session}", view), ("GET", "/v1/shares", control),
        ("GET", f"/v1/motions/{motion}/description", view), ("GET", f"/v1/motions/{motion}/blocks/0/0", view),
        ("GET", "/v1/motions/none", view), ("GET", "/v1/nothing", view),
        ("GET", "/v1/arms/393-351-256-560-320-120/table", view), ("HEAD", "/v1/motions", view),
        ("GET", "/v1/uploads/aaaaaaaaaa", target.tokens["ingest"]), ("POST", "/v1/tickets", view),
    ]  # fmt: skip
    for method, path, token in requests:
        response = await fetch(target, method, path, token=token)
        control_value = response.headers.get("cache-control", "none") if response else "no response"
        report.count(control_value)
        report.require(
            "private" in control_value or "no-store" in control_value,
            f"{method} {path.replace(motion, 'ID').replace(target.session, 'ID')}: Cache-Control: {control_value}",
        )


@attack(1, "others' overlay gap p99 <= 1.3x calm")
async def compressed_page_files(target: Target, report: Report) -> None:
    """Request the scripts of the page with compression, without a token, on fifty connections of ten addresses."""
    paths = [*(await find_page_files(target)), "/v1/openapi.json", "/"]

    async def run(number: int) -> None:
        until = time.monotonic() + target.seconds
        async with open_socket(target, address=1 + number % 10) as opened:
            while time.monotonic() < until and not opened.is_closed:
                await opened.send(request(target, "GET", paths[number % len(paths)], "Accept-Encoding: gzip"))
                report.count(await opened.describe_reaction())
                number += 1

    await asyncio.gather(*(run(number) for number in range(50)))
