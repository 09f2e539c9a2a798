#!/usr/bin/python3
"""The program `measure`: what it lists, what it refuses, and that documentation and scripts name what it has.

    tests/bench/measure_test.py SOURCE_DIR MEASURE [SEED]
"""
import pathlib
import random
import re
import string
import subprocess
import sys

MENTIONED = re.compile(r"(?:`|tests/bench/|\"\$)measure\"? ([a-z][a-z-]+)")


def run(measure, *words):
    return subprocess.run([measure, *words], stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=60)


def check(holds, what):
    if not holds:
        sys.exit(f"measure_test: {what}")


def check_refused(done, beginning, what):
    check(done.returncode == 2, f"{what}: exit code {done.returncode}")
    check(done.stdout == "" and done.stderr.count("\n") == 1, f"{what}: not one line: {done.stdout}{done.stderr}")
    check(done.stderr.startswith(beginning), f"{what}: {done.stderr}")


def edited(name, draw):
    """Returns a name with one letter left out, replaced, or swapped with its neighbour."""
    at = draw.randrange(len(name) - 1)
    letter = draw.choice(string.ascii_lowercase)
    return draw.choice([name[:at] + name[at + 1:], name[:at] + letter + name[at + 1:],
                        name[:at] + name[at + 1] + name[at] + name[at + 2:]])


def mentioned(root):
    """Returns the names of measurements in documentation, scripts and sources."""
    files = subprocess.run(["git", "ls-files", "*.md", "*.cpp", "*.h", "scripts"], cwd=root, capture_output=True,
                           text=True).stdout.split()
    paths = [root / file for file in files] or list(root.rglob("*.md")) + list((root / "scripts").iterdir())
    return {name: path for path in paths if path.is_file() for name in MENTIONED.findall(path.read_text(errors="ignore"))}


def main():
    root, measure = pathlib.Path(sys.argv[1]), sys.argv[2]
    seed = int(sys.argv[3]) if len(sys.argv) > 3 else random.randrange(10**6)
    print(f"seed {seed}")
    draw = random.Random(seed)

    listed = run(measure)
    check(listed.returncode == 0 and listed.stdout == run(measure, "--help").stdout, "no list without a name")
    names = re.findall(r"^([a-z][a-z-]+)  +\S", listed.stdout, re.MULTILINE)
    check(len(names) > 15 and len(names) == len(set(names)), f"listed are {names}")

    for name in names:
        word = "--" + "".join(draw.choices(string.ascii_lowercase, k=9))
        check_refused(run(measure, name, word), f"measure {name}: ", f"{name} {word}")
        other = edited(name, draw)
        if other in names:
            continue
        done = run(measure, other)
        check_refused(done, f"measure: unknown measurement '{other}'", other)
        check(name in done.stderr, f"{other}: does not suggest {name}: {done.stderr}")
    for name, words in {"unpack": ["--rounds"], "sampler": ["--rounds", str(draw.randrange(15))], "stars": ["2"],
                        "temporal": ["5", "6"], "planner": ["saved"], "retarget": ["--display", "2"],
                        "stage": ["--threads", "3"]}.items():
        check_refused(run(measure, name, *words), f"measure {name}: ", f"{name} {words}")

    found = mentioned(root)
    for name, path in found.items():
        check(name in names, f"{path.relative_to(root)} names {name}")
    for name in names:
        check(name in found, f"no page or script names {name}")

    done = run(measure, "unpack", "--rounds", "15")
    check(done.returncode == 0, f"unpack: exit code {done.returncode}: {done.stderr}")
    rows = re.findall(r"^(\S.*?) +\d+ x \d+ \|((?: +[\d.]+){4})$", done.stdout, re.MULTILINE)
    check(len(rows) == 16 and all(float(v) > 0 for _, values in rows for v in values.split()), f"unpack: {done.stdout}")
    print(f"{len(names)} measurements, {len(found)} named in documentation and scripts")


if __name__ == "__main__":
    main()
