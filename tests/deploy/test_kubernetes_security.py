"""Privileges, network policies and secrets of deploy/kubernetes."""

from __future__ import annotations

import base64
import ssl
from pathlib import Path
from typing import Any

import pytest

from bunraku.runtime.tls import create_client_context
from bunraku.serve import SERVICES
from tests.deploy.manifests import RenderedOverlay
from tests.deploy.test_compose import exchange_handshake


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
