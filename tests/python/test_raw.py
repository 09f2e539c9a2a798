"""Raw frames: views, and files written of arrays of all kinds, against what NumPy itself makes of them."""
import copy
import gc
import pickle
import warnings

import numpy as np
import pytest

import lowlux

LEVELS = dict(black=64, white=4095)
PHASES = {"RGGB": [[0, 1], [3, 2]], "GRBG": [[1, 0], [2, 3]], "GBRG": [[3, 2], [0, 1]], "BGGR": [[2, 3], [1, 0]]}


def codes(rng, height=24, width=36):
    return rng.integers(0, 4096, (height, width), dtype=np.uint16)


def written(path, mosaic, **figures):
    lowlux.write_dng(path, mosaic, **{**LEVELS, **figures})
    return lowlux.read_raw(path)


LAYOUTS = {
    "contiguous": lambda a: a,
    "columns first": np.asfortranarray,
    "transposed twice": lambda a: np.ascontiguousarray(a.T).T,
    "every second pixel": lambda a: np.repeat(np.repeat(a, 2, 0), 2, 1)[::2, ::2],
    "upside down": lambda a: a[::-1][::1],
    "mirrored": lambda a: a[:, ::-1],
    "negative strides in memory": lambda a: np.ascontiguousarray(a[::-1, ::-1])[::-1, ::-1],
    "one row repeated": lambda a: np.broadcast_to(a[:1], a.shape),
    "unaligned": lambda a: np.frombuffer(b"\0" + a.tobytes(), np.uint8)[1:].view(a.dtype).reshape(a.shape),
    "big endian": lambda a: a.astype(">u2"),
    "little endian": lambda a: a.astype("<u2"),
    "int64": lambda a: a.astype(np.int64),
    "big-endian uint32": lambda a: a.astype(">u4"),
    "uint8": lambda a: (a >> 4).astype(np.uint8),
}


@pytest.mark.parametrize("layout", LAYOUTS)
def test_a_mosaic_of_any_layout_is_written_as_numpy_reads_it(layout, tmp_path, rng):
    mosaic = LAYOUTS[layout](codes(rng))
    mosaic.flags.writeable = False
    raw = written(tmp_path / "a.dng", mosaic)
    assert raw.raw_image.dtype == np.uint16
    np.testing.assert_array_equal(raw.raw_image, mosaic.astype(np.uint16))


@pytest.mark.parametrize("kind", ["<f4", ">f4", "<f8", ">f8", "f2"])
def test_floats_below_black_and_above_white_keep_their_bits(kind, tmp_path, rng):
    mosaic = rng.normal(0.3, 0.8, (24, 36)).astype(kind)[::-1]
    raw = written(tmp_path / "f.dng", mosaic, black=0, white=1)
    assert raw.raw_image.dtype == np.float32
    assert raw.raw_image.tobytes() == mosaic.astype(np.float32).tobytes()


@pytest.mark.parametrize("cfa", ["RGGB", "MONO", None])
def test_compressed_files_hold_the_same_samples_in_fewer_bytes(cfa, tmp_path, rng):
    mosaic = rng.integers(500, 520, (600, 530), dtype=np.uint16)
    figures = dict(cfa=cfa) if cfa else dict(black=0, white=1)
    if not cfa:
        mosaic = np.stack([mosaic / 520] * 3, axis=2).astype(np.float32)
    raw = written(tmp_path / "a.dng", mosaic, compression="lossless", **figures)
    np.testing.assert_array_equal(raw.raw_image, mosaic)
    assert (tmp_path / "a.dng").stat().st_size < 0.5 * mosaic.nbytes
    for raw_file in (lambda: written(tmp_path / "b.dng", mosaic, compression="zip", **figures),
                     lambda: lowlux.denoise(tmp_path / "a.dng", tmp_path / "b.dng", compression="zip")):
        with pytest.raises(lowlux.ArgumentError, match="compression: 'zip' is none of none, lossless"):
            raw_file()
    assert not (tmp_path / "b.dng").exists()


@pytest.mark.parametrize("cfa", PHASES)
def test_the_pattern_is_the_one_that_was_written(cfa, tmp_path, rng):
    raw = written(tmp_path / "p.dng", codes(rng), cfa=cfa)
    assert raw.cfa == cfa
    assert written(tmp_path / "lower.dng", codes(rng), cfa=cfa.lower()).cfa == cfa
    assert lowlux.simulate("chart", size=(64, 48), cfa=raw.cfa).frames[0].cfa == cfa
    assert raw.raw_pattern.tolist() == PHASES[cfa]
    assert raw.color_desc == b"RGBG"
    assert raw.raw_colors[3, 5] == raw.raw_color(3, 5) == PHASES[cfa][1][1]


def test_figures_come_back(tmp_path, rng):
    matrix = np.eye(3) + 0.1 * rng.random((3, 3))
    noise = [(1e-4, 1e-6), (2e-4, 2e-6), (3e-4, 3e-6)]
    raw = written(tmp_path / "f.dng", codes(rng), black=[[60, 61], [62, 63]], cfa="GRBG", noise=noise, matrix=matrix,
                  exposure_s=0.125, iso=1600)
    assert raw.black_dn.tolist() == [[60, 61], [62, 63]]
    assert raw.black_level_per_channel == [61, 60, 62, 63]  # red, green of its rows, blue, green of its rows
    assert raw.white_dn.tolist() == [4095] * 3 and raw.white_level == 4095
    np.testing.assert_allclose(raw.noise, noise, rtol=1e-12)
    np.testing.assert_allclose(raw.matrices[0], matrix, rtol=1e-6)  # rationals of the file
    assert (raw.exposure_s, raw.iso) == (0.125, 1600)


def test_rgb_and_grey_arrays(tmp_path, rng):
    rgb = rng.random((30, 40, 3), dtype=np.float32)[:, ::-1]
    raw = written(tmp_path / "rgb.dng", rgb, black=0, white=1)
    assert raw.cfa == "RGB" and raw.raw_pattern is None
    np.testing.assert_array_equal(raw.raw_image, rgb)
    grey = written(tmp_path / "grey.dng", codes(rng), cfa="MONO")
    assert grey.cfa == "MONO" and grey.num_colors == 1 and grey.raw_colors is None


def test_views_share_memory_and_keep_the_frame(night):
    raw = lowlux.read_raw(night)
    whole, visible = raw.raw_image, raw.raw_image_visible
    sizes = raw.sizes
    assert whole.shape == (sizes.raw_height, sizes.raw_width)
    assert np.shares_memory(whole, visible) and np.shares_memory(whole, raw.raw_image)
    visible[1, 2] = 77
    assert raw.raw_value(sizes.top_margin + 1, sizes.left_margin + 2) == 77
    before = whole.copy()
    del raw, visible
    gc.collect()
    np.testing.assert_array_equal(whole, before)


def test_metadata_like_another_frame(raws, tmp_path):
    source = lowlux.read_raw(raws / "canon_kissx4_ml_colorchart.dng")
    visible = source.raw_image_visible // 2
    raw = lowlux.raw_from_array(visible, like=source)
    assert raw.sizes.height == raw.sizes.raw_height == source.sizes.height
    assert (raw.make, raw.model, raw.iso, raw.cfa) == (source.make, source.model, source.iso, source.cfa)
    whole = lowlux.raw_from_array(source.raw_image, like=source)
    assert whole.sizes == source.sizes
    lowlux.write_dng(tmp_path / "a.dng", source)
    lowlux.write_dng(tmp_path / "b.dng", whole)
    assert (tmp_path / "a.dng").read_bytes() == (tmp_path / "b.dng").read_bytes()
    with pytest.raises(lowlux.ArgumentError, match="its visible part"):
        lowlux.raw_from_array(visible[2:], like=source)


BAD = {
    "complex": (np.zeros((24, 24), complex), {}, "complex128"),
    "bool": (np.zeros((24, 24), bool), {}, "bool"),
    "objects": (np.full((24, 24), None), {}, "object"),
    "text": (np.full((24, 24), "a"), {}, "expected integers"),
    "empty": (np.zeros((0, 24), np.uint16), {}, "empty"),
    "one dimension": (np.zeros(24, np.uint16), {}, r"\(24,\)"),
    "two channels": (np.zeros((24, 24, 2), np.uint16), {}, r"\(24, 24, 2\)"),
    "negative": (np.full((24, 24), -1), {}, "range from -1"),
    "too large": (np.full((24, 24), 65536, np.uint32), {}, "65536"),
    "beyond int64": (np.full((24, 24), 2**63, np.uint64), {}, "9223372036854775808"),
    "NaN": (np.full((24, 24), np.nan), {}, "sample"),
    "infinite in 32 bits": (np.full((24, 24), 1e300), {}, "sample"),
    "no black": (np.zeros((24, 24), np.uint16), dict(black=None), "black"),
    "no white": (np.zeros((24, 24), np.uint16), dict(white=None), "white"),
    "NaN black": (np.zeros((24, 24), np.uint16), dict(black=np.nan), "BlackLevel"),
    "two blacks": (np.zeros((24, 24), np.uint16), dict(black=(1, 2)), "2 values"),
    "black above white": (np.zeros((24, 24), np.uint16), dict(black=5000), "black level"),
    "words": (np.zeros((24, 24), np.uint16), dict(black="dark"), "'dark'"),
    "mosaic": (np.zeros((24, 24), np.uint16), dict(cfa="XTRANS"), "XTRANS"),
    "noise": (np.zeros((24, 24), np.uint16), dict(noise=(1, 2, 3)), "3 values"),
    "negative noise": (np.zeros((24, 24), np.uint16), dict(noise=(-1, 0)), "NoiseProfile"),
    "white between codes": (np.zeros((24, 24), np.uint16), dict(white=4095.5), "white: 4095.5 is not an integer"),
    "white of NaN": (np.zeros((24, 24), np.uint16), dict(white=np.nan), "white"),
    "matrix of almost 0": (np.zeros((24, 24), np.uint16), dict(matrix=np.eye(3) * 1e-30), "ColorMatrix"),
    "a row of almost 0": (np.zeros((24, 24), np.uint16), dict(matrix=np.diag([1, 1, 4e-10])), "ColorMatrix"),
    "low": (np.zeros((21, 24), np.uint16), {}, "24 x 21 pixels: expected 22"),
    "narrow": (np.zeros((24, 21), np.uint16), {}, "21 x 24 pixels: expected 22"),
    "long": (np.zeros((22, 64001), np.uint16), {}, "64001 x 22 pixels: expected 22 to 64000"),
    "long floats": (np.zeros((1, 65536), np.float32), {}, "65536 x 1 pixels"),
    "rows that differ": ([[1], [2, 3]], {}, "rows differ"),
    "exposure in words": (np.zeros((24, 24), np.uint16), dict(exposure_s="x"), "exposure_s: 'x' is not a number"),
    "ISO of two": (np.zeros((24, 24), np.uint16), dict(iso=[1, 2]), "iso: .* is not a number"),
    "mosaic of 5": (np.zeros((24, 24), np.uint16), dict(cfa=5), "cfa: a int"),
    "empty mosaic": (np.zeros((24, 24), np.uint16), dict(cfa=""), "cfa"),
    "like a path": (np.zeros((24, 24), np.uint16), dict(like="a.dng"), "like: a str is not a RawImage"),
    "like an array": (np.zeros((24, 24), np.uint16), dict(like=np.zeros((24, 24))), "like: a ndarray is not a RawImage"),
    "exposure of NaN": (np.zeros((24, 24), np.uint16), dict(exposure_s=np.nan), "exposure_s: .* above 0"),
    "endless exposure": (np.zeros((24, 24), np.uint16), dict(exposure_s=np.inf), "exposure_s: .* above 0"),
    "exposure of 0": (np.zeros((24, 24), np.uint16), dict(exposure_s=0), "exposure_s: .* above 0"),
    "negative ISO": (np.zeros((24, 24), np.uint16), dict(iso=-100), "iso: .* above 0"),
    "ISO of NaN": (np.zeros((24, 24), np.uint16), dict(iso=np.nan), "iso: .* above 0"),
    "singular matrix": (np.zeros((24, 24), np.uint16), dict(matrix=np.zeros((3, 3))), "ColorMatrix"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_arrays_are_refused_and_nothing_is_written(case, tmp_path):
    mosaic, figures, message = BAD[case]
    with pytest.raises(lowlux.ArgumentError, match=message) as caught:
        lowlux.write_dng(tmp_path / "bad.dng", mosaic, **{**LEVELS, **figures})
    assert isinstance(caught.value, ValueError)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("state", ["raise", "warn", "ignore"])
@pytest.mark.parametrize("value", [1e300, -1e300, 1e-300, np.nan])
def test_conversions_leave_the_error_state_of_numpy_alone(value, state):
    """What 32 bits cannot hold is an error of lowlux, and 1e-300 is 0 in them; NumPy reports neither."""
    image = np.full((24, 24, 3), value)
    with np.errstate(all=state), warnings.catch_warnings():
        warnings.simplefilter("error")
        before = np.geterr()
        for call in (lambda: lowlux.raw_from_array(image[..., 0], **LEVELS), lambda: lowlux.compare(image, image)):
            try:
                call()
            except lowlux.Error:
                assert not 0 < value < 1
            else:
                assert 0 < value < 1
            assert np.geterr() == before


@pytest.mark.parametrize("kind", [np.uint16, np.int64, np.float32])
def test_arrays_without_memory_for_a_copy_are_refused_at_once(kind):
    """The array has strides of 0: it takes no memory, a copy would take exabytes, and finding its minimum years."""
    huge = np.broadcast_to(kind(100), (2**31 - 1, 500_000_000))
    with pytest.raises(lowlux.TooLargeError, match="mosaic: not enough memory .* GB") as caught:
        lowlux.raw_from_array(huge, **LEVELS)
    assert isinstance(caught.value, MemoryError)


def test_a_raw_image_is_made_by_functions_only(night):
    """One without a frame would read memory that was never written."""
    class Sub(lowlux.RawImage):
        pass

    raw = lowlux.read_raw(night)
    for make in (lowlux.RawImage, Sub, lambda: lowlux.RawImage.__new__(lowlux.RawImage), lambda: Sub.__new__(Sub),
                 lambda: lowlux.RawImage.__new__(Sub), lambda: object.__new__(lowlux.RawImage), lambda: object.__new__(Sub),
                 lambda: copy.copy(raw), lambda: copy.deepcopy(raw), lambda: pickle.dumps(raw)):
        with pytest.raises(TypeError):
            make()


@pytest.mark.parametrize("cfa", PHASES)
@pytest.mark.parametrize("shape", [(1, 1), (1, 6), (6, 1), (5, 3)])
def test_levels_of_frames_that_lack_filters(shape, cfa):
    """The filters are those of the 2x2 cell, whether or not the frame has a pixel of each."""
    raw = lowlux.raw_from_array(np.full(shape, 100, np.uint16), black=[60, 61, 63, 62], white=4095, cfa=cfa)
    level = dict(zip(np.ravel(PHASES[cfa]).tolist(), raw.black_dn.ravel().tolist()))
    assert raw.black_level_per_channel == [level[channel] for channel in range(4)]


def test_the_colour_of_a_pixel_needs_a_mosaic(rng):
    for raw in (lowlux.raw_from_array(codes(rng), cfa="MONO", **LEVELS),
                lowlux.raw_from_array(rng.random((24, 24, 3)), black=0, white=1)):
        with pytest.raises(lowlux.ArgumentError, match="no mosaic"):
            raw.raw_color(0, 0)


EXTREMES = {
    "smallest": (np.full((22, 22), 100, np.uint16), {}),
    "longest": (np.full((22, 64000), 100, np.uint16), {}),
    "highest": (np.full((64000, 22), 100, np.uint16), {}),
    "longest of floats": (np.full((1, 65535), 100, np.float32), {}),
    "one float": (np.full((1, 1), 100, np.float32), {}),
    "small matrix": (np.full((24, 24), 100, np.uint16), dict(matrix=np.eye(3) * 2e-9)),
    "small row": (np.full((24, 24), 100, np.uint16), dict(matrix=np.diag([1, 1, 1e-9]))),
    "large matrix": (np.full((24, 24), 100, np.uint16), dict(matrix=np.eye(3) * 1000)),
    "short exposure": (np.full((24, 24), 100, np.uint16), dict(exposure_s=1e-6, iso=1)),
}


@pytest.mark.parametrize("case", EXTREMES)
def test_what_is_written_can_be_read(case, tmp_path):
    mosaic, figures = EXTREMES[case]
    raw = written(tmp_path / "a.dng", mosaic, **figures)
    np.testing.assert_array_equal(raw.raw_image, mosaic)
    if "matrix" in figures:
        np.testing.assert_allclose(raw.matrices[0], figures["matrix"], rtol=1e-6, atol=0)


def test_errors_are_those_of_the_command(tmp_path, command):
    missing = tmp_path / "missing.dng"
    with pytest.raises(FileNotFoundError) as caught:
        lowlux.read_raw(missing)
    assert isinstance(caught.value, lowlux.NotFoundError) and caught.value.where == str(missing)
    assert command("develop", missing, "-o", tmp_path / "o.png", fails=True) == f"lowlux: {caught.value}\n"
    again = pickle.loads(pickle.dumps(caught.value))
    assert str(again) == str(caught.value)
    (tmp_path / "noise.dng").write_bytes(bytes(range(256)) * 64)
    with pytest.raises(lowlux.Error) as caught:
        lowlux.read_raw(tmp_path / "noise.dng")
    assert command("develop", tmp_path / "noise.dng", "-o", tmp_path / "o.png", fails=True) == f"lowlux: {caught.value}\n"


def test_existing_files_and_missing_folders(tmp_path, rng):
    path = tmp_path / "a.dng"
    first = codes(rng)
    lowlux.write_dng(path, first, **LEVELS)
    with pytest.raises(FileExistsError):
        lowlux.write_dng(path, first + 1, **LEVELS)
    np.testing.assert_array_equal(lowlux.read_raw(path).raw_image, first)
    lowlux.write_dng(path, first + 1, **LEVELS, overwrite=True)
    np.testing.assert_array_equal(lowlux.read_raw(path).raw_image, first + 1)
    with pytest.raises(lowlux.UnwritableError, match="none"):
        lowlux.write_dng(tmp_path / "none" / "a.dng", first, **LEVELS)
    with pytest.raises(lowlux.ArgumentError, match=".dng"):
        lowlux.write_dng(tmp_path / "a.tif", first, **LEVELS)
    with pytest.raises(lowlux.ArgumentError, match="black"):
        lowlux.write_dng(tmp_path / "b.dng", lowlux.read_raw(path), black=3)
