"""Manifests of deploy/kubernetes: valid for a cluster, and equivalent to docker-compose.yml."""

from __future__ import annotations

import base64
import re
import ssl
import subprocess
from pathlib import Path
from typing import Any

import kubernetes_validate
import pytest
import yaml

from bunraku.runtime.tls import create_client_context
from bunraku.serve import SERVICES
from tests.conftest import REPOSITORY
from tests.deploy.manifests import KUBERNETES, OVERLAYS, RenderedOverlay, find_kubectl, render_overlay
from tests.deploy.test_compose import DOCKERFILE, OWN_IMAGES, exchange_handshake
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


@pytest.fixture(scope="module", params=OVERLAYS)
def rendered(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> RenderedOverlay:
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


def test_container_has_least_privileges(rendered: RenderedOverlay) -> None:
    level = "pod-security.kubernetes.io/enforce"
    assert rendered.of("Namespace")["bunraku"]["metadata"]["labels"][level] == "restricted"
    for name, pod in rendered.pods().items():
        assert pod["automountServiceAccountToken"] is False, name
        assert pod["enableServiceLinks"] is False
        security_context = pod["securityContext"]
        assert security_context["runAsNonRoot"] is True
        assert security_context["runAsUser"] > 0
        assert security_context["seccompProfile"] == {"type": "RuntimeDefault"}
        assert not {"hostNetwork", "hostPID", "hostIPC"} & set(pod)
        assert all("hostPath" not in volume for volume in pod.get("volumes", ()))
    for name, container in rendered.containers():
        expected_context = {
            "allowPrivilegeEscalation": False,
            "readOnlyRootFilesystem": True,
            "capabilities": {"drop": ["ALL"]},
        }
        assert container["securityContext"] == expected_context, name
        assert {*container["resources"]["requests"]} == {"cpu", "memory"}
        assert {*container["resources"]["limits"]} == {"memory"}
        assert all("hostPort" not in port for port in container["ports"])


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


def test_only_the_gateway_is_reachable_from_outside(rendered: RenderedOverlay) -> None:
    kinds = {name: one["spec"].get("type", "ClusterIP") for name, one in rendered.of("Service").items()}
    assert {name for name, kind in kinds.items() if kind != "ClusterIP"} <= {"gateway"}
    policies = {name: one["spec"] for name, one in rendered.of("NetworkPolicy").items()}
    assert policies["nobody"] == {"podSelector": {}, "policyTypes": ["Ingress", "Egress"]}
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
                    for workload in rendered.of("Deployment", "StatefulSet").values()
                    if selected <= workload["spec"]["template"]["metadata"]["labels"].items()
                ]
                assert pods
                for pod in pods:
                    assert port["port"] in {named["name"] for named in pod["spec"]["containers"][0]["ports"]}


def egress_peers(policies: dict[str, Any], name: str) -> set[tuple[str, int | str]]:
    """Return the pods and ports that a policy lets its pods connect to."""
    found = set()
    for rule in policies[name]["egress"]:
        for port in rule.get("ports", ({"port": "any"},)):
            for peer in rule.get("to", ({},)):
                labels = peer.get("podSelector", {}).get("matchLabels") or peer.get("namespaceSelector", {}).get(
                    "matchLabels", {"": "anywhere"}
                )
                found.add((next(iter(labels.values())), port["port"]))
    return found


def test_pods_reach_only_what_they_need(rendered: RenderedOverlay) -> None:
    policies = {name: one["spec"] for name, one in rendered.of("NetworkPolicy").items()}
    dns: tuple[str, int | str] = ("kube-system", 53)
    assert egress_peers(policies, "gateway") == {("service", "http"), dns}
    assert egress_peers(policies, "service") == {("nats", "bus"), ("postgres", "sql"), dns}
    assert egress_peers(policies, "postgres") == set()
    assert egress_peers(policies, "nats") == {("nats", "any"), dns}
    # the library of a cluster is elsewhere
    others = policies.keys() - {"nobody", "gateway", "service", "postgres", "nats"}
    assert {peer for name in others for peer in egress_peers(policies, name)} <= {("anywhere", 443)}


def test_secrets_of_tokens_are_files(rendered: RenderedOverlay) -> None:
    for name in SERVICES:
        assert not {"BUNRAKU_SECRET", "BUNRAKU_SECRET_BEFORE"} & rendered.environment(name).keys()
        folder = rendered.environment(name)["BUNRAKU_SECRETS"]
        (mount,) = (one for one in rendered.container(name)["volumeMounts"] if one["mountPath"] == folder)
        (volume,) = (one for one in rendered.pods()[name]["volumes"] if one["name"] == mount["name"])
        paths = {item["path"] for one in volume["projected"]["sources"] for item in one["secret"]["items"]}
        assert paths == {"BUNRAKU_SECRET", "BUNRAKU_SECRET_BEFORE"}


def test_certificates_of_the_readme_are_accepted_by_clients(rendered: RenderedOverlay, tmp_path: Path) -> None:
    authority = tmp_path / "ca.crt"
    authority.write_text(rendered.one("ConfigMap", "authority")["data"]["ca.crt"])
    client = create_client_context(str(authority))
    # Python 3.13 verifies by this flag
    client.verify_flags |= ssl.VerifyFlags.VERIFY_X509_STRICT
    for service, hosts in (("nats", ["nats", "nats-0.nats", "nats-2.nats"]), ("postgres", ["postgres"])):
        data = rendered.one("Secret", f"{service}-tls")["data"]
        for name in ("tls.crt", "tls.key"):
            (tmp_path / name).write_bytes(base64.b64decode(data[name]))
        server = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        server.load_cert_chain(tmp_path / "tls.crt", tmp_path / "tls.key")
        for host in hosts:
            exchange_handshake(client, server, host)
        with pytest.raises(ssl.SSLCertVerificationError):
            exchange_handshake(client, server, "gateway")
    # the key of the authority is not kept
    assert all("ca.key" not in one.get("data", {}) for one in rendered.manifests)


def test_pods_are_replaced_one_at_a_time(rendered: RenderedOverlay) -> None:
    budgets = rendered.of("PodDisruptionBudget")
    for name in (*SERVICES, "gateway", "nats"):
        assert budgets[name]["spec"]["maxUnavailable"] == 1
    for name in SERVICES:
        spec = rendered.of("Deployment")[name]["spec"]
        assert spec["strategy"]["rollingUpdate"] == {"maxSurge": 1, "maxUnavailable": 0}
        assert spec["minReadySeconds"] > 30


def test_streams_scale_with_the_number_of_viewers(cluster: RenderedOverlay) -> None:
    scalers = cluster.of("HorizontalPodAutoscaler")
    assert set(scalers) == {"stream", "session", "gateway"}
    for name, scaler in scalers.items():
        assert scaler["spec"]["scaleTargetRef"] == {"apiVersion": "apps/v1", "kind": "Deployment", "name": name}
        # otherwise each `kubectl apply` would overwrite the value of the autoscaler
        assert "replicas" not in cluster.of("Deployment")[name]["spec"]
        down = scaler["spec"]["behavior"]["scaleDown"]
        assert down["stabilizationWindowSeconds"] >= 600
        assert [policy["type"] for policy in down["policies"]] == ["Pods"]
    metrics = scalers["stream"]["spec"]["metrics"]
    (viewers,) = (one["pods"] for one in metrics if one["type"] == "Pods")
    assert viewers["target"]["type"] == "AverageValue"
    # the documents state the same number
    per_replica = f"{int(viewers['target']['averageValue']):,}"
    assert f"{per_replica} each" in (KUBERNETES / "README.md").read_text()
    assert f"{per_replica} viewers a replica" in (REPOSITORY / "deploy" / "SCALE.md").read_text()
    adapter = yaml.safe_load((KUBERNETES / "prometheus" / "adapter-values.yaml").read_text())
    (rule,) = adapter["rules"]["custom"]
    assert (
        re.sub(rule["name"]["matches"], rule["name"]["as"], rule["seriesQuery"].partition("{")[0])
        == (viewers["metric"]["name"])
    )
    assert rule["resources"]["overrides"] == {one: {"resource": one} for one in ("namespace", "pod")}
    assert rule["metricsQuery"] == "sum(<<.Series>>{<<.LabelMatchers>>}) by (<<.GroupBy>>)"


def test_autoscaler_uses_an_exported_metric(cluster: RenderedOverlay) -> None:
    metrics_source = REPOSITORY / "services" / "bunraku" / "stream" / "metrics.py"
    if not metrics_source.exists():
        pytest.skip("the stream service exports no metrics")
    names = {f"bunraku_{name}" for name in re.findall(r'\.gauge\(\s*"(\w+)"', metrics_source.read_text())}
    metrics = cluster.of("HorizontalPodAutoscaler")["stream"]["spec"]["metrics"]
    assert {one["pods"]["metric"]["name"] for one in metrics if one["type"] == "Pods"} <= names


def test_prometheus_discovers_services_by_monitor_and_annotation(rendered: RenderedOverlay) -> None:
    monitor = yaml.safe_load((KUBERNETES / "prometheus" / "pod-monitor.yaml").read_text())
    (endpoint,) = monitor["spec"]["podMetricsEndpoints"]
    settings = rendered.one("ConfigMap", "settings")["data"]
    for name in SERVICES:
        template = rendered.of("Deployment")[name]["spec"]["template"]
        assert monitor["spec"]["selector"]["matchLabels"].items() <= template["metadata"]["labels"].items()
        ports = {port["name"]: port["containerPort"] for port in rendered.container(name)["ports"]}
        assert settings["BUNRAKU_METRICS"] == f"0.0.0.0:{ports[endpoint['port']]}"
        assert template["metadata"]["annotations"]["prometheus.io/port"] == str(ports[endpoint["port"]])


def test_cluster_overlay_shares_no_volume(cluster: RenderedOverlay) -> None:
    assert not cluster.of("PersistentVolumeClaim")
    for name in SERVICES:
        assert all("persistentVolumeClaim" not in one for one in cluster.pods()[name]["volumes"])
        assert cluster.environment(name)["BUNRAKU_LIBRARY"].startswith("s3://")


def test_all_nats_servers_are_listed_in_every_setting(cluster: RenderedOverlay) -> None:
    count = cluster.of("StatefulSet")["nats"]["spec"]["replicas"]
    names = [f"nats-{number}.nats" for number in range(count)]
    assert re.findall(r"@([^:]+):4222", cluster.environment("stream")["BUNRAKU_BUS"]) == names
    assert re.findall(r"@([^:]+):6222", " ".join(cluster.container("nats")["args"])) == names
    assert cluster.environment("session")["BUNRAKU_REGISTER_REPLICAS"] == str(count)
    mounted = cluster.container("nats")["volumeMounts"]
    assert "/etc/bunraku" in {one["mountPath"] for one in mounted}
    own = cluster.one("ConfigMap", "bus")["data"]["nats.conf"]
    assert own == (KUBERNETES / "overlays" / "cluster" / "nats.conf").read_text()
    # each of the three has the settings of a single server
    single = (REPOSITORY / "deploy" / "nats.conf").read_text()
    assert {*filter(None, single.splitlines()[1:])} <= {*own.splitlines()}


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
