"""What deploy/kubernetes says is what a cluster can read, and the same as docker-compose.yml says."""

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
from tests.deploy.manifests import KUBERNETES, OVERLAYS, RenderedOverlay, find_kubectl, render_overlay
from tests.deploy.test_compose import DOCKERFILE, OURS, STOCK
from tests.deploy.test_compose import SERVICES as ALL_COMPOSED
from tests.deploy.test_gateway import read_handles

COMPOSED = {name: one for name, one in ALL_COMPOSED.items() if "profiles" not in one}
"""What Compose starts unasked."""
SCHEMAS = ("1.27", "1.32", "1.37")
"""Versions of Kubernetes, the oldest that the README names first."""
COMPOSE_ONLY = {
    "BUNRAKU_PUBLISHED": "a cluster always has a secret",
}
"""What Compose alone says, and why."""
KUBERNETES_ONLY = {
    "BUNRAKU_BUS_PASSWORD": "addresses are made of it in the pod, not before",
    "BUNRAKU_CATALOGUE_PASSWORD": "as the other",
    "BUNRAKU_SITE": "of the gateway, among the settings of all",
    "BUNRAKU_LOGS": "the cluster's logs are read by machines",
    "BUNRAKU_LOG_LEVEL": "beside them",
    "BUNRAKU_METRICS": "a port of its own in each pod",
    "PGDATA": "a volume of a cluster may have a folder in it already",
}
"""What Kubernetes alone says, and why."""
MEBIBYTES_PER_UNIT = {"m": 1, "g": 1024, "Mi": 1, "Gi": 1024}


@pytest.fixture(scope="module", params=OVERLAYS)
def built(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> RenderedOverlay:
    return RenderedOverlay(render_overlay(tmp_path_factory.mktemp("built"), request.param))


@pytest.fixture(scope="module")
def laptop(tmp_path_factory: pytest.TempPathFactory) -> RenderedOverlay:
    return RenderedOverlay(render_overlay(tmp_path_factory.mktemp("laptop"), "laptop"))


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> RenderedOverlay:
    return RenderedOverlay(render_overlay(tmp_path_factory.mktemp("cluster"), "cluster"))


def mebibytes(size: str) -> int:
    found = re.fullmatch(r"(\d+)([A-Za-z]+)", size)
    assert found is not None, size
    return int(found[1]) * MEBIBYTES_PER_UNIT[found[2]]


def tmpfs_sizes(service: dict[str, Any]) -> dict[str, int]:
    """Where Compose has folders in memory, and their largest size in MiB."""
    return {one.partition(":")[0]: mebibytes(one.partition("size=")[2].partition(",")[0]) for one in service["tmpfs"]}


@pytest.mark.parametrize("version", SCHEMAS)
def test_every_object_is_one_that_kubernetes_knows(built: RenderedOverlay, version: str) -> None:
    for manifest in built.manifests:
        kubernetes_validate.validate(manifest, version, strict=True)


def test_the_schemas_refuse_what_is_no_field(laptop: RenderedOverlay) -> None:
    wrong = yaml.safe_load(yaml.safe_dump(laptop.of("Deployment")["stream"]))
    wrong["spec"]["template"]["spec"]["containers"][0]["securityContext"]["readOnlyRoot"] = True
    with pytest.raises(kubernetes_validate.ValidationError):
        kubernetes_validate.validate(wrong, SCHEMAS[0], strict=True)


@pytest.mark.parametrize("overlay", OVERLAYS)
def test_without_secrets_of_ones_own_nothing_is_built(overlay: str, tmp_path: Path) -> None:
    render_overlay(tmp_path, overlay)
    folder = tmp_path / "kubernetes" / "overlays" / overlay
    (folder / "secret.env").unlink()
    done = subprocess.run([find_kubectl(), "kustomize", str(folder)], capture_output=True, text=True)
    assert done.returncode != 0
    assert "secret.env" in done.stderr


def test_the_whole_house_is_there(built: RenderedOverlay) -> None:
    assert set(built.pods()) == set(COMPOSED) == {*SERVICES, "gateway", "nats", "postgres"}
    assert {one["metadata"].get("namespace", "bunraku") for one in built.manifests} == {"bunraku"}


def test_services_are_as_many_as_in_compose(laptop: RenderedOverlay) -> None:
    replicas = {name: one["spec"]["replicas"] for name, one in laptop.of("Deployment", "StatefulSet").items()}
    assert replicas == {name: one.get("scale", 1) for name, one in COMPOSED.items()}


@pytest.mark.parametrize("name", sorted(COMPOSED))
def test_a_service_runs_as_in_compose(laptop: RenderedOverlay, name: str) -> None:
    composed, container, pod = COMPOSED[name], laptop.container(name), laptop.pods()[name]
    image, _, tag = container["image"].partition(":")
    assert image == composed["image"].partition(":")[0]
    assert image in OURS or container["image"] in STOCK
    assert tag not in ("", "latest")
    assert container.get("args") == composed.get("command")
    user = {"postgres": "999:999"}.get(name, composed["user"])
    assert user == f"{pod['securityContext']['runAsUser']}:{pod['securityContext']['runAsGroup']}"
    assert mebibytes(container["resources"]["limits"]["memory"]) == mebibytes(composed["mem_limit"])
    assert pod["shareProcessNamespace"] is composed["init"]
    assert pod["terminationGracePeriodSeconds"] >= int(composed["stop_grace_period"].removesuffix("s"))


@pytest.mark.parametrize("name", sorted(COMPOSED))
def test_a_service_is_told_what_it_is_told_in_compose(laptop: RenderedOverlay, name: str) -> None:
    composed, here = COMPOSED[name]["environment"], laptop.environment(name)
    assert set(composed) - set(here) <= set(COMPOSE_ONLY)
    assert set(here) - set(composed) <= set(KUBERNETES_ONLY)
    for variable in set(composed) & set(here):
        # what may be said of it, or is said by default
        given = re.sub(r"\$\{(\w*PASSWORD):-bunraku\}", r"$(\1)", str(composed[variable]))
        given = re.sub(r"^\$\{\w+:-(.*)\}$", r"\1", given)
        if here[variable].startswith("<"):
            secret = re.match(r"\$[({](\w+)", re.sub(r"\$\{(\w+):-.*", r"$(\1)", str(composed[variable])))
            assert secret is not None, variable
            assert here[variable] == f"<{secret[1]}>", variable
        else:
            assert here[variable] == given, variable


def test_addresses_are_made_of_what_stands_before_them(built: RenderedOverlay) -> None:
    for name, container in built.containers():
        known: set[str] = set()
        for one in container.get("env", ()):
            assert set(re.findall(r"\$\((\w+)\)", one.get("value", ""))) <= known, (name, one)
            known.add(one["name"])
        assert set(re.findall(r"\$\((\w+)\)", " ".join(container.get("args", ())))) <= known, name


def test_what_is_kept_and_what_is_in_memory_is_as_in_compose(laptop: RenderedOverlay) -> None:
    claims = {*laptop.of("PersistentVolumeClaim")}
    for name, composed in COMPOSED.items():
        pod, container = laptop.pods()[name], laptop.container(name)
        volumes = {one["name"]: one for one in pod.get("volumes", ())}
        templates = laptop.of("StatefulSet").get(name, {"spec": {}})["spec"].get("volumeClaimTemplates", ())
        kept = {one["metadata"]["name"] for one in templates} | (claims & set(volumes))
        mounts = {one["mountPath"]: one["name"] for one in container["volumeMounts"]}
        for volume in composed["volumes"]:
            source, _, target = volume.rpartition(":")
            assert target in mounts, volume
            # certificates are not the gateway's here
            assert not source or name == "gateway" or mounts[target] == source in kept
        memory = {**(tmpfs_sizes(composed) if "tmpfs" in composed else {})}
        if "shm_size" in composed:
            memory["/dev/shm"] = mebibytes(composed["shm_size"])
        held = {
            path: mebibytes(volumes[volume]["emptyDir"]["sizeLimit"])
            for path, volume in mounts.items()
            if volumes.get(volume, {}).get("emptyDir", {}).get("medium") == "Memory"
        }
        assert held == memory


def test_every_container_may_do_no_more_than_it_must(built: RenderedOverlay) -> None:
    level = "pod-security.kubernetes.io/enforce"
    assert built.of("Namespace")["bunraku"]["metadata"]["labels"][level] == "restricted"
    for name, pod in built.pods().items():
        assert pod["automountServiceAccountToken"] is False, name
        assert pod["enableServiceLinks"] is False
        about = pod["securityContext"]
        assert about["runAsNonRoot"] is True
        assert about["runAsUser"] > 0
        assert about["seccompProfile"] == {"type": "RuntimeDefault"}
        assert not {"hostNetwork", "hostPID", "hostIPC"} & set(pod)
        assert all("hostPath" not in volume for volume in pod.get("volumes", ()))
    for name, container in built.containers():
        allowed = {"allowPrivilegeEscalation": False, "readOnlyRootFilesystem": True, "capabilities": {"drop": ["ALL"]}}
        assert container["securityContext"] == allowed, name
        assert {*container["resources"]["requests"]} == {"cpu", "memory"}
        assert {*container["resources"]["limits"]} == {"memory"}
        assert all("hostPort" not in port for port in container["ports"])


def test_every_probe_asks_what_is_answered(built: RenderedOverlay) -> None:
    program = (REPOSITORY / "services" / "bunraku" / "runtime" / "readiness.py").read_text()
    for name, container in built.containers():
        ports = {port["name"]: port["containerPort"] for port in container["ports"]}
        for kind in ("startupProbe", "livenessProbe", "readinessProbe"):
            probe = container[kind]
            if name in SERVICES or name == "gateway":
                path = probe["httpGet"]["path"]
                assert path == ("/readyz" if kind == "readinessProbe" and name in SERVICES else "/livez")
                assert f'@app.get("{path}"' in program
                assert ports[probe["httpGet"]["port"]] == (8080 if name == "gateway" else 8000)
            else:
                asked, composed = probe["exec"]["command"], COMPOSED[name]["healthcheck"]["test"]
                assert [word.partition("?")[0] for word in asked] == composed[1:]
    # that a stage is prepared, or the bus away, is no reason to be started anew
    assert f"handle {'/livez'} {{" in (REPOSITORY / "deploy" / "Caddyfile").read_text()


def test_the_gateway_finds_each_replica_by_name(built: RenderedOverlay) -> None:
    services = built.of("Service")
    wanted = {name for _, name in read_handles()} | {"page"}
    assert wanted == set(SERVICES)
    for name in wanted:
        spec = services[name]["spec"]
        # each pod's own address, not one for all; also while it is not ready
        assert spec["clusterIP"] == "None"
        assert spec["publishNotReadyAddresses"] is True
        assert [port["port"] for port in spec["ports"]] == [8000]
        assert spec["selector"] == built.of("Deployment")[name]["spec"]["selector"]["matchLabels"]
        labels = built.of("Deployment")[name]["spec"]["template"]["metadata"]["labels"]
        assert spec["selector"].items() <= labels.items()
    for name, port in (("nats", 4222), ("postgres", 5432)):
        assert f"@{name}:{port}" in " ".join(COMPOSED["stream"]["environment"].values())
        assert port in {one["port"] for one in services[name]["spec"]["ports"]}
        assert services[name]["spec"]["clusterIP"] == "None"


def test_nothing_but_the_gateway_is_reached_from_outside(built: RenderedOverlay) -> None:
    kinds = {name: one["spec"].get("type", "ClusterIP") for name, one in built.of("Service").items()}
    assert {name for name, kind in kinds.items() if kind != "ClusterIP"} <= {"gateway"}
    policies = {name: one["spec"] for name, one in built.of("NetworkPolicy").items()}
    assert policies["nobody"] == {"podSelector": {}, "policyTypes": ["Ingress"]}
    open_to_all = {name for name, one in policies.items() for rule in one.get("ingress", ()) if "from" not in rule}
    assert open_to_all == {"gateway"}
    for name in ("nats", "postgres"):
        assert policies[name]["podSelector"] == {"matchLabels": {"app.kubernetes.io/name": name}}
        assert "Egress" in policies[name]["policyTypes"]
    for one in policies.values():
        for rule in one.get("ingress", ()):
            for port in rule.get("ports", ()):
                selected = one["podSelector"]["matchLabels"].items()
                pods = [
                    workload["spec"]["template"]
                    for workload in built.of("Deployment", "StatefulSet").values()
                    if selected <= workload["spec"]["template"]["metadata"]["labels"].items()
                ]
                assert pods
                for pod in pods:
                    assert port["port"] in {each["name"] for each in pod["spec"]["containers"][0]["ports"]}


def test_viewers_are_moved_one_pod_at_a_time(built: RenderedOverlay) -> None:
    budgets = built.of("PodDisruptionBudget")
    for name in (*SERVICES, "gateway", "nats"):
        assert budgets[name]["spec"]["maxUnavailable"] == 1
    for name in SERVICES:
        spec = built.of("Deployment")[name]["spec"]
        assert spec["strategy"]["rollingUpdate"] == {"maxSurge": 1, "maxUnavailable": 0}
        assert spec["minReadySeconds"] > 30


def test_there_are_as_many_streams_as_there_are_viewers_for(cluster: RenderedOverlay) -> None:
    scalers = cluster.of("HorizontalPodAutoscaler")
    assert set(scalers) == {"stream", "session", "gateway"}
    for name, scaler in scalers.items():
        assert scaler["spec"]["scaleTargetRef"] == {"apiVersion": "apps/v1", "kind": "Deployment", "name": name}
        # or each `kubectl apply` would set what the autoscaler has set
        assert "replicas" not in cluster.of("Deployment")[name]["spec"]
        down = scaler["spec"]["behavior"]["scaleDown"]
        assert down["stabilizationWindowSeconds"] >= 600
        assert [policy["type"] for policy in down["policies"]] == ["Pods"]
    metrics = scalers["stream"]["spec"]["metrics"]
    (viewers,) = (one["pods"] for one in metrics if one["type"] == "Pods")
    assert viewers["target"]["type"] == "AverageValue"
    # as the documents work it out
    each = f"{int(viewers['target']['averageValue']):,}"
    assert f"{each} each" in (KUBERNETES / "README.md").read_text()
    assert f"{each} viewers a replica" in (REPOSITORY / "deploy" / "SCALE.md").read_text()
    adapter = yaml.safe_load((KUBERNETES / "prometheus" / "adapter-values.yaml").read_text())
    (rule,) = adapter["rules"]["custom"]
    assert (
        re.sub(rule["name"]["matches"], rule["name"]["as"], rule["seriesQuery"].partition("{")[0])
        == (viewers["metric"]["name"])
    )
    assert rule["resources"]["overrides"] == {one: {"resource": one} for one in ("namespace", "pod")}
    assert rule["metricsQuery"] == "sum(<<.Series>>{<<.LabelMatchers>>}) by (<<.GroupBy>>)"


def test_the_autoscaler_counts_what_streams_tell(cluster: RenderedOverlay) -> None:
    told = REPOSITORY / "services" / "bunraku" / "stream" / "metrics.py"
    if not told.exists():
        pytest.skip("streams tell nothing yet")
    names = {f"bunraku_{name}" for name in re.findall(r'\.gauge\(\s*"(\w+)"', told.read_text())}
    metrics = cluster.of("HorizontalPodAutoscaler")["stream"]["spec"]["metrics"]
    assert {one["pods"]["metric"]["name"] for one in metrics if one["type"] == "Pods"} <= names


def test_prometheus_finds_every_service_by_either_way(built: RenderedOverlay) -> None:
    monitor = yaml.safe_load((KUBERNETES / "prometheus" / "pod-monitor.yaml").read_text())
    (endpoint,) = monitor["spec"]["podMetricsEndpoints"]
    settings = built.one("ConfigMap", "settings")["data"]
    for name in SERVICES:
        template = built.of("Deployment")[name]["spec"]["template"]
        assert monitor["spec"]["selector"]["matchLabels"].items() <= template["metadata"]["labels"].items()
        ports = {port["name"]: port["containerPort"] for port in built.container(name)["ports"]}
        assert settings["BUNRAKU_METRICS"] == f"0.0.0.0:{ports[endpoint['port']]}"
        assert template["metadata"]["annotations"]["prometheus.io/port"] == str(ports[endpoint["port"]])


def test_several_nodes_share_no_volume(cluster: RenderedOverlay) -> None:
    assert not cluster.of("PersistentVolumeClaim")
    for name in SERVICES:
        assert all("persistentVolumeClaim" not in one for one in cluster.pods()[name]["volumes"])
        assert cluster.environment(name)["BUNRAKU_LIBRARY"].startswith("s3://")


def test_every_nats_server_is_named_wherever_all_are(cluster: RenderedOverlay) -> None:
    count = cluster.of("StatefulSet")["nats"]["spec"]["replicas"]
    names = [f"nats-{number}.nats" for number in range(count)]
    assert re.findall(r"@([^:]+):4222", cluster.environment("stream")["BUNRAKU_BUS"]) == names
    assert re.findall(r"@([^:]+):6222", " ".join(cluster.container("nats")["args"])) == names
    assert cluster.environment("session")["BUNRAKU_REGISTER_REPLICAS"] == str(count)
    mounted = cluster.container("nats")["volumeMounts"]
    assert "/etc/bunraku" in {one["mountPath"] for one in mounted}
    own = cluster.one("ConfigMap", "bus")["data"]["nats.conf"]
    assert own == (KUBERNETES / "overlays" / "cluster" / "nats.conf").read_text()
    # what one alone is told, each of the three is
    alone = (REPOSITORY / "deploy" / "nats.conf").read_text()
    assert {*filter(None, alone.splitlines()[1:])} <= {*own.splitlines()}


def test_images_have_the_version_of_the_package(laptop: RenderedOverlay) -> None:
    version = re.search(r"^ARG VERSION=(\S+)$", DOCKERFILE, re.MULTILINE)
    assert version is not None
    for name, container in laptop.containers():
        if name != "postgres":
            assert container["image"].endswith(f":{version[1]}")


def test_the_settings_are_kept_out_of_the_repository() -> None:
    files = ["secret.env", "settings.env"]
    made = [f"deploy/kubernetes/overlays/cluster/{name}" for name in files]
    if not (REPOSITORY / ".git").exists():
        pytest.skip("this is no repository")
    done = subprocess.run(["git", "check-ignore", *made], cwd=REPOSITORY, capture_output=True, text=True)
    assert done.stdout.split() == made
