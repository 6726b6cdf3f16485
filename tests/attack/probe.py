"""Uses of the server by another subject at the peak of an attack."""

from __future__ import annotations

import asyncio
import secrets
import time
from collections.abc import Awaitable, Callable

import httpx2
from websockets.exceptions import WebSocketException

from bunraku.client import Client, ControlRefused, Puppeteer
from tests.servers import make_bvh_clip

PROBE_TIMEOUT_S = 20.0

Probe = Callable[[Client, str, str], Awaitable[None]]
"""Function of the client, a motion and the controlled session."""


async def upload_motion(client: Client, _motion: str, _session: str) -> None:
    """Upload a motion and delete it."""
    clip = make_bvh_clip(1.0, secrets.randbelow(1 << 30))
    response = await client._http.post("/v1/motions", params={"filename": "probe.bvh"}, content=clip)
    _raise_for_status(response)
    _raise_for_status(await client._http.delete(f"/v1/motions/{response.json()['id']}"))


async def open_session(client: Client, motion: str, _session: str) -> None:
    """Open a session and end it."""
    response = await client._http.post("/v1/sessions", json={"motion": motion})
    _raise_for_status(response)
    _raise_for_status(await client._http.delete(f"/v1/sessions/{response.json()['id']}"))


async def share_motion(client: Client, motion: str, _session: str) -> None:
    """Create a share link and revoke it."""
    response = await client._http.post("/v1/shares", json={"motion": motion})
    _raise_for_status(response)
    _raise_for_status(await client._http.delete(f"/v1/shares/{response.json()['id']}"))


async def get_ticket(client: Client, _motion: str, _session: str) -> None:
    """Request a ticket."""
    _raise_for_status(await client._http.post("/v1/tickets"))


async def solve_limb(client: Client, _motion: str, _session: str) -> None:
    """Solve one arm."""
    body = {"proportions": "393-351-256-560-320-120", "targets": [[0.4, 0.1, 0.4]]}
    _raise_for_status(await client._http.post("/v1/solve", json=body))


async def control_session(client: Client, _motion: str, session: str) -> None:
    """Join the controlled session and claim a free limb."""
    async with Puppeteer(client, session, "probe") as puppeteer:
        await puppeteer.claim("right_leg")
        await puppeteer.release("right_leg")


PROBES: dict[str, Probe] = {
    "upload": upload_motion,
    "session": open_session,
    "share": share_motion,
    "ticket": get_ticket,
    "solve": solve_limb,
    "control": control_session,
}


def run_probe(name: str, url: str, token: str, motion: str, session: str) -> str | None:
    """Run a probe as the subject of `token` and return why it failed."""

    async def run() -> None:
        async with Client(url, token) as client, asyncio.timeout(PROBE_TIMEOUT_S):
            await PROBES[name](client, motion, session)

    began = time.monotonic()
    try:
        asyncio.run(run())
    except (AssertionError, ControlRefused, OSError, WebSocketException, httpx2.HTTPError) as error:
        reason = str(error) or type(error).__name__
        return f"another subject's {name} failed after {time.monotonic() - began:.1f} s: {reason}"
    return None


def _raise_for_status(response: httpx2.Response) -> None:
    assert response.is_success, f"{response.status_code} {response.text[:160]}"
