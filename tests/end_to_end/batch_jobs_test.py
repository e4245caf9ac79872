"""Batch jobs: the answers of Shapes without a client that waits, kept on the daemon, over stops and crashes."""

import json
import signal
import time
import unittest

import numpy

from model_test import LABELS, MARKER_VERTICES, Trained
from support import BAD_INPUT, NOT_FOUND, SUCCESS, Daemon, tube, write_mesh

FRAMES = 12


def write_take(folder, frames=FRAMES, shape=tube, vertices=MARKER_VERTICES):
    """A marker set and a trial of tubes that bend: the words that fit it."""
    markers = [{"label": label, "vertex": vertex} for label, vertex in zip(LABELS, vertices)]
    set_file = folder / "set.json"
    set_file.write_text(json.dumps({"markers": markers}))
    trial = folder / "take.npy"
    numpy.save(trial, numpy.array([shape(-0.9 + 1.6 * i / (frames - 1))[0][list(vertices)] for i in range(frames)]))
    return ["fit", "tubes", trial, "--marker-set", set_file]


def without_seconds(value):
    """The document but for the times, which no two runs have in common."""
    if isinstance(value, dict):
        return {key: without_seconds(inner) for key, inner in value.items() if key != "seconds"}
    return [without_seconds(inner) for inner in value] if isinstance(value, list) else value


class BatchJobs(Trained):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.fit = write_take(cls.folder)

    def detached(self, *words):
        job = self.expect(SUCCESS, *words, "--detach").json
        self.assertIn(job["state"], ("queued", "running", "succeeded"))
        return job["id"]

    def watched(self, job):
        return self.shapectl("watch", job).json

    def test_an_evaluation_as_a_job_says_what_the_call_says(self):
        words = ("evaluate", "tubes", "--samples", 2, "--modes", 2)
        called = self.shapectl(*words)
        followed = self.shapectl(*words, "--job")
        self.assertEqual(called.code, followed.code, followed.out + followed.err)
        self.assertEqual(without_seconds(called.json), without_seconds(followed.json))
        job = self.detached(*words)
        ended = self.watched(job)
        self.assertEqual((ended["kind"], ended["state"], ended["model_name"]), ("evaluate", "succeeded", "tubes@1"))
        for _ in range(2):  # as often as wanted
            plot = self.folder / "plot.svg"
            fetched = self.shapectl("result", job, "--plot", plot)
            self.assertEqual(without_seconds(called.json), without_seconds(fetched.json))
            self.assertIn("<svg", plot.read_text())

    def test_a_take_as_a_job_is_fitted_as_the_stream_fits_it(self):
        reports, shapes = [], []
        for name, extra in (("stream", ()), ("job", ("--job",))):
            out, report = self.folder / f"{name}.npy", self.folder / f"{name}.json"
            result = self.shapectl(*self.fit, "-o", out, "--report", report, *extra)
            self.assertEqual(result.json["frame_count"], FRAMES)
            reports.append(without_seconds(json.loads(report.read_text())))
            shapes.append(numpy.load(out))
        self.assertEqual(*reports)
        self.assertTrue((shapes[0] == shapes[1]).all())
        job = self.detached(*self.fit)
        self.assertEqual(self.watched(job)["state"], "succeeded")
        out, report = self.folder / "fetched.npy", self.folder / "fetched.json"
        self.shapectl("result", job, "-o", out, "--report", report, "--marker-set", self.fit[-1])
        self.assertEqual(reports[0], without_seconds(json.loads(report.read_text())))
        self.assertTrue((shapes[0] == numpy.load(out)).all())

    def test_meshes_are_projected_together(self):
        out, report = self.folder / "projected.npy", self.folder / "projected.json"
        result = self.shapectl("project", "tubes", *self.meshes, "--job", "-o", out, "--report", report)
        self.assertEqual(result.json["shape_count"], len(self.meshes))
        answers = json.loads(report.read_text())["shapes"]
        for mesh, answer, shape in zip(self.meshes, answers, numpy.load(out)):
            alone = self.shapectl("project", "tubes", mesh).json
            for one, other in zip(alone["tangent_coordinates"], answer["tangent_coordinates"]):
                self.assertAlmostEqual(one, other, delta=1e-5)  # meshes in text, datasets in single precision
            self.assertEqual(shape.shape, (106, 3))
        job = self.detached("project", "tubes", *self.meshes)
        self.watched(job)
        self.assertEqual(self.expect(result.code, "result", job).json["shape_count"], len(self.meshes))

    def test_what_cannot_be_done_is_refused_at_once_and_by_name(self):
        before = len(self.shapectl("jobs").json["jobs"])
        self.expect(NOT_FOUND, "evaluate", "nothing", "--detach")
        self.expect(NOT_FOUND, "evaluate", "tubes", "--dataset", "none", "--detach")
        self.refused("folds", "evaluate", "tubes", "--folds", 1, "--detach")
        self.refused("modes", "evaluate", "tubes", "--modes", 9, "--detach")
        self.refused("modes", *self.fit, "--modes", 9, "--detach")
        self.refused("MESH", "project", "tubes", "--detach")
        self.refused("MESH", "project", "tubes", *self.meshes)
        self.refused("--report", "project", "tubes", self.meshes[0], "--report", "r.json")
        other = [write_mesh(self.folder / f"other{i}.obj", *tube(0.1 * i, rings=9)) for i in range(3)]
        self.refused("connectivity", "project", "tubes", *other, "--detach")
        self.assertEqual(len(self.shapectl("jobs").json["jobs"]), before)
        self.assertEqual(list((self.folder / "store/jobs").glob("*/input")), [])

    def test_a_result_is_of_a_batch_job_that_has_succeeded_and_goes_with_it(self):
        training = self.shapectl("jobs").json["jobs"][0]
        self.assertEqual(training["kind"], "train_shell_pga")
        self.assertIn("published", self.expect(BAD_INPUT, "result", training["id"]).message())
        self.expect(NOT_FOUND, "result", "999")
        job = self.detached(*self.fit)
        self.watched(job)
        kept = set((self.folder / "store/jobs").glob("*/result"))
        self.expect(SUCCESS, "delete-job", job)
        self.expect(NOT_FOUND, "result", job)
        self.assertEqual(len(kept - set((self.folder / "store/jobs").glob("*/result"))), 1)

    def test_shapes_that_were_left_out_cannot_be_written(self):
        self.shapectl(*self.fit, "--job")
        job = self.shapectl("jobs").json["jobs"][-1]["id"]
        self.refused("--out", "result", job, "-o", self.folder / "none.npy")


class Limited(Trained):
    daemon_options = ("--max-job-megabytes", "1")

    def test_a_job_that_is_too_large_is_refused_or_fails_by_name(self):
        fit = write_take(self.folder, 850)  # 106 vertices: 1.3 KB an answer
        failed = self.shapectl(*fit, "-o", self.folder / "none.npy", "--job")
        self.assertEqual(failed.code, BAD_INPUT, failed.out)
        self.assertIn("--max-job-megabytes", failed.json["error"]["message"])
        until = time.monotonic() + 20  # the record says first that it has failed
        while list((self.folder / "store/jobs").iterdir()) and time.monotonic() < until:
            time.sleep(0.02)
        self.assertEqual(list((self.folder / "store/jobs").iterdir()), [])


class Stopped(Trained):
    """A daemon is stopped or killed in the middle of a job; the next one goes on, to the same answers."""

    daemon_options = ("--checkpoint-every", "0")

    def state(self, job):
        return next(one for one in self.shapectl("jobs").json["jobs"] if one["id"] == job)

    def stopped_in_the_middle(self, how):
        fit = write_take(self.folder, 200)
        whole, fetched = self.folder / "whole.json", self.folder / "fetched.json"
        self.shapectl(*fit, "--report", whole)
        job = self.shapectl(*fit, "--detach").json["id"]
        until = time.monotonic() + 60
        while self.state(job)["fraction"] < 0.05 and time.monotonic() < until:
            time.sleep(0.02)
        self.daemon.stop(how)
        type(self).daemon = Daemon(self.folder / "store", *self.daemon_options)
        self.addClassCleanup(self.daemon.stop)
        ended = self.shapectl("watch", job).json
        self.assertEqual((ended["state"], ended["attempts"]), ("succeeded", 2))
        self.assertRegex(ended["resumed_from"], r"frame \d+")
        self.shapectl("result", job, "--report", fetched, "--marker-set", fit[-1])
        self.assertEqual(without_seconds(json.loads(whole.read_text())), without_seconds(json.loads(fetched.read_text())))

    def test_a_take_goes_on_after_a_stop_and_ends_the_same(self):
        self.stopped_in_the_middle(signal.SIGTERM)

    def test_a_take_goes_on_after_a_kill_and_ends_the_same(self):
        self.stopped_in_the_middle(signal.SIGKILL)


if __name__ == "__main__":
    unittest.main()
