"""The examples of docs/python.md, as they stand."""
import os
import pathlib
import re

import pytest

PAGE = pathlib.Path(__file__).resolve().parents[2] / "docs" / "python.md"


def examples():
    """Return the examples with their headings; blocks that continue one are part of it."""
    found, heading = [], ""
    for match in re.finditer(r"^## ([^\n]+)$|^```python( continued)?\n(.*?)^```$", PAGE.read_text(), re.MULTILINE | re.DOTALL):
        if match[1]:
            heading = match[1]
        elif match[2]:
            found[-1] = (heading, found[-1][1] + match[3])
        else:
            found.append((heading, match[3]))
    return found


@pytest.mark.parametrize("heading, code", examples(), ids=[heading for heading, _ in examples()])
def test_an_example_runs_as_it_stands(heading, code, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATH", os.pathsep.join([os.path.dirname(os.environ["LOWLUX"]), os.environ["PATH"]]))
    exec(compile(code, f"{PAGE.name}: {heading}", "exec"), {"__name__": "__main__"})


def test_the_pairs_are_a_data_set_of_torch(tmp_path, monkeypatch):
    torch = pytest.importorskip("torch")
    monkeypatch.chdir(tmp_path)
    names = {}
    exec(dict(examples())["Training data"], names)
    loader = torch.utils.data.DataLoader(names["NightPairs"](4), batch_size=2)
    assert [tuple(noisy.shape) for noisy, _ in loader] == [(2, 4, 48, 64)] * 2


def test_there_are_examples():
    assert len(examples()) >= 6
