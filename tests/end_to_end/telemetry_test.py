"""What operators see of a daemon: scrape, statistics, log, traces, shapectl top."""

import json
import os
import pty
import queue
import re
import select
import signal
import socket
import subprocess
import time
import unittest

import grpc

from scrape import get, scrape
from support import SUCCESS, NOT_FOUND, Daemon, DaemonCase, tube, write_mesh, write_tubes

TRACE, SPAN = "4bf92f3577b34da6a3ce929d0e0e4736", "00f067aa0ba902b7"


def call(address, method, message=b"", metadata=()):
    """A unary call with messages as bytes; its status and initial metadata."""
    with grpc.insecure_channel(address) as channel:
        method = channel.unary_unary(method, lambda data: data, lambda data: data)
        try:
            _, answered = method.with_call(message, timeout=10, metadata=metadata)
        except grpc.RpcError as error:
            answered = error
        return answered.code(), dict(answered.initial_metadata())


def traced(address, *headers):
    """The traceparent that a call with these headers is answered with."""
    code, metadata = call(address, "/shaped.v1.Models/List", metadata=[("traceparent", header) for header in headers])
    assert code == grpc.StatusCode.OK
    return metadata["traceparent"]


class Telemetry(DaemonCase):
    daemon_options = ("--metrics", "127.0.0.1:0")

    def test_counts_follow_the_calls(self):
        before = scrape(self.daemon)
        self.assertEqual(before.value("shaped_requests_in_flight", method="Shapes.Project"), 0)
        self.assertIn(("shaped_requests_in_flight", (("method", "Shapes.Project"),)), before.series)
        for _ in range(3):
            self.expect(SUCCESS, "models")
        self.expect(NOT_FOUND, "describe", "nobody")
        after = scrape(self.daemon)

        def more(name, **labels):
            return after.value(name, **labels) - before.value(name, **labels)
        self.assertEqual(more("shaped_requests_total", method="Models.List", code="OK"), 3)
        self.assertEqual(more("shaped_requests_total", method="Models.Get", code="NOT_FOUND"), 1)
        self.assertEqual(more("shaped_request_seconds_count", method="Models.List"), 3)
        self.assertEqual(more("shaped_request_seconds_bucket", method="Models.List", le="+Inf"), 3)
        seconds = more("shaped_request_seconds_sum", method="Models.List")
        parts = [more(f"shaped_{part}_seconds_sum", method="Models.List") for part in ("queue", "compute")]
        self.assertTrue(0 < sum(parts) <= seconds < 3, (parts, seconds))
        self.assertGreater(after.value("process_resident_memory_bytes"), 1e6)
        self.assertEqual(after.value("shaped_log_lines_lost_total"), 0)

    def test_models_jobs_and_solvers(self):
        meshes = write_tubes(self.folder)
        self.expect(SUCCESS, "train", "shell-pga", "seen", *meshes, "--coarse-vertices", 60)
        score = self.shapectl("score", "seen", meshes[2]).json
        seen = scrape(self.daemon)
        self.assertGreater(seen.value("shaped_model_bytes", model="seen", version="1"), 10000)
        self.assertEqual(seen.value("shaped_jobs", state="succeeded"), 1)
        self.assertEqual(seen.value("shaped_solver_iterations_count", method="Shapes.Score"), 1)
        self.assertEqual(seen.value("shaped_solver_iterations_sum", method="Shapes.Score"), score["iterations"])
        for termination in ("iteration_limit", "stalled", "numerical_failure"):
            self.assertEqual(seen.value("shaped_solver_unconverged_total", method="Shapes.Score", termination=termination),
                             score["termination"] == termination)
        self.assertEqual(seen.value("shaped_solver_iterations_count", method="Jobs.Train"), 1)
        self.assertGreater(seen.value("shaped_solver_iterations_sum", method="Jobs.Train"), 0)
        self.assertEqual(seen.value("shaped_solver_unconverged_total", method="Jobs.Train", termination="stalled"), 0)
        # Statistics say the same as the scrape.
        statistics = self.expect(SUCCESS, "top").json
        self.assertEqual([model["model"] for model in statistics["models"]], [{"name": "seen", "version": 1}])
        train = next(method for method in statistics["methods"] if method["method"] == "Jobs.Train")
        self.assertEqual(train["solver"]["solves"], 1)
        self.assertEqual(sum(train["solver"]["unconverged"].values()), 0)
        self.expect(SUCCESS, "delete", "seen")
        self.assertNotIn("shaped_model_bytes", scrape(self.daemon).names())

    def test_a_stream_counts_its_time_without_the_client(self):
        """A path whose frames the client takes late: the wait is nobody's work."""
        ends = [write_mesh(self.folder / f"end{i}.obj", *tube(angle)) for i, angle in enumerate((0.1, 0.5))]
        self.expect(SUCCESS, "interpolate", ends[0], ends[1], "--frames", 3, "--out", self.folder / "path")
        seen = scrape(self.daemon)
        self.assertEqual(seen.value("shaped_requests_total", method="Shapes.Interpolate", code="OK"), 1)
        # The path and each frame are solves.
        self.assertGreaterEqual(seen.value("shaped_solver_iterations_count", method="Shapes.Interpolate"), 3)

    def test_health_and_paths(self):
        self.assertEqual(get(self.daemon.metrics + "/healthz"), (200, "alive\n"))
        self.assertEqual(get(self.daemon.metrics + "/readyz"), (200, "ready\n"))
        self.assertEqual(get(self.daemon.metrics + "/healthz", "HEAD"), (200, ""))
        self.assertEqual(get(self.daemon.metrics + "/other")[0], 404)
        self.assertEqual(get(self.daemon.metrics + "/metrics", "DELETE")[0], 405)

    def test_refusals_by_cause(self):
        daemon = Daemon(self.folder / "refusing", "--open-streams", "1", "--metrics", "127.0.0.1:0")
        self.addCleanup(daemon.stop)
        with grpc.insecure_channel(daemon.address) as channel:
            stream = channel.stream_stream("/shaped.v1.Shapes/FitMarkers", lambda data: data, lambda data: data)
            first_messages = queue.Queue()
            first = stream(iter(first_messages.get, None))
            while scrape(daemon).value("shaped_pool_open_streams", pool="solver") < 1:
                time.sleep(0.01)
            self.assertEqual(scrape(daemon).value("shaped_requests_in_flight", method="Shapes.FitMarkers"), 1)
            second = stream(iter([]))
            with self.assertRaises(grpc.RpcError):
                next(second)
            self.assertEqual(second.code(), grpc.StatusCode.RESOURCE_EXHAUSTED)
            first_messages.put(None)
            with self.assertRaises(grpc.RpcError):
                next(first)
        seen = scrape(daemon)
        self.assertEqual(seen.value("shaped_refusals_total", cause="open_streams"), 1)
        self.assertEqual(seen.value("shaped_refusals_total", cause="queue_length"), 0)
        self.assertEqual(seen.value("shaped_requests_total", method="Shapes.FitMarkers", code="RESOURCE_EXHAUSTED"), 1)
        self.assertEqual(seen.value("shaped_requests_in_flight", method="Shapes.FitMarkers"), 0)

    def test_a_scraper_that_hangs_does_not_hold_up_the_end(self):
        daemon = Daemon(self.folder / "ending", "--metrics", "127.0.0.1:0")
        host, port = daemon.metrics.removeprefix("http://").split(":")
        hanging = [socket.create_connection((host, int(port))) for _ in range(5)]
        hanging[0].sendall(b"GET /metrics HTTP/1.1\r\n")
        self.assertEqual(get(daemon.metrics + "/healthz")[0], 200)
        begin = time.monotonic()
        self.assertEqual(daemon.stop()[0], 0)
        self.assertLess(time.monotonic() - begin, 3)
        for connection in hanging:
            connection.close()

    def test_bad_options_are_refused(self):
        for options, text in ((("--metrics", "9464"), "--metrics: \"9464\", want HOST:PORT"),
                              (("--metrics", self.daemon.metrics.removeprefix("http://")), "Address already in use"),
                              (("--log-format", "xml"), "--log-format: \"xml\"")):
            with self.assertRaises(RuntimeError) as raised:
                Daemon(self.folder / "unused", *options)
            self.assertIn(text, str(raised.exception))


class Log(unittest.TestCase):
    def run_daemon(self, log_format):
        """Serves a few traced calls; returns the log's lines after the first."""
        import pathlib
        import tempfile
        with tempfile.TemporaryDirectory() as folder:
            daemon = Daemon(pathlib.Path(folder) / "store", "--log-format", log_format)
            try:
                self.assertEqual(traced(daemon.address, f"00-{TRACE}-{SPAN}-01")[:36], f"00-{TRACE}-")
                call(daemon.address, "/shaped.v1.Jobs/Get", b"\x0a\x05a\nb\"c")  # GetJobRequest{id: 'a\nb"c'}
                shapectl = DaemonCase
                shapectl.daemon = daemon
                environment = dict(os.environ, TRACEPARENT=f"00-{TRACE[::-1]}-{SPAN}-01")
                subprocess.run(shapectl.command("models"), env=environment, check=True, capture_output=True)
            finally:
                code, log = daemon.stop()
            self.assertEqual(code, 0)
            return log.splitlines()[1:]

    def test_json_lines(self):
        lines = [json.loads(line) for line in self.run_daemon("json")]
        for line in lines:
            self.assertRegex(line["time"], r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z$")
        self.assertEqual([line["message"] for line in lines[-2:]], ["stopping", "stopped"])
        first, second, third = [line for line in lines if "request" in line]
        self.assertEqual((first["method"], first["outcome"], first["level"]), ("Models.List", "OK", "info"))
        self.assertEqual((first["trace_id"], first["parent_id"]), (TRACE, SPAN))
        self.assertRegex(first["span_id"], "^[0-9a-f]{16}$")
        self.assertNotEqual(first["span_id"], SPAN)
        self.assertTrue(first["peer"].startswith("ipv4:127.0.0.1:"))
        self.assertLessEqual(first["queue_seconds"] + first["compute_seconds"], first["seconds"] + 2e-6)
        self.assertEqual((second["outcome"], second["level"], second["parent_id"]), ("NOT_FOUND", "warning", ""))
        self.assertIn('a?b"c', second["message"])
        self.assertEqual(third["trace_id"], TRACE[::-1])
        self.assertNotEqual(third["parent_id"], SPAN)  # shapectl's own

    def test_text_lines(self):
        lines = self.run_daemon("text")
        calls = [line for line in lines if " request=" in line]
        self.assertEqual(len(calls), 3, lines)
        self.assertRegex(calls[0], r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}[+-]\d\d:\d\d info request=1 method=Models.List "
                         r"client=- model=- outcome=OK seconds=[\d.]+ queue_seconds=[\d.]+ compute_seconds=[\d.]+ peer=ipv4:127.0.0.1:\d+ "
                         f"trace={TRACE}$")
        self.assertIn('a?b\\"c', calls[1])


class Traces(DaemonCase):
    def test_a_valid_trace_goes_on_with_a_span_of_the_daemons(self):
        for flags, answered in (("01", "01"), ("00", "00"), ("ff", "01")):
            found = re.fullmatch(r"00-([0-9a-f]{32})-([0-9a-f]{16})-(\d\d)", traced(self.daemon.address, f"00-{TRACE}-{SPAN}-{flags}"))
            self.assertEqual((found[1], found[3]), (TRACE, answered))
            self.assertNotEqual(found[2], SPAN)

    def test_an_absent_or_invalid_trace_is_replaced(self):
        seen = set()
        valid = f"00-{TRACE}-{SPAN}-01"
        for headers in ((), ("",), ("garbage",), (valid.upper(),), ("01" + valid[2:],), (valid + "-x",), (valid, valid),
                        (f"00-{'0' * 32}-{SPAN}-01",)):
            found = re.fullmatch(r"00-([0-9a-f]{32})-[0-9a-f]{16}-00", traced(self.daemon.address, *headers))
            self.assertIsNotNone(found, headers)
            self.assertNotEqual(found[1], TRACE)
            seen.add(found[1])
        self.assertEqual(len(seen), 8)

    def test_errors_and_streams_carry_it_too(self):
        header = [("traceparent", f"00-{TRACE}-{SPAN}-01")]
        code, metadata = call(self.daemon.address, "/shaped.v1.Jobs/Get", b"\x0a\x019", header)
        self.assertEqual(code, grpc.StatusCode.NOT_FOUND)
        self.assertIn(TRACE, metadata["traceparent"])
        with grpc.insecure_channel(self.daemon.address) as channel:
            for kind, method in ((channel.unary_stream, "Jobs/Watch"), (channel.stream_stream, "Shapes/FitMarkers")):
                message = b"\x0a\x019" if kind == channel.unary_stream else iter([])
                stream = kind("/shaped.v1." + method, lambda data: data, lambda data: data)(message, metadata=header, timeout=10)
                self.assertIn(TRACE, dict(stream.initial_metadata())["traceparent"])
                with self.assertRaises(grpc.RpcError):
                    next(stream)


class Top(DaemonCase):
    def text(self, *words):
        command = [self.command()[0], "--server", self.daemon.address, "top", *words]
        return subprocess.run(command, capture_output=True, text=True, timeout=30, check=True).stdout

    def test_a_pipe_gets_one_look_and_no_control_characters(self):
        self.expect(SUCCESS, "models")
        text = self.text()
        self.assertNotIn("\x1b", text)
        self.assertEqual(text.count("METHOD"), 1)
        self.assertRegex(text, r"(?m)^shaped \d+\.\d+\.\d+ at \S+, up .*memory .* MiB of ")
        self.assertRegex(text, r"(?m)^solver +0 of \d+ busy, 0 of 256 waiting")
        self.assertRegex(text, r"(?m)^Models\.List +0 ")
        self.assertNotIn("Shapes.Edit", text)

    def test_count_and_interval(self):
        begin = time.monotonic()
        self.assertEqual(self.text("--count", "3", "--interval", "0.2").count("METHOD"), 3)
        self.assertGreater(time.monotonic() - begin, 0.4)
        self.refused("--interval", "top", "--interval", "0")

    def test_a_terminal_shows_it_live_until_ctrl_c(self):
        leader, follower = pty.openpty()
        command = [self.command()[0], "--server", self.daemon.address, "top", "--interval", "0.1"]
        process = subprocess.Popen(command, stdin=follower, stdout=follower, stderr=follower)
        os.close(follower)
        text, until = "", time.monotonic() + 10
        while text.count("METHOD") < 3 and time.monotonic() < until:
            if select.select([leader], [], [], 0.1)[0]:
                text += os.read(leader, 65536).decode()
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.wait(timeout=10), SUCCESS)
        while select.select([leader], [], [], 0.1)[0]:
            try:
                text += os.read(leader, 65536).decode()
            except OSError:
                break
        os.close(leader)
        self.assertGreaterEqual(text.count("METHOD"), 3)
        self.assertTrue(text.startswith("\x1b[?1049h"), repr(text[:40]))
        self.assertTrue(text.endswith("\x1b[?1049l"), repr(text[-40:]))


if __name__ == "__main__":
    unittest.main()
