"""Replicas, autoscaling and monitoring of deploy/kubernetes."""

from __future__ import annotations

import re

import pytest
import yaml

from bunraku.serve import SERVICES
from tests.conftest import REPOSITORY
from tests.deploy.manifests import KUBERNETES, RenderedOverlay


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
