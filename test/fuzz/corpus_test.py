"""What fuzzing begins with is accepted today: corpus_test.py BIN_DIR. An older input is refused at its first unknown
key, and so is all that is made of it; test/fuzz/make_corpus makes them anew."""

import pathlib
import subprocess
import sys
import tempfile
import unittest

BIN = pathlib.Path(sys.argv[1]).resolve()
ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "deploy" / "launcher"))

import processes  # noqa: E402


def inputs(target):
    files = [file for file in (ROOT / "test" / "fuzz" / "corpus" / target).iterdir() if not file.name.startswith("found_")]
    assert files, target
    return sorted(files)


class Corpus(unittest.TestCase):
    def assert_taken(self, *command):
        answer = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
        self.assertEqual((answer.returncode, answer.stderr), (0, ""))

    def test_scenarios(self):
        for file in inputs("scenario"):
            with self.subTest(file=file.name):
                self.assert_taken(BIN / "chase-scenario", file)

    def test_configurations(self):
        with tempfile.TemporaryDirectory() as folder:
            for file in inputs("config"):
                with self.subTest(service=file.name):
                    config = pathlib.Path(folder) / file.name
                    config.write_text(file.read_text(encoding="utf-8").partition("\n")[2], encoding="utf-8")
                    self.assert_taken(BIN / f"chase-{file.name}", "--config", config, "--dump-config")

    def test_process_tables(self):
        for file in inputs("processes"):
            with self.subTest(file=file.name):
                processes.read_table(file.read_bytes(), file.name)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
