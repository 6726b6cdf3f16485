"""HTTP client of the Python SDK."""

from __future__ import annotations

import asyncio
import contextlib
import os
import secrets
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Self
from urllib.parse import quote, urlsplit, urlunsplit

import httpx2

from bunraku.client.authorization import authorization
from bunraku.client.server_problem import ServerProblem

if TYPE_CHECKING:
    from bunraku.client.performer import Performer
    from bunraku.motion.skeleton import Figure

REQUEST_TIMEOUT = httpx2.Timeout(10.0, read=130.0)
"""Seconds. The answer to an upload comes after encoding; a recording is made within 120 s."""
CHUNK_BYTES = 1 << 16
PROGRESS_INTERVAL_S = 0.25
"""Interval between queries of an upload's progress."""


class Client:
    """Client of a server at `url` (http or https), with an optional access `token`. Use as an async context manager.

    Methods raise `ServerProblem` if the server rejects the request, and `httpx2.TransportError` if it is unreachable.
    """

    def __init__(self, url: str = "http://127.0.0.1:8000", token: str | None = None) -> None:
        self.url = url.rstrip("/")
        self.token = token
        self._http = httpx2.AsyncClient(base_url=self.url, timeout=REQUEST_TIMEOUT, headers=authorization(token))

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self._http.aclose()

    async def health(self) -> dict[str, Any]:
        """Return status and version of the server."""
        return await self._request("GET", "/v1/health")

    async def upload(
        self,
        path: Path,
        progress: Callable[[int, int], None] | None = None,
        on_stage: Callable[[str, float], None] | None = None,
        *,
        take: str | None = None,
    ) -> dict[str, Any]:
        """Upload a motion file and wait until it can be watched.

        `take` chooses a motion of a file that has several. `progress` receives bytes sent and total; `on_stage`
        repeatedly receives the server's stage (`preparing`, `waiting`, `reading`, `encoding`) and the share done, 0..1.
        """
        query = {} if take is None else {"take": take}
        return await self._upload_file(path, "/v1/motions", progress, on_stage, query)

    async def upload_takes(
        self,
        path: Path,
        progress: Callable[[int, int], None] | None = None,
        on_stage: Callable[[str, float], None] | None = None,
    ) -> dict[str, Any]:
        """Upload a motion file and wait until each of its takes can be watched; a file may have 64.

        Return the motions as `items`, the takes that were not stored as `skipped` (`take`, `title`, `detail`, `hint`),
        and as `pending` the names of those that the server stores later because they would have delayed the answer.
        The callbacks are those of `upload`; shares of stages are those of all takes together.
        """
        stored = await self._upload_file(path, "/v1/motions", progress, on_stage, {"takes": "all"})
        # a server of an older release stores one take
        return stored if "items" in stored else {"items": [stored], "skipped": [], "pending": []}

    async def add_audio(
        self,
        motion: str,
        path: Path,
        progress: Callable[[int, int], None] | None = None,
        on_stage: Callable[[str, float], None] | None = None,
    ) -> dict[str, Any]:
        """Create a motion from `motion` and a WAV, FLAC, MP3 or Ogg file, and wait until it can be watched.

        The callbacks are those of `upload`.
        """
        return await self._upload_file(path, f"/v1/motions/{quote(motion, safe='')}/audio", progress, on_stage)

    async def add_scene(self, motion: str, staging: dict[str, Any]) -> dict[str, Any]:
        """Create a motion from `motion` with a camera and lights: keyframes as for `POST /v1/motions/{id}/scene`."""
        path = f"/v1/motions/{quote(motion, safe='')}/scene"
        return await self._request("POST", path, json=staging)

    async def add_performers(
        self, motion: str, motions: list[str], places: list[list[float]] | None = None
    ) -> dict[str, Any]:
        """Create a motion with the performers of `motions` beside those of `motion`.

        `places` are `[x, z, turn]` of each performer in metres and radians, those of `motion` first; by default they
        stand in a row.
        """
        path = f"/v1/motions/{quote(motion, safe='')}/performers"
        body = {"motions": motions} | ({"places": places} if places is not None else {})
        return await self._request("POST", path, json=body)

    async def edit_motion(
        self,
        motion: str,
        *,
        start: float = 0.0,
        end: float | None = None,
        mirror: bool = False,
        loop: bool = False,
        name: str | None = None,
        on_stage: Callable[[str, float], None] | None = None,
    ) -> dict[str, Any]:
        """Create an edited copy of a motion, and wait until it can be watched.

        `start` and `end` cut out a part, in seconds of motion time, rounded to frames. `mirror` exchanges left and
        right. `loop` blends the end into what precedes the start, so that the repetition is seamless. `name` is that of
        the copy. `on_stage` is that of `upload`.
        """
        body: dict[str, Any] = {"start": round(start * 1e6), "mirror": mirror, "loop": loop}
        body |= {} if end is None else {"end": round(end * 1e6)}
        body |= {} if name is None else {"name": name}
        upload = secrets.token_urlsafe(16)
        async with self._report_progress(upload, on_stage):
            return await self._request(
                "POST", f"/v1/motions/{quote(motion, safe='')}/edits", params={"upload": upload}, json=body
            )

    async def reencode_motion(self, motion: str) -> dict[str, Any]:
        """Encode a motion of an older release again, in place, and return it: its lower bitrate levels get smaller."""
        return await self._request("POST", f"/v1/motions/{quote(motion, safe='')}/encodings")

    async def motions(self, search: str = "", tag: str = "") -> list[dict[str, Any]]:
        """Return all motions, newest first: those whose name has every word of `search`, and that have the tag `tag`.

        Case is ignored; an empty text selects all.
        """
        return await self._list("/v1/motions", {key: text for key, text in (("search", search), ("tag", tag)) if text})

    async def motion(self, motion: str) -> dict[str, Any]:
        """Return one motion."""
        return await self._request("GET", f"/v1/motions/{quote(motion, safe='')}")

    async def update_motion(
        self, motion: str, *, name: str | None = None, tags: Sequence[str] | None = None
    ) -> dict[str, Any]:
        """Change the name or the tags of a motion, at most 16 of up to 40 characters, and return it."""
        fields = {"name": name, "tags": None if tags is None else list(tags)}
        body = {key: value for key, value in fields.items() if value is not None}
        return await self._request("PATCH", f"/v1/motions/{quote(motion, safe='')}", json=body)

    async def thumbnail(self, motion: str) -> bytes:
        """Return a small picture of a motion as SVG."""
        return await self._get_bytes(f"/v1/motions/{quote(motion, safe='')}/thumbnail")

    async def delete_motion(self, motion: str) -> None:
        """Delete one motion."""
        await self._request("DELETE", f"/v1/motions/{quote(motion, safe='')}")

    async def add_prop(self, path: Path, *, length: float | None = None, grip: str | None = None) -> dict[str, Any]:
        """Upload a glTF file (GLB, or JSON with embedded data) as a prop, and wait until sessions can have it.

        `length` is that of its longest side in metres, `grip` where it is held: `origin`, `middle` or `bottom`; by
        default both are as in the file, and `guessed` says what was taken for granted. The result's `id` is a kind for
        the `props` of `edit_session`.
        """
        fit = {"length": None if length is None else str(length), "grip": grip}
        query = {name: value for name, value in fit.items() if value is not None}
        return await self._upload_file(path, "/v1/props", None, None, query)

    async def props(self) -> list[dict[str, Any]]:
        """Return all stored props, newest first."""
        return await self._list("/v1/props")

    async def prop_model(self, prop: str) -> bytes:
        """Return the model of a stored prop, as a GLB file."""
        return await self._get_bytes(f"/v1/props/{quote(prop, safe='')}/model")

    async def delete_prop(self, prop: str) -> None:
        """Delete one stored prop: sessions and recordings no longer show it."""
        await self._request("DELETE", f"/v1/props/{quote(prop, safe='')}")

    async def open_session(self, motion: str, *, playing: bool = True, loop: bool = True) -> dict[str, Any]:
        """Open a session over a motion."""
        return await self._request("POST", "/v1/sessions", json={"motion": motion, "playing": playing, "loop": loop})

    async def session(self, session: str) -> dict[str, Any]:
        """Return one session."""
        return await self._request("GET", f"/v1/sessions/{quote(session, safe='')}")

    async def first_session(self) -> str | None:
        """Return the id of the oldest open session, or None."""
        items = (await self._request("GET", "/v1/sessions", params={"limit": 1}))["items"]
        return items[0]["id"] if items else None

    async def edit_session(self, session: str, **edit: Any) -> dict[str, Any]:
        """Edit a session: any of `playing`, `position` (microseconds), `loop`, `motion`, `crowd`, `props`."""
        return await self._request("PATCH", f"/v1/sessions/{quote(session, safe='')}", json=edit)

    def perform(
        self,
        figure: Figure | None = None,
        *,
        name: str = "",
        session: str | None = None,
        fps: float = 60.0,
        place: tuple[float, float, float] | None = None,
    ) -> Performer:
        """Return a live performer, an async context manager; the arguments are those of `Performer`."""
        from bunraku.client.performer import Performer

        return Performer(self, figure, name=name, session=session, fps=fps, place=place)

    async def create_performer(self, new: Mapping[str, Any]) -> dict[str, Any]:
        """Bring a live performer on a stage, with the fields of `POST /v1/performers`."""
        return await self._request("POST", "/v1/performers", json=dict(new))

    async def performer(self, performer: str) -> dict[str, Any]:
        """Return one live performer."""
        return await self._request("GET", f"/v1/performers/{quote(performer, safe='')}")

    async def end_performer(self, performer: str) -> None:
        """End a performance; its motion appears in the library within seconds."""
        await self._request("DELETE", f"/v1/performers/{quote(performer, safe='')}")

    async def record(
        self,
        session: str,
        name: str | None = None,
        seconds: float | None = None,
        camera: Sequence[Mapping[str, Any]] = (),
    ) -> dict[str, Any]:
        """Record what a session has shown as a new motion, and wait until it can be watched.

        `seconds` limits the recording to the last part (default: all that is available). `camera` are keyframes in
        order of time: `time` on the reference clock in microseconds, `position` and `gaze` in metres in the motion's
        frame, `fov` in radians.
        """
        fields = {"name": name, "seconds": seconds, "camera": [dict(key) for key in camera] or None}
        body = {key: value for key, value in fields.items() if value is not None}
        return await self._request("POST", f"/v1/sessions/{quote(session, safe='')}/recordings", json=body)

    async def share(
        self, *, session: str | None = None, motion: str | None = None, seconds: int | None = None
    ) -> dict[str, Any]:
        """Create a share link for viewers of a session or a motion, valid for `seconds` (default: a week).

        The result's `link` is appended to the server's address; `id` revokes it.
        """
        fields = {"session": session, "motion": motion, "seconds": seconds}
        body = {key: value for key, value in fields.items() if value is not None}
        return await self._request("POST", "/v1/shares", json=body)

    async def shares(self) -> list[dict[str, Any]]:
        """Return the newest share links of this subject, or of all subjects for an admin."""
        items: list[dict[str, Any]] = (await self._request("GET", "/v1/shares", params={"limit": 200}))["items"]
        return items

    async def revoke_share(self, share: str) -> None:
        """Revoke a share link; connections that use it are closed."""
        await self._request("DELETE", f"/v1/shares/{quote(share, safe='')}")

    def socket_url(self, path: str) -> str:
        """Return the WebSocket URL of a path of this server."""
        parts = urlsplit(self.url)
        scheme = {"http": "ws", "https": "wss"}.get(parts.scheme, parts.scheme)
        return urlunsplit((scheme, parts.netloc, parts.path.rstrip("/") + path, "", ""))

    async def _upload_file(
        self,
        path: Path,
        endpoint: str,
        progress: Callable[[int, int], None] | None,
        on_stage: Callable[[str, float], None] | None,
        query: Mapping[str, str] = MappingProxyType({}),
    ) -> dict[str, Any]:
        """Send a file to an endpoint, with the callbacks of `upload`."""
        size = await asyncio.to_thread(os.path.getsize, path)
        name = secrets.token_urlsafe(16)

        async def chunks() -> AsyncIterator[bytes]:
            sent = 0
            with path.open("rb") as file:
                while chunk := file.read(CHUNK_BYTES):
                    yield chunk
                    sent += len(chunk)
                    if progress is not None:
                        progress(sent, size)

        async with self._report_progress(name, on_stage):
            return await self._request(
                "POST",
                endpoint,
                params={"filename": path.name, "upload": name, **query},
                content=chunks(),
                headers={"Content-Length": str(size), "Content-Type": "application/octet-stream"},
            )

    @contextlib.asynccontextmanager
    async def _report_progress(self, upload: str, on_stage: Callable[[str, float], None] | None) -> AsyncIterator[None]:
        """Report the progress of an upload during the block."""
        if on_stage is None:
            yield
            return
        polling = asyncio.create_task(self._poll_progress(upload, on_stage))
        try:
            yield
        finally:
            polling.cancel()
            await asyncio.wait((polling,))

    async def _poll_progress(self, upload: str, on_stage: Callable[[str, float], None]) -> None:
        """Report the progress of an upload until cancelled. Failures are ignored: the upload's own answer counts."""
        while True:
            await asyncio.sleep(PROGRESS_INTERVAL_S)
            with contextlib.suppress(ServerProblem, httpx2.TransportError):
                progress = await self._request("GET", f"/v1/uploads/{upload}")
                if progress["stage"] != "receiving":
                    done = progress.get("take", 1) - 1 + progress["share"]
                    on_stage(progress["stage"], done / progress.get("takes", 1))

    async def _list(self, path: str, query: Mapping[str, str] = MappingProxyType({})) -> list[dict[str, Any]]:
        """Return the items of all pages of a list."""
        items: list[dict[str, Any]] = []
        params: dict[str, Any] = {"limit": 200, **query}
        while True:
            page = await self._request("GET", path, params=params)
            items += page["items"]
            if page["next"] is None:
                return items
            params["cursor"] = page["next"]

    async def _get_bytes(self, path: str) -> bytes:
        response = await self._http.get(path)
        if not response.is_success:
            body = self._parse_body(response)
            raise ServerProblem(response.status_code, body if isinstance(body, dict) else {})
        return response.content

    async def _request(self, method: str, path: str, **options: Any) -> dict[str, Any]:
        response = await self._http.request(method, path, **options)
        if response.status_code == 204:
            return {}
        body = self._parse_body(response)
        if not response.is_success or not isinstance(body, dict):
            raise ServerProblem(response.status_code, body if isinstance(body, dict) else {})
        return body

    def _parse_body(self, response: httpx2.Response) -> Any:
        try:
            return response.json()
        except ValueError:
            return {
                "title": "Not a Bunraku server",
                "detail": f"{self.url} answered {response.status_code} without JSON",
            }
