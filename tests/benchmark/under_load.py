"""What a daemon that has more to do than it can answers: health checks, 20 a second; lists; small requests of priority
interactive. In three stretches: idle, training alone, and training with a queue full of edits besides.

    SHAPED_BINARIES=build/release/bin SHAPED_SOURCE=. /usr/bin/python3 tests/benchmark/under_load.py [SECONDS]

Prints lines of RESULTS.md. As many workers as there are processors.
"""

import os
import pathlib
import subprocess
import sys
import tempfile
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / "end_to_end"))

import grpc
import numpy

from messages import shapes_pb2
from support import BINARIES, Daemon, tube, write_mesh

HEALTH, LIST = "/grpc.health.v1.Health/Check", "/shaped.v1.Models/List"


def percentiles(seconds):
    p50, p99 = numpy.percentile(seconds, (50, 99))
    return f"p50 {1e3 * p50:.1f}, p99 {1e3 * p99:.1f}, longest {1e3 * max(seconds):.1f} ms of {len(seconds)}"


class Load:
    def __init__(self, folder):
        self.folder = folder
        self.daemon = Daemon(folder / "store", "--queue-length", "64", "--client-requests", "200")
        self.channel = grpc.insecure_channel(self.daemon.address)

    def shapectl(self, *words):
        return [str(BINARIES / "shapectl"), "--server", self.daemon.address, *map(str, words)]

    def call(self, method, request=b"", priority=None):
        metadata = [("shaped-priority", priority)] if priority else []
        self.channel.unary_unary(method, None, None)(request, timeout=600, metadata=metadata)

    def timed(self, method, seconds, period, *arguments):
        """A call every period; one that is sent late because the last took longer counts from when it is sent."""
        took, due, end = [], time.monotonic(), time.monotonic() + seconds
        while due < end:
            time.sleep(max(0, due - time.monotonic()))
            begin = time.monotonic()
            self.call(method, *arguments)
            took.append(time.monotonic() - begin)
            due = max(due + period, time.monotonic())
        return took

    def look(self, title, seconds, small):
        """Health, lists and small requests side by side."""
        results = {}
        watched = {"health, 20/s": (HEALTH, 0.05), "Models.List, 5/s": (LIST, 0.2),
                   "Shapes.Score of priority interactive, at most 2/s": ("/shaped.v1.Shapes/Score", 0.5, small, "interactive")}

        def watch(name, method, period, *arguments):
            results[name] = self.timed(method, seconds, period, *arguments)
        threads = [threading.Thread(target=watch, args=(name, *how)) for name, how in watched.items()]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        for name in watched:
            print(f"| {name}, {title} | {percentiles(results[name])} |", flush=True)

    def saturate(self, edit, over):
        """Keeps the queue full of edits until it is over."""
        def insist():
            channel = grpc.insecure_channel(self.daemon.address, [("grpc.use_local_subchannel_pool", 1)])
            while not over.is_set():
                try:
                    channel.unary_unary("/shaped.v1.Shapes/Edit", None, None)(edit, timeout=600)
                except grpc.RpcError:
                    time.sleep(0.2)
        for _ in range(80):
            threading.Thread(target=insist, daemon=True).start()


def edit_request(vertices):
    request = shapes_pb2.EditRequest()
    request.model.name = "served"
    for share in (0.02, 0.3, 0.5, 0.7, 0.98):
        vertex = int(share * len(vertices))
        x, y, z = vertices[vertex]
        request.handles.add(vertex=vertex, x=x, y=y + 0.1 * share, z=z + 0.2)
    return request.SerializeToString()


def score_request(vertices):
    request = shapes_pb2.ScoreRequest()
    request.model.name = "served"
    request.shape.positions.extend(vertices.ravel())
    return request.SerializeToString()


def main(seconds):
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        load = Load(folder)
        try:
            shapes = [tube(-1.5 + 0.2 * i, 0.3 + 0.01 * (i % 7), 140, 50) for i in range(16)]
            meshes = [write_mesh(folder / f"tube{i}.obj", *shape) for i, shape in enumerate(shapes)]
            subprocess.run(load.shapectl("train", "shell-pga", "served", *meshes[::4], "--modes", 2, "--coarse-vertices", 300),
                           check=True, capture_output=True)
            small, edit = score_request(shapes[5][0]), edit_request(shapes[0][0])
            load.call("/shaped.v1.Shapes/Score", small)
            print(f"{os.cpu_count()} processors, load {os.getloadavg()[0]:.1f} before; {seconds} s each")
            load.look("idle", seconds, small)
            training = subprocess.Popen(load.shapectl("train", "shell-pga", "other", *meshes, "--coarse-vertices", 6000, "--modes", 8),
                                        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            time.sleep(5)
            load.look("training", seconds, small)
            over = threading.Event()
            load.saturate(edit, over)
            time.sleep(5)
            load.look("training, queue full of edits", seconds, small)
            if training.poll() is not None:
                print("the training had ended before: these numbers are none")
            over.set()
            training.terminate()
            training.wait(60)
        finally:
            load.daemon.process.kill()


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 30)
