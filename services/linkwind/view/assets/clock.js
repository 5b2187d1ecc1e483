// The one time of the page: of a recording that is played, or of a run that is followed while it goes on.

const CATCH_UP = 0.12; // s in which most of the way to a run's new state is done

// `step` is the communication step size [s].
export function makeClock(step) {
  const listeners = [];
  let first = 0, last = 0, t = 0, playing = false, live = false, following = false, speed = 1;
  let before = 0, ticking = false;

  const tell = () => listeners.forEach((listener) => listener(t, playing));

  function advance(seconds) {
    if (following) {
      t += (last - t) * (1 - Math.exp(-seconds / CATCH_UP));
      if (last - t < 0.2 * step) t = last;
    } else {
      t = Math.min(last, t + seconds * speed);
      if (t === last) { playing = false; following = live; }
    }
  }

  function tick(now) {
    ticking = playing || (following && t < last);
    if (!ticking) return;
    advance((now - before) / 1000);
    before = now;
    tell();
    requestAnimationFrame(tick);
  }

  function start() {
    if (ticking) return;
    ticking = true;
    before = performance.now();
    requestAnimationFrame(tick);
  }

  return {
    step,
    get first() { return first; },
    get last() { return last; },
    get t() { return t; },
    get playing() { return playing; },
    get following() { return following; },
    get live() { return live; },
    set speed(factor) { speed = factor; },
    listen(listener) { listeners.push(listener); listener(t, playing); },
    // The recording has come this far, and goes on or not.
    grow(from, to, goesOn) {
      first = from;
      last = to;
      if (live && !goesOn && following) { following = false; t = last; }
      live = goesOn;
      if (following) start();
      tell();
    },
    seek(to) { following = false; t = Math.min(last, Math.max(first, to)); tell(); },
    follow() { playing = false; following = live; if (!live) t = last; start(); tell(); },
    // To the communication point so many steps from here; fractions of a step are cut.
    move(steps) {
      playing = false;
      const k = steps > 0 ? Math.floor(t / step + 1e-6) : Math.ceil(t / step - 1e-6);
      this.seek((k + steps) * step);
    },
    play() {
      if (playing || last <= first) return;
      if (t >= last && !live) t = first;
      following = false;
      playing = true;
      tell();
      start();
    },
    pause() { playing = following = false; tell(); },
  };
}
