"""Frames in memory where the command names files: calibration frames, dark, bias and flat frames."""
import os
import pathlib
import tempfile

import lowlux
import numpy as np
import pytest


@pytest.fixture(scope="module")
def frames(tmp_path_factory):
    """Return flats and darks of a camera, each as files and as frames in memory."""
    folder = tmp_path_factory.mktemp("frames")

    def made(kind, index, **options):
        path = folder / f"{kind}s_{index}.dng"
        frame = lowlux.simulate(kind, path, sensor="ELD_NikonD850", size=(192, 128), no_truth=True, masked_columns=8,
                                **options).frames[0]
        return path, frame

    darks = [made("dark", i, exposure=0.01, seed=i) for i in range(4)]
    flats = [made("flat", i, exposure=0.01, luminance=[10, 30, 100, 300][i // 2], seed=10 + i) for i in range(8)]
    biases = [made("dark", 10, exposure=1e-4, seed=30)]
    return {"darks": list(zip(*darks)), "flats": list(zip(*flats)), "biases": list(zip(*biases))}


def as_lists(pair):
    return [list(files_or_frames) for files_or_frames in pair]


@pytest.fixture(autouse=True)
def temporary(tmp_path, monkeypatch):
    """Keep temporary files in a folder of the test, which is empty again at its end."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    yield folder
    if folder.exists():
        assert not list(folder.iterdir())


def without_names(profile):
    """Return the data of a profile without the names of the measured files."""
    def stripped(node):
        if isinstance(node, dict):
            return {key: stripped(value) for key, value in node.items() if key != "files"}
        return [stripped(value) for value in node] if isinstance(node, list) else node

    return stripped(profile.data)


def test_frames_in_memory_calibrate_as_their_files(frames):
    dark_files, darks = as_lists(frames["darks"])
    flat_files, flats = as_lists(frames["flats"])
    assert without_names(lowlux.calibrate("black", darks)) == without_names(lowlux.calibrate("black", dark_files))
    ours = lowlux.calibrate("noise", flats, darks=darks)
    theirs = lowlux.calibrate("noise", flat_files, darks=dark_files)
    assert without_names(ours) == without_names(theirs)
    assert ours.warnings == [warning.replace(str(flat_files[0].parent) + "/", "") for warning in theirs.warnings]
    mixed = lowlux.calibrate("noise", [*flat_files[:4], *flats[4:]], darks=darks)
    assert without_names(mixed) == without_names(theirs)
    one = lowlux.calibrate("black", darks[0])
    assert without_names(one) == without_names(lowlux.calibrate("black", dark_files[0]))


def test_profiles_name_frames_in_memory_by_their_argument(frames, temporary):
    text = str(lowlux.calibrate("black", list(frames["darks"][1])))
    assert "frames_0.dng" in text and str(temporary) not in text


def test_darks_and_flats_in_memory_are_subtracted_as_their_files(frames, tmp_path):
    (dark_files, darks), (flat_files, flats) = as_lists(frames["darks"]), as_lists(frames["flats"])
    (bias_file,), (bias,) = frames["biases"]
    raw = flats[5]
    for ours, theirs in ((dict(dark_frame=darks), dict(dark_frame=dark_files)),
                         (dict(bias_frame=bias), dict(bias_frame=bias_file)),
                         (dict(dark_frame=[darks[0], dark_files[1]], flat_frame=flats[6:]),
                          dict(dark_frame=dark_files[:2], flat_frame=flat_files[6:]))):
        expected = lowlux.develop(raw, **theirs)
        found = lowlux.develop(raw, **ours)
        assert np.array_equal(found.image, expected.image)
        assert found.warnings == [w.replace(str(dark_files[0].parent) + "/", "").replace("darks_10", "bias_frame_0").replace("darks_", "dark_frame_")
                                  for w in expected.warnings]
    clean, expected = (lowlux.denoise(raw, dark_frame=given, denoise="draft").raw for given in (darks, dark_files))
    assert np.array_equal(clean.raw_image, expected.raw_image)
    merged, expected = (lowlux.merge(flats[4:6], dark_frame=given).raw for given in (darks, dark_files))
    assert np.array_equal(merged.raw_image, expected.raw_image)


def test_changes_of_a_view_count(frames):
    darks = [lowlux.raw_from_array(dark.raw_image.copy(), like=dark) for dark in frames["darks"][1]]
    level = lowlux.calibrate("black", darks).gain()["pedestal_dn"]["site_00"]["value"]
    for dark in darks:
        dark.raw_image[:] += 100
    assert lowlux.calibrate("black", darks).gain()["pedestal_dn"]["site_00"]["value"] == pytest.approx(level + 100, abs=1e-3)


def test_errors_name_the_argument_and_no_temporary_file(frames, temporary):
    darks, flats = list(frames["darks"][1]), list(frames["flats"][1])
    small = lowlux.raw_from_array(np.full((8, 8), 70, np.uint16), black=64, white=1023)
    other = lowlux.raw_from_array(np.full((64, 64), 70, np.uint16), black=64, white=1023, exposure_s=0.01, iso=100)
    for call, name in ((lambda: lowlux.calibrate("black", [darks[0], other]), "frames_1.dng"),
                       (lambda: lowlux.develop(flats[0], dark_frame=[darks[0], other]), "dark_frame_1.dng"),
                       (lambda: lowlux.develop(flats[0], dark_frame=[small]), "dark_frame_0.dng"),
                       (lambda: lowlux.develop(flats[0], flat_frame=other), "flat_frame_0.dng")):
        with pytest.raises(lowlux.Error) as caught:
            call()
        assert name in str(caught.value) and str(temporary) not in str(caught.value)
        assert str(temporary) not in caught.value.where


def test_arrays_are_refused_with_what_makes_frames_of_them():
    dark = np.full((64, 64), 70, np.uint16)
    raw = lowlux.raw_from_array(dark, black=64, white=1023)
    for call in (lambda: lowlux.develop(raw, dark_frame=dark), lambda: lowlux.calibrate("black", dark),
                 lambda: lowlux.calibrate("noise", [raw], darks=dark)):
        with pytest.raises(lowlux.ArgumentError, match="raw_from_array"):
            call()


def test_without_a_temporary_folder_the_error_names_the_argument(frames, temporary):
    temporary.rmdir()
    with pytest.raises(lowlux.UnwritableError, match="^frames: "):
        lowlux.calibrate("black", list(frames["darks"][1]))
    assert lowlux.calibrate("black", list(map(os.fspath, frames["darks"][0])))
    assert pathlib.Path(frames["darks"][0][0]).exists()
