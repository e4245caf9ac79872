"""Clients that cost the daemon something and give nothing: thousands of idle connections, streams that are never read or only
half sent, metadata of a megabyte. What they hold comes back, and others are served meanwhile."""

import contextlib
import importlib
import json
import resource
import selectors
import socket
import threading
import time
import unittest

import grpc

from messages import Refusal, shapes_pb2
from scheduling_test import PATIENCE, Scheduling, path_request
from scrape import scrape
from support import skip_loudly, tube
from transfer_test import sha256

datasets_pb2 = importlib.import_module("shaped.v1.datasets_pb2")
jobs_pb2 = importlib.import_module("shaped.v1.jobs_pb2")
models_pb2 = importlib.import_module("shaped.v1.models_pb2")

CONNECTIONS, ROUNDS = 10_000, 4
SPARE = 500  # descriptors for what test and daemon have open besides
# What an HTTP/2 client says first: the preface, its settings (none), and that it has read the server's.
GREETING = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + b"\0\0\0\4\0\0\0\0\0" + b"\0\0\0\4\1\0\0\0\0"
PING, PONG = b"\0\0\x08\6\0\0\0\0\0", b"\0\0\x08\6\1\0\0\0\0"


def raise_descriptor_limit(wanted):
    """Of this process and the daemons that it starts."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    with contextlib.suppress(ValueError, OSError):  # who may not raise the hard limit has the one there is
        resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, wanted), max(hard, wanted)))
        return
    if hard < wanted:
        skip_loudly(f"at most {hard} open files, {wanted} are needed for {CONNECTIONS} connections (ulimit -Hn)")
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, wanted), hard))


class Crowd:
    """Connections that greet, answer pings, and want nothing; from an address of the loopback with ports enough for them."""

    def __init__(self, address, count, source):
        host, port = address.rsplit(":", 1)
        self.selector, self.over = selectors.DefaultSelector(), threading.Event()
        self.connections = []
        self.lost = 0
        self.silent = set()  # have not heard from the daemon
        self.thread = threading.Thread(target=self.answer, daemon=True)
        self.thread.start()
        for _ in range(count):
            connection = socket.create_connection((host, int(port)), PATIENCE, (source, 0))
            connection.sendall(GREETING)
            connection.setblocking(False)
            self.silent.add(connection)
            self.selector.register(connection, selectors.EVENT_READ)
            self.connections.append(connection)

    def answer(self):
        while not self.over.is_set():
            for key, _ in self.selector.select(0.1):
                with contextlib.suppress(BlockingIOError, OSError):
                    data = key.fileobj.recv(4096)
                    self.silent.discard(key.fileobj)
                    if not data:
                        self.lost += 1
                        self.selector.unregister(key.fileobj)
                    elif (at := data.find(PING)) >= 0:
                        key.fileobj.sendall(PONG + data[at + len(PING):at + len(PING) + 8])

    def leave(self):
        self.over.set()
        self.thread.join(PATIENCE)
        self.selector.close()
        for connection in self.connections:
            connection.close()


class Idle(Scheduling):
    def descriptors(self):
        return scrape(self.daemon).value("process_open_fds")

    def megabytes(self):
        return scrape(self.daemon).value("process_resident_memory_bytes") / 1e6

    def test_ten_thousand_idle_connections(self):
        raise_descriptor_limit(CONNECTIONS + SPARE)
        self.start()
        if scrape(self.daemon).value("process_max_fds") < CONNECTIONS + SPARE:
            skip_loudly("the daemon may not have so many files open")
        before, seen, slowest = self.descriptors(), [self.megabytes()], 0
        for i in range(ROUNDS):
            crowd = Crowd(self.daemon.address, CONNECTIONS, f"127.0.0.{i + 2}")
            self.addCleanup(crowd.leave)
            self.wait(lambda: not crowd.silent, "all connections are greeted")
            self.assertGreaterEqual(self.descriptors(), before + CONNECTIONS)
            seen.append(self.megabytes())
            for _ in range(20):
                begin = time.monotonic()
                self.assertIsNone(self.call().outcome())
                slowest = max(slowest, time.monotonic() - begin)
            self.assertLess(slowest, 10)
            self.assertEqual(crowd.lost, 0)
            crowd.leave()
            self.wait(lambda: self.descriptors() <= before + 20, "the connections are closed")
            seen.append(self.megabytes())
        print(f"resident MB: before {seen[0]:.0f}; with {CONNECTIONS} connections and after them, {ROUNDS} times: "
              f"{[round(x) for x in seen[1:]]}; slowest call {slowest * 1000:.0f} ms")
        first = seen[1] - seen[0]
        self.assertLess(first, CONNECTIONS * 0.1)  # 100 KB each; it is a quarter of that
        # The allocator keeps what was freed, in pieces, and uses it again: some twice the first crowd's is never
        # exceeded. Were it lost, each crowd would add as much as the first.
        self.assertLess(max(seen) - seen[0], 0.75 * ROUNDS * first)


class NeverRead(Scheduling):
    def given_up(self, method):
        line = self.daemon.wait_for("given up: the client did not take", PATIENCE)
        self.assertIn(f"method={method}", line)
        self.assertIn("outcome=CANCELLED", line)

    def test_the_worker_of_a_stream_that_nobody_reads_is_free_again(self):
        self.start("--write-patience", "1")
        stuck = self.call(path_request(times=5000, rings=30, sides=20), timeout=None)  # 35 MB, more than connections buffer
        stuck.first()
        waiting = self.call()  # behind it: there is one worker
        self.assertIsNone(waiting.outcome())
        self.given_up("Shapes.Interpolate")
        self.wait(lambda: self.pool("busy_threads") == 0, "the worker is free")
        self.assertEqual(self.pool("bytes_in_flight"), 0)
        refusal = stuck.outcome()  # whoever reads at last finds what came before, and then this
        self.assertEqual(refusal.code, grpc.StatusCode.CANCELLED)

    def test_nor_does_a_download_that_nobody_reads_keep_its_place(self):
        version = self.folder / "store/models/large/1"
        version.mkdir(parents=True)
        size = 64 << 20
        manifest = {"kind": "shell_pga", "format_version": 1, "created_by": "test", "description": {},
                    "tensors": {"file": "tensors.safetensors", "bytes": size, "sha256": "0" * 64}}
        (version / "manifest.json").write_text(json.dumps(manifest))
        header = b'{"x":{"dtype":"F64","shape":[%d],"data_offsets":[0,%d]}}'
        text = (header % ((size - 128) // 8, size - 128)).ljust(120)
        with open(version / "tensors.safetensors", "wb") as file:
            file.write(len(text).to_bytes(8, "little") + text)
            file.truncate(size)
        self.start("--write-patience", "1")
        with grpc.insecure_channel(self.daemon.address) as channel:
            download = channel.unary_stream("/shaped.v1.Models/Download", models_pb2.DownloadModelRequest.SerializeToString,
                                            models_pb2.DownloadModelResponse.FromString)
            stream = download(models_pb2.DownloadModelRequest(model={"name": "large"}))
            self.assertTrue(next(stream).HasField("header"))
            self.wait(lambda: self.pool("open_streams", "light") == 0, "its place is free")
            self.given_up("Models.Download")
            self.assertEqual(self.shapectl("models").code, 0)
            with self.assertRaises(grpc.RpcError) as raised:
                for _ in stream:
                    pass
            self.assertEqual(raised.exception.code(), grpc.StatusCode.CANCELLED)


def half_a_model():
    """Header and first piece of what says of itself that it is a model of 2 MiB."""
    zeros = "0" * 64
    manifest = json.dumps({"kind": "shell_pga", "format_version": 1, "created_by": "test", "description": {},
                           "tensors": {"file": "tensors.safetensors", "bytes": 2 << 20, "sha256": zeros}}).encode()
    return (models_pb2.UploadModelRequest(header={"name": "half", "files": {
                "manifest": manifest, "manifest_sha256": sha256(manifest), "tensors_sha256": zeros, "tensors_bytes": 2 << 20}}),
            models_pb2.UploadModelRequest(tensors=bytes(1 << 14)))


class HalfSent(Scheduling):
    def half(self, kind, method, request, *first):
        """A stream that sends these messages and then nothing; how it ended, and the time that took [s]."""
        over = threading.Event()

        def some():
            yield from first
            over.wait(2 * PATIENCE)

        begin = time.monotonic()
        with grpc.insecure_channel(self.daemon.address) as channel:
            try:
                answer = getattr(channel, kind)("/shaped.v1." + method, request.SerializeToString, lambda data: data)(
                    some(), timeout=PATIENCE)
                for _ in answer if kind == "stream_stream" else ():
                    pass
                self.fail("a half stream was answered")
            except grpc.RpcError as error:
                return Refusal(error), time.monotonic() - begin
            finally:
                over.set()

    def assertEnds(self, *stream):
        refusal, seconds = self.half(*stream)
        self.assertEqual((refusal.code, refusal.reason), (grpc.StatusCode.DEADLINE_EXCEEDED, "DEADLINE_EXCEEDED"), refusal.text)
        self.assertLess(seconds, PATIENCE / 2)  # by the daemon's cap, not the client's deadline
        for pool in ("solver", "light"):
            self.assertEqual((self.pool("open_streams", pool), self.pool("bytes_in_flight", pool)), (0, 0))

    def stray(self):
        """Files of the store that are not of its own: the lock and the job records."""
        return [str(path) for path in (self.folder / "store").rglob("*")
                if path.is_file() and path.name != ".lock" and not path.name.startswith("jobs.sqlite")]

    def test_streams_that_are_half_sent_end_and_leave_nothing(self):
        # One place: a stream that kept it would shut out the next.
        self.start("--longest-call", "1", "--open-streams", "1")
        vertices, faces = tube(0.2)
        upload = datasets_pb2.UploadDatasetRequest
        header = upload(header={"name": "half", "vertex_count": len(vertices), "faces": faces.ravel().tolist(), "frames": 3})
        frame = upload(frame={"positions": vertices.ravel().tolist()})
        self.assertEnds("stream_unary", "Datasets/Upload", upload, header, frame)
        self.assertEnds("stream_unary", "Datasets/Upload", upload)
        self.assertEnds("stream_unary", "Models/Upload", models_pb2.UploadModelRequest)
        self.assertEnds("stream_unary", "Models/Upload", models_pb2.UploadModelRequest, *half_a_model())
        self.assertEnds("stream_unary", "Jobs/FitMarkers", jobs_pb2.FitMarkersJobRequest)
        self.assertEnds("stream_stream", "Shapes/FitMarkers", shapes_pb2.FitMarkersRequest)
        self.assertEqual(self.stray(), [])
        with grpc.insecure_channel(self.daemon.address) as channel:
            whole = channel.stream_unary("/shaped.v1.Datasets/Upload", upload.SerializeToString,
                                         datasets_pb2.UploadDatasetResponse.FromString)
            self.assertEqual(whole(iter([header, frame, frame, frame]), timeout=PATIENCE).dataset.frames, 3)


class Metadata(Scheduling):
    def test_a_megabyte_of_metadata_is_refused_and_others_notice_nothing(self):
        self.start()
        other = self.occupy()
        for value in ("x" * (1 << 20), "x" * 50_000):
            for _ in range(5):
                with grpc.insecure_channel(self.daemon.address, [("grpc.use_local_subchannel_pool", 1)]) as channel:
                    limits = channel.unary_unary("/shaped.v1.Server/GetLimits", lambda data: data, lambda data: data)
                    with self.assertRaises(grpc.RpcError) as raised:
                        limits(b"", timeout=PATIENCE, metadata=[("x-large", value)])
                # gRPC sometimes closes the connection before the refusal is on its way.
                self.assertIn(raised.exception.code(), (grpc.StatusCode.RESOURCE_EXHAUSTED, grpc.StatusCode.UNAVAILABLE))
                other.first()
        self.assertEqual(self.shapectl("models").code, 0)
        self.assertTrue(self.daemon.running())


if __name__ == "__main__":
    unittest.main()
