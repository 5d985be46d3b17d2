#!/usr/bin/env python3
"""Quality of clips as people see it: ColorVideoVDP's JOD of each clip that `relight-lab measure --clips DIR` wrote.

    python3 -m venv jod && jod/bin/pip install cvvdp 'torch==2.0.1' 'torchvision==0.15.2' 'numpy<2'
    jod/bin/python lab/jod.py DIR [-o jod.json] [--display standard_fhd]

JOD: just-objectionable differences, 10 for equal videos; one JOD less is noticed by 75 % of people (Mantiuk et al.,
"ColorVideoVDP", ACM Transactions on Graphics 43, 2024). The value depends on the display and the distance, which
--display selects by name; `cvvdp --display ?` lists the names. A clip is compared with its folder `reference`, frame by frame
at the rate of its clip.json. The versions are those that it was tried with, on Python 3.11 and cvvdp 0.5.7; torch 2.11 with
torchvision 0.26 works, too.

Prints a row for each clip and picture and the mean of each picture, and writes them as JSON.
"""

import argparse
import concurrent.futures
import importlib.metadata
import json
import pathlib
import sys


def frames(folder, count):
    """The pictures 0000.png, 0001.png, … as an array: frame, row, column, channel."""
    import imageio.v3 as imageio
    import numpy

    files = [folder / f"{number:04}.png" for number in range(count)]
    # the decoder leaves Python's lock
    with concurrent.futures.ThreadPoolExecutor() as threads:
        return numpy.stack(list(threads.map(imageio.imread, files)))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("clips", type=pathlib.Path, metavar="DIR", help="folder of relight-lab measure --clips")
    parser.add_argument("-o", "--output", type=pathlib.Path, help="JSON to write; default: DIR/jod.json")
    parser.add_argument("--display", default="standard_fhd", help="display model of ColorVideoVDP")
    given = parser.parse_args()
    try:
        import pycvvdp
    except ImportError as missing:
        sys.exit(f"{missing}: pip install cvvdp")

    clips = sorted(given.clips.glob("*/clip.json"))
    if not clips:
        sys.exit(f"{given.clips}: no clips in it")
    metric = pycvvdp.cvvdp(display_name=given.display, heatmap=None, quiet=True)
    rows = []
    for about in clips:
        clip = json.loads(about.read_text())
        folder = about.parent
        reference = frames(folder / "reference", clip["frames"])
        for picture in clip["pictures"]:
            shown = frames(folder / picture, clip["frames"])
            jod, _ = metric.predict(shown, reference, dim_order="FHWC", frames_per_second=clip["rate"])
            rows.append({"clip": folder.name, "picture": picture, "jod": round(float(jod), 4)})
            print(f"{folder.name:<24} {picture:<16} {rows[-1]['jod']:8.4f}", flush=True)
    means = {}
    for row in rows:
        means.setdefault(row["picture"], []).append(row["jod"])
    means = {picture: round(sum(values) / len(values), 4) for picture, values in means.items()}
    for picture, mean in means.items():
        print(f"{'mean of ' + str(len(clips)):<24} {picture:<16} {mean:8.4f}")
    result = {
        "metric": f"cvvdp {importlib.metadata.version('cvvdp')}",
        "display": given.display,
        "rows": rows,
        "mean": means,
    }
    output = given.output or given.clips / "jod.json"
    output.write_text(json.dumps(result, indent=1) + "\n")


if __name__ == "__main__":
    main()
