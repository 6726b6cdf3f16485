"""Routing of the gateway: each route of the HTTP API goes to the service that has it."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from fastapi import FastAPI

import bunraku.ik.app
import bunraku.ingest.app
import bunraku.session.app
import bunraku.stream.app
from bunraku.runtime.context import open_context
from bunraku.runtime.settings import Settings
from tests.conftest import REPOSITORY

CADDYFILE = (REPOSITORY / "deploy" / "Caddyfile").read_text()


def read_matchers() -> dict[str, re.Pattern[str]]:
    """Return the named matchers of the Caddyfile as regular expressions."""
    found = {}
    for name, kind, patterns in re.findall(r"^\t@(\w+) (path|path_regexp) (.+)$", CADDYFILE, re.MULTILINE):
        if kind == "path_regexp":
            found[f"@{name}"] = re.compile(patterns)
        else:
            words = (re.escape(word).replace(r"\*", ".*") for word in patterns.split())
            found[f"@{name}"] = re.compile(f"^({'|'.join(words)})$")
    return found


def read_handles() -> list[tuple[str, str]]:
    """Return the `handle` blocks in order: matcher and service."""
    return re.findall(
        r"^\thandle ?(\S*) \{\n\t\treverse_proxy \{\n\t\t\tdynamic a (\w+) 8000 \{", CADDYFILE, re.MULTILINE
    )


def service_for(path: str) -> str:
    """Return the service to which the gateway routes a path."""
    matchers = read_matchers()
    for matcher, service in read_handles():
        if not matcher or matcher == path or (matcher in matchers and matchers[matcher].search(path)):
            return service
    raise AssertionError(f"no handle block matches {path}")


def sample_paths(service: str) -> Iterator[str]:
    """Yield the paths of a service with an id for each parameter."""
    for route in APPS[service]:
        yield re.sub(r"\{[^}]+\}", "1234abcd", route)


APPS: dict[str, list[str]] = {
    "stream": [
        "/v1/motions/{motion}/description",
        "/v1/motions/{motion}/blocks/{rate}/{index}",
        "/v1/motions/{motion}/stream",
        "/v1/sessions/{session}/stream",
    ],
    "ingest": [
        "/v1/motions/{motion}/edits",
        "/v1/motions/{motion}/encodings",
        "/v1/motions/{motion}/thumbnail",
        "/v1/motions",
        "/v1/motions/{motion}",
        "/v1/motions/{motion}/audio",
        "/v1/motions/{motion}/scene",
        "/v1/motions/{motion}/performers",
        "/v1/uploads/{upload}",
        "/v1/props",
        "/v1/props/{prop}",
        "/v1/props/{prop}/model",
    ],
    "ik": ["/v1/arms/{proportions}/table", "/v1/arms/{proportions}/figures/{name}", "/v1/solve"],
    "session": [
        "/v1/sessions",
        "/v1/sessions/{session}",
        "/v1/sessions/{session}/recordings",
        "/v1/sessions/{session}/control",
        "/v1/performers",
        "/v1/performers/{performer}",
        "/v1/performers/{performer}/input",
    ],
}


async def app_paths(folder: Path, service: str) -> set[str]:
    """Return the paths of a service's app, without those of its documentation."""
    async with open_context(Settings(data=folder)) as context:
        factories: dict[str, Callable[[], FastAPI]] = {
            "stream": lambda: bunraku.stream.app.create_app(context),
            "ingest": lambda: bunraku.ingest.app.create_app(context),
            "ik": bunraku.ik.app.create_app,
            "session": lambda: bunraku.session.app.create_app(context),
        }
        found = {str(getattr(route, "path", "")) for route in factories[service]().routes}
    return {path for path in found if path.startswith("/v1/")}


@pytest.mark.parametrize("service", sorted(APPS))
async def test_gateway_routes_every_path_of_a_service_to_it(service: str, tmp_path: Path) -> None:
    assert await app_paths(tmp_path, service) == set(APPS[service])
    for path in sample_paths(service):
        assert service_for(path) == service, path


@pytest.mark.parametrize(
    "path",
    [
        "/",
        "/assets/index-abc.js",
        "/v1/docs",
        "/v1/openapi.json",
        "/v1/health",
        "/v1/nothing",
        "/v1/tickets",
        "/v1/shares",
    ],
)
def test_other_path_goes_to_the_page(path: str) -> None:
    assert service_for(path) == "page"


def test_every_service_is_resolved_dynamically() -> None:
    assert len(read_handles()) == CADDYFILE.count("reverse_proxy {") == CADDYFILE.count("\t\t\timport replicas\n") == 6
    assert {service for _, service in read_handles()} == {*APPS, "page"}
