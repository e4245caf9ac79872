"""The Debian package: what is in it, and its life in a minimal Debian system: installed, run, upgraded, removed, purged."""

import contextlib
import re
import shutil
import subprocess
import unittest

from system import WORK, base_system, needs, package, run

ROOT = WORK / "root"


def field(deb, name):
    return run("dpkg-deb", "-f", deb, name).stdout.strip()


class Package(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        needs("debootstrap", "dpkg-shlibdeps", root=True)
        cls.deb = package()
        base = base_system()
        cls.leave_system()
        run("cp", "-a", base, ROOT)
        cls.addClassCleanup(cls.leave_system)
        run("mount", "-t", "proc", "proc", ROOT / "proc")
        # As on any server: nothing starts while packages are configured in a chroot.
        (ROOT / "usr/sbin/policy-rc.d").write_text("#!/bin/sh\nexit 101\n")
        (ROOT / "usr/sbin/policy-rc.d").chmod(0o755)
        shutil.copy("/etc/resolv.conf", ROOT / "etc/resolv.conf")
        cls.inside("apt-get", "update", "-qq")

    @classmethod
    def leave_system(cls):
        if (ROOT / "proc/self").exists():
            run("umount", ROOT / "proc")
        if ROOT.exists():
            run("rm", "-rf", "--one-file-system", ROOT)

    @classmethod
    def inside(cls, *words, check=True, user=None):
        who = [f"--userspec={user}:{user}"] if user else []
        return run("chroot", *who, ROOT, "/usr/bin/env", "DEBIAN_FRONTEND=noninteractive", "LC_ALL=C.UTF-8", *words, check=check)

    def install(self):
        shutil.copy(self.deb, ROOT / "tmp/shaped.deb")
        self.inside("apt-get", "install", "-qq", "-y", "--no-install-recommends", "--reinstall",
                    "-o", "Dpkg::Options::=--force-confdef", "-o", "Dpkg::Options::=--force-confold", "/tmp/shaped.deb")

    def test_1_its_contents(self):
        depends = field(self.deb, "Depends")
        for library in ("libgrpc++1.51", "libopenblas0", "libsqlite3-0", "libssl3", "adduser"):
            self.assertIn(library, depends)
        self.assertNotIn("-dev", depends)
        self.assertRegex(field(self.deb, "Version"), r"^\d+\.\d+\.\d+$")
        listing = run("dpkg-deb", "-c", self.deb).stdout
        for path in ("./usr/bin/shaped", "./usr/bin/shapectl", "./etc/shaped/shaped.yaml", "./usr/lib/systemd/system/shaped.service",
                     "./usr/share/doc/shaped/copyright", "./usr/share/doc/shaped/copyright.suitesparse",
                     "./usr/share/shaped/proto/shaped/v1/shapes.proto",
                     "./usr/share/shaped/monitoring/shaped-rules.yml", "./usr/share/shaped/load-balancing/nginx.conf"):
            self.assertRegex(listing, re.escape(path) + "\n")
        self.assertTrue(all(" root/root " in line for line in listing.splitlines()), listing)

    def test_1_the_trainer_is_a_package_of_its_own(self):
        self.assertNotIn("libtorch", field(self.deb, "Depends"))
        self.assertNotIn("shaped-trainer", run("dpkg-deb", "-c", self.deb).stdout)
        made = list(self.deb.parent.glob("shaped-trainer_*.deb"))
        if not (self.deb.parents[1] / "bin/shaped-trainer").exists():
            self.assertEqual(made, [])
            return
        self.assertIn("libtorch1", field(made[0], "Depends"))
        self.assertRegex(run("dpkg-deb", "-c", made[0]).stdout, r"\./usr/bin/shaped-trainer\n")

    def test_2_it_installs_and_runs(self):
        self.install()
        self.assertEqual(self.inside("stat", "-c", "%U:%G:%a", "/var/lib/shaped").stdout, "shaped:shaped:750\n")
        self.assertIn("in order", self.inside("shaped", "--check", "--config", "/etc/shaped/shaped.yaml", user="shaped").stdout)
        self.assertEqual(self.inside("shapectl", "--timeout", "2", "--server", "127.0.0.1:1", "health", check=False).returncode, 4)
        with self.daemon() as address:
            self.assertIn("serving", self.inside("shapectl", "--server", address, "health").stdout)
            self.inside("shapectl", "sample", "/tmp/sample", "--poses", "4")
            self.inside("shapectl", "--server", address, "train", "shell-pga", "creature", "--template", "/tmp/sample/template.ply",
                        "--frames", "/tmp/sample/poses.npy", "--coarse-vertices", "60", "--modes", "2")
        with self.daemon() as address:
            self.assertIn("creature@1", self.inside("shapectl", "--server", address, "models").stdout)

    def test_3_an_upgrade_keeps_what_the_operator_wrote(self):
        config = ROOT / "etc/shaped/shaped.yaml"
        config.write_text(config.read_text().replace("grace: 5", "grace: 7"))
        self.install()
        self.assertIn("grace: 7", config.read_text())

    def test_4_removal_keeps_models_and_a_purge_takes_them(self):
        self.inside("apt-get", "remove", "-qq", "-y", "shaped")
        self.assertFalse((ROOT / "usr/bin/shaped").exists())
        self.assertTrue((ROOT / "etc/shaped/shaped.yaml").exists())
        self.assertTrue((ROOT / "var/lib/shaped/models/creature/1").exists())
        self.inside("apt-get", "purge", "-qq", "-y", "shaped")
        for path in ("etc/shaped", "var/lib/shaped", "usr/share/doc/shaped", "usr/share/shaped"):
            self.assertFalse((ROOT / path).exists(), path)
        self.assertNotEqual(self.inside("getent", "passwd", "shaped", check=False).returncode, 0)

    @contextlib.contextmanager
    def daemon(self):
        """The installed daemon, as its own user with its own configuration but for the port; its address."""
        process = subprocess.Popen(["chroot", "--userspec=shaped:shaped", ROOT, "/usr/bin/shaped", "--config",
                                    "/etc/shaped/shaped.yaml", "--listen", "127.0.0.1:0"], stderr=subprocess.PIPE, text=True)
        try:
            lines = []
            for line in process.stderr:
                lines.append(line)
                if "listening on" in line:
                    break
            else:
                self.fail("the daemon did not start: " + "".join(lines))
            yield re.search(r"listening on (\S+),", lines[-1]).group(1)
        finally:
            process.terminate()
            process.stderr.read()
            process.stderr.close()
            self.assertEqual(process.wait(timeout=60), 0)


if __name__ == "__main__":
    unittest.main()
