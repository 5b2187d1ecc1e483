// Puts the page together from its data block.

import { makeCharts, makeKey } from "./charts.js";
import { makeClock, makeControls, unpack } from "./clock.js";
import { makeFilm } from "./film.js";
import { makeMotion } from "./motion.js";
import { makeScene } from "./scene.js";
import { makeVortices } from "./vortices.js";
import { makeWake } from "./wake.js";

// The frames of the data block as the film takes them.
function flowOf({ t, extent, quantities }) {
  const extents = unpack(extent);
  const picture = async (name, i) => [
    `data:image/webp;base64,${quantities[name].pictures[i]}`, extents.subarray(4 * i, 4 * i + 4),
  ];
  return { times: unpack(t), quantities, picture };
}

const data = JSON.parse(document.getElementById("data").textContent);
if (data.scene === null) {
  document.body.classList.add("empty");
} else {
  const clock = makeClock(unpack(data.scene.t));
  clock.series = unpack(data.t);
  makeKey(data.scene.bodies);
  makeControls(clock);
  const motion = makeMotion(data.scene, clock.times);
  const scene = makeScene(document.getElementById("scene"), motion, clock);
  if (data.flow) scene.film = makeFilm(flowOf(data.flow), scene.draw);
  if (data.wake) scene.wake = makeWake({ ...data.wake, times: data.wake.t, frame: async (i) => data.wake.frames[i] }, motion, scene.draw);
  if (data.vortices) scene.vortices = makeVortices({ ...data.vortices, times: data.vortices.t, frame: async (i) => data.vortices.frames[i] }, scene.draw);
  makeCharts(data.panels, clock, document.getElementById("charts"));
}
