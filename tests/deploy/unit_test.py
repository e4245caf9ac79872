"""deploy/systemd/shaped.service: what systemd itself says of it, and what the daemon does under its protocol and restrictions."""

import os
import pathlib
import re
import signal
import socket
import tempfile
import unittest
import urllib.request

import yaml

from support import BINARIES, NOT_CONVERGED, SUCCESS, Daemon, write_tubes
from system import SOURCE, needs, run

UNIT = SOURCE / "deploy/systemd/shaped.service"
# Of 100; systemd calls up to 20 "OK", and a service without any sandboxing 96.
MOST_EXPOSED = 20


def settings(name):
    return re.findall(rf"^{name}=(.*)$", UNIT.read_text(), re.M)


class Unit(unittest.TestCase):
    def installed(self):
        """A folder that looks to systemd like a system with the package."""
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        unit = pathlib.Path(folder.name) / "shaped.service"
        unit.write_text(UNIT.read_text().replace("/usr/bin/shaped", str(BINARIES / "shaped")))
        return unit

    def test_systemd_takes_it(self):
        needs("systemd-analyze")
        done = run("systemd-analyze", "verify", "--man=no", self.installed(), check=False)
        self.assertEqual((done.returncode, [line for line in done.stdout.splitlines() if "shaped.service" in line]), (0, []), done.stdout)

    def test_a_mistake_would_be_seen(self):
        needs("systemd-analyze")
        unit = self.installed()
        unit.write_text(unit.read_text().replace("ProtectSystem=strict", "ProtectSystem=tight"))
        self.assertIn("Failed to parse protect system value", run("systemd-analyze", "verify", "--man=no", unit, check=False).stdout)

    def test_it_exposes_little(self):
        needs("systemd-analyze")
        done = run("systemd-analyze", "security", "--offline=true", f"--threshold={MOST_EXPOSED}", self.installed(), check=False)
        print("\n" + done.stdout.strip().splitlines()[-1], flush=True)
        self.assertEqual(done.returncode, 0, done.stdout)

    def test_the_time_to_stop_is_enough(self):
        config = yaml.safe_load((SOURCE / "deploy/shaped.yaml").read_text())
        (limit,) = settings("TimeoutStopSec")
        self.assertGreater(int(limit), 2 * (config["drain"] + config["grace"]))

    def test_its_reload_refuses_a_faulty_file(self):
        check = settings("ExecReload")[0].split()
        with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file:
            check = [str(BINARIES / "shaped") if word == "/usr/bin/shaped" else word for word in check]
            check[check.index("/etc/shaped/shaped.yaml")] = file.name
            self.assertEqual(run(*check, check=False).returncode, 2)
            file.write("store: /tmp/none\n")
            file.flush()
            run(*check)


class Restrictions(unittest.TestCase):
    """Everything that a daemon calls while it trains, answers, reloads and stops is among what the unit leaves it."""

    @classmethod
    def setUpClass(cls):
        needs("strace", "systemd-analyze")
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        cls.calls = cls.trace()

    @classmethod
    def trace(cls):
        """Lines of strace, of every thread."""
        log = cls.folder / "calls"
        config = cls.folder / "shaped.yaml"
        config.write_text("metrics: 127.0.0.1:0\n")
        daemon = Daemon(cls.folder / "store", "--config", config, before=["strace", "-f", "-qq", "-o", str(log)])
        traced = int(log.read_text().split(maxsplit=1)[0])
        try:
            def shapectl(*words):
                done = run(BINARIES / "shapectl", "--server", daemon.address, *words, check=False)
                if done.returncode not in (SUCCESS, NOT_CONVERGED):
                    raise AssertionError(done.stdout)

            meshes = write_tubes(cls.folder)
            shapectl("train", "shell-pga", "tubes", *meshes, "--coarse-vertices", 60)
            shapectl("project", "tubes", meshes[0])
            shapectl("evaluate", "tubes", "--samples", 2)
            urllib.request.urlopen(daemon.metrics + "/metrics", timeout=60).close()
            os.kill(traced, signal.SIGHUP)
            daemon.wait_for("configuration read again")
            shapectl("delete", "tubes")
        finally:
            os.kill(traced, signal.SIGTERM)
            daemon.process.wait(timeout=120)
            daemon.stop()
        return log.read_text().splitlines()

    def test_the_calls_are_allowed(self):
        made = {match.group(1) for match in (re.match(r"\d+ +(\w+)\(", line) for line in self.calls) if match}
        self.assertIn("sendmsg", made)
        # The loader's and libc's own, which systemd lets through always.
        self.assertEqual(made - self.members("@system-service") - self.members("@default"), set())
        # SQLite gives its files an owner when it runs as root, as here perhaps and never under the unit.
        by_root = {"fchown"} if os.geteuid() == 0 else set()
        self.assertEqual(made & self.members("@privileged") - self.members("@default") - by_root, set())

    def members(self, group):
        """System calls of a group of systemd's, and of the groups in it."""
        found = set()
        for line in run("systemd-analyze", "syscall-filter", group).stdout.splitlines():
            word = line.strip()
            if word.startswith("@") and word != group:
                found |= self.members(word)
            elif line.startswith(" ") and word and not word.startswith("#"):
                found.add(word)
        return found

    def test_sockets_are_of_allowed_families(self):
        # One that another thread interrupted is "unfinished", and has its result elsewhere.
        families = {match.group(1) for match in (re.search(r" socket\((\w+),.*(= \d+|unfinished \.\.\.>)$", line)
                                                 for line in self.calls) if match}
        self.assertTrue(families)
        self.assertLessEqual(families, set(settings("RestrictAddressFamilies")[0].split()))

    def test_no_memory_is_both_written_and_executed(self):
        for line in self.calls:
            self.assertIsNone(re.search(r"PROT_WRITE\|PROT_EXEC|mprotect\(.*PROT_EXEC", line), line)


class Notices(unittest.TestCase):
    """Type=notify: the supervisor hears when the daemon serves and when it begins to stop."""

    def listen(self, name):
        listener = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.addCleanup(listener.close)
        listener.bind(name.replace("@", "\0", 1) if name.startswith("@") else name)
        listener.settimeout(60)
        return listener

    def check(self, name):
        listener = self.listen(name)
        os.environ["NOTIFY_SOCKET"] = name
        self.addCleanup(os.environ.pop, "NOTIFY_SOCKET", None)
        with tempfile.TemporaryDirectory() as store:
            daemon = Daemon(store)
            try:
                self.assertEqual(listener.recv(100), b"READY=1")
                self.assertEqual(run(BINARIES / "shapectl", "--server", daemon.address, "health").returncode, SUCCESS)
            finally:
                self.assertEqual(daemon.stop()[0], 0)
            self.assertEqual(listener.recv(100), b"STOPPING=1")

    def test_by_a_path(self):
        with tempfile.TemporaryDirectory() as folder:
            self.check(f"{folder}/notify")

    def test_by_an_abstract_name(self):
        self.check(f"@shaped-test-{os.getpid()}")

    def test_without_anybody_who_listens(self):
        for name in ("", "/nowhere/notify", "x" * 200):
            os.environ["NOTIFY_SOCKET"] = name
            self.addCleanup(os.environ.pop, "NOTIFY_SOCKET", None)
            with tempfile.TemporaryDirectory() as store:
                self.assertEqual(Daemon(store).stop()[0], 0)


if __name__ == "__main__":
    unittest.main()
