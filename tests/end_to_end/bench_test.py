"""shapectl bench against a real daemon: every method, open and closed loop, overload, errors."""

import json
import signal
import subprocess
import time
import unittest

from support import BAD_INPUT, CANCELLED, NOT_FOUND, SUCCESS, UNAVAILABLE, DaemonCase, write_tubes

PLAIN = ("health", "limits", "statistics", "models", "datasets", "jobs")
OF_A_MODEL = ("describe", "mean", "project", "synthesize", "score", "edit", "interpolate", "fit", "evaluate")


class Bench(DaemonCase):
    # One solver and a short queue: little load is too much for it.
    daemon_options = ("--threads", "1", "--queue-length", "2")

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        meshes = write_tubes(cls.folder)
        result = cls.shapectl("train", "shell-pga", "tubes", *meshes, "--modes", 2, "--coarse-vertices", 60)
        if result.code != SUCCESS:
            raise RuntimeError(result.out + result.err)

    def bench(self, *words):
        return self.expect(SUCCESS, "bench", *words).json

    def test_every_method_is_answered(self):
        for method in PLAIN + OF_A_MODEL:
            with self.subTest(method):
                model = ("--model", "tubes") if method in OF_A_MODEL else ()
                result = self.bench(method, *model, "--seconds", 0.2, "--warm-up", 0, "--concurrency", 1, "--frames", 3)
                self.assertGreater(result["answered"], 0)
                self.assertEqual(result["errors"], [])
                self.assertGreater(result["received_bytes_per_second"], 0)
                self.assertEqual(result["latency"]["count"], result["answered"])
                times = result["latency"]
                self.assertLessEqual(times["p50"], times["p99"])
                self.assertLessEqual(times["p99"], times["max"])

    def test_frames_of_any_mesh(self):
        self.refused("--mesh", "bench", "frames")
        result = self.bench("frames", "--mesh", self.folder / "tube0.obj", "--frames", 20, "--seconds", 0.2, "--warm-up", 0, "--concurrency", 1)
        self.assertEqual(result["errors"], [])
        # 106 vertices of three floats: a call's bytes are at least those of its frames.
        self.assertGreater(result["received_bytes_per_second"] * result["seconds"], result["answered"] * 20 * 106 * 12)

    def test_an_open_loop_sends_what_is_due(self):
        result = self.bench("limits", "--rate", 200, "--arrivals", "fixed", "--seconds", 1, "--warm-up", 0.5)
        self.assertEqual(result["sent"] + result["unsent"], 200)
        self.assertEqual(result["sent"], result["answered"] + result["refused"])  # the queue is short
        self.assertGreater(result["answered"], 0)

    def test_late_sends_count_as_latency(self):
        # One place and far more arrivals than it can serve: the daemon is quick, the clients wait all the same.
        result = self.bench("project", "--model", "tubes", "--rate", 5000, "--concurrency", 1, "--seconds", 1, "--warm-up", 0)
        self.assertGreater(result["unsent"], 0)
        self.assertGreater(result["late"], 0)
        self.assertGreater(result["latency"]["max"], 2 * result["service"]["p50"])
        self.assertGreater(result["delay"]["max"], 0.1)

    def test_overload_is_refused_and_counted(self):
        result = self.bench("edit", "--model", "tubes", "--concurrency", 60, "--connections", 2, "--seconds", 1, "--warm-up", 0)
        self.assertGreater(result["answered"], 0)
        self.assertGreater(result["refused"], 0)
        self.assertEqual([(error["code"], error["reason"]) for error in result["errors"]], [("RESOURCE_EXHAUSTED", "SERVER_BUSY")])
        self.assertEqual(result["refusals"]["count"], result["refused"])
        self.assertEqual(result["sent"], result["answered"] + result["refused"])

    def test_the_table(self):
        words = [word for word in self.command("bench", "limits", "--seconds", 0.2) if word not in ("--output", "json")]
        text = subprocess.run(words, capture_output=True, text=True, timeout=60)
        self.assertEqual(text.returncode, SUCCESS, text.stderr)
        for part in ("answers/s", "p99.9", "latency, from when it was due", "MB/s received"):
            self.assertIn(part, text.stdout)

    def test_what_is_wrong_is_said(self):
        self.refused("want one of", "bench", "nonsense")
        self.refused("--model", "bench", "project")
        self.refused("--rate", "bench", "limits", "--rate", 0)
        self.refused("--concurrency", "bench", "limits", "--concurrency", 0)
        self.refused("--connections", "bench", "limits", "--connections", 0)
        self.refused("--seconds", "bench", "limits", "--seconds", -1)
        self.refused("--arrivals", "bench", "limits", "--arrivals", "sometimes")
        self.refused("--frames", "bench", "fit", "--model", "tubes", "--frames", 0)
        self.expect(NOT_FOUND, "bench", "describe", "--model", "cat")
        nobody = [word.replace(self.daemon.address, "127.0.0.1:1") for word in self.command("bench", "limits")]
        self.assertEqual(subprocess.run(nobody, capture_output=True, timeout=60).returncode, UNAVAILABLE)

    def test_ctrl_c_tells_what_was_measured(self):
        process = subprocess.Popen(self.command("bench", "limits", "--seconds", 600, "--warm-up", 0), stdout=subprocess.PIPE, text=True)
        time.sleep(1)
        process.send_signal(signal.SIGINT)
        out, _ = process.communicate(timeout=60)
        self.assertEqual(process.returncode, CANCELLED)
        self.assertGreater(json.loads(out)["answered"], 0)


if __name__ == "__main__":
    unittest.main()
