"""simulate, compare, calibrate and profiles: the results of the command."""
import inspect
import json
import re

import numpy as np
import pytest

import lowlux

NOT_ARGUMENTS = {"help", "help-all", "no-config", "output", "force", "json", "quiet", "list", "explain", "timings"}
SCENE = dict(size=(96, 64), luminance=0.5, seed=7)
WORDS = ["--size", "96x64", "--luminance", "0.5", "--seed", "7"]


def test_simulating_gives_the_bytes_of_the_command(tmp_path, command):
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    words = [*WORDS, "--frames", "2", "--shake", "2", "--drift", "1.5,-1"]
    command("simulate", "chart", "-o", tmp_path / "a/n.dng", *words)
    options = dict(**SCENE, frames=2, shake=2, drift=(1.5, -1))
    ours = lowlux.simulate("chart", tmp_path / "b/n.dng", **options)
    names = sorted(path.name for path in (tmp_path / "a").iterdir())
    assert names == sorted(path.name for path in (tmp_path / "b").iterdir()) and len(names) == 4
    for name in names:
        if not name.endswith(".json"):  # states the names of the frames
            assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()
    memory = lowlux.simulate("chart", **options)
    for frame, name in zip(memory.frames, [name for name in names if name.endswith(".dng")]):
        np.testing.assert_array_equal(frame.raw_image, lowlux.read_raw(tmp_path / "a" / name).raw_image)
    np.testing.assert_array_equal(memory.truth, ours.truth)
    assert len(memory.motion["frames"]) == 2 and memory.truth.shape == memory.truth_e.shape == (64, 96, 3)


def test_the_noise_of_simulated_frames_is_that_of_their_truth():
    """The mean of a flat's residuals is 0 within 5 standard errors, and so is that of their squares less the variance."""
    options = dict(sensor="thesis", system_gain=2.0, read_noise=3.0, black_level=200, prnu=0, dsnu=0, dark_current=0,
                   quantise="round", effects="photon-noise,read-noise,quantisation")
    made = lowlux.simulate("flat", size=(200, 200), luminance=0.3, exposure=0.05, seed=11, **options)
    raw = made.frames[0]
    colours = np.array([0, 1, 2, 1])[raw.raw_colors]
    mean_e = np.take_along_axis(made.truth_e, colours[..., None], 2)[..., 0].astype(float)
    residual = raw.raw_image.astype(float) - 200 - 2.0 * mean_e
    variance = 2.0**2 * (mean_e + 3.0**2) + 1 / 12
    n = residual.size
    assert abs(residual.mean()) < 5 * np.sqrt(variance.mean() / n)
    excess = residual**2 - variance
    assert abs(excess.mean()) < 5 * excess.std() / np.sqrt(n)


def test_frames_have_the_white_level_of_their_files(tmp_path, rng):
    """So that what is made of them in memory can be written like them."""
    for _ in range(12):
        name = str(rng.choice(["ELD_CanonEOS5D4", "ELD_CanonEOS700D", "ELD_NikonD850", "ELD_SonyA7S2"]))
        frame = lowlux.simulate("flat", sensor=name, size=(32, 24), system_gain=float(np.exp(rng.uniform(-2, 2))),
                                no_truth=True).frames[0]
        lowlux.write_dng(tmp_path / "codes.dng", frame.raw_image, like=frame, overwrite=True)
        lowlux.write_dng(tmp_path / "floats.dng", frame.raw_image.astype(np.float32), like=frame, overwrite=True)
        for file in ("codes.dng", "floats.dng"):
            assert (lowlux.read_raw(tmp_path / file).white_dn == frame.white_dn).all(), name


def test_the_blur_of_the_lens_is_in_frames_and_truth():
    sharp, blurred = (lowlux.simulate("chart", **SCENE, effects="all", **lens) for lens in ({}, dict(lens_blur=1.5)))
    none = lowlux.simulate("chart", **SCENE, effects="all", lens_blur=0)
    np.testing.assert_array_equal(none.frames[0].raw_image, sharp.frames[0].raw_image)
    np.testing.assert_array_equal(none.truth, sharp.truth)
    assert (blurred.frames[0].raw_image != sharp.frames[0].raw_image).mean() > 0.1
    for before, after in ((sharp.truth, blurred.truth), (sharp.truth_e, blurred.truth_e)):
        np.testing.assert_allclose(after.sum(axis=(0, 1), dtype=float), before.sum(axis=(0, 1), dtype=float), rtol=1e-5)
        assert np.abs(np.diff(after, axis=1)).max() < 0.7 * np.abs(np.diff(before, axis=1)).max()
    assert blurred.report["lens_blur_px"] == 1.5


def test_an_array_is_a_scene_like_the_file_of_its_samples(tmp_path, rng):
    lit = np.exp(rng.uniform(-6, 0.5, (36, 48, 3))).astype(np.float32)  # some of it above white
    (tmp_path / "lit.pfm").write_bytes(b"PF\n48 36\n-1.0\n" + lit[::-1].astype("<f4").tobytes())
    codes = rng.integers(0, 256, (36, 48, 3)).astype(np.uint8)
    (tmp_path / "codes.ppm").write_bytes(b"P6\n48 36\n255\n" + codes.tobytes())
    for array, name in ((lit, "lit.pfm"), (lit.astype(float), "lit.pfm"), (codes, "codes.ppm"),
                        (codes.astype(np.uint16) * 257, "codes.ppm"), (codes[::-1].copy()[::-1], "codes.ppm")):
        options = dict(luminance=float(rng.uniform(0.1, 3)), seed=int(rng.integers(2**32)), frames=2)
        ours, of_file = lowlux.simulate(array, **options), lowlux.simulate(tmp_path / name, **options)
        for a, b in zip(ours.frames, of_file.frames):
            np.testing.assert_array_equal(a.raw_image, b.raw_image)
        np.testing.assert_array_equal(ours.truth, of_file.truth)
        np.testing.assert_array_equal(ours.truth_e, of_file.truth_e)
    lowlux.simulate(lit, tmp_path / "n.dng")
    assert sorted(path.name for path in tmp_path.glob("n.*")) == ["n.dng", "n.truth.exr"]
    for array, why in ((lit[..., 0], "height"), (np.where(lit > 1, np.nan, lit), "scene: .* is nan"), (-lit, "negative"),
                       (lit.astype(int), "uint8"), (lit[:20], "22")):
        with pytest.raises(lowlux.Error, match=why):
            lowlux.simulate(array)
    with pytest.raises(lowlux.ArgumentError, match="its own size"):
        lowlux.simulate(lit, size=(48, 36))


def test_comparing_files_and_arrays(night, tmp_path, command):
    a = lowlux.develop(night, tmp_path / "a.png", denoise="off").image
    b = lowlux.develop(night, tmp_path / "b.png").image
    files = lowlux.compare(tmp_path / "a.png", tmp_path / "b.png")
    assert files == json.loads(command("compare", tmp_path / "a.png", tmp_path / "b.png", "--json"))
    arrays = lowlux.compare(a, b[:, ::-1][:, ::-1])
    for name in ("ciede2000", "psnr_db", "ssim", "egr"):
        if isinstance(files[name], float):
            assert arrays[name] == pytest.approx(files[name], rel=1e-3)  # the ICC profile rounds its primaries
    codes = np.mean((a / 255.0 - b / 255.0) ** 2)
    assert arrays["psnr_db"] == pytest.approx(-10 * np.log10(codes), abs=0.01)
    assert lowlux.compare(a, a)["identical_codes"]
    with pytest.raises(lowlux.ArgumentError, match="crop or scale"):
        lowlux.compare(a, b[:-1])
    with pytest.raises(lowlux.Error, match="test"):
        lowlux.compare(a.astype(np.float32), np.full(a.shape, np.nan, np.float32))
    with pytest.raises(lowlux.ArgumentError, match="uint8"):
        lowlux.compare(a, b.astype(np.int64))


@pytest.mark.parametrize("shape", [(2**32 + 2, 1, 3), (1, 2**32 + 2, 3), (1, 1_500_000_000, 3), (2**38, 2**20, 3),
                                   (20_000, 20_000, 3)])
@pytest.mark.parametrize("kind", [np.uint8, np.float32])
def test_arrays_of_more_pixels_than_a_file_may_have_are_refused(shape, kind):
    """Strides of 0: the arrays take no memory, a copy would."""
    huge = np.broadcast_to(kind(0), shape)
    small = np.zeros((2, 1, 3), kind)
    for images in ((huge, small), (small, huge)):
        with pytest.raises(lowlux.TooLargeError, match="268435456 pixels"):
            lowlux.compare(*images)


def test_calibrating_gives_the_profile_of_the_command(tmp_path, command):
    darks, flats = [], []
    figures = ["--sensor", "ELD_NikonD850", "--size", "128x96", "--no-truth", "--quiet"]
    for index in range(2):
        darks.append(tmp_path / f"dark{index}.dng")
        command("simulate", "dark", "--exposure", "0.01", "--seed", 20 + index, "-o", darks[-1], *figures)
    for level in (10, 30, 100, 200, 300):
        for index in range(2):
            flats.append(tmp_path / f"flat{level}_{index}.dng")
            command("simulate", "flat", "--luminance", level, "--exposure", "0.01", "--seed", level + index,
                    "-o", flats[-1], *figures)
    command("calibrate", "noise", "-o", tmp_path / "a.json", "--quiet", *(f"--darks={d}" for d in darks), "--", *flats)
    ours = lowlux.calibrate("noise", flats, tmp_path / "b.json", darks=darks)
    assert (tmp_path / "b.json").read_bytes() == (tmp_path / "a.json").read_bytes()
    assert lowlux.calibrate("noise", flats, darks=darks).data == ours.data
    black = lowlux.calibrate("black", darks, system_gain=1.5)
    assert black.data["gains"] and black.path is None


def test_profiles(tmp_path, command, night):
    command("calibrate", "quoted", "thesis", "-o", tmp_path / "a.json")
    profile = lowlux.calibrate("quoted", "thesis", tmp_path / "b.json")
    assert (tmp_path / "b.json").read_bytes() == (tmp_path / "a.json").read_bytes()
    again = lowlux.Profile(tmp_path / "a.json")
    assert again.data == profile.data
    sensor = again.gain()["sensor"]
    gain, noise_e = sensor["system_gain_dn_per_e"]["value"], sensor["read_noise_e"]["value"]
    signal = np.array([0.0, 10, 1000])
    np.testing.assert_allclose(again.variance_dn2(signal), gain**2 * (noise_e**2 + signal / gain) + 1 / 12, rtol=1e-12)
    np.testing.assert_array_equal(again.variance_dn2([0, 10, 1000]), again.variance_dn2(signal))
    assert again.variance_dn2(-50) == again.variance_dn2(0) and (again.variance_dn2(-signal) == again.variance_dn2(0)).all()
    again.save(tmp_path / "c.json")
    assert (tmp_path / "c.json").read_bytes() == (tmp_path / "a.json").read_bytes()
    np.testing.assert_array_equal(lowlux.develop(night, profile=again).image,
                                  lowlux.develop(night, profile=tmp_path / "a.json").image)
    with pytest.raises(lowlux.ExistsError):
        again.save(tmp_path / "c.json")
    with pytest.raises(lowlux.ArgumentError, match="iso"):
        again.gain(123)
    broken = {**again.data, "gains": [{}]}
    with pytest.raises(lowlux.Error, match="gains"):
        lowlux.Profile(broken)
    with pytest.raises(lowlux.NotFoundError):
        lowlux.Profile(tmp_path / "none.json")


def test_a_profile_with_changed_data_is_saved_before_it_is_used(night, tmp_path):
    profile = lowlux.calibrate("quoted", "thesis", tmp_path / "a.json")
    before = lowlux.develop(night, profile=profile).image
    profile.gain()["sensor"]["read_noise_e"]["value"] *= 10
    with pytest.raises(lowlux.ArgumentError, match="save"):
        lowlux.develop(night, profile=profile)
    profile.save(tmp_path / "b.json")
    after = lowlux.develop(night, profile=profile).image
    np.testing.assert_array_equal(after, lowlux.develop(night, profile=tmp_path / "b.json").image)
    assert (after != before).any()


def test_colour_of_spectral_sensitivities(tmp_path, command):
    listed = command("simulate", "--list")
    camera = re.search(r"cameras.*\n(?:\(.*\n)?\s+(.+?)(?:  .*)?\n", listed).group(1).split(",")[0].strip()
    command("calibrate", "colour", "--camera", camera, "-o", tmp_path / "a.json")
    ours = lowlux.calibrate("colour", output=tmp_path / "b.json", camera=camera)
    assert (tmp_path / "b.json").read_bytes() == (tmp_path / "a.json").read_bytes()
    assert len(ours.data["colours"]) == 1


def test_colour_of_a_photographed_chart(tmp_path, command, raws):
    chart = raws / "canon_kissx4_ml_colorchart.dng"
    command("calibrate", "colour", chart, "-o", tmp_path / "a.json")
    lowlux.calibrate("colour", chart, tmp_path / "b.json")
    assert (tmp_path / "b.json").read_bytes() == (tmp_path / "a.json").read_bytes()


@pytest.mark.parametrize("options", [dict(sensor="ELD_NikonD580"), dict(exposure=-1), dict(size="12"),
                                     dict(effects="photons"), dict(luminance=float("nan")), dict(frames=0)])
def test_wrong_simulations_have_the_message_of_the_command(options, tmp_path, command):
    words = [word for name, value in options.items() for word in ("--" + name, str(value))]
    with pytest.raises(lowlux.Error) as caught:
        lowlux.simulate("chart", tmp_path / "a.dng", **options)
    said = command("simulate", "chart", "-o", tmp_path / "a.dng", *words, fails=True)
    assert str(caught.value).removeprefix("chart: ").removeprefix("lowlux simulate: ") in said
    assert list(tmp_path.iterdir()) == []


def test_frames_that_memory_does_not_hold_are_refused_at_once(tmp_path):
    for options in (dict(size=(16000, 16000), frames=10000), dict(size=(16000, 16000), frames=10000, no_truth=True)):
        with pytest.raises(lowlux.TooLargeError, match="not enough memory .*10000 of 16000 x 16000 pixels"):
            lowlux.simulate("flat", tmp_path / "a.dng", **options)
    assert list(tmp_path.iterdir()) == []


def test_unknown_sensors_and_kinds():
    with pytest.raises(lowlux.Error, match="no_such"):
        lowlux.calibrate("quoted", "no_such")
    with pytest.raises(lowlux.ArgumentError, match="kind"):
        lowlux.calibrate("gamma")


def test_every_option_of_simulate_is_an_argument(command):
    options = set(re.findall(r"^  (?:-\w,)?--([a-z-]+)", command("simulate", "--help-all"), re.MULTILINE)) - NOT_ARGUMENTS
    parameters = inspect.signature(lowlux.simulate).parameters
    arguments = {name for name, p in parameters.items() if p.kind == p.KEYWORD_ONLY} - {"overwrite"}
    assert arguments == {option.replace("-", "_") for option in options}
