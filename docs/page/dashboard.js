// The charts of the measurements: which file, which columns, which sentence.
"use strict";
{
  const charts = document.getElementById("charts");
  const { lab, runs, pairs } = relight;
  const origin = ({ command, device, date }) => `${command}; ${device}; ${date}.`;
  const middle = (values) => figure(quantile(values, 0.5));
  const spread = (values) => `median ${middle(values)}, 90 % at most ${figure(quantile(values, 0.9))}, worst ${figure(Math.max(...values))}`;

  const timeline = [...runs].sort((a, b) => a.date.localeCompare(b.date));
  /** A chart by commit of the metrics of one name. Each kind (map, device) is a series. */
  function history(id, title, name, sentence, { over, log = false, zero = false, wide = false }) {
    const found = timeline.flatMap((run) => run.metrics.filter((m) => m.name === name && (!over || m.over === over)).map((m) => ({ run, ...m })));
    if (found.length === 0) return;
    const kinds = [...new Set(found.map((m) => `${m.of}${m.over === "maps" ? "" : `, ${m.run.device}`}`))];
    const points = found.map((m) => ({ ...m, series: kinds.indexOf(`${m.of}${m.over === "maps" ? "" : `, ${m.run.device}`}`), name: m.of }));
    const shown = timeline.filter((run) => points.some((p) => p.run === run));
    const { unit } = found[0];
    charts.append(chart({
      id, title, legend: kinds, wide, drawing: byCommit(points, shown, { unit, log, zero }),
      note: sentence, head: ["commit", "day", "of", "device", "median", "least", "most", "values", "command"],
      rows: points.map((p) => [p.run.commit.slice(0, 9), p.run.date.slice(0, 10), p.of, p.run.device, middle(p.values),
        figure(Math.min(...p.values)), figure(Math.max(...p.values)), `${p.values.length} ${p.over}`, p.run.command]),
    }));
  }

  // Calibration: every map before and after
  const maps = lab["calibration-maps"].rows;
  const [before, after] = ["directives", "calibrated"].map((key) => maps.map((row) => ({ name: row.map, value: row[key] })));
  charts.append(chart({
    id: "chart-calibration", title: "Calibration: error of each of OpenArena’s maps", legend: ["calibrated", "lights of the map’s directives"],
    drawing: sortedDots([after, before], ["calibrated", "directives"], { unit: "stops", log: true }),
    note: `Median over texels that the fit did not use of |log2(traced / stored light)|. Directives: ${spread(before.map((p) => p.value))} stops. ` +
      `Calibrated: ${spread(after.map((p) => p.value))} stops. ${origin(lab["calibration-maps"])}`,
    head: ["map", "directives, stops", "calibrated, stops"], rows: maps.map((row) => [row.map, row.directives, row.calibrated]),
  }));
  history("chart-calibration-commits", "Calibration by commit: error over the maps", "calibration error",
    "A dot is the median of the 72 maps, the line reaches from the best to the worst map. From the calibration note’s table in git’s history; " +
    "on 2026-11-22 also the choice of texels that are held out changed.", { over: "maps", zero: true });

  // Quality
  const quality = lab["quality-places"].rows;
  charts.append(chart({
    id: "chart-quality", title: "Quality: a frame of one sample a pixel against its reference", legend: ["SSIM at rest", "SSIM with a moving light"],
    drawing: dotRows(quality.map((row) => ({ name: row.picture.replace(/^baseline: .*/, "baseline"), values: [row.SSIM, row["moving light"]] })), { unit: "SSIM (1: equal)" }),
    note: `Means over ten places. Baseline: uniform choice of lights, no gradients, TAA. ${origin(lab["quality-places"])}`,
    head: ["picture", "SSIM", "FLIP", "moving light, SSIM"], rows: quality.map((row) => [row.picture, row.SSIM, row.FLIP, row["moving light"]]),
  }));
  history("chart-quality-commits", "Quality by commit: the 16th frame of a view", "SSIM of the 16th frame",
    "SSIM against the accumulated picture, at spawn points; a dot is the median, the line reaches from the least to the most.", {});

  // Brightness
  const seen = pairs.filter((pair) => pair.luminance).map((pair) => ({ name: `${pair.map}, ${pair.name}`, values: [pair.luminance[1] / pair.luminance[0]] }));
  if (seen.length > 0) {
    charts.append(chart({
      id: "chart-brightness", title: "Brightness of the pictures above: traced over classic",
      drawing: dotRows(seen, { unit: "traced / classic, mean luminance", equal: 1, log: true }),
      note: `Median ${middle(seen.map((row) => row.values[0]))}. relight compare, for each pair of this page.`,
      head: ["place", "traced / classic"], rows: seen.map((row) => [row.name, figure(row.values[0])]),
    }));
  }
  const wild = lab["wild-maps"].rows.filter((row) => typeof row.luminance === "number");
  charts.append(chart({
    id: "chart-wild", title: "Brightness of maps that Relight was not tuned for", legend: ["traced / classic"],
    drawing: sortedDots([wild.map((row) => ({ name: row.map, value: row.luminance }))], ["brightness"], { unit: "traced / classic", log: true, equal: 1 }),
    note: `Mean luminance over the views of ${wild.length} maps; the dashed line is equal brightness. ${origin(lab["wild-maps"])}`,
    head: ["map", "pack", "traced / classic"], rows: wild.map((row) => [row.map, row.pack, row.luminance]),
  }));
  history("chart-brightness-commits", "Brightness by commit: traced over classic", "brightness",
    "Mean luminance at spawn points; a dot is the median, the line reaches from the least to the most.", {});

  // Speed
  const times = lab["frame-times-traced"].rows;
  charts.append(chart({
    id: "chart-times", title: "Speed: time of a traced frame", drawing: dotRows(times.map((row) => ({ name: row["map, bounces"], values: [row.frame] })), { unit: "ms, median", zero: true }),
    note: `Along a recorded path; the number is that of bounces. ${origin(lab["frame-times-traced"])}`,
    head: ["map, bounces", "ms"], rows: times.map((row) => [row["map, bounces"], row.frame]),
  }));
  for (const look of ["traced", "classic"]) {
    history(`chart-times-${look}-commits`, `Speed by commit: a frame of the ${look} look`, `frame, ${look} look`,
      "GPU time; a run’s figure is the median of its frames. A dot is the median of the runs, the line reaches from the fastest to the slowest.", { zero: true });
  }
  history("chart-seeds-commits", "Calibration by commit: error over choices of texels", "calibration error",
    "Two maps, each calibrated with several seeds; a dot is the median, the line reaches from the least to the most.", { over: "seeds" });
}
