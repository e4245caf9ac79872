"""Body models as users meet them: train, describe, project, synthesize, score, fit markers, register scans."""

import json
import shutil
import subprocess
import unittest

import numpy

from support import NOT_CONVERGED, NOT_FOUND, SUCCESS, DaemonCase, read_obj, tube, write_mesh, write_tubes

SCANNED = ("--points", 4000, "--noise", 1, "--seed", 3)


def rms(one, other):
    return numpy.sqrt(((one - other) ** 2).sum(1).mean())


class Bodies(DaemonCase):
    """A daemon that serves "creatures", of kind body, and "tubes", of kind shell_pga."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.sample = cls.folder / "sample"
        cls.done("sample", cls.sample, "--poses", 3, "--bodies", 12, "--markers", "--frames", 6, "--vertices", 800)
        cls.training = cls.done("train", "body", "creatures", "--template", cls.sample / "template.ply",
                                "--frames", cls.sample / "bodies.npy", "--rig", cls.sample / "rig.json",
                                "--modes", 6, "--posture", "none")
        cls.tubes = write_tubes(cls.folder)
        cls.done("train", "shell-pga", "tubes", *cls.tubes, "--modes", 3, "--coarse-vertices", 60)
        cls.posed = cls.sample / "poses/pose_001.ply"
        cls.pose = numpy.load(cls.sample / "poses.npy")[1]
        cls.done("project", "creatures", cls.posed, "-o", cls.folder / "projected.obj")
        cls.faces = read_obj(cls.folder / "projected.obj")[1]

    @classmethod
    def done(cls, *words):
        result = cls.shapectl(*words)
        if result.code != SUCCESS:
            raise RuntimeError(result.out + result.err)
        return result.json

    def project(self, mesh, *options):
        out, weights = self.folder / "projected.obj", self.folder / "projected.json"
        document = self.expect(SUCCESS, "project", "creatures", mesh, "-o", out, "--coefficients", weights, *options).json
        return document, read_obj(out)[0], weights


class Body(Bodies):
    def test_the_training_is_a_job_of_its_own_kind(self):
        self.assertAnswer(self.training)
        self.assertEqual((self.training["termination"], self.training["model"]), ("converged", {"name": "creatures", "version": 1}))
        kinds = [job["kind"] for job in self.expect(SUCCESS, "jobs").json["jobs"]]
        self.assertIn("train_body", kinds)
        self.assertIn("train_shell_pga", kinds)

    def test_the_model_is_listed_and_described_with_its_kind(self):
        listed = {model["model"]["name"]: model for model in self.expect(SUCCESS, "models").json["models"]}
        self.assertEqual((listed["creatures"]["kind"], listed["tubes"]["kind"]), ("body", "shell_pga"))
        self.assertNotIn("shell_pga", listed["creatures"])
        described = self.expect(SUCCESS, "describe", "creatures").json
        body = described["body"]
        self.assertEqual((body["training_shapes"], body["modes"], body["posture"], body["limits"]), (12, 6, "none", False))
        self.assertEqual(body["joints"][0]["parent"], -1)
        rig = json.loads((self.sample / "rig.json").read_text())
        self.assertEqual([joint["name"] for joint in body["joints"]], [joint["name"] for joint in rig["joints"]])
        self.assertEqual(body["variances"], sorted(body["variances"], reverse=True))
        self.assertGreater(described["memory_bytes"], 800 * 3 * 8 * 6)
        for verb, expected in (("describe", "(body, "), ("models", "body ")):
            words = self.command(verb, *(["creatures"] if verb == "describe" else []))
            words[words.index("json")] = "text"
            self.assertIn(expected, subprocess.run(words, capture_output=True, text=True, timeout=60).stdout)

    def test_a_registered_mesh_is_projected_and_synthesized_again(self):
        document, projected, weights = self.project(self.posed)
        self.assertAnswer(document)
        self.assertLess(rms(projected, self.pose), 0.012)
        self.assertAlmostEqual(document["score"]["residual_distance"], rms(projected, self.pose), places=5)
        self.assertEqual(document["residual_energy"], 0)
        joints = len(self.expect(SUCCESS, "describe", "creatures").json["body"]["joints"])
        numbers = json.loads(weights.read_text())["body"]
        self.assertEqual(len(numbers), 6 + 3 + 3 * joints)
        again = self.folder / "again.obj"
        self.assertAnswer(self.expect(SUCCESS, "synthesize", "creatures", "--coefficients", weights, "-o", again).json)
        self.assertLess(numpy.abs(read_obj(again)[0] - projected).max(), 1e-6)
        fewer, coarser, _ = self.project(self.posed, "--modes", 2)
        self.assertGreater(rms(coarser, self.pose), rms(projected, self.pose))
        self.assertEqual(len(fewer["coefficients"]["body"]), len(numbers))

    def test_scores_tell_one_of_the_people_from_a_stranger(self):
        known = self.expect(SUCCESS, "score", "creatures", self.sample / "bodies/body_004.ply").json
        self.assertAnswer(known)
        vertices = numpy.load(self.sample / "bodies.npy")[4]
        stranger = write_mesh(self.folder / "stranger.obj", vertices * [1.5, 0.7, 1.2], self.faces)
        odd = self.expect(SUCCESS, "score", "creatures", stranger).json
        self.assertGreater(odd["mahalanobis"], 2 * known["mahalanobis"])
        self.assertGreater(odd["residual_distance"], 2 * known["residual_distance"])
        self.assertLess(odd["log_likelihood"], known["log_likelihood"])

    def test_markers_are_fitted_missing_ones_too(self):
        out, report = self.folder / "fit.npy", self.folder / "fit.json"
        arguments = ("fit", "creatures", self.sample / "markers/trial.csv", "--marker-set", self.sample / "markers/marker_set.json")
        self.expect(SUCCESS, *arguments, "-o", out, "--report", report)
        truth, fitted = numpy.load(self.sample / "markers/truth.npy"), numpy.load(out)
        self.assertEqual(fitted.shape, truth.shape)
        for frame in range(len(truth)):
            self.assertLess(rms(fitted[frame], truth[frame]), 0.03)
        job = self.folder / "job.npy"
        self.expect(SUCCESS, *arguments, "-o", job, "--job")
        self.assertTrue((numpy.load(job) == fitted).all())
        self.refused("scale: = 1.200000, and a model of kind body has its size in its identity", *arguments, "--scale", 1.2)

    def test_a_dataset_is_projected_as_a_job(self):
        report = self.folder / "jobs.json"
        self.expect(SUCCESS, "project", "creatures", self.posed, self.sample / "bodies/body_001.ply", "--job", "--report", report)
        self.assertEqual(len(json.loads(report.read_text())["shapes"]), 2)

    def test_what_the_kind_cannot_answer_is_refused_by_its_name(self):
        edited = ("edit", "creatures", "--handles", self.sample / "handles.csv", "-o", self.folder / "e.obj")
        self.refused('model creatures version 1 is of kind "body", and Shapes.Edit needs one of kind "shell_pga"', *edited)
        self.refused('is of kind "body", and an evaluation needs one of kind "shell_pga"', "evaluate", "creatures")
        self.refused('is of kind "body", and an evaluation needs one of kind "shell_pga"', "evaluate", "creatures", "--job")
        scan = write_mesh(self.folder / "tube_scan.obj", *tube())
        self.refused('model tubes version 1 is of kind "shell_pga", and Registration.Register needs one of kind "body"',
                     "register", "tubes", scan)
        shell = self.folder / "alpha.json"
        shell.write_text('{"alpha": [1], "scale": 1}')
        self.refused("coefficients: are those of a Shell PGA model, and the model is of kind body: want body",
                     "synthesize", "creatures", "--coefficients", shell, "-o", self.folder / "x.obj")
        short = self.folder / "short.json"
        short.write_text('{"body": [0, 0]}')
        self.refused("coefficients.body: has 2 numbers, want ", "synthesize", "creatures", "--coefficients", short, "-o",
                     self.folder / "x.obj")

    def test_bad_trainings_are_refused_before_anything_is_computed(self):
        train = ("train", "body", "bad", "--template", self.sample / "template.ply", "--frames", self.sample / "bodies.npy")
        self.refused("body.modes: = 12, want at most 11", *train, "--modes", 12)
        self.refused("explained = 1.5", *train, "--explained", 1.5)
        self.refused('--posture: is "upright", want none, skeleton or local', *train, "--posture", "upright")
        self.refused("--path-steps: goes with shell-pga, not with body", *train, "--path-steps", 4)
        self.refused("--rig: goes with body, not with shell-pga", "train", "shell-pga", "bad", *self.tubes, "--rig", "x")
        self.refused('METHOD: is "head", want shell-pga or body', "train", "head", "bad", *self.tubes)
        rig = json.loads((self.sample / "rig.json").read_text())
        rig["weights"] = rig["weights"][1:]
        wrong = self.folder / "wrong_rig.json"
        wrong.write_text(json.dumps(rig))
        self.refused("wrong_rig.json", *train, "--rig", wrong)
        self.assertEqual(self.shapectl("describe", "bad").code, NOT_FOUND)

    def test_weights_that_do_not_sum_are_told(self):
        rig = json.loads((self.sample / "rig.json").read_text())
        rig["weights"][3] = [[joint, weight / 2] for joint, weight in rig["weights"][3]]
        halved = self.folder / "halved_rig.json"
        halved.write_text(json.dumps(rig))
        train = ("train", "body", "halved", "--template", self.sample / "template.ply", "--frames", self.sample / "bodies.npy")
        told = self.expect(SUCCESS, *train, "--rig", halved).err
        self.assertRegex(told, r"warning: .*halved_rig.json: weights of a vertex sum to 1 give or take 0.5")
        self.assertNotIn("warning", self.expect(SUCCESS, *train, "--rig", self.sample / "rig.json").err)

    def test_a_model_without_a_rig_moves_as_a_whole(self):
        self.expect(SUCCESS, "train", "body", "faces", *self.tubes, "--explained", 0.9, "--posture", "local", "--reach", 0.5)
        body = self.expect(SUCCESS, "describe", "faces").json["body"]
        self.assertEqual((len(body["joints"]), body["posture"]), (1, "local"))
        vertices, faces = tube(angle=0.7)
        turn = numpy.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
        moved = write_mesh(self.folder / "moved.obj", vertices @ turn.T + [3, 2, 1], faces)
        still = write_mesh(self.folder / "still.obj", vertices, faces)
        one, other = (self.expect(SUCCESS, "score", "faces", mesh).json for mesh in (moved, still))
        self.assertAlmostEqual(one["mahalanobis"], other["mahalanobis"], places=2)

    def test_models_travel_and_come_back(self):
        files = self.folder / "travel"
        self.expect(SUCCESS, "download", "creatures", files)
        self.assertEqual(json.loads((files / "manifest.json").read_text())["kind"], "body")
        self.expect(SUCCESS, "upload", "travelled", files)
        one = self.expect(SUCCESS, "score", "creatures", self.posed).json
        other = self.expect(SUCCESS, "score", "travelled", self.posed).json
        self.assertEqual(one["mahalanobis"], other["mahalanobis"])
        folder = self.folder / "store/models/travelled"
        shutil.copytree(folder / "1", folder / "2")
        manifest = json.loads((folder / "2/manifest.json").read_text())
        manifest["kind"] = "head"
        (folder / "2/manifest.json").write_text(json.dumps(manifest))
        self.assertIn('is of kind "head", want "shell_pga" or "body"', self.shapectl("load", "travelled").message())
        self.expect(SUCCESS, "unload", "travelled")
        self.expect(SUCCESS, "score", "travelled@1", self.posed)


class Scans(Bodies):
    def scan(self, mesh, *options):
        path = self.folder / f"scan_{mesh.stem}.ply"
        self.expect(SUCCESS, "sample-scan", mesh, "-o", path, *SCANNED, *options)
        return path

    def registered(self, *words):
        """A registration that succeeded, whether or not it stood still in the end to a tenth of a millimetre."""
        result = self.shapectl("register", *words)
        self.assertIn(result.code, (SUCCESS, NOT_CONVERGED), result.out + result.err)
        return result.json

    def assertLies(self, shape, wanted):
        """Vertex on vertex. A paw or the tail, far from where it rests, may be lost; the rest is not."""
        self.assertLess(numpy.median(numpy.sqrt(((shape - wanted) ** 2).sum(1))), 0.01)

    def test_a_scan_is_registered_where_it_lies(self):
        scan, out, report = self.scan(self.posed, "--still"), self.folder / "r.obj", self.folder / "r.json"
        document = self.registered("creatures", scan, "-o", out, "--report", report)
        self.assertAnswer(document)
        self.assertEqual(json.loads(report.read_text())["score"], document["score"])
        self.assertGreater(document["score"], 0.85)
        self.assertEqual(document["warnings"], [])
        self.assertIn("start_margin", document)
        self.assertLess(document["scan_report"]["scan_median"], 0.006)
        joints = self.expect(SUCCESS, "describe", "creatures").json["body"]["joints"]
        self.assertEqual([region["name"] for region in document["scan_report"]["regions"]], [joint["name"] for joint in joints])
        self.assertLies(read_obj(out)[0], self.pose)

    def test_a_registration_can_be_refined_beyond_the_model(self):
        scan = self.scan(self.posed, "--still")
        fitted = self.registered("creatures", scan)
        refined = self.registered("creatures", scan, "--refine")
        self.assertNotIn("refinement", fitted)
        self.assertLess(refined["refinement"]["median_distance"], 0.003)
        self.assertEqual(refined["coefficients"], fitted["coefficients"])

    def test_landmarks_place_a_scan_in_its_own_unit(self):
        handles = numpy.loadtxt(self.sample / "handles.csv", delimiter=",", skiprows=1)[:, 0].astype(int)
        landmarks = self.folder / "landmarks.json"
        landmarks.write_text(json.dumps({"landmarks": [
            {"vertex": int(v), "position": [float(x) for x in 1000 * self.pose[v]]} for v in handles]}))
        scan = write_mesh(self.folder / "millimetres.obj", 1000 * self.pose, self.faces)  # a mesh may be a scan
        out = self.folder / "l.obj"
        document = self.registered("creatures", scan, "--unit", "mm", "--landmarks", landmarks, "-o", out)
        self.assertNotIn("start_margin", document)
        self.assertLies(read_obj(out)[0], self.pose)
        warned = self.registered("creatures", scan)
        self.assertTrue(any("unit" in warning for warning in warned["warnings"]), warned["warnings"])
        self.assertAlmostEqual(warned["suspected_unit_factor"], 0.001)

    def test_a_sequence_goes_on_from_scan_to_scan(self):
        truth = numpy.load(self.sample / "markers/truth.npy")[:3]
        meshes = [write_mesh(self.folder / f"frame{i}.obj", shape, self.faces) for i, shape in enumerate(truth)]
        scans = [self.scan(mesh, "--still") for mesh in meshes]
        out = self.folder / "sequence.npy"
        documents = self.registered("creatures", *scans, "-o", out)["scans"]
        self.assertEqual([document["frame"] for document in documents], [0, 1, 2])
        self.assertIn("start_margin", documents[0])
        self.assertNotIn("start_margin", documents[1])
        for shape, wanted in zip(numpy.load(out), truth):
            self.assertLies(shape, wanted)

    def test_scans_that_cannot_be_used_are_refused_by_name(self):
        few = self.folder / "few.xyz"
        few.write_text("0 0 0\n1 0 0\n0 1 0\n")
        self.refused("scan: has 3 points, want at least", "register", "creatures", few)
        scan = self.scan(self.posed, "--still")
        self.refused('--unit: "furlong" is no unit of length', "register", "creatures", scan, "--unit", "furlong")
        landmarks = self.folder / "bad.json"
        landmarks.write_text('{"landmarks": [{"vertex": 100000, "position": [0, 0, 0]}]}')
        self.refused("landmarks[0].vertex: = 100000 is outside [0, ", "register", "creatures", scan, "--landmarks", landmarks)
        landmarks.write_text('[{"vertex": 1, "position": [0, 0, 0]}]')
        self.refused('bad.json: want {"landmarks": [...]}', "register", "creatures", scan, "--landmarks", landmarks)
        landmarks.write_text('{"landmarks": [{"vertex": 1, "position": "nose"}]}')
        self.refused("bad.json: landmarks[0]: want ", "register", "creatures", scan, "--landmarks", landmarks)
        landmarks.write_text('{"landmarks": [{"vertex": 1, "position": [0, 0]}]}')
        self.refused("bad.json: landmarks[0]: want ", "register", "creatures", scan, "--landmarks", landmarks)
        self.expect(NOT_FOUND, "register", "nobody", scan)


if __name__ == "__main__":
    unittest.main()
