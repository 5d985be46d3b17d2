// Loads the walk on request, because three.js and the map are megabytes. Browsers load neither modules nor maps from
// file:// addresses; the message says what to do.
"use strict";
{
  const { walk, pairs } = relight;
  const [start, message, cover] = ["walk-start", "walk-message", "walk-cover"].map((id) => document.getElementById(id));
  const place = document.getElementById("walk-place");
  if (!walk) {
    place.hidden = document.getElementById("walk-keys").hidden = true;
    document.getElementById("walk-what").textContent = "This build has no map: scripts/page without --only converts one.";
  } else {
    document.getElementById("walk-what").textContent =
      `The map ${walk.map} as relight convert writes it, a glTF file with the map’s baked light, shown by three.js. ` +
      `Loading takes ${walk.megabytes} MB, of which the map is ${walk.mapMegabytes} MB.`;
    if (walk.cover) cover.style.backgroundImage = `url(${walk.cover})`;
    start.textContent = `Walk through ${walk.map}`;
    start.addEventListener("click", async () => {
      if (location.protocol === "file:") {
        message.textContent = "Browsers load no maps from files. Run python3 -m http.server in this folder and open http://localhost:8000.";
        return;
      }
      start.hidden = true;
      try {
        const { begin } = await import("./walk.js");
        window.relightWalk = await begin(walk);
      } catch (error) {
        start.hidden = false;
        message.textContent = `The map cannot be shown: ${error.message}`;
      }
    });
  }
}
