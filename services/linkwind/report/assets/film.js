// The flow behind the mechanism: grey pictures of its frames, coloured here, each shown until the next one.

import { indexAt } from "./clock.js";
import { number } from "./motion.js";

// The picture as a canvas; `colours` has red, green, blue and opacity for each level of grey.
async function coloured(source, colours) {
  const image = new Image();
  image.src = source;
  await image.decode();
  const canvas = document.createElement("canvas");
  canvas.width = image.naturalWidth;
  canvas.height = image.naturalHeight;
  const pen = canvas.getContext("2d");
  pen.drawImage(image, 0, 0);
  const pixels = pen.getImageData(0, 0, canvas.width, canvas.height), { data } = pixels;
  for (let i = 0; i < data.length; i += 4) {
    const level = 4 * data[i];
    for (let k = 0; k < 4; k++) data[i + k] = colours[level + k];
  }
  pen.putImageData(pixels, 0, 0);
  return canvas;
}

// `flow` has the times, the quantities (unit, low, high, colours), and `picture(name, i)`, which promises the
// address of a picture and its edges: left, right, bottom, top [m]. `ahead` of the one shown are loaded.
export function makeFilm(flow, repaint, ahead = Infinity) {
  const choice = document.getElementById("flow"), scale = document.getElementById("flow-scale");
  let shots = {}, palette = {}; // of the scale that counts now

  function load(name, i) {
    const all = shots, row = (all[name] ??= []);
    if (i in row || i >= flow.times.length) return;
    const shot = (row[i] = { canvas: null, extent: null });
    flow.picture(name, i).then(async ([source, extent]) => {
      shot.canvas = await coloured(source, palette[name]);
      shot.extent = extent;
      if (all === shots) repaint();
    }).catch(() => { delete row[i]; }); // tried again with the next picture
  }

  // The last shot at or before the i-th that is there.
  function found(name, i) {
    const row = shots[name] ?? [];
    for (; i >= 0; i--) if (row[i]?.canvas) return row[i];
    return null;
  }

  function show() {
    const quantity = flow.quantities[choice.value];
    scale.hidden = !quantity;
    if (quantity) {
      const bytes = (palette[choice.value] ??= Uint8Array.from(atob(quantity.colours), (c) => c.charCodeAt(0)));
      const stops = Array.from({ length: 17 }, (_, i) => {
        const [r, g, b, a] = bytes.subarray(4 * Math.round((i * 255) / 16));
        return `rgba(${r}, ${g}, ${b}, ${(a / 255).toFixed(2)})`;
      });
      const text = (value) => number(value).replace("-", "−"), bar = document.createElement("i");
      bar.style.background = `linear-gradient(to right, ${stops.join(", ")})`;
      scale.replaceChildren(text(quantity.low), bar, `${text(quantity.high)} ${quantity.unit}`);
      if (ahead === Infinity) for (let i = 0; i < flow.times.length; i++) load(choice.value, i);
    }
    repaint();
  }

  for (const name of [...Object.keys(flow.quantities), "off"]) choice.add(new Option(name, name));
  document.getElementById("flow-choice").hidden = false;
  choice.addEventListener("change", show);
  requestAnimationFrame(show); // when the scene is there

  return {
    // Draws the frame at or before t; whether there is one.
    draw(pen, camera, t) {
      const name = choice.value, i = indexAt(flow.times, t + 1e-9);
      if (!(name in palette) || !(flow.times[i] <= t + 1e-9)) return false;
      if (ahead < Infinity) for (let k = i; k <= i + ahead; k++) load(name, k);
      const shot = found(name, i);
      if (!shot) return false;
      const [left, right, bottom, top] = shot.extent;
      const [x, y] = camera.project([left, top, 0]), [x1, y1] = camera.project([right, bottom, 0]);
      pen.imageSmoothingQuality = "high";
      pen.drawImage(shot.canvas, x, y, x1 - x, y1 - y);
      return true;
    },
    // Goes on with more frames, which may be on another scale.
    update(more) {
      if (JSON.stringify(more.quantities) !== JSON.stringify(flow.quantities)) { shots = {}; palette = {}; }
      flow = more;
      show();
    },
  };
}
