"""scripts/pmrid: the transform of the noise and the way of a frame through a network, with networks that are known."""
import importlib.machinery
import importlib.util
import pathlib
import subprocess
import sys

import numpy as np
import pytest

import lowlux

SCRIPT = pathlib.Path(__file__).resolve().parents[2] / "scripts" / "pmrid"


@pytest.fixture(scope="module")
def pmrid():
    """Return the script as a module."""
    loader = importlib.machinery.SourceFileLoader("pmrid", str(SCRIPT))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("pmrid", loader))
    sys.dont_write_bytecode, before = True, sys.dont_write_bytecode
    loader.exec_module(module)
    sys.dont_write_bytecode = before
    return module


def run(*words):
    return subprocess.run([sys.executable, str(SCRIPT), *map(str, words)], capture_output=True, text=True, check=False)


@pytest.mark.parametrize("cfa", ["RGGB", "GRBG", "GBRG", "BGGR"])
def test_an_identity_gives_the_frame_back_at_any_size(pmrid, rng, cfa):
    for _ in range(6):
        height, width = rng.integers(2, 150, 2)
        x = rng.normal(0.2, 0.3, (height, width))
        transforms = [pmrid.KSigma(*np.exp(rng.uniform([-12, -20], [-3, -6]))) for _ in range(3)]
        seen = []

        def identity(planes):
            seen.append(planes)
            return planes

        out = pmrid.denoise_mosaic(x, cfa, transforms, identity, clip=False)
        slopes = [t.slope for t in transforms]
        rounding = 2.0**-23 * max(np.abs(seen[0]).max() / 256 / slope for slope in slopes)  # float32 between the two
        assert np.abs(out - x).max() <= rounding
        assert seen[0].dtype == np.float32 and seen[0].shape[:2] == (1, 4)
        assert seen[0].shape[2] % 32 == 0 and seen[0].shape[3] % 32 == 0
        clipped = pmrid.denoise_mosaic(x, cfa, transforms, identity)
        assert np.abs(clipped - x.clip(0, 1)).max() <= rounding


@pytest.mark.parametrize("cfa", ["RGGB", "GRBG", "GBRG", "BGGR"])
def test_planes_are_red_green_green_blue(pmrid, cfa):
    value = {"R": 0.1, "G": 0.2, "B": 0.4}
    cell = np.array([value[c] for c in cfa]).reshape(2, 2)
    cell[[(y, x) for y in (0, 1) for x in (0, 1) if cfa[2 * y + x] == "G" and "B" in cfa[2 * y:2 * y + 2]][0]] = 0.3
    plain = pmrid.KSigma(pmrid.ANCHOR_K / pmrid.WHITE, pmrid.ANCHOR_VARIANCE / pmrid.WHITE**2)  # changes nothing
    seen = []
    pmrid.denoise_mosaic(np.tile(cell, (32, 32)), cfa, [plain] * 3, lambda planes: seen.append(planes) or planes)
    np.testing.assert_allclose(seen[0][0, :, 5, 7], 256 * np.array([0.1, 0.2, 0.3, 0.4]), rtol=1e-6)


def test_transformed_noise_is_that_of_the_networks_camera(pmrid, tmp_path):
    for seed, (luminance, gain) in enumerate([(0.5, "ISO 400"), (1.5, "ISO 1600"), (0.2, "ISO 6400")]):
        flat = lowlux.simulate("flat", size=(512, 512), luminance=luminance, gain=gain, seed=seed + 1,
                               effects="photon-noise,read-noise,clipping,quantisation").frames[0]
        path = tmp_path / f"{seed}.dng"
        lowlux.write_dng(path, flat)
        _, x, _, _, transforms = pmrid.read_frame(str(path))
        for (row, column), transform in zip([(0, 0), (0, 1), (1, 1)], transforms):
            codes = transform.forward(x[row::2, column::2]) * pmrid.WHITE
            expected = pmrid.ANCHOR_K * codes.mean() + pmrid.ANCHOR_VARIANCE
            assert codes.var() == pytest.approx(expected, rel=5 * np.sqrt(2 / codes.size)), (gain, row, column)


def test_networks_that_change_the_size_or_fail_are_refused(pmrid):
    plain = [pmrid.KSigma(1e-3, 1e-6)] * 3
    for network, words in [(lambda p: p[:, :, 1:], "expected the same shape"), (lambda p: p * np.nan, "not finite")]:
        with pytest.raises(pmrid.Failure, match=words):
            pmrid.denoise_mosaic(np.zeros((8, 8)), "RGGB", plain, network)


def test_what_is_missing_is_said_in_one_line(tmp_path, night, raws):
    for name in ("weights.ckp", "net.onnx", "net.pt"):
        (tmp_path / name).write_bytes(b"no network")
    cases = [("none.onnx", night, "there is no such file"), ("weights.ckp", night, "export them as --help states"),
             ("net.onnx", night, "onnxruntime"), ("net.pt", night, "PyTorch|TorchScript")]
    for name, frame, words in cases:
        done = run(tmp_path / name, frame, tmp_path / "out.dng")
        assert done.returncode == 1 and done.stderr.count("\n") == 1, done.stderr
        assert any(word in done.stderr for word in words.split("|")), done.stderr
    assert not (tmp_path / "out.dng").exists()
    assert run("net.onnx", "one.dng").returncode == 2
    mono = tmp_path / "mono.dng"
    lowlux.write_dng(mono, np.full((30, 30), 100, np.uint16), black=10, white=1000, cfa="MONO", noise=(1e-3, 1e-6))
    silent = tmp_path / "silent.dng"
    lowlux.write_dng(silent, np.full((30, 30), 100, np.uint16), black=10, white=1000)
    for frame, words in [(mono, "expected a Bayer mosaic"), (silent, "states no noise"), (tmp_path / "x.dng", "x.dng")]:
        done = run("--check", frame)
        assert done.returncode == 1 and done.stderr.count("\n") == 1 and words in done.stderr, done.stderr


def test_check_passes_a_frame_through(night):
    done = run("--check", night)
    assert done.returncode == 0, done.stderr
    assert float(done.stdout.split("inverse: ")[1].split()[0]) < 1e-6


def test_a_torchscript_network_is_run(tmp_path, night):
    torch = pytest.importorskip("torch")
    torch.jit.trace(torch.nn.Identity(), torch.zeros(1, 4, 64, 64)).save(str(tmp_path / "net.pt"))
    done = run("--no-clip", tmp_path / "net.pt", night, tmp_path / "out.dng")
    assert done.returncode == 0, done.stderr
    out, given = lowlux.read_raw(tmp_path / "out.dng"), lowlux.read_raw(night)
    np.testing.assert_allclose(out.raw_image, given.raw_image, atol=0.01)  # of codes up to 16383, in float32
    assert out.cfa == given.cfa and (out.black_dn == given.black_dn).all()
