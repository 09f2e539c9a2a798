"""bench: methods that are functions and commands, on the same frames as our levels."""
import json
import pathlib

import numpy as np
import pytest

import lowlux

PICTURES = pathlib.Path(__file__).resolve().parents[2] / "testdata" / "pictures"


def test_functions_and_commands_are_scored_next_to_our_levels(tmp_path):
    shapes = []

    def grey(raw):
        shapes.append(raw.raw_image.shape)
        return np.full((*raw.raw_image.shape, 3), 0.2, np.float32)

    def broken(raw):
        raise ValueError("no\nluck")

    methods = {"copy": lambda raw: raw, "grey": grey, "broken": broken, "text": lambda raw: "text",
               "half": lambda raw: np.zeros((8, 8, 3), np.uint8), "command": "cp {in} {out}", "mute": ": {in} {out}"}
    board = lowlux.bench(methods, tmp_path / "board", levels=["draft"], quick=True, seed=3, pictures_folder=PICTURES)
    psnr = {row["method"]: row["PSNR [dB]"] for row in board.rows}
    assert set(psnr) == {"noise-free", "noisy", "lowlux-draft", "copy", "grey", "command"}
    assert psnr["copy"] == psnr["noisy"] == pytest.approx(psnr["command"], abs=1e-9)
    assert psnr["lowlux-draft"] > psnr["copy"] + 5 and set(shapes) == {(256, 256)}
    assert {line.split(":")[1].split()[1] for line in board.failures} == {"broken", "text", "half", "mute"}
    assert any("it raised ValueError: no luck" in line for line in board.failures)
    assert board.settings["seed"] == "3" and board.machine["lowlux"]
    assert json.loads((tmp_path / "board" / "methods.json").read_text())["rows"] == board.rows


def test_methods_that_are_none_are_refused(tmp_path):
    for methods in ({"x": 3}, {"x": "cp {in}"}, {"a b": lambda raw: raw}, {"nosuch": None}):
        with pytest.raises(lowlux.ArgumentError):
            lowlux.bench(methods, quick=True, pictures_folder=PICTURES)
    with pytest.raises(lowlux.NotFoundError):
        lowlux.bench({}, quick=True, pictures_folder=tmp_path / "none")
