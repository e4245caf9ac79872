"""The time of day jumps, forward and back, under a daemon that runs and between two that take turns on a store.

Debian's libfaketime (package faketime) gives the daemon its own time of day, read from a file whenever it asks. The clock that
counts from the machine's start is left alone, as it is when an operator or NTP sets the time."""

import importlib
import os
import pathlib
import tempfile
import time
import unittest

import grpc

import messages  # makes the modules of all messages
from scrape import scrape
from support import NOT_CONVERGED, SUCCESS, Daemon, DaemonCase, skip_loudly, tube, write_mesh, write_tubes

models_pb2 = importlib.import_module("shaped.v1.models_pb2")
LIBRARY = next(pathlib.Path("/usr/lib").glob("*/faketime/libfaketimeMT.so.1"), None)
WAIT = "Models.WaitUntilReady"
PATIENCE = 60  # [s] for what takes milliseconds on a machine with nothing else to do


class ClockCase(DaemonCase):
    @classmethod
    def setUpClass(cls):
        if LIBRARY is None:
            skip_loudly("the package faketime is not installed: no clock jumps")

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.meshes = write_tubes(self.folder)
        self.addCleanup(lambda: self.daemon.stop())

    def set_clock(self, offset):
        """"+90d": that much later than it is. The file appears whole, since the daemon may read it at any moment."""
        new = self.folder / "clock.new"
        new.write_text(offset)
        new.rename(self.folder / "clock")

    def start(self, offset, *options):
        self.set_clock(offset)
        # A build with the address sanitizer wants to be the first library; it works behind this one too.
        sanitizer = f"ASAN_OPTIONS={os.environ.get('ASAN_OPTIONS', '')}:verify_asan_link_order=0"
        clock = ("env", f"LD_PRELOAD={LIBRARY}", f"FAKETIME_TIMESTAMP_FILE={self.folder / 'clock'}", "FAKETIME_NO_CACHE=1",
                 "FAKETIME_DONT_FAKE_MONOTONIC=1", sanitizer)
        type(self).daemon = Daemon(self.folder / "store", "--metrics", "127.0.0.1:0", *options, before=clock)

    def restart(self, offset, *options):
        self.assertEqual(self.daemon.stop()[0], 0)
        self.start(offset, *options)

    def train(self, name, *words, coarse=60):
        return self.expect(SUCCESS, "train", "shell-pga", name, *self.meshes, "--coarse-vertices", coarse, *words).json

    def jobs(self):
        return [(job["model_name"], job["state"]) for job in self.expect(SUCCESS, "jobs").json["jobs"]]

    def year(self):
        """As the daemon has it: of its latest job."""
        return int(self.expect(SUCCESS, "jobs").json["jobs"][-1]["created"][:4])

    def wait(self, question, what):
        until = time.monotonic() + PATIENCE
        while not question():
            self.assertLess(time.monotonic(), until, what + ": " + self.daemon.log[-2000:])
            time.sleep(0.02)


class Jobs(ClockCase):
    def test_jobs_that_run_while_it_jumps_finish_and_are_remembered(self):
        self.meshes = [write_mesh(self.folder / f"big{i}.obj", *tube(-1.2 + 0.3 * i, 0.3 + 0.02 * (i * i % 5), 40, 14))
                       for i in range(9)]
        self.start("+0", "--keep-jobs-days", "0", "--checkpoint-every", "0")
        for name, offset in (("ahead", "+1000d"), ("back", "-1000d")):
            job = self.train(name, "--detach", coarse=300)["id"]  # some seconds
            self.wait(lambda: self.expect(SUCCESS, "jobs").json["jobs"][-1]["state"] != "queued", "the job runs")
            self.set_clock(offset)
            ended = self.expect(SUCCESS, "watch", job).json
            self.assertEqual(ended["state"], "succeeded")
            self.assertGreater(abs(int(ended["ended"][:4]) - int(ended["created"][:4])), 1, "it jumped while the job ran")
        both = [("ahead", "succeeded"), ("back", "succeeded")]
        self.assertEqual(self.jobs(), both)
        for offset in ("-2000d", "+2000d", "+0"):
            self.restart(offset, "--keep-jobs-days", "0")
            self.assertEqual(self.jobs(), both)
            for name, _ in both:
                self.expect(SUCCESS, "describe", name)

    def test_between_starts_ages_follow_it_and_nothing_else_does(self):
        self.start("+0")
        self.train("now")
        year = self.year()
        self.restart("-4000d")
        self.assertEqual(self.jobs(), [("now", "succeeded")])
        self.train("earlier")
        self.assertLess(self.year(), year - 9)
        self.assertEqual([job for job, _ in self.jobs()], ["now", "earlier"])  # in the order in which they came
        # Back in the present "earlier" is ten years old, in a hundred days "now" is too old as well.
        for offset, kept in (("+0", ["now"]), ("+100d", [])):
            self.restart(offset)
            self.assertEqual([job for job, _ in self.jobs()], kept)
        for name in ("now", "earlier"):
            self.assertIn(self.shapectl("score", name, self.meshes[1]).code, (SUCCESS, NOT_CONVERGED))
        self.train("later")
        self.assertEqual(self.jobs(), [("later", "succeeded")])


class Calls(ClockCase):
    """Calls that wait for a model which is not there."""

    def wait_for_model(self, channel, name="tubes", timeout=None):
        before = self.in_flight()
        call = channel.unary_unary("/shaped.v1.Models/WaitUntilReady", models_pb2.WaitUntilReadyRequest.SerializeToString,
                                   models_pb2.WaitUntilReadyResponse.FromString)
        waiting = call.future(models_pb2.WaitUntilReadyRequest(model={"name": name}), timeout=timeout)
        self.wait(lambda: self.in_flight() == before + 1, "it waits")
        return waiting

    def in_flight(self):
        return scrape(self.daemon).value("shaped_requests_in_flight", method=WAIT)

    def late(self):
        return scrape(self.daemon).value("shaped_requests_total", method=WAIT, code="DEADLINE_EXCEEDED")

    def assertLate(self, waiting):
        self.assertEqual(waiting.exception(PATIENCE).code(), grpc.StatusCode.DEADLINE_EXCEEDED)
        self.wait(lambda: self.late() == 1, "the daemon calls it a deadline, too")
        self.assertEqual(self.in_flight(), 0)

    def test_set_back_a_clients_deadline_passes_as_before(self):
        self.start("+0")
        with grpc.insecure_channel(self.daemon.address) as channel:
            waiting = self.wait_for_model(channel, timeout=5)
            self.set_clock("-1h")
            self.assertLate(waiting)

    def test_set_back_the_cap_ends_a_call_as_before(self):
        self.start("+0", "--longest-call", "5")
        with grpc.insecure_channel(self.daemon.address) as channel:
            waiting = self.wait_for_model(channel)
            self.set_clock("-1h")
            self.assertLate(waiting)

    def test_set_ahead_no_call_ends(self):
        self.start("+0")
        with grpc.insecure_channel(self.daemon.address) as channel:
            waiting = self.wait_for_model(channel, timeout=300)
            short = self.wait_for_model(channel, "other", timeout=3)
            self.set_clock("+10h")
            # When this one's time is up the daemon looks at the others' as well.
            self.assertEqual(short.exception(PATIENCE).code(), grpc.StatusCode.DEADLINE_EXCEEDED)
            self.wait(lambda: self.in_flight() <= 1, "the short one has ended")
            time.sleep(1)
            self.assertEqual(self.in_flight(), 1)
            self.train("tubes")
            self.assertEqual(waiting.result(PATIENCE).model.name, "tubes")


if __name__ == "__main__":
    unittest.main()
