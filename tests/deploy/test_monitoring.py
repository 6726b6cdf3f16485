"""Monitoring of the stack: Prometheus settings, alert rules and dashboard, on a real Prometheus and real services."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any
from urllib.parse import urlencode
from urllib.request import urlopen

import httpx2
import pytest
import yaml

from bunraku.client import Client, Puppeteer
from tests.conftest import REPOSITORY
from tests.patient_viewer import PatientViewer
from tests.processes import ServerProcess, find_program, free_port, nats_url_of, run_jetstream
from tests.servers import make_bvh_clip
from tests.time_limit import HANG_TIMEOUT_S

OBSERVE = REPOSITORY / "deploy" / "observe"
DASHBOARD: dict[str, Any] = json.loads((OBSERVE / "dashboard.json").read_text())
CONFIG: dict[str, Any] = yaml.safe_load((OBSERVE / "prometheus.yml").read_text())


def dashboard_queries() -> list[tuple[str, str]]:
    """Return the panel title and expression of every query of the dashboard."""
    return [(panel["title"], target["expr"]) for panel in DASHBOARD["panels"] for target in panel["targets"]]


class Prometheus:
    """Client of the API of a Prometheus server."""

    def __init__(self, process: ServerProcess) -> None:
        self._url = f"http://127.0.0.1:{process.port}/api/v1"

    def get(self, path: str, **query: str) -> Any:
        """Return the `data` of a response; fail unless its status is success."""
        with urlopen(f"{self._url}/{path}?{urlencode(query)}", timeout=HANG_TIMEOUT_S) as http_response:
            response = json.load(http_response)
        assert response["status"] == "success", response
        return response["data"]

    def query(self, expression: str) -> list[Any]:
        """Return the current result of an expression."""
        return list(self.get("query", query=expression)["result"])


@pytest.fixture
def services(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[dict[str, tuple[ServerProcess, int]]]:
    """Start two processes; return each with its metrics port, by service name."""
    monkeypatch.setenv("NO_COLOR", "1")
    (tmp_path / "nats").mkdir()
    with ExitStack() as stack, run_jetstream(tmp_path / "nats") as nats:
        monkeypatch.setenv("BUNRAKU_BUS", nats_url_of(nats))
        started: dict[str, tuple[ServerProcess, int]] = {}
        for name, more_options in (("session", ["--service", "ingest"]), ("stream", [])):
            port, metrics = free_port(), free_port()
            monkeypatch.setenv("BUNRAKU_METRICS", f"127.0.0.1:{metrics}")
            (tmp_path / name).mkdir()
            command = [sys.executable, "-m", "bunraku.cli", "up", "--port", str(port), "--service", name, *more_options]
            process = ServerProcess([*command, "--data", str(tmp_path / "data")], port, tmp_path / name)
            stack.callback(process.stop)
            process.start()
            started[name] = process, metrics
        yield started


@pytest.fixture
def prometheus(tmp_path: Path, services: dict[str, tuple[ServerProcess, int]]) -> Iterator[Prometheus]:
    """Start Prometheus with the settings of the stack, but with static targets instead of DNS discovery."""
    program = find_program("prometheus")
    folder = tmp_path / "prometheus"
    folder.mkdir()
    (job,) = CONFIG["scrape_configs"]
    targets = [
        {"targets": [f"127.0.0.1:{port}"], "labels": {"__meta_dns_name": name}} for name, (_, port) in services.items()
    ]
    scrape_config = {**{key: value for key, value in job.items() if key != "dns_sd_configs"}, "static_configs": targets}
    (folder / "prometheus.yml").write_text(yaml.safe_dump({**CONFIG, "scrape_configs": [scrape_config]}))
    (folder / "rules.yml").write_text((OBSERVE / "rules.yml").read_text())
    port = free_port()
    options = [f"--web.listen-address=127.0.0.1:{port}", f"--storage.tsdb.path={folder / 'data'}"]
    process = ServerProcess([program, f"--config.file={folder / 'prometheus.yml'}", *options], port, folder)
    try:
        process.start()
        yield Prometheus(process)
    finally:
        process.stop()


async def use_services(services: dict[str, tuple[ServerProcess, int]], source: Path) -> None:
    """Use every service, so that every metric has a value."""
    urls = {name: f"http://127.0.0.1:{process.port}" for name, (process, _) in services.items()}
    async with Client(urls["session"]) as client:
        motion = (await client.upload(source))["id"]
        session = (await client.open_session(motion))["id"]
        async with Puppeteer(client, session, "Aiko") as puppeteer:
            await puppeteer.claim("left_hand")
            for step in range(10):
                await puppeteer.target("left_hand", 0.3 + 0.01 * step, 0.1, 0.4)
            await PatientViewer(Client(urls["stream"]).socket_url(f"/v1/sessions/{session}/stream")).watch(1)
    async with httpx2.AsyncClient(base_url=urls["stream"]) as http:
        assert (await http.get("/v1/nothing")).status_code == 404


async def test_every_panel_and_rule_has_data(
    tmp_path: Path, prometheus: Prometheus, services: dict[str, tuple[ServerProcess, int]]
) -> None:
    source = tmp_path / "one.bvh"
    source.write_bytes(make_bvh_clip(4.0, 1))
    end = time.monotonic() + HANG_TIMEOUT_S
    # a counter has no rate after its first increment: repeat until every panel has data
    missing = dashboard_queries()
    while missing:
        await use_services(services, source)
        missing = [(title, one) for title, one in missing if not prometheus.query(one)]
        assert time.monotonic() < end, missing
    targets = {target["labels"]["service"]: target for target in prometheus.get("targets")["activeTargets"]}
    assert targets.keys() == services.keys()
    assert all(target["health"] == "up" and not target["lastError"] for target in targets.values())

    (group,) = prometheus.get("rules")["groups"]
    rules = {rule["name"]: rule for rule in group["rules"]}
    assert len(rules) == 5
    while any(rule["health"] == "unknown" for rule in rules.values()):
        assert time.monotonic() < end, rules
        rules = {rule["name"]: rule for rule in prometheus.get("rules")["groups"][0]["rules"]}
    assert [rule["lastError"] for rule in rules.values() if rule.get("lastError")] == []
    # two of five services run; SolvingLate may fire on a slow machine
    assert {name for name, rule in rules.items() if rule["state"] != "inactive"} - {"SolvingLate"} == {"ServiceMissing"}


def test_prometheus_accepts_the_settings() -> None:
    program = find_program("promtool")
    for command in (["config", "--syntax-only", "prometheus.yml"], ["rules", "rules.yml"]):
        checked = subprocess.run([program, "check", *command], cwd=OBSERVE, capture_output=True, text=True, check=False)
        assert checked.returncode == 0, checked.stdout + checked.stderr
    (job,) = CONFIG["scrape_configs"]
    (query,) = job["dns_sd_configs"]
    compose = yaml.safe_load((REPOSITORY / "docker-compose.yml").read_text())["services"]
    services_with_metrics = {
        name for name, service in compose.items() if "BUNRAKU_METRICS" in service.get("environment", {})
    }
    assert set(query["names"]) == services_with_metrics
    assert {compose[name]["environment"]["BUNRAKU_METRICS"] for name in services_with_metrics} == {
        f"0.0.0.0:{query['port']}"
    }


def test_every_panel_has_description_unit_and_legend() -> None:
    assert len(DASHBOARD["panels"]) <= 16
    for panel in DASHBOARD["panels"]:
        assert panel["description"].endswith((".", "hidden"))
        assert panel["fieldConfig"]["defaults"]["unit"]
        assert all(target["legendFormat"] for target in panel["targets"])
    positions = [(p["gridPos"]["x"], p["gridPos"]["y"]) for p in DASHBOARD["panels"]]
    assert len(set(positions)) == len(positions)
    source = yaml.safe_load((OBSERVE / "datasource.yml").read_text())["datasources"][0]["uid"]
    assert {panel["datasource"]["uid"] for panel in DASHBOARD["panels"]} == {source}


def test_images_contain_every_monitoring_file() -> None:
    dockerfile = (REPOSITORY / "deploy" / "Dockerfile").read_text()
    copied = set(re.findall(r"deploy/observe/(\S+)", dockerfile))
    assert copied == {path.name for path in OBSERVE.iterdir()}


@pytest.mark.parametrize(
    ("address", "password", "anonymous", "login"),
    [
        ("127.0.0.1", "", "true", False),
        ("", "", "true", False),
        ("localhost", "a password", "true", True),
        ("0.0.0.0", "a password", "false", True),
        ("192.0.2.1", "a password", "false", True),
    ],
)
def test_grafana_needs_a_login_unless_it_listens_on_loopback(
    address: str, password: str, anonymous: str, login: bool
) -> None:
    environment = {"BUNRAKU_GRAFANA_ADDRESS": address, "BUNRAKU_GRAFANA_PASSWORD": password, "GRAFANA": "/usr/bin/env"}
    environment["PATH"] = os.environ["PATH"]
    result = subprocess.run([OBSERVE / "grafana"], env=environment, capture_output=True, text=True, check=True)
    settings = dict(line.split("=", 1) for line in result.stdout.splitlines() if line.startswith("GF_"))
    assert settings["GF_AUTH_ANONYMOUS_ENABLED"] == anonymous
    assert (settings.get("GF_SECURITY_ADMIN_PASSWORD") == password) == login
    assert len(settings["GF_SECURITY_ADMIN_PASSWORD"]) == (len(password) if login else 44)
    assert (settings.get("GF_AUTH_DISABLE_LOGIN_FORM") == "true") == (not login)


def test_published_grafana_refuses_to_start_without_a_password() -> None:
    environment = {"BUNRAKU_GRAFANA_ADDRESS": "0.0.0.0", "BUNRAKU_GRAFANA_PASSWORD": "", "GRAFANA": "/usr/bin/env"}
    result = subprocess.run([OBSERVE / "grafana"], env=environment, capture_output=True, text=True, check=False)
    assert result.returncode == 1
    assert "set BUNRAKU_GRAFANA_PASSWORD" in result.stderr
