#!/usr/bin/env python3
"""Opens the built page in Chromium and checks what is seen and what can be done there.

usage: test.py FOLDER [--pairs N] [--pictures FOLDER] [--browser PROGRAM]

Pictures load; a key and the pointer move the line of a slider; three.js draws the map, and a key walks; each chart has
a mark for each value of lab/data and lab/runs; the console has no error; nothing but the page's own files is requested.
--pictures keeps pictures of the page at two widths and in both colour schemes. Python's own library is enough.
"""
import argparse
import functools
import http.server
import json
import shutil
import sys
import threading
from pathlib import Path

from browser import Browser

LAB = Path(__file__).resolve().parents[2] / "lab"
failures = []


def check(passed, what):
    print(f"{'ok    ' if passed else 'FAILED'} {what}", flush=True)
    if not passed:
        failures.append(what)


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_):
        pass


def serve(folder):
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=str(folder)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return f"http://127.0.0.1:{server.server_port}/"


def rows(name):
    return json.loads((LAB / f"data/{name}.json").read_text())["rows"]


def expected_marks(pairs):
    """Marks of each chart, counted from the files of lab and not by the page's own data."""
    runs = [json.loads(path.read_text()) for path in (LAB / "runs").glob("*.json")]
    metrics = [metric for run in runs for metric in run["metrics"]]

    def named(name, maps=None):
        return sum(m["name"] == name and (maps is None or (m["over"] == "maps") == maps) for m in metrics)

    counts = {
        "chart-calibration": 2 * len(rows("calibration-maps")),
        "chart-calibration-commits": named("calibration error", True),
        "chart-quality": sum(row[key] is not None for row in rows("quality-places") for key in ("SSIM", "moving light")),
        "chart-quality-commits": named("SSIM of the 16th frame"),
        "chart-brightness": pairs,
        "chart-wild": sum(isinstance(row["luminance"], (int, float)) for row in rows("wild-maps")),
        "chart-brightness-commits": named("brightness"),
        "chart-times": len(rows("frame-times-traced")),
        "chart-times-traced-commits": named("frame, traced look"),
        "chart-times-classic-commits": named("frame, classic look"),
        "chart-seeds-commits": named("calibration error", False),
    }
    return {name: count for name, count in counts.items() if count}


def check_pictures(page, pairs):
    page.run("document.querySelectorAll('#pairs img').forEach((i) => { i.loading = 'eager'; })")
    page.wait("[...document.images].every((i) => i.complete)")
    widths = page.run("[...document.querySelectorAll('#pairs img')].map((i) => i.naturalWidth)")
    check(len(widths) == 2 * pairs and all(widths), f"{2 * pairs} pictures are loaded (widths {sorted(set(widths))})")
    alts = page.run("[...document.images].map((i) => i.alt)")
    check(all(alts) and len(set(alts)) == len(alts), "each picture has a text of its own")


def check_slider(page):
    cut = "getComputedStyle(document.querySelector('.pair .classic')).clipPath"
    page.run("document.querySelector('.pair input').focus()")
    before = page.run(cut)
    page.press("ArrowRight")
    after = page.run(cut)
    check("50%" in before and "49%" in after, f"ArrowRight moves the line ({before}, {after})")
    page.drag(page.middle(".pair input", 0.5), page.middle(".pair input", 0.75))
    dragged = page.run(cut)
    check("25%" in dragged, f"the pointer drags the line to three quarters ({dragged})")
    line = page.run("""(() => { const f = document.querySelector('.pair .frame').getBoundingClientRect(),
        d = document.querySelector('.pair .divider').getBoundingClientRect(); return (d.left + d.width / 2 - f.left) / f.width; })()""")
    check(abs(line - 0.75) < 0.01, f"the line is where the pointer is ({line:.3f})")


def check_charts(page, pairs):
    marks = page.run("Object.fromEntries([...document.querySelectorAll('.chart')].map((c) => [c.id, c.querySelectorAll('.mark').length]))")
    expected = expected_marks(pairs)
    check(marks.keys() == expected.keys(), f"{len(expected)} charts are there ({sorted(marks.keys() ^ expected.keys())} differ)")
    for name, count in expected.items():
        check(marks.get(name) == count, f"{name} has {count} marks ({marks.get(name)})")
    broken = page.run("""[...document.querySelectorAll('.mark')].filter((m) => {
        const b = m.getBBox(), v = m.ownerSVGElement.viewBox.baseVal;
        return !(b.x >= 0 && b.y >= 0 && b.x + b.width <= v.width && b.y + b.height <= v.height); }).length""")
    check(broken == 0, f"every mark lies inside of its chart ({broken} outside)")


def check_walk(page):
    page.drag(page.middle("#walk-start"), page.middle("#walk-start"))
    check(page.wait("window.relightWalk && relightWalk.renderer.info.render.frame > 3", 120), "three.js draws the map")
    if not page.run("Boolean(window.relightWalk)"):
        return check(False, f"the walk says: {page.run('document.getElementById(`walk-message`).textContent')}")
    triangles = page.run("relightWalk.renderer.info.render.triangles")
    check(triangles > 0, f"{triangles} triangles are drawn")
    colours = page.run("""(() => { const { renderer, scene, camera } = relightWalk, gl = renderer.getContext();
        renderer.render(scene, camera); const w = gl.drawingBufferWidth, h = gl.drawingBufferHeight, p = new Uint8Array(4 * w * h);
        gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, p);
        return new Set(new Uint32Array(p.buffer)).size; })()""")
    check(colours > 500, f"the picture of the map has {colours} colours")
    lit = page.run("""(() => { let n = 0; relightWalk.scene.traverse((o) => { if (o.material?.lightMap?.image) n++; }); return n; })()""")
    check(lit > 0, f"{lit} meshes have the map's lightmap")
    check(page.wait("relightWalk.walker.stands", 20), "the walker stands on the floor")
    where = "relightWalk.camera.position.toArray()"
    page.run("document.getElementById('walk-canvas').focus()")
    before = page.run(where)
    page.press("w", "KeyW", 1.5)
    after = page.run(where)
    way = sum((a - b) ** 2 for a, b in zip(before, after)) ** 0.5
    check(way > 0.5, f"the key W walks ({way:.2f} m)")
    yaw = "relightWalk.walker.yaw"
    before_touch = page.run(yaw)
    page.touch(page.middle("#walk-canvas", 0.8), page.middle("#walk-canvas", 0.7))
    check(abs(page.run(yaw) - before_touch) > 0.1, "a finger on the right half turns")
    check(abs(after[1] - before[1]) < 3, f"the floor bears the walker ({after[1] - before[1]:+.2f} m)")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("--pairs", type=int, help="pairs of pictures that must be there (default: those of the folder)")
    parser.add_argument("--pictures", type=Path)
    parser.add_argument("--browser", default="chromium")
    given = parser.parse_args()
    pairs = given.pairs or len(list((given.folder / "pictures").glob("*-traced.jpg")))
    if not shutil.which(given.browser):
        sys.exit(f"{given.browser} is not installed: scripts/setup page")
    address = serve(given.folder)
    page = Browser(given.browser)
    try:
        page.size(1280, 900)
        check(page.open(address), "the page opens")
        check_pictures(page, pairs)
        check_slider(page)
        check_charts(page, pairs)
        check_walk(page)
        for width, height in [(1280, 900), (400, 800)]:
            page.size(width, height)
            wide = page.run("document.documentElement.scrollWidth")
            check(wide <= width, f"nothing is wider than a window of {width} pixels ({wide})")
        if given.pictures:
            given.pictures.mkdir(parents=True, exist_ok=True)
            for width, scheme in [(1280, "light"), (1280, "dark"), (400, "light")]:
                page.size(width, 900)
                page.scheme(scheme)
                if width < 600:
                    page.open(f"{address}?narrow")  # charts are drawn for the window's width
                page.wait("new Promise((done) => setTimeout(() => done(true), 800))")
                page.picture(given.pictures / f"page-{width}-{scheme}.png", whole=True)
        foreign = [url for url in page.requests if not url.startswith((address, "data:", "blob:", "about:"))]
        check(not foreign, f"only the page's own files are requested ({len(page.requests)} requests, foreign: {foreign[:3]})")
        # Without a server: all but the walk
        check(page.open((given.folder.resolve() / "index.html").as_uri()), "the page opens as a file")
        check_pictures(page, pairs)
        check_slider(page)
        check_charts(page, pairs)
        page.drag(page.middle("#walk-start"), page.middle("#walk-start"))
        check(page.wait("document.getElementById('walk-message').textContent.includes('http.server')", 10), "as a file, the walk says what it needs")
        check(not page.errors, f"the console has no errors and warnings {page.errors[:5]}")
    finally:
        page.close()
    sys.exit(f"{len(failures)} checks failed" if failures else 0)


if __name__ == "__main__":
    main()
