// The flow behind the mechanism: grey pictures of its frames, coloured here, each shown until the next one.

// The picture as a canvas; `colours` has red, green, blue and opacity for each level of grey.
async function coloured(picture, colours) {
  const image = new Image();
  image.src = `data:image/webp;base64,${picture}`;
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

function makeFilm(flow, repaint) {
  const choice = document.getElementById("flow"), scale = document.getElementById("flow-scale");
  const times = unpack(flow.t), extents = unpack(flow.extent), canvases = {};

  function load(name) {
    const { colours, pictures } = flow.quantities[name];
    const bytes = Uint8Array.from(atob(colours), (c) => c.charCodeAt(0));
    canvases[name] = new Array(pictures.length);
    pictures.forEach(async (picture, i) => {
      canvases[name][i] = await coloured(picture, bytes);
      repaint();
    });
    const stops = Array.from({ length: 17 }, (_, i) => {
      const [r, g, b, a] = bytes.subarray(4 * Math.round((i * 255) / 16));
      return `rgba(${r}, ${g}, ${b}, ${(a / 255).toFixed(2)})`;
    });
    canvases[name].bar = `linear-gradient(to right, ${stops.join(", ")})`;
  }

  function show() {
    const quantity = flow.quantities[choice.value];
    scale.hidden = !quantity;
    if (quantity) {
      if (!canvases[choice.value]) load(choice.value);
      const text = (value) => number(value).replace("-", "−"), bar = document.createElement("i");
      bar.style.background = canvases[choice.value].bar;
      scale.replaceChildren(text(quantity.low), bar, `${text(quantity.high)} ${quantity.unit}`);
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
      const i = indexAt(times, t + 1e-9), canvas = times[i] <= t + 1e-9 ? canvases[choice.value]?.[i] : null;
      if (!canvas) return false;
      const [left, right, bottom, top] = extents.subarray(4 * i);
      const [x, y] = camera.project([left, top, 0]), [x1, y1] = camera.project([right, bottom, 0]);
      pen.imageSmoothingQuality = "high";
      pen.drawImage(canvas, x, y, x1 - x, y1 - y);
      return true;
    },
  };
}
