// Where the bodies are, from several pieces of the recording: all of it coarsely, the newest states of a run,
// and every state around the time that is looked at.

import { unpack } from "/report/clock.js";
import { makeMotion } from "/report/motion.js";

const piece = (scene) => makeMotion(scene, unpack(scene.t));
const covers = (motion, t) => motion && t >= motion.times[0] && t <= motion.times.at(-1);
const KEPT = 400; // newest pieces

export function makePoses(scene) {
  let overview = piece(scene), detail = null, newest = [];

  const at = (t) => (covers(detail, t) ? detail : covers(overview, t) ? overview : newest.find((each) => covers(each, t)));

  return {
    scene,
    get times() { return overview.times; },
    get path() { return overview.path; },
    get world() { return overview.world; },
    get largest() { return overview.largest; },
    get beyond() { return overview.beyond; },
    centre: overview.centre,
    poses: (t) => (at(t) ?? newest.at(-1) ?? overview).poses(t),
    air: (t) => (at(t) ?? newest.at(-1) ?? overview).air(t),
    drift: (t) => overview.drift(t),
    detailed: (t) => covers(detail, t),
    set overview(next) {
      overview = piece(next);
      newest = newest.filter((each) => each.times.at(-1) > overview.times.at(-1));
      scene.joints = next.joints; // some may have been released since
    },
    set detail(scene) { detail = scene && piece(scene); },
    append(scene) { newest = [...newest.slice(-KEPT), piece(scene)]; },
  };
}
