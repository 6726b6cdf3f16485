"""Manifests of deploy/kubernetes: valid for a cluster, and equivalent to docker-compose.yml."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path
from typing import Any

import kubernetes_validate
import pytest
import yaml

from bunraku.serve import SERVICES
from tests.conftest import REPOSITORY
from tests.deploy.manifests import OVERLAYS, RenderedOverlay, find_kubectl, render_overlay
from tests.deploy.test_compose import DOCKERFILE, OWN_IMAGES
from tests.deploy.test_compose import SERVICES as ALL_COMPOSE_SERVICES
from tests.deploy.test_gateway import read_handles

COMPOSE_SERVICES = {name: one for name, one in ALL_COMPOSE_SERVICES.items() if "profiles" not in one}
"""Services that Compose starts without a profile."""
KUBERNETES_VERSIONS = ("1.27", "1.32", "1.37")
"""Versions of Kubernetes; the first is the oldest that the README supports."""
COMPOSE_ONLY = {
    "BUNRAKU_PUBLISHED": "a cluster always has a secret",
    "BUNRAKU_SECRET": "a file in a cluster",
    "BUNRAKU_SECRET_BEFORE": "as BUNRAKU_SECRET",
}
"""Variables set by Compose only, and the reason."""
KUBERNETES_ONLY = {
    "BUNRAKU_BUS_PASSWORD": "the pod, not Compose, builds addresses from it",
    "BUNRAKU_CATALOGUE_PASSWORD": "as for the bus",
    "BUNRAKU_SITE": "the gateway's, in the settings shared by all",
    "BUNRAKU_PROXIES": "part of BUNRAKU_TRUSTED_PROXIES",
    "BUNRAKU_REQUEST_TIMEOUT": "the gateway's",
    "BUNRAKU_SECRETS": "the folder of the files",
    "BUNRAKU_LOGS": "logs of a cluster are collected as JSON",
    "BUNRAKU_LOG_LEVEL": "set together with BUNRAKU_LOGS",
    "BUNRAKU_METRICS": "each pod has a separate port",
    "PGDATA": "a volume of a cluster may already contain a folder",
}
"""Variables set by Kubernetes only, and the reason."""
MEBIBYTES_PER_UNIT = {"m": 1, "g": 1024, "Mi": 1, "Gi": 1024}


def mebibytes(size: str) -> int:
    found = re.fullmatch(r"(\d+)([A-Za-z]+)", size)
    assert found is not None, size
    return int(found[1]) * MEBIBYTES_PER_UNIT[found[2]]


def tmpfs_sizes(service: dict[str, Any]) -> dict[str, int]:
    """Return the tmpfs folders of a Compose service and their sizes in MiB."""
    return {one.partition(":")[0]: mebibytes(one.partition("size=")[2].partition(",")[0]) for one in service["tmpfs"]}


@pytest.mark.parametrize("version", KUBERNETES_VERSIONS)
def test_manifest_matches_the_kubernetes_schema(rendered: RenderedOverlay, version: str) -> None:
    for manifest in rendered.manifests:
        kubernetes_validate.validate(manifest, version, strict=True)


def test_schema_rejects_an_unknown_field(laptop: RenderedOverlay) -> None:
    wrong = yaml.safe_load(yaml.safe_dump(laptop.of("Deployment")["stream"]))
    wrong["spec"]["template"]["spec"]["containers"][0]["securityContext"]["readOnlyRoot"] = True
    with pytest.raises(kubernetes_validate.ValidationError):
        kubernetes_validate.validate(wrong, KUBERNETES_VERSIONS[0], strict=True)


@pytest.mark.parametrize("overlay", OVERLAYS)
def test_rendering_fails_without_secrets(overlay: str, tmp_path: Path) -> None:
    render_overlay(tmp_path, overlay)
    folder = tmp_path / "kubernetes" / "overlays" / overlay
    (folder / "secret.env").unlink()
    result = subprocess.run([find_kubectl(), "kustomize", str(folder)], capture_output=True, text=True)
    assert result.returncode != 0
    assert "secret.env" in result.stderr


def test_overlay_contains_every_service(rendered: RenderedOverlay) -> None:
    assert set(rendered.pods()) == set(COMPOSE_SERVICES) == {*SERVICES, "gateway", "nats", "postgres"}
    assert {one["metadata"].get("namespace", "bunraku") for one in rendered.manifests} == {"bunraku"}


def test_replica_counts_equal_compose(laptop: RenderedOverlay) -> None:
    replicas = {name: one["spec"]["replicas"] for name, one in laptop.of("Deployment", "StatefulSet").items()}
    assert replicas == {name: one.get("scale", 1) for name, one in COMPOSE_SERVICES.items()}


@pytest.mark.parametrize("name", sorted(COMPOSE_SERVICES))
def test_container_settings_equal_compose(laptop: RenderedOverlay, name: str) -> None:
    compose_service, container, pod = COMPOSE_SERVICES[name], laptop.container(name), laptop.pods()[name]
    image, _, tag = container["image"].partition(":")
    assert image == compose_service["image"].partition(":")[0]
    assert image in OWN_IMAGES
    assert tag not in ("", "latest")
    assert container.get("args") == compose_service.get("command")
    user = {"postgres": "999:999"}.get(name, compose_service["user"])
    assert user == f"{pod['securityContext']['runAsUser']}:{pod['securityContext']['runAsGroup']}"
    assert mebibytes(container["resources"]["limits"]["memory"]) == mebibytes(compose_service["mem_limit"])
    assert pod["shareProcessNamespace"] is compose_service["init"]
    assert pod["terminationGracePeriodSeconds"] >= int(compose_service["stop_grace_period"].removesuffix("s"))


@pytest.mark.parametrize("name", sorted(COMPOSE_SERVICES))
def test_environment_equals_compose(laptop: RenderedOverlay, name: str) -> None:
    compose_service, environment = COMPOSE_SERVICES[name]["environment"], laptop.environment(name)
    assert set(compose_service) - set(environment) <= set(COMPOSE_ONLY)
    assert set(environment) - set(compose_service) <= set(KUBERNETES_ONLY)
    for variable in set(compose_service) & set(environment):
        # compare the default, with a reference to the password variable
        expected = re.sub(r"\$\{(\w*PASSWORD):-bunraku\}", r"$(\1)", str(compose_service[variable]))
        expected = expected.replace("* ${BUNRAKU_PROXIES:-127.0.0.1/32}", "* $(BUNRAKU_PROXIES)")
        expected = re.sub(r"^\$\{\w+:-(.*)\}$", r"\1", expected)
        if environment[variable].startswith("<"):
            secret = re.match(r"\$[({](\w+)", re.sub(r"\$\{(\w+):-.*", r"$(\1)", str(compose_service[variable])))
            assert secret is not None, variable
            assert environment[variable] == f"<{secret[1]}>", variable
        else:
            assert environment[variable] == expected, variable


def test_variable_references_are_defined_before_their_use(rendered: RenderedOverlay) -> None:
    for name, container in rendered.containers():
        defined: set[str] = set()
        for one in container.get("env", ()):
            assert set(re.findall(r"\$\((\w+)\)", one.get("value", ""))) <= defined, (name, one)
            defined.add(one["name"])
        assert set(re.findall(r"\$\((\w+)\)", " ".join(container.get("args", ())))) <= defined, name


def test_volumes_and_memory_folders_equal_compose(laptop: RenderedOverlay) -> None:
    claims = {*laptop.of("PersistentVolumeClaim")}
    for name, compose_service in COMPOSE_SERVICES.items():
        pod, container = laptop.pods()[name], laptop.container(name)
        volumes = {one["name"]: one for one in pod.get("volumes", ())}
        templates = laptop.of("StatefulSet").get(name, {"spec": {}})["spec"].get("volumeClaimTemplates", ())
        persistent = {one["metadata"]["name"] for one in templates} | (claims & set(volumes))
        mounts = {one["mountPath"]: one["name"] for one in container["volumeMounts"]}
        for volume in compose_service["volumes"]:
            source, _, target = volume.removesuffix(":ro").rpartition(":")
            if target == "/run/certificate":
                # in a cluster the certificate of a backend is a secret
                continue
            assert target in mounts, volume
            if source.endswith("-certificate"):
                assert volumes[mounts[target]] == {"name": "authority", "configMap": volumes["authority"]["configMap"]}
                continue
            # in a cluster the gateway stores no certificates
            assert not source or name == "gateway" or mounts[target] == source in persistent
        expected_memory = {**(tmpfs_sizes(compose_service) if "tmpfs" in compose_service else {})}
        if expected_memory.pop("/run/tls", None):
            assert volumes[mounts["/run/tls"]]["secret"]["secretName"].startswith(f"{name}-tls-")
        if "shm_size" in compose_service:
            expected_memory["/dev/shm"] = mebibytes(compose_service["shm_size"])
        memory_mounts = {
            path: mebibytes(volumes[volume]["emptyDir"]["sizeLimit"])
            for path, volume in mounts.items()
            if volumes.get(volume, {}).get("emptyDir", {}).get("medium") == "Memory"
        }
        assert memory_mounts == expected_memory


def test_every_probe_path_exists(rendered: RenderedOverlay) -> None:
    source = (REPOSITORY / "services" / "bunraku" / "runtime" / "readiness.py").read_text()
    for name, container in rendered.containers():
        ports = {port["name"]: port["containerPort"] for port in container["ports"]}
        for kind in ("startupProbe", "livenessProbe", "readinessProbe"):
            probe = container[kind]
            if name in SERVICES or name == "gateway":
                path = probe["httpGet"]["path"]
                assert path == ("/readyz" if kind == "readinessProbe" and name in SERVICES else "/livez")
                assert f'@app.get("{path}"' in source
                assert ports[probe["httpGet"]["port"]] == (8080 if name == "gateway" else 8000)
            else:
                command, compose_service = probe["exec"]["command"], COMPOSE_SERVICES[name]["healthcheck"]["test"]
                assert [word.partition("?")[0] for word in command] == compose_service[1:]
    # loading a session, or an unavailable bus, must not cause a restart
    assert f"handle {'/livez'} {{" in (REPOSITORY / "deploy" / "Caddyfile").read_text()


def test_services_are_headless_for_the_gateway(rendered: RenderedOverlay) -> None:
    services = rendered.of("Service")
    service_names = {name for _, name in read_handles()} | {"page"}
    assert service_names == set(SERVICES)
    for name in service_names:
        spec = services[name]["spec"]
        # DNS returns each pod's address, also while the pod is not ready
        assert spec["clusterIP"] == "None"
        assert spec["publishNotReadyAddresses"] is True
        assert [port["port"] for port in spec["ports"]] == [8000]
        assert spec["selector"] == rendered.of("Deployment")[name]["spec"]["selector"]["matchLabels"]
        labels = rendered.of("Deployment")[name]["spec"]["template"]["metadata"]["labels"]
        assert spec["selector"].items() <= labels.items()
    for name, port in (("nats", 4222), ("postgres", 5432)):
        assert f"@{name}:{port}" in " ".join(COMPOSE_SERVICES["stream"]["environment"].values())
        assert port in {one["port"] for one in services[name]["spec"]["ports"]}
        assert services[name]["spec"]["clusterIP"] == "None"


def test_image_tags_equal_the_package_version(laptop: RenderedOverlay) -> None:
    version = re.search(r"^ARG VERSION=(\S+)$", DOCKERFILE, re.MULTILINE)
    assert version is not None
    for name, container in laptop.containers():
        assert container["image"].endswith(f":{version[1]}"), name


def test_git_ignores_settings_files() -> None:
    files = ["secret.env", "settings.env", "ca.crt", "nats.key", "postgres.key"]
    ignored = [f"deploy/kubernetes/overlays/cluster/{name}" for name in files]
    if not (REPOSITORY / ".git").exists():
        pytest.skip("this is no repository")
    result = subprocess.run(["git", "check-ignore", *ignored], cwd=REPOSITORY, capture_output=True, text=True)
    assert result.stdout.split() == ignored
