"""The files under deploy/monitoring and the table in docs/operations.md name what a daemon really exposes."""

import json
import os
import pathlib
import re
import shutil
import subprocess
import unittest

import yaml

from scrape import scrape
from support import DaemonCase, write_tubes

SOURCE = pathlib.Path(os.environ["SHAPED_SOURCE"])
FOLDER = SOURCE / "deploy/monitoring"
NAME = re.compile(r"\b((?:shaped|process)_\w+|up)\b(?:\{([^}]*)\})?")


def dashboard():
    return json.loads((FOLDER / "shaped-dashboard.json").read_text())


def rules():
    groups = yaml.safe_load((FOLDER / "shaped-rules.yml").read_text())["groups"]
    return [rule for group in groups for rule in group["rules"]]


def expressions():
    for panel in dashboard()["panels"]:
        for target in panel.get("targets", ()):
            yield panel["title"], target["expr"]
    for rule in rules():
        yield rule["alert"], rule["expr"]


class Monitoring(DaemonCase):
    daemon_options = ("--metrics", "127.0.0.1:0")

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        meshes = write_tubes(cls.folder)
        cls.shapectl("train", "shell-pga", "seen", *meshes, "--coarse-vertices", 60)
        cls.shapectl("score", "seen", meshes[0])
        cls.seen = scrape(cls.daemon)

    def test_every_metric_and_label_exists(self):
        checked = set()
        for where, expression in expressions():
            for name, matchers in NAME.findall(expression):
                checked.add(name)
                if name == "up":
                    continue
                self.assertIn(name, self.seen.names(), where)
                for label in re.findall(r"(\w+)=~?\"", matchers):
                    self.assertIn(label, self.seen.labels(name) | {"instance", "job"}, f"{where}: {name}")
        self.assertGreater(len(checked), 25)

    def test_every_family_has_a_panel_and_a_line_in_the_docs(self):
        used = {name for _, expression in expressions() for name, _ in NAME.findall(expression)}
        documented = {}
        for name, labels in re.findall(r"^\| `(\w+)(?:\{([\w,]*)\})?` \|", (SOURCE / "docs/operations.md").read_text(), re.M):
            documented[name] = set(labels.split(",")) - {""}
        for family in self.seen.families:
            self.assertTrue(any(name.startswith(family) for name in used), family)
            series = {name for name in self.seen.names() if re.fullmatch(family + "(_bucket|_sum|_count)?", name)}
            labels = set().union(*(self.seen.labels(name) for name in series)) - {"le"}
            self.assertEqual(documented.get(family), labels, family)
        metrics = {name for name in documented if name.startswith(("shaped_", "process_"))}
        self.assertEqual(metrics - set(self.seen.families), set())

    def test_files_are_whole(self):
        scraping = yaml.safe_load((FOLDER / "prometheus.yml").read_text())
        self.assertEqual([job["job_name"] for job in scraping["scrape_configs"]], ["shaped"])
        self.assertTrue(all((FOLDER / name).is_file() for name in scraping["rule_files"]))
        for rule in rules():
            self.assertIn(rule["labels"]["severity"], ("warning", "critical"))
            self.assertTrue(rule["annotations"]["summary"] and rule["annotations"]["description"])
        panels = dashboard()["panels"]
        self.assertEqual(len({panel["id"] for panel in panels}), len(panels))
        for panel in panels:
            place = panel["gridPos"]
            self.assertLessEqual(place["x"] + place["w"], 24)

    @unittest.skipUnless(shutil.which("promtool"), "promtool (Debian's package prometheus, 332 MB) is not installed")
    def test_prometheus_itself_takes_them(self):
        for name in ("prometheus.yml", "prometheus.compose.yml"):
            checked = subprocess.run(["promtool", "check", "config", FOLDER / name], capture_output=True, text=True, timeout=60)
            self.assertEqual(checked.returncode, 0, checked.stdout + checked.stderr)
            self.assertIn("10 rules found", checked.stdout)


if __name__ == "__main__":
    unittest.main()
