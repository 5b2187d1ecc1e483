// The play bar and the keys. Where a steered run is followed they act on the run, else on the picture.

import { leisurely, SPEEDS, times } from "/report/clock.js";

const ids = ["back", "play", "forward", "scrub", "time", "speed", "pace", "live"];
const STRIDE = 10; // of an arrow key with shift

// `run`: steered, paused, rate. `spacing` is how far the arrow keys go [steps].
export function makePlaybar(clock, run, spacing) {
  const [back, play, forward, scrub, time, speed, pace, live] = ids.map((id) => document.getElementById(id));
  const digits = Math.min(6, Math.max(2, Math.ceil(-Math.log10(clock.step) - 1e-9)));
  let playback = null, mode = null;

  const steers = () => run.steered && clock.live && clock.following;
  const send = (command) => {
    Object.assign(run, "points" in command ? { paused: true } : command); // shown at once
    show();
    return fetch("steer", {
      method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(command),
    });
  };

  function toggle() {
    if (steers()) send({ paused: !run.paused });
    else if (clock.playing || clock.following) clock.pause();
    else clock.play();
  }

  function onward() {
    if (steers()) send({ points: 1 });
    else clock.move(1);
  }

  // At the head of a run the speeds are the run's, elsewhere the picture's.
  function offer() {
    const wanted = steers() ? "run" : "picture";
    if (mode === wanted) return;
    mode = wanted;
    pace.textContent = mode === "run" ? "run at" : "speed";
    const values = mode === "run" ? [0, ...SPEEDS] : SPEEDS;
    speed.replaceChildren(...values.map((factor) => new Option(factor ? times(factor) : "full speed", factor)));
  }

  function show() {
    offer();
    playback ??= clock.last > clock.first && !clock.live ? leisurely(clock.last - clock.first) : null;
    clock.speed = playback ?? 1;
    speed.value = mode === "run" ? run.rate : playback ?? 1;
    const { first, last, t } = clock;
    scrub.min = first;
    scrub.max = last;
    scrub.value = t;
    time.value = `${t.toFixed(digits)} s`;
    scrub.setAttribute("aria-valuetext", time.value);
    const going = steers() ? !run.paused : clock.playing || clock.following;
    play.classList.toggle("playing", going);
    play.setAttribute("aria-label", going ? "Pause" : "Play");
    live.hidden = !clock.live;
    const held = run.steered && run.paused;
    live.className = `chip ${held ? "held" : clock.following ? "on" : ""}`;
    live.textContent = held ? "run paused" : clock.following ? "live" : "to live";
  }

  back.addEventListener("click", () => clock.move(-1));
  play.addEventListener("click", toggle);
  forward.addEventListener("click", onward);
  live.addEventListener("click", () => clock.follow());
  scrub.addEventListener("input", () => { const to = Number(scrub.value); clock.pause(); clock.seek(to); });
  speed.addEventListener("change", () => {
    if (mode === "run") send({ rate: Number(speed.value) });
    else playback = clock.speed = Number(speed.value);
  });

  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.target.closest?.("select, input:not([type=range])")) return;
    const button = event.target.closest?.("button");
    const act = {
      " ": button ? null : toggle,
      ".": onward,
      ",": () => clock.move(-1),
      ArrowLeft: () => clock.move(-spacing() * (event.shiftKey ? STRIDE : 1)),
      ArrowRight: () => clock.move(spacing() * (event.shiftKey ? STRIDE : 1)),
      Home: () => { clock.pause(); clock.seek(clock.first); },
      End: () => clock.follow(),
    }[event.key];
    if (act) { event.preventDefault(); act(); }
  });
  clock.listen(show);
  return { show };
}
