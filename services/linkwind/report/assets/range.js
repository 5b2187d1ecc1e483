// The range of time that all plots show: to be read, to be typed, how far curves reach in it, and the means over it.

import { indexAt } from "./clock.js";

// Mean of a curve over a range, by the trapezoidal rule, its ends between points by straight lines. A curve that was
// thinned has `means`: those of all its samples from each of its points to the next.
export function meanOf({ x, y, means }, [low, high]) {
  let area = 0, length = 0;
  for (let i = indexAt(x, low); i + 1 < x.length && x[i] < high; i++) {
    const from = Math.max(x[i], low), to = Math.min(x[i + 1], high);
    if (!(from < to)) continue;
    const middle = ((from + to) / 2 - x[i]) / (x[i + 1] - x[i]);
    area += (to - from) * (means ? means[i] : y[i] + middle * (y[i + 1] - y[i]));
    length += to - from;
  }
  return length > 0 ? area / length : NaN;
}

// The values that curves have within a range, in numbers of their axis, with some room; null where there are none, or
// where all of them are within the range.
export function reachOf(curves, [from, to], log) {
  const place = log ? Math.log10 : (value) => value;
  let low = Infinity, high = -Infinity, all = true;
  for (const { x, y } of curves) {
    all &&= from <= x[0] && x[x.length - 1] <= to;
    for (let i = indexAt(x, from); i < x.length && x[i] <= to; i++) {
      const value = place(y[i]);
      if (x[i] < from || !Number.isFinite(value)) continue;
      low = Math.min(low, value);
      high = Math.max(high, value);
    }
  }
  if (all || low > high) return null;
  const room = 0.06 * (high - low) || 0.1 * Math.abs(high) || 1;
  return [low - room, high + room];
}

const text = (t) => String(Number(t.toPrecision(6)));

// Two fields for the range, and how the means over it were made. `wanted` is told what is typed: [from, to], or null
// for all.
export function makeRange(wanted) {
  const bar = document.createElement("div");
  bar.className = "range";
  bar.innerHTML = `<label>Plots from <input type="number" step="any" aria-label="Plots from, in s"></label>
    <label>to <input type="number" step="any" aria-label="Plots to, in s"> s</label>
    <button type="button">all</button><span></span>`;
  const fields = [...bar.querySelectorAll("input")], [all, told] = bar.querySelectorAll("button, span");
  let range = [0, 0];
  const fill = () => fields.forEach((field, i) => { field.value = text(range[i]); });
  bar.addEventListener("change", () => {
    const [from, to] = fields.map((field) => field.valueAsNumber);
    if (from < to) wanted([from, to]);
    else fill();
  });
  all.addEventListener("click", () => wanted(null));
  return {
    bar,
    // `every`: how many steps there are from one sample to the next.
    show(now, whole, every) {
      range = now;
      if (!fields.includes(document.activeElement)) fill(); // nobody types
      all.hidden = whole;
      told.textContent = `below each value: its mean over that time${every > 1 ? `, ≈ as one state in ${every} is here` : ""}`;
    },
  };
}
