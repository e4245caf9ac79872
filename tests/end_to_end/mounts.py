"""File systems of a test's own: small ones, and ones that become read-only."""

import pathlib
import subprocess
import tempfile

from support import skip_loudly


def run(*words):
    """Runs a command of the system; skips the test where that is not allowed."""
    done = subprocess.run([*map(str, words)], capture_output=True, text=True, timeout=60)
    if done.returncode != 0:
        skip_loudly(f"{' '.join(map(str, words))}: {done.stderr.strip()}")


class Mount:
    """A file system that is there until the test ends."""

    def __init__(self, test, *how):
        folder = tempfile.mkdtemp()
        test.addCleanup(pathlib.Path(folder).rmdir)
        self.path, self.how = pathlib.Path(folder), how
        self.mount()
        test.addCleanup(self.unmount)

    def mount(self):
        run("mount", *self.how, self.path)

    def unmount(self):
        # Lazily: a process that a failed test left behind must not keep it.
        subprocess.run(["umount", "-l", self.path], check=False, capture_output=True, timeout=60)

    def remount(self, how):
        run("mount", "-o", "remount," + how, self.path)


def memory(test, kilobytes):
    """One that is full soon."""
    return Mount(test, "-t", "tmpfs", "-o", f"size={kilobytes}k", "tmpfs")


class Disk(Mount):
    """An ext4 in a file, which the kernel can be told to find broken: it then lets nobody write, open files or not."""

    def __init__(self, test, folder, megabytes):
        self.image = folder / "disk.img"
        with open(self.image, "wb") as file:
            file.truncate(megabytes << 20)
        run("mkfs.ext4", "-q", self.image)
        super().__init__(test, "-o", "loop", self.image)

    def fail(self):
        self.remount("abort")

    def repair(self):
        """Nobody may have files open on it."""
        run("umount", self.path)
        done = subprocess.run(["fsck.ext4", "-p", self.image], capture_output=True, text=True, timeout=60)
        assert done.returncode in (0, 1), done.stdout + done.stderr
        self.mount()
