"""SIGKILL at random moments: what was begun ends published or failed, once, and leaves nothing behind.

    SHAPED_KILLS=100 SHAPED_BINARIES=build/release/bin python3 crash_test.py

kills more often than the 10 times of a usual run. SHAPED_SEED repeats a run."""

import os
import pathlib
import random
import signal
import subprocess
import tempfile
import time
import unittest

from support import SUCCESS, Daemon, DaemonCase, tube, write_mesh

KILLS = int(os.environ.get("SHAPED_KILLS", "10"))
SEED = int(os.environ.get("SHAPED_SEED", random.randrange(10 ** 6)))


class Killed(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.store = self.folder / "store"
        self.random = random.Random(SEED)
        self.meshes = [write_mesh(self.folder / f"tube{i}.obj", *tube(-1.2 + 0.3 * i, 0.3 + 0.02 * (i * i % 5), 40, 14))
                       for i in range(9)]
        self.start()
        self.addCleanup(lambda: DaemonCase.daemon.stop(signal.SIGKILL))

    def start(self):
        DaemonCase.daemon = Daemon(self.store, "--checkpoint-every", "0", "--job-crashes", "1000000")

    def kill(self):
        DaemonCase.daemon.stop(signal.SIGKILL)
        self.start()

    def shapectl(self, *words):
        return DaemonCase.shapectl(*words)

    def begin(self, name):
        """Starts a training and leaves it: the client goes without a word."""
        client = subprocess.Popen(DaemonCase.command("train", "shell-pga", name, *self.meshes, "--coarse-vertices", 300),
                                  stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        until = time.monotonic() + 60
        while not self.jobs(name) and time.monotonic() < until:
            time.sleep(0.02)
        client.kill()
        client.wait()

    def jobs(self, name=None):
        return [job for job in self.shapectl("jobs").json["jobs"] if name in (None, job["model_name"])]

    def finish(self):
        """Waits until no job goes on; returns all."""
        until = time.monotonic() + 120
        while time.monotonic() < until:
            jobs = self.jobs()
            if all(job["state"] not in ("queued", "running") for job in jobs):
                return jobs
            time.sleep(0.05)
        self.fail(f"jobs go on: {jobs}")

    def assertTidy(self, models, datasets):
        """The store holds what is listed, whole, and nothing else."""
        self.assertEqual(list((self.store / "jobs").iterdir()), [])
        self.assertEqual({path.name for path in self.store.iterdir()} - {"jobs.sqlite-wal", "jobs.sqlite-shm"},
                         {".lock", "datasets", "jobs", "jobs.sqlite", "models"})
        files = {str(path.relative_to(self.store / "models")) for path in (self.store / "models").rglob("*")
                 if path.is_file() and path.name != ".highest-version"}
        self.assertEqual(files, {f"{name}/{version}/{file}" for name, version in models
                                 for file in ("manifest.json", "tensors.safetensors")})
        self.assertEqual({path.name for path in (self.store / "datasets").iterdir()}, datasets)
        for name, version in models:
            self.assertEqual(self.shapectl("describe", f"{name}@{version}").code, SUCCESS)

    def listed(self):
        return {(model["model"]["name"], model["model"]["version"])
                for model in self.shapectl("models").json["models"]}

    def datasets(self):
        return {path.name for path in (self.store / "datasets").iterdir() if not path.name.startswith(".")}

    def test_killed_while_training_and_publishing(self):
        resumed = 0
        kills = 0
        while kills < KILLS:
            name = f"m{kills}"
            begin = time.monotonic()
            self.begin(name)
            while kills < KILLS and self.jobs(name)[-1]["state"] in ("queued", "running"):
                # Soon after the start, and with luck in the middle of the mean, the publishing or the record of it.
                time.sleep(self.random.uniform(0, 0.6))
                self.kill()
                kills += 1
                resumed += "resumed_from" in self.jobs(name)[-1]
                if time.monotonic() - begin > 10:
                    break
            jobs = self.finish()
            self.assertEqual([job["state"] for job in jobs], ["succeeded"] * len(jobs), f"seed {SEED}: {jobs}")
            self.assertEqual(self.listed(), {(job["model_name"], 1) for job in jobs}, f"seed {SEED}")
        self.kill()
        self.assertTidy(self.listed(), self.datasets())
        print(f"{kills} kills, {resumed} seen resumed, {len(self.jobs())} jobs, seed {SEED}")

    def test_killed_while_uploading_and_deleting(self):
        for i in range(max(3, KILLS // 3)):
            words = self.random.choice((["train", "shell-pga", "m", *self.meshes, "--coarse-vertices", "60",
                                         "--path-steps", "2"], ["delete", "m"]))
            client = subprocess.Popen(DaemonCase.command(*words), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            time.sleep(self.random.uniform(0, 0.5))
            self.kill()
            client.kill()
            client.wait()
        self.finish()
        self.kill()
        self.assertTidy(self.listed(), self.datasets())

    def test_a_daemon_that_is_stopped_leaves_its_job_for_the_next(self):
        self.begin("m")
        until = time.monotonic() + 30
        while self.jobs("m")[-1]["stage"].find("Newton step") < 0 and time.monotonic() < until:
            time.sleep(0.02)
        begin = time.monotonic()
        code, log = DaemonCase.daemon.stop()
        self.assertEqual(code, 0, log)
        self.assertLess(time.monotonic() - begin, 4)
        self.assertEqual(len(list((self.store / "jobs").rglob("checkpoint.safetensors"))), 1)
        self.start()
        job, = self.finish()
        self.assertEqual(job["state"], "succeeded")
        self.assertEqual(job["attempts"], 2)
        self.assertIn("Frechet mean", job["resumed_from"])
        self.assertTidy({("m", 1)}, self.datasets())

    def test_a_damaged_checkpoint_is_left_aside(self):
        self.begin("m")
        until = time.monotonic() + 30
        while not list((self.store / "jobs").rglob("checkpoint.safetensors")) and time.monotonic() < until:
            time.sleep(0.02)
        DaemonCase.daemon.stop(signal.SIGKILL)
        path, = (self.store / "jobs").rglob("checkpoint.safetensors")
        content = bytearray(path.read_bytes())
        content[-1] ^= 1
        path.write_bytes(content)
        self.start()
        job, = self.finish()
        self.assertEqual(job["state"], "succeeded")
        self.assertNotIn("resumed_from", job)
        code, log = DaemonCase.daemon.stop()
        self.assertIn("begins anew", log)
        self.start()

    def test_a_damaged_database_is_refused_by_name(self):
        DaemonCase.daemon.stop()
        (self.store / "jobs.sqlite").write_bytes(b"x" * 8192)
        with self.assertRaisesRegex(RuntimeError, "jobs.sqlite.*move it away"):
            self.start()
        (self.store / "jobs.sqlite").unlink()
        self.start()


if __name__ == "__main__":
    unittest.main()
