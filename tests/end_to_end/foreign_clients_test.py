"""Clients in Python and Node.js against a daemon with TLS and tokens: every kind of call, deadlines, cancellation, error
details; and the examples of docs/api.md, run as it says there."""

import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

from certificates import Authority
from support import BINARIES, SOURCE, Daemon, generate_messages, tube, write_tubes

HERE = pathlib.Path(__file__).resolve().parent
EXAMPLES = SOURCE / "docs/examples"
SHAPES = 4
# Places for streams: room for those of the tests before that have not quite ended.
OPEN_STREAMS = "4"


def run(*words, **environment):
    return subprocess.run(list(map(str, words)), env={**os.environ, **{k: str(v) for k, v in environment.items()}},
                          capture_output=True, text=True, timeout=300)


def node_modules():
    """Folder of the packages that the lock file names, installed once a build folder; a reason to skip where they cannot be."""
    if not (shutil.which("node") and shutil.which("npm")):
        return None, "node or npm is not installed"
    home = BINARIES.parent / "node_client"
    home.mkdir(exist_ok=True)
    lock = (EXAMPLES / "node_client/package-lock.json").read_text()
    stamp = home / "installed.json"
    if not stamp.exists() or stamp.read_text() != lock:
        for name in ("package.json", "package-lock.json"):
            shutil.copy(EXAMPLES / "node_client" / name, home)
        done = subprocess.run(["npm", "ci", "--ignore-scripts", "--no-audit", "--no-fund"], cwd=home, capture_output=True,
                              text=True, timeout=300, stdin=subprocess.DEVNULL)
        if done.returncode != 0:
            return None, "npm cannot fetch the packages: " + done.stderr.strip()[-300:]
        stamp.write_text(lock)
    return home / "node_modules", None


class ForeignClients(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        cls.authority = Authority(cls.folder, "ours")
        tokens = [cls.make_token("owner", "admin"), cls.make_token("reader", "read")]
        (cls.folder / "tokens.json").write_text(json.dumps({"tokens": [entry for _, entry in tokens]}))
        (cls.folder / "token").write_text(tokens[0][0] + "\n")
        certificate, key = cls.authority.sign("daemon")
        cls.daemon = Daemon(cls.folder / "store", "--tls-cert", certificate, "--tls-key", key, "--tokens",
                            cls.folder / "tokens.json", "--open-streams", OPEN_STREAMS)
        cls.addClassCleanup(cls.daemon.stop)
        cls.address = "localhost:" + cls.daemon.address.rsplit(":", 1)[1]
        cls.train()
        cls.write_scenario(*(token for token, _ in tokens))
        (cls.folder / "messages").mkdir()
        generate_messages(cls.folder / "messages")

    @classmethod
    def make_token(cls, name, roles):
        made = json.loads(run(BINARIES / "shapectl", "--output", "json", "token", name, "--roles", roles).stdout)
        return made["token"], made["entry"]

    @classmethod
    def train(cls):
        trained = run(BINARIES / "shapectl", "--server", cls.address, "--ca", cls.authority.certificate, "--token-file",
                      cls.folder / "token", "train", "shell-pga", "tubes", *write_tubes(cls.folder), "--coarse-vertices", 60)
        if trained.returncode != 0:
            raise RuntimeError(trained.stderr)

    @classmethod
    def write_scenario(cls, token, reader):
        shapes = [tube(angle=-1.2 + 0.8 * i, radius=0.3 + 0.02 * i) for i in range(SHAPES)]
        cls.scenario = cls.folder / "scenario.json"
        cls.scenario.write_text(json.dumps({
            "address": cls.address, "ca": str(cls.authority.certificate), "token": token, "reader": reader,
            "other_ca": str(Authority(cls.folder, "theirs").certificate), "model": "tubes", "open_streams": int(OPEN_STREAMS),
            "vertices": len(shapes[0][0]), "faces": shapes[0][1].ravel().tolist(),
            "frames": [vertices.ravel().tolist() for vertices, _ in shapes], "markers": list(range(0, 104, 5))}))

    def tearDown(self):
        self.assertTrue(self.daemon.running(), "the daemon has died")

    def python(self, program, *words):
        return run(sys.executable, "-B", program, *words, PYTHONPATH=f"{self.folder / 'messages'}:{EXAMPLES}")

    def node(self, program, *words):
        modules, missing = node_modules()
        if missing:
            print(f"\nSKIPPED: the Node.js client is NOT tested: {missing}", file=sys.stderr, flush=True)
            self.skipTest(missing)
        return run("node", program, *words, NODE_PATH=modules)

    def check_every_kind(self, process):
        self.assertEqual(process.returncode, 0, process.stderr)
        seen = json.loads(process.stdout)
        self.assertEqual(seen["unary"], {"models": [["tubes", 106]], "trace": "0af7651916cd43dd8448eb211c80319c"})
        self.assertEqual(seen["client_stream"], {"frames": SHAPES, "vertices": 106})
        self.check_error(seen["refused_client_stream"], "INVALID_ARGUMENT", "INVALID_FIELD", "frames[1]", "has 317 coordinates")
        self.assertEqual(seen["server_stream"]["parts"], ["summary", "frame", "frame", "frame"])
        self.assertLess(seen["server_stream"]["far"], 1e-3)
        self.assertEqual(seen["both_streams"], {"answers": [[0, 1, True], [1, 1, True]], "more": 0})
        busy = seen["busy"]
        self.check_error(busy, "RESOURCE_EXHAUSTED", "OPEN_STREAMS", None, "streams are open")
        self.assertGreater(busy["retry_seconds"], 0)
        self.assertIn(busy["open"], range(1, int(OPEN_STREAMS) + 1))
        deadline = seen["deadline"]
        self.assertEqual((deadline["waiting"], deadline["solving"], deadline["left"]),
                         ("DEADLINE_EXCEEDED", "DEADLINE_EXCEEDED", 0))
        self.assertGreaterEqual(deadline["seconds"], 0.9)
        self.assertEqual(seen["cancellation"], {"first": "summary", "code": "CANCELLED", "left": 0})
        self.check_error(seen["error_details"]["bad"], "INVALID_ARGUMENT", "INVALID_FIELD", "shape.positions", "has 317 numbers")
        self.check_error(seen["error_details"]["missing"], "NOT_FOUND", "MODEL_NOT_FOUND", None, "none")
        self.assertEqual(seen["refusals"], {"nobody": "UNAUTHENTICATED", "reader": "PERMISSION_DENIED",
                                            "stranger": "UNAVAILABLE"})

    def check_error(self, error, code, reason, field, text):
        self.assertEqual((error["code"], error.get("reason"), error.get("domain")), (code, reason, "shaped"), error)
        self.assertIn(text, error["message"])
        if field:
            self.assertIn(field, error["field"])

    def check_example(self, process):
        self.assertEqual(process.returncode, 0, process.stderr)
        self.assertIn("tubes@1: 106 vertices", process.stdout)
        self.assertIn("projected: TERMINATION_CONVERGED", process.stdout)
        self.assertIn("synthesized 106 vertices", process.stdout)
        self.assertIn("refused: INVALID_ARGUMENT: shape.positions: has 317 numbers", process.stdout)
        self.assertIn("(INVALID_FIELD)", process.stdout)

    def test_python_in_every_kind_of_call(self):
        self.check_every_kind(self.python(HERE / "every_kind.py", self.scenario))

    def test_node_in_every_kind_of_call(self):
        self.check_every_kind(self.node(HERE / "every_kind.js", self.scenario))

    def test_the_python_example(self):
        self.check_example(self.python(EXAMPLES / "python_client.py", self.address, "tubes", self.authority.certificate,
                                       self.folder / "token"))

    def test_the_node_example(self):
        self.check_example(self.node(EXAMPLES / "node_client/client.js", self.address, "tubes", self.authority.certificate,
                                     self.folder / "token"))


if __name__ == "__main__":
    unittest.main()
