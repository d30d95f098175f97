#!/usr/bin/env python3
"""Runs chase-plan and chase-predict on every scene and checks the verdicts that their files promise
("Expected: VERDICT"), then on malformed scenes: one line that says what and where, exit 1.
scenes.py BIN_DIR SCENES_DIR"""
import json
import pathlib
import re
import subprocess
import sys
import tempfile

sys.path.append(str(pathlib.Path(__file__).resolve().parents[2] / "deploy/launcher"))
sys.dont_write_bytecode = True
import script  # noqa: E402

BALL = "  - {center: [[0, 0, 0]], shape: [1, 0, 0, 0, 1, 0, 0, 0, 1]}\n"


def run(program, file):
    return subprocess.run([str(program), str(file)], capture_output=True, text=True, timeout=30)


def check_scene(bin_dir, file):
    expected = re.search(r"Expected:\s+(?:#\s+)?([A-Z_]+)", file.read_text())
    if not expected:
        return f"{file.name}: does not say what it expects"
    program = "chase-predict" if file.name.startswith("predict_") else "chase-plan"
    answer = run(bin_dir / program, file)
    if answer.returncode != 0:
        return f"{file.name}: exit {answer.returncode}: {answer.stderr}"
    verdict = json.loads(answer.stdout)["verdict"]
    return None if verdict == expected[1] else f"{file.name}: {verdict} instead of {expected[1]}"


def malformed(plan, predict):
    """(program, scene, words that the answer must hold)"""
    def swap(text, old, new):
        assert old in text, old
        return text.replace(old, new, 1)

    def shape(old, new, *words):
        return ("chase-plan", swap(plan, old, new), ("obstacles[", "].shape") + words)

    row = "    - [5.0, 0.5, 0.0]\n"
    return [
        shape("[8.0, 0.0, 0.0]", "[-8.0, 0.0, 0.0]", "positive definite", "-8", "1/a^2"),
        shape("[8.0, 0.0, 0.0]", "[0.0, 0.0, 0.0]", "positive definite", "is 0"),
        shape("[6.0, 1.0, 0.0]", "[6.0, 2.0, 0.0]", "symmetric", "differ by 1"),
        shape("[6.0, 1.0, 0.0]", "[6.0, 1.0]", "2 entries", "3 numbers"),
        shape("[6.0, 1.0, 0.0]", "[6.0, .inf, 0.0]", ".inf", "finite"),
        ("chase-plan", swap(plan, "0.3, 1.6]", ".nan, 1.6]"), ("initial.p[1]", ".nan", "finite")),
        ("chase-plan", swap(plan, "0.3, 1.6]", "left, 1.6]"), ("initial.p[1]", "left", "number")),
        ("chase-plan", swap(plan, "horizon_s: 5.0", "horizon_s: 0"), ("horizon_s", "is 0", "60 s")),
        ("chase-plan", swap(plan, "horizon_s: 5.0", "horizon_s: -2"), ("horizon_s", "is -2")),
        ("chase-plan", swap(plan, "horizon_s: 5.0", "horizon_s: 61"), ("horizon_s", "is 61")),
        ("chase-plan", swap(plan, row, "    - [5.0, 0.5]\n"),
         ("target.coefficients[1]", "2 entries", "3 numbers")),
        ("chase-plan", swap(plan, row, 9 * row), ("target.coefficients", "11 entries", "1 to 8")),
        ("chase-plan", "horizon_s: 2\nobstacles:\n" + 2500 * BALL, ("obstacles", "2500", "2000")),
        ("chase-plan", "horizon_s: 2\nobstacles:\n" + 10**6 * BALL,
         ("obstacles", "MiB", "2000", "leave out")),
        ("chase-plan", "x: [", (":1:", "YAML")),
        ("chase-plan", "", ("map",)),
        ("chase-plan", plan + "\nfoo: 1\n", ("unknown key 'foo'", "known here", "horizon_s")),
        ("chase-plan", plan + "\nhorizon_s: 2\n", ("'horizon_s' is given twice",)),
        ("chase-plan", swap(plan, "skeletons: 8", "skeletons: 8, skeletons: 7"),
         ("'skeletons' is given twice",)),
        ("chase-plan", swap(plan, "skeletons: 8", "skeletons: 0"), ("skeletons", "0", "must be")),
        ("chase-plan", swap(plan, "skeletons: 8", "skeletonz: 8"), ("unknown key 'skeletonz'",)),
        ("chase-plan", predict, ("missing key 'initial'",)),
        ("chase-predict", plan, ("observations", "0 entries", "2 to 32")),
        ("chase-predict", swap(predict, "covariance: [[0.0025", "covariance: [[-0.0025"),
         ("observations[0].covariance", "positive definite", "variances")),
        ("chase-predict", swap(predict, "mean: [", "mean: [.nan, "), ("observations[0].mean",)),
        ("chase-predict", predict + "\npredictor: {degree: 12}\n", ("degree", "12", "1 to 7")),
    ]


def check_malformed(bin_dir, program, text, words):
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "scene.yaml"
        file.write_text(text)
        answer = run(bin_dir / program, file)
    lines = answer.stderr.splitlines()
    if answer.returncode == 1 and len(lines) == 1 and not answer.stdout:
        missing = [word for word in words if word not in lines[0]]
        return f"{lines[0]}: does not say {missing}" if missing else None
    return f"{words}: exit {answer.returncode}, {len(lines)} lines: {answer.stderr[:300]}"


def main():
    bin_dir, scenes = map(pathlib.Path, script.arguments(__doc__, 2, 2))
    files = sorted(scenes.glob("*.yaml"))
    bad = malformed((scenes / "pillars.yaml").read_text(),
                    (scenes / "predict_turn.yaml").read_text())
    problems = [check_scene(bin_dir, file) for file in files]
    problems += [check_malformed(bin_dir, *case) for case in bad]
    for problem in filter(None, problems):
        print(problem)
    print(f"{len(files)} scenes, {len(bad)} malformed ones, {len(list(filter(None, problems)))} problems")
    return 1 if any(problems) or not files else 0


if __name__ == "__main__":
    sys.exit(main())
