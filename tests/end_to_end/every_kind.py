"""What a Python client meets over TLS with a token, in each kind of call; prints it as one JSON document for
foreign_clients_test.py. Its twin is every_kind.js.

    every_kind.py SCENARIO.json
"""

import json
import pathlib
import queue
import sys
import time

import grpc

from google.rpc import error_details_pb2  # noqa: F401  (details() finds its messages)
from python_client import connect, details
from shaped.v1 import admin_pb2, datasets_pb2, models_pb2, shapes_pb2

PATIENCE = 60  # [s] of every wait
TRACEPARENT = "00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01"


def method(channel, kind, name, request, answer):
    return getattr(channel, kind)("/shaped.v1." + name, request.SerializeToString, answer.FromString)


def failure(error):
    """An error as its code, message and details."""
    found = details(error)
    told = {"code": error.code().name, "message": error.details(), "details": sorted(found)}
    if "ErrorInfo" in found:
        told["reason"], told["domain"] = found["ErrorInfo"].reason, found["ErrorInfo"].domain
    if "BadRequest" in found:
        told["field"] = found["BadRequest"].field_violations[0].field
    if "RetryInfo" in found:
        delay = found["RetryInfo"].retry_delay
        told["retry_seconds"] = delay.seconds + 1e-9 * delay.nanos
    return told


def failing(call):
    """What the call fails with."""
    try:
        answer = call()
        for _ in answer if hasattr(answer, "__next__") else ():
            pass
    except grpc.RpcError as error:
        return failure(error)
    return {"code": "OK"}


class Client:
    def __init__(self, scenario):
        self.scenario = scenario
        self.channel = connect(scenario["address"], scenario["ca"], scenario["token"])

    def unary(self):
        call = method(self.channel, "unary_unary", "Models/List", models_pb2.ListModelsRequest, models_pb2.ListModelsResponse)
        answer, info = call.with_call(models_pb2.ListModelsRequest(), timeout=PATIENCE, metadata=[("traceparent", TRACEPARENT)])
        return {"models": [[m.model.name, m.vertex_count] for m in answer.models],
                "trace": dict(info.initial_metadata())["traceparent"].split("-")[1]}

    def uploads(self, name, frames):
        yield datasets_pb2.UploadDatasetRequest(header=datasets_pb2.UploadDatasetRequest.Header(
            name=name, vertex_count=self.scenario["vertices"], faces=self.scenario["faces"], frames=len(frames)))
        for frame in frames:
            yield datasets_pb2.UploadDatasetRequest(frame=datasets_pb2.UploadDatasetRequest.Frame(positions=frame))

    def upload(self, name, frames):
        call = method(self.channel, "stream_unary", "Datasets/Upload", datasets_pb2.UploadDatasetRequest,
                      datasets_pb2.UploadDatasetResponse)
        return call(self.uploads(name, frames), timeout=PATIENCE)

    def client_stream(self):
        dataset = self.upload("from_python", self.scenario["frames"]).dataset
        return {"frames": dataset.frames, "vertices": dataset.vertex_count}

    def refused_client_stream(self):
        return failing(lambda: self.upload("refused", [self.scenario["frames"][0], self.scenario["frames"][1][:-1]]))

    def interpolate(self, times, timeout=PATIENCE):
        first, last = self.scenario["frames"][0], self.scenario["frames"][-1]
        request = shapes_pb2.InterpolateRequest(times=times)
        getattr(request, "from").positions.extend(first)
        getattr(request, "from").faces.extend(self.scenario["faces"])
        request.to.positions.extend(last)
        call = method(self.channel, "unary_stream", "Shapes/Interpolate", shapes_pb2.InterpolateRequest,
                      shapes_pb2.InterpolateResponse)
        return call(request, timeout=timeout)

    def server_stream(self):
        parts, last = [], None
        for answer in self.interpolate([0.0, 0.5, 1.0]):
            parts.append(answer.WhichOneof("part"))
            last = answer.frame
        wanted = self.scenario["frames"][-1]
        return {"parts": parts, "far": max(abs(a - b) for a, b in zip(last.shape.positions, wanted))}

    def fit(self, requests, timeout=PATIENCE):
        call = method(self.channel, "stream_stream", "Shapes/FitMarkers", shapes_pb2.FitMarkersRequest,
                      shapes_pb2.FitMarkersResponse)
        return call(iter(requests.get, None), timeout=timeout)

    def setup(self):
        setup = shapes_pb2.FitMarkersRequest.Setup(without_shapes=True)
        setup.model.name = self.scenario["model"]
        for vertex in self.scenario["markers"]:
            setup.marker_set.markers.add(label=f"m{vertex}", vertex=vertex)
        return shapes_pb2.FitMarkersRequest(setup=setup)

    def marker_frame(self, number):
        request = shapes_pb2.FitMarkersRequest()
        request.frame.frame = number
        frame = self.scenario["frames"][number]
        for vertex in self.scenario["markers"]:
            request.frame.positions.extend(frame[3 * vertex:3 * vertex + 3])
        return request

    def open_fit(self):
        """A stream of markers with its first answer: where to put requests, that answer, and the answers to come."""
        requests = queue.Queue()
        requests.put(self.setup())
        requests.put(self.marker_frame(0))
        answers = self.fit(requests)
        return requests, next(answers), answers

    def both_streams(self):
        """Each frame is sent after the answer to the one before."""
        requests, answer, answers = self.open_fit()
        seen = [[answer.frame, answer.model.version, answer.rms < 0.05]]
        requests.put(self.marker_frame(1))
        answer = next(answers)
        seen.append([answer.frame, answer.model.version, answer.rms < 0.05])
        requests.put(None)
        return {"answers": seen, "more": sum(1 for _ in answers)}

    def busy(self):
        """What a stream meets when all places are taken."""
        held, refused = [], {"code": "OK"}
        while refused["code"] == "OK" and len(held) < 2 * self.scenario["open_streams"]:
            refused = failing(lambda: held.append(self.open_fit()))
        for requests, _, answers in held:
            requests.put(None)
            for _ in answers:
                pass
        return {**refused, "open": len(held)}

    def deadline(self):
        begin = time.monotonic()
        wait = method(self.channel, "unary_unary", "Models/WaitUntilReady", models_pb2.WaitUntilReadyRequest,
                      models_pb2.WaitUntilReadyResponse)
        request = models_pb2.WaitUntilReadyRequest()
        request.model.name = "never"
        waiting = failing(lambda: wait(request, timeout=0.5))["code"]
        solving = failing(lambda: self.interpolate([0.3] * 10000, 0.5))["code"]
        seconds = time.monotonic() - begin
        return {"waiting": waiting, "solving": solving, "seconds": seconds, "left": self.calls_left()}

    def cancellation(self):
        answers = self.interpolate([0.3] * 10000)
        first = next(answers).WhichOneof("part")
        answers.cancel()
        code = failing(lambda: answers)["code"]
        return {"first": first, "code": code, "left": self.calls_left()}

    def calls_left(self):
        """Calls of Interpolate and WaitUntilReady that the daemon still works on, once they are none or patience ends."""
        call = method(self.channel, "unary_unary", "Admin/GetStatistics", admin_pb2.GetStatisticsRequest,
                      admin_pb2.GetStatisticsResponse)
        until = time.monotonic() + PATIENCE
        while True:
            methods = call(admin_pb2.GetStatisticsRequest(), timeout=PATIENCE).methods
            left = sum(m.in_flight for m in methods if m.method in ("Shapes.Interpolate", "Models.WaitUntilReady"))
            if left == 0 or time.monotonic() > until:
                return left
            time.sleep(0.05)

    def error_details(self):
        request = shapes_pb2.ProjectRequest()
        request.model.name = self.scenario["model"]
        request.shape.positions.extend(self.scenario["frames"][0][:-1])
        project = method(self.channel, "unary_unary", "Shapes/Project", shapes_pb2.ProjectRequest, shapes_pb2.ProjectResponse)
        bad = failing(lambda: project(request, timeout=PATIENCE))
        request.model.name = "none"
        return {"bad": bad, "missing": failing(lambda: project(request, timeout=PATIENCE))}

    def refusals(self):
        """Without a token, with one that lacks the role, and by a daemon of another authority."""
        def code(token, ca=self.scenario["ca"], name="Models/Delete"):
            with connect(self.scenario["address"], ca, token) as channel:
                request = models_pb2.DeleteModelRequest()
                request.model.name = "none"
                call = method(channel, "unary_unary", name, models_pb2.DeleteModelRequest, models_pb2.DeleteModelResponse)
                return failing(lambda: call(request, timeout=PATIENCE))["code"]

        return {"nobody": code(None), "reader": code(self.scenario["reader"]),
                "stranger": code(self.scenario["token"], self.scenario["other_ca"])}


def main(path):
    client = Client(json.loads(pathlib.Path(path).read_text()))
    kinds = ("unary", "client_stream", "refused_client_stream", "server_stream", "both_streams", "busy", "deadline",
             "cancellation", "error_details", "refusals")
    print(json.dumps({kind: getattr(client, kind)() for kind in kinds}))


if __name__ == "__main__":
    main(*sys.argv[1:])
