// Charts as SVG: rows of dots by name, sorted dots, and points with whiskers by commit. Each has its table.
"use strict";

// Charts are as wide as a narrow window, so that their text keeps its size.
const WIDTH = Math.min(600, Math.max(330, document.documentElement.clientWidth - 28));

function svg(name, attributes = {}, ...children) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

/** The value below which the share `part` of sorted numbers lies, between neighbours in proportion. */
function quantile(numbers, part) {
  const sorted = [...numbers].sort((a, b) => a - b);
  const at = (sorted.length - 1) * part;
  const below = Math.floor(at);
  return sorted[below] + (at - below) * ((sorted[below + 1] ?? sorted[below]) - sorted[below]);
}

const figure = (number) => (number >= 100 ? number.toFixed(0) : String(Number(number.toPrecision(3))));

/** A scale from values to pixels with its ticks; `log` has ticks at 1, 2, 5 times powers of ten. */
function scale(values, from, to, { log = false, zero = false } = {}) {
  let low = Math.min(...values), high = Math.max(...values);
  if (log) {
    const ticks = [];
    for (let power = Math.floor(Math.log10(low)) - 1; power <= Math.log10(high) + 1; power++) {
      for (const digit of [1, 2, 5]) ticks.push(digit * 10 ** power);
    }
    low = Math.max(...ticks.filter((t) => t <= low * 1.001));
    high = Math.min(...ticks.filter((t) => t >= high * 0.999));
    const at = (v) => from + ((to - from) * Math.log(v / low)) / Math.log(high / low);
    return { at, ticks: ticks.filter((t) => t >= low && t <= high) };
  }
  if (zero) low = Math.min(0, low);
  if (low === high) { low -= Math.abs(low) / 10 || 1; high += Math.abs(high) / 10 || 1; }
  const step = [1, 2, 5, 10].map((n) => n * 10 ** Math.floor(Math.log10((high - low) / 4))).find((s) => (high - low) / s <= 6);
  low = Math.floor(low / step + 1e-9) * step;
  high = Math.ceil(high / step - 1e-9) * step;
  const ticks = Array.from({ length: Math.round((high - low) / step) + 1 }, (_, i) => low + i * step);
  return { at: (v) => from + ((to - from) * (v - low)) / (high - low), ticks };
}

const text = (x, y, words, anchor = "start", kind = "") =>
  svg("text", { x, y, "text-anchor": anchor, class: kind }, words);

/** A mark for one value of one row; pointing at it shows the words. */
function mark(series, x, y, words, r = 4) {
  return svg("circle", { class: `mark s${series}`, cx: x.toFixed(1), cy: y.toFixed(1), r }, svg("title", {}, words));
}

/** The frame of a chart: title, legend, drawing, sentence, table. `head` and `rows` are the table. */
function chart({ id, title, legend = [], drawing, note, head, rows, wide = false }) {
  const table = element("table", {},
    element("thead", {}, element("tr", {}, ...head.map((h) => element("th", { scope: "col" }, h)))),
    element("tbody", {}, ...rows.map((row) => element("tr", {}, ...row.map((cell) => element("td", {}, String(cell ?? "–")))))));
  const names = legend.map((name, i) => element("span", {}, element("i", { class: `s${i}` }), name));
  drawing.setAttribute("role", "img");
  drawing.setAttribute("aria-label", `${title}; the values are in the table below`);
  return element("figure", { class: wide ? "chart wide" : "chart", id },
    element("h3", {}, title), element("div", { class: "legend" }, ...names), drawing,
    element("figcaption", {}, note),
    element("details", {}, element("summary", {}, "Table"), element("div", { class: "rows", tabindex: "0" }, table)));
}

/** One line for each row, one dot for each of its values along the line. `equal` is a value to compare with. */
function dotRows(rows, { unit, equal, log, zero, left = 172 }) {
  const width = WIDTH, top = 4, line = 22, bottom = top + rows.length * line;
  const x = scale([...rows.flatMap((r) => r.values.filter((v) => v != null)), ...(equal ? [equal] : [])], left, width - 16, { log, zero });
  const drawn = svg("svg", { viewBox: `0 0 ${width} ${bottom + 36}` });
  for (const tick of x.ticks) {
    drawn.append(svg("line", { class: "grid", x1: x.at(tick), x2: x.at(tick), y1: top, y2: bottom }),
      text(x.at(tick), bottom + 15, figure(tick), "middle"));
  }
  if (equal) drawn.append(svg("line", { class: "equal", x1: x.at(equal), x2: x.at(equal), y1: top, y2: bottom }));
  rows.forEach((row, i) => {
    const y = top + (i + 0.5) * line;
    drawn.append(text(left - 10, y + 4, row.name, "end", "name"));
    row.values.forEach((v, s) => v != null && drawn.append(mark(s, x.at(v), y, `${row.name}: ${figure(v)} ${unit}`, 5)));
  });
  drawn.append(text(width - 16, bottom + 31, unit, "end"));
  return drawn;
}

/** Series of values, each sorted by itself, so that a height is read as a share of the rows. */
function sortedDots(series, names, { unit, log, equal }) {
  const width = WIDTH, height = 300, left = 44, bottom = height - 34;
  const y = scale(series.flatMap((s) => s.map((p) => p.value)), bottom, 24, { log });
  const drawn = svg("svg", { viewBox: `0 0 ${width} ${height}` });
  for (const tick of y.ticks) {
    drawn.append(svg("line", { class: "grid", x1: left, x2: width, y1: y.at(tick), y2: y.at(tick) }),
      text(left - 6, y.at(tick) + 4, figure(tick), "end"));
  }
  if (equal) drawn.append(svg("line", { class: "equal", x1: left, x2: width, y1: y.at(equal), y2: y.at(equal) }));
  const x = (share) => left + 8 + share * (width - left - 16);
  for (const share of [0, 0.25, 0.5, 0.75, 1]) drawn.append(text(x(share), bottom + 18, `${share * 100} %`, "middle"));
  drawn.append(text(width, bottom + 32, "of the maps have no more", "end"), text(0, 10, unit));
  series.forEach((points, s) => [...points].sort((a, b) => a.value - b.value).forEach((p, i) =>
    drawn.append(mark(s, x(i / Math.max(1, points.length - 1)), y.at(p.value), `${p.name}, ${names[s]}: ${figure(p.value)} ${unit}`, 3))));
  return drawn;
}

/** By commit, in the order of time: the median as a dot, a line from the least to the most. `points` have `run`,
    `series`, `values`; points of one series are joined. */
function byCommit(points, runs, { unit, log, zero }) {
  const width = WIDTH, height = 250, left = 52, bottom = height - 50;
  const y = scale(points.flatMap((p) => p.values), bottom, 24, { log, zero });
  const drawn = svg("svg", { viewBox: `0 0 ${width} ${height}` });
  for (const tick of y.ticks) {
    drawn.append(svg("line", { class: "grid", x1: left, x2: width, y1: y.at(tick), y2: y.at(tick) }),
      text(left - 6, y.at(tick) + 4, figure(tick), "end"));
  }
  const slot = (width - left) / runs.length;
  const kinds = 1 + Math.max(...points.map((p) => p.series));
  const x = (run, s) => left + (runs.indexOf(run) + 0.5) * slot + (s - (kinds - 1) / 2) * Math.min(24, slot / (kinds + 1));
  const middleOf = (run) => x(run, (kinds - 1) / 2);
  const every = Math.ceil((runs.length * 58) / (width - left));
  runs.forEach((run, i) => {
    if ((runs.length - 1 - i) % every) return;
    drawn.append(text(middleOf(run), bottom + 18, run.commit.slice(0, 7), "middle"), text(middleOf(run), bottom + 33, run.date.slice(5, 10), "middle"));
  });
  drawn.append(text(width, bottom + 48, `commit and day, in order${every > 1 ? `; one in ${every} is named` : ""}`, "end"), text(0, 10, unit));
  for (const s of new Set(points.map((p) => p.series))) {
    const own = points.filter((p) => p.series === s);
    const middle = (p) => y.at(quantile(p.values, 0.5)).toFixed(1);
    drawn.append(svg("polyline", { class: `path s${s}`, points: own.map((p) => `${x(p.run, s).toFixed(1)},${middle(p)}`).join(" ") }));
    for (const p of own) {
      const at = x(p.run, s), [low, high] = [Math.min(...p.values), Math.max(...p.values)];
      drawn.append(svg("path", { class: `whisker s${s}`, d: `M${at - 3} ${y.at(low)}h6m-3 0V${y.at(high)}m-3 0h6` }),
        mark(s, at, Number(middle(p)), `${p.run.commit.slice(0, 7)}, ${p.run.device}: ${p.name} ${figure(quantile(p.values, 0.5))} ` +
          `(${figure(low)} to ${figure(high)}, ${p.values.length} ${p.over}) ${unit}`));
    }
  }
  return drawn;
}
