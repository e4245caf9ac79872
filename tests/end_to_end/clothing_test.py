"""Body shape under clothing as users meet it: scans of a motion in, one body and its postures out."""

import json
import subprocess
import time
import unittest

import numpy

from support import BAD_INPUT, CANCELLED, DEADLINE, NOT_CONVERGED, NOT_FOUND, SUCCESS, DaemonCase, tube, write_mesh, write_tubes

FRAMES = 3
CLOTH = 0.02


def rms(one, other):
    return numpy.sqrt(((one - other) ** 2).sum(1).mean())


def normals(vertices, faces):
    """Of the vertices, outwards."""
    corners = vertices[faces]
    across = numpy.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sums = numpy.zeros_like(vertices)
    for corner in range(3):
        numpy.add.at(sums, faces[:, corner], across)
    return sums / numpy.linalg.norm(sums, axis=1, keepdims=True)


class Clothing(DaemonCase):
    """A daemon that serves "bends", tubes as bodies of one joint, and scans of one of them in cloth as it turns."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.shapes = write_tubes(cls.folder, 8)
        for kind, name, options in (("body", "bends", ("--explained", 0.99, "--posture", "none")),
                                    ("shell-pga", "shells", ("--modes", 3, "--coarse-vertices", 60))):
            trained = cls.shapectl("train", kind, name, *cls.shapes, *options)
            if trained.code != SUCCESS:
                raise RuntimeError(trained.out + trained.err)
        rest, cls.faces = tube(angle=-1.2 + 2.4 * 3 / 7, radius=0.3 + 0.02 * 4)
        cls.scans, cls.bodies = [], []
        for i in range(FRAMES):
            angle = 0.2 * i
            turn = numpy.array([[numpy.cos(angle), -numpy.sin(angle), 0], [numpy.sin(angle), numpy.cos(angle), 0], [0, 0, 1]])
            cls.bodies.append(rest @ turn.T + [0.1 * i, 0, 0])
            dressed = cls.bodies[-1] + CLOTH * normals(cls.bodies[-1], cls.faces)
            mesh = write_mesh(cls.folder / f"dressed{i}.obj", dressed, cls.faces)
            cls.scans.append(cls.folder / f"scan{i}.ply")
            cls.shapectl("sample-scan", mesh, "-o", cls.scans[-1], "--points", 3000, "--noise", 1, "--seed", i + 1, "--still")
        cls.landmarks = cls.folder / "landmarks.json"
        cls.landmarks.write_text(json.dumps({"landmarks": [
            {"frame": i, "vertex": v, "position": cls.bodies[i][v].tolist()} for i in range(FRAMES) for v in (0, 26, 52, 78, 100)]}))

    def estimated(self, *words):
        result = self.shapectl("under-clothing", *words)
        self.assertIn(result.code, (SUCCESS, NOT_CONVERGED), result.out + result.err)
        self.assertEqual(result.code == SUCCESS, result.json["termination"] == "converged")
        return result.json

    def test_a_motion_becomes_one_body_in_several_postures(self):
        out, rest, report = (self.folder / name for name in ("out.npy", "rest.obj", "report.json"))
        document = self.estimated("bends", *self.scans, "--landmarks", self.landmarks, "-o", out, "--rest", rest, "--report", report)
        self.assertAnswer(document)
        self.assertEqual(json.loads(report.read_text()), document)
        self.assertEqual([frame["frame"] for frame in document["frames"]], list(range(FRAMES)))
        shapes = numpy.load(out)
        self.assertEqual(shapes.shape, (FRAMES, *self.bodies[0].shape))
        for frame, shape, body in zip(document["frames"], shapes, self.bodies):
            self.assertLess(rms(shape, body), 2 * CLOTH)
            self.assertGreater(frame["inside"], 0.8)
            self.assertLessEqual(frame["inside_strictly"], frame["inside"])
            self.assertGreater(frame["mean_gap"], 0)
            self.assertLess(frame["mean_gap"], 2 * CLOTH)
        # The same person at rest and in every frame, as their coefficients make them.
        weights = self.folder / "weights.json"
        for frame, shape in zip(document["frames"], shapes):
            weights.write_text(json.dumps(frame["coefficients"]))
            self.expect(SUCCESS, "synthesize", "bends", "--coefficients", weights, "-o", self.folder / "again.obj")
            self.assertLess(numpy.abs(self.vertices(self.folder / "again.obj") - shape).max(), 1e-5)
        weights.write_text(json.dumps(document["coefficients"]))
        self.expect(SUCCESS, "synthesize", "bends", "--coefficients", weights, "-o", self.folder / "again.obj")
        self.assertLess(numpy.abs(self.vertices(self.folder / "again.obj") - self.vertices(rest)).max(), 1e-5)

    @staticmethod
    def vertices(path):
        with open(path) as file:
            return numpy.array([[float(x) for x in line.split()[1:4]] for line in file if line.startswith("v ")])

    def test_a_folder_of_scans_is_a_motion_by_name_and_the_table_says_how_it_went(self):
        folder = self.folder / "motion"
        folder.mkdir()
        for i, scan in enumerate(self.scans[:2]):
            (folder / f"b{i}.ply").write_bytes(scan.read_bytes())
        words = self.command("under-clothing", "bends", folder)
        words[words.index("json")] = "text"
        result = subprocess.run(words, capture_output=True, text=True, timeout=300)
        self.assertIn(result.returncode, (SUCCESS, NOT_CONVERGED), result.stderr)
        lines = result.stdout.splitlines()
        self.assertTrue(lines[0].startswith("bends@1: "), lines)
        self.assertEqual(lines[1].split(), ["frame", "ended", "inside", "gap", "seen", "explained", "trusted"])
        self.assertEqual([line.split()[0] for line in lines[2:4]], ["0", "1"])
        self.assertIn("warning: there are fewer than three scans", result.stdout)

    def test_what_cannot_be_used_is_refused_by_name_and_nothing_is_written(self):
        out = self.folder / "refused.npy"

        def refused(text, *words):
            self.refused(text, "under-clothing", *words, "-o", out)

        scan = self.scans[0]
        empty, few, broken = (self.folder / name for name in ("empty.ply", "few.xyz", "broken.npy"))
        empty.write_text("ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\nproperty float z\nend_header\n")
        refused("empty.ply", "bends", scan, empty)
        few.write_text("".join(f"{i} {i * i % 7} {i % 5}\n" for i in range(50)))
        refused("frames[1].scan: has 50 points, want at least 100", "bends", scan, few)
        points = numpy.random.default_rng(1).normal(size=(200, 3))
        points[7, 1] = numpy.nan
        numpy.save(broken, points)
        self.assertIn("broken.npy", self.expect(BAD_INPUT, "under-clothing", "bends", scan, broken, "-o", out).message())
        refused("missing.ply", "bends", scan, self.folder / "missing.ply")
        refused("--unit: \"furlong\"", "bends", scan, "--unit", "furlong")
        refused("options: scan_noise = -1", "bends", scan, "--scan-noise", -1)
        refused("options: thickest = 0", "bends", scan, "--thickest", 0)
        refused('model shells version 1 is of kind "shell_pga", and Registration.EstimateUnderClothing needs one of kind "body"',
                "shells", scan)
        self.expect(NOT_FOUND, "under-clothing", "nobody", scan, "-o", out)
        nowhere = self.folder / "nowhere"
        nowhere.mkdir()
        refused("holds no scans", "bends", nowhere)
        refused("frames[1000]: is one more than the 1000 scans", "bends", *[scan_of_points(self.folder)] * 1001)
        self.assertFalse(out.exists())

    def test_faulty_landmarks_are_refused_by_name(self):
        bad = self.folder / "bad.json"

        def refused(text, landmark, *scans):
            bad.write_text(json.dumps({"landmarks": [landmark]}))
            self.refused(text, "under-clothing", "bends", *(scans or self.scans), "--landmarks", bad)

        here = {"vertex": 1, "position": [0, 0, 0]}
        refused("bad.json: landmarks[0]: want ", here)
        refused("frame", {**here, "frame": FRAMES})
        refused("bad.json: landmarks[0]: want ", {"frame": 0, "vertex": 1, "position": "nose"})
        refused("frames[2].landmarks[0].vertex: = 100000 is outside [0, ", {**here, "frame": 2, "vertex": 100000})
        refused("frames[0].landmarks[0].vertex: = 100000", {**here, "vertex": 100000}, self.scans[0])

    def test_a_deadline_and_an_interrupt_free_the_worker(self):
        many = self.scans * 20
        out = self.folder / "late.npy"
        self.expect(DEADLINE, "--timeout", 2, "under-clothing", "bends", *many, "-o", out)
        process = subprocess.Popen(self.command("under-clothing", "bends", *many, "-o", out), stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE, text=True)
        time.sleep(3)
        process.terminate()
        process.communicate(timeout=60)
        self.assertEqual(process.returncode, CANCELLED)
        begin = time.monotonic()
        self.refused("options: thickest = 0", "under-clothing", "bends", self.scans[0], "--thickest", 0)
        self.assertLess(time.monotonic() - begin, 30)
        self.assertFalse(out.exists())


def scan_of_points(folder):
    """A scan that is as small as one may be."""
    path = folder / "points.npy"
    numpy.save(path, numpy.random.default_rng(2).normal(size=(100, 3)))
    return path


if __name__ == "__main__":
    unittest.main()
