"""The pages to be looked at, each made by the command."""
import os
import re
import subprocess

CAMERA = ["--sensor", "ELD_NikonD850", "--gain", "ISO 1600", "--iso", "1600", "--system-gain", "0.5",
          "--read-noise", "2", "--full-well", "20000", "--dark-current", "20,30,25", "--no-truth", "--quiet",
          "--effects", "all"]


class Pages:
    def __init__(self, lowlux, folder):
        self._lowlux = lowlux
        self._folder = folder

    def run(self, *words, timeout_s=100):
        done = subprocess.run([self._lowlux, *words], capture_output=True, text=True, timeout=timeout_s, check=False)
        if done.returncode != 0:
            raise RuntimeError(f"lowlux {' '.join(words)}: exit code {done.returncode}: {done.stderr.strip()}")
        return done.stdout

    def path(self, *names):
        return os.path.join(self._folder, *names)

    def _shoot(self, name, scene, exposure_s, seed, *more):
        self.run("simulate", scene, "-o", self.path(name + ".dng"), "--size", "160x120", "--exposure", exposure_s,
                 "--frames", "2", "--seed", str(seed), *CAMERA, *more)
        return [self.path(f"{name}_{i:04}.dng") for i in range(2)]

    def stages(self):
        """Titles of the stages of bench by their ids."""
        return dict(re.split(" +", line, maxsplit=1) for line in self.run("bench", "--list").splitlines())

    def bench(self, quick):
        """The page of all stages, and how long it says they took."""
        options, timeout_s = (["--quick"], 200) if quick else ([], 3600)
        said = self.run("bench", *options, "-o", self.path("bench"), timeout_s=timeout_s)
        page = self.path("bench", "bench.html")
        if page not in said.split():
            raise RuntimeError(f"bench does not say that it wrote {page}")
        took = said.splitlines()[-1]
        if not re.fullmatch(f"{len(self.stages())} stages took [0-9.]+ s", took):
            raise RuntimeError(f"bench does not end with what it took: {took}")
        return page, took

    def calibration(self):
        darks = self._shoot("dark", "dark", "0.001", 1)
        flats = []
        for i, luminance in enumerate(["0.05", "0.1", "0.2", "0.4", "0.7", "1", "1.4", "20"]):
            flats += self._shoot(f"flat{i}", "flat", "0.1", 2 + i, "--luminance", luminance)
        page = self.path("calibration.html")
        self.run("calibrate", "noise", *flats, "--darks", ",".join(darks), "-o", self.path("camera.json"), "--report", page)
        return page

    def reproduction(self):
        self.run("reproduce", "few-photons", "chromaticity-clouds", "frequency-of-seeing", "dark-desaturation",
                 "--quick", "-o", self.path("findings"))
        return self.path("findings", "report.html")

    def advice(self):
        page = self.path("advice.html")
        self.run("info", "--advise", "--sensor", "ELD_NikonD850", "--luminance", "0.05", "--highlight", "20x",
                 "--max-exposure", "0.05", "--report", page)
        return page
