"""The Python example of docs/api.md, run as it says there."""

import os
import subprocess
import sys
import unittest

from support import SOURCE, SUCCESS, DaemonCase, generate_messages, write_tubes


class PythonClient(DaemonCase):
    def test_the_example_runs(self):
        self.expect(SUCCESS, "train", "shell-pga", "tubes", *write_tubes(self.folder), "--coarse-vertices", 60)
        messages = self.folder / "messages"
        messages.mkdir()
        generate_messages(messages)
        run = subprocess.run([sys.executable, "-B", SOURCE / "docs/examples/python_client.py", self.daemon.address, "tubes"],
                             env={**os.environ, "PYTHONPATH": str(messages)}, capture_output=True, text=True, timeout=120)
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assertIn("tubes@1: 106 vertices", run.stdout)
        self.assertIn("projected: TERMINATION_CONVERGED", run.stdout)
        self.assertIn("synthesized 106 vertices", run.stdout)
        self.assertIn("refused: INVALID_ARGUMENT: shape.positions: has 317 numbers", run.stdout)


if __name__ == "__main__":
    unittest.main()
