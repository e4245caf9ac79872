"""A daemon is offered ten times what it can do: how much of its best does it still do?

    SHAPED_BINARIES=build/release/bin SHAPED_SOURCE=. /usr/bin/python3 tests/benchmark/overload.py FOLDER [--seconds 60] [--times 10] \
        [--shapes MESH ... --modes 3 --coarse-vertices 60]

Starts a daemon of its own in FOLDER (which must not exist), with one solver thread on one processor; the clients have the others, as
they would have machines of their own. The peak is that of a closed loop; then as many times that come by themselves, with a deadline.
--shapes: meshes of one connectivity to train the model with, all but the last, which is then projected; else small tubes. Every call costs
gRPC some time, refused or not (on a busy processor here 0.3 ms, as does a health check): a tenth of the peak is lost to that alone when a
call takes less than some 25 ms to answer. Prints a JSON document: rates, how refusals went, and the daemon's processor time. Exit code 1 when the goodput is below nine tenths of
the peak, a refusal has another code or takes longer than 20 ms, or an admitted call was late.
"""

import argparse
import json
import os
import pathlib
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "end_to_end"))
from support import BINARIES, Daemon, tube, write_mesh, write_tubes  # noqa: E402

DEADLINE = 2  # [s]


def processor_seconds(process):
    fields = pathlib.Path(f"/proc/{process.pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


class Trial:
    def __init__(self, options):
        self.folder = options.folder
        self.folder.mkdir(parents=True)
        processors = sorted(os.sched_getaffinity(0))
        if len(processors) < 2:
            raise SystemExit("overload.py: wants two processors, one for the daemon and one for the clients")
        self.clients = ",".join(map(str, processors[1:]))
        self.daemon = Daemon(self.folder / "store", "--threads", "1", before=("taskset", "-c", str(processors[0])))
        *shapes, self.mesh = options.shapes or [*write_tubes(self.folder), write_mesh(self.folder / "unseen.obj", *tube(0.5, radius=0.31))]
        self.shapectl("train", "shell-pga", "tubes", *shapes, "--modes", options.modes, "--coarse-vertices", options.coarse_vertices)

    def shapectl(self, *words):
        return subprocess.run(["taskset", "-c", self.clients, BINARIES / "shapectl", "--server", self.daemon.address, *words],
                              check=True, stdout=subprocess.PIPE, text=True, timeout=900).stdout

    def load(self, *words):
        before = processor_seconds(self.daemon.process)
        result = json.loads(self.shapectl("--output", "json", "--timeout", str(DEADLINE), "bench", "project", "--model", "tubes", "--mesh",
                                          self.mesh, *words))
        result["daemon_processor_seconds"] = processor_seconds(self.daemon.process) - before
        return result


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--seconds", type=float, default=60)
    parser.add_argument("--times", type=float, default=10)
    parser.add_argument("--shapes", nargs="+")
    parser.add_argument("--modes", default="3")
    parser.add_argument("--coarse-vertices", default="60")
    options = parser.parse_args()
    trial = Trial(options)
    try:
        peak = trial.load("--concurrency", "4", "--seconds", "15")
        over = trial.load("--rate", str(options.times * peak["answers_per_second"]), "--concurrency", "3000", "--connections", "40",
                          "--seconds", str(options.seconds))
    finally:
        trial.daemon.stop()
    causes = {error["code"] for error in over["errors"]}
    ratio = over["good_per_second"] / peak["answers_per_second"]
    print(json.dumps({
        "peak_per_second": peak["answers_per_second"], "offered_per_second": over["sent"] / over["seconds"],
        "good_per_second": over["good_per_second"], "goodput_of_peak": ratio, "refused": over["refused"], "sent_late": over["late"],
        "refusal_seconds": over["refusals"], "codes": sorted(causes), "latency_seconds": over["latency"],
        "daemon_ms_per_answer_at_peak": 1e3 * peak["daemon_processor_seconds"] / peak["answered"],
        "daemon_ms_per_answer_and_its_refusals": 1e3 * over["daemon_processor_seconds"] / over["answered"]}, indent=1))
    # An admitted call that was late is an error of another code.
    met = ratio >= 0.9 and causes <= {"RESOURCE_EXHAUSTED"} and over["refusals"]["max"] <= 0.020
    return 0 if met else 1


if __name__ == "__main__":
    sys.exit(main())
