// Frames of a fluid in space, one by one: loaded before they are due, coloured on one scale.

import { indexAt } from "./clock.js";
import { number } from "./motion.js";

const AHEAD = 2; // frames that are loaded before they are due
const BEHIND = 3; // frames before the one that is due, of which one will do until that is there

export const bytesOf = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));

// `source` has the times, top, unit, colours, and `frame(i)`, which promises a frame, which `decoded` takes. `name` is
// that of the elements which switch it and show its scale.
export function makeReel(source, name, decoded, repaint) {
  const choice = document.getElementById(name), scale = document.getElementById(`${name}-scale`);
  let palette = null;
  const shots = [], coming = new Set();

  // One that is on another scale stays until it is there again.
  function load(i) {
    const { top } = source;
    if (i < 0 || i >= source.times.length || coming.has(i) || shots[i]?.top === top) return;
    coming.add(i);
    source.frame(i).then((frame) => {
      shots[i] = { ...decoded(frame), top };
      repaint();
    }).catch(() => {}).finally(() => coming.delete(i)); // tried again with the next picture
  }

  function show() {
    palette ??= bytesOf(source.colours);
    scale.hidden = !choice.checked;
    const stops = Array.from({ length: 17 }, (_, i) => `rgb(${palette.subarray(3 * Math.round((i * 254) / 16)).slice(0, 3).join(", ")})`);
    const bar = document.createElement("i");
    bar.style.background = `linear-gradient(to right, ${stops.join(", ")})`;
    scale.replaceChildren(`−${number(source.top)}`, bar, `${number(source.top)} ${source.unit}`);
    repaint();
  }

  choice.checked = true;
  document.getElementById(`${name}-choice`).hidden = false;
  choice.addEventListener("change", show);
  requestAnimationFrame(show); // when the scene is there

  return {
    get source() { return source; },
    // Whether there is something to show at the time t.
    shows(t) { return choice.checked && source.times[indexAt(source.times, t + 1e-9)] <= t + 1e-9; },
    // The frame at or a little before the time t, and the one after it; undefined what is not there yet.
    around(t) {
      const i = indexAt(source.times, t + 1e-9);
      for (let k = i; k <= i + AHEAD; k++) load(k);
      let last = i;
      while (last > i - BEHIND && !shots[last]) last--;
      return palette ? [shots[last], shots[last + 1]] : [];
    },
    // Red, green, blue of a level, −127 to 127.
    colour(level) { return palette.subarray(3 * (level + 127), 3 * (level + 127) + 3); },
    get colours() { return palette; },
    // Goes on with more frames, which may be on another scale.
    update(more) {
      source = more;
      show();
    },
  };
}
