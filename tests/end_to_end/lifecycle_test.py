"""Starting, reading the configuration again, and stopping."""

import pathlib
import platform
import re
import signal
import subprocess
import tempfile
import time
import unittest

import grpc

from support import BINARIES, Daemon

SERVING, NOT_SERVING = b"\x08\x01", b"\x08\x02"  # HealthCheckResponse {status: 1 or 2}


def health(address, wait=False):
    """What grpc.health.v1 answers, as bytes."""
    with grpc.insecure_channel(address) as channel:
        return channel.unary_unary("/grpc.health.v1.Health/Check")(b"", timeout=5, wait_for_ready=wait)


def probe(address):
    """What a container's health check gets: exit code and words of shapectl health."""
    done = subprocess.run([BINARIES / "shapectl", "--server", address, "health"], capture_output=True, text=True, timeout=30)
    return done.returncode, done.stdout


def run(*words):
    return subprocess.run([BINARIES / "shaped", *map(str, words)], capture_output=True, text=True, timeout=30)


class Lifecycle(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.config = self.folder / "shaped.yaml"

    def daemon(self, *options):
        daemon = Daemon(self.folder / "store", *options)
        self.addCleanup(daemon.stop, signal.SIGKILL)
        return daemon

    def test_check_tells_good_from_bad(self):
        self.config.write_text("threads: 3\n")
        good = run("--check", "--config", self.config, "--store", self.folder / "store")
        self.assertEqual((good.returncode, good.stderr), (0, ""))
        self.assertIn("threads: 3\n", good.stdout)
        self.assertFalse((self.folder / "store").exists(), "checking must leave no trace")
        self.config.write_text("store: x\nthreads: none\n")
        bad = run("--check", "--config", self.config)
        self.assertEqual((bad.returncode, bad.stdout), (2, ""))
        self.assertIn("shaped.yaml:2: threads: \"none\"", bad.stderr)

    @unittest.skipUnless(platform.machine() == "x86_64", "OpenBLAS has other names for kernels elsewhere")
    def test_it_runs_the_kernels_that_the_processor_deserves_unless_told(self):
        flags = pathlib.Path("/proc/cpuinfo").read_text()
        daemon = Daemon(self.folder / "store", before=("env", "-u", "OPENBLAS_CORETYPE"))
        self.addCleanup(daemon.stop, signal.SIGKILL)
        kernels = re.search(r"OpenBLAS for (\w+)", daemon.log).group(1)
        if " avx2 " in flags:
            self.assertNotIn(kernels, ("Prescott", "Nehalem", "Sandybridge"))
        told = Daemon(self.folder / "other", before=("env", "OPENBLAS_CORETYPE=Nehalem"))
        self.addCleanup(told.stop, signal.SIGKILL)
        self.assertIn("OpenBLAS for Nehalem", told.log)

    def test_sighup_takes_over_what_is_safe(self):
        self.config.write_text("queue-length: 9\nthreads: 1\n")
        daemon = self.daemon("--config", self.config)
        self.config.write_text("queue-length: 5\nthreads: 2\n")
        daemon.process.send_signal(signal.SIGHUP)
        daemon.wait_for("configuration read again")
        self.assertIn("queue-length is now 5\n", daemon.log)
        self.assertIn("threads is now 2 in the configuration: from the next start on", daemon.log)

    def test_a_faulty_configuration_changes_nothing(self):
        self.config.write_text("queue-length: 9\n")
        daemon = self.daemon("--config", self.config)
        self.config.write_text("queue-length: 0\n")
        daemon.process.send_signal(signal.SIGHUP)
        line = daemon.wait_for("not taken over")
        self.assertIn("shaped.yaml:1: queue-length: ", line)
        self.assertEqual(health(daemon.address), SERVING)

    def test_it_drains_before_it_stops(self):
        daemon = self.daemon("--drain", "1.5")
        self.assertEqual(health(daemon.address, wait=True), SERVING)
        begin = time.monotonic()
        daemon.process.send_signal(signal.SIGTERM)
        daemon.wait_for("stopping")
        time.sleep(0.2)
        self.assertEqual(health(daemon.address), NOT_SERVING)
        self.assertEqual(daemon.process.wait(timeout=20), 0)
        self.assertGreaterEqual(time.monotonic() - begin, 1.5)

    def test_a_second_signal_ends_the_drain(self):
        daemon = self.daemon("--drain", "600")
        self.assertEqual(probe(daemon.address), (0, "serving\n"))
        daemon.process.send_signal(signal.SIGTERM)
        daemon.wait_for("stopping")
        # The signal is logged just before health turns.
        until = time.monotonic() + 20
        while probe(daemon.address)[0] == 0 and time.monotonic() < until:
            time.sleep(0.1)
        self.assertEqual(probe(daemon.address), (4, "not serving: it is about to stop\n"))
        daemon.process.send_signal(signal.SIGINT)
        self.assertEqual(daemon.process.wait(timeout=20), 0)
        self.assertEqual(probe(daemon.address)[0], 4)


if __name__ == "__main__":
    unittest.main()
