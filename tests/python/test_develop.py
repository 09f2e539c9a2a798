"""develop, denoise and merge: the bytes of the command, of files and of frames in memory."""
import inspect
import json
import re
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import lowlux

FIXED = {"output", "overwrite"}  # of Python; --output and --force
OF_THE_COMMAND = {"help", "help-all", "no-config", "output", "format", "force", "skip-existing", "sync", "jobs", "shard", "explain",
                  "json", "timings",
                  "quiet", "merge"}


def pfm(path):
    """Return the samples of a PFM, from the top row down."""
    with open(path, "rb") as file:
        channels = 3 if file.readline().strip() == b"PF" else 1
        width, height = map(int, file.readline().split())
        order = "<f4" if float(file.readline()) < 0 else ">f4"
        samples = np.frombuffer(file.read(), order).reshape(height, width, channels)[::-1]
    return samples if channels == 3 else samples[..., 0]


def without_times(plan):
    """Return a plan without what differs from run to run."""
    return {name: value for name, value in plan.items() if name not in ("timings_s", "output", "file", "cost")}


DEVELOPED = {
    "default": {},
    "night look": dict(look="eye", scene_luminance=0.05, seeing_map=True),
    "16 bits": dict(bits=16, space="rec2020", wb=4000, exposure=1.5, denoise="high"),
    "half size": dict(half=True, exposure=-0.5, black=(500, 501, 502, 503), repair="off"),
    "finished": dict(wb="tungsten", exposure="auto-0.5", brightness=0.5, contrast=1.2, saturation=1.1, local_tone=0.4, sharpen=0.6,
                     highlights="reconstruct", crop=(8, 6, 60, 40), max_size=50),
    "levels": dict(denoise="off", tone="none", effects="all"),
}


def words_of(options):
    words = []
    for name, value in options.items():
        flag = "--" + name.replace("_", "-")
        words += [flag] if value is True else [flag, ",".join(map(str, value)) if isinstance(value, tuple) else str(value)]
    return words


@pytest.mark.parametrize("case", DEVELOPED)
def test_developing_gives_the_bytes_of_the_command(case, night, tmp_path, command):
    options = DEVELOPED[case]
    command("develop", night, "-o", tmp_path / "command.png", *words_of(options))
    ours = lowlux.develop(night, tmp_path / "python.png", **options)
    assert (tmp_path / "python.png").read_bytes() == (tmp_path / "command.png").read_bytes()
    assert ours.image.dtype == (np.uint16 if options.get("bits") == 16 else np.uint8)
    again = lowlux.develop(lowlux.read_raw(night), **options)
    np.testing.assert_array_equal(again.image, ours.image)
    if options.get("seeing_map"):
        np.testing.assert_array_equal(ours.seeing_map, pfm(tmp_path / "command.seeing.pfm"))


def test_floats_maps_and_plans_are_those_of_the_command(night, tmp_path, command):
    printed = command("develop", night, "-o", tmp_path / "a.pfm", "--json", "--maps")
    made = lowlux.develop(night, bits=32, maps=True)
    assert made.image.dtype == np.float32
    np.testing.assert_array_equal(made.image, pfm(tmp_path / "a.pfm"))
    np.testing.assert_array_equal(made.noise_map, pfm(tmp_path / "a.noise.pfm"))
    np.testing.assert_array_equal(made.confidence_map, pfm(tmp_path / "a.confidence.pfm"))
    assert without_times(made.plan) == without_times(json.loads(printed)[0])


def test_denoising_gives_the_bytes_of_the_command(night, tmp_path, command):
    command("denoise", night, "-o", tmp_path / "command.dng", "--denoise", "high", "--maps")
    ours = lowlux.denoise(night, tmp_path / "python.dng", denoise="high", maps=True)
    assert (tmp_path / "python.dng").read_bytes() == (tmp_path / "command.dng").read_bytes()
    np.testing.assert_array_equal(ours.raw.raw_image, lowlux.read_raw(tmp_path / "command.dng").raw_image)
    np.testing.assert_array_equal(ours.noise_map, pfm(tmp_path / "command.noise.pfm"))
    assert ours.plan["denoise"]["level"] == "high"
    before = lowlux.read_raw(night)
    copy = before.raw_image.copy()
    memory = lowlux.denoise(before, denoise="high")
    np.testing.assert_array_equal(memory.raw.raw_image, ours.raw.raw_image)
    np.testing.assert_array_equal(before.raw_image, copy)


@pytest.mark.parametrize("options", [{}, dict(align="none", mean="plain"), dict(align="cells", false_alarm=0.01)])
def test_merging_gives_the_bytes_of_the_command(options, burst, tmp_path, command):
    command("merge", *burst, "-o", tmp_path / "command.dng", *words_of(options))
    ours = lowlux.merge(burst, tmp_path / "python.dng", **options)
    assert (tmp_path / "python.dng").read_bytes() == (tmp_path / "command.dng").read_bytes()
    memory = lowlux.merge([lowlux.read_raw(path) for path in burst], **options)
    np.testing.assert_array_equal(memory.raw.raw_image, ours.raw.raw_image)
    assert len(ours.plan["frames"]) == len(burst)


def test_a_list_is_merged_and_developed_as_the_command_does(burst, tmp_path, command):
    command("develop", "--merge", *burst, "-o", tmp_path / "command.png", "--half")
    lowlux.develop(burst, tmp_path / "python.png", half=True)
    assert (tmp_path / "python.png").read_bytes() == (tmp_path / "command.png").read_bytes()


def test_a_frame_that_is_given_twice_is_not_merged(burst, tmp_path, monkeypatch):
    """Its noise would be taken for that of independent frames."""
    raw, other = lowlux.read_raw(burst[0]), lowlux.read_raw(burst[1])
    monkeypatch.chdir(burst[0].parent)
    twice = ([burst[0], burst[1], f"./{burst[0].name}"], [raw, other, raw], [burst[0], burst[0]])
    for frames in twice:
        for call in (lowlux.merge, lambda frames, output: lowlux.develop(frames, output.with_suffix(".png"))):
            with pytest.raises(lowlux.ArgumentError, match="given twice|same frame"):
                call(frames, tmp_path / "a.dng")
    assert list(tmp_path.iterdir()) == []


def test_the_reference_is_one_of_the_frames(burst, tmp_path):
    raws = [lowlux.read_raw(path) for path in burst]
    by_path = lowlux.merge(burst, reference=burst[2])
    assert [frame["reference"] for frame in by_path.plan["frames"]].index(True) == 2
    for reference in (raws[2], "raws[2]"):
        by_frame = lowlux.merge(raws, reference=reference)
        np.testing.assert_array_equal(by_frame.raw.raw_image, by_path.raw.raw_image)
    for frames in (burst, raws):
        for reference in ("nonsense.dng", "raws[9]", repr(raws[2])):
            for call in (lowlux.merge, lowlux.develop):
                with pytest.raises(lowlux.ArgumentError, match="reference"):
                    call(frames, reference=reference)


def test_a_file_with_the_name_of_a_frame_in_memory_is_not_taken_for_it(burst, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "raws[1]").write_bytes(burst[0].read_bytes())
    with pytest.raises(lowlux.ArgumentError, match="rename"):
        lowlux.merge(["raws[1]", lowlux.read_raw(burst[1])])


def test_an_array_is_developed_like_its_file(rng, tmp_path):
    mosaic = rng.integers(64, 1200, (64, 96), dtype=np.uint16)
    figures = dict(black=64, white=4095, cfa="GBRG", noise=(1e-3, 1e-5), matrix=np.diag([0.6, 1.0, 0.7]))
    lowlux.write_dng(tmp_path / "a.dng", mosaic, **figures)
    memory = lowlux.develop(lowlux.raw_from_array(mosaic, **figures))
    np.testing.assert_array_equal(memory.image, lowlux.develop(tmp_path / "a.dng").image)


@pytest.mark.parametrize("verb", ["develop", "denoise", "merge"])
def test_every_option_of_the_command_is_an_argument(verb, command):
    options = set(re.findall(r"^  (?:-\w,)?--([a-z-]+)", command(verb, "--help-all"), re.MULTILINE)) - OF_THE_COMMAND
    function = inspect.signature(getattr(lowlux, verb)).parameters
    arguments = {name for name, p in function.items() if p.kind == p.KEYWORD_ONLY} - FIXED
    assert arguments == {option.replace("-", "_") for option in options}


@pytest.mark.parametrize("options", [dict(exposure="bright"), dict(exposure="1,5"), dict(denoise="most"), dict(bits=12),
                                     dict(space="srgb", bits=32), dict(profile="none.json"), dict(dark_noise=0.5),
                                     dict(budget_ms=100, budget_mpps=5), dict(dark_frame="no_such.dng")])
def test_wrong_options_have_the_message_of_the_command(options, night, tmp_path, command):
    with pytest.raises(lowlux.Error) as caught:
        lowlux.develop(night, tmp_path / "a.tif", **options)
    said = command("develop", night, "-o", tmp_path / "a.tif", *words_of(options), fails=True)
    assert str(caught.value).removeprefix("lowlux develop: ") in said
    assert list(tmp_path.iterdir()) == []


def test_bad_inputs_and_outputs(night, tmp_path, rng):
    with pytest.raises(lowlux.ArgumentError, match="raw_from_array"):
        lowlux.develop(np.zeros((24, 24), np.uint16))
    with pytest.raises(lowlux.ArgumentError, match="unknown.tga"):
        lowlux.develop(night, tmp_path / "unknown.tga")
    with pytest.raises(lowlux.ArgumentError, match=".dng"):
        lowlux.denoise(night, tmp_path / "a.png")
    with pytest.raises(TypeError):
        lowlux.develop(night, exposur=1)
    with pytest.raises(lowlux.ArgumentError, match="replace"):
        lowlux.denoise(night, night, overwrite=True)
    (tmp_path / "a.png").write_bytes(b"kept")
    with pytest.raises(lowlux.ExistsError):
        lowlux.develop(night, tmp_path / "a.png")
    assert (tmp_path / "a.png").read_bytes() == b"kept"
    grey = lowlux.raw_from_array(rng.integers(64, 999, (64, 64)), black=64, white=4095, cfa="MONO")
    assert lowlux.denoise(grey).raw.raw_image.shape == (64, 64)
    unknown = lowlux.raw_from_array(rng.random((64, 64, 3)), black=0, white=1)
    with pytest.raises(lowlux.Error):
        lowlux.denoise(unknown)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_values_written_to_a_view_are_checked(value, rng, tmp_path):
    figures = dict(black=0, white=1, noise=(1e-3, 1e-5), matrix=np.diag([0.6, 1.0, 0.7]))
    raw = lowlux.raw_from_array(rng.random((64, 64)), **figures)
    whole = lowlux.develop(raw).image
    raw.raw_image[40, 3] = value
    other = lowlux.raw_from_array(np.full((64, 64), 0.5), **figures)
    for call in (lambda: lowlux.develop(raw, tmp_path / "a.png"), lambda: lowlux.denoise(raw, tmp_path / "a.dng"),
                 lambda: lowlux.merge([other, raw], tmp_path / "a.dng"), lambda: lowlux.write_dng(tmp_path / "a.dng", raw)):
        with pytest.raises(lowlux.ArgumentError):
            call()
    assert list(tmp_path.iterdir()) == []
    raw.raw_image[40, 3] = 0.5
    assert lowlux.develop(raw).image.shape == whole.shape


def test_values_that_another_thread_writes_are_checked_in_the_copy(rng):
    """Either the sample is refused, or nothing of it is in the result. Checking takes long enough for it to change."""
    raw = lowlux.raw_from_array(rng.random((2048, 2048), dtype=np.float32), black=0, white=1)
    view, done = raw.raw_image, threading.Event()

    def write():
        while not done.is_set():
            view[0, 0] = 1e30
            view[0, 0] = 0.5

    writer = threading.Thread(target=write)
    writer.start()
    try:
        for _ in range(50):
            try:
                image = lowlux.develop(raw, bits=32, space="camera", denoise="off", repair="off", half=True).image
            except lowlux.ArgumentError:
                continue
            assert np.abs(image[:8, :8]).max() < 100
    finally:
        done.set()
        writer.join()


LIMITED = """
import resource, sys
import lowlux
raw = lowlux.read_raw(sys.argv[2])
resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, 60_000))  # between a map, of 38 kB, and the image
try:
    getattr(lowlux, sys.argv[1])(raw, sys.argv[3], maps=True)
except lowlux.UnwritableError as error:
    print(error)
"""


@pytest.mark.parametrize("verb, name", [("develop", "a.tif"), ("develop", "a.pfm"), ("denoise", "a.dng")])
def test_an_output_that_cannot_be_written_leaves_no_maps(verb, name, night, tmp_path):
    done = subprocess.run([sys.executable, "-c", LIMITED, verb, night, tmp_path / name], capture_output=True, text=True,
                          check=True)
    assert name in done.stdout and done.stdout.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_threads_run_at_once(night):
    """While one thread develops, others run Python: the global lock is released."""
    raw = lowlux.read_raw(night)
    alone = lowlux.develop(raw, denoise="best").image
    results, ticks, done = [], 0, threading.Event()

    def work():
        results.append(lowlux.develop(raw, denoise="best").image)

    def finish():
        for worker in workers:
            worker.join()
        done.set()

    workers = [threading.Thread(target=work) for _ in range(2)]
    for worker in workers:
        worker.start()
    threading.Thread(target=finish).start()
    while not done.is_set():
        time.sleep(0.0005)
        ticks += 1
    assert ticks >= 10
    for image in results:
        np.testing.assert_array_equal(image, alone)
