"""The gateway's paths are those of the services: each route of the interface goes to the one that has it."""

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
    """The named matchers, as expressions."""
    found = {}
    for name, kind, given in re.findall(r"^\t@(\w+) (path|path_regexp) (.+)$", CADDYFILE, re.MULTILINE):
        if kind == "path_regexp":
            found[f"@{name}"] = re.compile(given)
        else:
            words = (re.escape(word).replace(r"\*", ".*") for word in given.split())
            found[f"@{name}"] = re.compile(f"^({'|'.join(words)})$")
    return found


def read_handles() -> list[tuple[str, str]]:
    """What is handled, in order, and by which service."""
    return re.findall(
        r"^\thandle ?(\S*) \{\n\t\treverse_proxy \{\n\t\t\tdynamic a (\w+) 8000 \{", CADDYFILE, re.MULTILINE
    )


def service_for(path: str) -> str:
    """Who answers a path."""
    known = read_matchers()
    for matcher, service in read_handles():
        if not matcher or matcher == path or (matcher in known and known[matcher].search(path)):
            return service
    raise AssertionError(f"nobody answers {path}")


def routes(service: str) -> Iterator[str]:
    """The paths of a service's app, an id put in for each parameter."""
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
        "/v1/motions",
        "/v1/motions/{motion}",
        "/v1/motions/{motion}/audio",
        "/v1/motions/{motion}/scene",
        "/v1/motions/{motion}/performers",
        "/v1/uploads/{upload}",
    ],
    "ik": ["/v1/arms/{proportions}/table", "/v1/arms/{proportions}/figures/{name}", "/v1/solve"],
    "session": [
        "/v1/sessions",
        "/v1/sessions/{session}",
        "/v1/sessions/{session}/recordings",
        "/v1/sessions/{session}/control",
    ],
}


async def paths(folder: Path, service: str) -> set[str]:
    """The paths of a service's app, but those with which it describes itself."""
    async with open_context(Settings(data=folder)) as backing:
        made: dict[str, Callable[[], FastAPI]] = {
            "stream": lambda: bunraku.stream.app.create_app(backing),
            "ingest": lambda: bunraku.ingest.app.create_app(backing),
            "ik": bunraku.ik.app.create_app,
            "session": lambda: bunraku.session.app.create_app(backing),
        }
        found = {str(getattr(route, "path", "")) for route in made[service]().routes}
    return {path for path in found if path.startswith("/v1/")}


@pytest.mark.parametrize("service", sorted(APPS))
async def test_what_a_service_answers_comes_to_it(service: str, tmp_path: Path) -> None:
    assert await paths(tmp_path, service) == set(APPS[service])
    for path in routes(service):
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
def test_all_else_is_the_pages(path: str) -> None:
    assert service_for(path) == "page"


def test_each_way_comes_upon_replicas_as_they_come_and_go() -> None:
    assert len(read_handles()) == CADDYFILE.count("reverse_proxy {") == CADDYFILE.count("\t\t\timport replicas\n") == 6
    assert {service for _, service in read_handles()} == {*APPS, "page"}
