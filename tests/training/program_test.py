"""shaped-trainer as a job system meets it: its exit status, its output, its signals."""

import json
import os
import pathlib
import signal
import struct
import subprocess
import tempfile
import time
import unittest

import numpy

TRAINER = pathlib.Path(os.environ["SHAPED_BINARIES"]) / "shaped-trainer"
TYPES = {"float64": "F64", "float32": "F32", "int32": "I32"}


def write_tensors(path, **arrays):
    header, data = {}, b""
    for name, array in arrays.items():
        block = numpy.ascontiguousarray(array).tobytes()
        header[name] = {"dtype": TYPES[str(array.dtype)], "shape": list(array.shape), "data_offsets": [len(data), len(data) + len(block)]}
        data += block
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 8)
    path.write_bytes(struct.pack("<Q", len(text)) + text + data)


def bumpy_sheet(size):
    """A rectangular sheet of size x size vertices, and its triangles."""
    x, y = numpy.meshgrid(numpy.linspace(0, 1, size), numpy.linspace(0, 1.5, size), indexing="ij")
    shape = numpy.stack([x, y, 0.1 * numpy.sin(5 * x) * numpy.cos(4 * y)], 2).reshape(-1, 3)
    at = numpy.arange(size * size).reshape(size, size)
    a, b, c, d = at[:-1, :-1].ravel(), at[1:, :-1].ravel(), at[1:, 1:].ravel(), at[:-1, 1:].ravel()
    faces = numpy.concatenate([numpy.stack([a, b, c], 1), numpy.stack([a, c, d], 1)]).astype(numpy.int32)
    return shape, faces


class Program(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)
        shape, faces = bumpy_sheet(12)
        write_tensors(self.folder / "sheet.safetensors", faces=faces, shape=shape)
        write_tensors(self.folder / "pair.safetensors", source=shape, target=shape * [1.1, 1, 1], scan=(shape * [1.1, 1, 1]).astype(numpy.float32))

    def write_job(self, epochs, **options):
        job = {"kind": "jacobian_field", "references": {"sheet": "sheet.safetensors"}, "checkpoint_seconds": 1000,
               "pairs": [{"reference": "sheet", "file": "pair.safetensors"}], "options": {"epochs": epochs, **options}}
        (self.folder / "job.json").write_text(json.dumps(job))

    def run_trainer(self, *words):
        done = subprocess.run([TRAINER, *words], capture_output=True, text=True, timeout=120)
        return done.returncode, [json.loads(line) for line in done.stdout.splitlines()], done.stderr

    def stopped_by(self, sign):
        """The events of a long training that is sent a signal after its third line."""
        process = subprocess.Popen([TRAINER, self.folder], stdout=subprocess.PIPE, text=True)
        events = [json.loads(process.stdout.readline()) for _ in range(3)]
        process.send_signal(sign)
        events += [json.loads(line) for line in process.communicate(timeout=120)[0].splitlines()]
        return process.returncode, events

    def test_a_job_is_done(self):
        self.write_job(3)
        status, events, errors = self.run_trainer(self.folder)
        self.assertEqual((status, errors), (0, ""))
        self.assertEqual([event["event"] for event in events], ["start", "epoch", "epoch", "epoch", "checkpoint", "done"])
        self.assertTrue((self.folder / "field.safetensors").exists())

    def test_a_signal_leaves_a_checkpoint_from_which_the_job_goes_on(self):
        for sign in signal.SIGTERM, signal.SIGINT:
            self.write_job(1000000)
            status, events = self.stopped_by(sign)
            self.assertEqual(status, 3)
            self.assertEqual([event["event"] for event in events[-2:]], ["checkpoint", "stopped"])
            again, resumed = self.stopped_by(sign)
            self.assertEqual(again, 3)
            self.assertEqual(resumed[0]["step"], events[-1]["step"])
            self.assertGreater(resumed[-1]["step"], resumed[0]["step"])
            (self.folder / "checkpoint.safetensors").unlink()

    def test_with_its_parent_it_ends_too_and_keeps_a_checkpoint(self):
        self.write_job(1000000)
        out = self.folder / "out"
        subprocess.run(["sh", "-c", f"'{TRAINER}' --parent $$ '{self.folder}' > '{out}' & "
                        f"until grep -q epoch '{out}'; do sleep 0.05; done"], check=True, timeout=120)
        until = time.monotonic() + 60
        while '"stopped"' not in out.read_text() and time.monotonic() < until:
            time.sleep(0.05)
        events = [json.loads(line)["event"] for line in out.read_text().splitlines()]
        self.assertEqual(events[-2:], ["checkpoint", "stopped"])
        # One that is not its parent (any more) cannot tell it when to end: it does not begin.
        self.assertEqual(self.run_trainer("--parent", "4194305", self.folder)[0], 3)

    def test_bad_jobs_are_refused_in_words(self):
        self.write_job(0)
        status, events, errors = self.run_trainer(self.folder)
        self.assertEqual((status, events), (2, []))
        self.assertIn("job.json: options: epochs = 0, want >= 1", errors)
        self.write_job(1)
        (self.folder / "pair.safetensors").write_bytes(b"no tensors")
        status, _, errors = self.run_trainer(self.folder)
        self.assertEqual(status, 2)
        self.assertIn("pair.safetensors", errors)

    def test_without_a_folder_it_says_how_it_is_called(self):
        for words in [], ["--help"], ["a", "b"]:
            status, _, errors = self.run_trainer(*words)
            self.assertEqual(status, 2)
            self.assertIn("usage: shaped-trainer [--parent PID] FOLDER", errors)

    def test_divergence_is_an_error(self):
        self.write_job(5, learning_rate=1e20, last_learning_rate=1e20, warm_up=0)
        status, events, errors = self.run_trainer(self.folder)
        self.assertEqual((status, events[-1]["event"]), (1, "diverged"))
        self.assertIn("learning_rate", errors)


if __name__ == "__main__":
    unittest.main()
