// Wings and their wakes at any time. Between two frames every line of a wake goes straight from where it was to
// where it will be; one that is shed in between leaves the trailing edge in time. Behind the last frame nothing is
// known but where lines were shed.

import { add, turned } from "./motion.js";
import { bytesOf, makeReel } from "./reel.js";

const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const blend = (a, b, f) => a.map((x, k) => x + f * (b[k] - x));

// A frame with its numbers: corners of an edge of a wing, and levels of circulation of the row in front of it.
function decoded(frame, motion, bodies) {
  const { t, bound, columns, shed, middle, unit } = frame, across = columns + 1;
  const places = new Int16Array(bytesOf(frame.corner).buffer), levels = new Int8Array(bytesOf(frame.strength).buffer);
  const edges = bound + shed.length;
  const line = (wing, edge) => Array.from({ length: across }, (_, j) => {
    const at = 3 * ((wing * edges + edge) * across + j);
    return [0, 1, 2].map((k) => middle[k] + unit * places[at + k]);
  });
  const row = (wing, edge) => levels.subarray((wing * (edges - 1) + edge - 1) * columns, (wing * (edges - 1) + edge) * columns);
  const then = motion.poses(t);
  const wings = bodies.map((body, wing) => {
    const { at, q: [w, x, y, z] } = then[body];
    const own = Array.from({ length: bound + 1 }, (_, edge) => line(wing, edge).map((p) => turned([w, -x, -y, -z], minus(p, at))));
    const wake = new Map(shed.slice(1).map((step, i) => [step, { line: line(wing, bound + 1 + i), row: row(wing, bound + 1 + i) }]));
    return { own, wake, rows: Array.from({ length: bound }, (_, i) => row(wing, i + 1)) };
  });
  return { t, bound, columns, wings, kept: shed[0] - shed.at(-1), stride: shed.length > 3 ? shed[1] - shed[2] : 1 };
}

const KEPT = 4000; // trailing edges that are remembered

// The tips of all wakes.
export const tips = (wings) => (wings ?? []).flatMap(({ bound, lines }) => lines.slice(bound).flatMap((line) => [line[0], line.at(-1)]));

// `wakes` has the times, bodies, step, top, colours, and `frame(i)`, which promises a frame.
export function makeWake(wakes, motion, repaint) {
  const named = (source) => ({ ...source, unit: "m²/s" });
  const reel = makeReel(named(wakes), "wake", (frame) => decoded(frame, motion, wakes.bodies), repaint);
  let edges = new Map(), shown = null;

  // The trailing edge of a wing at the time of a step.
  function trailing(shot, wing, step) {
    const key = `${wing}:${step}`;
    if (edges.size > KEPT) edges = new Map();
    if (!edges.has(key)) edges.set(key, placed(shot, wing, shot.bound, motion.poses(step * wakes.step)));
    return edges.get(key);
  }

  const placed = (shot, wing, edge, now) => {
    const { at, q } = now[wakes.bodies[wing]];
    return shot.wings[wing].own[edge].map((p) => add(at, turned(q, p)));
  };

  // The edges of a wing's wake at the time t, from the newest, with the levels of the row in front of each.
  function wakeAt(shot, next, wing, t) {
    const before = shot.wings[wing].wake, after = next?.wings[wing].wake ?? new Map();
    const newest = Math.ceil(t / wakes.step - 1e-6) - 1, f = next ? (t - shot.t) / (next.t - shot.t) : 0;
    const last = Math.round(shot.t / wakes.step), stride = Math.max(1, shot.stride);
    const oldest = newest + 1 - (next ? Math.max(shot.kept, next.kept) : shot.kept < last ? shot.kept : Infinity);
    const steps = new Set([...before.keys(), ...[...after.keys()].filter((step) => step >= last)]);
    if (!next) for (let step = last; step <= newest; step++) if (step % stride === 0 || step === newest) steps.add(step);
    const both = [...before.keys()].filter((step) => after.has(step)).pop(); // the oldest one that is in both
    const drift = both == null ? null : before.get(both).line.map((p, j) => minus(after.get(both).line[j], p));
    const unknown = new Int8Array(shot.columns);
    return [...steps].filter((step) => step <= newest && step >= oldest).sort((a, b) => b - a).map((step) => {
      const from = before.get(step), to = after.get(step), row = (from ?? to)?.row ?? unknown;
      if (from && to) return { row, line: from.line.map((p, j) => blend(p, to.line[j], f)) };
      if (from) return { row, line: drift ? from.line.map((p, j) => add(p, drift[j].map((x) => f * x))) : from.line };
      const shed = trailing(shot, wing, step), since = step * wakes.step;
      return { row, line: to ? shed.map((p, j) => blend(p, to.line[j], (t - since) / (next.t - since))) : shed };
    });
  }

  return {
    // Edges and rows of each wing and its wake, `bound` rows of them on the wing; null without.
    at(t) {
      if (!reel.shows(t)) return null;
      const [shot, next] = reel.around(t), now = motion.poses(t);
      if (!shot) return shown; // until it is there
      return (shown = wakes.bodies.map((_, wing) => {
        const wake = wakeAt(shot, next, wing, t);
        const own = Array.from({ length: shot.bound + 1 }, (_, edge) => placed(shot, wing, edge, now));
        return {
          bound: shot.bound,
          lines: [...own, ...wake.map(({ line }) => line)],
          rows: [...shot.wings[wing].rows, ...wake.map(({ row }) => row)],
        };
      }));
    },
    colour: reel.colour,
    get colours() { return reel.colours; },
    update: (more) => reel.update(named(more)),
  };
}
