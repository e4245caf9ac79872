"""The store of a daemon is full, read-only, or holds what it should not: what is refused, what goes on, and what is left."""

import json
import pathlib
import shutil
import tempfile
import time
import unittest

import mounts
from support import INTERNAL, NOT_CONVERGED, SUCCESS, UNAVAILABLE, Daemon, DaemonCase, tube, write_mesh, write_tubes
from transfer_test import FILES, read_files, restated, with_header, write_files

PATIENCE = 120  # [s] for what takes seconds on a machine with nothing else to do
READ_ONLY = "Read-only file system"


class StoreCase(DaemonCase):
    """Each test has a file system of its own for its store, and ends with the question whether the daemon still serves."""

    @classmethod
    def setUpClass(cls):
        pass

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.meshes = write_tubes(self.folder)

    def start(self, *options):
        type(self).daemon = Daemon(self.store, *options)
        self.addCleanup(self.daemon.stop)

    def stop(self):
        code, log = self.daemon.stop()
        self.assertEqual(code, 0, log)

    def train(self, name, *words):
        return ["train", "shell-pga", name, *self.meshes, "--coarse-vertices", 60, *words]

    def trained(self, *names):
        for name in names:
            self.expect(SUCCESS, *self.train(name))

    def train_slowly(self, name):
        """A job that takes some seconds and runs now; its id."""
        meshes = [write_mesh(self.folder / f"slow{i}.obj", *tube(-1.2 + 0.3 * i, 0.3 + 0.02 * (i * i % 5), 40, 14)) for i in range(9)]
        job = self.expect(SUCCESS, "train", "shell-pga", name, *meshes, "--coarse-vertices", 300, "--detach").json["id"]
        self.wait(lambda: self.job(job)["state"] == "running" and self.job(job)["fraction"] > 0, "the job runs")
        return job

    def job(self, job):
        return next(one for one in self.expect(SUCCESS, "jobs").json["jobs"] if one["id"] == job)

    def assertServed(self, name):
        """Whether its answer has converged is not the question here."""
        self.assertIn(self.shapectl("score", name, self.meshes[1]).code, (SUCCESS, NOT_CONVERGED))

    def names(self):
        return [model["model"]["name"] for model in self.expect(SUCCESS, "models").json["models"]]

    def wait(self, question, what):
        until = time.monotonic() + PATIENCE
        while not question():
            self.assertLess(time.monotonic(), until, what + ": " + self.daemon.log[-2000:])
            time.sleep(0.02)


class ReadOnly(StoreCase):
    def test_a_daemon_does_not_start_on_a_read_only_store(self):
        mount = mounts.memory(self, 8192)
        self.store = mount.path / "store"
        self.start()
        self.trained("tubes")
        self.stop()
        mount.remount("ro")
        begin = time.monotonic()
        with self.assertRaisesRegex(RuntimeError, r"shaped ended with 1: .*store/\S+: cannot be written: " + READ_ONLY):
            self.start()
        self.assertLess(time.monotonic() - begin, 60)
        mount.remount("rw")
        self.start()
        self.expect(SUCCESS, "describe", "tubes")

    def test_a_store_that_becomes_read_only_is_served_on_and_not_written(self):
        disk = mounts.Disk(self, self.folder, 32)
        self.store = disk.path / "store"
        self.start("--publish-patience", "1")
        self.trained("tubes", "later")
        self.expect(SUCCESS, "download", "tubes", self.folder / "copy")
        self.expect(SUCCESS, "unload", "later")
        running = self.train_slowly("running")
        disk.fail()
        for name in ("tubes", "later"):  # the one in memory, and one that is still to be read
            self.assertServed(name)
        self.expect(SUCCESS, "download", "tubes", self.folder / "again")
        for words in (self.train("new"), ("upload", "new", self.folder / "copy"), ("label", "tubes@1", "stable"), ("delete", "tubes@1"),
                      ("evaluate", "tubes", "--detach")):
            refused = self.expect(UNAVAILABLE, *words).json["error"]
            self.assertEqual(refused["reason"], "STORE_READ_ONLY", refused)
            self.assertRegex(refused["message"], f"(?i){READ_ONLY}|is read-only", words)
        self.assertEqual(sorted(self.names()), ["later", "tubes"])
        self.daemon.wait_for(f"the end of job {running} cannot be recorded, trying again", PATIENCE)
        self.stop()  # which it does in spite of all that it could not write
        disk.repair()
        self.start()
        self.expect(SUCCESS, "watch", running)
        self.assertEqual(sorted(self.names()), ["later", "running", "tubes"])
        self.trained("new")


class Full(StoreCase):
    def setUp(self):
        super().setUp()
        self.mount = mounts.memory(self, 16384)
        self.store = self.mount.path / "store"

    def fill(self):
        """Until not a byte more goes in."""
        with open(self.mount.path / "filler", "ab", buffering=0) as file:
            for size in (1 << 20, 1 << 12, 1):
                try:
                    while True:
                        file.write(bytes(size))
                except OSError:
                    pass

    def make_room(self):
        (self.mount.path / "filler").unlink()

    def files(self, folder):
        """All of it, scratch folders too."""
        return sorted(str(path.relative_to(self.store)) for path in (self.store / folder).rglob("*"))

    def disk_full(self, *words):
        refused = self.expect(UNAVAILABLE, *words).json["error"]
        self.assertEqual(refused["reason"], "DISK_FULL", refused)
        self.assertIn("free space", refused["message"])

    def test_uploads(self):
        self.start()
        self.trained("tubes")
        self.expect(SUCCESS, "download", "tubes", self.folder / "copy")
        datasets, models = self.files("datasets"), self.files("models")
        self.fill()
        self.meshes[0] = write_mesh(self.folder / "other.obj", *tube(0.33))  # another dataset
        self.disk_full(*self.train("other"))
        self.disk_full("upload", "copy", self.folder / "copy")
        self.assertServed("tubes")
        self.assertEqual((self.files("datasets"), self.files("models")), (datasets, models))
        self.make_room()
        self.trained("other")
        self.expect(SUCCESS, "upload", "copy", self.folder / "copy")
        self.assertEqual(sorted(self.names()), ["copy", "other", "tubes"])

    def test_a_training_waits_for_room_before_it_publishes(self):
        self.start()
        job = self.train_slowly("slow")
        self.fill()
        self.wait(lambda: "waiting for room on the disk" in self.job(job)["stage"], "the training has ended, and waits")
        self.assertIn("No space left on device", self.job(job)["stage"])
        self.make_room()
        self.assertEqual(self.expect(SUCCESS, "watch", job).json["model"], {"name": "slow", "version": 1})
        self.assertEqual(self.files("models"), ["models/slow", "models/slow/1", *(f"models/slow/1/{name}" for name in FILES)])
        self.wait(lambda: self.files("jobs") == [], "the job's folder is removed")

    def test_a_training_fails_when_no_room_comes(self):
        self.start("--publish-patience", "1")
        job = self.train_slowly("slow")
        self.fill()
        # The record of the failure may need room as well, or find some in a journal that has been written back.
        self.wait(lambda: self.job(job)["state"] == "failed" or "cannot be recorded, trying again" in self.daemon.log, "it gives up")
        self.assertEqual(self.files("models"), [])
        self.make_room()
        self.wait(lambda: self.job(job)["state"] == "failed", "the failure is recorded")
        self.assertIn("No space left on device", self.shapectl("watch", job).message())
        self.trained("slow")
        self.assertEqual(self.names(), ["slow"])

    def test_jobs_that_cannot_be_recorded_are_refused(self):
        self.start()
        self.trained("tubes")
        self.fill()
        words = ("evaluate", "tubes", "--modes", 1, "--samples", 1, "--folds", 2, "--detach")
        known = 1
        # Until the journal of the database needs another page.
        for _ in range(50):
            result = self.shapectl(*words)
            if result.code != SUCCESS:
                break
            known += 1
        self.assertEqual((result.code, result.json["error"]["reason"]), (UNAVAILABLE, "DISK_FULL"), result.out)
        self.assertServed("tubes")
        self.assertEqual(len(self.expect(SUCCESS, "jobs").json["jobs"]), known)
        self.make_room()
        job = self.expect(SUCCESS, *words).json["id"]
        self.expect(SUCCESS, "watch", job)
        jobs = self.expect(SUCCESS, "jobs").json["jobs"]
        self.assertEqual([one["state"] for one in jobs], ["succeeded"] * (known + 1), jobs)
        self.stop()
        self.start()
        self.assertEqual(self.expect(SUCCESS, "jobs").json["jobs"], jobs)


class Foreign(StoreCase):
    def test_versions_that_are_not_what_they_should_be(self):
        """Put into the store by hand, one model each. All others are served."""
        self.store = self.folder / "store"
        self.start()
        self.trained("good")
        self.stop()
        manifest, tensors = read_files(self.store / "models/good/1")

        def stating(**changes):
            return json.dumps({**json.loads(manifest), **changes}).encode()

        def beyond(header):
            header["mean"]["data_offsets"][1] += 1 << 30

        outside = with_header(tensors, beyond)
        wrong_sum = {**json.loads(manifest)["tensors"], "sha256": "0" * 64}
        cases = {"sum": (stating(tensors=wrong_sum), tensors, "has SHA-256"),
                 "kind": (stating(kind="oracle"), tensors, 'is of kind "oracle"'),
                 "future": (stating(format_version=9), tensors, "has format version 9"),
                 "outside": (restated(manifest, outside), outside, "'mean' reaches from byte"),
                 "short": (manifest, tensors[:-8], "is damaged"),
                 "no_json": (b"{", tensors, "is no model manifest"),
                 "nothing": (manifest, b"", "")}
        for name, (stated, content, _) in cases.items():
            (self.store / "models" / name).mkdir()
            write_files(self.store / "models" / name / "1", stated, content)
        self.start("--preload", "all")
        self.daemon.wait_for("preload: ")
        for name, (_, _, text) in cases.items():
            for words in (("score", name, self.meshes[1]), ("load", name), ("score", name, self.meshes[1])):
                failed = self.expect(INTERNAL, *words)
                self.assertIn(text, failed.message())
                self.assertIn(name, failed.message())
        states = {model["model"]["name"]: model["state"] for model in self.expect(SUCCESS, "models").json["models"]}
        del cases["no_json"]  # what has no manifest is not listed: nothing is known of it
        self.assertEqual(states, {"good": "ready", **{name: "failed" for name in cases}})
        self.assertServed("good")
        # Taking a good one's files is all that it needs.
        for file in FILES:
            shutil.copy(self.store / "models/good/1" / file, self.store / "models/sum/1" / file)
        self.assertServed("sum")
        for name in cases:
            self.expect(SUCCESS, "delete", name)
        self.assertEqual(self.names(), ["good"])


if __name__ == "__main__":
    unittest.main()
