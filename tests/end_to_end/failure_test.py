"""What goes wrong around the daemon: a full disk while publishing, Ctrl-C in training, damaged files."""

import resource
import signal
import subprocess
import time
import unittest

from support import (CANCELLED, INTERNAL, NOT_FOUND, SUCCESS, UNAVAILABLE, Daemon, DaemonCase, tube, write_mesh,
                     write_tubes)


def limit_files():
    """No file of the process may grow beyond this: the dataset and the job's record fit, a model does not."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (36864, 36864))


class FullDisk(unittest.TestCase):
    def test_a_full_disk_while_publishing(self):
        import pathlib
        import tempfile
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            DaemonCase.daemon = Daemon(folder / "store", "--publish-patience", "1", preexec=limit_files)
            try:
                case = DaemonCase()
                meshes = write_tubes(folder)
                result = case.expect(UNAVAILABLE, "train", "shell-pga", "tubes", *meshes, "--coarse-vertices", 60)
                self.assertIn("File too large", result.json["error"]["message"])
                self.assertEqual(case.shapectl("models").json, {"models": []})
                self.assertEqual(list((folder / "store/models").glob("tubes/*")), [])
            finally:
                DaemonCase.daemon.stop()


class Interrupted(DaemonCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.meshes = [write_mesh(cls.folder / f"big{i}.obj", *tube(-1.5 + 0.1 * i, 0.3 + 0.01 * (i % 7), 80, 30))
                      for i in range(30)]

    def start(self):
        process = subprocess.Popen(self.command("train", "shell-pga", "big", *self.meshes, "--coarse-vertices", 2000),
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.wait_for("running")
        return process

    def wait_for(self, state):
        until = time.monotonic() + 60
        while time.monotonic() < until:
            jobs = self.shapectl("jobs").json["jobs"]
            if jobs and jobs[-1]["state"] == state:
                return jobs[-1]
            time.sleep(0.05)
        self.fail("no job is " + state)

    def test_ctrl_c_in_the_middle_of_training(self):
        process = self.start()
        time.sleep(0.5)
        begin = time.monotonic()
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=30)
        self.assertEqual(process.returncode, CANCELLED, out + err)
        self.assertLess(time.monotonic() - begin, 5)
        self.assertEqual(self.wait_for("cancelled")["state"], "cancelled")
        self.assertEqual(self.shapectl("models").json, {"models": []})

    def test_another_terminal_cancels_a_job(self):
        process = self.start()
        job = self.wait_for("running")
        self.expect(SUCCESS, "cancel", job["id"])
        out, err = process.communicate(timeout=30)
        self.assertEqual(process.returncode, CANCELLED, out + err)

    def test_the_daemon_stops_in_the_middle_of_training(self):
        daemon = Daemon(self.folder / "stopped")
        process = subprocess.Popen([self.command()[0], "--server", daemon.address, "train", "shell-pga", "big",
                                    *map(str, self.meshes), "--coarse-vertices", "2000"],
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        time.sleep(2)
        begin = time.monotonic()
        code, log = daemon.stop()
        self.assertEqual(code, 0, log)
        self.assertLess(time.monotonic() - begin, 10)
        process.communicate(timeout=30)
        self.assertIn(process.returncode, (CANCELLED, UNAVAILABLE))


class Damaged(DaemonCase):
    def test_a_damaged_model_is_reported_and_the_rest_served(self):
        meshes = write_tubes(self.folder)
        for name in ("good", "bad"):
            self.expect(SUCCESS, "train", "shell-pga", name, *meshes[:3], "--coarse-vertices", 60)
        self.daemon.stop()
        tensors = next((self.folder / "store/models/bad").glob("*/tensors.safetensors"))
        content = bytearray(tensors.read_bytes())
        content[-1] ^= 1
        tensors.write_bytes(content)
        type(self).daemon = Daemon(self.folder / "store")
        self.addClassCleanup(self.daemon.stop)
        result = self.expect(INTERNAL, "describe", "bad")
        self.assertIn("bad", result.message())
        self.assertEqual(self.expect(SUCCESS, "describe", "good").code, SUCCESS)
        self.expect(SUCCESS, "delete", "bad")
        self.expect(NOT_FOUND, "describe", "bad")


if __name__ == "__main__":
    unittest.main()
