// Where the bodies are at any time, and how that is seen: poses, camera, extents.

import { indexAt, unpack } from "./clock.js";

export const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const mix = (a, b, f) => a + (b - a) * f;
export const length = (a) => Math.hypot(...a);

// The vector v turned by the unit quaternion (w, x, y, z).
export function turned([w, x, y, z], v) {
  const a = 2 * (y * v[2] - z * v[1]), b = 2 * (z * v[0] - x * v[2]), c = 2 * (x * v[1] - y * v[0]);
  return [v[0] + w * a + y * c - z * b, v[1] + w * b + z * a - x * c, v[2] + w * c + x * b - y * a];
}

// The largest 1, 2 or 5 times a power of ten that is not above the value.
export function nice(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return power * [5, 2, 1].find((digit) => digit * power <= value * (1 + 1e-9));
}

export const number = (value) => String(Number(value.toPrecision(3)));

// Poses and forces at any time, from the frames: linear between two of them.
export function makeMotion(scene, times) {
  const position = unpack(scene.position), orientation = unpack(scene.orientation), force = unpack(scene.force);
  const n = scene.bodies.length, all = times.length;
  const total = scene.bodies.reduce((sum, body) => sum + body.mass, 0);

  function poses(t) {
    const i = indexAt(times, t), j = Math.min(i + 1, all - 1);
    const f = j > i ? (t - times[i]) / (times[j] - times[i]) : 0;
    const between = (array, width, b, k) => mix(array[(i * n + b) * width + k], array[(j * n + b) * width + k], f);
    return scene.bodies.map((_, b) => {
      const q = [0, 1, 2, 3].map((k) => between(orientation, 4, b, k));
      const size = Math.hypot(...q);
      return {
        at: [0, 1, 2].map((k) => between(position, 3, b, k)),
        q: q.map((part) => part / size),
        force: [0, 1, 2].map((k) => between(force, 3, b, k)),
      };
    });
  }

  // The wind at the centre [m/s], and how far it has blown since the first frame [m].
  const blown = scene.air ? makeAir(unpack(scene.air), times) : {
    air: () => scene.wind, drift: (t) => scene.wind.map((part) => part * t),
  };

  const centre = (now) => [0, 1, 2].map(
    (k) => now.reduce((sum, pose, b) => sum + pose.at[k] * scene.bodies[b].mass, 0) / total);

  const { largest, beyond } = scaleOf(force, scene.bodies.length);
  let world = null;
  return {
    scene, times, poses, centre, largest, beyond, ...blown,
    path: Array.from(times, (t) => centre(poses(t))),
    get world() { return (world ??= extents(scene, poses, centre, times)); },
  };
}

// A wind given at some times: linear between two of them.
function makeAir(velocity, times) {
  const all = times.length, way = new Float64Array(velocity.length);
  for (let n = 3; n < velocity.length; n++) {
    const i = Math.floor(n / 3), mean = 0.5 * (velocity[n] + velocity[n - 3]);
    way[n] = way[n - 3] + (isFinite(mean) ? mean * (times[i] - times[i - 1]) : 0);
  }

  function between(t) {
    const i = indexAt(times, t), j = Math.min(i + 1, all - 1);
    return [i, j, j > i ? (t - times[i]) / (times[j] - times[i]) : 0];
  }

  function air(t) {
    const [i, j, f] = between(t);
    return [0, 1, 2].map((k) => mix(velocity[3 * i + k], velocity[3 * j + k], f));
  }

  function drift(t) {
    const [i, j, f] = between(t);
    return [0, 1, 2].map((k) => mix(way[3 * i + k], way[3 * j + k], f));
  }

  return { air, drift };
}

const OFTEN = 0.99; // share of the frames whose forces are no spike
const SPIKE = 3; // times as large is one

// The largest force for which arrows are long; whether there are larger ones, of a moment such as an impulsive start,
// beside which nobody would see the others.
function scaleOf(force, bodies) {
  const most = new Float64Array(force.length / (3 * bodies));
  for (let i = 0; i < force.length; i += 3) {
    const size = Math.hypot(force[i], force[i + 1], force[i + 2]), frame = Math.floor(i / (3 * bodies));
    if (size > most[frame] && isFinite(size)) most[frame] = size;
  }
  most.sort();
  const top = most.at(-1) ?? 0, usual = most[Math.floor(OFTEN * (most.length - 1))] ?? 0;
  const beyond = usual > 0 && top > SPIKE * usual;
  return { largest: beyond ? usual : top, beyond };
}

// The middle of the mechanism and of points around it; how far they reach from there along the axes, and at all [m].
export function around(centre, reach, points) {
  const low = [...centre], high = [...centre];
  for (const p of points) for (let k = 0; k < 3; k++) { low[k] = Math.min(low[k], p[k]); high[k] = Math.max(high[k], p[k]); }
  const size = low.map((x, k) => high[k] - x);
  const half = (extent) => Math.max(1.35 * reach, 0.5 * extent + 0.45 * reach);
  return { middle: low.map((x, k) => x + 0.5 * size[k]), side: half(Math.max(...size)), radius: half(Math.hypot(...size)) };
}

// The box around a box and a room, which may be missing: lowest and highest corner.
export function joined({ low, high }, room) {
  return room ? { low: low.map((x, k) => Math.min(x, room[0][k])), high: high.map((x, k) => Math.max(x, room[1][k])) } : { low, high };
}

// Turns and scales W to the screen. `angle` and `tilt` are the orbit of a 3-D scene.
export function makeCamera(scene) {
  const camera = { angle: scene.planar ? 0 : -0.6, tilt: scene.planar ? 0 : 0.35, centre: [0, 0, 0], scale: 1, w: 1, h: 1 };
  camera.turn = (p) => { // right, up, towards the viewer
    const [x, y, z] = scene.up === "z" ? [p[0], p[2], -p[1]] : p;
    const ca = Math.cos(camera.angle), sa = Math.sin(camera.angle), ce = Math.cos(camera.tilt), se = Math.sin(camera.tilt);
    const depth = -x * sa + z * ca;
    return [x * ca + z * sa, y * ce - depth * se, y * se + depth * ce];
  };
  camera.project = (p) => {
    const [x, y, z] = camera.turn(p), c = camera.turn(camera.centre);
    return [camera.w / 2 + (x - c[0]) * camera.scale, camera.h / 2 - (y - c[1]) * camera.scale, z];
  };
  return camera;
}

// How far the run reaches (a box in W), and the mechanism from its own centre of mass.
function extents(scene, poses, centre, times) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  let reach = 0;
  const stride = Math.max(1, Math.floor(times.length / 400));
  for (let i = 0; i < times.length; i += stride) {
    const now = poses(times[i]), middle = centre(now);
    now.forEach((pose, b) => {
      const at = length(pose.at.map((x, k) => x - middle[k])) + scene.bodies[b].reach;
      if (!isFinite(at)) return;
      reach = Math.max(reach, at);
      for (let k = 0; k < 3; k++) {
        low[k] = Math.min(low[k], pose.at[k] - scene.bodies[b].reach);
        high[k] = Math.max(high[k], pose.at[k] + scene.bodies[b].reach);
      }
    });
  }
  return { low, high, reach: reach || 1 };
}
