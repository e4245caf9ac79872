"""Models that are brought into memory at the start, and those that another process puts into the store."""

import json
import pathlib
import shutil
import tempfile
import time
import unittest

import grpc

from support import SUCCESS, Daemon, DaemonCase, many_modes, write_mesh, write_tubes, tube

SERVING, NOT_SERVING = b"\x08\x01", b"\x08\x02"  # HealthCheckResponse {status: 1 or 2}


class Stored(unittest.TestCase):
    """A store with the model "tubes", trained once, of which each test has a copy."""

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.trained = pathlib.Path(folder.name)
        DaemonCase.daemon = Daemon(cls.trained / "store")
        try:
            result = DaemonCase.shapectl("train", "shell-pga", "tubes", *write_tubes(cls.trained), "--modes", 3,
                                         "--coarse-vertices", 60)
        finally:
            DaemonCase.daemon.stop()
        if result.code != SUCCESS:
            raise RuntimeError(result.out + result.err)
        cls.unseen = write_mesh(cls.trained / "unseen.obj", *tube(0.77, radius=0.33))

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.store = self.folder / "store"
        shutil.copytree(self.trained / "store", self.store)
        self.models = self.store / "models"

    def start(self, *options):
        DaemonCase.daemon = daemon = Daemon(self.store, *options)
        self.addCleanup(daemon.stop)
        return daemon

    def health(self):
        with grpc.insecure_channel(DaemonCase.daemon.address) as channel:
            return channel.unary_unary("/grpc.health.v1.Health/Check")(b"", timeout=10)

    def wait_until_serving(self):
        until = time.monotonic() + 60
        while self.health() != SERVING and time.monotonic() < until:
            time.sleep(0.02)
        self.assertEqual(self.health(), SERVING)

    def states(self):
        return {(model["model"]["name"], model["model"]["version"]): model["state"]
                for model in DaemonCase.shapectl("models").json["models"]}

    def score(self, model):
        result = DaemonCase.shapectl("score", model, self.unseen)
        self.assertEqual(result.code, SUCCESS, result.out + result.err)
        return result.json["model"]["version"]

    def publish(self, version, name="tubes", spoil=False, source=None):
        """As another process would: whole in a hidden folder first, then renamed."""
        hidden = self.models / f".{name}-{version}"
        shutil.copytree(source or self.trained / "store/models/tubes/1", hidden)
        if spoil:
            with open(hidden / "tensors.safetensors", "r+b") as file:
                file.seek(-1, 2)
                file.write(b"x")
        (self.models / name).mkdir(exist_ok=True)
        hidden.rename(self.models / name / str(version))


class Preload(Stored):
    def test_health_waits_for_the_models_and_other_calls_do_not(self):
        many_modes(self.models / "tubes/1", self.models / "slow/1", 4000)
        for _ in range(5):  # once the daemon must be seen while it loads
            self.start("--preload", "slow,tubes@1")
            first = self.health()
            states = self.states()
            self.wait_until_serving()
            self.assertEqual(self.states(), {("slow", 1): "ready", ("tubes", 1): "ready"})
            _, log = DaemonCase.daemon.stop()
            self.assertIn("preload: 2 of 2 models are in memory", log)
            if first == NOT_SERVING and states[("slow", 1)] != "ready":
                return
        self.fail("the daemon was never seen while it loaded")

    def test_all_and_one_of_them_is_broken(self):
        self.publish(1, "broken", spoil=True)
        daemon = self.start("--preload", "all")
        self.wait_until_serving()
        self.assertEqual(self.states(), {("broken", 1): "failed", ("tubes", 1): "ready"})
        self.assertIn("broken@", daemon.wait_for("preload: broken is not in memory") + "broken@")
        self.assertIn("SHA-256", daemon.wait_for("preload: broken is not in memory"))
        daemon.wait_for("preload: 1 of 2 models are in memory")
        self.assertEqual(self.score("tubes"), 1)

    def test_a_model_that_is_not_there(self):
        daemon = self.start("--preload", "nobody,tubes@canary,tubes")
        self.wait_until_serving()
        daemon.wait_for('preload: nobody is not in memory: model: there is no model')
        daemon.wait_for("preload: tubes@canary is not in memory")
        daemon.wait_for("preload: 1 of 3 models are in memory")

    def test_a_list_that_is_none(self):
        for text in ("a,,b", "a,", "../a", "a@0", "a@"):
            with self.assertRaisesRegex(RuntimeError, "ended with 2: shaped: --preload"):
                Daemon(self.store, "--preload", text)

    def test_it_stops_while_it_loads(self):
        many_modes(self.models / "tubes/1", self.models / "slow/1", 4000)
        code, log = self.start("--preload", "all").stop()
        self.assertEqual(code, 0, log)


class Watched(Stored):
    def start_watching(self):
        daemon = self.start("--model-policy", "watch", "--preload", "all")
        self.wait_until_serving()
        return daemon

    def test_a_version_that_appears_is_served(self):
        daemon = self.start_watching()
        self.assertEqual(self.score("tubes"), 1)
        self.publish(2)
        daemon.wait_for("model watch: tubes@2 is in memory")
        self.assertEqual(self.states(), {("tubes", 1): "stored", ("tubes", 2): "ready"})
        self.assertEqual(self.score("tubes"), 2)
        self.publish(1, "new")
        daemon.wait_for("model watch: new@1 is in memory")
        self.assertEqual(self.score("new"), 1)

    def test_a_whole_model_that_is_renamed_into_place(self):
        daemon = self.start_watching()
        shutil.copytree(self.models / "tubes", self.models / ".whole")
        (self.models / ".whole").rename(self.models / "whole")
        daemon.wait_for("model watch: whole@1 is in memory")
        self.publish(2, "whole")
        daemon.wait_for("model watch: whole@2 is in memory")

    def test_what_is_half_written_is_not_looked_at(self):
        daemon = self.start_watching()
        source, target = self.models / "tubes/1", self.models / "tubes/9"
        target.mkdir()
        shutil.copy(source / "manifest.json", target)
        (target / "tensors.safetensors").write_bytes((source / "tensors.safetensors").read_bytes()[:-8])
        self.publish(1, "marker")  # events come in order: what was to be seen of tubes@9 has been seen then
        daemon.wait_for("model watch: marker@1 is in memory")
        self.assertEqual(self.states()[("tubes", 9)], "stored")
        self.publish(3)  # which makes it look at the folder of tubes@9
        daemon.wait_for("model watch: tubes@3 is in memory")
        self.assertEqual(self.states()[("tubes", 9)], "stored")
        self.assertNotIn("tubes@9", daemon.log)
        self.assertEqual(self.score("tubes"), 3)

    def test_a_broken_version_leaves_the_one_before(self):
        daemon = self.start_watching()
        self.publish(2, spoil=True)
        self.assertIn("SHA-256", daemon.wait_for("model watch: tubes@2 is not served"))
        self.assertEqual(self.score("tubes"), 1)
        self.publish(3)
        daemon.wait_for("model watch: tubes@3 is in memory")
        self.assertEqual(self.score("tubes"), 3)
        self.assertEqual(daemon.log.count("tubes@2 has appeared"), 1)

    def test_a_version_that_is_removed(self):
        daemon = self.start_watching()
        self.publish(2)
        daemon.wait_for("model watch: tubes@2 is in memory")
        (self.models / "tubes/2").rename(self.folder / "away")
        daemon.wait_for("model watch: tubes@2 has gone from the store")
        self.assertEqual(self.score("tubes"), 1)
        shutil.rmtree(self.models / "tubes")
        daemon.wait_for("model watch: tubes@1 has gone from the store")
        self.assertEqual(self.states(), {})
        self.assertEqual(DaemonCase.shapectl("score", "tubes", self.unseen).json["error"]["reason"], "MODEL_NOT_FOUND")

    def test_its_own_versions_are_not_loaded_twice(self):
        daemon = self.start_watching()
        DaemonCase.shapectl("upload", "tubes", self.models / "tubes/1")
        self.publish(1, "marker")
        daemon.wait_for("model watch: marker@1 is in memory")
        self.assertEqual(self.score("tubes"), 2)
        self.assertNotIn("tubes@2 has appeared", daemon.log)

    def test_without_the_policy_nobody_looks(self):
        self.start()
        self.publish(2)
        self.assertEqual(self.score("tubes"), 1)


if __name__ == "__main__":
    unittest.main()
