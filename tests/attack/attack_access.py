"""Tokens, links, tickets, sessions and names: rows 11, 15, 16 and 17."""

from __future__ import annotations

import asyncio
import time
import unicodedata
from datetime import datetime
from urllib.parse import quote

from bunraku.wire.messages import Presence, unpack
from tests.attack.raw_socket import connect_websocket, fetch, fetch_json, frame
from tests.attack.registry import Report, Target, attack
from tests.servers import make_bvh_clip

MAX_SESSIONS = 1_000
"""Sessions that one replica opens in total."""
LINKS = 1_500
HOSTILE_NAMES = {
    "control characters": "a\x1b[2Jb\x1b]0;owned\x07c\x9b2Jd\0e\x7ff",
    "line breaks": "a\r\nb\u2028c\u2029d\x85e",
    "bidirectional characters": "a\u202egnp.exe\u2066b\u2067c\u2069d",
    "invisible characters": "a\u200bb\u2060c\ufeffd" + "".join(chr(0xE0000 + ord(one)) for one in "hidden"),
    "combining characters": "a" + "\u0301" * 100,
}
"""Names with characters that a terminal or a page may act on."""
JOINERS = "\u200c\u200d"
"""Format characters that emoji and some scripts need."""
UNSAFE_CATEGORIES = ("Cc", "Cf", "Cs", "Zl", "Zp", "Cn")


def unsafe_characters(text: str) -> str:
    """Return the code points of a text that must not be shown, and of runs of more than eight combining marks."""
    found = [one for one in text if unicodedata.category(one) in UNSAFE_CATEGORIES and one not in JOINERS]
    run = 0
    for one in text:
        run = run + 1 if unicodedata.combining(one) else 0
        if run > 8:
            found.append(one)
    return " ".join(sorted({f"U+{ord(one):04X}" for one in found}))


async def _post_many(target: Target, report: Report, path: str, content: object, count: int) -> list[str]:
    """Send the same request until `count` have succeeded, one was refused, or time is up; return the created ids."""
    created: list[str] = []
    until = time.monotonic() + max(target.seconds, 2.0) * 3
    refused = asyncio.Event()

    async def run(address: int) -> None:
        while len(created) < count and not refused.is_set() and time.monotonic() < until:
            response = await fetch_json(target, "POST", path, content, token=target.tokens["control"], address=address)
            report.count(f"{path} {response.status if response else None}")
            if response is None or response.status != 201:
                refused.set()
                return
            created.append(response.json()["id"])

    await asyncio.gather(*(run(address) for address in range(1, 9)))
    return created


@attack(11, "quota per subject; others open sessions", seconds=10.0, probe="session")
async def sessions_of_one_subject(target: Target, report: Report) -> None:
    """Open sessions until they are refused, up to 1,000, while another subject opens one; then end them."""
    created = await _post_many(target, report, "/v1/sessions", {"motion": target.motion}, MAX_SESSIONS + 8)
    report.count("opened", len(created))
    await report.reach_peak()
    token = target.tokens["control"]
    for at in range(0, len(created), 16):
        batch = created[at : at + 16]
        await asyncio.gather(*(fetch(target, "DELETE", f"/v1/sessions/{one}", token=token) for one in batch))


@attack(11, "quota per subject; others create links", seconds=10.0, probe="share")
async def links_of_one_subject(target: Target, report: Report) -> None:
    """Create 1,500 links, while another subject creates one; then revoke them."""
    created = await _post_many(target, report, "/v1/shares", {"motion": target.motion}, LINKS)
    report.count("created", len(created))
    report.require(len(created) < LINKS, f"one subject has {len(created)} live links")
    await report.reach_peak()
    token = target.tokens["control"]
    for at in range(0, len(created), 16):
        batch = created[at : at + 16]
        await asyncio.gather(*(fetch(target, "DELETE", f"/v1/shares/{one}", token=token) for one in batch))


@attack(11, "tickets per subject; others get tickets", probe="ticket")
async def tickets_of_one_subject(target: Target, report: Report) -> None:
    """Request tickets from forty addresses until they are refused."""
    until = time.monotonic() + target.seconds * 2

    async def run(first: int) -> None:
        address = first
        while time.monotonic() < until:
            response = await fetch(target, "POST", "/v1/tickets", token=target.tokens["view"], address=address)
            status = response.status if response else None
            report.count(str(status))
            if status == 429:
                title = response.json().get("title") if response else ""
                if title != "Too many connections":
                    report.count("refused by subject")
                    return
                address = 100 + (address + 8) % 40

    await asyncio.gather(*(run(100 + number) for number in range(8)))
    await report.reach_peak()


@attack(11, "bounded caches; others are served", probe="solve")
async def arms_of_all_proportions(target: Target, report: Report) -> None:
    """Request tables and figures of ever different arms."""
    until = time.monotonic() + target.seconds
    numbers = iter(range(100_000))

    async def run(address: int) -> None:
        while time.monotonic() < until:
            number = next(numbers)
            links = (300 + number % 150, 300 + number // 150 % 150)
            arm = f"{links[0]}-{links[1]}-{1_000 - sum(links)}-560-320-120"
            path = f"/v1/arms/{arm}/" + ("figures/circle" if number & 1 else "table")
            response = await fetch(target, "GET", path, token=target.tokens["view"], address=address)
            report.count(str(response.status if response else None))
            report.require(response is None or response.status < 500, f"{path}: {response and response.status}")

    running = [asyncio.create_task(run(address)) for address in range(1, 5)]
    await asyncio.sleep(target.seconds / 2)
    await report.reach_peak()
    await asyncio.gather(*running)


@attack(11, "others' overlay gap p99 <= 1.3x calm", probe="session")
async def edits_of_an_own_session(target: Target, report: Report) -> None:
    """Edit the timeline of an own session as fast as possible on eight connections, and change its motion."""
    token = target.tokens["control"]
    opened = await fetch_json(target, "POST", "/v1/sessions", {"motion": target.motion}, token=token)
    assert opened is not None
    path = f"/v1/sessions/{opened.json()['id']}"
    until = time.monotonic() + target.seconds

    async def run(address: int) -> None:
        number = address
        while time.monotonic() < until:
            edit = {"motion": target.motion} if number % 8 == 0 else {"position": number * 1_000 % 1_000_000}
            response = await fetch_json(target, "PATCH", path, edit, token=token, address=address)
            report.count(str(response.status if response else None))
            number += 1

    running = [asyncio.create_task(run(address)) for address in range(1, 9)]
    await asyncio.sleep(target.seconds / 2)
    await report.reach_peak()
    await asyncio.gather(*running)
    await fetch(target, "DELETE", path, token=token)


@attack(15, "a link never outlives what made it", quick=True)
async def links_that_outlive_their_maker(target: Target, report: Report) -> None:
    """Create links of 31 days with tokens that expire within the hour, bound and unbound."""
    for name in ("control", "bound control"):
        now = time.time()
        content = {"session": target.session, "seconds": 2_678_400}
        response = await fetch_json(target, "POST", "/v1/shares", content, token=target.tokens[name])
        assert response is not None
        report.count(f"{name} {response.status}")
        if response.status != 201:
            continue
        share = response.json()
        lifetime = datetime.fromisoformat(share["expires"]).timestamp() - now
        report.require(lifetime <= 3_700, f"a {name} token of one hour made a link of {lifetime / 3_600:,.0f} hours")
        other = {"motion": target.motion}
        widened = await fetch_json(target, "POST", "/v1/shares", other, token=share["token"])
        report.require(widened is not None and widened.status in (401, 403, 404), "a link made another link")
        await fetch(target, "DELETE", f"/v1/shares/{share['id']}", token=target.tokens[name])


@attack(17, "401 for tokens that are not valid yet, too long, or malformed", quick=True)
async def tokens_that_must_be_refused(target: Target, report: Report) -> None:
    """Use tokens signed with the right secret whose claims break the contract."""
    for name, token in target.tokens.items():
        if not name.startswith("bad "):
            continue
        response = await fetch(target, "GET", "/v1/motions", token=token)
        report.count(f"{response.status if response else None}")
        report.require(response is not None and response.status == 401, f"{name[4:]}: the token is taken")
        opened = await connect_websocket(target, target.stream, token, address=9)
        code = await opened.read_close_code(3.0) if opened is not None else None
        report.require(code == 4401, f"{name[4:]}: a stream was closed with {code}, expected 4401")
        if opened is not None:
            opened.close()


@attack(16, "no control, format or bidirectional characters in names", quick=True)
async def hostile_names(target: Target, report: Report) -> None:
    """Upload motions and join sessions under names with characters that terminals and pages act on."""
    token, created = target.tokens["ingest"], []
    for number, (kind, name) in enumerate(HOSTILE_NAMES.items()):
        clip = make_bvh_clip(0.3, 9_000 + number)
        path = f"/v1/motions?filename={quote(name)}.bvh"
        response = await fetch(target, "POST", path, token=token, body=clip, timeout_s=30.0)
        assert response is not None
        report.count(str(response.status))
        found = unsafe_characters(" ".join(map(str, response.json().values())))
        if response.status < 300:
            created.append(response.json()["id"])
        report.require(not found, f"motion name with {kind}: {found}")
        opened = await connect_websocket(target, f"{target.control}?name={quote(name)}", target.tokens["control"])
        if opened is None:
            report.count("puppeteer refused")
            continue
        # the server closes the connection after its messages
        await opened.send(frame(8))
        await opened.read_close_code()
        for message in map(unpack, opened.messages):
            if isinstance(message, Presence):
                found = unsafe_characters(" ".join(one["name"] for one in message.puppeteers))
                report.require(not found, f"puppeteer name with {kind}: {found}")
        opened.close()
    for one in created:
        await fetch(target, "DELETE", f"/v1/motions/{one}", token=token)
