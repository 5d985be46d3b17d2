#!/usr/bin/env python3
"""Measures the headline figures of the founding papers on this machine, and writes the tables of docs/src/how/papers*.md.

usage: lab/papers.py --label NAME [options]   measures; writes lab/data/papers/NAME.json
       lab/papers.py --page [--check]         writes the tables of the page from lab/data/papers/*.json

The commands relight and relight-lab must be built from the commit: in target/release, or in the folder RELIGHT_BIN.
"""
import argparse
import json
import math
import os
import shlex
import statistics
import subprocess
import sys
import tempfile
from datetime import date
from pathlib import Path

LAB = Path(__file__).resolve().parent
ROOT = LAB.parent
DATA = LAB / "data" / "papers"
PAGES = [ROOT / "docs" / "src" / "how" / name for name in ["papers.md", "papers-cost.md"]]
GAME = "/usr/share/games/openarena/baseoa"
FILTERS = ("trace_gradient", "trace_temporal", "trace_wavelet", "trace_sparse", "trace_bounce_upsample")
# The least time of a run on the GPU.
SECONDS = 1.5
# Settings like those of a tracer on CPUs of 2004: point lights, no light from surface to surface, no filters.
HARD = ["rt_softshadows=0", "rt_bounces=0", "rt_denoiser=0", "rt_taa=0", "rt_bloom=0"]


def objects(text):
    """The JSON objects in a command's output."""
    decoder, at = json.JSONDecoder(), 0
    while (start := text.find("{", at)) >= 0:
        found, length = decoder.raw_decode(text[start:])
        yield found
        at = start + length


class Bench:
    """Runs the commands, and keeps their figures."""

    def __init__(self, given, folder):
        self.given, self.folder = given, Path(folder)
        self.bin = Path(os.environ.get("RELIGHT_BIN", ROOT / "target/release"))
        self.figures, self.device = [], None

    def output(self, command, *options, device=True):
        given = self.given
        shared = ["--device", given.device] if given.device and device else []
        games = [word for game in given.game for word in ("--game", game)]
        made = command[:2] == ["relight-lab", "growth"]
        words = [str(self.bin / command[0]), *command[1:], *shared, *([] if made else games), *map(str, options)]
        done = subprocess.run(words, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            sys.exit(f"{shlex.join(words)} failed:\n{done.stderr.strip()}")
        return done.stdout

    def add(self, row, case, column, unit, values):
        values = [round(value, 5) for value in values]
        self.figures.append({"row": row, "case": case, "column": column, "unit": unit, "values": values})
        print(f"{row}, {case}, {column}: {values} {unit}", flush=True)

    def render(self, game_map, size, *options, sets=(), frames=None, turn=True):
        """Costs of a rendered series of frames: those of --timings, and those of --stats."""
        printed = self.output(
            ["relight", "render", game_map], "--size", size, "--no-accumulation", "--timings", "--stats",
            *(["--turn"] if turn else []), "--spp", frames or self.given.frames, "-o", self.folder / "frame.png",
            *[word for item in [*sets] for word in ("--set", item)], *options)
        found = list(objects(printed))
        stats = next(o for o in found if "memory" in o)
        times = next(o for o in found if "gpu_ms" in o)
        self.device = times["device"]
        return times, stats

    def medians(self, *arguments, frames=None, **keywords):
        """Median frame times of the runs, and the filters' part of each.

        Each run lasts SECONDS or longer on the GPU, because its clock rises only under load: with 60 ms of work the
        frame times of an H200 differ by a factor of 4 between runs.
        """
        found, filters = [], []
        frames = frames or self.given.frames
        while len(found) < self.given.runs:
            times, _ = self.render(*arguments, frames=frames, **keywords)
            needed = min(math.ceil(1000 * SECONDS / times["gpu_ms"]["median"]), 20000)
            if not found and needed > 2 * frames:
                frames = needed
                continue
            found.append(times["gpu_ms"]["median"])
            filters.append(sum(ms for name, ms in times["ms"].items() if name.startswith(FILTERS)))
        return found, filters

    def wants(self, case):
        return not self.given.cases or case in self.given.cases

    def sizes(self, *sizes):
        """Sizes divided by --shrink."""
        return [f"{width // self.given.shrink}x{height // self.given.shrink}" for width, height in sizes]


def c1(bench):
    for size in filter(bench.wants, bench.sizes((1280, 720), (1920, 1080), (2560, 1440))):
        raw = ["--denoiser", "0", "--no-taa", "--bounces", "0"]
        bench.add("C1", size, "all lights", "ms", bench.medians("oa_dm1", size, "--sampling", "all", *raw)[0])
        bench.add("C1", size, "one light", "ms", bench.medians("oa_dm1", size, *raw)[0])
        frames, filters = bench.medians("oa_dm1", size, "--no-taa", "--bounces", "0")
        bench.add("C1", size, "one light, filter", "ms", frames)
        bench.add("C1", size, "of this the filter", "ms", filters)


def c2(bench):
    for game_map in bench.given.maps:
        rows = {}
        for row in objects(bench.output(["relight-lab", "estimators", game_map], "--json", "--frames", bench.given.samples, "--reference", bench.given.samples,
                                        "--size", bench.sizes((512, 384))[0])):
            rows[row["estimator"]] = row
        culled, every = rows["all"], rows["all, not culled"]
        ratio = every["direct_ms"] / culled["direct_ms"]
        noise = every["noise"][0]["relative"] / culled["noise"][0]["relative"]
        bench.add("C2", game_map, "all lights of the map", "ms", [every["direct_ms"]])
        bench.add("C2", game_map, "culled", "ms", [culled["direct_ms"]])
        bench.add("C2", game_map, "ratio of times", "", [ratio])
        bench.add("C2", game_map, "at equal noise", "", [ratio * noise])


def c3(bench):
    found = next(objects(bench.output(
        ["relight-lab", "measure", "oa_dm1"], "--matrix", "--views", 1, "--json", "--reference", bench.given.reference,
        "--size", bench.sizes((1024, 768))[0])))
    names = {("none", False): "no filter", ("none", True): "TAA", ("a-svgf", False): "A-SVGF", ("a-svgf", True): "both"}
    for row in next(iter(found.values())):
        name = names.get((row["filter"], row["taa"]))
        case = "1 light" if row["samples"] == "1" else f"{row['samples']} lights"
        if name:
            bench.add("C3", case, name, "SSIM", [row["ssim"]])
        if name == "no filter":
            bench.add("C3", case, "no filter", "ms", [row["gpu_ms"]])


def c4(bench):
    size = bench.sizes((1280, 720))[0]
    for case, lights in [("all lights", 0), ("one light", 1)]:
        times = [bench.render("oa_dm1", size, sets=[f"rt_numRandomDL={lights}", "rt_denoiser=0", "rt_taa=0"],
                              frames=10 * bench.given.frames)[0]["gpu_ms"] for _ in range(bench.given.runs)]
        for column in ["median", "p95", "p99", "worst"]:
            bench.add("C4", case, column, "ms", [time[column] for time in times])
        bench.add("C4", case, "p99 / median", "", [time["p99"] / time["median"] for time in times])


def c7(bench):
    file = bench.folder / "tracers.json"
    bench.output(["relight-lab", "tracers"], "--made", "36,2064,61562", "--size", "256x256", "--views", 1, "--runs",
                 bench.given.runs, "-o", file, *[word for t in ["compute", "grid", "pipeline"] for word in ("--tracer", t)])
    for row in json.loads(file.read_text())["rows"]:
        if row["mrays"][0]:
            bench.add("C7", row["scene"].replace("made", "triangles:"), row["tracer"], "Mrays/s", row["mrays"][0])


def c8(bench):
    size = bench.sizes((1920, 1080))[0]
    for number, name in [(1, "A-SVGF"), (2, "sparse")]:
        frames, filters = bench.medians("oa_dm1", size, "--denoiser", number, "--no-taa")
        bench.add("C8", name, "filter", "ms", filters)
        bench.add("C8", name, "frame", "ms", frames)
        memory = bench.render("oa_dm1", size, "--denoiser", number, "--no-taa")[1]["memory"]
        bench.add("C8", name, "screen images", "MB", [memory["screen images"] / 1e6])


def c9(bench):
    lights = bench.folder / "lights" / "maps"
    lights.mkdir(parents=True)
    lines = ["without surfaces", "without points", "without suns"]
    lines += [f"point {x} {y} {z + 40} 300 1 1 1" for x, y, z, _ in places(bench, "oa_dm1")[:3]]
    (lights / "oa_dm1.lights").write_text("\n".join(lines) + "\n")
    for edge in [128, 256, 512]:
        if not bench.wants(f"{edge} x {edge}"):
            continue
        for samples in [1, 2, 4, 8]:
            count = max(bench.given.frames // samples, 8)
            sets = [*HARD, f"rt_samples={samples}"]
            times = bench.medians("oa_dm1", f"{edge}x{edge}", "--game", lights.parent, "--tracer", "compute", sets=sets,
                                  frames=count)[0]
            bench.add("C9", f"{edge} x {edge}", f"{samples} a pixel", "frames/s", [1000 / time for time in times])


def places(bench, game_map):
    """Places of cameras: x, y, z, yaw."""
    printed = bench.output(["relight", "cameras", game_map], device=False)
    return [[float(word) for word in line.split("\t")[1].split()] for line in printed.splitlines()]


def c10(bench):
    size = bench.sizes((1920, 1080))[0]
    for deviation in ["40", "8", "4", "1", "0.25"]:
        eye, frames = [], []
        for _ in range(bench.given.runs):
            times, stats = bench.render(bench.given.curves, size, "--bounces", "0", sets=[f"r_subdivisions={deviation}"])
            eye.append(times["ms"]["trace_primary_rays"])
            frames.append(times["gpu_ms"]["median"])
        case = f"r_subdivisions {deviation}"
        bench.add("C10", case, "structures", "KB", [stats["memory"]["acceleration structures"] / 1e3])
        bench.add("C10", case, "rays of the camera", "ms", eye)
        bench.add("C10", case, "frame", "ms", frames)


def c11(bench):
    file = bench.folder / "structures.json"
    bench.output(["relight-lab", "tracers", *bench.given.maps], "--made", "1000000", "--size", "64x64", "--views", 1,
                 "--frames", 6, "--runs", bench.given.runs, "-o", file, "--set", "rt_lights=prior",
                 *[word for tracer in ["compute", "grid", "pipeline"] for word in ("--tracer", tracer)])
    for row in json.loads(file.read_text())["rows"]:
        case = f"{row['scene'].replace('made ', '')}, {row['tracer']}"
        bench.add("C11", case, "structures", "bytes a triangle", [row["bytes"] / row["triangles"]])
        bench.add("C11", case, "build", "ms a million triangles", [1e6 * ms / row["triangles"] for ms in row["build_ms"]])


def c12(bench):
    found = next(objects(bench.output(
        ["relight-lab", "measure", "oa_dm1"], "--cut", "--views", 1, "--json", "--reference", bench.given.reference,
        "--size", bench.sizes((1024, 768))[0])))
    for name, row in next(iter(found.values())).items():
        for frames, ssim in zip(row["frames"], row["ssim"]):
            bench.add("C12", name, f"frame {frames}", "SSIM", [ssim])


def c14(bench):
    size = bench.sizes((1920, 1080))[0]
    for game_map in bench.given.maps:
        for name, looks in [("classic", ["--look", "classic"]), ("hybrid", ["--look", "hybrid"]), ("traced", ["--look", "traced"])]:
            bench.add("C14", game_map, name, "ms", bench.medians(game_map, size, *looks)[0])


ROWS = {"C1": c1, "C2": c2, "C3": c3, "C4": c4, "C7": c7, "C8": c8, "C9": c9, "C10": c10, "C11": c11, "C12": c12, "C14": c14}


def measure(given):
    given.game = given.game or [GAME]
    file = Path(given.output) if given.output else DATA / f"{given.label}.json"
    file.parent.mkdir(parents=True, exist_ok=True)
    command = shlex.join(["lab/papers.py", *sys.argv[1:]])
    with tempfile.TemporaryDirectory() as folder:
        for row in given.rows:
            bench = Bench(given, folder)
            ROWS[row](bench)
            # after each row, so that an interrupted run keeps what is complete
            save(file, row, bench, command)


def save(file, row, bench, command):
    """Writes the figures of a row into the file, in place of older ones."""
    old = json.loads(file.read_text()) if file.exists() else {}
    figures = [figure for figure in old.get("figures", []) if figure["row"] != row] + bench.figures
    figures.sort(key=lambda figure: int(figure["row"][1:]))
    head = {
        "device": bench.given.machine or bench.device or old.get("device"), "date": date.today().isoformat(),
        "commands": old.get("commands", {}) | {row: command},
    }
    lines = ",\n  ".join(json.dumps(figure, ensure_ascii=False) for figure in figures)
    fields = "".join(f' "{key}": {json.dumps(value)},\n' for key, value in head.items())
    file.write_text(f'{{\n{fields} "figures": [\n  {lines}\n ]\n}}\n')


def cell(figure):
    """Median and, of several runs, least and most."""
    if not figure:
        return "–"

    def short(value):
        return f"{value:.3f}" if figure["unit"] == "SSIM" else f"{value:.3g}" if value < 1000 else f"{value:.0f}"
    values = figure["values"]
    median, least, most = (short(of(values)) for of in (statistics.median, min, max))
    return median if least == most else f"{median} ({least} to {most})"


def table(row, runs):
    figures = [(run["device"], figure) for run in runs for figure in run["figures"] if figure["row"] == row]
    if not figures:
        return "*Not measured yet with this command.*"
    columns = list(dict.fromkeys((figure["column"], figure["unit"]) for _, figure in figures))
    cases = list(dict.fromkeys((device, figure["case"]) for device, figure in figures))
    titles = [f"{column}, {unit}" if unit else column for column, unit in columns]
    lines = ["| device | case | " + " | ".join(titles) + " |", "|---" * (2 + len(columns)) + "|"]
    for device, case in cases:
        of_case = {(f["column"], f["unit"]): f for d, f in figures if (d, f["case"]) == (device, case)}
        lines.append(f"| {device} | {case} | " + " | ".join(cell(of_case.get(column)) for column in columns) + " |")
    return "\n".join(lines)


def page(check):
    runs = [json.loads(file.read_text()) for file in sorted(DATA.glob("*.json"))]
    for file in PAGES:
        text = written = file.read_text()
        for row in ROWS:
            begin, end = f"<!-- {row} -->\n", f"<!-- /{row} -->"
            if begin in written:
                before, rest = written.split(begin, 1)
                written = before + begin + "\n" + table(row, runs) + "\n\n" + end + rest.split(end, 1)[1]
        if check and written != text:
            sys.exit(f"{file.relative_to(ROOT)} differs from lab/data/papers: run lab/papers.py --page")
        if not check:
            file.write_text(written)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--page", action="store_true", help="write the tables of the page")
    parser.add_argument("--check", action="store_true", help="with --page: fail where a table differs")
    parser.add_argument("--label", help="name of the file of figures")
    parser.add_argument("--machine", help="device as the page names it (default: Vulkan's name)")
    parser.add_argument("--device", help="part of the Vulkan device's name")
    parser.add_argument("--rows", type=lambda text: text.split(","), default=list(ROWS), metavar="C1,…", help="default: all")
    parser.add_argument("--cases", nargs="+", default=[], metavar="CASE", help="cases of C1 and C9, such as 1280x720 or '128 x 128' (default: all)")
    parser.add_argument("--maps", nargs="+", default=["oa_dm1", "kaos2", "am_galmevish"])
    parser.add_argument("--curves", default="oa_dm5", metavar="MAP", help="map with curves, of C10")
    parser.add_argument("--game", action="append", default=[], metavar="DIR", help=f"game folder (default {GAME})")
    parser.add_argument("--runs", type=int, default=3, help="runs of each time (default 3)")
    parser.add_argument("--frames", type=int, default=300, help="frames of a timed run (default 300: clocks of GPUs rise at first)")
    parser.add_argument("--samples", type=int, default=256, help="frames of an estimator (default 256)")
    parser.add_argument("--reference", type=int, default=1024, help="frames of a reference (default 1024)")
    parser.add_argument("--shrink", type=int, default=1, help="divides sizes, for slow devices; C7 and C9 keep theirs")
    parser.add_argument("--output", help="file of figures (default lab/data/papers/LABEL.json)")
    given = parser.parse_args()
    if given.page:
        page(given.check)
    elif given.label:
        measure(given)
    else:
        parser.error("--label or --page is needed")


if __name__ == "__main__":
    main()
