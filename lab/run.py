#!/usr/bin/env python3
"""Measures one commit and writes lab/runs/DATE-COMMIT-DEVICE.json, for the charts by commit of the page.

usage: lab/run.py [options]      (lab/README.md describes the file)
       lab/run.py --from-notes   one file for each measured version of the calibration note in git's history
       lab/run.py --from-tracers FILE   the file of relight-lab tracers -o FILE

The command `relight` must be built from the commit: target/release/relight, or RELIGHT in the environment.
"""
import argparse
import json
import os
import re
import shlex
import signal
import subprocess
import sys
import tempfile
from datetime import date
from pathlib import Path

LAB = Path(__file__).resolve().parent
ROOT = LAB.parent
RUNS = LAB / "runs"
NOTES = ["docs/calibration.md", "lab/notes/calibration.md"]  # the note's names in git's history
# Its table was of a trial, says commit 338dad1, which replaces it.
TRIALS = ["a2eeaee"]


def output(command):
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))} failed:\n{done.stderr.strip()}")
    return done.stdout


def git(*arguments):
    return output(["git", "-C", str(ROOT), "-c", "safe.directory=*", *arguments]).strip()


def metric(name, of, unit, over, values):
    return {"name": name, "of": of, "unit": unit, "over": over, "values": values}


def write(label, run):
    RUNS.mkdir(exist_ok=True)
    path = RUNS / f"{run['date'][:10]}-{run['commit'][:7]}-{label}.json"
    lines = ",\n  ".join(json.dumps(m, ensure_ascii=False) for m in run["metrics"])
    head = "".join(f' "{key}": {json.dumps(value, ensure_ascii=False)},\n' for key, value in run.items() if key != "metrics")
    path.write_text(f'{{\n{head} "metrics": [\n  {lines}\n ]\n}}\n')
    print(path.relative_to(ROOT))


def measured(given, folder):
    """The metrics, one after the other, and the device's name with those that used one."""
    relight = os.environ.get("RELIGHT", str(ROOT / "target/release/relight"))
    first = given.maps[0]
    where = f"{first} {given.size}"

    def render(name, *options):
        target = f"{folder}/{name}.png"
        select = ["--device", given.device] if given.device else []
        return target, output([relight, "render", first, "--size", given.size, *select, *options, "-o", target])

    def compare(reference, other):
        found = re.search(r"SSIM ([\d.]+), FLIP ([\d.]+).*luminance ([\d.]+) and ([\d.]+)",
                          output([relight, "compare", reference, other]))
        return [float(number) for number in found.groups()]

    for game_map in given.maps:
        stops = []
        for seed in range(1, given.runs + 1):
            line = output([relight, "calibration", game_map, "--seed", str(seed), "--json"])
            stops.append(round(json.loads(line.splitlines()[0])["after"]["median_stops"], 4))
        yield metric("calibration error", game_map, "stops", "seeds", stops), None
    for look in ["classic", "traced"]:
        times = []
        for _ in range(given.runs):
            printed = render("frame", "--look", look, "--no-accumulation", "--timings", "--turn", "--spp", str(given.frames))[1]
            cost = json.loads(next(line for line in printed.splitlines() if line.startswith("{")))
            times.append(round(cost["gpu_ms"]["median"], 3))
        yield metric(f"frame, {look} look", where, "ms", "runs", times), cost["device"]
    likeness, brightness = [], []
    for spawn in range(given.views):
        view = ["--spawn", str(spawn)]
        reference = render("reference", *view, "--spp", str(given.reference))[0]
        frame = render("frame", *view, "--no-accumulation", "--spp", "16")[0]
        classic = render("classic", *view, "--look", "classic")[0]
        likeness.append(compare(reference, frame)[0])
        luminance = compare(classic, reference)[2:]
        brightness.append(round(luminance[1] / luminance[0], 3))
    yield metric("SSIM of the 16th frame", where, f"against {given.reference} frames", "views", likeness), None
    yield metric("brightness", where, "traced / classic", "views", brightness), None


def measure(given):
    changed = git("status", "--porcelain", "--", "*.rs", "*.toml", "Cargo.lock", "shaders")
    if changed and not given.commit:
        sys.exit(f"The sources differ from the commit; commit or stash them:\n{changed}")
    commit = git("rev-parse", given.commit or "HEAD")
    metrics, devices = [], []
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        with tempfile.TemporaryDirectory() as folder:
            for made, device in measured(given, folder):
                print(f"{made['name']}, {made['of']}: {made['values']} {made['unit']}", flush=True)
                metrics.append(made)
                devices += [device] if device else []
    except KeyboardInterrupt:
        print("Interrupted: the file has what is complete.")
    write(given.label, {
        "commit": commit, "date": git("log", "-1", "--format=%cI", commit), "measured": date.today().isoformat(),
        "device": given.machine or (devices or ["processor"])[0], "command": shlex.join(["lab/run.py", *sys.argv[1:]]),
        "source": None, "metrics": metrics,
    })


def calibrated(text):
    """The errors after calibration, by map, of the table of 72 maps; None where a version of the note has none."""
    column, errors = None, {}
    for line in text.splitlines():
        cells = [cell.strip(" *") for cell in line.strip().strip("|").split("|")]
        if line.startswith("| map |") and "calibrated, stops" in cells:
            column = cells.index("calibrated, stops")
        elif column and line.startswith("|") and len(cells) > column and re.fullmatch(r"[\d.]+", cells[column]):
            errors[cells[0]] = float(cells[column])
        elif not line.startswith("|"):
            column = None
    return errors if len(errors) == 72 else None


def from_notes():
    last = None
    for commit in git("log", "--reverse", "--format=%H", "--", *NOTES).split():
        note = next((n for n in NOTES if git("ls-tree", "--name-only", commit, "--", n)), None)
        errors = note and calibrated(git("show", f"{commit}:{note}"))
        if not errors or errors == last:
            continue
        last = errors
        if commit[:7] in TRIALS:
            continue
        write("note", {
            "commit": commit, "date": git("log", "-1", "--format=%cI", commit),
            "measured": git("log", "-1", "--format=%cs", commit), "device": "any processor: results are the same to the bit",
            "command": "relight calibration MAP…", "source": f"{note} of this commit",
            "metrics": [metric("calibration error", "72 maps of OpenArena", "stops", "maps", [errors[m] for m in sorted(errors)])],
        })


def from_tracers(given):
    report = json.loads(Path(given.from_tracers).read_text())
    commit = git("rev-parse", given.commit or "HEAD")
    metrics = []
    scenes = list(dict.fromkeys(row["scene"] for row in report["rows"]))
    maps = [scene for scene in scenes if not scene.startswith("made ")]
    made = ",".join(scene.removeprefix("made ") for scene in scenes if scene not in maps)
    for row in report["rows"]:
        where = f"{row['scene']} {report['size'][0]}x{report['size'][1]}, {row['tracer']}"
        for name, values in zip(["eye rays", "bounce rays", "light rays"], row["mrays"]):
            metrics += [metric(name, where, "Mrays/s", "runs", values)] if values else []
        metrics.append(metric("build of the map's structures", where, "ms", "runs", row["build_ms"]))
        metrics.append(metric("structures of the map", where, "bytes", "runs", [row["bytes"]]))
    write(given.label, {
        "commit": commit, "date": git("log", "-1", "--format=%cI", commit), "measured": date.today().isoformat(),
        "device": given.machine or report["device"],
        "command": " ".join(["relight-lab tracers", *maps, *(["--made", made] if made else []),
                             f"--size {report['size'][0]}x{report['size'][1]} --views {report['views']} --frames {report['frames']}",
                             f"--runs {report['runs']} -o FILE; lab/run.py --from-tracers FILE"]),
        "source": None, "metrics": metrics,
    })


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--from-notes", action="store_true", help="read measured tables out of git's history")
    parser.add_argument("--from-tracers", metavar="FILE", help="read the file of relight-lab tracers -o FILE")
    parser.add_argument("--commit", help="the commit that the command is built from (default: HEAD, with unchanged sources)")
    parser.add_argument("--maps", nargs="+", default=["oasago2", "oa_dm1"], help="maps to calibrate; the first is also drawn")
    parser.add_argument("--runs", type=int, default=5, help="runs of each time, seeds of each calibration (default 5)")
    parser.add_argument("--views", type=int, default=5, help="spawn points of the first map (default 5)")
    parser.add_argument("--size", default="320x180")
    parser.add_argument("--frames", type=int, default=24, help="frames of a timed run (default 24)")
    parser.add_argument("--reference", type=int, default=256, help="frames of a reference picture (default 256)")
    parser.add_argument("--device", help="part of the Vulkan device's name")
    parser.add_argument("--machine", help="device and driver as the chart names them (default: Vulkan's name of the device)")
    parser.add_argument("--label", default="run", help="end of the file's name, for several devices")
    given = parser.parse_args()
    if given.from_notes:
        from_notes()
    elif given.from_tracers:
        from_tracers(given)
    else:
        measure(given)


if __name__ == "__main__":
    main()
