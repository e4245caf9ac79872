"""Two replicas under load, one of them killed and started again: behind nginx, behind haproxy, and by the clients' own round_robin.
No call may fail that a client may repeat."""

import json
import pathlib
import re
import shutil
import signal
import socket
import subprocess
import tempfile
import threading
import time
import unittest

import grpc

from support import BINARIES, NOT_CONVERGED, SUCCESS, Daemon, generate_messages, write_tubes
from system import SOURCE, find, needs, run

FOLDER = SOURCE / "deploy/load-balancing"
ROUND_ROBIN = (FOLDER / "round_robin.json").read_text()
BEHIND_A_BALANCER = (FOLDER / "behind_a_balancer.json").read_text()
CALLERS = 6
PATIENCE = 60  # [s] of every wait and call

# A request of each: Models.List, and Shapes.Synthesize of the model "tubes" (its weights come with the answer to Project).
LIST, SYNTHESIZE = "/shaped.v1.Models/List", "/shaped.v1.Shapes/Synthesize"


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Load:
    """Callers that call one after the other until they are told to stop; what they met."""

    def __init__(self, target, synthesize, config):
        self.channel = grpc.insecure_channel(target, [("grpc.service_config", config), ("grpc.use_local_subchannel_pool", 1)])
        self.synthesize, self.stopping = synthesize, threading.Event()
        self.answers, self.failures = 0, []
        self.lock = threading.Lock()
        self.callers = [threading.Thread(target=self.call) for _ in range(CALLERS)]

    def __enter__(self):
        grpc.channel_ready_future(self.channel).result(timeout=PATIENCE)
        for caller in self.callers:
            caller.start()
        return self

    def __exit__(self, *_):
        self.stopping.set()
        for caller in self.callers:
            caller.join()
        self.channel.close()

    def call(self):
        synthesize, models = self.channel.unary_unary(SYNTHESIZE), self.channel.unary_unary(LIST)
        while not self.stopping.is_set():
            try:
                synthesize(self.synthesize, timeout=PATIENCE)
                models(b"", timeout=PATIENCE)
                with self.lock:
                    self.answers += 2
            except grpc.RpcError as error:
                with self.lock:
                    self.failures.append((error.code().name, error.details()))

    def wait_for_more(self, count):
        """Until so many more calls have been answered."""
        until, wanted = time.monotonic() + PATIENCE, self.answers + count
        while self.answers < wanted:
            if time.monotonic() > until:
                raise AssertionError(f"{wanted - self.answers} answers are missing; failures: {self.failures[:3]}")
            time.sleep(0.02)


class Balancing(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        cls.ports, cls.scrapes, cls.replicas = [free_port(), free_port()], [free_port(), free_port()], [None, None]
        cls.addClassCleanup(lambda: [replica.stop() for replica in cls.replicas if replica])
        cls.start(0)
        trained = cls.shapectl(cls.address(0), "train", "shell-pga", "tubes", *write_tubes(cls.folder), "--coarse-vertices", 60)
        if trained.returncode != SUCCESS:
            raise RuntimeError(trained.stdout)
        # Replicas have a store each; a version is copied beside the others and renamed into place.
        shutil.copytree(cls.folder / "store0/models", cls.folder / "store1/models")
        cls.start(1)
        cls.write_request()

    @classmethod
    def write_request(cls):
        """A Synthesize request, out of what shapectl projects."""
        coefficients = cls.folder / "coefficients.json"
        cls.shapectl(cls.address(0), "project", "tubes", cls.folder / "tube1.obj", "--coefficients", coefficients)
        messages = cls.folder / "messages"
        messages.mkdir()
        generate_messages(messages)
        made = subprocess.run(["/usr/bin/python3", "-B", "-c", MAKE_REQUEST, coefficients], env={"PYTHONPATH": str(messages)},
                              capture_output=True, check=True)
        cls.request = made.stdout

    @classmethod
    def start(cls, which):
        cls.replicas[which] = Daemon(cls.folder / f"store{which}", "--listen", cls.address(which), "--metrics",
                                     f"127.0.0.1:{cls.scrapes[which]}", "--drain", "2")

    @classmethod
    def address(cls, which):
        return f"127.0.0.1:{cls.ports[which]}"

    @classmethod
    def shapectl(cls, server, *words):
        return run(BINARIES / "shapectl", "--output", "json", "--server", server, *words, check=False)

    def answered(self, which):
        """Calls of Synthesize that a replica has answered since it started."""
        methods = json.loads(self.shapectl(self.address(which), "top").stdout)["methods"]
        return sum(count for method in methods if method["method"] == "Shapes.Synthesize"
                   for code, count in method["by_code"].items() if code == "OK")

    def kill_and_restart_under_load(self, target, how, config):
        """What the load met while the first replica ended and came back; both must have had a part of it."""
        before = self.answered(1)
        with Load(target, self.request, config) as load:
            load.wait_for_more(200)
            self.replicas[0].stop(how)
            load.wait_for_more(200)
            self.start(0)
            # The killed one is taken back, after the while that who balances gives it.
            self.wait_until(lambda: self.answered(0) > 20)
            load.wait_for_more(100)
        self.assertGreater(self.answered(1) - before, 100)
        return load

    def wait_until(self, question):
        until = time.monotonic() + PATIENCE
        while not question():
            self.assertLess(time.monotonic(), until, "it did not happen in time")
            time.sleep(0.2)

    def check(self, target, config):
        """A crash, then an orderly stop."""
        for how in (signal.SIGKILL, signal.SIGTERM):
            load = self.kill_and_restart_under_load(target, how, config)
            print(f"\n{how.name}: {load.answers} answers, {len(load.failures)} failures", flush=True)
            self.assertEqual(load.failures, [])

    def both(self):
        return "ipv4:" + ",".join(self.address(which) for which in (0, 1))

    def test_round_robin_of_a_client(self):
        self.check(self.both(), ROUND_ROBIN)

    def test_without_retries_calls_in_flight_fail(self):
        """The control: what the retries are for. And nothing but calls in flight fails."""
        config = json.loads(ROUND_ROBIN)
        del config["methodConfig"]
        for _ in range(5):  # a kill may fall between two calls
            load = self.kill_and_restart_under_load(self.both(), signal.SIGKILL, json.dumps(config))
            if load.failures:
                break
        self.assertEqual({code for code, _ in load.failures}, {"UNAVAILABLE"})
        self.assertLessEqual(len(load.failures), 2 * CALLERS)

    def test_shapectl_with_two_replicas(self):
        server = ",".join(self.address(which) for which in (0, 1))
        codes, stopping = [], threading.Event()

        def call():
            while not stopping.is_set():
                codes.append(self.shapectl(server, "score", "tubes", self.folder / "tube1.obj").returncode)

        caller = threading.Thread(target=call)
        caller.start()
        try:
            for step in (lambda: self.replicas[0].stop(signal.SIGKILL), lambda: self.start(0), lambda: None):
                wanted = len(codes) + 8
                self.wait_until(lambda: len(codes) >= wanted)
                step()
        finally:
            stopping.set()
            caller.join()
        self.assertLessEqual(set(codes), {SUCCESS, NOT_CONVERGED})

    def configured(self, name):
        """An example configuration with this test's addresses; the port to call, and its path."""
        port = free_port()
        text = (FOLDER / name).read_text()
        for old, new in (("50050", port), ("50051", self.ports[0]), ("50052", self.ports[1]), ("9464", self.scrapes[0]),
                         ("9465", self.scrapes[1]), ("/run/nginx-shaped.pid", self.folder / "nginx.pid")):
            if re.search(r"\d{4}", old):
                self.assertTrue(name == "nginx.conf" or old in text, old)
            text = text.replace(old, str(new))
        path = self.folder / name
        path.write_text(text)
        return port, path

    def balancer(self, port, *words):
        process = subprocess.Popen(list(map(str, words)), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.stderr.close)
        self.addCleanup(process.wait, timeout=PATIENCE)
        self.addCleanup(process.terminate)

        def listens():
            if process.poll() is not None:
                self.fail(f"{words[0]} ended: {process.stderr.read()}")
            with socket.socket() as probe:
                return probe.connect_ex(("127.0.0.1", port)) == 0

        self.wait_until(listens)
        return f"127.0.0.1:{port}"

    def test_behind_nginx(self):
        needs("nginx")
        port, path = self.configured("nginx.conf")
        run(find("nginx"), "-t", "-c", path)
        self.check(self.balancer(port, find("nginx"), "-c", path, "-g", "daemon off;"), BEHIND_A_BALANCER)

    def test_behind_haproxy(self):
        needs("haproxy")
        port, path = self.configured("haproxy.cfg")
        run(find("haproxy"), "-c", "-f", path)
        self.check(self.balancer(port, find("haproxy"), "-db", "-f", path), BEHIND_A_BALANCER)


MAKE_REQUEST = """
import json, sys
from shaped.v1 import shapes_pb2
point = json.load(open(sys.argv[1]))
request = shapes_pb2.SynthesizeRequest()
request.model.name = "tubes"
request.coefficients.alpha.extend(point["alpha"])
request.coefficients.scale = point["scale"]
sys.stdout.buffer.write(request.SerializeToString())
"""


if __name__ == "__main__":
    unittest.main()
