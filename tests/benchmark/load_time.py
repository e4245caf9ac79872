"""How long a large model takes from the disk into memory, and what of that is the disk.

    SHAPED_BINARIES=build/release/bin python3 tests/benchmark/load_time.py [MEGABYTES] [FOLDER]

Writes a model of that many MiB (1024) into a store under FOLDER (a temporary folder), and times, three times each, reading the
file, hashing it and `shapectl load`, cold (the file dropped from the page cache before) and from the cache. Wall seconds, and CPU
seconds of whoever does the work: the daemon's, for a load. The latter hold on a machine that is busy otherwise, too."""

import hashlib
import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "end_to_end"))
import numpy  # noqa: E402

from support import Daemon, DaemonCase, tube, write_tensors  # noqa: E402

REPEATS = 3


def large_model(folder, megabytes):
    """A tube of 10,000 vertices with as many modes as fill the file; its full mesh has one vertex more."""
    mean, faces = tube(rings=500, sides=20)
    vertices = len(mean)
    modes = max(1, (megabytes << 20) // (2 * vertices * 24))
    centre = mean[faces[0]].mean(0, keepdims=True)
    a, b, c = faces[0]
    fine_faces = numpy.concatenate([[[a, b, vertices], [b, c, vertices], [c, a, vertices]], faces[1:]])
    fine = numpy.concatenate([mean, centre])
    scale = 1 + 1e-3 * numpy.linspace(0.1, 1, 2 * modes)
    tensors = {
        "template": fine, "reference": fine, "faces": fine_faces.astype(numpy.int32),
        "coarse.kept": numpy.arange(vertices, dtype=numpy.int32), "coarse.faces": faces.astype(numpy.int32),
        "detail.row_begin": numpy.zeros(vertices + 2, numpy.int32), "detail.columns": numpy.zeros(0, numpy.int32),
        "detail.values": numpy.zeros(0), "mean": mean, "eigenvalues": numpy.linspace(1e-3, 5e-4, modes),
        "eigenvectors": numpy.eye(modes), "variations": (scale[:, None, None] * mean).reshape(-1, 3)}
    ended = {"termination": "converged", "iterations": 1, "residual": 1e-9}
    description = {"vertices": vertices + 1, "faces": len(fine_faces), "coarse_vertices": vertices, "modes": modes, "path_steps": 4,
                   "bending": 1e-3, "path_energy": "symmetric", "training_shapes": modes,
                   "training": {"mean": ended, "variations": ended, "seconds": 0}}
    manifest = {"kind": "shell_pga", "format_version": 1, "created_by": "load_time.py", "description": description}
    write_tensors(folder, manifest, tensors)


def drop(path):
    """Takes the file out of the page cache."""
    with open(path, "rb") as file:
        os.fsync(file.fileno())
        os.posix_fadvise(file.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)


def read(path):
    with open(path, "rb", buffering=0) as file:
        while file.read(1 << 20):
            pass


def digest(path):
    hashed = hashlib.sha256()
    with open(path, "rb", buffering=0) as file:
        while piece := file.read(1 << 20):
            hashed.update(piece)


def cpu_of(process):
    """CPU seconds that a process has used."""
    fields = pathlib.Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def timed(step, before=lambda: None, process="self"):
    """Medians of wall and CPU seconds."""
    wall, cpu = [], []
    for _ in range(REPEATS):
        before()
        begin, begin_cpu = time.monotonic(), cpu_of(process)
        step()
        wall.append(time.monotonic() - begin)
        cpu.append(cpu_of(process) - begin_cpu)
    return statistics.median(wall), statistics.median(cpu)


def main():
    megabytes = int(sys.argv[1]) if len(sys.argv) > 1 else 1024
    with tempfile.TemporaryDirectory(dir=sys.argv[2] if len(sys.argv) > 2 else None) as name:
        store = pathlib.Path(name) / "store"
        large_model(store / "models/large/1", megabytes)
        file = store / "models/large/1/tensors.safetensors"
        size = file.stat().st_size
        subprocess.run(["sync"], check=True)
        print(f"{size / 2**20:.0f} MiB of tensors, medians of {REPEATS}")
        rows = [("read, cold", timed(lambda: read(file), lambda: drop(file))),
                ("read, from the cache", timed(lambda: read(file))),
                ("SHA-256 (OpenSSL), from the cache", timed(lambda: digest(file)))]
        DaemonCase.daemon = Daemon(store, "--model-megabytes", "20000", "--longest-call", "3600")
        try:
            def load():
                result = DaemonCase.shapectl("load", "large")
                assert result.code == 0, result.out + result.err

            def unload():
                assert DaemonCase.shapectl("unload", "large").code == 0

            def forget():
                unload()
                drop(file)

            load()
            process = DaemonCase.daemon.process.pid
            rows += [("shapectl load, cold", timed(load, forget, process)),
                     ("shapectl load, from the cache", timed(load, unload, process))]
            status = pathlib.Path(f"/proc/{process}/status").read_text()
            resident = {line.split(":")[0]: int(line.split()[1]) / 1024 for line in status.splitlines()
                        if line.startswith(("RssAnon", "RssFile"))}
            model = DaemonCase.shapectl("models").json["models"][0]
        finally:
            DaemonCase.daemon.stop()
        for text, (wall, cpu) in rows:
            print(f"{text:36} {wall:8.2f} s wall {cpu:8.2f} s CPU {size / wall / 1e9:8.2f} GB/s")
        print(f"daemon: {resident['RssAnon']:.0f} MiB of its own, {resident['RssFile']:.0f} MiB mapped; "
              f"it says {json.dumps(model.get('memory_bytes', 0) / 2**20)} MiB")


if __name__ == "__main__":
    main()
