"""Arguments of all functions: flags, values, lists and paths."""
import os
import pathlib
import re

import numpy as np
import pytest

import lowlux
from lowlux import _words

OF_THE_COMMAND = {"help", "help-all", "no-config", "force", "json", "quiet", "list", "explain", "timings", "skip-existing",
                  "sync", "calibrate-cost"}


@pytest.mark.parametrize("value", [True, False, np.True_, np.False_])
@pytest.mark.parametrize("name", ["denoise", "repair", "line_noise", "sharpen", "dark_estimate", "baseline_exposure", "look",
                                  "effects", "exposure", "max_size", "dark_frame"])
def test_a_truth_value_is_for_flags_only(name, value, night, tmp_path):
    with pytest.raises(lowlux.ArgumentError, match=f'{name}: .*"off"'):
        lowlux.develop(night, tmp_path / "a.png", **{name: value})
    assert list(tmp_path.iterdir()) == []


def test_flags_are_true_or_false(night):
    assert lowlux.develop(night, half=np.True_).image.shape == (80, 120, 3)
    assert lowlux.develop(night, half=np.False_).image.shape == (160, 240, 3)
    for value in ("off", 0, 1, [True]):
        with pytest.raises(lowlux.ArgumentError, match="half: .*True nor False"):
            lowlux.develop(night, half=value)


def test_truth_values_are_for_flags_only(burst, tmp_path):
    with pytest.raises(lowlux.ArgumentError, match="effects"):
        lowlux.simulate("chart", effects=False)
    with pytest.raises(lowlux.ArgumentError, match="system_gain"):
        lowlux.calibrate("black", burst, tmp_path / "a.json", system_gain=True)
    assert lowlux.simulate("flat", size=(32, 32), no_truth=True).truth is None
    assert list(tmp_path.iterdir()) == []


def test_every_flag_of_the_command_is_one_of_python(command):
    """In the help, an option without a value is followed by spaces."""
    flags = set()
    for verb in ("develop", "denoise", "merge", "simulate", "bench", *(f"calibrate {kind}" for kind in
                                                                      ("black", "noise", "colour", "quoted"))):
        page = command(*verb.split(), "--help-all")
        flags |= set(re.findall(r"^  (?:-\w,)?--([a-z-]+)(?:  |$)", page, re.MULTILINE))
    assert {flag.replace("-", "_") for flag in flags - OF_THE_COMMAND} == _words._FLAGS


def test_arrays_are_values_like_tuples(night):
    of_tuples = lowlux.develop(night, wb=(2.0, 1.0, 1.5), crop=(8, 6, 60, 40), denoise="off").image
    of_arrays = lowlux.develop(night, wb=np.array([2.0, 1, 1.5]), crop=np.array([8, 6, 60, 40]), denoise="off").image
    np.testing.assert_array_equal(of_arrays, of_tuples)
    of_scalars = lowlux.develop(night, exposure=np.float32(0.5), max_size=np.int64(50), contrast=np.array(1.25)).image
    np.testing.assert_array_equal(of_scalars, lowlux.develop(night, exposure=0.5, max_size=50, contrast=1.25).image)
    for bad in (np.eye(3), object(), {"r": 2}, lowlux.read_raw(night), [[2, 1, 1]], lowlux):
        with pytest.raises(lowlux.ArgumentError, match="wb"):
            lowlux.develop(night, wb=bad)


def test_sizes_may_be_arrays():
    options = dict(seed=3, no_truth=True)
    for size in (np.array([40, 30]), np.array([40.0, 30.0]), [np.int16(40), 30]):
        made = lowlux.simulate("flat", size=size, **options).frames[0]
        np.testing.assert_array_equal(made.raw_image, lowlux.simulate("flat", size=(40, 30), **options).frames[0].raw_image)


def test_one_frame_is_no_list_of_frames(night):
    raw = lowlux.read_raw(night)
    for frames in (str(night), night, bytes(night), raw, 3, None):
        with pytest.raises(lowlux.ArgumentError, match="not a list of frames"):
            lowlux.merge(frames)


def test_standard_input_is_for_the_command(burst):
    for call in (lambda: lowlux.develop("-"), lambda: lowlux.denoise("-"), lambda: lowlux.merge([*burst, "-"]),
                 lambda: lowlux.develop([b"-", *burst])):
        with pytest.raises(lowlux.ArgumentError, match="standard input"):
            call()


@pytest.mark.parametrize("name", ["help", "help_all", "json", "force", "quiet", "no_config"])
def test_options_that_print_are_for_the_command(name, capfd):
    with pytest.raises(lowlux.ArgumentError, match=f"{name}: .*command"):
        lowlux.calibrate("quoted", "thesis", **{name: True})
    assert capfd.readouterr() == ("", "")


def test_a_text_without_an_end_or_with_one_inside_is_no_path(night, tmp_path, rng):
    """A NUL would end the name in C: the file `nul` would be written."""
    raw, image = lowlux.read_raw(night), np.zeros((24, 24, 3), np.uint8)
    profile = lowlux.calibrate("quoted", "thesis")
    for bad in (str(tmp_path / "nul\0x.dng"), os.fsencode(tmp_path) + b"/nul\0x.dng", "", b"", "\ud800.dng"):
        calls = [lambda: lowlux.read_raw(bad), lambda: lowlux.write_dng(bad, raw), lambda: profile.save(bad),
                 lambda: lowlux.Profile(bad), lambda: lowlux.compare(image, bad), lambda: lowlux.simulate(bad, size=(32, 32)),
                 lambda: lowlux.simulate("flat", bad, size=(32, 32)), lambda: lowlux.develop(bad),
                 lambda: lowlux.develop(raw, bad), lambda: lowlux.develop(raw, profile=bad),
                 lambda: lowlux.develop(raw, dark_frame=[bad]), lambda: lowlux.denoise(raw, bad),
                 lambda: lowlux.merge([raw, bad]), lambda: lowlux.merge([raw, raw], bad),
                 lambda: lowlux.calibrate("black", bad), lambda: lowlux.calibrate("quoted", "thesis", bad),
                 lambda: lowlux.bench({}, bad, quick=True), lambda: lowlux.bench({}, pictures_folder=bad, quick=True),
                 lambda: lowlux.bench({"x": bad}, quick=True)]
        for call in calls:
            with pytest.raises(lowlux.ArgumentError):
                call()
    assert list(tmp_path.iterdir()) == []


def test_extensions_may_be_in_capitals(night, tmp_path):
    raw = lowlux.read_raw(night)
    lowlux.write_dng(tmp_path / "A.DNG", raw)
    assert lowlux.merge([raw], tmp_path / "M.DNG").plan["alignment"] == "none"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["A.DNG", "M.DNG"]
    with pytest.raises(lowlux.ArgumentError):
        lowlux.merge([raw], tmp_path / "M.TIF")


def test_names_of_any_bytes_and_bytes_themselves_are_paths(night, tmp_path):
    raw = lowlux.read_raw(night)
    folder = os.fsencode(tmp_path) + b"/\xff\xfe"
    os.mkdir(folder)
    for path in (folder + b"/a\xe4.dng", os.fsdecode(folder + b"/b\xe4.dng"), pathlib.Path(os.fsdecode(folder)) / "c.dng"):
        name = os.fsdecode(path)
        lowlux.write_dng(path, raw)
        np.testing.assert_array_equal(lowlux.read_raw(path).raw_image, raw.raw_image)
        with pytest.raises(lowlux.ExistsError) as caught:
            lowlux.write_dng(path, raw)
        assert caught.value.where == name and name in str(caught.value)
        made = lowlux.develop(path, name + ".png", half=True, maps=True)
        np.testing.assert_array_equal(lowlux.develop(raw, half=True).image, made.image)
        assert lowlux.denoise(path, denoise="draft").plan["denoise"]["level"] == "draft"
        profile = lowlux.calibrate("quoted", "thesis", name + ".json")
        assert profile.path == name + ".json" and lowlux.Profile(os.fsencode(profile.path)).data == profile.data
        lowlux.develop(path, profile=profile, half=True)
        assert lowlux.compare(name + ".png", os.fsencode(name + ".png"))["identical_codes"]
    burst = lowlux.simulate("chart", folder + b"/s\xf6.dng", size=(64, 48), frames=2, shake=1)
    names = [os.fsdecode(folder + b"/s\xf6_000%d.dng" % index) for index in range(2)]
    np.testing.assert_array_equal(lowlux.read_raw(names[1]).raw_image, burst.frames[1].raw_image)
    assert len(lowlux.merge(names, reference=os.fsencode(names[1])).plan["frames"]) == 2
    with pytest.raises(lowlux.NotFoundError) as caught:
        lowlux.read_raw(folder + b"/none\xff")
    assert caught.value.where == os.fsdecode(folder + b"/none\xff")
