// Draws the charts of a report page as SVG: lines, bands, areas, points and horizontal bars.
// The page holds them as JSON {arrays, charts}; colours of axes and words follow the page's theme.
(() => {
  const page = JSON.parse(document.getElementById("figures").textContent);
  const charts = [];
  const decode = (text) => {
    const raw = Uint8Array.from(atob(text.slice(1)), (c) => c.charCodeAt(0));
    return text[0] === "4" ? new Float32Array(raw.buffer) : new Float64Array(raw.buffer);
  };
  const decoded = new Map();
  const numbers = (index) => {
    if (!decoded.has(index)) decoded.set(index, decode(page.arrays[index]));
    return decoded.get(index);
  };

  const svg = (name, attributes = {}, parent = null, text = null) => {
    const made = document.createElementNS("http://www.w3.org/2000/svg", name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    if (text !== null) made.textContent = text;
    if (parent) parent.appendChild(made);
    return made;
  };
  const html = (name, className, parent, text = "") => {
    const made = document.createElement(name);
    made.className = className;
    made.textContent = text;
    parent.appendChild(made);
    return made;
  };
  const figure = (value, digits = 4) => {
    if (!Number.isFinite(value)) return "–";
    const size = Math.abs(value);
    if (size !== 0 && (size < 1e-3 || size >= 1e6)) return value.toExponential(digits - 2).replace("-", "−").replace("e+", "e");
    return String(Number(value.toPrecision(digits))).replace("-", "−");
  };

  // ticks at 1, 2 or 5 times a power of ten; on a logarithmic axis at every such number
  const linearTicks = (low, high, count) => {
    const rough = (high - low) / Math.max(count, 1), power = 10 ** Math.floor(Math.log10(rough));
    const step = power * ([1, 2, 5, 10].find((m) => m * power >= rough * 0.999) || 10);
    const out = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k += 1) out.push(k * step);
    return out;
  };
  const logTicks = (low, high) => {
    const out = [], fine = high - low < 2;
    for (let k = Math.floor(low); k <= high; k += 1)
      for (const m of fine ? [1, 2, 5] : [1]) {
        const at = k + Math.log10(m);
        if (at >= low && at <= high) out.push(at);
      }
    return out;
  };

  const bounds = (arrays, x = null, range = null) => {
    let low = Infinity, high = -Infinity;
    for (const [values, across] of arrays)
      for (let i = 0; i < values.length; i += 1) {
        const v = values[i];
        if (!Number.isFinite(v) || (range && (across[i] < range[0] || across[i] > range[1]))) continue;
        if (v < low) low = v;
        if (v > high) high = v;
      }
    return low <= high ? [low, high] : [0, 1];
  };
  const padded = ([low, high], share) => {
    const span = high - low || Math.abs(high) || 1;
    return [low - share * span, high + share * span];
  };

  // text is this wide for each letter of its size, on average
  const EM = 0.58;
  // a label in one or two lines of so many letters, cut with an ellipsis where that is too little
  const twoLines = (words, room) => {
    if (words.length <= room) return [words];
    const gap = words.lastIndexOf(" ", room);
    const lines = gap > 0 ? [words.slice(0, gap), words.slice(gap + 1)] : [words];
    return lines.map((w) => (w.length > room ? `${w.slice(0, room - 1)}…` : w));
  };

  // a frame with axes; returns the functions from values to pixels and the clipped group of marks;
  // `ends`: values with the letters that stand to the right of them, for which room is left
  const framed = (plot, chart, x, y, { log = false, rows = null, ends = [] } = {}) => {
    const width = plot.clientWidth, height = plot.clientHeight, size = 11.5;
    const yTicks = rows ? rows.map((_, k) => k) : linearTicks(y[0], y[1], Math.max(height / 55, 2));
    const words = yTicks.map((v, k) => (rows ? rows[k] : figure(v)));
    const widest = Math.max(...words.map((w) => w.length), 1);
    const left = Math.min(widest * size * EM + 14, 0.42 * width) + (chart.y ? 20 : 0);
    const box = { left, right: width - 12, top: 8, bottom: height - 40 };
    for (const [value, letters] of ends) {
      const room = Math.max(box.right - left - letters * size * EM, 0.2 * (box.right - left));
      x = [x[0], Math.max(x[1], x[0] + ((value - x[0]) * (box.right - left)) / room)];
    }
    const root = svg("svg", { width, height, role: "img", "aria-label": chart.title });
    const px = (v) => box.left + ((v - x[0]) / (x[1] - x[0])) * (box.right - box.left);
    const py = (v) => box.bottom - ((v - y[0]) / (y[1] - y[0])) * (box.bottom - box.top);
    for (const v of log ? logTicks(x[0], x[1]) : linearTicks(x[0], x[1], Math.max((box.right - box.left) / 90, 2))) {
      svg("line", { class: v === 0 && !log ? "zero" : "grid", x1: px(v), x2: px(v), y1: box.top, y2: box.bottom }, root);
      svg("text", { class: "tick", x: px(v), y: box.bottom + 16, "text-anchor": "middle" }, root, figure(log ? 10 ** v : v));
    }
    yTicks.forEach((v, k) => {
      if (!rows) svg("line", { class: v === 0 ? "zero" : "grid", x1: box.left, x2: box.right, y1: py(v), y2: py(v) }, root);
      const lines = twoLines(words[k], Math.floor((box.left - 10) / (size * EM)));
      lines.forEach((shown, n) => {
        const at = py(v) + 4 + (n - (lines.length - 1) / 2) * (size + 1);
        const label = svg("text", { class: "tick", x: box.left - 7, y: at, "text-anchor": "end" }, root, shown);
        if (lines.join(" ") !== words[k]) svg("title", {}, label, words[k]);
      });
    });
    // under the middle of the axis, unless it would leave the picture; smaller where it is too wide
    const wide = chart.x.length * 12 * EM, fits = Math.min(1, (width - 8) / Math.max(wide, 1));
    const centre = Math.min((box.left + box.right) / 2, width - 4 - (wide * fits) / 2);
    svg("text", { class: "name", x: Math.max(centre, 4 + (wide * fits) / 2), y: height - 6, "text-anchor": "middle", style: `font-size: ${12 * fits}px` }, root, chart.x);
    if (chart.y) svg("text", { class: "name", transform: `translate(13 ${(box.top + box.bottom) / 2}) rotate(-90)`, "text-anchor": "middle" }, root, chart.y);
    const id = `clip-${charts.length}-${Math.random().toString(36).slice(2)}`;
    const clip = svg("clipPath", { id }, root);
    svg("rect", { x: box.left, y: box.top, width: Math.max(box.right - box.left, 0), height: box.bottom - box.top }, clip);
    const inner = svg("g", { "clip-path": `url(#${id})` }, root);
    for (const [at, label, level] of chart.marks) {
      const [a, b] = level ? [py(at), py(at)] : [px(at), px(at)];
      if (!level && (a < box.left - 1 || a > box.right + 1)) continue;
      svg("line", level ? { class: "mark", x1: box.left, x2: box.right, y1: a, y2: b } : { class: "mark", x1: a, x2: b, y1: box.top, y2: box.bottom }, inner);
      const turned = !level && a + 4 + label.length * 11 * EM > box.right;
      svg("text", level ? { class: "note", x: box.right - 3, y: a - 4, "text-anchor": "end" } : { class: "note", x: turned ? a - 4 : a + 4, y: box.top + 11, "text-anchor": turned ? "end" : "start" }, inner, label);
    }
    return { root, inner, box, px, py };
  };

  const pathOf = (xs, ys, px, py) => {
    let out = "", pen = false;
    for (let i = 0; i < xs.length; i += 1) {
      if (!Number.isFinite(ys[i])) { pen = false; continue; }
      out += `${pen ? "L" : "M"}${px(xs[i]).toFixed(1)} ${py(ys[i]).toFixed(1)}`;
      pen = true;
    }
    return out;
  };
  // every stretch between two gaps is an area of its own
  const areaOf = (xs, low, high, px, py) => {
    let out = "", first = 0;
    const flush = (last) => {
      if (last - first < 2) return;
      for (let i = first; i < last; i += 1) out += `${i === first ? "M" : "L"}${px(xs[i]).toFixed(1)} ${py(high[i]).toFixed(1)}`;
      for (let i = last - 1; i >= first; i -= 1) out += `L${px(xs[i]).toFixed(1)} ${py(low[i]).toFixed(1)}`;
      out += "Z";
    };
    for (let i = 0; i <= xs.length; i += 1)
      if (i === xs.length || !Number.isFinite(low[i]) || !Number.isFinite(high[i])) { flush(i); first = i + 1; }
    return out;
  };
  // what is hidden has no size, and is drawn when it gets one
  const sized = (area) => area.clientWidth > 60 && area.clientHeight > 60;
  const ink = (colour) => (colour === "ink" ? "var(--ink)" : colour);

  const lineChart = (plot, chart) => {
    const lines = chart.lines.map((line) => ({ ...line, x: numbers(line.x), y: numbers(line.y), low: line.low === undefined ? null : numbers(line.low), high: line.high === undefined ? null : numbers(line.high) }));
    const hidden = new Set();
    const legend = html("div", "legend", plot);
    const area = html("div", "canvas", plot);
    const hint = html("div", "hint", plot);
    const state = { chart, range: null, redraw: () => {} };
    const whole = bounds(lines.map((l) => [l.x, l.x]).concat([[chart.marks.filter((m) => !m[2]).map((m) => m[0]), []]]));
    let frame = null;
    state.redraw = () => {
      if (!sized(area)) return;
      const shown = lines.filter((l) => !hidden.has(l.name));
      let x = state.range || (chart.equal ? padded(whole, 0.04) : whole[0] === whole[1] ? padded(whole, 0.04) : whole);
      const spans = shown.flatMap((l) => (l.low ? [[l.low, l.x], [l.high, l.x]] : []).concat(l.area ? [] : [[l.y, l.x]]));
      const levels = chart.marks.filter((m) => m[2]).map((m) => m[0]);
      let y = padded(bounds(spans.concat(state.range ? [] : [[levels, []]]), null, state.range), 0.06);
      if (chart.equal) {
        const wide = (x[1] - x[0]) / Math.max(area.clientWidth - 80, 50), tall = (y[1] - y[0]) / Math.max(area.clientHeight - 48, 50);
        const grow = ([low, high], factor) => [(low + high) / 2 - (factor * (high - low)) / 2, (low + high) / 2 + (factor * (high - low)) / 2];
        if (wide > tall) y = grow(y, wide / tall); else x = grow(x, tall / wide);
      }
      frame = framed(area, chart, x, y);
      for (const line of shown) {
        const { px, py, inner } = frame;
        if (line.low) svg("path", { d: areaOf(line.x, line.low, line.high, px, py), fill: ink(line.colour), "fill-opacity": line.area ? 0.65 : 0.2 }, inner);
        if (line.area) continue;
        if (line.dots) {
          for (let i = 0; i < line.x.length; i += 1) if (Number.isFinite(line.y[i])) svg("circle", { cx: px(line.x[i]).toFixed(1), cy: py(line.y[i]).toFixed(1), r: 2, fill: ink(line.colour) }, inner);
        } else svg("path", { d: pathOf(line.x, line.y, px, py), fill: "none", stroke: ink(line.colour), "stroke-width": 1.6, "stroke-linejoin": "round", ...(line.dash ? { "stroke-dasharray": "6 4" } : {}) }, inner);
      }
      frame.range = x;
      area.replaceChildren(frame.root);
      interact(area, hint, frame, shown, state);
    };
    for (const line of lines.filter((l) => !l.quiet)) {
      const entry = html("button", "entry", legend);
      entry.type = "button";
      const swatch = html("span", `swatch${line.dash ? " dash" : ""}${line.dots ? " dots" : ""}`, entry);
      swatch.style.color = ink(line.colour);
      entry.append(line.name);
      entry.addEventListener("click", () => {
        if (hidden.has(line.name)) hidden.delete(line.name); else hidden.add(line.name);
        entry.classList.toggle("off", hidden.has(line.name));
        state.redraw();
      });
    }
    state.redraw();
    new ResizeObserver(() => state.redraw()).observe(area);
    charts.push(state);
  };

  const nearest = (xs, at) => {
    let best = -1, gap = Infinity;
    for (let i = 0; i < xs.length; i += 1) { const d = Math.abs(xs[i] - at); if (d < gap) { gap = d; best = i; } }
    return best;
  };
  const zoom = (state, range) => {
    for (const other of state.chart.time ? charts.filter((c) => c.chart.time) : [state]) { other.range = range; other.redraw(); }
  };
  const interact = (area, hint, frame, lines, state) => {
    const { root, box, px, range } = frame;
    const cursor = svg("line", { class: "cursor", y1: box.top, y2: box.bottom, visibility: "hidden" }, root);
    const brush = svg("rect", { class: "brush", y: box.top, height: box.bottom - box.top, visibility: "hidden" }, root);
    const value = (pixel) => range[0] + ((pixel - box.left) / (box.right - box.left)) * (range[1] - range[0]);
    const place = (event) => Math.min(Math.max(event.clientX - root.getBoundingClientRect().left, box.left), box.right);
    let from = null;
    root.addEventListener("pointerdown", (event) => { from = place(event); root.setPointerCapture(event.pointerId); });
    root.addEventListener("pointermove", (event) => {
      const at = place(event);
      if (from !== null) {
        brush.setAttribute("x", Math.min(from, at)); brush.setAttribute("width", Math.abs(at - from)); brush.setAttribute("visibility", "visible");
      }
      cursor.setAttribute("x1", at); cursor.setAttribute("x2", at); cursor.setAttribute("visibility", state.chart.equal ? "hidden" : "visible");
      hint.replaceChildren();
      if (state.chart.equal) return;
      html("div", "where", hint, `${figure(value(at), 5)}`);
      for (const line of lines.filter((l) => !l.quiet)) {
        const i = nearest(line.x, value(at));
        if (i < 0 || Math.abs(px(line.x[i]) - at) > 12) continue;
        const row = html("div", "", hint);
        html("span", "swatch", row).style.color = ink(line.colour);
        row.append(`${line.name}: ${figure(line.y[i])}`);
      }
      hint.style.visibility = "visible";
      hint.style.left = `${at > (box.left + box.right) / 2 ? at - hint.offsetWidth - 12 : at + 12}px`;
    });
    const leave = () => { cursor.setAttribute("visibility", "hidden"); hint.style.visibility = "hidden"; };
    root.addEventListener("pointerleave", leave);
    root.addEventListener("pointerup", (event) => {
      const at = place(event), start = from;
      from = null;
      brush.setAttribute("visibility", "hidden");
      if (start !== null && Math.abs(at - start) > 6) zoom(state, [value(Math.min(start, at)), value(Math.max(start, at))]);
    });
    root.addEventListener("dblclick", () => { leave(); zoom(state, null); });
  };

  const barChart = (plot, chart) => {
    const area = html("div", "canvas", plot);
    const scale = (v) => (chart.log ? Math.log10(Math.max(v, 1e-12)) : v);
    const redraw = () => {
      if (!sized(area)) return;
      const count = chart.bars.length;
      const marks = chart.marks.map(([at, label]) => [scale(at), label, false]);
      const ends = chart.bars.map((b) => [scale(Math.max(b.start, b.value + (b.error || 0))), b.text.length]);
      const { root, inner, box, px, py } = framed(area, { ...chart, marks }, chart.range, [count - 0.4, -0.9], { log: chart.log, rows: chart.bars.map((b) => b.label), ends });
      const half = Math.max((0.31 * (box.bottom - box.top)) / (count + 0.5), 1);
      chart.bars.forEach((bar, k) => {
        const [a, b] = [px(scale(bar.start)), px(scale(bar.value))], middle = py(k);
        const rect = svg("rect", { x: Math.min(a, b), y: middle - half, width: Math.max(Math.abs(b - a), 0.5), height: 2 * half, fill: bar.colour }, inner);
        svg("title", {}, rect, `${bar.label}: ${bar.text || figure(bar.value)}`);
        let end = Math.max(a, b);
        if (bar.error) {
          const [low, high] = [px(scale(bar.value - bar.error)), px(scale(bar.value + bar.error))];
          svg("path", { class: "error", d: `M${low} ${middle}H${high}M${low} ${middle - 4}V${middle + 4}M${high} ${middle - 4}V${middle + 4}` }, inner);
          end = Math.max(end, high);
        }
        svg("text", { class: "figure", x: end + 6, y: middle + 4 }, root, bar.text);
      });
      area.replaceChildren(root);
    };
    redraw();
    new ResizeObserver(redraw).observe(area);
  };

  const pending = new Map(page.charts.map((chart, k) => [document.getElementById(`chart-${k}`), chart]));
  const visible = (plot) => !plot.closest("details:not([open]), [hidden]");
  const drawVisible = () => pending.forEach((chart, plot) => {
    if (!visible(plot)) return;
    pending.delete(plot);
    plot.classList.add("drawn");
    (chart.bars ? barChart : lineChart)(plot, chart);
  });
  drawVisible();
  document.querySelectorAll("details").forEach((fold) => fold.addEventListener("toggle", drawVisible));
  document.querySelectorAll(".choice").forEach((choice) => choice.querySelector("select").addEventListener("change", (event) => {
    [...choice.children].filter((child) => child.classList.contains("panel")).forEach((panel, k) => { panel.hidden = k !== Number(event.target.value); });
    drawVisible();
  }));
})();
