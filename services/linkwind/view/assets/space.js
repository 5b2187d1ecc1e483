// A mechanism in space: solids, joints, forces and the way of the centre of mass, orbited with the mouse.

import { bodyColour, theme } from "/report/charts.js";
import { add, around, joined, length, number, turned } from "/report/motion.js";
import { tips } from "/report/wake.js";

const SIDES = 10; // of the head of an arrow
const ROUND = 32; // points around an ellipsoid
const ARROW = 0.14; // of the room's side, the longest arrow: it stays in the room wherever it begins
const FRAME = 30; // ms between two pictures at least
const LEVELS = 127; // of circulation and vorticity, above 0

// Triangles over an ellipsoid: rings about its z axis, and the poles.
function ellipsoid(size) {
  const points = [-1, 1].map((pole) => [0, 0, 0.5 * pole * size[2]]), triangles = [];
  const ring = (row) => 2 + ROUND * row, rows = ROUND / 2 - 1;
  for (let row = 0; row < rows; row++) {
    const angle = Math.PI * (row + 1) / (rows + 1), across = 0.5 * Math.sin(angle);
    for (let i = 0; i < ROUND; i++) {
      const turn = 2 * Math.PI * i / ROUND, j = (i + 1) % ROUND, a = ring(row), b = ring(row + 1);
      points.push([across * Math.cos(turn) * size[0], across * Math.sin(turn) * size[1], -0.5 * Math.cos(angle) * size[2]]);
      if (row === 0) triangles.push([0, a + j, a + i]);
      if (row === rows - 1) triangles.push([a + i, a + j, 1]);
      else triangles.push([a + i, a + j, b + j], [a + i, b + j, b + i]);
    }
  }
  return { points, triangles };
}

// Triangles over closed lines of a body: caps, and sides between the two faces of an outline.
function facesOf(body) {
  if (body.ball) return ellipsoid(body.ball);
  const points = [], triangles = [];
  const loops = body.lines.filter(({ closed, points }) => closed && points.length > 2).map(({ points: line }) => {
    const start = points.length;
    points.push(...line);
    if (body.ends) {
      triangles.push(...body.ends.map((corners) => corners.map((i) => start + i)));
      return { start, n: line.length };
    }
    const middle = points.push([0, 1, 2].map((k) => line.reduce((sum, p) => sum + p[k], 0) / line.length)) - 1;
    line.forEach((_, i) => triangles.push([start + i, start + (i + 1) % line.length, middle]));
    return { start, n: line.length };
  });
  const [near, far] = loops;
  if (loops.length === 2 && near.n === far.n) {
    for (let i = 0; i < near.n; i++) {
      const j = (i + 1) % near.n;
      triangles.push([near.start + i, near.start + j, far.start + i], [far.start + i, near.start + j, far.start + j]);
    }
  }
  return { points, triangles };
}

// The lines of a body as one, with gaps.
function edgesOf(body) {
  return body.lines.flatMap(({ points, closed }) => [...points, ...(closed ? [points[0]] : []), null]);
}

const GAP = [null, null, null];
const columns = (points) => [0, 1, 2].map((k) => points.map((p) => (p ?? GAP)[k]));

// A cone from the base to the tip of an arrow.
function cone(tip, along, height, radius) {
  const side = Math.abs(along[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const u = cross(along, side).map((x, _, v) => x / length(v)), v = cross(along, u);
  const base = Array.from({ length: SIDES }, (_, i) => {
    const a = (2 * Math.PI * i) / SIDES;
    return [0, 1, 2].map((k) => tip[k] - height * along[k] + radius * (Math.cos(a) * u[k] + Math.sin(a) * v[k]));
  });
  return [tip, ...base];
}

export function makeSpace(host, motion, clock) {
  const { scene } = motion, follow = document.getElementById("follow");
  const far = Math.hypot(...motion.world.high.map((x, k) => x - motion.world.low[k]));
  follow.checked = far > 14 * motion.world.reach; // as the report does
  const bodies = scene.bodies.map((body) => ({ ...facesOf(body), edges: edgesOf(body) }));
  const still = columns(edgesOf({ lines: scene.still }));
  const up = scene.up === "z" ? { x: 0, y: 0, z: 1 } : { x: 0, y: 1, z: 0 };
  let colour = theme(), drawn = 0, waiting = 0, ready = false, wake = null, vortices = null, coloured = false;

  const place = (pose, points) => columns(points.map((p) => p && add(pose.at, turned(pose.q, p))));

  // The room to look at: a cube, so that lengths are the same along every axis.
  function room(now, points) {
    const { low, high } = joined(motion.world, vortices?.room);
    const near = around(motion.centre(now), 1.04 * motion.world.reach, points);
    const middle = follow.checked ? near.middle : low.map((x, k) => (x + high[k]) / 2);
    const half = follow.checked ? near.side : (vortices?.room ? 0.56 : 0.7) * Math.max(...high.map((x, k) => x - low[k]), 1e-9);
    return middle.map((x) => [x - half, x + half]);
  }

  // The rings of the wakes as triangles, their circulation, and their edges.
  function sheets(wings) {
    const points = [], triangles = [], levels = [], lines = [];
    for (const { bound, lines: all, rows } of wings ?? []) {
      const edges = all.slice(bound), across = edges[0].length, start = points.length;
      points.push(...edges.flat());
      for (const edge of edges) lines.push(...edge, null);
      for (let j = 0; j < across; j++) lines.push(...edges.map((edge) => edge[j]), null);
      for (let i = 0; i + 1 < edges.length; i++) {
        for (let j = 0; j + 1 < across; j++) {
          const a = start + i * across + j, level = rows[bound + i][j];
          triangles.push([a, a + 1, a + across], [a + across, a + 1, a + across + 1]);
          levels.push(level, level);
        }
      }
    }
    return { points, triangles, levels, lines };
  }

  function arrows(now, metres) {
    const lines = [], heads = [], scale = motion.largest ? (ARROW * metres) / motion.largest : 0;
    for (const { at, force } of now) {
      const size = Math.min(length(force) * scale, ARROW * metres);
      if (!(size > 0.002 * metres)) { heads.push(...Array(SIDES + 1).fill(at)); continue; }
      const along = force.map((x) => x / length(force)), tip = at.map((x, k) => x + size * along[k]);
      const height = Math.min(0.045 * metres, 0.6 * size);
      lines.push(at, at.map((x, k) => x + (size - 0.8 * height) * along[k]), null);
      heads.push(...cone(tip, along, height, 0.36 * height));
    }
    return { lines, heads };
  }

  // What changes with time, trace by trace.
  function frame(t) {
    const now = motion.poses(t), wings = wake?.at(t), turning = vortices?.at(t) ?? { points: [], triangles: [], levels: [] };
    const ranges = room(now, [...tips(wings), ...turning.points]), metres = ranges[0][1] - ranges[0][0];
    const { lines, heads } = arrows(now, metres);
    const held = scene.joints.filter(({ until }) => until == null || t <= until);
    const joints = held.map(({ body, point }) => add(now[body].at, turned(now[body].q, point)));
    const path = motion.path.filter((_, i) => motion.times[i] <= t);
    const sheet = sheets(wings);
    return {
      ranges, sheet, turning,
      points: [
        ...bodies.flatMap(({ points, edges }, b) => [place(now[b], points), place(now[b], edges)]),
        columns(joints), columns(lines), columns(heads), columns(path), still, columns(sheet.points), columns(sheet.lines), columns(turning.points),
      ],
    };
  }

  function traces(points, { triangles, levels }, turning) {
    const [i, j, k] = [0, 1, 2].map((corner) => (faces) => faces.map((face) => face[corner]));
    const at = ([x, y, z]) => ({ x, y, z, hoverinfo: "skip" });
    const ring = scene.bodies.flatMap((_, b) => Array.from({ length: SIDES }, (_, s) => {
      const tip = b * (SIDES + 1);
      return [tip, tip + 1 + s, tip + 1 + ((s + 1) % SIDES)];
    }));
    const light = { ambient: 0.8, diffuse: 0.55, specular: 0.1, roughness: 0.9 };
    const made = bodies.flatMap(({ triangles }, b) => {
      const own = colour(bodyColour(b));
      return [
        { type: "mesh3d", ...at(points[2 * b]), i: i(triangles), j: j(triangles), k: k(triangles), color: own, opacity: 1, flatshading: true, lighting: light },
        { type: "scatter3d", mode: "lines", ...at(points[2 * b + 1]), line: { color: own, width: 4 } },
      ];
    });
    const [joints, lines, heads, path, surroundings, rings, edges, eddies] = points.slice(2 * bodies.length);
    return [
      ...made,
      { type: "scatter3d", mode: "markers", ...at(joints), marker: { size: 5, color: colour("card"), line: { color: colour("ink"), width: 2 } } },
      { type: "scatter3d", mode: "lines", ...at(lines), line: { color: colour("force"), width: 6 } },
      { type: "mesh3d", ...at(heads), i: i(ring), j: j(ring), k: k(ring), color: colour("force"), lighting: light },
      { type: "scatter3d", mode: "lines", ...at(path), line: { color: colour("soft"), width: 2, dash: "solid" } },
      { type: "scatter3d", mode: "lines", ...at(surroundings), line: { color: colour("soft"), width: 3 } },
      {
        type: "mesh3d", ...at(rings), i: i(triangles), j: j(triangles), k: k(triangles), intensity: levels, intensitymode: "cell",
        cmin: -LEVELS, cmax: LEVELS, colorscale: scale(), showscale: false, opacity: 0.9, flatshading: true,
        lighting: { ambient: 0.9, diffuse: 0.3, specular: 0, roughness: 1 },
      },
      { type: "scatter3d", mode: "lines", ...at(edges), line: { color: colour("soft"), width: 1 }, opacity: 0.35 },
      {
        type: "mesh3d", ...at(eddies), i: i(turning.triangles), j: j(turning.triangles), k: k(turning.triangles),
        intensity: turning.levels, intensitymode: "vertex", cmin: -LEVELS, cmax: LEVELS, colorscale: scale(), showscale: false,
        opacity: 0.85, flatshading: false, lighting: { ambient: 0.7, diffuse: 0.5, specular: 0.05, roughness: 0.9 },
      },
    ];
  }

  // The colours of circulation and of vorticity, the same, from the most negative.
  function scale() {
    const of = [wake, vortices].find((shown) => shown?.colours);
    return Array.from({ length: 33 }, (_, i) => {
      const [r, g, b] = of ? of.colour(Math.round((i / 16 - 1) * LEVELS)) : [128, 128, 128];
      return [i / 32, `rgb(${r}, ${g}, ${b})`];
    });
  }

  // From so far away that the whole room is in the picture, with the numbers below its edges.
  function camera() {
    const from = scene.up === "z" ? [0.63, -0.72, 0.29] : [0.5, 0.33, 0.8];
    const { clientWidth: w, clientHeight: h } = host, away = (2 + 80 / h) * Math.max(1, (1.05 * h) / w);
    const [x, y, z] = from.map((part) => away * part);
    return { up, eye: { x, y, z }, center: { x: 0, y: -0.1 * up.y, z: -0.1 * up.z } };
  }

  function layout(ranges) {
    const axis = (range, title) => ({
      range, title: { text: title }, color: colour("soft"), gridcolor: colour("line"), zerolinecolor: colour("line"),
      backgroundcolor: colour("card"), showbackground: false, showspikes: false, nticks: 6,
    });
    const [x, y, z] = ranges;
    return {
      margin: { l: 0, r: 0, t: 0, b: 0 }, showlegend: false, paper_bgcolor: "rgba(0,0,0,0)",
      font: { family: "system-ui, sans-serif", size: 12, color: colour("soft") },
      uirevision: "kept", annotations: words(),
      scene: {
        aspectmode: "cube", dragmode: "orbit", xaxis: axis(x, "x [m]"), yaxis: axis(y, "y [m]"), zaxis: axis(z, "z [m]"),
        camera: camera(),
      },
    };
  }

  function words() {
    const wind = motion.air(clock.t), where = scene.air ? " at the bodies" : "", blows = isFinite(length(wind)) && (scene.air || length(wind));
    const text = blows ? [`wind${where} ${number(length(wind))} m/s along (${wind.map(number).join(", ")})`] : [];
    if (motion.largest) text.push(`longest arrow ${number(motion.largest)} N${motion.beyond ? " and more" : ""}`);
    return [{ text: text.join(" · "), x: 0.01, y: 0.99, xref: "paper", yref: "paper", xanchor: "left", yanchor: "top", showarrow: false }];
  }

  async function paint() {
    if (!ready) return;
    const { ranges, points, sheet, turning } = frame(clock.t), rings = points.length - 3, eddies = points.length - 1;
    if (!coloured && (wake?.colours || vortices?.colours)) {
      coloured = true;
      await Plotly.restyle(host, { colorscale: [scale()] }, [rings, eddies]);
    }
    const at = (k) => points.map((each) => each[k]), meshes = { [rings]: sheet, [eddies]: turning };
    const corner = (k) => points.map((_, n) => meshes[n]?.triangles.map((each) => each[k]));
    const intensity = points.map((_, n) => meshes[n]?.levels);
    const [x, y, z] = ["xaxis", "yaxis", "zaxis"].map((name, k) => [`scene.${name}.range`, ranges[k]]);
    drawn = performance.now();
    await Plotly.update(host, { x: at(0), y: at(1), z: at(2), i: corner(0), j: corner(1), k: corner(2), intensity }, { ...Object.fromEntries([x, y, z]), annotations: words() });
  }

  // As often as time changes, but not faster than a picture takes.
  function draw() {
    if (waiting) return;
    waiting = setTimeout(async () => { try { await paint(); } finally { waiting = 0; } }, Math.max(0, drawn + FRAME - performance.now()));
  }

  function dress() {
    colour = theme();
    const { ranges, points, sheet, turning } = frame(clock.t);
    const config = { displayModeBar: false, responsive: true, scrollZoom: true };
    Plotly.react(host, traces(points, sheet, turning), layout(ranges), config).then(() => { ready = true; });
  }

  dress();
  clock.listen(draw);
  follow.addEventListener("change", draw);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", dress);
  return { draw, set wake(made) { wake = made; }, set vortices(made) { vortices = made; } };
}
