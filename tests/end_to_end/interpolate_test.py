"""shapectl interpolate, and how calls end: deadline, Ctrl-C, an unreachable daemon."""

import signal
import subprocess
import time
import unittest

import numpy

from support import (BAD_INPUT, CANCELLED, DEADLINE, NOT_FOUND, SUCCESS, UNAVAILABLE, Daemon, DaemonCase, Result, tube,
                     write_mesh)


class Interpolate(DaemonCase):
    daemon_options = ("--threads", "1")

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        vertices, cls.faces = tube(0.0)
        cls.ends = vertices, tube(1.5)[0]
        cls.a = write_mesh(cls.folder / "a.obj", cls.ends[0], cls.faces)
        cls.b = write_mesh(cls.folder / "b.obj", cls.ends[1], cls.faces)
        big = [tube(angle, rings=120, sides=40) for angle in (0.0, 2.0)]
        cls.big = [write_mesh(cls.folder / f"big{i}.obj", *mesh) for i, mesh in enumerate(big)]

    def slow(self):
        """A call that takes far longer than any test waits."""
        return self.command("interpolate", *self.big, "--frames", 5000, "--path-steps", 16)

    def test_a_path_between_two_bends(self):
        out = self.folder / "path"
        document = self.expect(SUCCESS, "interpolate", self.a, self.b, "--path-steps", 8, "--frames", 3, "-o", out).json
        self.assertAnswer(document)
        self.assertEqual(document["termination"], "converged")
        self.assertEqual(len(document["segment_energies"]), 8)
        self.assertAlmostEqual(document["path_energy"], 8 * sum(document["segment_energies"]))
        self.assertEqual([frame["time"] for frame in document["frames"]], [0, 0.5, 1])
        self.assertEqual(sorted(path.name for path in out.iterdir()),
                         ["frame_0000.ply", "frame_0001.ply", "frame_0002.ply"])
        energies = numpy.array(document["segment_energies"])
        self.assertLess(energies.max() / energies.min(), 1.1)  # constant speed

    def test_extrapolation_bends_on(self):
        out = self.folder / "beyond"
        self.expect(SUCCESS, "interpolate", self.a, self.b, "--frames", 1, "--from", 1.25, "-o", out)
        self.assertTrue((out / "frame_0000.ply").exists())

    def test_bad_input_is_refused_by_name(self):
        vertices, faces = self.ends[0].copy(), self.faces.copy()
        path = self.folder / "bad.obj"
        self.refused("missing.obj", "interpolate", self.a, self.folder / "missing.obj")
        empty = self.folder / "empty.obj"
        empty.write_text("")
        self.refused("empty.obj", "interpolate", self.a, empty)
        text = self.a.read_text().replace("v ", "v nan ", 1).replace(" 0.0\n", "\n", 1)
        path.write_text(text)
        self.refused("bad.obj", "interpolate", self.a, path)
        write_mesh(path, vertices, numpy.roll(faces, 1, axis=0))
        self.refused("bad.obj: is connected differently", "interpolate", self.a, path)
        write_mesh(path, vertices[:-1], faces[:-8])
        self.refused("bad.obj: has 105 vertices", "interpolate", self.a, path)
        collapsed = vertices.copy()
        collapsed[faces[7][0]] = collapsed[faces[7][1]]
        write_mesh(path, collapsed, faces)
        self.refused("to: face", "interpolate", self.a, path)
        self.refused("from: vertices: face", "interpolate", path, self.a)

    def test_bad_connectivity_is_refused_by_name(self):
        vertices, faces = self.ends[0], self.faces
        path = self.folder / "connectivity.obj"
        write_mesh(path, vertices, numpy.vstack([faces, faces[:1]]))
        self.refused("from: faces: edge", "interpolate", path, path)
        write_mesh(path, numpy.vstack([vertices, vertices + [0, 0, 5]]), numpy.vstack([faces, faces + len(vertices)]))
        self.refused("from: faces: has 2 connected components", "interpolate", path, path)
        flipped = faces.copy()
        flipped[3] = flipped[3][::-1]
        write_mesh(path, vertices, flipped)
        self.refused("orient all faces alike", "interpolate", path, path)

    def test_bad_options_are_refused_by_name(self):
        self.refused("--path-steps", "interpolate", self.a, self.b, "--path-steps", -1)
        self.refused("path_steps: has 5000 steps", "interpolate", self.a, self.b, "--path-steps", 5000)
        self.refused("times[0]", "interpolate", self.a, self.b, "--frames", 1, "--from", 11)
        self.refused("bending", "interpolate", self.a, self.b, "--bending", -1)
        self.assertEqual(self.shapectl("interpolate", self.a).code, BAD_INPUT)
        self.assertEqual(self.shapectl("interpolat", self.a).code, BAD_INPUT)

    def test_the_timeout_ends_the_call(self):
        begin = time.monotonic()
        result = Result(subprocess.run([*self.slow(), "--timeout", "0.5"], capture_output=True, text=True, timeout=60))
        self.assertEqual(result.code, DEADLINE, result.err)
        self.assertLess(time.monotonic() - begin, 5)
        self.assertServesSoon()

    def test_ctrl_c_ends_the_call(self):
        process = subprocess.Popen(self.slow(), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        time.sleep(1)
        process.send_signal(signal.SIGINT)
        out, _ = process.communicate(timeout=10)
        self.assertEqual(process.returncode, CANCELLED, out)
        self.assertServesSoon()

    def assertServesSoon(self):
        """The only solver thread is free again."""
        begin = time.monotonic()
        self.expect(SUCCESS, "interpolate", self.a, self.b)
        self.assertLess(time.monotonic() - begin, 5)

    def test_an_unreachable_daemon(self):
        result = Result(subprocess.run([self.command()[0], "--server", "127.0.0.1:1", "--output", "json", "models"],
                                       capture_output=True, text=True, timeout=60))
        self.assertEqual(result.code, UNAVAILABLE)
        self.assertIn("127.0.0.1:1", result.message())

    def test_unknown_things_are_not_found(self):
        for words in (["describe", "nobody"], ["delete", "nobody"], ["watch", "99"], ["cancel", "99"]):
            self.assertEqual(self.shapectl(*words).json["error"]["kind"], "not_found", words)
        self.assertEqual(self.shapectl("describe", "nobody@3").code, NOT_FOUND)
        self.refused("a model is NAME, NAME@VERSION", "describe", "nobody@0")


class Lifecycle(DaemonCase):
    def test_a_second_daemon_on_the_store_is_refused(self):
        with self.assertRaisesRegex(RuntimeError, "ended with 2.*another daemon"):
            Daemon(self.folder / "store")

    def test_sigterm_stops_it_cleanly(self):
        daemon = Daemon(self.folder / "other")
        code, log = daemon.stop()
        self.assertEqual(code, 0)
        self.assertIn("stopped", log)


if __name__ == "__main__":
    unittest.main()
