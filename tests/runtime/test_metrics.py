from __future__ import annotations

import socket
import threading
from collections import Counter

import httpx2
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.runtime.metrics import (
    DURATION_BOUNDS_S,
    Histogram,
    LabelledHistograms,
    Metrics,
    MetricsListenError,
    parse_address,
)
from tests.metrics import MetricSamples, scrape_metrics
from tests.processes import free_port


@pytest.mark.parametrize(
    ("text", "address"),
    [("127.0.0.1:9100", ("127.0.0.1", 9100)), ("[::1]:9100", ("::1", 9100)), ("localhost:1", ("localhost", 1))],
)
def test_an_address_is_a_host_and_a_port(text: str, address: tuple[str, int]) -> None:
    assert parse_address(text) == address


@pytest.mark.parametrize(
    "text",
    ["9100", ":9100", "localhost", "localhost:", "localhost:0", "localhost:70000", "localhost:9100/metrics", "a b:c",
     "http://localhost:9100", "me@localhost:9100", "[::1:9100", "[localhost]:9100", "localhost:-1"],
)  # fmt: skip
def test_what_is_none_is_refused_with_what_to_do(text: str) -> None:
    with pytest.raises(ValueError, match=r"host:port, 127\.0\.0\.1:9100 say"):
        parse_address(text)


@given(st.lists(st.floats(0, 100)))
def test_a_distribution_counts_each_once_and_cumulates(values: list[float]) -> None:
    taken = Histogram()
    for value in values:
        taken.observe(value)
    for bound, count in taken.cumulative_buckets():
        assert count == sum(value <= float(bound) for value in values)
    assert taken.cumulative_buckets()[-1] == ("+Inf", len(values))
    assert taken.total_s == pytest.approx(sum(values))
    assert len(taken.cumulative_buckets()) == len(DURATION_BOUNDS_S) + 1


def test_numbers_are_read_when_asked_for_and_each_registry_is_its_own() -> None:
    metrics, other, seen = Metrics(), Metrics(), Counter[tuple[str, ...]]({("a",): 2})
    metrics.gauge("people", "Those here", lambda: len(seen))
    metrics.counter("comings_total", "Those who came", seen.copy, ("door",))
    times = LabelledHistograms()
    metrics.histograms("wait_seconds", "Waiting", times, ("door",))
    other.gauge("people", "Those there", lambda: 7)
    port, second = free_port(), free_port()
    with metrics.serve(f"127.0.0.1:{port}"), other.serve(f"127.0.0.1:{second}"):
        found = scrape_metrics(port)
        assert (found.sum("people"), found.sum("comings_total", door="a")) == (1, 2)
        seen["b",] += 5
        times.observe(("b",), 0.3)
        found = scrape_metrics(port)
        assert (found.sum("people"), found.sum("comings_total", door="b")) == (2, 5)
        assert found.sum("wait_seconds_bucket", door="b", le="0.25") == 0
        assert found.sum("wait_seconds_bucket", door="b", le="0.5") == found.sum("wait_seconds_count") == 1
        assert {"process_resident_memory_bytes", "python_info"} <= found.families.keys()
        assert scrape_metrics(second).sum("people") == 7
        assert not scrape_metrics(second).has("comings_total")
    # thread and port are let go
    socket.create_server(("127.0.0.1", port)).close()
    assert not [thread for thread in threading.enumerate() if thread.daemon and "serve_forever" in thread.name]


def test_no_two_have_one_name() -> None:
    metrics = Metrics()
    metrics.gauge("people", "Those here", lambda: 1)
    with pytest.raises(ValueError, match="bunraku_people"):
        metrics.counter("people_total", "Those who came", lambda: 1)


def test_nothing_else_is_there() -> None:
    metrics, port = Metrics(), free_port()
    with metrics.serve(f"127.0.0.1:{port}"), httpx2.Client(base_url=f"http://127.0.0.1:{port}") as http:
        for path in ("/", "/metrics/", "/v1/sessions", "/favicon.ico", "//metrics"):
            assert http.get(path).status_code == 404, path
        assert http.post("/metrics").status_code == 405
        assert http.get("/metrics").status_code == 200


def test_one_that_cannot_be_read_keeps_nobody_from_reading_the_rest() -> None:
    metrics, port = Metrics(), free_port()
    growing = iter([RuntimeError("set changed size during iteration")] * 2)

    def read() -> float:
        if (error := next(growing, None)) is not None:
            raise error
        return 3

    def never() -> float:
        raise RuntimeError("dictionary changed size during iteration")

    metrics.gauge("growing", "It changes twice", read)
    metrics.gauge("never", "It changes always", never)
    with metrics.serve(f"127.0.0.1:{port}"):
        found = scrape_metrics(port)
    assert found.sum("growing") == 3
    assert not found.has("never")


def test_an_address_that_another_has_is_said_in_words() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        address = f"127.0.0.1:{taken.getsockname()[1]}"
        with (
            pytest.raises(MetricsListenError, match=rf"{address}: .*BUNRAKU_METRICS says where"),
            Metrics().serve(address),
        ):
            pass


def test_without_an_address_nobody_listens() -> None:
    before = threading.active_count()
    with Metrics().serve(""):
        assert threading.active_count() == before


def test_the_parser_of_these_tests_reads() -> None:
    assert MetricSamples('bunraku_x_total{a="b"} 3\nbunraku_x_total{a="c"} 4\n').sum("x_total", a="c") == 4
