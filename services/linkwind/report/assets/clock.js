// The one time of the page: every view listens to it, every control sets it.

// Arrays of the data block are base64 of little-endian numbers.
export function unpack(packed) {
  const bytes = Uint8Array.from(atob(packed.bdata), (c) => c.charCodeAt(0));
  return packed.dtype === "f8" ? new Float64Array(bytes.buffer) : new Float32Array(bytes.buffer);
}

// Largest i with times[i] <= t (times ascending).
export function indexAt(times, t) {
  let low = 0, high = times.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (times[middle] <= t) low = middle; else high = middle - 1;
  }
  return low;
}

export function makeClock(times) {
  const first = times[0], last = times[times.length - 1];
  const listeners = [];
  let t = first, playing = false, speed = 1, before = 0;

  const tell = () => listeners.forEach((listener) => listener(t, playing));

  function tick(now) {
    if (!playing) return;
    t += (now - before) / 1000 * speed;
    before = now;
    if (t >= last) { t = last; playing = false; }
    tell();
    if (playing) requestAnimationFrame(tick);
  }

  return {
    times, first, last,
    get t() { return t; },
    get playing() { return playing; },
    set speed(factor) { speed = factor; },
    listen(listener) { listeners.push(listener); listener(t, playing); },
    seek(to) { t = Math.min(last, Math.max(first, to)); tell(); },
    step(frames) {
      const i = indexAt(times, t + 1e-12 * Math.abs(t)) + frames;
      this.pause();
      this.seek(times[Math.min(times.length - 1, Math.max(0, i))]);
    },
    play() {
      if (playing || last <= first) return;
      if (t >= last) t = first;
      playing = true;
      before = performance.now();
      tell();
      requestAnimationFrame(tick);
    },
    pause() { playing = false; tell(); },
    toggle() { if (playing) this.pause(); else this.play(); },
  };
}

export const SPEEDS = [0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100];
const SHOWING = 8; // s that a run should take on the screen at first

export const times = (factor) => `${factor < 1 ? `1/${Math.round(1 / factor)}` : factor} ×`;

// The speed at which a run of this length [s] is seen well.
export function leisurely(duration) {
  const off = (factor) => Math.abs(Math.log((factor * SHOWING) / duration));
  return SPEEDS.reduce((a, b) => (off(b) < off(a) ? b : a));
}

export function makeControls(clock) {
  const [play, scrub, time, speed] = ["play", "scrub", "time", "speed"].map((id) => document.getElementById(id));
  const step = (clock.last - clock.first) / Math.max(1, clock.times.length - 1);
  const digits = Math.min(6, Math.max(2, Math.ceil(-Math.log10(step || 1))));

  const initial = leisurely(clock.last - clock.first);
  for (const factor of SPEEDS) speed.add(new Option(times(factor), factor, factor === initial, factor === initial));
  clock.speed = initial;
  scrub.max = clock.times.length - 1;

  play.addEventListener("click", () => clock.toggle());
  speed.addEventListener("change", () => { clock.speed = Number(speed.value); });
  scrub.addEventListener("input", () => {
    const wanted = clock.times[Number(scrub.value)]; // before pause() sets the slider back
    clock.pause();
    clock.seek(wanted);
  });
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.target.closest("select, summary, a, textarea, input:not([type=range]), .modebar")) return;
    const slider = event.target === scrub; // steps by itself on the arrow keys
    const act = {
      " ": event.target === play ? null : () => clock.toggle(),
      ArrowLeft: slider ? null : () => clock.step(event.shiftKey ? -10 : -1),
      ArrowRight: slider ? null : () => clock.step(event.shiftKey ? 10 : 1),
      Home: () => clock.step(-Infinity),
      End: () => clock.step(Infinity),
    }[event.key];
    if (act) { event.preventDefault(); act(); }
  });
  clock.listen((t, playing) => {
    scrub.value = indexAt(clock.times, t + 1e-12 * Math.abs(t));
    time.value = `${t.toFixed(digits)} s`;
    scrub.setAttribute("aria-valuetext", time.value);
    play.textContent = playing ? "❚❚" : "▶";
    play.setAttribute("aria-label", playing ? "Pause" : "Play");
  });
}
