#!/usr/bin/env python3
"""Writes data.js of the page: places of its pictures, film, map, and the measurements of lab/data and lab/runs.

usage: data.py --out FOLDER --frames N --map NAME --start NODE     (scripts/page runs it)
"""
import argparse
import json
import re
import struct
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TABLES = ["calibration-maps", "quality-places", "wild-maps", "frame-times-traced"]


def git(*arguments):
    command = ["git", "-C", str(ROOT), "-c", "safe.directory=*", *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False).stdout.strip()


def jpeg_size(path):
    """Width and height out of the frame header."""
    data, at = path.read_bytes(), 2
    while data[at + 1] not in (0xC0, 0xC1, 0xC2):
        at += 2 + struct.unpack(">H", data[at + 2:at + 4])[0]
    height, width = struct.unpack(">HH", data[at + 5:at + 9])
    return width, height


def pairs(folder):
    made = []
    for line in (folder / "table.txt").read_text().splitlines():
        name, map_name, _, what = line.split(maxsplit=3)
        classic = folder / f"{name}-classic.jpg"
        if not classic.exists():
            continue
        width, height = jpeg_size(classic)
        pair = {"name": name, "map": map_name, "what": what, "width": width, "height": height,
                "classic": f"pictures/{name}-classic.jpg", "traced": f"pictures/{name}-traced.jpg"}
        compared = folder / f"{name}.compared"
        if compared.exists():
            found = re.search(r"SSIM ([\d.]+).*luminance ([\d.]+) and ([\d.]+)", compared.read_text())
            pair |= {"ssim": float(found[1]), "luminance": [float(found[2]), float(found[3])]}
        made.append(pair)
    return made


def megabytes(path):
    return round(path.stat().st_size / 1e6, 1)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--frames", type=int, required=True)
    parser.add_argument("--map", required=True)
    parser.add_argument("--start", required=True, help="the spawn point at which the walk begins: its node in the GLB")
    given = parser.parse_args()
    out = given.out
    films = sorted(out.glob("film.*"))
    glb = out / f"{given.map}.glb"
    three = sum(path.stat().st_size for path in (out / "three").rglob("*.js")) / 1e6
    found = pairs(out / "pictures")
    covers = [pair["classic"] for pair in found if pair["map"] == given.map]
    made = {
        "commit": git("rev-parse", "HEAD") or "unknown",
        "date": git("log", "-1", "--format=%cs") or "unknown date",
        "frames": given.frames,
        "pairs": found,
        "film": {"file": films[0].name, "megabytes": megabytes(films[0])} if films else None,
        "walk": {
            "map": given.map, "file": glb.name, "start": given.start, "bytes": glb.stat().st_size, "mapMegabytes": megabytes(glb),
            "megabytes": round(megabytes(glb) + three, 1), "cover": covers[0] if covers else None,
        } if glb.exists() else None,
        "lab": {name: json.loads((ROOT / f"lab/data/{name}.json").read_text()) for name in TABLES},
        "runs": [json.loads(path.read_text()) for path in sorted((ROOT / "lab/runs").glob("*.json"))],
    }
    text = json.dumps(made, ensure_ascii=False, separators=(",", ":"))
    (out / "data.js").write_text(f"const relight = {text};\n")
    print(f"{len(found)} pairs, {len(made['runs'])} runs, {glb.name} {made['walk']['mapMegabytes'] if made['walk'] else 0} MB")


if __name__ == "__main__":
    main()
