"""A body model that grows by raw scans, as users meet it: a daemon, shapectl bootstrap, and shaped-trainer where it is
built. Two rounds on a coarse creature; what the field learns in two epochs is not judged here."""

import json
import os
import pathlib
import shutil
import signal
import subprocess
import tempfile
import time
import unittest

import numpy

from support import BAD_INPUT, BINARIES, CANCELLED, NOT_CONVERGED, NOT_FOUND, SUCCESS, Daemon, DaemonCase, skip_loudly, write_tubes

TRAINER = BINARIES / "shaped-trainer"
REGISTERED, SCANNED = 7, 3


def tiny(*words):
    """Options under which a bootstrap takes seconds, but for those that are given."""
    small = {"--modes": 3, "--epochs": 2, "--least-joined": 1, "--posture": "none"}
    return [word for option, value in small.items() if option not in words for word in (option, value)] + list(words)


def trainers_of(daemon):
    """Process ids of shaped-trainer that this daemon started; after its death, of none."""
    found = []
    for folder in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            words = (folder / "cmdline").read_bytes().split(b"\0")
        except OSError:
            continue
        if words[0].endswith(b"shaped-trainer") and str(daemon).encode() in words:
            found.append(int(folder.name))
    return found


class Creatures:
    """Meshes and scans that all tests share, made once."""

    folder = None

    @classmethod
    def make(cls):
        if cls.folder:
            return
        keep = tempfile.TemporaryDirectory()
        unittest.addModuleCleanup(keep.cleanup)
        folder = pathlib.Path(keep.name)
        run = lambda *words: subprocess.run([BINARIES / "shapectl", *map(str, words)], check=True, stdout=subprocess.DEVNULL)
        run("sample", folder / "sample", "--poses", 1, "--frames", 1, "--bodies", REGISTERED + SCANNED, "--vertices", 600)
        bodies = numpy.load(folder / "sample/bodies.npy")
        numpy.save(folder / "registered.npy", bodies[:REGISTERED])
        numpy.save(folder / "two.npy", bodies[:2])
        (folder / "scans").mkdir()
        (folder / "field_scans").mkdir()
        for i in range(REGISTERED - 3, REGISTERED):
            run("sample-scan", folder / f"sample/bodies/body_{i:03}.ply", "-o", folder / f"field_scans/{i}.ply",
                "--points", 1500, "--noise", 1, "--still")
        for i in range(REGISTERED, REGISTERED + SCANNED):
            run("sample-scan", folder / f"sample/bodies/body_{i:03}.ply", "-o", folder / f"scans/body_{i:03}.ply",
                "--points", 1500, "--noise", 1, "--seed", i)
        cls.folder = folder

    @classmethod
    def shapes(cls):
        return ("--template", cls.folder / "sample/template.ply", "--frames", cls.folder / "registered.npy",
                "--rig", cls.folder / "sample/rig.json")


class Bootstrap(DaemonCase):
    """What can be told without training anything, and with a trainer where it is built."""

    @classmethod
    def setUpClass(cls):
        Creatures.make()
        super().setUpClass()
        tubes = cls.shapectl("train", "shell-pga", "tubes", *write_tubes(cls.folder), "--modes", 2, "--coarse-vertices", 60)
        if tubes.code != SUCCESS:
            raise RuntimeError(tubes.err)

    def bootstrap(self, *words, scans=None, shapes=None):
        shapes = Creatures.shapes() if shapes is None else shapes
        return ("bootstrap", "grown", "--scans", scans or Creatures.folder / "scans", *shapes, *tiny(*words))

    def folder_of(self, name, files):
        folder = self.folder / name
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        for file, content in files.items():
            (folder / file).write_text(content)
        return folder

    def test_folders_of_scans_are_refused_by_what_is_wrong(self):
        self.refused("--scans: ", *self.bootstrap(scans=self.folder / "nowhere"))
        self.refused("holds no scans", *self.bootstrap(scans=self.folder_of("none", {"notes.txt": "x"})))
        self.refused("broken.ply", *self.bootstrap(scans=self.folder_of("broken", {"broken.ply": "ply\n"})))
        few = self.folder_of("few", {"few.xyz": "".join(f"{i} 0 0\n" for i in range(50))})
        self.refused("scans[0] (few.xyz): has 50 points, want at least 100", *self.bootstrap(scans=few))
        unknown = self.folder_of("nan", {"nan.xyz": "nan 0 0\n" * 200})
        self.refused("nan.xyz", *self.bootstrap(scans=unknown))
        self.refused("--unit: ", *self.bootstrap("--unit", "parsec"))
        self.assertEqual([d for d in self.expect(SUCCESS, "datasets").json["datasets"] if d["kind"] == "scans"], [])

    def test_options_are_refused_by_name(self):
        self.refused("bootstrap: rounds = 0, want >= 1", *self.bootstrap("--rounds", 0))
        self.refused("--rounds: ", *self.bootstrap("--rounds", -1))
        self.refused("bootstrap: acceptance = -1", *self.bootstrap("--acceptance", -1))
        self.refused("bootstrap.field: learning_rate = 2", *self.bootstrap("--learning-rate", 2))
        self.refused("--posture: is \"upright\"", *self.bootstrap("--posture", "upright"))
        self.refused("bootstrap.field_registrations: = 6, want at most 5 of the dataset's 7", *self.bootstrap("--field-registrations", 6))
        self.refused("holds 3 scans, want one for each of the 2 registrations that train the field",
                     *self.bootstrap("--field-registrations", 2, "--field-scans", Creatures.folder / "field_scans"))
        two = ("--template", Creatures.folder / "sample/template.ply", "--frames", Creatures.folder / "two.npy")
        self.refused("holds 2 registrations; a bootstrap needs at least three", *self.bootstrap(shapes=two))
        self.refused("goes without --detach", *self.bootstrap("--detach", "--log", self.folder / "log"))

    def test_a_model_that_gives_no_registrations_says_which_are_missing(self):
        for name in ("nobody", "tubes"):
            words = ("bootstrap", name, "--scans", Creatures.folder / "scans")
            self.refused("name its registrations with --template and --frames, or as MESH files, and its rig with --rig", *words)
        self.refused("--rig: goes with --template", "bootstrap", "nobody", "--scans", Creatures.folder / "scans",
                     "--rig", Creatures.folder / "sample/rig.json")

    def test_datasets_are_listed_and_deleted(self):
        self.refused("rounds = 0", *self.bootstrap("--rounds", 0))  # what was uploaded stays
        listed = {d["kind"]: d for d in self.expect(SUCCESS, "datasets").json["datasets"]}
        self.assertEqual(listed["scans"]["frames"], SCANNED)
        self.expect(SUCCESS, "delete-dataset", listed["scans"]["name"])
        self.expect(NOT_FOUND, "delete-dataset", listed["scans"]["name"])


class WithoutTrainer(DaemonCase):
    daemon_options = ("--trainer", "/no/such/shaped-trainer")

    def test_a_missing_trainer_is_said_when_the_job_is_submitted(self):
        Creatures.make()
        result = self.shapectl("bootstrap", "grown", "--scans", Creatures.folder / "scans", *Creatures.shapes(), *tiny())
        self.assertEqual(result.code, BAD_INPUT, result.err)
        self.assertEqual(result.json["error"]["reason"], "WRONG_STATE")
        self.assertIn("there is no program /no/such/shaped-trainer", result.message())
        self.assertIn("--trainer", result.message())
        self.assertEqual(self.expect(SUCCESS, "jobs").json["jobs"], [])


class Grown(DaemonCase):
    """With the trainer: one daemon, a model that has grown in two rounds."""

    @classmethod
    def setUpClass(cls):
        if not TRAINER.exists():
            skip_loudly("shaped-trainer is not built here (libtorch-dev is missing)")
        Creatures.make()
        super().setUpClass()
        cls.log = cls.folder / "log.jsonl"
        result = cls.shapectl("bootstrap", "grown", "--scans", Creatures.folder / "scans", *Creatures.shapes(),
                              *tiny("--rounds", 2, "--log", cls.log))
        if result.code != SUCCESS:
            raise RuntimeError(result.out + result.err + cls.daemon.log)
        cls.job = result.json

    def test_the_job_says_where_the_scans_went(self):
        self.assertEqual((self.job["kind"], self.job["state"], self.job["model"]), ("bootstrap", "succeeded", {"name": "grown", "version": 1}))
        self.assertIn(self.job["end"], ("rounds_done", "few_joined", "none_left"))
        first = self.job["rounds"][0]
        self.assertEqual((first["registrations"], first["field_registrations"], first["tried"]), (4, 3, SCANNED))
        self.assertGreaterEqual(first["joined"], 1)  # the nearest always does
        self.assertLessEqual(first["smallest"], first["accepted_below"])
        self.assertEqual([scan["name"] for scan in self.job["scans"]], [f"body_{i:03}.ply" for i in range(REGISTERED, REGISTERED + SCANNED)])
        for scan in self.job["scans"]:
            self.assertGreater(scan["score"], 0.3)
            self.assertLess(scan["chamfer"], 0.1)
            self.assertEqual(scan["why"] == "", scan["verdict"] == "joined")
        joined = sum(round["joined"] for round in self.job["rounds"])
        self.assertEqual(sum(scan["verdict"] == "joined" for scan in self.job["scans"]), joined)
        self.assertEqual(self.expect(SUCCESS, "result", self.job["id"]).json, {key: self.job[key] for key in ("rounds", "scans", "end")})

    def test_scans_were_told_as_they_came(self):
        told = [json.loads(line) for line in self.log.read_text().splitlines()]
        pending = [scan for scan in told if scan["verdict"] == "pending"]
        tried = sum(round["tried"] for round in self.job["rounds"])
        unusable = [scan for scan in told if scan["verdict"] == "unusable"]
        self.assertEqual(len(pending) + len(unusable), tried)
        self.assertEqual(len(told), 2 * tried)
        self.assertEqual(told[0]["round"], 1)

    def test_the_model_has_a_field_and_says_how_it_grew(self):
        body = self.expect(SUCCESS, "describe", "grown@1").json["body"]
        self.assertTrue(body["field"])
        self.assertEqual(body["joined"], [round["joined"] for round in self.job["rounds"]])
        self.assertEqual(body["training_shapes"], 4 + sum(body["joined"]))

    def registered(self, *words):
        """Whether the fit of three modes quite converges is not the matter here."""
        result = self.shapectl("register", "grown@1", *words)
        self.assertIn(result.code, (SUCCESS, NOT_CONVERGED), result.out + result.err)
        return result.json

    def test_registrations_use_the_field_unless_asked_not_to(self):
        scan = Creatures.folder / "scans/body_007.ply"
        with_field, without = self.folder / "with.ply", self.folder / "without.ply"
        document = self.registered(scan, "-o", with_field)
        plain = self.registered(scan, "-o", without, "--without-field")
        self.assertNotIn("field_report", plain)
        self.assertIn("chamfer", document["field_report"])
        self.assertEqual(document["coefficients"], plain["coefficients"])
        self.assertNotEqual(with_field.read_bytes(), without.read_bytes())
        sequence = self.registered(scan, scan)["scans"]
        self.assertTrue(all("field_report" in one for one in sequence))
        sequence = self.registered(scan, scan, "--without-field")["scans"]
        self.assertFalse(any("field_report" in one for one in sequence))

    def test_a_model_grows_again_by_its_own_registrations_and_rig(self):
        job = self.expect(SUCCESS, "bootstrap", "grown", "--scans", Creatures.folder / "scans", "--rounds", 1, "--modes", 3,
                          "--epochs", 1, "--field-registrations", 3, "--field-scans", Creatures.folder / "field_scans").json
        self.assertEqual(job["model"], {"name": "grown", "version": 2})
        self.assertEqual(job["dataset"], self.job["dataset"])
        self.assertEqual(job["rounds"][0]["registrations"], 4)
        self.assertEqual(job["end"], "few_joined")  # 3 scans at most, and ten are wanted for another round

    def test_a_job_leaves_nothing_but_its_result(self):
        kept = lambda: {path.name for path in (self.folder / "store/jobs").glob("*/*")}
        begin = time.monotonic()
        while kept() != {"result"} and time.monotonic() - begin < 20:
            time.sleep(0.1)  # the rest goes after the record is written
        self.assertEqual(kept(), {"result"})
        self.assertEqual(trainers_of(self.daemon.process.pid), [])


class Interrupted(unittest.TestCase):
    """Stops of every kind, with the trainer."""

    def setUp(self):
        if not TRAINER.exists():
            skip_loudly("shaped-trainer is not built here (libtorch-dev is missing)")
        Creatures.make()
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.store = pathlib.Path(folder.name) / "store"
        self.daemon = None
        self.start()
        self.addCleanup(lambda: self.daemon.stop(signal.SIGKILL))

    def start(self):
        self.daemon = DaemonCase.daemon = Daemon(self.store, "--checkpoint-every", "0")

    def begin(self, name, *words):
        result = DaemonCase.shapectl("bootstrap", name, "--scans", Creatures.folder / "scans", *Creatures.shapes(),
                                     *tiny("--rounds", 1, "--detach", *words))
        self.assertEqual(result.code, SUCCESS, result.err + result.out)
        return result.json["id"]

    def job(self, id):
        return next(job for job in DaemonCase.shapectl("jobs").json["jobs"] if job["id"] == id)

    def wait_for(self, id, reached, timeout=900):  # jobs give way to all else on the machine
        until = time.monotonic() + timeout
        while time.monotonic() < until:
            job = self.job(id)
            if reached(job):
                return job
            self.assertIn(job["state"], ("queued", "running"), job)
            time.sleep(0.02)
        self.fail(f"not reached: {job}, {self.daemon.log}")

    def tensors(self, name):
        return (self.store / "models" / name / "1/tensors.safetensors").read_bytes()

    def ended(self, job):
        return job["state"] == "succeeded"

    def gone(self, parent):
        """Trainers end with the daemon, soon."""
        until = time.monotonic() + 30
        while trainers_of(parent) and time.monotonic() < until:
            time.sleep(0.05)
        return trainers_of(parent) == []

    def test_killed_daemons_go_on_and_end_with_the_same_bits(self):
        self.wait_for(self.begin("whole"), self.ended)
        id = self.begin("killed")
        for fraction in (0.05, 0.15, 0.33):  # at about a fit of the field's scans, its training, the first scan
            self.wait_for(id, lambda job: job["fraction"] >= fraction)
            parent = self.daemon.process.pid
            self.daemon.stop(signal.SIGKILL)
            self.assertTrue(self.gone(parent), "a trainer outlived its daemon")
            self.start()
        job = self.wait_for(id, self.ended)
        self.assertEqual(job["attempts"], 4)
        self.assertTrue(job["resumed_from"])
        self.assertEqual(self.tensors("killed"), self.tensors("whole"))

    def test_datasets_may_go_and_the_daemon_may_stop_while_a_job_runs(self):
        id = self.begin("grown", "--epochs", 2000)
        self.wait_for(id, lambda job: "epoch 1 of" in job["stage"])
        for dataset in DaemonCase.shapectl("datasets").json["datasets"]:
            self.assertEqual(DaemonCase.shapectl("delete-dataset", dataset["name"]).code, SUCCESS)
        begin = time.monotonic()
        self.assertEqual(self.daemon.stop()[0], 0)
        self.assertLess(time.monotonic() - begin, 20)
        self.start()
        self.wait_for(id, lambda job: job["attempts"] == 2 and "epoch" in job["stage"] and "epoch 0 " not in job["stage"])
        checkpoint = list(self.store.glob("jobs/*/field-1/checkpoint.safetensors"))
        self.assertEqual(len(checkpoint), 1)
        begin = time.monotonic()
        self.assertEqual(DaemonCase.shapectl("cancel", id).code, SUCCESS)
        job = self.job(id)
        while job["state"] == "running" and time.monotonic() - begin < 20:
            job = self.job(id)
        self.assertEqual(job["state"], "cancelled")
        while list(self.store.glob("jobs/*")) and time.monotonic() - begin < 20:
            time.sleep(0.1)  # the folder goes after the record is written
        self.assertEqual(list(self.store.glob("jobs/*")), [])
        self.assertEqual(trainers_of(self.daemon.process.pid), [])

    def test_ctrl_c_of_who_follows_cancels(self):
        client = subprocess.Popen(DaemonCase.command("bootstrap", "grown", "--scans", Creatures.folder / "scans",
                                                     *Creatures.shapes(), *tiny("--epochs", 2000)),
                                  stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(client.kill)
        until = time.monotonic() + 60
        while not DaemonCase.shapectl("jobs").json["jobs"] and time.monotonic() < until:
            time.sleep(0.05)
        client.send_signal(signal.SIGINT)
        out, err = client.communicate(timeout=60)
        self.assertEqual(client.returncode, CANCELLED, out + err)
        self.assertEqual(json.loads(out)["state"], "cancelled")


if __name__ == "__main__":
    unittest.main()
