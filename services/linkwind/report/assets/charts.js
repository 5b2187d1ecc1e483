// The plots: one plotly figure a row, one time range and one cursor for all of them.

import { indexAt, unpack } from "./clock.js";
import { makeRange, meanOf, reachOf } from "./range.js";

const MARGIN = { l: 62, r: 10, t: 6, b: 8 }; // on the left at least: all plots share the widest that one needs
const BOTTOM = 36; // of a row that carries the time axis

export function theme() {
  const style = getComputedStyle(document.documentElement);
  return (name) => style.getPropertyValue(`--${name}`).trim();
}

export const bodyColour = (index) => `c${index % 8}`;

// Which body has which colour.
export function makeKey(bodies) {
  document.getElementById("bodies").replaceChildren(...bodies.map((body, i) => {
    const item = document.createElement("li");
    item.textContent = body.name;
    item.style.setProperty("--colour", `var(--${bodyColour(i)})`);
    return item;
  }));
}

const DASHES = ["solid", "dash", "dot", "dashdot"];

// Numbers of one row all have the same number of decimals, so that they do not jump; means have `more`.
function formatter(row, more = 0) {
  let largest = 0;
  for (const curve of row.curves) for (const y of curve.y) if (Math.abs(y) > largest && isFinite(y)) largest = Math.abs(y);
  if (row.log || largest >= 1e5 || (largest > 0 && largest < 1e-2)) return (y) => y.toExponential(1 + more).replace("-", "−");
  const decimals = row.whole ? 0 : Math.min(4, Math.max(largest < 1000 ? 1 : 0, 2 - Math.floor(Math.log10(largest || 1))));
  return (y) => y.toFixed(decimals + more).replace("-", "−");
}

// Ticks of a logarithmic axis at 1, 2 and 5 times the powers of ten; at these alone where those would not fit.
function decades([low, high]) {
  const values = [], digits = high - low > 1.5 ? [1] : [1, 2, 5];
  for (let power = Math.floor(low); power <= high; power++) {
    for (const digit of digits) values.push(digit * 10 ** power);
  }
  return { tickvals: values, ticktext: values.map(String) };
}

function layoutOf(row, range, left, colour) {
  const axis = {
    gridcolor: colour("grid"), zerolinecolor: colour("line"), linecolor: colour("line"), ticks: "outside",
    tickcolor: colour("line"), ticklen: 4, exponentformat: "power", automargin: false,
  };
  const bottom = row.last ? BOTTOM : MARGIN.b, reach = row.bars ? null : reachOf(row.curves, range, row.log);
  return {
    margin: { ...MARGIN, l: left, b: bottom }, showlegend: false, hovermode: false, bargap: 0.04,
    paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
    font: { family: "system-ui, sans-serif", size: 12, color: colour("soft") },
    xaxis: {
      ...axis, range: [...range], type: row.bars ? "log" : "linear", showticklabels: row.last,
      title: row.last ? { text: row.bars ? row.xlabel : "t [s]", standoff: 2 } : undefined, nticks: 6,
      ...(row.bars ? decades(range) : {}),
    },
    yaxis: {
      ...axis, automargin: "left", title: { text: row.label, standoff: 4 }, type: row.log ? "log" : "linear", nticks: 5, zeroline: !row.log,
      rangemode: row.bars ? "tozero" : "normal", tickformat: row.whole ? "d" : undefined,
      dtick: row.log ? undefined : row.whole ? 1 : undefined, ...(reach ? { range: reach, autorange: false } : { autorange: true }),
    },
  };
}

function tracesOf(row, colour) {
  if (row.bars) {
    const [curve] = row.curves;
    return [{ type: "bar", x: curve.x, width: curve.width, y: curve.y, marker: { color: colour("accent") } }];
  }
  return row.curves.map((curve) => ({
    type: "scatter", mode: curve.x.length > 1 ? "lines" : "markers", x: curve.x, y: curve.y, connectgaps: false,
    line: {
      color: colour(bodyColour(curve.colour)), width: 1.6, dash: DASHES[Math.floor(curve.colour / 8) % 4],
      shape: row.whole ? "hv" : "linear",
    },
  }));
}

function makeRow(row, card) {
  const holder = card.appendChild(document.createElement("div"));
  holder.className = "row";
  const readout = holder.appendChild(document.createElement("div"));
  readout.className = "readout";
  const plot = holder.appendChild(document.createElement("div"));
  plot.className = row.last ? "plot last" : "plot";
  const cursor = document.createElement("div");
  cursor.className = "cursor";
  cursor.style.height = `calc(100% - ${MARGIN.t + (row.last ? BOTTOM : MARGIN.b)}px)`;
  const values = row.bars ? [] : row.curves.map((curve) => {
    const item = readout.appendChild(document.createElement("span"));
    item.style.setProperty("--colour", `var(--${bodyColour(curve.colour)})`);
    item.append(curve.name, " ", document.createElement("b"));
    return item.lastChild;
  });
  const means = row.bars || row.log || row.whole ? [] : values.map((value) => {
    value.after(document.createElement("i"));
    return value.nextSibling;
  });
  const made = { ...row, plot, cursor, format: formatter(row) };
  made.show = (t) => made.curves.forEach((curve, i) => {
    const y = curve.y[indexAt(curve.x, t + 1e-12 * Math.abs(t))];
    values[i].textContent = Number.isFinite(y) ? made.format(y) : "–";
  });
  made.average = (range, sampled) => means.forEach((text, i) => {
    const mean = meanOf(made.curves[i], range), format = formatter(made, 1);
    text.textContent = `mean ${sampled ? "≈ " : ""}${Number.isFinite(mean) ? format(mean) : "–"}`;
  });
  return made;
}

// The rows of all panels, their curves unpacked; `series` are the times of curves without their own.
function unpacked(panels, series) {
  return panels.map((panel) => ({
    ...panel,
    rows: panel.rows.map((row, i) => ({
      ...row,
      last: i === panel.rows.length - 1 || row.bars,
      curves: row.curves.map((curve) => ({
        ...curve,
        y: unpack(curve.y),
        x: curve.x ? unpack(curve.x) : series,
        ...(curve.width ? { width: unpack(curve.width) } : {}),
        ...(curve.means ? { means: unpack(curve.means) } : {}),
      })),
    })),
  }));
}

// What the rows are: as long as it stays the same, new curves go into the same plots.
const kindOf = (panels) => JSON.stringify(
  panels.map(({ title, rows }) => [title, rows.map(({ bars, curves }) => [bars, curves.map(({ name }) => name)])]));

// `zoomed` is told the range of time that is looked at.
export function makeCharts(panels, clock, host, zoomed = () => {}) {
  const coarse = matchMedia("(pointer: coarse)").matches; // fingers scroll the page, they do not zoom plots
  const config = {
    displaylogo: false, responsive: true, staticPlot: coarse, displayModeBar: false, doubleClick: false,
  };
  const limits = makeRange((typed) => zoom(typed ?? whole()));
  let rows = [], timed = [], notes = [], kind = null, range = whole(), left = MARGIN.l, spacing = 1;

  function whole() {
    const pad = clock.last > clock.first ? 0 : 0.5;
    return [clock.first - pad, clock.last + pad];
  }

  const spanOf = (row) => row.bars
    ? [Math.log10(row.curves[0].x[0]) - 0.1, Math.log10(row.curves[0].x.at(-1)) + 0.1] : range;

  function place(t) {
    for (const { plot, cursor } of timed) {
      const part = (t - range[0]) / (range[1] - range[0]);
      cursor.hidden = part < 0 || part > 1;
      cursor.style.transform = `translateX(${left + part * (plot.clientWidth - left - MARGIN.r)}px)`;
    }
  }

  // Tells the range, and the means over it.
  function average() {
    const [low, high] = whole();
    limits.show(range, low === range[0] && high === range[1], spacing);
    for (const row of timed) row.average(range, spacing > 1);
  }

  function zoom(to) {
    if (to[0] === range[0] && to[1] === range[1]) return;
    range = to;
    for (const { plot, curves, log } of timed) {
      const reach = reachOf(curves, range, log);
      Plotly.relayout(plot, { "xaxis.range": [...range], ...(reach ? { "yaxis.range": reach } : { "yaxis.autorange": true }) });
    }
    align();
    place(clock.t);
    average();
    const [low, high] = whole();
    zoomed(range, low === range[0] && high === range[1]);
  }

  function listen(row) {
    const { plot } = row;
    const timeOf = (event) => {
      const box = plot.getBoundingClientRect();
      const part = (event.clientX - box.left - left) / (box.width - left - MARGIN.r);
      return part < 0 || part > 1 ? null : range[0] + part * (range[1] - range[0]);
    };
    const move = (event) => { const t = timeOf(event); if (t !== null) clock.seek(t); };
    plot.addEventListener("pointerdown", (event) => { clock.pause(); move(event); }, true);
    plot.addEventListener("pointermove", (event) => {
      if (!clock.playing && event.buttons === 0 && event.pointerType === "mouse") move(event);
    }, true);
    plot.addEventListener("dblclick", () => zoom(whole()), true);
    plot.on("plotly_relayout", (change) => {
      if ("xaxis.range[0]" in change) zoom([change["xaxis.range[0]"], change["xaxis.range[1]"]]);
    });
  }

  function draw(some = rows) {
    const colour = theme();
    for (const row of some) {
      row.stale = false;
      Plotly.react(row.plot, tracesOf(row, colour), layoutOf(row, spanOf(row), left, colour), config);
    }
    align();
  }

  // Gives every plot the left margin of the one with the widest numbers, so that their times stand in line.
  function align() {
    const drawn = rows.filter(({ plot }) => plot._fullLayout);
    const widest = Math.ceil(Math.max(left, ...drawn.map(({ plot }) => plot._fullLayout._size.l)));
    if (widest === left) return;
    left = widest;
    for (const { plot } of drawn) Plotly.relayout(plot, { "margin.l": left });
  }

  function build(panels) {
    for (const { plot } of rows) Plotly.purge(plot);
    host.replaceChildren(limits.bar);
    left = MARGIN.l;
    notes = [];
    rows = panels.flatMap((panel) => {
      const card = host.appendChild(document.createElement("article"));
      card.className = "card";
      card.appendChild(document.createElement("h2")).textContent = panel.title;
      const note = card.appendChild(document.createElement("p"));
      note.hidden = !panel.note;
      notes.push(note);
      return panel.rows.map((row) => makeRow(row, card));
    });
    timed = rows.filter((row) => !row.bars);
    draw();
    for (const row of timed) { row.plot.append(row.cursor); listen(row); onScreen.observe(row.plot); }
  }

  // Draws later what is not looked at now.
  const onScreen = new IntersectionObserver((entries) => {
    for (const { target, isIntersecting } of entries) {
      const row = rows.find(({ plot }) => plot === target);
      if (!row) continue;
      row.seen = isIntersecting;
      if (isIntersecting && row.stale) draw([row]);
    }
  });

  // `every`: how many steps there are from one sample to the next.
  function show(panels, series, to = range, every = 1) {
    const all = unpacked(panels, series), now = kindOf(panels);
    range = to;
    spacing = every;
    if (now !== kind) { kind = now; build(all); }
    else {
      all.flatMap((panel) => panel.rows).forEach((row, i) => {
        Object.assign(rows[i], row, { format: formatter(row), stale: true });
      });
      draw(rows.filter((row) => row.seen));
    }
    place(clock.t);
    for (const row of timed) row.show(clock.t);
    average();
    panels.forEach((panel, i) => { notes[i].textContent = panel.note; });
  }

  show(panels, clock.series);
  clock.listen((t) => { place(t); for (const row of timed) row.show(t); });
  new ResizeObserver(() => place(clock.t)).observe(host);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => draw());
  return { show };
}
