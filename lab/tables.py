#!/usr/bin/env python3
"""Writes the result tables of lab/notes/*.md as JSON into lab/data.

usage: lab/tables.py [--check]     --check: writes nothing, fails where a file of lab/data differs

The notes hold the figures; TABLES says which of their tables become a file, and names units, device and date.
"""
import json
import re
import sys
from pathlib import Path

LAB = Path(__file__).parent
LAVAPIPE = "lavapipe: Mesa 25.0.7, 2 processor cores"
CPU = "any processor: results are the same to the bit"
H200 = "NVIDIA H200, driver 580.159.04"
H100 = "NVIDIA H100"
SOFTWARE = "Mesa's software drivers, 2 processor cores"
WILD = "triangles; lights; GLB [MiB]; before [stops]; after [stops]; luminance [traced / classic]; " \
    "colour [1000 u'v']; saturation [traced / classic]; warnings; seconds [s]"

# file; note; how the header of the table (or tables) begins; columns with units; device; date; command
TABLES = [
    ("calibration-maps", "calibration", "| map | gamma, lights that end",
     "map; compiler; directives [stops]; calibrated [stops]; known sources; back splashes; points put in",
     CPU, "2026-11-26 (stops), 2026-11-23 (counts)", "relight calibration MAP…"),
    ("calibration-hidden-entities", "calibration", "| map | entities | found",
     "map; entities; found within 32 units; of these within 15 %; median distance [units]; part of the power [%]; "
     "power put in [over power hidden]; agreement [stops]",
     CPU, "2026-11-23", "relight calibration MAP --hide-entities"),
    ("calibration-colour", "calibration", "| γ for", "γ for; distance, mean [1000 u'v']; distance, worst [1000 u'v']; "
     "saturation, mean [traced / classic]; smallest, largest; mean of |saturation − 1|",
     H100, "2026-11-25", "relight-lab looks MAP… --views 4 --frames 16 --size 256x192"),
    ("estimators-mean", "traced-look", "| | uniform | worst tile",
     "map; uniform [%, standard errors]; worst tile of uniform [%, standard errors]; "
     "resampled [%, standard errors]; worst tile of resampled [%, standard errors]",
     H100, "2026-11-24", "relight-lab estimators MAP --frames 4096 --size 512x384"),
    ("estimators-noise", "traced-look", "| after frames | 1 | 16 | 4096",
     "estimator and map; 1 frame [squared noise / squared mean, times frames]; 16 frames; 4096 frames",
     H100, "2026-11-24", "relight-lab estimators MAP --frames 4096 --size 512x384"),
    ("light-lists-direct", "traced-look", "| map | lights | not culled",
     "map; lights; not culled [ms, squared noise / squared mean]; culled [ms, squared noise / squared mean]; "
     "ratio [ms times noise]", H100, "2026-11-27", "relight-lab estimators MAP --size 512x384"),
    ("quality-places", "traced-look", "| picture | SSIM | least | FLIP",
     "picture; SSIM; least [SSIM]; FLIP; noise at rest [median σ/μ]; light off [frames to 10 %]; moving light [SSIM]; "
     "its trail [mean, most]", H100, "2026-11-27", "relight-lab measure MAP --reference 1024 --views 2"),
    ("quality-shadows", "traced-look", "| picture | 0–128",
     "picture; to 128 units [kept contrast]; to 256; to 512; to 1024; to 2048; beyond", H100, "2026-11-27",
     "relight-lab measure MAP --reference 1024 --views 2"),
    ("quality-cut", "traced-look", "| picture | map | 1",
     "picture; map; frame 1 [SSIM]; frame 2; frame 4; frame 8; frame 16; frame 32", H100, "2026-11-27",
     "relight-lab measure MAP --reference 1024 --views 1 --cut"),
    ("quality-samples", "traced-look", "| samples | none",
     "samples; none [SSIM, FLIP]; TAA; A-SVGF; A-SVGF, TAA; sparse; sparse, TAA", H100, "2026-11-27",
     "relight-lab measure oa_dm1 --reference 1024 --views 1 --matrix"),
    ("quality-bounces", "traced-look", "| bounces | relative RMSE",
     "bounces; relative RMSE, mean; relative RMSE, most; luminance over that of 8 bounces, mean; least; "
     "ratio of the darkest tenth, mean; its least; pixels brighter by 5 %",
     H100, "2026-11-27", "relight-lab measure MAP --bounce-counts --reference 1024 --views 2 --size 640x480"),
    ("quality-mirrors", "traced-look", "| place | part |",
     "place; part; A-SVGF moving [SSIM, FLIP]; A-SVGF at rest [SSIM, FLIP]; TAA moving [SSIM, FLIP]; "
     "TAA at rest [SSIM, FLIP]", H200, "2026-11-22, one row 2026-11-23",
     "relight-lab measure MAP --view X,Y,Z,YAW,PITCH --no-lights --reference 1024"),
    ("models-brightness", "traced-look", "| what | places | mean",
     "what; places; mean [traced / classic]; median; least, most", LAVAPIPE, "2026-11-23", "in the engine"),
    ("skies", "traced-look", "| map | kind |", "map; kind; luminance [traced / classic]; SSIM",
     f"first and last table, and oasago1: {LAVAPIPE}; second: {H200}", "2026-11-22 (first table), 2026-11-23",
     "relight render"),
    ("frame-times-traced", "traced-look", "| map, bounces |",
     "map, bounces; eye, plain, primary, other side [ms]; choose, direct, suns [ms]; "
     "bounce, meets, light, fill [ms]; denoiser [ms]; TAA [ms]; fog [ms]; frame [ms, median]",
     H100, "2026-11-24", "relight render MAP --look traced --no-accumulation --timings --path FILE"),
    ("frame-times-classic", "classic-look", "| oa_dm1 | am_galmevish | oa_ctf2 |",
     "oa_dm1 [ms]; am_galmevish [ms]; oa_ctf2 [ms]", H100, "2026-11-24",
     "relight render MAP --look classic --path FILE --timings"),
    ("timedemo", "classic-look", "| demo | frames per second |",
     "demo; frames per second [over opengl1]; processor seconds [over opengl1]", SOFTWARE, "2026-11-24",
     "scripts/bench timedemo --runs 3"),
    ("processor-time", "classic-look", "| demo | outside: game",
     "demo; outside: game, queue, picture [ms]; outside, opengl1 [ms]; rasterizing [ms]; rasterizing, opengl1 [ms]; "
     "X server [ms]; X server, opengl1 [ms]", SOFTWARE, "2026-11-24", "scripts/bench timedemo, sampled by thread"),
    ("fidelity-least", "classic-look", "| frame | SSIM | FLIP |", "frame; SSIM; FLIP; reason",
     SOFTWARE, "2026-11-21", "scripts/fidelity"),
    ("wild-packages", "wild", "| package | maps |", "package; maps; before, median [stops]; after, median [stops]; "
     "after, worst [stops]", CPU, "2026-11-25", "relight calibration MAP"),
    ("wild-maps", "wild", "| map | pack | triangles | lights", f"map; pack; {WILD}",
     f"{H100}, 16 processor cores; rows ons-reborn, reslimed, silvercity: {LAVAPIPE}", "2026-11-25, two rows 2026-11-26",
     "scripts/wild FOLDER"),
    ("tracers-lavapipe", "tracers", "| lavapipe | triangles | tracer",
     "scene; triangles; tracer; cells; build [ms: median, least, most]; structures [KiB]; "
     "eye rays [million a second: median, least, most]; bounce rays; light rays; "
     "eye rays over our hierarchies' [ratio within a run: median, least, most]; bounce rays over theirs",
     f"{LAVAPIPE}, beside other work", "2026-11-28",
     "relight-lab tracers oa_dm1 oa_koth1 hydronex2 --made 36,2064,61562 --size 256x256 --views 2 --frames 6 --runs 5"),
    ("tracers-h200", "tracers", "| H200 | triangles | tracer",
     "scene; triangles; tracer; cells; build [ms: median, least, most]; structures [KiB]; "
     "eye rays [million a second: median, least, most]; bounce rays; light rays; "
     "eye rays over our hierarchies' [ratio within a run: median, least, most]; bounce rays over theirs",
     "NVIDIA H200", "2026-11-28",
     "relight-lab tracers oa_dm1 oa_koth1 hydronex2 --made 36,2064,61562 --size 1920x1080 --views 3 --frames 40 --runs 3 "
     "--set rt_lights=prior"),
    ("maps-converted", "maps-table", "| map | pack | triangles | materials",
     "map; pack; triangles; materials; images; size [MiB]; processor time [s]; errors / warnings",
     "processor", "2026-11-22", "scripts/maps-table"),
]
NUMBER = re.compile(r"(-?[\d.]*\d)(?: (?:%|MiB))?(?: \(([\d.]+)\))?")


def value(text):
    """A number, a list of numbers, text, or None."""
    text = text.replace("**", "").replace("`", "").replace("\\|", "|").strip()
    if text in ("", "–"):
        return None
    numbers = []
    for part in re.split(r" \+ |, ", text):
        found = NUMBER.fullmatch(part)
        if not found:
            outside = re.fullmatch(r"([\d.]+): ([\d., ]+)", text)  # a sum, then its parts
            return [float(n) for n in [outside[1], *outside[2].split(", ")]] if outside else text
        numbers += [float(n) if "." in n else int(n) for n in found.groups() if n]
    return numbers[0] if len(numbers) == 1 else numbers


def tables(lines, header):
    """The heading and the rows (lists of cells) of each table that begins so."""
    heading, at = "", 0
    while at < len(lines):
        line = lines[at]
        heading = line.lstrip("# ") if line.startswith("#") else heading
        if line.startswith(header):
            at += 2
            rows = []
            while at < len(lines) and lines[at].startswith("|"):
                rows.append(re.split(r"(?<!\\)\|", lines[at].strip())[1:-1])
                at += 1
            yield heading, rows
        at += 1


def document(name, note, columns, device, date, command, rows):
    pairs = [re.fullmatch(r"(.*?)(?: \[(.*)\])?", c.strip()).groups() for c in columns.split(";")]
    made = []
    for heading, cells in rows:
        assert len(cells) == len(pairs), (name, cells)
        row = {key: value(cell) for (key, _), cell in zip(pairs, cells)}
        first = pairs[0][0]
        row[first] = row[first] if row[first] is not None else made[-1][first]  # the same as above
        if first == "estimator and map" and ": " not in row[first]:
            row[first] = f"{made[-1][first].split(': ')[0]}: {row[first]}"
        if "compiler" in row:
            gamma, *rest = cells[1].strip().split(", ")
            row["compiler"] = {"gamma": float(gamma), "ends": "ends" in rest, "dirt": "dirt" in rest}
        made.append(({"section": heading} if heading else {}) | row)
    return {"note": f"lab/notes/{note}.md", "device": device, "date": date, "command": command,
            "columns": [{"name": key, "unit": unit} for key, unit in pairs], "rows": made}


def main():
    check, differ = "--check" in sys.argv[1:], []
    for name, note, header, columns, device, date, command in TABLES:
        text = (LAB / "notes" / f"{note}.md").read_text()
        rows = [(heading, row) for heading, rows in tables(text.splitlines(), header) for row in rows]
        assert rows, f"{name}: lab/notes/{note}.md has no such table"
        made = document(name, note, columns, device, date, command, rows)
        written = json.dumps(made, ensure_ascii=False, indent=1) + "\n"
        # one row a line
        written = re.sub(r"\n   +|\n  (?=[\]}])", " ", written)
        path = LAB / "data" / f"{name}.json"
        if check:
            differ += [] if path.exists() and path.read_text() == written else [name]
        else:
            path.write_text(written)
        print(f"{name}: {len(rows)} rows")
    if differ:
        sys.exit(f"lab/data differs from the notes: {', '.join(differ)}; run lab/tables.py")


if __name__ == "__main__":
    main()
