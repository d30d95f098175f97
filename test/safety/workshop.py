"""A copy of the work tree in which lines are changed, built and tested; never the tree itself."""

import contextlib
import fcntl
import os
import shutil
import subprocess

import tree

# As in deploy/build: else nothing is cached where headers are precompiled.
SLOPPINESS = "pch_defines,time_macros,include_file_mtime,include_file_ctime"
OPTIONS = ("-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release", "-DCHASE_WERROR=OFF")
LIMIT = 180  # s for one test: the slowest takes 30 s; what goes on for ever counts as noticed
BUILD_LIMIT = 1800  # s
SKIPPED = 77  # exit code of a test program that did not fail, though it did not run all of its tests (test/main.cpp)


MARK = ".chase-safety"  # in folders that are ours to change


class Broken(RuntimeError):
    """What has been asked for cannot be had; of a change: it does not compile."""


class Workshop:
    def __init__(self, folder, jobs):
        self.root, self.jobs = folder, str(jobs)
        self.build = folder / "build"

    @contextlib.contextmanager
    def mine(self):
        """The folder is new or of an earlier run, and nobody else's for now."""
        self.root.mkdir(parents=True, exist_ok=True)
        if any(self.root.iterdir()) and not (self.root / MARK).is_file():
            raise Broken(f"{self.root} is not empty and no copy of an earlier run")
        with open(self.root / MARK, "a", encoding="utf-8") as mark:
            try:
                fcntl.flock(mark, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError as error:
                raise Broken(f"another run works in {self.root}; give --tree") from error
            yield

    def prepare(self):
        """The copy as the tree is now; what has not changed keeps its time stamp."""
        wanted = tree.files()
        for path in wanted:
            copy_if_changed(tree.ROOT / path, self.root / path)
        for path in set(self.sources()) - {self.root / path for path in wanted}:
            path.unlink()
        for path in wanted:
            if path.name == "package.json":
                link(tree.ROOT / path.parent / "node_modules", self.root / path.parent / "node_modules")
        launcher = ["-DCMAKE_CXX_COMPILER_LAUNCHER=ccache"] if shutil.which("ccache") else []
        self.call("cmake", "-S", self.root, "-B", self.build, *OPTIONS, *launcher)

    def sources(self):
        for path in self.root.rglob("*"):
            if path.is_file() and self.build not in path.parents and path.name != MARK:
                yield path

    def call(self, *command):
        environment = dict(os.environ, CCACHE_BASEDIR=str(self.root), CCACHE_SLOPPINESS=SLOPPINESS)
        answer = subprocess.run([str(c) for c in command], cwd=self.root, env=environment,
                                timeout=BUILD_LIMIT, capture_output=True, text=True, check=False)
        if answer.returncode:
            raise Broken((answer.stdout + answer.stderr)[-1500:])

    def make(self, *programs):
        self.call("nice", "ninja", "-j", self.jobs, "-C", self.build, *programs)

    def fails(self, program, case=""):
        """Does the test, built as the copy is now, fail? None: it runs nothing."""
        command = [self.build / "test" / program, f"--gtest_filter={case or '*'}", "--gtest_fail_fast"]
        try:
            answer = subprocess.run([str(c) for c in command], cwd=self.root, timeout=LIMIT,
                                    capture_output=True, text=True, errors="replace", check=False)
        except subprocess.TimeoutExpired:
            return True
        if "Running 0 tests" in answer.stdout:
            return None
        return answer.returncode not in (0, SKIPPED)

    @contextlib.contextmanager
    def changed(self, file, change):
        """The file holds what `change` makes of its text for a while."""
        path = self.root / file
        before = path.read_text(encoding="utf-8")
        path.write_text(change(before), encoding="utf-8")
        try:
            yield
        finally:
            path.write_text(before, encoding="utf-8")


def link(packages, copy):
    """To packages that are there, if they are."""
    if copy.is_symlink():
        copy.unlink()
    if packages.is_dir() and not copy.exists():
        copy.symlink_to(packages)


def copy_if_changed(source, target):
    if target.is_file() and target.read_bytes() == source.read_bytes():
        return
    target.parent.mkdir(parents=True, exist_ok=True)
    shutil.copy(source, target)
