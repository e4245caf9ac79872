"""A model is replaced every second under load: does every request get an answer, and all of it from one version?

    mkdir OUT && protoc --python_out=OUT -I proto proto/shaped/v1/*.proto
    PYTHONPATH=OUT /usr/bin/python3 tests/benchmark/reload.py BINARIES FOLDER [--seconds 300] [--clients 2]

Starts a daemon of its own in FOLDER (which must not exist) and trains two models of different shapes on one connectivity. Version
after version of the model "live" is then put into the store, loaded, and the one before deleted: odd versions are copies of one,
even ones of the other. Clients project a shape and ask for the mean; every answer must equal, number by number, what its
version's model answers. Prints a JSON document; exit code 1 when an answer failed or was mixed, or memory is not back within 5 % of
what it was after the first ten reloads.
"""

import argparse
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import threading
import time

import grpc
import numpy

from shaped.v1 import models_pb2, shapes_pb2

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "end_to_end"))
sys.argv[1:] and os.environ.setdefault("SHAPED_BINARIES", sys.argv[1])
from support import Daemon, tube, write_mesh  # noqa: E402


class Client:
    def __init__(self, address):
        self.channel = grpc.insecure_channel(address, [("grpc.use_local_subchannel_pool", 1)])

    def call(self, method, request, answer):
        return self.channel.unary_unary("/shaped.v1." + method, type(request).SerializeToString, answer.FromString)(request, timeout=30)

    def mean(self, model, version=0):
        request = models_pb2.GetModelRequest(with_mean=True)
        request.model.name, request.model.version = model, version
        answer = self.call("Models/Get", request, models_pb2.GetModelResponse)
        return answer.description.model.version, numpy.array(answer.mean.positions)

    def project(self, model, shape):
        request = shapes_pb2.ProjectRequest()
        request.model.name = model
        request.shape.positions.extend(shape)
        answer = self.call("Shapes/Project", request, shapes_pb2.ProjectResponse)
        return answer.model.version, numpy.array(answer.shape.positions)

    def load(self, model):
        request = models_pb2.LoadModelRequest()
        request.model.name = model
        self.call("Models/Load", request, models_pb2.LoadModelResponse)

    def delete(self, model, version):
        request = models_pb2.DeleteModelRequest()
        request.model.name, request.model.version = model, version
        self.call("Models/Delete", request, models_pb2.DeleteModelResponse)


class Trial:
    def __init__(self, options):
        self.options, self.folder = options, options.folder
        self.folder.mkdir(parents=True)
        self.daemon = Daemon(self.folder / "store")
        self.train("a", 0.28)
        self.train("b", 0.35)
        self.shape = tube(0.5, radius=0.31)[0].astype(numpy.float32).ravel()
        self.client = Client(self.daemon.address)
        self.expected = {model: (self.client.mean(model)[1], self.client.project(model, self.shape)[1]) for model in "ab"}
        if numpy.array_equal(self.expected["a"][0], self.expected["b"][0]):
            raise RuntimeError("the two models are the same: a mixed answer would not show")
        self.answers, self.failures, self.memory, self.running = 0, [], [], True
        self.lock = threading.Lock()

    def train(self, name, radius):
        meshes = [write_mesh(self.folder / f"{name}{i}.obj", *tube(-1.2 + 0.5 * i, radius=radius + 0.01 * (i * i % 5))) for i in range(6)]
        subprocess.run([self.options.binaries / "shapectl", "--server", self.daemon.address, "train", "shell-pga", name, *meshes,
                        "--modes", "3", "--coarse-vertices", "60"], check=True, stdout=subprocess.DEVNULL, timeout=300)

    def publish(self, version):
        models = self.folder / "store/models"
        scratch = self.folder / "store/incoming"
        shutil.copytree(models / ("a" if version % 2 else "b") / "1", scratch)
        (models / "live").mkdir(exist_ok=True)
        scratch.rename(models / "live" / str(version))

    def ask(self):
        client = Client(self.daemon.address)
        for turn in range(10 ** 9):
            if not self.running:
                return
            try:
                version, got = client.project("live", self.shape) if turn % 2 else client.mean("live")
                wanted = self.expected["a" if version % 2 else "b"][turn % 2]
                problem = None if numpy.array_equal(got, wanted) else f"the answer is not that of version {version}"
            except grpc.RpcError as error:
                problem = f"{error.code().name}: {error.details()}"
            with self.lock:
                self.answers += problem is None
                if problem:
                    self.failures.append(problem)

    def resident(self):
        return int(re.search(r"VmRSS:\s+(\d+)", pathlib.Path(f"/proc/{self.daemon.process.pid}/status").read_text()).group(1))

    def run(self):
        self.publish(1)
        self.client.load("live")
        clients = [threading.Thread(target=self.ask) for _ in range(self.options.clients)]
        for client in clients:
            client.start()
        end, version = time.monotonic() + self.options.seconds, 1
        while time.monotonic() < end:
            begin, version = time.monotonic(), version + 1
            self.publish(version)
            self.client.load("live")
            self.client.delete("live", version - 1)
            self.memory.append(self.resident())
            time.sleep(max(0, 1 - (time.monotonic() - begin)))
        self.running = False
        for client in clients:
            client.join(timeout=60)
        time.sleep(1)
        self.memory.append(self.resident())
        return version


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("binaries", type=pathlib.Path)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--seconds", type=float, default=300)
    parser.add_argument("--clients", type=int, default=2)
    trial = Trial(parser.parse_args())
    try:
        versions = trial.run()
    finally:
        trial.daemon.stop()
    early = trial.memory[min(10, len(trial.memory) - 1)]
    grown = trial.memory[-1] / early - 1
    print(json.dumps({"versions": versions, "answers": trial.answers, "failures": len(trial.failures),
                      "first_failures": trial.failures[:5], "memory_kB": {"after_ten_reloads": early, "largest": max(trial.memory),
                                                                         "at_the_end": trial.memory[-1], "grown": grown}}, indent=1))
    return 1 if trial.failures or grown > 0.05 else 0


if __name__ == "__main__":
    sys.exit(main())
