"""shapectl sample, sample-scan and render: verbs that need no daemon."""

import json
import pathlib
import struct
import subprocess
import tempfile
import unittest

import numpy

from support import BAD_INPUT, BINARIES, INTERNAL, SUCCESS, Result, tube, write_mesh


def shapectl(*words):
    # A server that nobody listens on: a local verb must not care.
    command = [str(BINARIES / "shapectl"), "--server", "127.0.0.1:1", "--output", "json", *map(str, words)]
    return Result(subprocess.run(command, capture_output=True, text=True, timeout=300))


def png_size(path):
    head = path.read_bytes()[:24]
    assert head[:8] == b"\x89PNG\r\n\x1a\n", path
    return struct.unpack(">II", head[16:24])


def ply_body(path):
    head, body = path.read_bytes().split(b"end_header\n", 1)
    counts = {words[1]: int(words[2]) for words in map(str.split, head.decode().splitlines()) if words[0] == "element"}
    return counts, body


def ply_scan(path):
    counts, body = ply_body(path)
    rows = numpy.frombuffer(body, "<f8").reshape(counts["vertex"], 6)
    return rows[:, :3], rows[:, 3:]


def ply_mesh(path):
    counts, body = ply_body(path)
    vertices = numpy.frombuffer(body, "<f8", 3 * counts["vertex"]).reshape(-1, 3)
    corners = numpy.dtype([("count", "u1"), ("corners", "<i4", 3)])
    return vertices, numpy.frombuffer(body, corners, counts["face"], vertices.nbytes)["corners"]


class LocalVerbs(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        cls.sample = cls.folder / "sample"
        cls.answer = shapectl("sample", cls.sample, "--poses", 3, "--bodies", 2, "--markers", "--frames", 8,
                              "--vertices", 700)

    def refused(self, text, *words, code=BAD_INPUT):
        result = shapectl(*words)
        self.assertEqual(result.code, code, result.out + result.err)
        self.assertIn(text, result.message())

    def test_sample_writes_what_it_says(self):
        self.assertEqual(self.answer.code, SUCCESS, self.answer.err)
        count = self.answer.json["vertices"]
        self.assertLess(abs(count - 700), 70)
        names = sorted(str(path.relative_to(self.sample)) for path in self.sample.rglob("*") if path.is_file())
        self.assertEqual(names, ["bodies.npy", "bodies/body_000.ply", "bodies/body_001.ply", "handles.csv", "held_out.ply",
                                 "markers/marker_set.json", "markers/trial.csv", "markers/truth.npy", "poses.npy",
                                 "poses/pose_000.ply", "poses/pose_001.ply", "poses/pose_002.ply", "rig.json", "template.ply"])
        self.assertEqual(numpy.load(self.sample / "poses.npy").shape, (3, count, 3))
        self.assertEqual(numpy.load(self.sample / "bodies.npy").shape, (2, count, 3))
        self.assertEqual(numpy.load(self.sample / "markers/truth.npy").shape, (8, count, 3))

    def test_the_same_seed_gives_the_same_sample_and_another_one_does_not(self):
        again, other = self.folder / "again", self.folder / "other"
        shapectl("sample", again, "--poses", 3, "--vertices", 700)
        shapectl("sample", other, "--poses", 3, "--vertices", 700, "--seed", 2)
        mine = (self.sample / "poses.npy").read_bytes()
        self.assertEqual(mine, (again / "poses.npy").read_bytes())
        self.assertNotEqual(mine, (other / "poses.npy").read_bytes())
        self.assertFalse((again / "markers").exists())

    def test_sample_refuses_bad_options(self):
        self.refused("vertices = 4", "sample", self.folder / "bad", "--vertices", 4)
        self.refused("--poses", "sample", self.folder / "bad", "--poses", -1)
        file = self.folder / "file"
        file.write_text("")
        self.refused("file/sub", "sample", file / "sub", code=INTERNAL)

    def scan(self, name, *options):
        result = shapectl("sample-scan", self.sample / "template.ply", "-o", self.folder / name, "--points", 2000, *options)
        self.assertEqual(result.code, SUCCESS, result.out + result.err)
        return result.json

    def test_a_virtual_scan_is_written_with_its_truth(self):
        truth_file = self.folder / "truth.json"
        answer = self.scan("scan.ply", "--outliers", 0.1, "--truth", truth_file)
        truth = json.loads(truth_file.read_text())
        self.assertEqual(answer["points"], 2000)
        self.assertEqual(len(answer["outliers"]), 200)
        self.assertEqual({key: answer[key] for key in answer if key != "scan"},
                         {key: truth[key] for key in truth if key not in ("faces", "barycentric", "cameras")})
        self.assertGreater(answer["visible_fraction"], 0.7)
        points, normals = ply_scan(self.folder / "scan.ply")
        numpy.testing.assert_allclose(numpy.linalg.norm(normals, axis=1), 1)
        # Moved back by the truth, all but the outliers lie where the truth says, up to noise.
        moved = (points - truth["translation"]) @ numpy.array(truth["rotation"])
        vertices, faces = ply_mesh(self.sample / "template.ply")
        seen = numpy.setdiff1d(numpy.arange(2000), truth["outliers"])
        corners = vertices[faces[numpy.array(truth["faces"])[seen]]]
        places = numpy.einsum("nc,nci->ni", numpy.array(truth["barycentric"])[seen], corners)
        distances = numpy.linalg.norm(moved[seen] - places, axis=1)
        self.assertAlmostEqual(numpy.sqrt(numpy.mean(distances ** 2)), 0.0015, delta=0.0001)

    def test_scans_lose_what_they_are_told_to_and_differ_by_seed(self):
        whole = self.scan("whole.ply", "--outliers", 0, "--still")
        self.assertEqual(whole["rotation"], [[1, 0, 0], [0, 1, 0], [0, 0, 1]])
        gaps = self.scan("gaps.ply", "--outliers", 0, "--still", "--missing", 0.25, "--cut", 0.25, "--hole-radius", 30)
        self.assertEqual(gaps["points"], 1000)
        self.assertGreater(len(gaps["holes"]), 3)
        self.assertIn("cut", gaps)
        self.scan("again.ply", "--outliers", 0, "--still")
        self.scan("other.ply", "--outliers", 0, "--still", "--seed", 2)
        bytes_of = lambda name: (self.folder / name).read_bytes()
        self.assertEqual(bytes_of("whole.ply"), bytes_of("again.ply"))
        self.assertNotEqual(bytes_of("whole.ply"), bytes_of("other.ply"))

    def test_sample_scan_refuses_bad_options(self):
        out = self.folder / "refused.ply"
        mesh = self.sample / "template.ply"
        self.refused("points = 0", "sample-scan", mesh, "-o", out, "--points", 0)
        self.refused("outliers = 1", "sample-scan", mesh, "-o", out, "--outliers", 1)
        self.refused("holes + cut", "sample-scan", mesh, "-o", out, "--missing", 0.5, "--cut", 0.5)
        self.refused("a scan is written as PLY", "sample-scan", mesh, "-o", self.folder / "refused.obj")
        self.refused("missing.ply", "sample-scan", self.folder / "missing.ply", "-o", out)
        self.assertFalse(out.exists())

    def test_render_draws_scans_as_points(self):
        self.scan("drawn.ply", "--still")
        out = self.folder / "points.png"
        result = shapectl("render", self.sample / "template.ply", "--scans", self.folder / "drawn.ply",
                          self.sample / "template.ply", "-o", out, "--width", 64)
        self.assertEqual(result.code, SUCCESS, result.err)
        self.assertEqual([picture["caption"] for picture in result.json["pictures"]], ["template", "drawn", "template"])
        self.refused("--error-against", "render", "--scans", self.folder / "drawn.ply", "-o", out, "--error-against",
                     self.sample / "template.ply")
        self.refused("nothing to draw", "render", "-o", out)

    def test_render_draws_meshes_and_stacks(self):
        out = self.folder / "sheet.png"
        result = shapectl("render", self.sample / "template.ply", self.sample / "poses.npy", "--template",
                          self.sample / "template.ply", "--frames", "1:", "-o", out, "--width", 80, "--columns", 3)
        self.assertEqual(result.code, SUCCESS, result.err)
        self.assertEqual([picture["caption"] for picture in result.json["pictures"]], ["template", "poses 1", "poses 2"])
        self.assertEqual(png_size(out), (240, result.json["height"]))

    def test_errors_are_measured_between_vertices_or_to_the_surface(self):
        out = self.folder / "error.png"
        vertices, faces = tube()
        mesh = write_mesh(self.folder / "tube.obj", vertices, faces)
        moved = write_mesh(self.folder / "moved.obj", vertices + [0.01, 0, 0], faces)
        other = write_mesh(self.folder / "other.obj", vertices + [0.01, 0, 0], numpy.roll(faces, 1, axis=0))
        against = lambda reference: shapectl("render", mesh, "-o", out, "--width", 64, "--error-against", reference)
        same = against(moved).json["pictures"][0]
        self.assertAlmostEqual(same["mean_distance"], 0.01, places=9)
        self.assertAlmostEqual(same["largest_distance"], 0.01, places=9)
        # Sliding along its own axis leaves a tube's surface nearly in place: only the caps move.
        surface = against(other).json["pictures"][0]
        self.assertLess(surface["mean_distance"], 0.005)
        self.assertGreater(surface["largest_distance"], 0.005)

    def test_render_refuses_bad_input(self):
        out = self.folder / "none.png"
        self.refused("missing.ply", "render", self.folder / "missing.ply", "-o", out)
        self.refused("--template", "render", self.sample / "poses.npy", "-o", out)
        self.refused("--up", "render", self.sample / "template.ply", "-o", out, "--up", "x")
        self.refused("3 shapes for 1 pictures", "render", self.sample / "template.ply", "-o", out, "--template",
                     self.sample / "template.ply", "--error-against", self.sample / "poses.npy")
        self.assertFalse(out.exists())


if __name__ == "__main__":
    unittest.main()
