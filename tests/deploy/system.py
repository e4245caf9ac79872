"""A minimal Debian system, the package, and the skipping of what this machine cannot test."""

import contextlib
import fcntl
import os
import pathlib
import shutil
import subprocess
import sys
import unittest

SOURCE = pathlib.Path(os.environ["SHAPED_SOURCE"])
BUILD = pathlib.Path(os.environ["SHAPED_BINARIES"]).parent
WORK = BUILD / "deploy"
MIRROR = os.environ.get("SHAPED_DEBIAN_MIRROR", "http://deb.debian.org/debian")
SOURCES = f"""deb {MIRROR} bookworm main
deb {MIRROR} bookworm-updates main
deb {MIRROR}-security bookworm-security main
"""

# Of one step [s]: a machine that does other things too may take minutes over it.
PATIENCE = 1200


def run(*words, check=True, **options):
    """Runs a command; what it printed is shown when it fails."""
    done = subprocess.run(list(map(str, words)), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          timeout=options.pop("timeout", PATIENCE), stdin=subprocess.DEVNULL, **options)
    if check and done.returncode != 0:
        raise AssertionError(f"{' '.join(map(str, words))} ended with {done.returncode}:\n{done.stdout[-6000:]}")
    return done


def needs(*programs, root=False):
    """Skips the test, loudly, where a program is missing."""
    missing = [f"{name} is not installed" for name in programs if not find(name)]
    if root and os.geteuid() != 0:
        missing.append("it takes root")
    if missing:
        skip(", ".join(missing) + " (deploy/install-deps --all)")


def skip(reason):
    print(f"\nSKIPPED, so that it is NOT tested: {reason}", file=sys.stderr, flush=True)
    raise unittest.SkipTest(reason)


def find(program):
    return shutil.which(program, path=os.environ.get("PATH", "") + ":/usr/sbin:/sbin")


@contextlib.contextmanager
def alone(name):
    """One process at a time, of those that share a build folder."""
    WORK.mkdir(exist_ok=True)
    with open(WORK / f"{name}.lock", "w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield


def base_system():
    """A folder with Debian 12 and nothing beyond it, made once a build folder. Skips the test where it cannot be made, without a
    mirror in reach or the right to mount: that says nothing of ours."""
    base = WORK / "base"
    with alone("base"):
        if not base.exists():
            new = WORK / "base.new"
            shutil.rmtree(new, ignore_errors=True)
            made = run("debootstrap", "--variant=minbase", "bookworm", new, MIRROR, check=False)
            if made.returncode != 0:
                skip(f"debootstrap ended with {made.returncode}: {made.stdout[-1000:]}")
            (new / "etc/apt/sources.list").write_text(SOURCES)
            run("chroot", new, "apt-get", "clean")
            new.rename(base)
    return base


def package():
    """The Debian package of the programs as they are built; made where it is older than what goes into it."""
    with alone("package"):
        made = list((BUILD / "package").glob("shaped_*.deb"))
        if len(made) != 1 or made[0].stat().st_mtime < latest_change():
            for old in (BUILD / "package").glob("*.deb"):
                old.unlink()
            run("cpack", "--config", BUILD / "CPackConfig.cmake", cwd=BUILD)
            made = list((BUILD / "package").glob("shaped_*.deb"))
    (deb,) = made
    return deb


def latest_change():
    files = [BUILD / "CPackConfig.cmake", BUILD / "bin/shaped", BUILD / "bin/shapectl"]
    for folder in ("deploy", "docs", "proto"):
        files += [path for path in (SOURCE / folder).rglob("*") if path.is_file()]
    return max(path.stat().st_mtime for path in files)
