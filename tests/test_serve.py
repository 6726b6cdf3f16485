from __future__ import annotations

import contextlib
import gc
import gzip
import re
import resource
import socket
from pathlib import Path

import httpx2
import pytest

from bunraku import __version__, serve
from bunraku.runtime.settings import Settings
from tests.servers import run_server


async def test_all_services_are_served_and_described(server: str) -> None:
    async with httpx2.AsyncClient(base_url=server) as http:
        assert (await http.get("/v1/health")).json() == {"status": "ok", "version": __version__}
        described = (await http.get("/v1/openapi.json")).json()
    routes = {(path, method) for path, methods in described["paths"].items() for method in methods}
    assert routes >= {
        ("/v1/motions", "post"),
        ("/v1/motions", "get"),
        ("/v1/motions/{motion}", "get"),
        ("/v1/motions/{motion}", "delete"),
        ("/v1/motions/{motion}/description", "get"),
        ("/v1/motions/{motion}/blocks/{rate}/{index}", "get"),
        ("/v1/sessions", "post"),
        ("/v1/sessions/{session}", "patch"),
        ("/v1/arms/{proportions}/table", "get"),
        ("/v1/solve", "post"),
        ("/v1/health", "get"),
    }


async def test_reference_of_the_api_loads_only_files_of_this_server(server: str) -> None:
    async with httpx2.AsyncClient(base_url=server) as http:
        page = await http.get("/v1/docs")
        assert (page.status_code, page.headers["content-type"]) == (200, "text/html; charset=utf-8")
        policy = dict(one.split(" ", 1) for one in page.headers["content-security-policy"].split("; "))
        assert policy["default-src"] == policy["frame-ancestors"] == policy["base-uri"] == "'none'"
        assert policy["script-src"] == policy["style-src"] == policy["connect-src"] == "'self'"
        assert page.headers["x-frame-options"] == "DENY"
        assert page.headers["x-content-type-options"] == "nosniff"
        # neither inline scripts and styles nor event handlers
        assert re.findall(r"<script(?![^>]*src=)|<style|style=|\son\w+=", page.text) == []
        files = re.findall(r'<(?:script|link)[^>]*(?:src|href)="(?!data:)([^"]+)"', page.text)
        assert len(files) >= 2
        for file in files:
            address = page.url.join(file)
            assert (address.host, address.port) == (page.url.host, page.url.port)
            asset = await http.get(address)
            assert asset.status_code == 200
            assert "immutable" in asset.headers["cache-control"]
            assert not re.findall(r"https?://(?!www\.w3\.org)", asset.text)


@pytest.mark.parametrize("path", ["/docs", "/docs/", "/redoc", "/docs/oauth2-redirect", "/openapi.json", "/v1/docs/"])
async def test_documentation_has_no_other_address(server: str, path: str) -> None:
    async with httpx2.AsyncClient(base_url=server) as http:
        assert (await http.get(path)).status_code == 404


async def test_reference_says_how_to_build_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(serve, "PAGE_FOLDER", tmp_path / "nowhere")
    async with serve.compose_app(Settings(data=tmp_path / "data"), services=("stream",)) as app:
        transport = httpx2.ASGITransport(app)
        async with httpx2.AsyncClient(transport=transport, base_url="http://stage") as http:
            answer = await http.get("/v1/docs")
    assert answer.status_code == 503
    assert answer.headers["content-type"] == "application/problem+json"
    assert "make setup" in answer.json()["hint"]


async def test_page_process_describes_the_whole_api(tmp_path: Path, server: str) -> None:
    async with httpx2.AsyncClient(base_url=server) as http:
        description = (await http.get("/v1/openapi.json")).json()["paths"]
    async with serve.compose_app(Settings(data=tmp_path), services=("page",)) as app:
        transport = httpx2.ASGITransport(app)
        async with httpx2.AsyncClient(transport=transport, base_url="http://stage") as http:
            assert (await http.get("/v1/openapi.json")).json()["paths"] == description
            assert (await http.get("/readyz")).json() == {"status": "ready"}
            assert (await http.get("/v1/motions")).status_code != 200


def test_server_that_is_cancelled_closes_its_connections(tmp_path: Path) -> None:
    with contextlib.ExitStack() as clients:
        with run_server(tmp_path) as url:
            port = int(url.rpartition(":")[2])
            opened = [clients.enter_context(socket.create_connection(("127.0.0.1", port))) for _ in range(3)]
            for client in opened:
                client.sendall(b"GET /v1/health HTTP/1.1\r\nHost: a\r\n\r\n")
                assert client.recv(12) == b"HTTP/1.1 200"
        # a transport that was not closed warns when it is collected, and the warning fails this test
        gc.collect()


def test_server_raises_the_open_file_limit(tmp_path: Path) -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    low = min(512, hard)
    resource.setrlimit(resource.RLIMIT_NOFILE, (low, hard))
    try:
        with run_server(tmp_path / "data", services=("stream",)):
            assert resource.getrlimit(resource.RLIMIT_NOFILE) == (hard, hard)
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


async def test_server_with_all_services_is_ready(server: str) -> None:
    async with httpx2.AsyncClient(base_url=server) as http:
        assert (await http.get("/livez")).json() == {"status": "ok"}
        assert (await http.get("/readyz")).json() == {"status": "ready"}


@pytest.mark.parametrize("path", ["/v1/nothing", "/v1/motions/none", "/v1/sessions/none"])
async def test_missing_resource_is_a_problem_document(server: str, path: str) -> None:
    async with httpx2.AsyncClient(base_url=server) as http:
        answer = await http.get(path)
    assert answer.status_code == 404
    assert answer.headers["content-type"] == "application/problem+json"


async def test_page_is_revalidated_and_its_assets_are_immutable(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = tmp_path / "page"
    (page / "assets").mkdir(parents=True)
    (page / "index.html").write_text("<!doctype html><title>Bunraku</title>" + " " * 2000)
    (page / "index.html.gz").write_bytes(gzip.compress((page / "index.html").read_bytes()))
    (page / "assets" / "index-abc.js").write_text("export {};" * 500)
    monkeypatch.setattr(serve, "PAGE_FOLDER", page)
    with run_server(tmp_path / "data") as url:
        async with httpx2.AsyncClient(base_url=url) as http:
            index = await http.get("/")
            script = await http.get("/assets/index-abc.js")
            missing = await http.get("/assets/other.js")
    assert index.headers["cache-control"] == "no-cache"
    assert index.headers["content-encoding"] == "gzip"
    assert "immutable" in script.headers["cache-control"]
    assert missing.status_code == 404


async def test_only_embed_scripts_have_open_cors(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = tmp_path / "page"
    (page / "assets").mkdir(parents=True)
    (page / "embed" / "parts").mkdir(parents=True)
    for name in ("index.html", "assets/index-abc.js", "embed/bunraku-stage.js", "embed/parts/stage-abc.js"):
        (page / name).write_text("export {};" * 500)
    monkeypatch.setattr(serve, "PAGE_FOLDER", page)
    immutable = "public, max-age=31536000, immutable"
    for origins, allowed in (("", "*"), ("https://dance.example", "https://dance.example")):
        with run_server(tmp_path / "data", origins=origins) as url:
            async with httpx2.AsyncClient(base_url=url) as http:
                expected_by_origin = {None: "*", "https://dance.example": allowed, "https://other.example": "*"}
                for origin, expected in expected_by_origin.items():
                    headers = {"Origin": origin} if origin else {}
                    entry = await http.get("/embed/bunraku-stage.js", headers=headers)
                    part = await http.get("/embed/parts/stage-abc.js", headers=headers)
                    for answer, cache_control in ((entry, "no-cache"), (part, immutable)):
                        assert answer.status_code == 200
                        assert answer.headers["cache-control"] == cache_control
                        # both responses allow the origin of the requesting page
                        assert answer.headers["access-control-allow-origin"] == expected
                        assert "javascript" in answer.headers["content-type"]
                revalidated = await http.get(
                    "/embed/bunraku-stage.js", headers={"If-None-Match": entry.headers["etag"]}
                )
                assert revalidated.status_code == 304
                own = await http.get("/assets/index-abc.js", headers={"Origin": "https://other.example"})
                assert "access-control-allow-origin" not in own.headers


async def test_missing_page_build_is_a_503_with_instructions(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(serve, "PAGE_FOLDER", tmp_path / "nowhere")
    async with serve.compose_app(Settings(data=tmp_path / "data")) as app:
        transport = httpx2.ASGITransport(app)
        async with httpx2.AsyncClient(transport=transport, base_url="http://stage") as http:
            answer = await http.get("/")
    assert answer.status_code == 503
    assert "make setup" in answer.text
