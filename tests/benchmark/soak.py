"""Mixed calls to a running daemon, some of them bad in every way we know: does it stay up, flat and truthful?

    mkdir OUT && protoc --python_out=OUT -I proto proto/shaped/v1/*.proto
    PYTHONPATH=OUT /usr/bin/python3 tests/benchmark/soak.py 127.0.0.1:50051 MODEL --pid PID [--calls 200000] [--bad 0.05]

Prints a JSON document: calls by kind and outcome, and the daemon's resident memory over time. Exit code 1 when there was a
status INTERNAL or UNKNOWN, a bad call was answered OK, or memory over the last half of the run is not flat within 5 %.
"""

import argparse
import collections
import json
import pathlib
import random
import sys
import threading
import time

import grpc
import numpy

from shaped.v1 import datasets_pb2, jobs_pb2, models_pb2, server_pb2, shapes_pb2

TIMEOUT = 30  # of a call [s]
BUSY = ("RESOURCE_EXHAUSTED",)


class Daemon:
    """What the calls need: a channel, the model's mean, points of the model."""

    def __init__(self, address, model):
        self.channel = grpc.insecure_channel(address, [("grpc.max_receive_message_length", -1), ("grpc.use_local_subchannel_pool", 1)])
        self.address, self.model = address, model
        got = models_pb2.GetModelResponse.FromString(self.unary("Models/Get", self.get(True)))
        self.mean = numpy.array(got.mean.positions, dtype=numpy.float32)
        self.faces = got.mean.faces
        projected = shapes_pb2.ProjectResponse.FromString(self.unary("Shapes/Project", self.project(self.mean).SerializeToString()))
        self.coefficients = projected.coefficients

    def unary(self, method, request, timeout=TIMEOUT, **options):
        return self.channel.unary_unary("/shaped.v1." + method, None, None)(request, timeout=timeout, **options)

    def get(self, with_mean):
        request = models_pb2.GetModelRequest(with_mean=with_mean)
        request.model.name = self.model
        return request.SerializeToString()

    def project(self, positions):
        request = shapes_pb2.ProjectRequest()
        request.model.name = self.model
        request.shape.positions.extend(positions)
        return request

    def synthesize(self, coefficients):
        request = shapes_pb2.SynthesizeRequest(coefficients=coefficients)
        request.model.name = self.model
        return request.SerializeToString()

    def edit(self, vertices, model=None):
        request = shapes_pb2.EditRequest()
        request.model.name = model or self.model
        for vertex in vertices:
            x, y, z = self.mean[3 * (vertex % (len(self.mean) // 3)):][:3]
            request.handles.add(vertex=vertex, x=x, y=y, z=z * 1.01)
        return request.SerializeToString()

    def setup(self, vertices):
        request = shapes_pb2.FitMarkersRequest()
        request.setup.model.name = self.model
        request.setup.scale = 1
        for vertex in vertices:
            request.setup.marker_set.markers.add(label=f"m{vertex}", vertex=vertex)
        return request.SerializeToString()

    def frame(self, vertices, number=0):
        request = shapes_pb2.FitMarkersRequest()
        request.frame.frame = number
        for vertex in vertices:
            request.frame.positions.extend(self.mean[3 * vertex:3 * vertex + 3])
        return request.SerializeToString()

    def interpolate(self, times, to=None):
        request = shapes_pb2.InterpolateRequest(times=times, path_steps=2)
        getattr(request, "from").positions.extend(self.mean)
        getattr(request, "from").faces.extend(self.faces)
        request.to.positions.extend(self.mean * 1.01 if to is None else to)
        return request.SerializeToString()

    def header(self, frames, vertices=None):
        request = datasets_pb2.UploadDatasetRequest()
        request.header.name = f"soak{random.getrandbits(40)}"
        request.header.vertex_count = vertices or len(self.mean) // 3
        request.header.faces.extend(self.faces)
        request.header.frames = frames
        return request.SerializeToString()

    def upload(self, messages):
        return self.channel.stream_unary("/shaped.v1.Datasets/Upload", None, None)(iter(messages), timeout=TIMEOUT)

    def fit(self, messages, leave_after=None):
        stream = self.channel.stream_stream("/shaped.v1.Shapes/FitMarkers", None, None)(iter(messages), timeout=TIMEOUT)
        for i, _ in enumerate(stream):
            if i == leave_after:
                return stream.cancel()
        stream.result() if hasattr(stream, "result") else None
        return None

    def read(self, request, leave_after=None):
        stream = self.channel.unary_stream("/shaped.v1.Shapes/Interpolate", None, None)(request, timeout=TIMEOUT)
        for i, _ in enumerate(stream):
            if i == leave_after:
                return stream.cancel()
        return None


def much_metadata(address):
    """On a connection of its own: gRPC may close it, and what else is on it then fails."""
    with grpc.insecure_channel(address, [("grpc.use_local_subchannel_pool", 1)]) as channel:
        channel.unary_unary("/shaped.v1.Server/GetLimits")(b"", timeout=TIMEOUT, metadata=[("x", "y" * 100_000)])


MARKERS = (0, 5, 20, 40, 60, 80)


def good_calls(daemon):
    """Name, how often, what to do."""
    return [
        ("limits", 30, lambda: daemon.unary("Server/GetLimits", b"")),
        ("list", 15, lambda: daemon.unary("Models/List", b"")),
        ("jobs", 10, lambda: daemon.unary("Jobs/List", b"")),
        ("statistics", 4, lambda: daemon.unary("Admin/GetStatistics", b"")),
        ("describe", 15, lambda: daemon.unary("Models/Get", daemon.get(False))),
        ("mean", 5, lambda: daemon.unary("Models/Get", daemon.get(True))),
        ("project", 8, lambda: daemon.unary("Shapes/Project", daemon.project(daemon.mean).SerializeToString())),
        ("synthesize", 8, lambda: daemon.unary("Shapes/Synthesize", daemon.synthesize(daemon.coefficients))),
        ("edit", 1, lambda: daemon.unary("Shapes/Edit", daemon.edit(MARKERS[:4]))),
        ("fit", 2, lambda: daemon.fit([daemon.setup(MARKERS), daemon.frame(MARKERS), daemon.frame(MARKERS, 1)])),
        ("interpolate", 2, lambda: daemon.read(daemon.interpolate([0, 1]))),
    ]


def bad_calls(daemon):
    nan, mean = float("nan"), daemon.mean
    spoiled = mean.copy()
    spoiled[7] = nan
    garbage = random.randbytes(200)
    name = models_pb2.GetModelRequest()
    name.model.name = "no-such-model"
    hostile = models_pb2.GetModelRequest()
    hostile.model.name = "../../etc/passwd"
    job = jobs_pb2.GetJobRequest(id="x" * 5000).SerializeToString()
    unary = daemon.unary
    # Field 1 as text, but no UTF-8; a length beyond the end; a group that never ends.
    no_text, too_long, open_group = b"\x0a\x02\xff\xfe", b"\x0a\xff\xff\xff\xff\x07abc", b"\x0b\x0b\x0b"
    coefficients = shapes_pb2.SynthesizeRequest().coefficients
    coefficients.alpha.extend([nan, 2])
    return [
        ("short shape", lambda: unary("Shapes/Project", daemon.project(mean[:-1]).SerializeToString())),
        ("no shape", lambda: unary("Shapes/Project", daemon.project([]).SerializeToString())),
        ("NaN in a shape", lambda: unary("Shapes/Project", daemon.project(spoiled).SerializeToString())),
        ("all at one point", lambda: unary("Shapes/Score", daemon.project(0 * mean).SerializeToString())),
        ("NaN coefficients", lambda: unary("Shapes/Synthesize", daemon.synthesize(coefficients))),
        ("unknown model", lambda: unary("Models/Get", name.SerializeToString())),
        ("a path for a name", lambda: unary("Models/Get", hostile.SerializeToString())),
        ("handles beyond the mesh", lambda: unary("Shapes/Edit", daemon.edit([1, 2, 4_000_000_000]))),
        ("two handles", lambda: unary("Shapes/Edit", daemon.edit([1, 2]))),
        ("unknown job", lambda: unary("Jobs/Get", job)),
        ("garbage, unary", lambda: unary("Shapes/Project", garbage)),
        ("garbage, unary 2", lambda: unary("Jobs/Wait", too_long)),
        ("no UTF-8", lambda: unary("Jobs/Get", no_text)),
        ("open group", lambda: unary("Models/Get", open_group)),
        ("garbage, server stream", lambda: daemon.read(garbage)),
        ("garbage, two-way stream", lambda: daemon.fit([garbage])),
        ("garbage after a setup", lambda: daemon.fit([daemon.setup(MARKERS), too_long])),
        ("garbage, upload", lambda: daemon.upload([too_long])),
        ("unknown method", lambda: unary("Shapes/Sing", b"")),
        ("frame before setup", lambda: daemon.fit([daemon.frame(MARKERS)])),
        ("empty stream", lambda: daemon.fit([])),
        ("upload half sent", lambda: daemon.upload([daemon.header(3)])),
        ("upload without header", lambda: daemon.upload([b"\x12\x00"])),
        ("upload of another size", lambda: daemon.upload([daemon.header(1, 17)])),
        ("interpolate far away", lambda: daemon.read(daemon.interpolate([1e9]))),
        ("interpolate NaN", lambda: daemon.read(daemon.interpolate([0.5], to=spoiled))),
        ("cancelled stream", lambda: daemon.read(daemon.interpolate([0, 0.5, 1] * 20), leave_after=0)),
        ("cancelled fit", lambda: daemon.fit([daemon.setup(MARKERS)] + [daemon.frame(MARKERS, i) for i in range(20)], leave_after=1)),
        ("deadline at once", lambda: unary("Shapes/Project", daemon.project(mean).SerializeToString(), timeout=0.0005)),
        ("much metadata", lambda: much_metadata(daemon.address)),
    ]


# These may succeed or end by the client's own doing.
HARMLESS = {"cancelled stream", "cancelled fit", "deadline at once"}


def outcome(call):
    try:
        call()
        return "OK"
    except grpc.RpcError as error:
        if error.code() == grpc.StatusCode.UNAVAILABLE:  # never to be expected: say which
            return f"UNAVAILABLE: {error.details()}"
        return error.code().name if error.code() else "CANCELLED"


class Soak:
    def __init__(self, options):
        self.options, self.left, self.lock = options, options.calls, threading.Lock()
        self.outcomes = {"good": collections.defaultdict(collections.Counter), "bad": collections.defaultdict(collections.Counter)}
        self.memory = []

    def take(self):
        with self.lock:
            self.left -= 1
            return self.left >= 0

    def work(self, seed):
        chance = random.Random(seed)
        daemon = Daemon(self.options.address, self.options.model)
        good, bad = good_calls(daemon), bad_calls(daemon)
        weights = [weight for _, weight, _ in good]
        while self.take():
            if chance.random() < self.options.bad:
                kind, (name, call) = "bad", chance.choice(bad)
            else:
                kind, (name, _, call) = "good", chance.choices(good, weights)[0]
            result = outcome(call)
            with self.lock:
                self.outcomes[kind][name][result] += 1

    def resident(self):
        for line in pathlib.Path(f"/proc/{self.options.pid}/status").read_text().splitlines():
            if line.startswith("VmRSS"):
                return int(line.split()[1])
        return 0

    def run(self):
        begin = time.monotonic()
        workers = [threading.Thread(target=self.work, args=(i,)) for i in range(self.options.clients)]
        for worker in workers:
            worker.start()
        while any(worker.is_alive() for worker in workers):
            self.memory.append((self.options.calls - max(self.left, 0), self.resident()))
            for worker in workers:
                worker.join(1 / len(workers))
        return time.monotonic() - begin

    def verdict(self):
        problems = []
        for kind, calls in self.outcomes.items():
            for name, counts in calls.items():
                wrong = ("INTERNAL", "UNKNOWN") if name == "much metadata" else ("INTERNAL", "UNKNOWN", "UNAVAILABLE")
                problems += [f"{kind} {name}: {code}" for code in counts if code.startswith(wrong)]
                if kind == "good":
                    problems += [f"{name}: {code}" for code in counts if code != "OK" and code not in BUSY]
                elif name not in HARMLESS and counts["OK"]:
                    problems.append(f"bad {name} was answered")
        half = [kilobytes for done, kilobytes in self.memory if done >= self.options.calls / 2]
        if half and max(half) > 1.05 * min(half):
            problems.append(f"memory over the last half: {min(half)} to {max(half)} kB")
        return problems


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("address")
    parser.add_argument("model")
    parser.add_argument("--pid", type=int, required=True)
    parser.add_argument("--calls", type=int, default=200_000)
    parser.add_argument("--bad", type=float, default=0.05)
    parser.add_argument("--clients", type=int, default=8)
    soak = Soak(parser.parse_args())
    seconds = soak.run()
    problems = soak.verdict()
    step = max(1, len(soak.memory) // 40)
    print(json.dumps({"seconds": seconds, "outcomes": soak.outcomes, "memory_kB": soak.memory[::step] + soak.memory[-1:],
                      "problems": problems}, indent=1))
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
