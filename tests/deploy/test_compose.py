"""What docker-compose.yml promises of every service, without an engine."""

from __future__ import annotations

import re
from typing import Any

import pytest
import yaml

from tests.conftest import REPOSITORY

COMPOSE: dict[str, Any] = yaml.safe_load((REPOSITORY / "docker-compose.yml").read_text())
DOCKERFILE = (REPOSITORY / "deploy" / "Dockerfile").read_text()
SERVICES: dict[str, dict[str, Any]] = COMPOSE["services"]
STOCK = {
    "python:3.13-slim", "node:20-slim", "nats:2.10-alpine", "postgres:17", "caddy:2",
    "prom/prometheus:v3.13.1", "grafana/grafana:12.4.2",
}  # fmt: skip
OURS = {"bunraku", "bunraku-gateway", "bunraku-bus", "bunraku-prometheus", "bunraku-grafana"}
OBSERVE = {"prometheus", "grafana"}


def test_the_whole_house_is_there() -> None:
    always = {name for name, service in SERVICES.items() if "profiles" not in service}
    assert always == {"gateway", "ingest", "stream", "ik", "session", "page", "nats", "postgres"}
    assert {name for name, service in SERVICES.items() if service.get("profiles") == ["observe"]} == OBSERVE
    assert set(SERVICES) == always | OBSERVE
    assert {name: one["scale"] for name, one in SERVICES.items() if "scale" in one} == {"stream": 2, "session": 2}


@pytest.mark.parametrize("name", SERVICES)
def test_every_service_may_do_no_more_than_it_must(name: str) -> None:
    service = SERVICES[name]
    assert service["read_only"] is True
    assert service["cap_drop"] == ["ALL"]
    assert "cap_add" not in service
    assert "privileged" not in service
    assert "no-new-privileges:true" in service["security_opt"]
    assert service["user"] not in ("", "0", "root", "0:0")
    assert re.fullmatch(r"\d+[mg]", service["mem_limit"])
    assert service["pids_limit"] > 0


@pytest.mark.parametrize("name", SERVICES)
def test_every_service_is_looked_after_and_ends_in_order(name: str) -> None:
    service = SERVICES[name]
    assert service["healthcheck"]["test"][0] == "CMD"
    assert service["restart"] == "always"
    assert service["init"] is True
    assert re.fullmatch(r"\d+s", service["stop_grace_period"])


def test_nothing_but_the_gateway_is_reached_from_outside_and_that_from_this_machine_alone() -> None:
    assert [name for name, service in SERVICES.items() if "ports" in service] == ["gateway", "grafana"]
    assert SERVICES["gateway"]["ports"] == ["${BUNRAKU_ADDRESS:-127.0.0.1}:${BUNRAKU_PORT:-8080}:8080"]
    assert COMPOSE["networks"]["backing"] == {"internal": True}
    for name in ("nats", "postgres"):
        assert SERVICES[name]["networks"] == ["backing"]
    assert SERVICES["gateway"]["networks"] == ["gateway"]


def test_who_observes_reaches_no_more_than_it_must() -> None:
    address, port = "${BUNRAKU_GRAFANA_ADDRESS:-127.0.0.1}", "${BUNRAKU_GRAFANA_PORT:-3000}"
    assert SERVICES["grafana"]["ports"] == [f"{address}:{port}:3000"]
    assert SERVICES["grafana"]["environment"]["BUNRAKU_GRAFANA_ADDRESS"] == address
    # the services are Prometheus's to ask, and Prometheus is Grafana's
    assert SERVICES["prometheus"]["networks"] == ["backing", "observing"]
    assert SERVICES["grafana"]["networks"] == ["observing", "looking"]
    assert COMPOSE["networks"]["observing"] == {"internal": True}
    for name in ("ingest", "stream", "ik", "session", "page"):
        given = SERVICES[name]["environment"]
        assert (given["BUNRAKU_METRICS"], given["BUNRAKU_LOGS"]) == ("0.0.0.0:9100", "json")
    assert "9100" not in (REPOSITORY / "deploy" / "Caddyfile").read_text()
    for service in SERVICES.values():
        # a volume of its own, and nothing of this machine
        assert all(re.fullmatch(r"[a-z]+:/\S+|/\S+", one) for one in service.get("volumes", []))


def test_every_password_can_be_given() -> None:
    text = (REPOSITORY / "docker-compose.yml").read_text()
    for line in text.splitlines():
        if "PASSWORD" in line:
            assert re.search(r"\$\{BUNRAKU_((BUS|CATALOGUE)_PASSWORD:-bunraku|GRAFANA_PASSWORD:-)\}", line), line


def test_what_can_be_given_is_documented_and_nothing_else() -> None:
    given = set(re.findall(r"\$\{(\w+)", (REPOSITORY / "docker-compose.yml").read_text()))
    readme = (REPOSITORY / "deploy" / "README.md").read_text()
    settings = readme.partition("\n## Settings\n")[2].partition("\n**")[0]
    assert set(re.findall(r"`((?:BUNRAKU|AWS)_\w+)`", settings)) == given


def test_images_are_ours_or_stock_and_none_names_a_registry() -> None:
    begun = re.findall(r"^FROM (\S+) AS (\S+)$", DOCKERFILE, re.MULTILINE)
    targets = {target for _, target in begun}
    assert len(begun) == len(re.findall(r"^FROM ", DOCKERFILE, re.MULTILINE))
    assert {image for image, _ in begun} <= STOCK
    for service in SERVICES.values():
        assert service["image"] in OURS | STOCK
        assert ("build" in service) == (service["image"] in OURS)
        if "build" in service:
            assert service["build"]["target"] in targets


def test_an_image_runs_as_nobody_in_particular_and_says_what_it_is() -> None:
    for target in ("bunraku", "bus", "gateway"):
        stage = DOCKERFILE.partition(f" AS {target}\n")[2].partition("\nFROM ")[0]
        assert "\nUSER 10001:10001\n" in stage
    for label in ("title", "description", "version", "revision"):
        assert f"org.opencontainers.image.{label}=" in DOCKERFILE
    assert "--require-hashes" in DOCKERFILE


def test_where_others_reach_the_gateway_the_services_need_a_secret() -> None:
    for name in ("ingest", "stream", "ik", "session", "page"):
        given = SERVICES[name]["environment"]
        assert given["BUNRAKU_PUBLISHED"] == "${BUNRAKU_ADDRESS:-127.0.0.1}"
        assert given["BUNRAKU_SECRET"] == "${BUNRAKU_SECRET:-}"
        # the gateway alone gets to them, and says who connects
        assert given["FORWARDED_ALLOW_IPS"] == "*"
        assert "ports" not in SERVICES[name]
