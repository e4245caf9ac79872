"""A daemon, a client and small meshes for the end-to-end tests."""

import hashlib
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest

import numpy

BINARIES = pathlib.Path(os.environ["SHAPED_BINARIES"])
SOURCE = pathlib.Path(os.environ["SHAPED_SOURCE"])

# What shapectl returns to the shell, as docs/api.md says.
SUCCESS, INTERNAL, BAD_INPUT, NOT_FOUND, UNAVAILABLE, DEADLINE, CANCELLED, NOT_CONVERGED = range(8)


def skip_loudly(reason):
    """Skips the test, and says so where the summary of a run that passed does not."""
    print(f"SKIPPED, so this is not known to work here: {reason}", file=sys.stderr, flush=True)
    raise unittest.SkipTest(reason)


class Daemon:
    """A shaped process on a free port of the loopback. A thread of its own reads the log, so that no pipe ever fills."""

    def __init__(self, store, *options, preexec=None, before=()):
        # Not our standard output: a daemon that outlives a test which ran out of time would keep ctest waiting for its end.
        self.process = subprocess.Popen(
            [*before, BINARIES / "shaped", "--listen", "127.0.0.1:0", "--store", store, *options],
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, preexec_fn=preexec)
        self.log = ""
        self.reading = threading.Condition()
        self.reader = threading.Thread(target=self.read, daemon=True)
        self.reader.start()
        try:
            started = self.wait_for("listening on ")
        except AssertionError as problem:
            self.process.kill()
            raise RuntimeError(f"shaped ended with {self.process.wait()}: {self.log}") from problem
        self.address = re.search(r"listening on (\S+),", started).group(1)
        scrape = re.search(r"metrics on (http://\S+)/metrics", self.log)
        self.metrics = scrape and scrape.group(1)

    def read(self):
        with self.process.stderr as stream:
            for line in stream:
                with self.reading:
                    self.log += line
                    self.reading.notify_all()

    def wait_for(self, text, timeout=60):
        """The first line of the log that holds the text, which may come any time until then."""
        until = time.monotonic() + timeout
        while True:
            over = not self.reader.is_alive() or time.monotonic() > until
            with self.reading:
                for line in self.log.splitlines(keepends=True):
                    if text in line and line.endswith("\n"):
                        return line
                if over:
                    raise AssertionError(f"the log has no \"{text}\": {self.log}")
                self.reading.wait(0.1)

    def running(self):
        return self.process.poll() is None

    def stop(self, how=signal.SIGTERM):
        """Ends it, once, and returns (exit code, its whole log)."""
        if self.running():
            self.process.send_signal(how)
            try:
                self.process.wait(timeout=60)
            except subprocess.TimeoutExpired:
                self.process.kill()
                raise
        self.reader.join(timeout=10)
        return self.process.wait(), self.log


class Result:
    """What a run of shapectl left: exit code, both outputs, and the JSON document if stdout holds one."""

    def __init__(self, process):
        self.code = process.returncode
        self.out, self.err = process.stdout, process.stderr
        try:
            self.json = json.loads(self.out)
        except ValueError:
            self.json = None

    def message(self):
        return self.json["error"]["message"]


class DaemonCase(unittest.TestCase):
    """One daemon with an empty store for all tests of a class; each test ends with the question whether it still serves."""

    daemon_options = ()

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        cls.daemon = Daemon(cls.folder / "store", *cls.daemon_options)
        cls.addClassCleanup(cls.daemon.stop)

    def tearDown(self):
        self.assertTrue(self.daemon.running(), "the daemon has died")
        self.assertEqual(self.shapectl("models").code, SUCCESS)

    @classmethod
    def command(cls, *words):
        return [str(BINARIES / "shapectl"), "--server", cls.daemon.address, "--output", "json", *map(str, words)]

    @classmethod
    def shapectl(cls, *words):
        return Result(subprocess.run(cls.command(*words), capture_output=True, text=True, timeout=900))

    def expect(self, code, *words):
        result = self.shapectl(*words)
        self.assertEqual(result.code, code, result.out + result.err)
        return result

    def refused(self, text, *words):
        """The command is bad input, and the message contains the text."""
        self.assertIn(text, self.expect(BAD_INPUT, *words).message())

    def assertAnswer(self, document):
        """The document carries what every answer carries."""
        for key in ("termination", "iterations", "residual", "smallest_area_ratio", "seconds", "model"):
            self.assertIn(key, document)


def tube(angle=0.0, radius=0.3, rings=13, sides=8, length=3.0):
    """A closed tube along x, bent by an angle about z: vertices and faces."""
    x = numpy.linspace(0, length, rings)
    around = numpy.linspace(0, 2 * numpy.pi, sides, endpoint=False)
    bent = angle * (x / length - 0.5)
    scale = length / angle if abs(angle) > 1e-9 else None
    centre = (numpy.stack([scale * numpy.sin(bent), scale * (1 - numpy.cos(bent))], 1) if scale
              else numpy.stack([x - length / 2, 0 * x], 1))
    normal = numpy.stack([-numpy.sin(bent), numpy.cos(bent)], 1)
    vertices = [[c[0] + radius * numpy.cos(a) * n[0], c[1] + radius * numpy.cos(a) * n[1], radius * numpy.sin(a)]
                for c, n in zip(centre, normal) for a in around]
    faces = []
    for i in range(rings - 1):
        for j in range(sides):
            a, b = i * sides + j, i * sides + (j + 1) % sides
            faces += [[a, b, b + sides], [a, b + sides, a + sides]]
    for ring, flip in ((0, True), (rings - 1, False)):
        vertices.append([*centre[ring], 0])
        for j in range(sides):
            a, b = ring * sides + j, ring * sides + (j + 1) % sides
            faces.append([b, a, len(vertices) - 1] if flip else [a, b, len(vertices) - 1])
    return numpy.array(vertices), numpy.array(faces)


def write_mesh(path, vertices, faces):
    """An OBJ file."""
    with open(path, "w") as file:
        for vertex in vertices:
            file.write("v %r %r %r\n" % tuple(float(x) for x in vertex))
        for face in faces:
            file.write("f %d %d %d\n" % tuple(int(i) + 1 for i in face))
    return path


def read_obj(path):
    with open(path) as file:
        lines = [line.split() for line in file]
    return (numpy.array([[float(x) for x in line[1:4]] for line in lines if line and line[0] == "v"]),
            numpy.array([[int(x.split("/")[0]) - 1 for x in line[1:4]] for line in lines if line and line[0] == "f"]))


def write_tubes(folder, count=6):
    """Training meshes: tubes of several bends and thicknesses."""
    paths = []
    for i in range(count):
        vertices, faces = tube(angle=-1.2 + 2.4 * i / (count - 1), radius=0.3 + 0.02 * ((i * i) % 5))
        paths.append(write_mesh(folder / f"tube{i}.obj", vertices, faces))
    return paths


def generate_messages(folder):
    """Python's modules of all messages, as docs/api.md makes them."""
    subprocess.run(["protoc", f"--python_out={folder}", "-I", SOURCE / "proto", *sorted((SOURCE / "proto/shaped/v1").glob("*.proto")),
                    *sorted((SOURCE / "proto/google/rpc").glob("*.proto"))], check=True)


def many_modes(source, target, modes):
    """A version like `source` with more modes: the first variations over and over, a little apart. Loads slowly."""
    manifest = json.loads((source / "manifest.json").read_text())
    data = (source / "tensors.safetensors").read_bytes()
    length = int.from_bytes(data[:8], "little")
    header = json.loads(data[8:8 + length])
    types = {"F64": numpy.float64, "F32": numpy.float32, "I64": numpy.int64, "I32": numpy.int32}
    tensors = {name: numpy.frombuffer(data[8 + length:][slice(*entry["data_offsets"])], types[entry["dtype"]])
               .reshape(entry["shape"]) for name, entry in header.items()}
    vertices = tensors["mean"].shape[0]
    variation = tensors["variations"].reshape(-1, vertices, 3)[0]
    scale = 1 + 1e-3 * numpy.linspace(0, 1, 2 * modes)
    tensors["variations"] = (scale[:, None, None] * variation).reshape(-1, 3)
    tensors["eigenvalues"] = numpy.linspace(1, 0.5, modes) * tensors["eigenvalues"][0]
    tensors["eigenvectors"] = numpy.eye(modes)
    manifest["description"]["modes"] = modes
    write_tensors(target, manifest, tensors)


def write_tensors(folder, manifest, tensors):
    """A version's two files; the manifest is given without its statement of the tensors."""
    types = {"float64": "F64", "float32": "F32", "int64": "I64", "int32": "I32"}
    ordered = sorted(tensors.items(), key=lambda item: -item[1].itemsize)
    header, end = {}, 0
    for name, numbers in ordered:
        header[name] = {"dtype": types[str(numbers.dtype)], "shape": list(numbers.shape), "data_offsets": [end, end + numbers.nbytes]}
        end += numbers.nbytes
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 8)
    hashed = hashlib.sha256()
    folder.mkdir(parents=True)
    with open(folder / "tensors.safetensors", "wb") as file:
        for piece in (len(text).to_bytes(8, "little"), text, *(numpy.ascontiguousarray(numbers) for _, numbers in ordered)):
            hashed.update(piece)
            file.write(piece)
        size = file.tell()
    manifest["tensors"] = {"file": "tensors.safetensors", "bytes": size, "sha256": hashed.hexdigest()}
    (folder / "manifest.json").write_text(json.dumps(manifest))
