"""scripts/train-denoiser: planes, transform, risk estimate in closed form; the network where PyTorch is installed."""
import importlib.machinery
import importlib.util
import pathlib
import subprocess
import sys

import numpy as np
import pytest

import lowlux

SCRIPT = pathlib.Path(__file__).resolve().parents[2] / "scripts" / "train-denoiser"
PHASES = ["RGGB", "GRBG", "GBRG", "BGGR"]


@pytest.fixture(scope="module")
def trainer():
    """Return the script as a module."""
    loader = importlib.machinery.SourceFileLoader("train_denoiser", str(SCRIPT))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("train_denoiser", loader))
    sys.dont_write_bytecode, before = True, sys.dont_write_bytecode
    loader.exec_module(module)
    sys.dont_write_bytecode = before
    return module


def run(*words):
    return subprocess.run([sys.executable, str(SCRIPT), *map(str, words)], capture_output=True, text=True, check=False)


def drawn_frame(trainer, rng, cfa):
    """Return a frame of any size with levels and noise of each site's own, and values on both sides of black."""
    shape = tuple(rng.integers(23, 90, 2))
    black = np.round(rng.uniform(60, 70, (2, 2)) * 16) / 16  # a DNG states it exactly
    mosaic = (np.tile(black, (45, 45))[:shape[0], :shape[1]] + rng.normal(3, 12, shape)).astype(np.float32)
    noise = np.exp(rng.uniform([-9, -14], [-5, -10], (3, 2)))
    return trainer.Frame(lowlux.raw_from_array(mosaic, black=black, white=4095, cfa=cfa, noise=noise))


@pytest.mark.parametrize("cfa", PHASES)
def test_planes_of_any_phase_and_size_give_the_mosaic_back(trainer, rng, cfa):
    value = {"R": 1, "G": 2, "B": 4}
    for _ in range(20):
        height, width = rng.integers(2, 60, 2)
        mosaic = rng.normal(size=(height, width))
        planes = trainer.pack(mosaic, cfa)
        assert (trainer.unpack(planes, cfa, mosaic.shape) == mosaic).all()
        colours = np.tile(np.array([value[c] for c in cfa]).reshape(2, 2), (30, 30))[:height, :width]
        assert (trainer.pack(colours, cfa) == np.array([1, 2, 2, 4])[:, None, None]).all()


@pytest.mark.parametrize("cfa", PHASES)
def test_an_identity_gives_signed_electrons_back(trainer, rng, cfa):
    for _ in range(5):
        frame = drawn_frame(trainer, rng, cfa)
        assert (frame.electrons < 0).mean() > 0.1 and not frame.clipped.any()
        out = frame.denoised(lambda planes: planes)
        bound = np.abs(frame.electrons).max() * 2.0**-20  # float32 between the two, on both sides of a root
        assert np.abs(out - frame.electrons).max() <= bound


def test_a_file_keeps_tags_and_signed_values(trainer, rng, tmp_path):
    for number, cfa in enumerate(PHASES):
        frame, path = drawn_frame(trainer, rng, cfa), tmp_path / f"{number}.dng"
        frame.write(path, frame.electrons)
        raw = lowlux.read_raw(path)
        np.testing.assert_allclose(raw.raw_image, frame.raw.raw_image, rtol=1e-6)
        assert raw.cfa == cfa and (raw.black_dn == frame.raw.black_dn).all()
        np.testing.assert_allclose(raw.noise, frame.raw.noise)


def test_clipped_sites_are_left_alone_and_masked_pixels_too(trainer, tmp_path):
    made = lowlux.simulate("flat", size=(64, 48), luminance=1, masked_columns=16, seed=4).frames[0]
    made.raw_image_visible[10, 20] = made.white_level
    lowlux.write_dng(tmp_path / "in.dng", made)
    frame = trainer.Frame(trainer.read_bayer(str(tmp_path / "in.dng")))
    clean = frame.denoised(np.zeros_like)
    assert frame.clipped.sum() == 1 and clean[10, 20] == frame.electrons[10, 20]
    assert np.abs(clean[~frame.clipped]).max() == 0
    frame.write(tmp_path / "out.dng", clean)
    raw = lowlux.read_raw(tmp_path / "out.dng")
    assert (raw.raw_image[:, :16] == made.raw_image[:, :16]).all()
    np.testing.assert_allclose(raw.raw_image_visible[~frame.clipped], frame.black[~frame.clipped])


def test_the_inverse_of_a_mean_lacks_a_quarter_of_its_variance(trainer, rng):
    """Where no value lies below black, t = 2 sqrt(y + c) - 2 sqrt(c): E[(t + 2 sqrt(c))^2] / 4 - c = E[y], so that
    inverse(E[t]) + Var(t) / 4 = E[y] without approximation. The variance is 1 + O(1 / e^2)."""
    for _ in range(12):
        read = np.exp(rng.uniform(np.log(0.7), np.log(10)))
        mean = 30 * read + 40 + np.exp(rng.uniform(0, 7))
        y = rng.poisson(mean, 200_000) + rng.normal(0, read, 200_000)
        assert y.min() > 0
        offset = np.float64(read**2 + 0.375)
        t = trainer.stabilise(y, offset)
        np.testing.assert_allclose(trainer.electrons_of(t, offset), y, rtol=1e-11)
        error = np.sqrt((mean + read**2) / y.size)
        assert abs(trainer.electrons_of(t.mean(), offset) + t.var() / 4 - mean) < 5 * error, (read, mean)
        assert abs(t.var() - 1) < 5 * np.sqrt(2 / y.size) + 1 / mean, (read, mean)


def test_the_transform_is_linear_below_black_without_a_step(trainer, rng):
    for offset in np.exp(rng.uniform(np.log(0.4), np.log(200), 20)):
        below = -np.linspace(0, 30, 40) * np.sqrt(offset)
        np.testing.assert_allclose(trainer.stabilise(below, offset), below / np.sqrt(offset), atol=1e-12)
        np.testing.assert_allclose(trainer.electrons_of(trainer.stabilise(below, offset), offset), below, atol=1e-9)
        step = 1e-6 * offset
        up, down = (trainer.stabilise(np.array([s * step]), offset)[0] for s in (1, -1))
        assert up == pytest.approx(-down, rel=1e-5) and up == pytest.approx(step / np.sqrt(offset), rel=1e-5)


def box_blur(values):
    """Return the mean of 3 x 3 values, the frame being a torus: df/dy is 1/9 everywhere."""
    return sum(np.roll(values, (y, x), (0, 1)) for y in (-1, 0, 1) for x in (-1, 0, 1)) / 9


FILTERS = {
    "identity": (lambda y: y, 1.0), "zero": (np.zeros_like, 0.0), "half": (lambda y: y / 2, 0.5),
    "box": (box_blur, 1 / 9),
}


@pytest.mark.parametrize("name", FILTERS)
def test_the_risk_of_linear_filters_is_their_error(trainer, rng, name):
    """Also in closed form: of f = a y + rest the divergence is a at every site, whatever the probes."""
    function, slope = FILTERS[name]
    differences = []
    for _ in range(16):
        read = np.exp(rng.uniform(np.log(0.5), np.log(10)))
        truth = np.exp(rng.uniform(-2, 5)) * (1 + np.sin(np.arange(256) / rng.uniform(2, 30)) * np.ones((256, 1)))
        noisy = rng.poisson(truth) + rng.normal(0, read, truth.shape)
        before, after = trainer.risk.risk_maps(function, noisy, read**2, rng, probes=4)
        np.testing.assert_allclose(before, noisy + read**2)
        exact = (function(noisy) - noisy)**2 + (2 * slope - 1) * (noisy + read**2)
        if name == "box":
            # The sum of eight products of signs / 9 and of steps of neighbours, a mean of zero: sites are alike.
            error = trainer.risk.block_means(after - exact, np.zeros(truth.shape, bool))
            assert abs(error.mean()) < 5 * error.std(ddof=1) / np.sqrt(error.size)
        else:
            np.testing.assert_allclose(after, exact, rtol=1e-6, atol=1e-6 * (np.abs(noisy).max() + read**2))
        blocks = trainer.risk.block_means(after - (function(noisy) - truth)**2, np.zeros(truth.shape, bool))
        differences.append(blocks.mean() / (blocks.std(ddof=1) / np.sqrt(blocks.size)))
    assert np.abs(differences).max() < 5, differences
    assert abs(np.mean(differences)) < 5 / np.sqrt(len(differences)), differences


def test_the_risk_of_a_simulated_frame_is_its_error(trainer, rng):
    for seed in range(4):
        luminance, gain = np.exp(rng.uniform(-3, 1)), ["ISO 400", "ISO 1600", "ISO 6400"][rng.integers(3)]
        frame, truth = trainer.simulated("chart:munsell", luminance=luminance, gain=gain, seed=seed + 1, row_noise=0)
        blur = lambda planes: np.stack([box_blur(p) for p in planes])  # noqa: E731
        row = trainer.risk.check_frame(frame, blur, rng, truth)
        assert row["agrees"], (luminance, gain, row)
        assert row["true_before_e2"] == pytest.approx(row["before_e2"], rel=0.05)


def test_blocks_with_a_clipped_site_are_left_out(trainer):
    values, clipped = np.arange(70.0 * 100).reshape(70, 100), np.zeros((70, 100), bool)
    clipped[40, 3] = clipped[69, 99] = True
    means = trainer.risk.block_means(values, clipped)
    assert means.size == 5 and means[0] == values[:32, :32].mean()


def test_noise_and_black_are_measured_where_a_file_states_no_noise(trainer, raws, tmp_path):
    frame = trainer.Frame(trainer.read_bayer(str(raws / "canon_kissx4_ml_colorchart.dng")))
    assert frame.source == "measured" and frame.electrons.shape == (1156, 1734)
    frame.write(tmp_path / "out.dng", frame.electrons)
    made = lowlux.read_raw(tmp_path / "out.dng")
    assert (made.black_dn < 2052).all()  # of the masked pixels; the tag of the file states 2056
    np.testing.assert_allclose(made.black_dn, frame.black_cell, rtol=1e-6)
    np.testing.assert_allclose(made.raw_image, frame.raw.raw_image, rtol=1e-6)
    # Diagonal second differences in dark, flat places of one colour have the variance of the noise.
    electrons, read = frame.electrons[::2, ::2], frame.read_variance[0, 0]
    detail = (electrons[:-1, :-1] - electrons[1:, :-1] - electrons[:-1, 1:] + electrons[1:, 1:]) / 2
    none = np.zeros(detail.shape, bool)
    level = trainer.risk.block_means(electrons[1:, 1:], none, side=16)
    ratio = trainer.risk.block_means(detail**2, none, side=16)[level < 60] / (level[level < 60] + read)
    assert ratio.size > 100 and np.median(ratio) == pytest.approx(1, abs=0.15)  # the median is below a mean


def test_noise_that_is_not_known_is_refused(trainer, raws):
    for name in ("n900_dog_small_grbg10in16.dng", "openisp_test_rggb10.dng"):
        with pytest.raises(trainer.Failure, match="states no noise, and it cannot be measured"):
            trainer.Frame(trainer.read_bayer(str(raws / name)), name)


def test_arguments_that_contradict_are_refused(tmp_path):
    for words in ([], ["-o", "a.pt", "x.dng"], ["--apply", "a.pt", "x.dng"], ["-o", "a.pt", "--check", "a.pt"],
                  ["-o", "a.pt", "--steps", "0"], ["-o", "a.pt", "--minutes", "-1"]):
        assert run(*words).returncode == 2, words


def test_without_pytorch_it_says_so_in_one_line(night, tmp_path):
    code = ("import runpy, sys; sys.modules['torch'] = None; sys.argv[0] = " + repr(str(SCRIPT)) + "; "
            "runpy.run_path(sys.argv[0], run_name='__main__')")
    out = tmp_path / "out.dng"
    for words in (["-o", tmp_path / "net.pt"], ["--apply", "net.pt", night, out], ["--check", "net.pt", night]):
        done = subprocess.run([sys.executable, "-c", code, *map(str, words)], capture_output=True, text=True,
                              check=False)
        assert done.returncode == 1 and done.stderr.count("\n") == 1, done.stderr
        assert "needs PyTorch (Debian: python3-torch)" in done.stderr
    assert not list(tmp_path.iterdir())


def test_a_folder_that_is_missing_is_reported_before_training(torch, tmp_path):
    done = run("-o", tmp_path / "none" / "net.pt")
    assert done.returncode == 1 and "the folder cannot be written" in done.stderr and done.stderr.count("\n") == 1


@pytest.fixture(scope="module")
def torch():
    module = pytest.importorskip("torch")
    module.set_num_threads(1)
    return module


def some_pair(trainer, random):
    """Return maps as draw_pair() does, of stripes."""
    truth = np.tile(np.repeat(random.uniform(1, 60, 12), 16), (64, 1))
    noisy = random.poisson(truth) + random.normal(0, 2, truth.shape)
    flat = np.ones(truth.shape)
    return np.stack([trainer.pack(m, "RGGB") for m in (noisy, truth, 4.375 * flat, flat)])


def test_steps_of_training_lower_the_loss_of_a_batch(trainer, torch):
    random = np.random.default_rng(2)
    batch = torch.from_numpy(np.stack([some_pair(trainer, random) for _ in range(4)]).astype(np.float32))
    torch.manual_seed(1)
    network = trainer.make_network(torch)
    optimiser = torch.optim.Adam(network.parameters(), lr=2e-3)
    losses = []
    for _ in range(9):
        optimiser.zero_grad()
        loss = trainer.loss_of(network, batch)
        loss.backward()
        optimiser.step()
        losses.append(loss.item())
    assert losses[1] < losses[0] and losses[-1] < losses[0] - 0.5, losses  # dB


def test_a_seed_and_steps_give_the_same_network_and_output(trainer, torch, night, tmp_path):
    outputs = []
    for number in (1, 2):
        net, out = tmp_path / f"{number}.pt", tmp_path / f"{number}.dng"
        trainer.POOL, before = 2, trainer.POOL
        assert trainer.main(["-o", str(net), "--steps", "3", "--threads", "1", "--json"]) == 0
        trainer.POOL = before
        assert trainer.main(["--apply", str(net), str(night), str(out), "--threads", "1"]) == 0
        outputs.append(out.read_bytes())
    assert outputs[0] == outputs[1]
    given, made = lowlux.read_raw(night), lowlux.read_raw(tmp_path / "1.dng")
    assert made.cfa == given.cfa and (made.black_dn == given.black_dn).all() and made.raw_image.dtype == np.float32
    (tmp_path / "bad.pt").write_bytes(b"no network")
    done = run("--apply", tmp_path / "bad.pt", night, tmp_path / "bad.dng")
    assert done.returncode == 1 and "not a network of train-denoiser" in done.stderr and done.stderr.count("\n") == 1


def test_a_shifted_frame_gives_the_shifted_result(trainer, torch, rng):
    """A shift by as many sites as the coarsest scale has is exact inside; a shift by one changes the phase alone."""
    torch.manual_seed(3)
    network = trainer.make_network(torch)
    torch.nn.init.normal_(network.last.weight, std=0.01)

    def function(planes):
        with torch.no_grad():
            return network(torch.from_numpy(planes)[None])[0].numpy()

    mosaic = (70 + 40 * rng.random((240, 240))).astype(np.float32)
    made = []
    for cfa, first in [("RGGB", 0), ("GRBG", 17), ("BGGR", 17), ("GBRG", 17)]:
        rows, columns = (first if cfa in names else 0 for names in (("BGGR", "GBRG"), ("BGGR", "GRBG")))
        part = mosaic[rows:, columns:]
        frame = trainer.Frame(lowlux.raw_from_array(part, black=64, white=4095, cfa=cfa, noise=(1e-3, 1e-5)))
        made.append(frame.denoised(function)[96 - rows:144 - rows, 96 - columns:144 - columns])
    for other in made[1:]:
        np.testing.assert_allclose(other, made[0], atol=1e-3)
    assert np.abs(made[0] - frame.electrons[79:127, 96:144]).max() > 0.01  # the network does something
