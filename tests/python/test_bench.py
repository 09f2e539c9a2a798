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


def test_samples_that_no_frame_can_have_are_failures():
    def spoiled(value):
        def run(raw):
            floats = lowlux.raw_from_array(raw.raw_image.astype(np.float32), black=raw.black_dn, white=raw.white_level)
            floats.raw_image[9, 7] = value
            return floats

        return run

    methods = {"nan": spoiled(np.nan), "inf": spoiled(-np.inf), "floats": spoiled(1000),
               "image": lambda raw: np.full((*raw.raw_image.shape, 3), np.nan, np.float32)}
    board = lowlux.bench(methods, levels=(), quick=True, pictures_folder=PICTURES)
    assert {row["method"] for row in board.rows} == {"noise-free", "noisy", "floats"}
    assert {line.split(":")[1].split()[1] for line in board.failures} == {"nan", "inf", "image"}


class Mute(Exception):
    def __str__(self):
        raise ValueError("no text")


def test_any_failure_of_a_function_is_its_own():
    """The texts of exceptions may be anything; what asks Python to end is passed on."""
    def raising(error):
        def run(raw):
            raise error

        return run

    methods = {"surrogates": raising(ValueError("\udc80 here")), "mute": raising(Mute()), "memory": raising(MemoryError()),
               "generator": raising(StopIteration(1)), "objects": lambda raw: np.full((*raw.raw_image.shape, 3), None),
               "class": lambda raw: lowlux.RawImage}
    board = lowlux.bench(methods, levels=(), quick=True, pictures_folder=PICTURES)
    assert {row["method"] for row in board.rows} == {"noise-free", "noisy"}
    assert {line.split(":")[1].split()[1] for line in board.failures} == set(methods)
    assert any(r"it raised ValueError: \udc80 here" in line for line in board.failures)
    assert any("it raised Mute" in line and "no text" not in line for line in board.failures)
    for error in (SystemExit(3), KeyboardInterrupt(), GeneratorExit()):
        with pytest.raises(type(error)):
            lowlux.bench({"ends": raising(error)}, levels=(), quick=True, pictures_folder=PICTURES)


def test_methods_that_are_none_are_refused(tmp_path):
    for methods in ({"x": 3}, {"x": "cp {in}"}, {"a b": lambda raw: raw}, {"nosuch": None},
                    {"a=FOO": "cp {in} {out}"}, {"a=cp {in} {out}": None}, {"": lambda raw: raw}):
        with pytest.raises(lowlux.ArgumentError):
            lowlux.bench(methods, quick=True, pictures_folder=PICTURES)
    for methods in ({1: lambda raw: raw}, {None: "cp {in} {out}"}, {b"x": "cp {in} {out}"}, [lambda raw: raw], "cp {in} {out}",
                    {"x": ""}, {"\udc80": lambda raw: raw}):
        with pytest.raises(lowlux.ArgumentError):
            lowlux.bench(methods, quick=True, pictures_folder=PICTURES)
    for levels in ("draft", 3, b"draft"):
        with pytest.raises(lowlux.ArgumentError, match="levels"):
            lowlux.bench({}, levels=levels, quick=True, pictures_folder=PICTURES)
    with pytest.raises(lowlux.NotFoundError):
        lowlux.bench({}, quick=True, pictures_folder=tmp_path / "none")
