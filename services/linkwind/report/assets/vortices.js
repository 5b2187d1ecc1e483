// Surfaces of vortices at any time: those of the nearest frame, which go with the fluid from there.

import { bytesOf, makeReel } from "./reel.js";

function surfaceOf(frame) {
  const { t, middle, unit, fastest } = frame;
  const places = new Int16Array(bytesOf(frame.point).buffer), speeds = new Int8Array(bytesOf(frame.velocity).buffer);
  const corners = new Uint16Array(bytesOf(frame.triangle).buffer);
  const triple = (array, i) => [array[3 * i], array[3 * i + 1], array[3 * i + 2]];
  const points = Array.from({ length: places.length / 3 }, (_, i) => triple(places, i).map((x, k) => middle[k] + unit * x));
  const triangles = Array.from({ length: corners.length / 3 }, (_, i) => triple(corners, i));
  return {
    t, points, triangles, normals: normalsOf(points, triangles), levels: [...new Int8Array(bytesOf(frame.level).buffer)],
    speeds: Array.from({ length: speeds.length / 3 }, (_, i) => triple(speeds, i).map((x) => fastest * x)),
  };
}

// Unit normals outwards at the points, the mean of the triangles around each.
function normalsOf(points, triangles) {
  const normals = points.map(() => [0, 0, 0]);
  for (const corners of triangles) {
    const [a, b, c] = corners.map((i) => points[i]);
    const u = [0, 1, 2].map((k) => b[k] - a[k]), v = [0, 1, 2].map((k) => c[k] - a[k]);
    const area = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    for (const i of corners) for (let k = 0; k < 3; k++) normals[i][k] += area[k];
  }
  return normals.map((n) => { const size = Math.hypot(...n) || 1; return n.map((x) => x / size); });
}

// `vortices` has the times, top, axis, colours, room, and `frame(i)`, which promises a frame.
export function makeVortices(vortices, repaint) {
  const named = (source) => ({ ...source, unit: `1/s about ${source.axis}` });
  const reel = makeReel(named(vortices), "vortices", surfaceOf, repaint);
  let shown = null;

  return {
    // Points, triangles of them, normals and the level of vorticity at each point; null without.
    at(t) {
      if (!reel.shows(t)) return null;
      const [before, after] = reel.around(t);
      if (!before) return shown; // until it is there
      const nearest = after && after.t - t < t - before.t ? after : before;
      const since = after ? t - nearest.t : 0; // behind the last frame nothing is known
      const { triangles, normals, levels } = nearest;
      const points = nearest.points.map((p, i) => p.map((x, k) => x + since * nearest.speeds[i][k]));
      return (shown = { points, triangles, normals, levels });
    },
    // Between which corners there are any [m], in frames that were looked at.
    get room() { return reel.source.room; },
    colour: reel.colour,
    get colours() { return reel.colours; },
    update: (more) => reel.update(named(more)),
  };
}
