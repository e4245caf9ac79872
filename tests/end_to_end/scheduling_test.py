"""Who is let in, who runs next and what ends early: a daemon with one worker, and requests that occupy it for as long as
a test wants."""

import contextlib
import json
import pathlib
import re
import signal
import subprocess
import tempfile
import threading
import time
import unittest

import grpc

from messages import Refusal, shapes_pb2
from scrape import scrape
from support import BAD_INPUT, BINARIES, SUCCESS, UNAVAILABLE, Daemon, DaemonCase, Result, tube, write_mesh

INTERPOLATE, FIT = "/shaped.v1.Shapes/Interpolate", "/shaped.v1.Shapes/FitMarkers"
PATIENCE = 60  # [s] for what takes milliseconds on a machine with nothing else to do


def path_request(times=0, rings=6, sides=6, angle=0.8):
    """A path between two tubes and a shape at each of so many times."""
    request = shapes_pb2.InterpolateRequest(times=[(i + 0.5) / times for i in range(times)])
    (start, faces), (end, _) = tube(0.1, rings=rings, sides=sides), tube(angle, rings=rings, sides=sides)
    getattr(request, "from").positions.extend(start.ravel())
    getattr(request, "from").faces.extend(faces.ravel())
    request.to.positions.extend(end.ravel())
    return request


class Call:
    """An Interpolate in the making, with a channel of its own."""

    def __init__(self, daemon, request, *, timeout=PATIENCE, priority=None, token=None):
        metadata = [("shaped-priority", priority)] if priority else []
        metadata += [("authorization", "Bearer " + token)] if token else []
        self.channel = grpc.insecure_channel(daemon.address)
        method = self.channel.unary_stream(INTERPOLATE, shapes_pb2.InterpolateRequest.SerializeToString,
                                           shapes_pb2.InterpolateResponse.FromString)
        self.begin = time.monotonic()
        self.stream = method(request, timeout=timeout, metadata=metadata)

    def first(self):
        return next(self.stream)

    def outcome(self):
        """Reads to the end: None when all went well, else what was refused."""
        try:
            for _ in self.stream:
                pass
            return None
        except grpc.RpcError as error:
            return Refusal(error)
        finally:
            self.seconds = time.monotonic() - self.begin
            self.channel.close()

    def cancel(self):
        self.stream.cancel()
        self.channel.close()


class Scheduling(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def start(self, *options):
        self.daemon = Daemon(self.folder / "store", "--threads", "1", "--metrics", "127.0.0.1:0", *options)
        self.addCleanup(self.daemon.stop)
        return self.daemon

    def shapectl(self, *words, address=None):
        command = [BINARIES / "shapectl", "--server", address or self.daemon.address, "--output", "json", *map(str, words)]
        return Result(subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE))

    def tokens(self, *names):
        """A tokens file for these clients; their tokens are in self.secrets."""
        made = [self.shapectl("token", name, "--roles", "infer", address="localhost:1").json for name in names]
        self.secrets = {name: one["token"] for name, one in zip(names, made)}
        path = self.folder / "tokens.json"
        path.write_text(json.dumps({"tokens": [one["entry"] for one in made]}))
        return path

    def call(self, request=None, **how):
        call = Call(self.daemon, request or path_request(), **how)
        self.addCleanup(call.cancel)
        return call

    def pool(self, what, pool="solver"):
        return scrape(self.daemon).value("shaped_pool_" + what, pool=pool)

    def wait(self, question, what):
        until = time.monotonic() + PATIENCE
        while not question():
            self.assertLess(time.monotonic(), until, what + ": " + self.daemon.log[-2000:])
            time.sleep(0.005)

    def occupy(self, **how):
        """The worker has a path with 10,000 shapes, and waits for somebody to take them."""
        call = self.call(path_request(times=10000), **how)
        call.first()
        return call

    def queue(self, length, request=None, **how):
        """A call that waits as the last of so many."""
        call = self.call(request, **how)
        self.wait(lambda: self.pool("queue_length") == length, f"{length} calls wait")
        return call

    def refusals(self):
        return {dict(labels)["cause"]: value for (name, labels), value in scrape(self.daemon).series.items()
                if name == "shaped_refusals_total" and value > 0}

    def assertRefused(self, call, reason):
        refusal = call.outcome()
        self.assertIsNotNone(refusal, "was let in")
        self.assertEqual((refusal.code, refusal.reason), (grpc.StatusCode.RESOURCE_EXHAUSTED, reason), refusal.text)
        self.assertGreaterEqual(refusal.retry_after, 0.1)
        self.assertLessEqual(refusal.retry_after, 60)
        self.assertEqual(int(refusal.metadata["grpc-retry-pushback-ms"]), round(1000 * refusal.retry_after))
        self.assertIn("try again in", refusal.text)
        return refusal

    def ended(self):
        """(request id, client) in the order in which the one worker ended them."""
        return [(int(request), client) for request, client in
                re.findall(r"request=(\d+) method=Shapes\.Interpolate client=(\S+) model=- outcome=OK", self.daemon.log)]


class Refusals(Scheduling):
    def test_a_full_queue(self):
        self.start("--queue-length", "2")
        self.occupy()
        self.queue(1)
        self.queue(2)
        call = self.call()
        self.assertRefused(call, "SERVER_BUSY")
        self.assertLess(call.seconds, 10)  # at once, not when the queue moves
        self.assertEqual(self.refusals(), {"queue_length": 1})

    def test_batch_leaves_room_for_others(self):
        self.start("--queue-length", "8")
        self.occupy()
        for i in range(4):
            self.queue(i + 1, priority="batch")
        self.assertIn("priority batch", self.assertRefused(self.call(priority="batch"), "SERVER_BUSY").text)
        for i in range(4, 7):
            self.queue(i + 1)
        self.assertRefused(self.call(), "SERVER_BUSY")
        self.queue(8, priority="interactive")
        self.assertRefused(self.call(priority="interactive"), "SERVER_BUSY")

    def test_too_many_bytes_in_flight(self):
        self.start("--in-flight-megabytes", "1")
        self.occupy()
        large = path_request(rings=250, sides=100)  # some 1.2 MB: three of it are over the limit in any order
        self.assertGreater(large.ByteSize(), 1 << 20)
        self.assertRefused(self.call(large), "BYTES_IN_FLIGHT")
        self.queue(1)
        self.assertEqual(self.refusals(), {"bytes_in_flight": 1})

    def test_one_clients_requests_and_bytes(self):
        self.start("--client-requests", "2", "--client-megabytes", "1")
        blocker = self.occupy()
        large = path_request(rings=250, sides=100)
        self.assertRefused(self.call(large), "CLIENT_BYTES")
        waiting = self.queue(1)
        self.assertRefused(self.call(), "CLIENT_REQUESTS")
        self.assertEqual(self.refusals(), {"client_bytes": 1, "client_requests": 1})
        seen = self.shapectl("top").json
        self.assertEqual((seen["refusals"]["client_bytes"], seen["refusals"]["client_requests"]), (1, 1))
        # What a call held is free before its client hears of the end.
        blocker.cancel()
        self.assertIsNone(waiting.outcome())
        for _ in range(20):
            self.assertIsNone(self.call().outcome())

    def test_one_clients_limits_leave_others_alone(self):
        self.start("--client-requests", "1", "--tokens", self.tokens("ann", "bob"))
        self.occupy(token=self.secrets["ann"])
        self.assertRefused(self.call(token=self.secrets["ann"]), "CLIENT_REQUESTS")
        self.queue(1, token=self.secrets["bob"])

    def test_streams(self):
        for options, reason, cause in ((("--client-streams", "1"), "CLIENT_STREAMS", "client_streams"),
                                       (("--open-streams", "1"), "OPEN_STREAMS", "open_streams")):
            self.start(*options)
            with grpc.insecure_channel(self.daemon.address) as channel:
                stream = channel.stream_stream(FIT, lambda data: data, lambda data: data)
                over = threading.Event()
                first = stream(iter(lambda: over.wait(PATIENCE) and None, None), timeout=PATIENCE)
                self.wait(lambda: self.pool("open_streams") == 1, "a stream is open")
                with self.assertRaises(grpc.RpcError) as raised:
                    next(stream(iter([]), timeout=PATIENCE))
                self.assertEqual(Refusal(raised.exception).reason, reason)
                self.assertEqual(self.refusals(), {cause: 1})
                over.set()
                with self.assertRaises(grpc.RpcError):
                    next(first)
            self.daemon.stop()

    def test_limits_follow_the_configuration(self):
        config = self.folder / "shaped.yaml"
        config.write_text("client-requests: 1\n")
        self.start("--config", config)
        self.occupy()
        self.assertRefused(self.call(), "CLIENT_REQUESTS")
        config.write_text("client-requests: 5\nageing: 3\n")
        self.daemon.process.send_signal(signal.SIGHUP)
        self.daemon.wait_for("configuration read again")
        self.assertIn("ageing is now 3\n", self.daemon.log)
        self.queue(1)

    def test_shapectl_says_when_to_come_back(self):
        self.start("--client-requests", "1")
        self.occupy()
        ends = [write_mesh(self.folder / f"end{i}.obj", *tube(angle)) for i, angle in enumerate((0.1, 0.5))]
        result = self.shapectl("interpolate", *ends, "--frames", 2, "--out", self.folder / "path")
        self.assertEqual(result.code, UNAVAILABLE, result.out)
        error = result.json["error"]
        self.assertEqual(error["reason"], "CLIENT_REQUESTS")
        self.assertGreaterEqual(error["retry_after_seconds"], 0.1)


class Order(Scheduling):
    def test_the_urgent_overtake(self):
        self.start()
        blocker = self.occupy()
        waiting = [self.queue(i + 1, priority=priority)
                   for i, priority in enumerate(("batch", None, "interactive", "batch", "interactive", "normal"))]
        blocker.cancel()
        for call in waiting:
            self.assertIsNone(call.outcome())
        # The blocker was request 1; of one class, first come first served.
        self.wait(lambda: len(self.ended()) == 6, "all have ended")
        self.assertEqual([request - 2 for request, _ in self.ended()], [2, 4, 1, 5, 0, 3])

    def test_batch_is_not_left_waiting(self):
        """Behind requests without end, it runs once it has waited for two classes."""
        self.start("--ageing", "0.5")
        blocker = self.occupy()
        batch = self.queue(1, priority="batch")
        over = threading.Event()

        def insist():
            while not over.is_set():
                with contextlib.suppress(grpc.RpcError):
                    Call(self.daemon, path_request(), priority="interactive").outcome()
        threads = [threading.Thread(target=insist, daemon=True) for _ in range(4)]
        for thread in threads:
            thread.start()
        self.wait(lambda: self.pool("queue_length") >= 3, "the others insist")
        blocker.cancel()
        self.assertIsNone(batch.outcome())
        over.set()
        for thread in threads:
            thread.join(timeout=PATIENCE)

    def test_clients_take_turns(self):
        self.start("--tokens", self.tokens("ann", "bob"))
        blocker = self.occupy(token=self.secrets["ann"])
        waiting = [self.queue(i + 1, token=self.secrets["ann"]) for i in range(8)]
        waiting += [self.queue(9 + i, token=self.secrets["bob"]) for i in range(2)]
        blocker.cancel()
        for call in waiting:
            self.assertIsNone(call.outcome())
        self.wait(lambda: len(self.ended()) == 10, "all have ended")
        clients = [client for _, client in self.ended()]
        # His two do not wait for her eight: she has had the worker for a long while already.
        self.assertEqual(clients[:2], ["bob", "bob"], clients)

    def test_priorities_are_checked(self):
        self.start()
        refusal = self.call(priority="urgent").outcome()
        self.assertEqual((refusal.code, refusal.reason, refusal.field),
                         (grpc.StatusCode.INVALID_ARGUMENT, "INVALID_FIELD", "shaped-priority"))
        self.assertIn("use interactive, normal or batch", refusal.text)
        with grpc.insecure_channel(self.daemon.address) as channel:
            for method in ("Models/List", "Jobs/Wait"):
                with self.assertRaises(grpc.RpcError) as raised:
                    channel.unary_unary("/shaped.v1." + method, lambda data: data, lambda data: data)(
                        b"", timeout=PATIENCE, metadata=[("shaped-priority", "")])
                self.assertEqual(raised.exception.code(), grpc.StatusCode.INVALID_ARGUMENT)
            with self.assertRaises(grpc.RpcError) as raised:
                next(channel.stream_stream(FIT, lambda data: data, lambda data: data)(
                    iter([]), timeout=PATIENCE, metadata=[("shaped-priority", "a"), ("shaped-priority", "b")]))
            self.assertEqual(Refusal(raised.exception).field, "shaped-priority")
        self.assertEqual(self.pool("open_streams"), 0)
        for priority, code in (("interactive", SUCCESS), ("batch", SUCCESS), ("urgent", BAD_INPUT)):
            self.assertEqual(self.shapectl("models", "--priority", priority).code, code)


class Ends(Scheduling):
    def test_a_deadline_passes_in_the_queue(self):
        self.start()
        self.occupy()
        late = self.queue(1, timeout=1)
        patient = self.queue(2)
        self.assertEqual(late.outcome().code, grpc.StatusCode.DEADLINE_EXCEEDED)
        self.assertLess(late.seconds, 20)
        # It has left although no worker has come to it; its client may have heard of it a little before.
        self.wait(lambda: self.pool("queue_length") == 1, "it leaves the queue")
        self.assertEqual(self.pool("busy_threads"), 1)
        self.assertIn("outcome=DEADLINE_EXCEEDED", self.daemon.wait_for("outcome=DEADLINE_EXCEEDED"))
        patient.cancel()

    def test_the_cap_without_a_deadline(self):
        self.start("--longest-call", "0.5")
        refusal = self.call(path_request(rings=140, sides=50, angle=2.5), timeout=None).outcome()  # takes seconds
        self.assertEqual((refusal.code, refusal.reason), (grpc.StatusCode.DEADLINE_EXCEEDED, "DEADLINE_EXCEEDED"))

    def test_cancelling_in_the_queue(self):
        self.start()
        self.occupy()
        waiting = self.queue(1)
        waiting.cancel()
        self.wait(lambda: self.pool("queue_length") == 0, "it leaves the queue")
        self.assertEqual(self.pool("busy_threads"), 1)
        self.assertLess(self.pool("bytes_in_flight"), path_request(times=10000).ByteSize() + 1000)

    def test_cancelling_a_solver_frees_its_worker(self):
        """A path on a mesh of 7,000 vertices takes seconds; the worker must be free long before."""
        self.start()
        slow = path_request(rings=140, sides=50, angle=2.5)
        for after in (0.3, 0.6, 1.0):
            call = self.call(slow)
            self.wait(lambda: self.pool("busy_threads") == 1, "it runs")
            time.sleep(after)
            begin = time.monotonic()
            call.cancel()
            self.wait(lambda: self.pool("busy_threads") == 0, "the worker is free")
            self.assertLess(time.monotonic() - begin, 5)
            self.assertEqual(self.pool("bytes_in_flight"), 0)
        self.assertIsNone(self.call().outcome())


class Saturated(DaemonCase):
    daemon_options = ("--threads", "1", "--queue-length", "8")

    def test_health_and_lists_answer(self):
        meshes = [write_mesh(self.folder / f"big{i}.obj", *tube(-1.5 + 0.2 * i, 0.3 + 0.01 * (i % 7), 80, 30))
                  for i in range(16)]
        train = self.command("train", "shell-pga", "big", *meshes, "--coarse-vertices", 1500)
        training = subprocess.Popen(train, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.addCleanup(training.wait)
        self.addCleanup(training.kill)
        slow = path_request(rings=140, sides=50, angle=2.5)
        calls = [Call(self.daemon, slow, priority="interactive") for _ in range(9)]
        waits = []
        with grpc.insecure_channel(self.daemon.address) as channel:
            check = channel.unary_unary("/grpc.health.v1.Health/Check", lambda data: data, lambda data: data)
            for _ in range(60):
                begin = time.monotonic()
                self.assertEqual(check(b"", timeout=PATIENCE), b"\x08\x01")
                waits.append(time.monotonic() - begin)
                time.sleep(0.05)
            self.expect(SUCCESS, "models")
        for call in calls:
            call.cancel()
        # 50 ms on a machine of its own (tests/benchmark/RESULTS.md); far less than any of the requests in any case.
        self.assertLess(sorted(waits)[len(waits) // 2], 1, waits)


if __name__ == "__main__":
    unittest.main()
