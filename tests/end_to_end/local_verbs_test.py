"""shapectl sample and render: verbs that need no daemon."""

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
                                 "poses/pose_000.ply", "poses/pose_001.ply", "poses/pose_002.ply", "template.ply"])
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
