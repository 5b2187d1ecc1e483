// Puts the page together: asks the server what there is, and shows it as it grows.

import { makeCharts, makeKey } from "/report/charts.js";
import { unpack } from "/report/clock.js";
import { makeFilm } from "/report/film.js";
import { makeScene } from "/report/scene.js";
import { makeVortices } from "/report/vortices.js";
import { makeWake } from "/report/wake.js";
import { makeClock } from "./clock.js";
import { makeHand } from "./hand.js";
import { makePlaybar } from "./playbar.js";
import { makePoses } from "./poses.js";
import { makeSpace } from "./space.js";

const AHEAD = 6; // pictures of the fluid that are loaded before they are due
const REST = 2; // times as long as loading took that a growing recording is left alone
const SHORTEST = 600; // ms, the same at least
const DETAIL = 700; // states around the time that is looked at, where all of the recording has too many

const element = (id) => document.getElementById(id);

async function ask(path) {
  const answer = await fetch(path);
  if (!answer.ok) throw new Error((await answer.json().catch(() => ({}))).error ?? `${path}: ${answer.status}`);
  return answer.json();
}

const facts = await ask("facts");
document.title = `${facts.name} · linkwind`;
element("name").textContent = facts.name;
element("description").textContent = facts.description;

const run = { steered: facts.steered, paused: false, rate: 0 };
const clock = makeClock(facts.step);
let now = facts; // what the server told last
let view = null; // of the recording, once it has a state: poses, scene, charts
let film = null, frames = 0, wake = null, wakes = 0, vortices = null, volumes = 0;
const loaded = { last: null, every: 1, busy: false, again: 0, timer: 0 };

const playbar = makePlaybar(clock, run, () => loaded.every);

function tell() {
  const badge = element("badge"), { ended, complete, error } = now;
  const [kind, word] = !ended ? ["live", facts.steered ? "running" : "no end yet"]
    : complete ? ["good", "complete"] : ["bad", "incomplete"];
  badge.className = `badge ${kind}`;
  badge.textContent = word;
  element("banner").hidden = !error;
  element("banner").textContent = error ?? "";
  element("waiting").hidden = view !== null;
  if (ended && now.last === null) element("waiting").textContent = "The log holds no state of the mechanism.";
}

function fail(error) {
  element("banner").hidden = false;
  element("banner").textContent = String(error.message ?? error);
}

// The whole recording: every state, or a sample. Now and then while it grows, at once when it stands still.
async function load() {
  clearTimeout(loaded.timer);
  if (loaded.busy || now.last === null || now.last === loaded.last) return;
  const wait = now.ended || run.paused ? 0 : loaded.again - performance.now();
  if (wait > 0) {
    loaded.timer = setTimeout(() => load().catch(fail), wait);
    return;
  }
  loaded.busy = true;
  const began = performance.now(), { first, last } = now;
  try {
    const window = await ask(`window?from=${first}&to=${last}`);
    if (window.scene) show(window);
    Object.assign(loaded, { last, every: window.every });
  } finally {
    loaded.busy = false;
    loaded.again = performance.now() + Math.max(SHORTEST, REST * (performance.now() - began));
  }
  if (now.last !== loaded.last) load().catch(fail);
}

// Where the axis of a run ends that goes on: not at every state another place.
function horizon() {
  if (!clock.live) return clock.last;
  const share = clock.last / facts.planned;
  return facts.planned * Math.min(1, [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1].find((part) => share <= 0.95 * part) ?? 1);
}

function show(window) {
  const series = unpack(window.t);
  if (view === null) {
    makeKey(window.scene.bodies);
    const poses = makePoses(window.scene), flat = window.scene.planar;
    element("scene").hidden = !flat;
    element("space").hidden = flat;
    element("waiting").hidden = true;
    clock.series = series;
    const scene = flat ? makeScene(element("scene"), poses, clock) : makeSpace(element("space"), poses, clock);
    if (flat) makeHand(element("scene"), scene);
    if (clock.live) element("follow").checked = true;
    view = { poses, scene, charts: makeCharts([], clock, element("charts"), zoomed), zoom: null };
  } else {
    view.poses.overview = window.scene;
  }
  view.whole = { panels: window.panels, series, every: window.every };
  if (view.zoom === null) view.charts.show(window.panels, series, [clock.first, horizon() > clock.first ? horizon() : clock.first + 1], window.every);
  view.scene.draw();
}

// More of what the plots are zoomed to.
async function zoomed([low, high], whole) {
  const range = (view.zoom = whole ? null : [low, high]);
  if (whole) return view.charts.show(view.whole.panels, view.whole.series, [clock.first, horizon()], view.whole.every);
  if (loaded.every === 1) return;
  const { step } = clock; // a state more at both ends, for means right up to them
  const window = await ask(`window?from=${Math.max(low - step, clock.first)}&to=${Math.min(high + step, clock.last)}`);
  if (view.zoom === range && window.scene) view.charts.show(window.panels, unpack(window.t), range, window.every);
}

// Every state around the time that is looked at.
let looking = 0;
async function look() {
  if (loaded.every === 1 || view === null || clock.following || view.poses.detailed(clock.t)) return;
  const span = DETAIL * facts.step, t = clock.t;
  const window = await ask(`window?from=${Math.max(clock.first, t - span)}&to=${Math.min(clock.last, t + span)}`);
  view.poses.detail = window.scene;
  view.scene.draw();
}
clock.listen((t, playing) => {
  clearTimeout(looking);
  if (!playing) looking = setTimeout(() => look().catch(fail), 120);
});

// The frames of the fluid, of the first provider that shows its own.
async function reel() {
  const [provider] = Object.keys(now.frames);
  if (!provider || view === null || now.frames[provider] === frames || !("film" in view.scene)) return;
  frames = now.frames[provider];
  const { t, quantities } = await ask(`reel/${provider}`);
  if (!Object.keys(quantities).length) return;
  const stamp = (name) => `${quantities[name].low}:${quantities[name].high}`; // another scale is another picture
  const picture = async (name, i) => {
    const answer = await fetch(`picture/${provider}/${name}/${i}?scale=${stamp(name)}`);
    if (!answer.ok) throw new Error(`picture ${i}: ${answer.status}`);
    const extent = JSON.parse(answer.headers.get("X-Extent"));
    return [URL.createObjectURL(await answer.blob()), extent];
  };
  const flow = { times: Float64Array.from(t), quantities, picture };
  if (film) film.update(flow);
  else view.scene.film = film = makeFilm(flow, view.scene.draw, AHEAD);
}

// Wings and wakes, of the first provider that shows its own.
async function trail() {
  const [provider] = Object.keys(now.wakes);
  if (!provider || view === null || now.wakes[provider] === wakes) return;
  wakes = now.wakes[provider];
  const reel = await ask(`wake/${provider}`);
  if (!reel) return;
  const made = { ...reel, times: reel.t, frame: (i) => ask(`wake/${provider}/${i}?scale=${reel.top}`) };
  if (wake) wake.update(made);
  else view.scene.wake = wake = makeWake(made, view.poses, view.scene.draw);
}

// Vortices, of the first provider that shows its fluid in a box.
async function turn() {
  const [provider] = Object.keys(now.volumes);
  if (!provider || view === null || now.volumes[provider] === volumes || !("vortices" in view.scene)) return;
  volumes = now.volumes[provider];
  const reel = await ask(`vortices/${provider}`);
  if (!reel) return;
  const made = { ...reel, times: reel.t, frame: (i) => ask(`vortices/${provider}/${i}?scale=${reel.top}`) };
  if (vortices) vortices.update(made);
  else view.scene.vortices = vortices = makeVortices(made, view.scene.draw);
}

async function update(news) {
  const { poses, ...rest } = news;
  now = { ...now, ...rest };
  if ("paused" in now) Object.assign(run, { paused: now.paused, rate: now.rate });
  if (now.last !== null) {
    const begins = clock.last === 0 && !clock.live && !now.ended;
    clock.grow(now.first, now.last, !now.ended);
    if (begins) clock.follow();
  }
  if (poses && view) view.poses.append(poses);
  playbar.show();
  tell();
  const loading = load();
  await trail(); // frames are there sooner than all of the recording
  await turn();
  await loading;
  await reel();
  await trail();
  await turn();
}

tell();
const events = new EventSource("events");
events.onmessage = (event) => update(JSON.parse(event.data)).catch(fail);
events.onerror = () => {
  element("badge").className = "badge bad";
  element("badge").textContent = now.ended ? "server gone" : "not connected";
};
