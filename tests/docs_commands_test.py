#!/usr/bin/python3
"""Fails on a command of README.md or docs/ with an option that lowlux does not have, and on a chain of commands that does
not run as it stands.

    tests/docs_commands_test.py SOURCE_DIR LOWLUX
"""
import os
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile

# Sections of docs/using.md that make their own files: their blocks of commands, in the order in which they are run.
CHAINS = {"Calibrate": (1, 0)}


def blocks_of(text):
    """@return blocks of indented lines, each as one text"""
    found = re.findall(r"(?:^    .*\n)+", text, re.MULTILINE)
    return ["".join(line[4:] for line in block.splitlines(keepends=True)) for block in found]


def section(text, title):
    return re.search(rf"^## {title}\n(.*?)(?=^## |\Z)", text, re.DOTALL | re.MULTILINE).group(1)


def commands_of(block):
    """@return words of each command lowlux of a block, without comments and what follows a pipe"""
    lines = block.replace("\\\n", " ").splitlines()
    found = [shlex.split(line, comments=True) for line in lines if re.match(r"\s*lowlux ", line)]
    return [words[1:words.index("|")] if "|" in words else words[1:] for words in found]


def options_of(lowlux, verb, known):
    if verb not in known:
        text = subprocess.run([lowlux, *verb, "--help-all"], check=True, capture_output=True, text=True).stdout
        known[verb] = set(re.findall(r"^  (?:-\w, )?(--[\w-]+)", text, re.MULTILINE)) | {"-o", "-h", "-v"}
    return known[verb]


def faults_of(lowlux, words, known):
    """@return options of a command that its verb does not have"""
    if words[0].startswith("-") or words[0] in ("help", "VERB"):
        return []
    verb = tuple(words[:2]) if words[0] == "calibrate" else (words[0],)
    given = [word.split("=")[0] for word in words if re.match(r"--?[a-z]", word)]
    return [option for option in given if option not in options_of(lowlux, verb, known)]


def run_chain(root, lowlux, blocks):
    with tempfile.TemporaryDirectory() as folder:
        os.symlink(root / "testdata", pathlib.Path(folder, "testdata"))
        os.symlink(pathlib.Path(lowlux).resolve(), pathlib.Path(folder, "lowlux"))
        environment = {**os.environ, "PATH": f"{folder}:{os.environ['PATH']}", "XDG_CONFIG_HOME": folder}
        for block in blocks:
            done = subprocess.run(["bash", "-euc", block], cwd=folder, env=environment, capture_output=True, text=True)
            if done.returncode != 0:
                return f"exit status {done.returncode} of\n{block}{done.stderr}"
    return None


def main():
    root, lowlux = pathlib.Path(sys.argv[1]).resolve(), sys.argv[2]
    known, count, faults = {}, 0, []
    for path in (root / "README.md", *sorted((root / "docs").glob("*.md"))):
        for block in blocks_of(path.read_text()):
            for words in commands_of(block):
                count += 1
                faults += [f"{path.name}: lowlux {words[0]} has no {o}" for o in faults_of(lowlux, words, known)]
    text = (root / "docs/using.md").read_text()
    for title, order in CHAINS.items():
        blocks = blocks_of(section(text, title))
        fault = run_chain(root, lowlux, [blocks[i] for i in order])
        faults += [f"using.md: {title}: {fault}"] if fault else []
    print("\n".join([*faults, f"{count} commands of documents, {len(CHAINS)} chains run, {len(faults)} faults"]))
    sys.exit(1 if faults or count < 40 else 0)


if __name__ == "__main__":
    main()
