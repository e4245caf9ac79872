"""The Curves service and its verbs: smooth, geodesic, bezier, join, render-motion."""

import importlib
import signal
import subprocess
import time
import unittest
import xml.etree.ElementTree

import grpc
import numpy

from messages import Refusal
from support import BAD_INPUT, CANCELLED, NOT_FOUND, SUCCESS, DaemonCase, tube, write_mesh

curves_pb2 = importlib.import_module("shaped.v1.curves_pb2")


def bends(angles, **options):
    return numpy.stack([tube(angle, **options)[0] for angle in angles]).astype(numpy.float32)


def aligned_distance(a, b):
    """Root mean square after the best rigid motion."""
    a, b = a - a.mean(0), b - b.mean(0)
    u, _, v = numpy.linalg.svd(a.T @ b)
    turn = u @ numpy.diag([1, 1, numpy.sign(numpy.linalg.det(u @ v))]) @ v
    return numpy.sqrt(((a @ turn - b) ** 2).sum(1).mean())


class Curves(DaemonCase):
    daemon_options = ("--max-curve-megabytes", "4")

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        vertices, cls.faces = tube(0.0)
        cls.mesh = write_mesh(cls.folder / "mesh.obj", vertices, cls.faces)
        cls.a = write_mesh(cls.folder / "a.obj", vertices, cls.faces)
        cls.b = write_mesh(cls.folder / "b.obj", tube(0.9)[0], cls.faces)
        cls.c = write_mesh(cls.folder / "c.obj", tube(-0.5)[0], cls.faces)

    def motion(self, name, frames):
        path = self.folder / f"{name}.npy"
        numpy.save(path, frames)
        return path

    def trembling(self, frames=24):
        phase = numpy.arange(frames)
        return bends(0.8 * numpy.sin(0.2 * phase) + 0.06 * (phase % 2))

    def smooth(self, motion, *options, code=SUCCESS):
        out = self.folder / "smooth.npy"
        out.unlink(missing_ok=True)
        result = self.expect(code, "smooth", motion, "--template", self.mesh, "-o", out, *options)
        return (result.json, numpy.load(out)) if code == SUCCESS else result.message()

    def test_smoothing_calms_a_motion_and_keeps_its_ends(self):
        noisy = self.trembling()
        document, smooth = self.smooth(self.motion("noisy", noisy), "--steps", 6)
        self.assertEqual(document["termination"], "converged")
        self.assertEqual(document["steps"], 6)
        self.assertEqual(smooth.shape, noisy.shape)
        numpy.testing.assert_array_equal(smooth[[0, -1]], noisy[[0, -1]])
        energies = document["step_energies"]
        self.assertEqual(len(energies), 7)
        self.assertTrue(all(b < a for a, b in zip(energies, energies[1:])), energies)
        self.assertLess(max(document["gradient_after"]), 0.3 * max(document["gradient_before"]))
        self.assertGreater(document["smallest_area_ratio"], 0.9)

    def test_nothing_is_left_on_the_daemon_and_datasets_that_are_there_stay(self):
        motion = self.motion("transient", self.trembling(8))
        self.smooth(motion)
        datasets = self.folder / "store" / "datasets"
        self.assertEqual([path.name for path in datasets.iterdir() if path.name.startswith("shapes-motion")], [])

    def test_reduced_and_full_agree(self):
        motion = self.motion("both", self.trembling())
        full = self.smooth(motion, "--reduced", "off")
        reduced = self.smooth(motion, "--reduced", "on")
        self.assertEqual(full[0]["dimension"], 0)
        self.assertGreater(reduced[0]["dimension"], 0)
        self.assertLess(abs(full[1] - reduced[1]).max(), 0.02)

    def test_restoring_held_and_closed(self):
        noisy = self.trembling()
        motion = self.motion("options", noisy)
        free = self.smooth(motion)[1]
        pulled = self.smooth(motion, "--restore", 0.5)[1]
        self.assertLess(abs(pulled - noisy).max(), 0.7 * abs(free - noisy).max())
        by_distance = self.smooth(motion, "--restore", 0.5, "--restore-scale", 0.1)[1]
        self.assertLess(abs(by_distance - noisy).max(), 0.2 * abs(free - noisy).max())
        held = self.smooth(motion, "--hold", 7, 8)[1]
        numpy.testing.assert_array_equal(held[[7, 8]], noisy[[7, 8]])
        self.assertGreater(abs(held[9] - noisy[9]).max(), 1e-4)
        closed, frames = self.smooth(motion, "--closed", "--steps", 40)
        self.assertGreater(abs(frames[-1] - noisy[-1]).max(), 0.1)
        self.assertLess(closed["path_energy_after"], 0.2 * closed["path_energy_before"])

    def test_windows_leave_no_seams(self):
        noisy = self.trembling(60)
        motion = self.motion("long", noisy)
        whole = self.smooth(motion, "--reduced", "off", "--fixed-tau", "--steps", 5)[1]
        document, windows = self.smooth(motion, "--reduced", "off", "--fixed-tau", "--steps", 5, "--window", 24)
        self.assertGreater(document["windows"], 3)
        self.assertEqual(len(document["gradient_after"]), 60)
        self.assertLess(abs(whole - windows).max(), 1e-4)

    def test_a_plot_of_the_corners(self):
        plot = self.folder / "corners.svg"
        self.smooth(self.motion("plotted", self.trembling()), "--plot", plot)
        self.assertTrue(xml.etree.ElementTree.parse(plot).getroot().tag.endswith("svg"))
        self.assertIn("after", plot.read_text())

    def test_a_plot_of_the_energy(self):
        plot = self.folder / "energy.svg"
        motion = self.motion("falling", self.trembling())
        self.smooth(motion, "--closed", "--plot-energy", plot)
        self.assertTrue(xml.etree.ElementTree.parse(plot).getroot().tag.endswith("svg"))
        self.assertIn("path energy", plot.read_text())
        message = self.smooth(motion, "--window", 8, "--steps", 1, "--plot-energy", plot, code=BAD_INPUT)
        self.assertIn("one window", message)

    def test_bad_motions_are_refused_by_name(self):
        noisy = self.trembling(6)
        self.assertIn("1 frames", self.smooth(self.motion("one", noisy[:1]), code=BAD_INPUT))
        self.assertIn("2 frames, a closed", self.smooth(self.motion("two", noisy[:2]), "--closed", code=BAD_INPUT))
        spoiled = noisy.copy()
        spoiled[3, 5, 1] = numpy.nan
        self.assertIn("frame 3, vertex 5", self.smooth(self.motion("nan", spoiled), code=BAD_INPUT))
        self.assertIn("105 vertices", self.smooth(self.motion("short", noisy[:, :-1]), code=BAD_INPUT))
        good = self.motion("good", noisy)
        for option, value, message in (("--tau", 0, "flow.tau: = 0"), ("--tau", 1.5, "flow.tau"), ("--restore", 1.2, "restore[0]"),
                                       ("--restore", -0.1, "restore[0]"), ("--restore-scale", -1, "restore_scale"), ("--hold", 6, "held[0]"), ("--hold", "x", "--hold"),
                                       ("--steps", 20000, "flow.steps"), ("--steps", -1, "--steps"), ("--window", 3, "window"),
                                       ("--ghost-vertices", 2, "flow.ghost_vertices"), ("--dimension", 501, "flow.dimension"),
                                       ("--reduced", "maybe", "--reduced"), ("--bending", -1, "bending")):
            self.assertIn(message, self.smooth(good, option, value, code=BAD_INPUT), (option, value))
        self.assertIn("no such file", self.smooth(self.folder / "missing.npy", code=BAD_INPUT))
        self.expect(NOT_FOUND, "smooth", "no-such-dataset", "-o", self.folder / "x.npy")
        self.assertFalse((self.folder / "x.npy").exists())
        big = self.motion("big", numpy.repeat(noisy[:1], 2000, axis=0))
        self.assertIn("--max-curve-megabytes", self.smooth(big, "--closed", code=BAD_INPUT))

    def test_two_equal_frames_and_one_inside_out(self):
        still = self.motion("still", numpy.repeat(self.trembling(1), 2, axis=0))
        document, frames = self.smooth(still)
        self.assertTrue(document["stationary"])
        mirrored = self.trembling(9)
        mirrored[4, :, 2] *= -1
        document, frames = self.smooth(self.motion("mirrored", mirrored), "--steps", 3, "--reduced", "off")
        self.assertTrue(numpy.isfinite(frames).all())
        self.assertLessEqual(document["path_energy_after"], document["path_energy_before"])

    def test_a_ghost_larger_than_the_mesh_is_the_mesh(self):
        document, _ = self.smooth(self.motion("ghost", self.trembling()), "--reduced", "on", "--ghost-vertices", 100000)
        self.assertEqual(document["termination"], "converged")

    def test_a_geodesic_has_even_speed_and_the_given_ends(self):
        out = self.folder / "geodesic.npy"
        document = self.expect(SUCCESS, "geodesic", self.a, self.b, "--frames", 9, "-o", out).json
        frames = numpy.load(out)
        self.assertEqual(len(frames), 9)
        numpy.testing.assert_allclose(frames[0], tube(0.0)[0], atol=1e-6)
        numpy.testing.assert_allclose(frames[-1], tube(0.9)[0], atol=1e-6)
        steps = [aligned_distance(a, b) for a, b in zip(frames, frames[1:])]
        self.assertLess(max(steps) / min(steps), 1.2)
        self.assertLess(document["missing"], 1e-3)
        flow = self.expect(SUCCESS, "geodesic", self.a, self.b, "--frames", 9, "--by-flow", "-o", out).json
        self.assertAlmostEqual(flow["path_energy"] / document["path_energy"], 1, places=2)

    def test_a_bezier_curve(self):
        out = self.folder / "bezier.npy"
        document = self.expect(SUCCESS, "bezier", self.a, self.b, self.c, "--frames", 9, "-o", out).json
        frames = numpy.load(out)
        self.assertEqual(len(frames), 9)
        numpy.testing.assert_allclose(frames[0], tube(0.0)[0], atol=1e-6)
        numpy.testing.assert_allclose(frames[-1], tube(-0.5)[0], atol=1e-6)
        self.assertGreater(document["geodesics"], 9)
        # bends are nearly a straight line: the middle is a quarter, a half and a quarter of the angles
        self.assertLess(aligned_distance(frames[4], tube(0.5 * 0.9 - 0.25 * 0.5)[0]), 0.02)
        self.refused("b.obj", "bezier", self.a, self.other(), "-o", out)
        self.refused("frames: = 1", "bezier", self.a, self.b, "--frames", 1, "-o", out)

    def other(self):
        vertices, faces = tube(0.0, rings=7)
        return write_mesh(self.folder / "other_b.obj", vertices, faces)

    def test_joined_clips_lose_their_corner(self):
        there, back = bends(numpy.linspace(0, 0.9, 30)), bends(numpy.linspace(0.9, 0, 30))
        turn = numpy.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0]])
        clips = [self.motion("there", there), self.motion("back", (back @ turn.T + [5, 0, 1]).astype(numpy.float32))]
        out = self.folder / "joined.npy"
        document = self.expect(SUCCESS, "join", *clips, "--template", self.mesh, "--reach", 25, "-o", out).json
        frames = numpy.load(out)
        self.assertEqual(len(frames), 59)  # they meet in one frame
        seam = document["seams"][0]
        self.assertEqual((seam["last_frame"], seam["first_frame"]), (29, 29))
        self.assertLess(seam["gradient_after"], 0.1 * seam["gradient_before"])
        numpy.testing.assert_allclose(frames[:3], there[:3], atol=1e-6)
        numpy.testing.assert_allclose(frames[-1], there[0], atol=1e-4)
        apart = self.motion("apart", bends(numpy.linspace(0.3, 0, 20)))
        document = self.expect(SUCCESS, "join", clips[0], apart, "--template", self.mesh, "--transition", 4, "-o", out).json
        self.assertEqual(document["frames"], 54)
        self.expect(NOT_FOUND, "join", clips[0], "no-such", "--template", self.mesh, "-o", out)
        self.refused("--template", "join", *clips, "-o", out)
        self.refused("--up", "join", *clips, "--template", self.mesh, "--up", "w", "-o", out)

    def test_pictures_of_a_motion(self):
        motion = self.motion("pictures", self.trembling(10))
        for name, magic in (("strip.png", b"\x89PNG"), ("animated.gif", b"GIF89a")):
            out = self.folder / name
            self.expect(SUCCESS, "render-motion", motion, "--template", self.mesh, "-o", out, "--width", 64)
            self.assertEqual(out.read_bytes()[:len(magic)], magic)
        self.refused("--out", "render-motion", motion, "--template", self.mesh, "-o", self.folder / "x.jpg")
        self.refused("--rate", "render-motion", motion, "--template", self.mesh, "-o", out, "--rate", 0)
        self.refused("105 vertices", "render-motion", self.motion("few", self.trembling(3)[:, :-1]), "--template", self.mesh, "-o", out)

    def test_ctrl_c_ends_the_work_and_leaves_no_file(self):
        motion = self.motion("slow", bends(0.8 * numpy.sin(0.2 * numpy.arange(30)), rings=60, sides=30))
        mesh = write_mesh(self.folder / "slow.obj", *tube(0.0, rings=60, sides=30))
        out = self.folder / "slow_out.npy"
        process = subprocess.Popen(self.command("smooth", motion, "--template", mesh, "--steps", 10000, "--reduced", "off", "-o", out),
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        time.sleep(2)
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=30)
        self.assertEqual(process.returncode, CANCELLED)
        self.assertFalse(out.exists())
        # the daemon's one worker for such work is free again
        self.smooth(self.motion("next", self.trembling(5)))

    def test_streams_over_the_wire(self):
        with grpc.insecure_channel(self.daemon.address) as channel:
            def call(method, request, response):
                return list(channel.unary_stream(f"/shaped.v1.Curves/{method}", type(request).SerializeToString,
                                                 response.FromString)(request, timeout=60))

            vertices, faces = tube(0.0)
            request = curves_pb2.GeodesicRequest(frames=5)
            request.topology.faces.vertex_count = len(vertices)
            request.topology.faces.faces.extend(int(i) for i in numpy.asarray(faces).ravel())
            getattr(request, "from").positions.extend(vertices.ravel())
            request.to.positions.extend(tube(0.4)[0].ravel())
            parts = [part.WhichOneof("part") for part in call("Geodesic", request, curves_pb2.GeodesicResponse)]
            self.assertEqual([part for part in parts if part != "progress"], ["frame"] * 5 + ["summary"])
            self.assertEqual(parts[-1], "summary")
            request.ClearField("topology")
            with self.assertRaises(grpc.RpcError) as failed:
                call("Geodesic", request, curves_pb2.GeodesicResponse)
            refusal = Refusal(failed.exception)
            self.assertEqual((refusal.code, refusal.field), (grpc.StatusCode.INVALID_ARGUMENT, "topology"))
            with self.assertRaises(grpc.RpcError) as failed:
                call("Join", curves_pb2.JoinRequest(datasets=["one"]), curves_pb2.JoinResponse)
            self.assertEqual(Refusal(failed.exception).field, "datasets")


if __name__ == "__main__":
    unittest.main()
