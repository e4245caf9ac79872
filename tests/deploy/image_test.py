"""deploy/Dockerfile, built and run for real, without an engine: buildah, with chroot for isolation, on a base that debootstrap makes.
With SHAPED_FULL_IMAGE set it compiles inside the image's build stage; otherwise it installs the package of what is built."""

import json
import os
import pathlib
import shutil
import signal
import subprocess
import tempfile
import unittest

import yaml

from system import SOURCE, WORK, base_system, needs, package, run

LARGEST_IMAGE = 150e6  # [bytes] without the trainer
STORAGE = WORK / "containers"


def buildah(*words, **options):
    return run("buildah", "--root", STORAGE / "root", "--runroot", STORAGE / "run", "--storage-driver", "vfs", *words, **options)


def descendants(parent):
    """Process ids below a process."""
    found = []
    for stat in pathlib.Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rsplit(")", 1)[1].split()
        except OSError:
            continue
        if int(fields[1]) == parent:
            child = int(stat.parent.name)
            found += [child, *descendants(child)]
    return found


class Image(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        needs("buildah", "debootstrap", root=True)
        shutil.rmtree(STORAGE, ignore_errors=True)
        cls.addClassCleanup(shutil.rmtree, STORAGE, ignore_errors=True)
        cls.addClassCleanup(lambda: buildah("rm", "--all"))
        cls.import_base()
        cls.build()
        cls.container = buildah("from", "--pull-never", "localhost/shaped").stdout.split()[-1]
        cls.root = pathlib.Path(buildah("mount", cls.container).stdout.split()[-1])
        inspected = json.loads(buildah("inspect", "--type", "image", "localhost/shaped").stdout)
        cls.config = inspected["Docker"]["config"]

    @classmethod
    def import_base(cls):
        container = buildah("from", "scratch").stdout.split()[-1]
        buildah("copy", container, base_system(), "/")
        buildah("commit", "--rm", container, "localhost/shaped-base")

    @classmethod
    def build(cls):
        how = [] if os.environ.get("SHAPED_FULL_IMAGE") else ["--build-arg", f"PACKAGE={package().relative_to(SOURCE)}"]
        buildah("bud", "--isolation", "chroot", "--format", "docker", "--pull-never", "--build-arg", "BASE=localhost/shaped-base",
                *how, "-f", SOURCE / "deploy/Dockerfile", "-t", "localhost/shaped", SOURCE, timeout=7200)

    def in_image(self, *words, user="10001:10001", options=()):
        """The words of a command that runs inside the image. An engine would take the user from the image itself."""
        return ["buildah", "--root", STORAGE / "root", "--runroot", STORAGE / "run", "--storage-driver", "vfs", "run", "--isolation",
                "chroot", "--user", user, *options, self.container, "--", *words]

    def test_it_is_small_and_holds_no_more_than_it_needs(self):
        files = [path for path in self.root.rglob("*") if path.is_file() and not path.is_symlink()]
        size = sum(path.stat().st_size for path in files)
        print(f"\nthe image holds {len(files)} files, {size / 1e6:.1f} MB", flush=True)
        self.assertLess(size, LARGEST_IMAGE)
        names = {path.name for path in files}
        for unwanted in ("sh", "bash", "dpkg", "apt-get", "perl", "cc1plus", "ld.bfd"):
            self.assertNotIn(unwanted, names)
        self.assertEqual([path for path in files if path.stat().st_mode & 0o6000], [])
        self.assertEqual([path for path in files if path.suffix in (".a", ".h")], [])
        for needed in ("usr/share/doc/shaped/copyright", "usr/share/doc/shaped/copyright.suitesparse", "etc/ssl/certs/ca-certificates.crt"):
            self.assertTrue((self.root / needed).is_file(), needed)

    def test_it_says_how_to_be_run(self):
        self.assertEqual(self.config["User"], "10001:10001")
        self.assertEqual(sorted(self.config["ExposedPorts"]), ["50051/tcp", "9464/tcp"])
        self.assertEqual(list(self.config["Volumes"]), ["/var/lib/shaped"])
        self.assertEqual(self.config["StopSignal"], "SIGTERM")
        self.assertEqual(self.config["Healthcheck"]["Test"], ["CMD", "/usr/bin/shapectl", "--timeout", "4", "health"])
        run(*self.in_image(*self.config["Entrypoint"], "--check", *self.config["Cmd"]))

    def test_it_serves_keeps_its_store_and_stops(self):
        with tempfile.TemporaryDirectory() as volume:
            os.chown(volume, 10001, 10001)
            address = self.serve_once(volume, self.train)
            self.assertEqual(self.health(address).returncode, 4)
            self.serve_once(volume, lambda address: self.assertIn("creature@1", self.shapectl(address, "models").stdout))

    def serve_once(self, volume, use):
        """Starts the image with its own command on free ports, waits until it is healthy, uses it, stops it; its address."""
        words = [word.replace(":50051", ":0").replace(":9464", ":0") for word in self.config["Entrypoint"] + self.config["Cmd"]]
        process = subprocess.Popen(list(map(str, self.in_image(*words, options=("-v", f"{volume}:/var/lib/shaped")))),
                                   stderr=subprocess.PIPE, text=True)
        self.addCleanup(self.end, process)
        address = "127.0.0.1:" + self.listening_line(process).split("listening on ")[1].split(",")[0].rsplit(":", 1)[1]
        self.assertEqual(self.health(address).returncode, 0)
        daemon = self.daemon_of(process)
        self.assertEqual(os.stat(f"/proc/{daemon}").st_uid, 10001)
        use(address)
        os.kill(daemon, signal.SIGTERM)
        self.assertEqual(process.wait(timeout=60), 0)
        return address

    def end(self, process):
        """Whatever still runs of it: buildah passes no signal on."""
        for each in [*descendants(process.pid), process.pid]:
            if process.poll() is None:
                os.kill(each, signal.SIGKILL)
        process.wait()
        process.stderr.close()

    def listening_line(self, process):
        for line in process.stderr:
            if "listening on" in line:
                return json.loads(line)["message"]
        self.fail("the daemon in the image did not start")

    def daemon_of(self, process):
        for child in descendants(process.pid):
            if os.readlink(f"/proc/{child}/exe").endswith("/usr/bin/shaped"):
                return child
        self.fail("no daemon runs")

    def health(self, address):
        """The image's own health check."""
        return run(*self.in_image(*self.config["Healthcheck"]["Test"][1:], options=("--env", f"SHAPED_SERVER={address}")), check=False)

    def shapectl(self, address, *words):
        return run(*self.in_image("/usr/bin/shapectl", "--server", address, *words))

    def train(self, address):
        self.shapectl(address, "sample", "/tmp/sample", "--poses", "4")
        self.shapectl(address, "train", "shell-pga", "creature", "--template", "/tmp/sample/template.ply", "--frames",
                      "/tmp/sample/poses.npy", "--coarse-vertices", "60", "--modes", "2")
        self.shapectl(address, "project", "creature", "/tmp/sample/template.ply", "-o", "/tmp/projected.ply")
        self.shapectl(address, "render", "/tmp/projected.ply", "-o", "/tmp/projected.png")


class Compose(unittest.TestCase):
    def test_its_files_and_options_exist(self):
        compose = yaml.safe_load((SOURCE / "deploy/compose.yaml").read_text())
        services = compose["services"]
        self.assertEqual(sorted(services), ["grafana", "prometheus", "shaped"])
        for name, service in services.items():
            self.assertTrue(all(port.startswith("127.0.0.1:") for port in service["ports"]), name)
            for volume in service.get("volumes", ()):
                source = volume.split(":")[0]
                if source.startswith("."):
                    self.assertTrue((SOURCE / "deploy" / source).exists(), source)
                else:
                    self.assertIn(source, compose["volumes"])
        build = services["shaped"]["build"]
        self.assertTrue((SOURCE / "deploy" / build["context"] / build["dockerfile"]).is_file())
        binaries = pathlib.Path(os.environ["SHAPED_BINARIES"])
        run(binaries / "shaped", "--check", "--store", "/tmp/none", *services["shaped"]["command"])

    def test_prometheus_and_grafana_find_each_other(self):
        monitoring = SOURCE / "deploy/monitoring"
        compose = yaml.safe_load((monitoring / "prometheus.compose.yml").read_text())
        plain = yaml.safe_load((monitoring / "prometheus.yml").read_text())
        self.assertEqual(compose["scrape_configs"][0]["static_configs"], [{"targets": ["shaped:9464"]}])
        for config in (compose, plain):
            del config["scrape_configs"][0]["static_configs"]
        self.assertEqual(compose, plain)
        (source,) = yaml.safe_load((monitoring / "grafana/datasource.yaml").read_text())["datasources"]
        self.assertEqual((source["type"], source["url"]), ("prometheus", "http://prometheus:9090"))
        (provider,) = yaml.safe_load((monitoring / "grafana/dashboards.yaml").read_text())["providers"]
        volumes = yaml.safe_load((SOURCE / "deploy/compose.yaml").read_text())["services"]["grafana"]["volumes"]
        self.assertTrue(any(volume.split(":")[1].startswith(provider["options"]["path"]) for volume in volumes))


if __name__ == "__main__":
    unittest.main()
