"""SIGKILL at random moments: what was begun ends published or failed, once, and leaves nothing behind.

    SHAPED_KILLS=100 SHAPED_BINARIES=build/release/bin python3 crash_test.py

kills more often than the 10 times of a usual run. SHAPED_SEED repeats a run."""

import itertools
import json
import os
import pathlib
import random
import shutil
import signal
import subprocess
import tempfile
import time
import unittest

import numpy

from batch_jobs_test import without_seconds, write_take
from support import NOT_CONVERGED, SUCCESS, Daemon, DaemonCase, tube, write_mesh

KILLS = int(os.environ.get("SHAPED_KILLS", "10"))
SEED = int(os.environ.get("SHAPED_SEED", random.randrange(10 ** 6)))


LATE_STAGES = ("gram", "reflected", "backward")


def tensor(path, name):
    """One tensor of doubles out of a safetensors file; None when the file is not there."""
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        return None
    length = int.from_bytes(content[:8], "little")
    begin, end = json.loads(content[8:8 + length])[name]["data_offsets"]
    return numpy.frombuffer(content[8 + length + begin:8 + length + end])


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

    def assertTidy(self, models, datasets, results=0):
        """The store holds what is listed, whole, and nothing else."""
        self.assertEqual([path.name for path in (self.store / "jobs").rglob("*") if path.is_file()], ["result"] * results)
        self.assertEqual(len(list((self.store / "jobs").iterdir())), results)
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

    def killed_in_stage(self, name, stage):
        """Kills the daemon once a checkpoint holds an item of the stage; what the next one resumed from, or nothing when the
        training was faster."""
        self.begin(name)
        until = time.monotonic() + 60
        while time.monotonic() < until:
            path = next((self.store / "jobs").glob("*/checkpoint.safetensors"), None)
            states = path and tensor(path, f"{stage}.states")
            if states is not None and states.any():
                break
            if path is None and self.jobs(name)[-1]["state"] not in ("queued", "running"):
                return ""
        self.kill()
        return self.finish()[-1].get("resumed_from", "")

    def test_killed_in_every_stage_after_the_mean(self):
        seen = []
        for stage, words in zip(LATE_STAGES, ("Gram matrix", "reflections", "principal variations")):
            # A stage is over in a fraction of a second: the next try meets it when one has come too late.
            for attempt in range(10):
                seen.append(self.killed_in_stage(f"{stage}{attempt}", stage))
                if any(word in seen[-1] for word in ("Gram", "reflections", "variations")):
                    break
            self.assertRegex(seen[-1], "Gram matrix|reflections|principal variations", words)
        jobs = self.jobs()
        self.assertEqual({job["state"] for job in jobs}, {"succeeded"})
        self.kill()
        self.assertTidy({(job["model_name"], 1) for job in jobs}, self.datasets())
        print("resumed from", seen)

    def test_killed_in_batch_jobs(self):
        self.assertEqual(self.shapectl("train", "shell-pga", "tubes", *self.meshes, "--coarse-vertices", 100, "--modes", 3).code, SUCCESS)
        dataset, = self.datasets()
        fit = write_take(self.folder, 100, lambda angle: tube(angle, 0.3, 40, 14), (1, 141, 283, 425, 556))
        kinds = {"evaluate": ["evaluate", "tubes", "--samples", 2], "fit_markers": fit,
                 "project": ["project", "tubes", "--dataset", dataset, "--fine"]}
        whole = {kind: self.result(self.shapectl(*words, "--detach").json["id"]) for kind, words in kinds.items()}
        kills, resumed, jobs = 0, 0, len(kinds)
        for kind, words in itertools.cycle(kinds.items()):
            if kills >= KILLS:
                break
            job = self.shapectl(*words, "--detach").json["id"]
            jobs += 1
            for _ in range(4):
                time.sleep(self.random.uniform(0, 0.6))
                self.kill()
                kills += 1
                resumed += "resumed_from" in self.job(job)
            self.assertEqual(self.result(job), whole[kind], f"seed {SEED}: {kind}")
        self.kill()
        self.assertTidy({("tubes", 1)}, {dataset}, jobs)
        print(f"{kills} kills in batch jobs, {resumed} seen resumed, {jobs} jobs, seed {SEED}")

    def job(self, job):
        return next(one for one in self.jobs() if one["id"] == job)

    def result(self, job):
        """The answers of a job, once it has ended."""
        self.finish()
        self.assertEqual(self.job(job)["state"], "succeeded", self.job(job))
        report = self.folder / "report.json"
        report.unlink(missing_ok=True)
        fetched = self.shapectl("result", job, "--report", report)
        self.assertIn(fetched.code, (SUCCESS, NOT_CONVERGED), fetched.err)
        return without_seconds(json.loads(report.read_text()) if report.exists() else fetched.json)

    def timed(self, *words):
        begin = time.monotonic()
        self.assertEqual(self.shapectl(*words).code, SUCCESS)
        return time.monotonic() - begin

    def test_killed_while_uploading_and_deleting(self):
        train = ["train", "shell-pga", "m", *self.meshes, "--coarse-vertices", "60", "--path-steps", "2", "--detach"]
        upload_time = self.timed(*train)
        self.finish()
        whole = self.folder / "whole"
        shutil.copytree(self.store / "models/m/1", whole)
        delete_time = self.timed("delete", "m@1")
        deleted = 0
        for i in range(KILLS):
            version = 1000 * (i + 1)  # between them is room for what trainings publish
            delete = self.random.random() < 0.5
            if delete:  # one more version, as another process would bring it in
                shutil.copytree(whole, self.store / f"models/m/.copy{version}")
                (self.store / f"models/m/.copy{version}").rename(self.store / f"models/m/{version}")
            client = subprocess.Popen(DaemonCase.command(*(["delete", f"m@{version}"] if delete else train)),
                                      stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            time.sleep(self.random.uniform(0, 1.6 * (delete_time if delete else upload_time)))
            self.kill()
            client.kill()
            client.wait()
            deleted += delete and ("m", version) not in self.listed()
        jobs = self.finish()
        self.assertEqual({job["state"] for job in jobs}, {"succeeded"})
        self.kill()
        self.assertTidy(self.listed(), self.datasets())
        print(f"{KILLS} kills while uploading and deleting, {deleted} versions deleted, {len(jobs)} jobs, seed {SEED}")

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
