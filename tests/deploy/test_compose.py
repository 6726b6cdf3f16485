"""Settings of docker-compose.yml, checked without a container engine."""

from __future__ import annotations

import re
from typing import Any

import pytest
import yaml

from tests.conftest import REPOSITORY

COMPOSE: dict[str, Any] = yaml.safe_load((REPOSITORY / "docker-compose.yml").read_text())
DOCKERFILE = (REPOSITORY / "deploy" / "Dockerfile").read_text()
SERVICES: dict[str, dict[str, Any]] = COMPOSE["services"]
STOCK_IMAGES = {
    "python:3.13-slim", "node:20-slim", "nats:2.10-alpine", "postgres:17", "caddy:2",
    "prom/prometheus:v3.13.1", "grafana/grafana:12.4.2",
}  # fmt: skip
OWN_IMAGES = {"bunraku", "bunraku-gateway", "bunraku-bus", "bunraku-prometheus", "bunraku-grafana"}
OBSERVE_SERVICES = {"prometheus", "grafana"}


def test_compose_lists_every_service() -> None:
    default_services = {name for name, service in SERVICES.items() if "profiles" not in service}
    assert default_services == {"gateway", "ingest", "stream", "ik", "session", "page", "nats", "postgres"}
    assert {name for name, service in SERVICES.items() if service.get("profiles") == ["observe"]} == OBSERVE_SERVICES
    assert set(SERVICES) == default_services | OBSERVE_SERVICES
    assert {name: one["scale"] for name, one in SERVICES.items() if "scale" in one} == {"stream": 2, "session": 2}


@pytest.mark.parametrize("name", SERVICES)
def test_service_has_least_privileges(name: str) -> None:
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
def test_service_has_health_check_restart_and_grace_period(name: str) -> None:
    service = SERVICES[name]
    assert service["healthcheck"]["test"][0] == "CMD"
    assert service["restart"] == "always"
    assert service["init"] is True
    assert re.fullmatch(r"\d+s", service["stop_grace_period"])


def test_only_the_gateway_publishes_a_port_on_loopback() -> None:
    assert [name for name, service in SERVICES.items() if "ports" in service] == ["gateway", "grafana"]
    assert SERVICES["gateway"]["ports"] == ["${BUNRAKU_ADDRESS:-127.0.0.1}:${BUNRAKU_PORT:-8080}:8080"]
    assert COMPOSE["networks"]["backing"] == {"internal": True}
    for name in ("nats", "postgres"):
        assert SERVICES[name]["networks"] == ["backing"]
    assert SERVICES["gateway"]["networks"] == ["gateway"]


def test_monitoring_has_least_network_access() -> None:
    address, port = "${BUNRAKU_GRAFANA_ADDRESS:-127.0.0.1}", "${BUNRAKU_GRAFANA_PORT:-3000}"
    assert SERVICES["grafana"]["ports"] == [f"{address}:{port}:3000"]
    assert SERVICES["grafana"]["environment"]["BUNRAKU_GRAFANA_ADDRESS"] == address
    # Prometheus reaches the services, Grafana reaches Prometheus
    assert SERVICES["prometheus"]["networks"] == ["backing", "observing"]
    assert SERVICES["grafana"]["networks"] == ["observing", "looking"]
    assert COMPOSE["networks"]["observing"] == {"internal": True}
    for name in ("ingest", "stream", "ik", "session", "page"):
        environment = SERVICES[name]["environment"]
        assert (environment["BUNRAKU_METRICS"], environment["BUNRAKU_LOGS"]) == ("0.0.0.0:9100", "json")
    assert "9100" not in (REPOSITORY / "deploy" / "Caddyfile").read_text()
    for service in SERVICES.values():
        # named volumes only, no folder of the host
        assert all(re.fullmatch(r"[a-z]+:/\S+|/\S+", one) for one in service.get("volumes", []))


def test_every_password_can_be_set() -> None:
    text = (REPOSITORY / "docker-compose.yml").read_text()
    for line in text.splitlines():
        if "PASSWORD" in line:
            assert re.search(r"\$\{BUNRAKU_((BUS|CATALOGUE)_PASSWORD:-bunraku|GRAFANA_PASSWORD:-)\}", line), line


def test_readme_lists_exactly_the_settings_of_compose() -> None:
    environment = set(re.findall(r"\$\{(\w+)", (REPOSITORY / "docker-compose.yml").read_text()))
    readme = (REPOSITORY / "deploy" / "README.md").read_text()
    settings = readme.partition("\n## Settings\n")[2].partition("\n**")[0]
    assert set(re.findall(r"`((?:BUNRAKU|AWS)_\w+)`", settings)) == environment


def test_images_are_own_or_stock_without_a_registry() -> None:
    stages = re.findall(r"^FROM (\S+) AS (\S+)$", DOCKERFILE, re.MULTILINE)
    targets = {target for _, target in stages}
    assert len(stages) == len(re.findall(r"^FROM ", DOCKERFILE, re.MULTILINE))
    assert {image for image, _ in stages} <= STOCK_IMAGES
    for service in SERVICES.values():
        assert service["image"] in OWN_IMAGES | STOCK_IMAGES
        assert ("build" in service) == (service["image"] in OWN_IMAGES)
        if "build" in service:
            assert service["build"]["target"] in targets


def test_image_runs_unprivileged_and_has_labels() -> None:
    for target in ("bunraku", "bus", "gateway"):
        stage = DOCKERFILE.partition(f" AS {target}\n")[2].partition("\nFROM ")[0]
        assert "\nUSER 10001:10001\n" in stage
    for label in ("title", "description", "version", "revision"):
        assert f"org.opencontainers.image.{label}=" in DOCKERFILE
    assert "--require-hashes" in DOCKERFILE


def test_services_know_whether_the_gateway_is_published() -> None:
    for name in ("ingest", "stream", "ik", "session", "page"):
        environment = SERVICES[name]["environment"]
        assert environment["BUNRAKU_PUBLISHED"] == "${BUNRAKU_ADDRESS:-127.0.0.1}"
        assert environment["BUNRAKU_SECRET"] == "${BUNRAKU_SECRET:-}"
        # only the gateway reaches them, so its forwarded client address is trusted
        assert environment["FORWARDED_ALLOW_IPS"] == "*"
        assert "ports" not in SERVICES[name]
