"""What the tests of the Python package share. They run with the package in PYTHONPATH and LOWLUX naming the command."""
import os
import pathlib
import subprocess

import pytest

RAWS = pathlib.Path(__file__).resolve().parents[2] / "testdata" / "raws"


@pytest.fixture(scope="session")
def command():
    """Return a function that runs the command and returns its stdout, or its stderr where it is to fail."""

    def run(*words, fails=False):
        done = subprocess.run([os.environ["LOWLUX"], *map(str, words)], capture_output=True, text=True, check=False)
        assert (done.returncode != 0) == fails, done.stderr
        return done.stderr if fails else done.stdout

    return run


@pytest.fixture(scope="session")
def raws():
    """Return the folder of raw files."""
    return RAWS


@pytest.fixture(scope="session")
def night(tmp_path_factory, command):
    """Return a simulated raw file of a chart at night."""
    path = tmp_path_factory.mktemp("night") / "night.dng"
    command("simulate", "chart", "--size", "240x160", "--luminance", "0.3", "--seed", "3", "--no-truth", "--quiet", "-o",
            path)
    return path


@pytest.fixture
def rng(request):
    """Return a random generator whose seed depends on the test's name; it is printed when a test fails."""
    seed = sum(map(ord, request.node.name))
    print("seed", seed)
    import numpy as np
    return np.random.default_rng(seed)


@pytest.fixture(scope="session")
def burst(tmp_path_factory, command):
    """Return four simulated raw files of one scene, by hand."""
    folder = tmp_path_factory.mktemp("burst")
    command("simulate", "chart", "--size", "240x160", "--luminance", "0.3", "--frames", "4", "--shake", "3", "--seed", "5",
            "--no-truth", "--quiet", "-o", folder / "f.dng")
    return sorted(folder.glob("f_*.dng"))
