"""Models travel between stores: download, upload, and all that can be wrong with what is sent."""

import hashlib
import importlib
import json
import os
import pathlib
import resource
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
import unittest

import grpc

from support import (BAD_INPUT, INTERNAL, NOT_FOUND, SUCCESS, UNAVAILABLE, Daemon, DaemonCase, write_tubes)

SOURCE = pathlib.Path(os.environ["SHAPED_SOURCE"])
FILES = ("manifest.json", "tensors.safetensors")
PIECE = 1 << 14


def sha256(data):
    return hashlib.sha256(data).hexdigest()


def read_files(folder):
    return [(folder / name).read_bytes() for name in FILES]


def write_files(folder, manifest, tensors):
    folder.mkdir()
    for name, data in zip(FILES, (manifest, tensors)):
        (folder / name).write_bytes(data)
    return folder


def restated(manifest, tensors):
    """The manifest with the size and hash that these tensors have."""
    manifest = json.loads(manifest)
    manifest["tensors"].update(bytes=len(tensors), sha256=sha256(tensors))
    return json.dumps(manifest).encode()


def with_header(tensors, change):
    """The tensor file with its header changed."""
    length, = struct.unpack("<Q", tensors[:8])
    header = json.loads(tensors[8:8 + length])
    change(header)
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 8)
    return struct.pack("<Q", len(text)) + text + tensors[8 + length:]


class Transfer(DaemonCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        result = cls.shapectl("train", "shell-pga", "tubes", *write_tubes(cls.folder), "--modes", 3, "--coarse-vertices", 60)
        if result.code != SUCCESS:
            raise RuntimeError(result.out + result.err)
        cls.shapectl("download", "tubes", cls.folder / "copy")
        cls.manifest, cls.tensors = read_files(cls.folder / "copy")
        messages = cls.folder / "messages"
        messages.mkdir()
        subprocess.run(["protoc", f"--python_out={messages}", "-I", SOURCE / "proto",
                        *sorted((SOURCE / "proto/shaped/v1").glob("*.proto"))], check=True)
        sys.path.insert(0, str(messages))
        cls.addClassCleanup(sys.path.remove, str(messages))
        cls.pb = importlib.import_module("shaped.v1.models_pb2")
        cls.channel = grpc.insecure_channel(cls.daemon.address)
        cls.addClassCleanup(cls.channel.close)

    def versions(self, name):
        return [model["model"]["version"] for model in self.expect(SUCCESS, "models").json["models"]
                if model["model"]["name"] == name]

    def stray(self):
        """What no start and no end of a call should leave in the store."""
        found = []
        for folder, folders, files in os.walk(self.folder / "store/models"):
            found += [f"{folder}/{name}" for name in folders + files if ".scratch-" in name or ".partial-" in name]
            found += [folder] if not folders + files else []
        return found

    def assertNothingStray(self):
        until = time.monotonic() + 30  # the daemon notices a client's end a little later
        while self.stray() and time.monotonic() < until:
            time.sleep(0.05)
        self.assertEqual(self.stray(), [])

    def header(self, name, manifest=None, tensors=None, **changes):
        manifest, tensors = manifest or self.manifest, tensors or self.tensors
        files = dict(manifest=manifest, manifest_sha256=sha256(manifest), tensors_sha256=sha256(tensors),
                     tensors_bytes=len(tensors))
        files.update(changes)
        return self.pb.UploadModelRequest(header={"name": name, "files": files})

    def pieces(self, tensors=None):
        tensors = tensors or self.tensors
        for begin in range(0, len(tensors), PIECE):
            yield self.pb.UploadModelRequest(tensors=tensors[begin:begin + PIECE])

    def upload(self, messages):
        """Messages by hand; the answer, or the error."""
        call = self.channel.stream_unary("/shaped.v1.Models/Upload", self.pb.UploadModelRequest.SerializeToString,
                                         self.pb.UploadModelResponse.FromString)
        return call(iter(messages), timeout=120)

    def assertRefused(self, text, messages, code=grpc.StatusCode.INVALID_ARGUMENT):
        with self.assertRaises(grpc.RpcError) as raised:
            self.upload(messages)
        self.assertEqual(raised.exception.code(), code, raised.exception.details())
        self.assertIn(text, raised.exception.details())
        self.assertNotIn(str(self.folder), raised.exception.details())
        self.assertEqual(self.versions("other"), [])
        self.assertNothingStray()

    def test_a_round_trip_is_identical_to_the_bit(self):
        self.assertEqual(read_files(self.folder / "store/models/tubes/1"), [self.manifest, self.tensors])
        for version in (1, 2):
            uploaded = self.expect(SUCCESS, "upload", "again", self.folder / "copy").json
            self.assertEqual(uploaded["model"], {"name": "again", "version": version})
            self.assertEqual(uploaded["state"], "ready")
            self.assertEqual(read_files(self.folder / f"store/models/again/{version}"), [self.manifest, self.tensors])
        self.expect(SUCCESS, "download", "again@1", self.folder / "back")
        self.assertEqual(read_files(self.folder / "back"), [self.manifest, self.tensors])
        self.assertEqual(self.versions("again"), [1, 2])
        elsewhere = Daemon(self.folder / "elsewhere")  # a daemon that has never seen it
        self.addCleanup(elsewhere.stop)
        subprocess.run([self.command()[0], "--server", elsewhere.address, "upload", "tubes", self.folder / "back"], check=True,
                       stdout=subprocess.DEVNULL, timeout=120)
        self.assertEqual(read_files(self.folder / "elsewhere/models/tubes/1"), [self.manifest, self.tensors])
        self.assertNothingStray()
        self.assertEqual(sorted(path.name for path in (self.folder / "back").iterdir()), sorted(FILES))

    def test_the_same_shape_comes_from_the_model_and_its_copy(self):
        self.expect(SUCCESS, "upload", "twin", self.folder / "copy")
        mesh = next(self.folder.glob("tube3.obj"))
        out = [self.expect(SUCCESS, "project", name, mesh, "-o", self.folder / f"{name}.ply") and
               (self.folder / f"{name}.ply").read_bytes() for name in ("tubes", "twin")]
        self.assertEqual(out[0], out[1])

    def test_a_folder_that_exists_is_left_alone(self):
        self.refused("exists already", "download", "tubes", self.folder / "copy")
        self.refused("is no folder", "download", "tubes", self.folder / "none/copy")
        self.expect(NOT_FOUND, "download", "nobody", self.folder / "nobody")
        self.expect(NOT_FOUND, "download", "tubes@7", self.folder / "nobody")
        self.assertFalse((self.folder / "nobody").exists())
        self.assertEqual(list(self.folder.glob(".scratch-*")), [])

    def test_a_piece_that_was_changed_on_the_way(self):
        pieces = list(self.pieces())
        changed = bytearray(pieces[1].tensors)
        changed[5] ^= 1
        pieces[1].tensors = bytes(changed)
        self.assertRefused("tensors: have SHA-256", [self.header("other"), *pieces])

    def test_a_stream_that_is_too_short_or_too_long(self):
        self.assertRefused("tensors: ended after", [self.header("other"), *list(self.pieces())[:-1]])
        self.assertRefused("tensors: are more than", [self.header("other"), *self.pieces(), *self.pieces()])
        self.assertRefused("header: is missing", [])
        self.assertRefused("header: is missing", list(self.pieces())[:1])
        self.assertRefused("header: came a second time", [self.header("other"), self.header("other")])
        self.assertRefused("part: is neither", [self.header("other"), self.pb.UploadModelRequest()])

    def test_a_header_that_contradicts_itself(self):
        self.assertRefused("header.files.manifest: has SHA-256", [self.header("other", manifest_sha256="0" * 64)])
        self.assertRefused("header.files.tensors_sha256: is", [self.header("other", tensors_sha256="0" * 64)])
        self.assertRefused("header.files.tensors_bytes: is 7", [self.header("other", tensors_bytes=7)])
        self.assertRefused("want at most 4294967296", [self.header("other", tensors_bytes=1 << 40)])
        self.assertRefused("no model manifest", [self.header("other", b"{}")])
        self.assertRefused("has 300000 bytes", [self.header("other", b" " * 300000)])

    def test_no_name_of_a_client_is_a_path(self):
        for name in ("../other", "/tmp/other", ".other", "a/b", ""):
            self.assertRefused("header.name: ", [self.header(name), *self.pieces()])

    def test_a_manifest_with_a_wrong_checksum(self):
        manifest = json.loads(self.manifest)
        manifest["tensors"]["sha256"] = "0" * 64
        source = write_files(self.folder / "wrong_sum", json.dumps(manifest).encode(), self.tensors)
        self.refused("tensors: have SHA-256", "upload", "other", source)
        self.assertNothingStray()

    def test_another_kind_and_a_future_format(self):
        for key, value, text in (("kind", "oracle", 'is of kind "oracle"'), ("format_version", 9, "has format version 9")):
            manifest = json.loads(self.manifest)
            manifest[key] = value
            source = write_files(self.folder / key, json.dumps(manifest).encode(), self.tensors)
            self.refused(text, "upload", "other", source)
        self.assertEqual(self.versions("other"), [])
        self.assertNothingStray()

    def test_tensors_that_are_not_what_the_model_needs(self):
        def beyond(header):
            header["mean"]["data_offsets"][1] += 1 << 30

        def renamed(header):
            header["average"] = header.pop("mean")

        for change, text in ((beyond, "'mean' reaches from byte"), (renamed, "no tensor 'mean'")):
            tensors = with_header(self.tensors, change)
            self.assertRefused(text, [self.header("other", restated(self.manifest, tensors), tensors), *self.pieces(tensors)])
        tensors = self.tensors[:100]
        self.assertRefused("is no tensor file or truncated", [self.header("other", restated(self.manifest, tensors), tensors),
                                                              *self.pieces(tensors)])

    def test_a_damaged_file_of_the_store_is_not_handed_on(self):
        self.expect(SUCCESS, "upload", "damaged", self.folder / "copy")
        path = self.folder / "store/models/damaged/1/tensors.safetensors"
        content = bytearray(path.read_bytes())
        content[-1] ^= 1
        path.write_bytes(content)
        self.assertIn("SHA-256", self.expect(INTERNAL, "download", "damaged@1", self.folder / "damaged").message())
        self.assertFalse((self.folder / "damaged").exists())

    def hold(self, name):
        """An upload that sends half of its pieces and then nothing; returns the client once the daemon has some of it."""
        client = subprocess.Popen(
            [sys.executable, "-B", "-c", HALF, self.daemon.address, str(self.folder), name], stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL, text=True,
            env={**os.environ, "PYTHONPATH": str(self.folder / "messages")})
        self.addCleanup(client.stdout.close)
        self.addCleanup(client.wait)
        self.addCleanup(client.kill)
        self.assertEqual(client.stdout.readline(), "half\n")
        until = time.monotonic() + 30
        while not self.stray() and time.monotonic() < until:
            time.sleep(0.02)
        self.assertNotEqual(self.stray(), [], "the daemon has nothing of it")
        return client

    def test_a_client_killed_in_the_middle(self):
        client = self.hold("other")
        self.assertEqual(self.versions("other"), [])
        client.kill()
        self.assertNothingStray()
        self.assertEqual(self.versions("other"), [])

    def test_the_daemon_killed_in_the_middle(self):
        client = self.hold("other")
        self.daemon.stop(signal.SIGKILL)
        client.kill()
        self.assertNotEqual(self.stray(), [])
        type(self).daemon = Daemon(self.folder / "store")
        self.addClassCleanup(self.daemon.stop)
        type(self).channel = grpc.insecure_channel(self.daemon.address)
        self.assertEqual(self.stray(), [])
        self.assertEqual(self.versions("other"), [])
        self.assertIn(1, self.versions("tubes"))

    def test_an_upload_that_is_cancelled(self):
        def endless():
            yield self.header("other")
            yield next(self.pieces())
            time.sleep(60)

        call = self.channel.stream_unary("/shaped.v1.Models/Upload", self.pb.UploadModelRequest.SerializeToString,
                                         self.pb.UploadModelResponse.FromString).future(endless(), timeout=120)
        until = time.monotonic() + 30
        while not self.stray() and time.monotonic() < until:
            time.sleep(0.02)
        self.assertNotEqual(self.stray(), [])
        call.cancel()
        self.assertNothingStray()
        self.assertEqual(self.versions("other"), [])

    def test_many_who_do_not_take_what_they_asked_for_keep_nobody_waiting(self):
        request = self.pb.DownloadModelRequest(model={"name": "tubes"})
        download = self.channel.unary_stream("/shaped.v1.Models/Download", self.pb.DownloadModelRequest.SerializeToString,
                                             self.pb.DownloadModelResponse.FromString)
        streams = [download(request, timeout=60) for _ in range(8)]
        self.expect(SUCCESS, "models")
        for stream in streams:
            data = b"".join(message.tensors for message in stream)
            self.assertEqual(data, self.tensors)


HALF = """
import pathlib, sys, time, grpc
address, folder, name = sys.argv[1:]
from shaped.v1 import models_pb2 as pb
import hashlib
manifest, tensors = [(pathlib.Path(folder) / "copy" / file).read_bytes() for file in ("manifest.json", "tensors.safetensors")]
def messages():
    yield pb.UploadModelRequest(header={"name": name, "files": {
        "manifest": manifest, "manifest_sha256": hashlib.sha256(manifest).hexdigest(),
        "tensors_sha256": hashlib.sha256(tensors).hexdigest(), "tensors_bytes": len(tensors)}})
    yield pb.UploadModelRequest(tensors=tensors[:len(tensors) // 2])
    print("half", flush=True)
    time.sleep(120)
grpc.insecure_channel(address).stream_unary("/shaped.v1.Models/Upload", pb.UploadModelRequest.SerializeToString,
                                            pb.UploadModelResponse.FromString)(messages(), timeout=120)
"""


def two_megabytes(folder):
    """What says of itself that it is a model of 2 MiB; nobody reads it."""
    manifest = {"kind": "shell_pga", "format_version": 1, "created_by": "test", "description": {},
                "tensors": {"file": "tensors.safetensors", "bytes": 2 << 20, "sha256": "0" * 64}}
    return write_files(folder / "source", json.dumps(manifest).encode(), bytes(2 << 20))


class LimitedUploads(DaemonCase):
    daemon_options = ("--max-upload-megabytes", "1")

    def test_a_model_that_is_larger_than_the_limit(self):
        self.refused("want at most 1048576, the server's limit", "upload", "other", two_megabytes(self.folder))


class LimitedMemory(DaemonCase):
    daemon_options = ("--model-megabytes", "1")

    def test_a_model_that_never_fits_into_memory(self):
        refused = self.expect(UNAVAILABLE, "upload", "other", two_megabytes(self.folder)).json["error"]
        self.assertEqual(refused["reason"], "MEMORY_BUDGET")
        self.assertNotIn("retry_after_seconds", refused)


def limit_files():
    """No file of the process may grow beyond this: as on a full disk."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (36864, 36864))


class FullDisk(unittest.TestCase):
    def test_a_full_disk(self):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            DaemonCase.daemon = Daemon(folder / "store")
            case = DaemonCase()
            case.expect(SUCCESS, "train", "shell-pga", "tubes", *write_tubes(folder), "--coarse-vertices", 60)
            case.expect(SUCCESS, "download", "tubes", folder / "copy")
            self.assertGreater((folder / "copy" / FILES[1]).stat().st_size, 36864)
            DaemonCase.daemon.stop()
            shutil.rmtree(folder / "store")
            DaemonCase.daemon = Daemon(folder / "store", preexec=limit_files)
            try:
                refused = case.expect(UNAVAILABLE, "upload", "tubes", folder / "copy").json["error"]
                self.assertEqual(refused["reason"], "DISK_FULL")
                self.assertIn("free space", refused["message"])
                self.assertEqual(case.shapectl("models").json, {"models": []})
                self.assertEqual(list((folder / "store/models").iterdir()), [])
            finally:
                DaemonCase.daemon.stop()


if __name__ == "__main__":
    unittest.main()
