"""Data sets of arrays, read with NumPy alone: they hold what those of DNGs hold."""
import json

import numpy as np
import pytest

import lowlux

TYPES = {"U8": np.uint8, "U16": "<u2", "F32": "<f4"}


def read_safetensors(path):
    """Return the arrays and the metadata of a file. Arrays are aligned, and fill the file without gaps."""
    data = path.read_bytes()
    begin = 8 + int.from_bytes(data[:8], "little")
    assert begin % 8 == 0 and data[8:9] == b"{"
    header = json.loads(data[8:begin])
    metadata = header.pop("__metadata__")
    ends = sorted(entry["data_offsets"] for entry in header.values())
    assert [0] + [end for _, end in ends] == [first for first, _ in ends] + [len(data) - begin]
    arrays = {}
    for name, entry in header.items():
        first, end = entry["data_offsets"]
        kind = np.dtype(TYPES[entry["dtype"]])
        assert (begin + first) % kind.itemsize == 0
        arrays[name] = np.frombuffer(data[begin + first:begin + end], kind).reshape(entry["shape"])
    return arrays, metadata


def read_exr(path):
    """Return the red, green and blue of an OpenEXR file without compression, and whether its samples are halves."""
    data = path.read_bytes()
    at, attributes = 8, {}
    while data[at]:
        name, kind, rest = data[at:].split(b"\0", 2)
        at += len(name) + len(kind) + 2
        size = int.from_bytes(data[at:at + 4], "little")
        attributes[name] = data[at + 4:at + 4 + size]
        at += 4 + size
    left, top, right, bottom = np.frombuffer(attributes[b"dataWindow"], "<i4")
    assert attributes[b"compression"] == b"\0" and attributes[b"channels"][:2] == b"B\0"
    kind = {1: "<f2", 2: "<f4"}[attributes[b"channels"][2]]
    width, height = right - left + 1, bottom - top + 1
    offsets = np.frombuffer(data, "<u8", height, at + 1).tolist()
    rows = [np.frombuffer(data, kind, 3 * width, offset + 8).reshape(3, width) for offset in offsets]
    return np.stack(rows)[:, ::-1].transpose(0, 2, 1), kind == "<f2"


def read_arrays(folder, sample):
    """Return the arrays of a sample by their names, those of several frames as a stack."""
    name = sample["files"][0]["name"]
    if name.endswith(".safetensors"):
        arrays, metadata = read_safetensors(folder / name)
        stated = {key: value if isinstance(sample[key], str) else json.loads(value) for key, value in metadata.items()}
        assert stated == {key: value for key, value in sample.items() if key != "files"}
        return arrays
    arrays = {}
    for part in sample["files"]:
        kind = part["name"].split(".")[1]
        arrays.setdefault({"electrons": "truth_electrons"}.get(kind, kind), []).append(np.load(folder / part["name"]))
    return {kind: all[0] if len(all) == 1 else np.stack(all) for kind, all in arrays.items()}


def draw_spec(rng):
    """Return a spec of three samples, and print it; sizes are odd too."""
    pick = lambda *values: values[rng.integers(len(values))]
    spec = {"seed": int(rng.integers(1 << 30)), "count": 3, "first_index": int(rng.integers(1 << 62)),
            "scenes": ["chart", "flat", "dark"], "sensors": ["ELD_SonyA7S2", "ELD_NikonD850"],
            "size": {"choice": [f"{rng.integers(22, 70)}x{rng.integers(22, 70)}" for _ in range(3)]},
            "exposure_s": {"uniform": [0.01, 0.5]}, "luminance_cd_m2": {"log_uniform": [0.01, 100]},
            "masked_columns": pick(0, 4), "cfa": pick("rggb", "gbrg"), "frames": pick(1, 1, 3),
            "effects": pick("all", "all", "photon-noise,read-noise", "read-noise,quantisation,clipping"),
            "mask": pick(True, True, False), "truth_electrons": pick(True, False)}
    print(spec)
    return spec


@pytest.fixture
def make(tmp_path, command):
    """Return a function that makes a data set in a format, None being that without the key, and returns its folder."""

    def made(spec, name):
        path, folder = tmp_path / f"{name}.json", tmp_path / f"{name}"
        path.write_text(json.dumps(spec if name is None else {**spec, "format": name}))
        command("dataset", path, "-o", folder, "--quiet")
        return folder

    return made


def samples(folder):
    return {path.stem: json.loads(path.read_text()) for path in sorted(folder.glob("[0-9]*.json"))}


@pytest.mark.parametrize("seed", range(6))
def test_arrays_are_those_of_the_dngs(seed, make):
    spec = draw_spec(np.random.default_rng(seed))
    dngs = make(spec, "dng")
    for name in ("npy", "safetensors"):
        folder = make(spec, name)
        assert samples(folder).keys() == samples(dngs).keys()
        assert {path.suffix for path in folder.iterdir()} == {".json", f".{name}"}
        for stem, sample in samples(folder).items():
            expected = samples(dngs)[stem]
            for key in expected.keys() - {"files", "spec_sha256"}:
                assert sample[key] == expected[key], key
            arrays = read_arrays(folder, sample)
            named = {part["name"]: dngs / part["name"] for part in expected["files"]}
            raws = [lowlux.read_raw(path) for path in named.values() if path.suffix == ".dng"]
            stacked = lambda all: all[0] if len(all) == 1 else np.stack(all)
            np.testing.assert_array_equal(arrays.pop("raw"), stacked([raw.raw_image for raw in raws]), strict=True)
            if spec["mask"]:
                masks = [np.load(path) for path in named.values() if path.suffix == ".npy"]
                np.testing.assert_array_equal(arrays.pop("mask"), stacked(masks), strict=True)
            for file, kind in ((f"{stem}.truth.exr", "truth"), (f"{stem}.electrons.exr", "truth_electrons")):
                if file in named:
                    truth, half = read_exr(named[file])
                    array = arrays.pop(kind)
                    assert array.dtype == np.float32 and array.shape == truth.shape
                    np.testing.assert_array_equal(array.astype(truth.dtype), truth, strict=True)
                    assert half == (kind == "truth")
            assert not arrays


@pytest.mark.parametrize("seed", range(8))
def test_the_parameters_state_what_the_tags_of_the_dng_state(seed, make, command):
    folder = make(draw_spec(np.random.default_rng(100 + seed)), "dng")
    for sample in samples(folder).values():
        dng = folder / sample["files"][0]["name"]
        info, raw = json.loads(command("info", "--json", dng)), sample["raw"]
        info = info[0] if isinstance(info, list) else info
        black, white = raw.pop("black_level_dn"), raw.pop("white_level_dn")
        assert black == pytest.approx(info["black"]["tag"]["pattern_dn"][0], rel=1e-6) and [white] * 3 == info["white_dn"]
        gain = raw.pop("gain_e_per_dn")
        assert raw.keys() == {"cfa", "active", "default_crop", "masked", "noise_profile", "exposure", "colour"}
        same(raw, {key: info[key] for key in raw})
        if raw["noise_profile"]:  # its scale is the gain in white levels; white is rounded
            assert 1 / raw["noise_profile"]["scale"][0] == pytest.approx(gain * (white - black), abs=gain)


def same(ours, tags):
    """Compare JSON; numbers are within the precision of rationals."""
    if isinstance(ours, dict):
        assert ours.keys() == tags.keys()
        for key in ours.keys() - {"source", "cct_k"}:  # a DNG has the nearest light source
            same(ours[key], tags[key])
    elif isinstance(ours, list):
        assert len(ours) == len(tags)
        for one, other in zip(ours, tags):
            same(one, other)
    elif isinstance(ours, float):
        assert ours == pytest.approx(tags, rel=1e-6, abs=1e-9)
    else:
        assert ours == tags


def test_the_key_changes_no_byte_of_dngs(make):
    spec = draw_spec(np.random.default_rng(7))
    plain, keyed = make(spec, None), make(spec, "dng")
    names = [path.name for path in plain.iterdir() if path.suffix != ".json"]
    assert sorted(names) == sorted(path.name for path in keyed.iterdir() if path.suffix != ".json")
    for name in names:
        assert (plain / name).read_bytes() == (keyed / name).read_bytes()
    for stem, sample in samples(plain).items():
        assert sample.keys() == samples(keyed)[stem].keys() - {"raw"}
