// The moving mechanism on a canvas: orthographic, straight on for planar motion, orbited by drag in 3-D.

import { bodyColour, theme } from "./charts.js";
import { add, around, joined, length, makeCamera, nice, number, turned } from "./motion.js";
import { tips } from "./wake.js";

const GHOSTS = 8; // earlier poses left standing over a whole run
const WAKE = 4; // sizes of the mechanism that are shown across a flow, and twice as many along it

function arrow(pen, from, to, head) {
  const angle = Math.atan2(to[1] - from[1], to[0] - from[0]), size = Math.hypot(to[0] - from[0], to[1] - from[1]);
  if (!(size > 1)) return;
  const tip = Math.min(head, size * 0.6);
  pen.beginPath();
  pen.moveTo(from[0], from[1]);
  pen.lineTo(to[0] - 0.7 * tip * Math.cos(angle), to[1] - 0.7 * tip * Math.sin(angle));
  pen.stroke();
  pen.beginPath();
  pen.moveTo(to[0], to[1]);
  for (const side of [-0.42, 0.42]) pen.lineTo(to[0] - tip * Math.cos(angle + side), to[1] - tip * Math.sin(angle + side));
  pen.closePath();
  pen.fill();
}

// `motion` has the scene and where everything is; `film`, the flow behind it, `wake` and `vortices` may come later.
export function makeScene(canvas, motion, clock) {
  const pen = canvas.getContext("2d"), follow = document.getElementById("follow");
  const { scene } = motion, camera = makeCamera(scene);
  const extent = ({ low, high } = motion.world) => high.map((x, k) => x - low[k]);
  follow.checked = length(extent()) > 14 * motion.world.reach;
  const windSpeed = length(scene.wind);
  const look = { zoom: 1, pan: [0, 0, 0] };
  let colour = theme(), film = null, wake = null, vortices = null;

  function aim(now, points) {
    const room = Math.min(camera.w, camera.h), { world } = motion, all = joined(world, vortices?.room), size = extent(all);
    const middle = all.low.map((x, k) => x + size[k] / 2);
    if (follow.checked) {
      const { middle, radius } = around(motion.centre(now), world.reach, points);
      camera.centre = middle;
      camera.scale = room / (film ? WAKE * world.reach : 2 * radius);
    } else {
      let [w, h] = scene.planar ? size : [length(size), length(size)];
      const more = film ? Math.max(0, 2 * WAKE * world.reach - w) : 0; // of the wake, downstream
      if (film) { w += more; h = Math.max(h, WAKE * world.reach); }
      camera.centre = middle.map((x, k) => x + (windSpeed ? 0.3 * more * scene.wind[k] / windSpeed : 0));
      camera.scale = Math.min((camera.w - 60) / w, (camera.h - 110) / h);
    }
    camera.scale *= look.zoom;
    camera.centre = camera.centre.map((x, k) => x + look.pan[k]);
  }

  // Rings of the wakes, the farthest first.
  function wakes(trailing) {
    const rings = [];
    for (const { bound, lines, rows } of trailing) {
      const seen = lines.slice(bound).map((line) => line.map(camera.project));
      for (let i = 0; i + 1 < seen.length; i++) {
        const row = rows[bound + i], [near, far] = [seen[i], seen[i + 1]];
        for (let j = 0; j < row.length; j++) {
          const corners = [near[j], near[j + 1], far[j + 1], far[j]];
          rings.push([corners[0][2] + corners[2][2], corners, row[j]]);
        }
      }
    }
    rings.sort((a, b) => a[0] - b[0]);
    pen.lineWidth = 0.5;
    for (const [, corners, level] of rings) {
      const [r, g, b] = wake.colour(level);
      pen.beginPath();
      for (const [x, y] of corners) pen.lineTo(x, y);
      pen.closePath();
      pen.globalAlpha = 0.72;
      pen.fillStyle = `rgb(${r}, ${g}, ${b})`;
      pen.fill();
      pen.globalAlpha = 0.8;
      pen.strokeStyle = `rgb(${0.72 * r}, ${0.72 * g}, ${0.72 * b})`;
      pen.stroke();
    }
    pen.globalAlpha = 1;
  }

  // What faces the eye of the vortices' surfaces, the farthest first.
  function surfaces({ points, triangles, normals, levels }) {
    const seen = points.map(camera.project), towards = normals.map((n) => Math.abs(camera.turn(n)[2])), faces = [];
    for (const [i, j, k] of triangles) {
      const [a, b, c] = [seen[i], seen[j], seen[k]];
      if ((b[0] - a[0]) * (a[1] - c[1]) <= (c[0] - a[0]) * (a[1] - b[1])) continue;
      faces.push([a[2] + b[2] + c[2], [a, b, c], levels[i] + levels[j] + levels[k], towards[i] + towards[j] + towards[k]]);
    }
    faces.sort((one, other) => one[0] - other[0]);
    pen.lineWidth = 0.6;
    pen.globalAlpha = 0.85;
    for (const [, corners, level, facing] of faces) {
      const light = 0.62 + 0.38 * facing / 3, colour = vortices.colour(Math.round(level / 3));
      pen.fillStyle = pen.strokeStyle = `rgb(${Array.from(colour, (part) => Math.round(light * part)).join(", ")})`;
      pen.beginPath();
      for (const [x, y] of corners) pen.lineTo(x, y);
      pen.closePath();
      pen.fill();
      pen.stroke();
    }
    pen.globalAlpha = 1;
  }

  function grid() {
    const step = 1 / nice(camera.scale / 64); // at least 64 px, and 1, 2 or 5 times a power of ten
    const [x0, y0] = [camera.centre[0] - camera.w / 2 / camera.scale, camera.centre[1] - camera.h / 2 / camera.scale];
    pen.strokeStyle = colour("grid");
    pen.fillStyle = colour("soft");
    pen.lineWidth = 1;
    pen.globalAlpha = 1;
    const decimals = Math.max(0, Math.ceil(-Math.log10(step) - 1e-9));
    const text = (value) => (Math.abs(value) < step / 2 ? 0 : value).toFixed(decimals).replace("-", "−");
    pen.textAlign = "center";
    for (let x = Math.ceil(x0 / step) * step; x < x0 + camera.w / camera.scale; x += step) {
      const [px] = camera.project([x, 0, 0]);
      pen.beginPath(); pen.moveTo(px, 0); pen.lineTo(px, camera.h); pen.stroke();
      const half = pen.measureText(text(x)).width / 2;
      if (px > 40 && px + half < camera.w - 4) pen.fillText(text(x), px, camera.h - 5);
    }
    pen.textAlign = "left";
    for (let y = Math.ceil(y0 / step) * step; y < y0 + camera.h / camera.scale; y += step) {
      const py = camera.project([0, y, 0])[1];
      pen.beginPath(); pen.moveTo(0, py); pen.lineTo(camera.w, py); pen.stroke();
      if (py > 60 && py < camera.h - 52) pen.fillText(text(y), 4, py - 3);
    }
    pen.fillText("m", 4, camera.h - 5);
  }

  // The undisturbed wind as streaks that drift with it, in the world that the camera looks at.
  function streaks(t) {
    const wind = camera.turn(motion.air(t)), moved = camera.turn(motion.drift(t)), c = camera.turn(camera.centre);
    const speed = length(wind);
    if (!(speed > 0)) return;
    pen.strokeStyle = colour("wind");
    pen.globalAlpha = 0.35;
    pen.lineWidth = 1.2;
    const wrap = (value, period) => ((value % period) + period) % period;
    const w = camera.w + 80, h = camera.h + 80;
    for (let i = 0; i < 36; i++) {
      const x = wrap(0.7548777 * i * w + (moved[0] - c[0]) * camera.scale, w) - 40;
      const y = wrap(0.5698403 * i * h - (moved[1] - c[1]) * camera.scale, h) - 40;
      pen.beginPath(); pen.moveTo(x, y); pen.lineTo(x - 26 * wind[0] / speed, y + 26 * wind[1] / speed); pen.stroke();
    }
    pen.globalAlpha = 1;
  }

  function trail(t) {
    for (const [alpha, until] of [[0.3, Infinity], [0.9, t]]) {
      pen.beginPath();
      motion.path.forEach((p, i) => { if (motion.times[i] <= until) pen.lineTo(...camera.project(p).slice(0, 2)); });
      pen.globalAlpha = alpha;
      pen.strokeStyle = colour("soft");
      pen.lineWidth = 1.3;
      pen.setLineDash(alpha < 0.5 ? [3, 4] : []);
      pen.stroke();
    }
    pen.setLineDash([]);
    pen.globalAlpha = 1;
  }

  // What stands still.
  function surroundings() {
    pen.strokeStyle = colour("soft");
    pen.lineWidth = 1.5;
    for (const { points, closed } of scene.still) {
      pen.beginPath();
      for (const point of points) pen.lineTo(...camera.project(point).slice(0, 2));
      if (closed) pen.closePath();
      pen.stroke();
    }
  }

  function bodies(now, alpha, cased = false) {
    const order = now.map((pose, b) => [camera.turn(pose.at)[2], b]).sort((p, q) => p[0] - q[0]);
    for (const [, b] of order) {
      const { lines, thick, reach } = scene.bodies[b], pose = now[b];
      pen.strokeStyle = pen.fillStyle = colour(bodyColour(b));
      pen.lineJoin = pen.lineCap = "round";
      const width = thick ? Math.max(3.5, (scene.planar ? 0.05 : 0.02) * reach * camera.scale) : 2;
      for (const { points, closed } of lines) {
        pen.beginPath();
        for (const point of points) pen.lineTo(...camera.project(add(pose.at, turned(pose.q, point))).slice(0, 2));
        if (closed) { pen.closePath(); pen.globalAlpha = 0.28 * alpha; pen.fill(); }
        pen.globalAlpha = alpha;
        if (cased) { // seen on any colour of the flow
          pen.strokeStyle = colour("card"); pen.lineWidth = width + 3; pen.stroke();
          pen.strokeStyle = pen.fillStyle;
        }
        pen.lineWidth = width;
        pen.stroke();
      }
    }
    pen.globalAlpha = 1;
  }

  function joints(now, t) {
    for (const joint of scene.joints) {
      if (joint.until != null && t > joint.until) continue; // released
      const pose = now[joint.body], [x, y] = camera.project(add(pose.at, turned(pose.q, joint.point)));
      pen.beginPath();
      pen.arc(x, y, 4.5, 0, 2 * Math.PI);
      pen.fillStyle = colour("card"); pen.strokeStyle = colour("ink"); pen.lineWidth = 2;
      pen.fill(); pen.stroke();
    }
  }

  const forceScale = () => 0.28 * Math.min(camera.w, camera.h) / (motion.largest || 1) / camera.scale; // m per N

  function forces(now) {
    if (!motion.largest) return;
    pen.strokeStyle = pen.fillStyle = colour("force");
    pen.lineWidth = 2.2;
    for (const pose of now) {
      const tip = add(pose.at, pose.force.map((x) => x * forceScale()));
      arrow(pen, camera.project(pose.at), camera.project(tip), 11);
    }
    pen.fillStyle = colour("ink");
    for (const pose of now) {
      const [x, y] = camera.project(pose.at);
      pen.beginPath(); pen.arc(x, y, 2.4, 0, 2 * Math.PI); pen.fill();
    }
  }

  // Scales and directions, on strips that keep them readable.
  function key(t) {
    const wind = motion.air(t), speed = length(wind);
    pen.fillStyle = colour("card");
    pen.globalAlpha = 0.82;
    pen.fillRect(0, camera.h - 44, camera.w, 26);
    const blows = isFinite(speed) && (scene.air || windSpeed);
    if (blows) pen.fillRect(0, 8, scene.air ? 240 : 200, 34);
    pen.globalAlpha = 1;
    pen.textAlign = "left";
    pen.lineWidth = 2;
    const metres = nice(90 / camera.scale), bar = metres * camera.scale;
    let x = 12;
    const y = camera.h - 26;
    pen.strokeStyle = pen.fillStyle = colour("ink");
    pen.beginPath();
    pen.moveTo(x, y - 4); pen.lineTo(x, y); pen.lineTo(x + bar, y); pen.lineTo(x + bar, y - 4);
    pen.stroke();
    pen.fillText(`${number(metres)} m`, x + bar + 7, y + 1);
    x += bar + 62;
    if (motion.largest) {
      const unit = forceScale() * camera.scale, newton = nice(80 / unit);
      pen.strokeStyle = pen.fillStyle = colour("force");
      arrow(pen, [x, y - 3], [x + newton * unit, y - 3], 11);
      pen.fillText(`${number(newton)} N${camera.w < 440 ? "" : " aerodynamic force"}`, x + newton * unit + 7, y + 1);
    }
    if (blows) {
      const along = camera.turn(wind).map((part) => part / speed * 46);
      pen.strokeStyle = pen.fillStyle = colour("wind");
      arrow(pen, [38 - along[0] / 2, 26 + along[1] / 2], [38 + along[0] / 2, 26 - along[1] / 2], 11);
      pen.fillText(`wind ${number(speed)} m/s${scene.air ? " at the bodies" : ""}`, 70, 30);
    }
    if (!scene.planar) triad();
  }

  function triad() {
    const at = [camera.w - 44, 48];
    pen.strokeStyle = pen.fillStyle = colour("soft");
    ["x", "y", "z"].forEach((name, k) => {
      const [dx, dy] = camera.turn([0, 1, 2].map((i) => (i === k ? 30 : 0)));
      pen.lineWidth = 1.5;
      arrow(pen, at, [at[0] + dx, at[1] - dy], 7);
      pen.fillText(name, at[0] + 1.25 * dx - 3, at[1] - 1.25 * dy + 4);
    });
  }

  function draw() {
    const ratio = window.devicePixelRatio || 1;
    const t = clock.t, now = motion.poses(t);
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, camera.w, camera.h);
    pen.font = "12px system-ui, sans-serif";
    const trailing = wake?.at(t), turning = vortices?.at(t);
    aim(now, [...tips(trailing), ...(turning?.points ?? [])]);
    const filmed = film?.draw(pen, camera, t);
    if (scene.planar) grid();
    if (!filmed) streaks(t);
    surroundings();
    trail(t);
    for (let i = 0; i < GHOSTS; i++) {
      const then = clock.first + (clock.last - clock.first) * i / GHOSTS;
      if (then < t) bodies(motion.poses(then), 0.22);
    }
    if (trailing) wakes(trailing);
    if (turning) surfaces(turning);
    bodies(now, 1, filmed);
    forces(now);
    joints(now, t);
    key(t);
  }

  function resize() {
    const ratio = window.devicePixelRatio || 1;
    camera.w = canvas.clientWidth;
    camera.h = canvas.clientHeight;
    canvas.width = Math.round(camera.w * ratio);
    canvas.height = Math.round(camera.h * ratio);
    draw();
  }

  if (!scene.planar) {
    canvas.classList.add("orbit");
    canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
    canvas.addEventListener("pointermove", (event) => {
      if (!event.buttons) return;
      camera.angle -= event.movementX * 0.01;
      camera.tilt = Math.max(-1.5, Math.min(1.5, camera.tilt + event.movementY * 0.01));
      draw();
    });
  }
  follow.addEventListener("change", draw);
  new ResizeObserver(resize).observe(canvas);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { colour = theme(); draw(); });
  resize();
  clock.listen(draw);
  return { draw, look, camera, set film(made) { film = made; }, set wake(made) { wake = made; }, set vortices(made) { vortices = made; } };
}
