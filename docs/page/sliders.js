// Pairs of pictures with a line to drag, and the film.
"use strict";

/** An element with attributes and children. */
function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

/** One pair. A range input covers the picture, so that pointer, touch and keyboard need no code of their own. */
function pair({ map, what, classic, traced, width, height }, index) {
  const loading = index < 3 ? "eager" : "lazy";
  const picture = (src, look) =>
    element("img", { src, width, height, loading, class: look, alt: `${map}, ${what}: ${look} look`, draggable: "false" });
  const input = element("input", {
    type: "range", min: 0, max: 100, step: 1, value: 50, "aria-label": `${map}, ${what}: share of the classic picture`,
  });
  const frame = element("div", { class: "frame" },
    picture(traced, "traced"), picture(classic, "classic"), element("span", { class: "divider" }),
    element("span", { class: "look left", "aria-hidden": "true" }, "classic"),
    element("span", { class: "look right", "aria-hidden": "true" }, "traced"), input);
  const move = () => {
    frame.style.setProperty("--at", `${input.value}%`);
    input.setAttribute("aria-valuetext", `${input.value} % classic, ${100 - input.value} % traced`);
    frame.querySelector(".left").hidden = input.value < 12;
    frame.querySelector(".right").hidden = input.value > 88;
  };
  input.addEventListener("input", move);
  move();
  return element("figure", { class: "pair" }, frame, element("figcaption", {}, `${map}: ${what}`));
}

document.getElementById("pairs").append(...relight.pairs.map(pair));
document.getElementById("pictures-how").textContent = relight.pairs.length === 0
  ? "There are no pictures here; scripts/page renders them."
  : `Our own command renders both from OpenArena’s packs: ${relight.frames} frames of one sample a pixel for a traced picture.`;
document.getElementById("built").textContent = `Built from commit ${relight.commit.slice(0, 9)} of ${relight.date}.`;

const film = document.getElementById("film-place");
if (relight.film) {
  const video = element("video", { controls: "", loop: "", muted: "", playsinline: "", preload: "metadata", src: relight.film.file });
  video.setAttribute("aria-label", "A recorded demo in both looks");
  film.append(video, element("p", { class: "note" },
    `One recorded demo of OpenArena in both looks, left the classic and right the traced one; ${relight.film.megabytes} MB.`));
} else {
  film.append(element("p", { class: "note" }, "This build has no film: scripts/page --film FILE adds one."));
}
