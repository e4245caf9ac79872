"""The layers of the source tree: who may include and name what. The link graph in CMake is the architecture; includes must
follow it, and some things belong to one layer only."""

import os
import pathlib
import re
import unittest

ROOT = pathlib.Path(os.environ.get("SHAPED_SOURCE", pathlib.Path(__file__).resolve().parents[2]))
INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]', re.MULTILINE)


def sources(*folders):
    for folder in folders:
        for path in sorted((ROOT / folder).rglob("*")):
            if path.suffix in (".cpp", ".h"):
                yield path


def includes(path):
    return INCLUDE.findall(path.read_text())


def links():
    """Target name -> targets that it names, out of shaped_library(NAME LINKS...) and what is linked privately."""
    graph = {}
    for path in ROOT.glob("core/*/CMakeLists.txt"):
        text = path.read_text()
        for name, rest in re.findall(r"shaped_library\((\S+)([^)]*)\)", text):
            graph.setdefault(name, set()).update(rest.split())
        for name, rest in re.findall(r"target_link_libraries\((\S+)([^)]*)\)", text):
            graph.setdefault(name, set()).update(rest.split())
    return graph


def reachable(graph, target):
    seen, waiting = set(), [target]
    while waiting:
        for link in graph.get(waiting.pop(), ()):
            if link not in seen:
                seen.add(link)
                waiting.append(link)
    return seen


class Layers(unittest.TestCase):
    def test_core_folders_include_only_what_they_link(self):
        graph = links()
        self.assertGreater(len(graph), 8)
        for path in sources("core"):
            own = path.relative_to(ROOT).parts[1]
            allowed = {own} | {name.removeprefix("shaped_") for name in reachable(graph, "shaped_" + own)}
            for include in includes(path):
                if include.startswith("core/"):
                    self.assertIn(include.split("/")[1], allowed, f"{path.relative_to(ROOT)} includes {include}")

    def test_the_link_graph_has_no_cycle(self):
        graph = links()
        for target in graph:
            self.assertNotIn(target, reachable(graph, target))

    def test_core_knows_no_wire_no_terminal_and_no_layer_above(self):
        wire = re.compile(r"^(grpc|google/protobuf|shaped/v1|server/|client/|CLI/|spdlog|iostream$)")
        terminal = re.compile(r"std::(cout|cerr|clog)|\b(printf|puts|fprintf) *\(|\bgetenv\b")
        clock = re.compile(r"std::chrono::\w*clock|\bclock\(\)")
        for path in sources("core"):
            for include in includes(path):
                self.assertIsNone(wire.match(include), f"{path.relative_to(ROOT)} includes {include}")
            for pattern in (terminal, clock):
                self.assertIsNone(pattern.search(path.read_text()), f"{path.relative_to(ROOT)} matches {pattern.pattern}")

    def test_only_io_knows_files(self):
        for path in sources("core"):
            if path.relative_to(ROOT).parts[1] in ("io", "rendering"):  # pictures are encoded by libpng
                continue
            for include in includes(path):
                self.assertNotIn(include, ("fstream", "cstdio", "fcntl.h", "unistd.h"), f"{path.relative_to(ROOT)}")

    def test_the_server_has_no_mathematics_and_the_client_no_server(self):
        for path in sources("server"):
            for include in includes(path):
                self.assertIsNone(re.match(r"client/|Eigen/(Sparse|Dense|Eigenvalues|Cholesky|QR|SVD)|core/shell/shell_objective", include),
                                  f"{path.relative_to(ROOT)} includes {include}")
        for path in sources("client"):
            for include in includes(path):
                self.assertFalse(include.startswith("server/"), f"{path.relative_to(ROOT)} includes {include}")

    def test_job_storage_hides_behind_its_interface(self):
        for path in sources("server"):
            folder, name = path.relative_to(ROOT).parts[1:3] if len(path.relative_to(ROOT).parts) > 2 else ("", "")
            for include in includes(path):
                if include == "sqlite3.h":
                    self.assertEqual((folder, name), ("jobs", "sqlite.cpp"))
                if include == "server/jobs/sqlite_job_registry.h":
                    self.assertIn(folder, ("jobs", "daemon"), f"{path.relative_to(ROOT)} knows how jobs are stored")

    def test_only_training_and_the_trainer_know_libtorch(self):
        torch = re.compile(r"^(torch|ATen|c10|caffe2)/")
        for path in sources("core", "server", "client", "trace"):
            folder = "/".join(path.relative_to(ROOT).parts[:2])
            for include in includes(path):
                if torch.match(include):
                    self.assertIn(folder, ("core/training", "server/trainer"), f"{path.relative_to(ROOT)} includes {include}")
                if include.startswith(("core/training/", "server/trainer/")):
                    self.assertIn(folder, ("core/training", "server/trainer"), f"{path.relative_to(ROOT)} includes {include}")
        for path in (file for top in ("core", "server", "client", "trace", "tests") for file in (ROOT / top).rglob("CMakeLists.txt")):
            folder = str(path.parent.relative_to(ROOT))
            if re.search(r"shaped_(torch|training|server_trainer)\b(?!_tests)", path.read_text()):
                self.assertIn(folder, ("core", "core/training", "server", "server/trainer", "tests", "tests/benchmark"), path)

    def test_traces_stand_alone(self):
        for path in sources("trace"):
            for include in includes(path):
                self.assertNotRegex(include, "^(core|server|client|shaped|grpc)", path)

    def test_telemetry_depends_on_nobody_it_tells_of(self):
        for path in sources("server/telemetry"):
            for include in includes(path):
                self.assertNotRegex(include, "^(grpc|shaped/v1|server/(models|jobs|datasets|rpc|convert|daemon))", path)

    def test_the_protocol_stands_alone(self):
        for path in (ROOT / "proto").rglob("*.proto"):
            for name in re.findall(r'^import "([^"]+)"', path.read_text(), re.MULTILINE):
                self.assertTrue(name.startswith(("shaped/v1/", "google/protobuf/")), f"{path.relative_to(ROOT)} imports {name}")

    def test_headers_are_guarded(self):
        for path in sources("core", "server", "client", "trace"):
            if path.suffix == ".h":
                self.assertTrue(path.read_text().startswith("#pragma once"), path)


if __name__ == "__main__":
    unittest.main()
