"""The main job, from meshes to fitted shapes: train, describe, project, synthesize, score, edit, fit, evaluate, delete."""

import json
import shutil
import signal
import subprocess
import unittest

import numpy

from support import (BAD_INPUT, CANCELLED, DEADLINE, INTERNAL, NOT_CONVERGED, NOT_FOUND, SUCCESS, Daemon, DaemonCase, Result, read_obj, tube,
                     write_mesh, write_tubes)

LABELS = ("head", "chest", "belly", "hip", "foot")
MARKER_VERTICES = (1, 27, 53, 70, 101)


class Trained(DaemonCase):
    """A daemon that serves the model "tubes"."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.meshes = write_tubes(cls.folder)
        result = cls.shapectl("train", "shell-pga", "tubes", *cls.meshes, "--modes", 3, "--coarse-vertices", 60)
        if result.code != SUCCESS:
            raise RuntimeError(result.out + result.err)
        cls.training = result.json
        cls.unseen = write_mesh(cls.folder / "unseen.obj", *tube(0.77, radius=0.33))


class Versions(Trained):
    def state(self, version=1):
        for model in self.expect(SUCCESS, "models").json["models"]:
            if model["model"] == {"name": "tubes", "version": version}:
                return model["state"]
        return None

    def score(self, model):
        return self.expect(SUCCESS, "score", model, self.unseen).json["model"]["version"]

    def test_versions_load_swap_and_go(self):
        self.assertEqual(self.state(), "ready")
        self.assertEqual(len(self.expect(SUCCESS, "unload", "tubes").json["unloaded"]), 1)
        self.assertEqual(self.state(), "stored")
        self.assertEqual(self.score("tubes"), 1)  # waits for the load
        self.assertEqual(self.state(), "ready")
        folder = self.folder / "store/models/tubes"
        shutil.copytree(folder / "1", folder / "2")
        self.assertEqual(self.score("tubes"), 1)  # nobody asked for it yet
        self.assertEqual(self.expect(SUCCESS, "load", "tubes").json["model"]["version"], 2)
        self.assertEqual(self.score("tubes"), 2)
        self.expect(SUCCESS, "label", "tubes@1", "stable")
        self.assertEqual((self.score("tubes"), self.score("tubes@stable"), self.score("tubes@2")), (1, 1, 2))
        self.assertIn("labelled", self.expect(BAD_INPUT, "delete", "tubes@1").message())
        self.expect(SUCCESS, "label", "tubes", "stable", "--remove")
        self.assertEqual(self.score("tubes"), 2)
        shutil.copytree(folder / "1", folder / "3")
        with open(folder / "3/tensors.safetensors", "ab") as file:
            file.write(b"x")
        broken = [self.expect(INTERNAL, "load", "tubes").message(), self.expect(INTERNAL, "score", "tubes@3", self.unseen).message()]
        self.assertEqual(broken[0], broken[1])
        self.assertEqual(self.state(3), "failed")
        self.assertEqual(self.score("tubes"), 2)
        self.expect(NOT_FOUND, "score", "tubes@canary", self.unseen)

    def test_one_waits_for_a_model_to_come(self):
        self.expect(DEADLINE, "--timeout", "0.5", "wait", "later")
        with subprocess.Popen(self.command("wait", "later"), stdout=subprocess.PIPE, text=True) as waiting:
            self.expect(SUCCESS, "train", "shell-pga", "later", *self.meshes, "--modes", 2, "--coarse-vertices", 60)
            self.assertEqual(json.loads(waiting.communicate(timeout=60)[0]), {"name": "later", "version": 1})


class MainJob(Trained):
    def test_training_reports_itself(self):
        self.assertAnswer(self.training)
        self.assertEqual(self.training["state"], "succeeded")
        self.assertEqual(self.training["termination"], "converged")
        self.assertGreater(self.training["smallest_area_ratio"], 0.1)
        self.assertEqual(self.training["model"], {"name": "tubes", "version": 1})

    def test_the_model_is_listed_and_described(self):
        listed = self.expect(SUCCESS, "models").json["models"]
        self.assertIn({"name": "tubes", "version": 1}, [model["model"] for model in listed])
        described = self.expect(SUCCESS, "describe", "tubes").json
        self.assertEqual(described["vertices"], len(tube()[0]))
        self.assertEqual(described["training"]["termination"], "converged")
        self.assertGreater(described["training"]["seconds"], 0)
        pga = described["shell_pga"]
        self.assertEqual((pga["training_shapes"], pga["modes"], pga["path_steps"]), (6, 3, 4))
        self.assertEqual(pga["eigenvalues"], sorted(pga["eigenvalues"], reverse=True))

    def test_jobs_are_listed_and_can_be_watched_later(self):
        job = self.expect(SUCCESS, "jobs").json["jobs"][0]
        self.assertEqual(job["state"], "succeeded")
        self.assertEqual(self.expect(SUCCESS, "watch", job["id"]).json["model"], {"name": "tubes", "version": 1})

    def test_a_projection_can_be_synthesized_again(self):
        out, again, weights = (self.folder / name for name in ("p.obj", "s.obj", "c.json"))
        document = self.expect(SUCCESS, "project", "tubes", self.unseen, "-o", out, "--coefficients", weights).json
        self.assertAnswer(document)
        self.assertAlmostEqual(sum(json.loads(weights.read_text())["alpha"]), 1, places=6)
        projected, unseen = read_obj(out)[0], read_obj(self.unseen)[0]
        self.assertLess(numpy.sqrt(((projected - unseen) ** 2).sum(1).mean()), 0.06)
        self.assertAnswer(self.expect(SUCCESS, "synthesize", "tubes", "--coefficients", weights, "-o", again).json)
        self.assertLess(rigid_distance(read_obj(again)[0], projected), 1e-4)

    def test_a_shape_can_be_finished_at_full_resolution(self):
        out, fine, again, weights = (self.folder / name for name in ("p2.obj", "f.obj", "f2.obj", "c2.json"))
        self.expect(SUCCESS, "project", "tubes", self.unseen, "-o", out)
        document = self.expect(SUCCESS, "project", "tubes", self.unseen, "-o", fine, "--coefficients", weights, "--fine")
        self.assertAnswer(document.json)
        self.expect(SUCCESS, "synthesize", "tubes", "--coefficients", weights, "-o", again, "--fine")
        gap = rigid_distance(read_obj(fine)[0], read_obj(out)[0])
        self.assertGreater(gap, 1e-5)  # it did something,
        self.assertLess(gap, 0.03)  # but not much
        self.assertLess(rigid_distance(read_obj(again)[0], read_obj(fine)[0]), 1e-4)

    def test_the_energy_of_paths_can_be_chosen(self):
        options = ("--modes", 3, "--coarse-vertices", 60)
        self.expect(SUCCESS, "train", "shell-pga", "directed", *self.meshes, *options, "--directed")
        values = {}
        for name, energy in (("tubes", "symmetric"), ("directed", "directed")):
            pga = self.expect(SUCCESS, "describe", name).json["shell_pga"]
            self.assertEqual(pga["path_energy"], energy)
            values[name] = pga["eigenvalues"][0]
        difference = abs(values["tubes"] / values["directed"] - 1)
        self.assertGreater(difference, 1e-4)
        self.assertLess(difference, 0.2)

    def test_a_training_shape_is_likelier_than_a_crumpled_one(self):
        noise = numpy.random.default_rng(1).normal(0, 0.04, tube()[0].shape)
        crumpled = write_mesh(self.folder / "crumpled.obj", tube()[0] + noise, tube()[1])
        scores = [self.shapectl("score", "tubes", path).json for path in (self.meshes[2], crumpled)]
        for score in scores:
            self.assertAnswer(score)
        self.assertLess(scores[0]["residual_distance"], scores[1]["residual_distance"])

    def test_handles_are_met(self):
        target = read_obj(self.unseen)[0]
        handles = self.folder / "handles.csv"
        handles.write_text("vertex,x,y,z\n" + "".join(
            "%d,%r,%r,%r\n" % (v, *map(float, target[v])) for v in MARKER_VERTICES))
        out = self.folder / "edited.obj"
        result = self.shapectl("edit", "tubes", "--handles", handles, "-o", out)
        document = result.json
        self.assertAnswer(document)
        # The alternation is slow here; an answer that is short of the tolerance is written and says so.
        self.assertEqual(result.code, SUCCESS if document["termination"] == "converged" else NOT_CONVERGED)
        self.assertLess(document["largest_handle_distance"], 1e-6)
        self.assertEqual(document["energies"], sorted(document["energies"], reverse=True))
        edited = read_obj(out)[0]
        self.assertLess(numpy.abs(edited[list(MARKER_VERTICES)] - target[list(MARKER_VERTICES)]).max(), 1e-5)

    def test_evaluation_with_a_plot(self):
        plot = self.folder / "plot.svg"
        document = self.expect(SUCCESS, "evaluate", "tubes", "--folds", 2, "--modes", 2, "--samples", 2, "--plot", plot).json
        self.assertAnswer(document)
        self.assertEqual(document["modes"], [1, 2])
        self.assertLess(document["compactness"][0], document["compactness"][1])
        self.assertEqual(len(document["generalisation"]["vertex"]), 2)
        self.assertIn("<svg", plot.read_text())
        self.assertEqual(self.shapectl("evaluate", "tubes", "--dataset", "nobody").code, NOT_FOUND)

    def test_a_second_training_is_a_second_version_and_a_restart_keeps_both(self):
        with_folder = self.folder / "restarted"
        daemon = Daemon(with_folder)
        try:
            command = lambda *words: Result(subprocess.run(
                [*self.command()[:1], "--server", daemon.address, "--output", "json", *map(str, words)],
                capture_output=True, text=True, timeout=300))
            for version in (1, 2):
                trained = command("train", "shell-pga", "t", *self.meshes[:3], "--coarse-vertices", 60)
                self.assertEqual(trained.json["model"], {"name": "t", "version": version}, trained.err)
            daemon.stop()
            daemon = Daemon(with_folder)
            self.assertEqual([m["model"]["version"] for m in command("models").json["models"]], [1, 2])
            self.assertEqual(command("describe", "t").json["model"]["version"], 2)
            self.assertEqual(command("project", "t@1", self.unseen).json["model"]["version"], 1)
            self.assertEqual(command("delete", "t@2").json["deleted"], [{"name": "t", "version": 2}])
            self.assertEqual(command("describe", "t").json["model"]["version"], 1)
            self.assertEqual(command("delete", "t").code, SUCCESS)
            self.assertEqual(command("describe", "t").code, NOT_FOUND)
        finally:
            daemon.stop()


def rigid_distance(one, other):
    """Largest vertex distance after the best rigid motion."""
    a, b = one - one.mean(0), other - other.mean(0)
    u, _, v = numpy.linalg.svd(a.T @ b)
    turn = u @ numpy.diag([1, 1, numpy.sign(numpy.linalg.det(u @ v))]) @ v
    return numpy.abs(a @ turn - b).max()


class Markers(Trained):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.set_file = cls.folder / "set.json"
        cls.set_file.write_text(json.dumps(
            {"markers": [{"label": label, "vertex": vertex} for label, vertex in zip(LABELS, MARKER_VERTICES)]}))
        # A tube that bends to and fro; marker "belly" is missing in frame 2.
        shapes = [tube(angle, radius=0.32)[0] for angle in numpy.linspace(-0.8, 0.9, 6)]
        cls.shapes = numpy.array(shapes)
        markers = cls.shapes[:, MARKER_VERTICES, :].copy()
        markers[2, 2] = numpy.nan
        cls.trial = cls.folder / "trial.npy"
        numpy.save(cls.trial, markers)

    def fit(self, *words):
        return ["fit", "tubes", self.trial, "--marker-set", self.set_file, *words]

    def test_a_trial_is_fitted(self):
        out, report = self.folder / "fit.npy", self.folder / "report.json"
        result = self.shapectl(*self.fit("-o", out, "--report", report))
        self.assertIn(result.code, (SUCCESS, NOT_CONVERGED), result.out)
        self.assertAnswer(result.json)
        self.assertEqual(result.code == SUCCESS, result.json["termination"] == "converged")
        fitted = numpy.load(out)
        self.assertEqual(fitted.shape, self.shapes.shape)
        error = numpy.sqrt(((fitted - self.shapes) ** 2).sum(2)).mean()
        self.assertLess(error, 0.05)
        frames = json.loads(report.read_text())["frames"]
        self.assertEqual([frame["frame"] for frame in frames], list(range(6)))
        self.assertIsNone(frames[2]["residuals"]["belly"])
        self.assertLess(frames[2]["residuals"]["chest"], 0.05)
        self.assertLess(result.json["rms"], 0.03)

    def test_frames_can_be_chosen(self):
        out = self.folder / "some.npy"
        self.assertIn(self.shapectl(*self.fit("-o", out, "--frames", "1:5:2")).code, (SUCCESS, NOT_CONVERGED))
        self.assertEqual(len(numpy.load(out)), 2)
        self.refused("--frames", *self.fit("--frames", "9:"))
        self.refused("--frames", *self.fit("--frames", "a:b"))

    def test_bad_trials_and_marker_sets_are_refused_by_name(self):
        bad = self.folder / "bad.json"

        def refuse(text, markers):
            bad.write_text(json.dumps({"markers": markers}))
            self.refused(text, "fit", "tubes", self.trial, "--marker-set", bad)

        good = json.loads(self.set_file.read_text())["markers"]
        refuse("bad.json", good[:-1] + [{"label": "foot", "vertex": 100000}])
        refuse("bad.json", good[:-1] + [{"label": "head", "vertex": 3}])
        refuse("bad.json", [])
        csv = self.folder / "other.csv"
        csv.write_text("frame,LEFT_x,LEFT_y,LEFT_z\n1,0,0,0\n")
        self.refused("head", "fit", "tubes", csv, "--marker-set", self.set_file)
        markers = numpy.load(self.trial)
        few = self.folder / "few.npy"
        markers[0, 2:] = numpy.nan
        numpy.save(few, markers)
        self.refused("markers", "fit", "tubes", few, "--marker-set", self.set_file)

    def test_faulty_c3d_files_are_refused_by_name(self):
        truncated = self.folder / "truncated.c3d"
        truncated.write_bytes(b"\x02\x50" + bytes(510))
        self.refused("truncated.c3d", "fit", "tubes", truncated, "--marker-set", self.set_file)
        empty = self.folder / "empty.c3d"
        empty.write_bytes(b"")
        self.refused("empty.c3d", "fit", "tubes", empty, "--marker-set", self.set_file)

    def test_ctrl_c_leaves_no_half_file(self):
        long = self.folder / "long.npy"
        numpy.save(long, numpy.tile(numpy.load(self.trial), (2000, 1, 1)))
        out = self.folder / "half.npy"
        process = subprocess.Popen(self.command("fit", "tubes", long, "--marker-set", self.set_file, "-o", out),
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        try:
            process.wait(timeout=2)
        except subprocess.TimeoutExpired:
            pass
        process.send_signal(signal.SIGINT)
        text, _ = process.communicate(timeout=20)
        self.assertEqual(process.returncode, CANCELLED, text)
        self.assertFalse(out.exists())


class BadInput(Trained):
    """Section by section what may be wrong with the input of training and of the model's tasks."""

    def train(self, *words):
        return ["train", "shell-pga", "bad", *words]

    def tearDown(self):
        listed = self.shapectl("models").json["models"]
        self.assertEqual([model["model"]["name"] for model in listed], ["tubes"])  # nothing lost, nothing added
        super().tearDown()

    def bad_mesh(self, vertices, faces):
        return write_mesh(self.folder / "bad.obj", vertices, faces)

    def test_a_mesh_with_nan(self):
        path = self.bad_mesh(*tube())
        path.write_text(path.read_text().replace("v ", "v nan ", 1))
        self.refused("bad.obj", *self.train(self.meshes[0], path))

    def test_frames_with_nan(self):
        frames = numpy.array([tube(angle)[0] for angle in (0.1, 0.5, 0.9)])
        frames[1, 7, 2] = numpy.nan
        path = self.folder / "frames.npy"
        numpy.save(path, frames)
        self.refused("frames.npy", *self.train("--template", self.meshes[0], "--frames", path))

    def test_different_connectivity(self):
        vertices, faces = tube()
        self.refused("bad.obj: is connected differently",
                     *self.train(self.meshes[0], self.bad_mesh(vertices, numpy.roll(faces, 1, axis=1))))
        self.refused("bad.obj: has", *self.train(self.meshes[0], self.bad_mesh(*tube(rings=14))))

    def test_non_manifold_edges(self):
        vertices, faces = tube()
        path = self.bad_mesh(vertices, numpy.vstack([faces, [faces[5][0], faces[5][1], len(vertices) - 1]]))
        self.refused("faces", *self.train(path, path))

    def test_several_components(self):
        vertices, faces = tube()
        path = self.bad_mesh(numpy.vstack([vertices, vertices + 5]), numpy.vstack([faces, faces + len(vertices)]))
        self.refused("2 connected components", *self.train(path, path))

    def test_degenerate_triangles(self):
        vertices, faces = tube()
        vertices[faces[9][0]] = vertices[faces[9][1]]
        self.refused("bad.obj", *self.train(self.meshes[0], self.bad_mesh(vertices, faces)))

    def test_one_shape_only(self):
        self.refused("at least two", *self.train(self.meshes[0]))

    def test_two_identical_shapes(self):
        vertices, faces = read_obj(self.meshes[1])
        turned = vertices @ numpy.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]]) + 3
        twin = self.bad_mesh(turned, faces)
        result = self.shapectl(*self.train(self.meshes[0], self.meshes[1], twin, "--coarse-vertices", 60))
        self.assertEqual(result.code, BAD_INPUT, result.out)
        self.assertIn("shapes[", result.json["error"]["message"])

    def test_too_many_modes(self):
        self.refused("modes = 6", *self.train(*self.meshes, "--modes", 6))

    def test_bad_options(self):
        self.refused("bending", *self.train(*self.meshes, "--bending", -1))
        self.refused("coarse_vertices = 3", *self.train(*self.meshes, "--coarse-vertices", 3))
        self.refused("--modes", *self.train(*self.meshes, "--modes", -2))
        self.refused("METHOD", "train", "pca", "bad", *self.meshes)
        self.refused("model_name", "train", "shell-pga", "a b", *self.meshes)
        self.refused("MESH", *self.train())
        self.refused("--template", *self.train("--frames", "x.npy"))

    def test_an_empty_file(self):
        path = self.folder / "bad.obj"
        path.write_text("")
        self.refused("bad.obj", *self.train(self.meshes[0], path))
        path = self.folder / "empty.npy"
        path.write_bytes(b"")
        self.refused("empty.npy", *self.train("--template", self.meshes[0], "--frames", path))

    def test_unknown_models(self):
        for words in (["project", "nobody", self.unseen], ["score", "tubes@7", self.unseen], ["evaluate", "nobody"]):
            self.assertEqual(self.shapectl(*words).code, NOT_FOUND, words)

    def test_shapes_that_do_not_fit(self):
        other = write_mesh(self.folder / "other.obj", *tube(rings=14))
        for verb in ("project", "score"):
            self.refused("other.obj: has 114 vertices", verb, "tubes", other)
        vertices, faces = tube()
        vertices[faces[9][0]] = vertices[faces[9][1]]
        self.refused("shape: face", "project", "tubes", self.bad_mesh(vertices, faces))
        self.refused("modes", "project", "tubes", self.unseen, "--modes", 4)

    def test_bad_coefficients(self):
        path = self.folder / "c.json"
        for text, alpha in (("alpha", [1.0]), ("alpha", [0.5, 0.6, 0, 0, 0, 0]), ("alpha", [1.5, -0.5, 0, 0, 0, 0]),
                            ("c.json", "x")):
            path.write_text(json.dumps({"alpha": alpha, "scale": 1}))
            self.refused(text, "synthesize", "tubes", "--coefficients", path, "-o", self.folder / "x.ply")
        path.write_text("{")
        self.refused("c.json", "synthesize", "tubes", "--coefficients", path, "-o", self.folder / "x.ply")
        self.assertFalse((self.folder / "x.ply").exists())

    def test_bad_handles(self):
        path = self.folder / "h.csv"
        lines = ["0,0,0,0", "50,1,0,0", "90,2,0,0"]
        cases = (("handles", lines), ("handles", lines[:2]), ("h.csv", ["0,0,0,0"] * 3), ("h.csv", ["0,0,zero,0"]),
                 ("h.csv", []), ("handles[2].vertex", lines[:2] + ["1000,2,1,0"]))
        for text, rows in cases:
            path.write_text("\n".join(["vertex,x,y,z", *rows]))
            self.refused(text, "edit", "tubes", "--handles", path, "-o", self.folder / "x.ply")


if __name__ == "__main__":
    unittest.main()
