"use strict";
// The charts of the explorer. uPlot draws the axes, the zoom and the cursor. The data are drawn here:
// samples closer than a pixel are drawn as the least and greatest value of each pixel column. Every drawing is a function of a
// canvas context, so that a picture of the page can also be made of vectors (vector.js).
window.nsdrill = (() => {
  const FAMILY = '"DejaVu Sans", Verdana, sans-serif', font = (size, weight = "") => `${weight}${size}px ${FAMILY}`, FONT = font(11), DIGIT = 7; // px: a digit of FONT
  const INK = "#1b1b1b", GRID = "#e8e8e8", BLUE = "#0072B2", VERMILLION = "#D55E00", REFERENCE = "#4D4D4D", DIFFERS = "#E8D47A";
  const MAX_MARKERS = 20000; // above, markers are drawn as squares
  const ratio = () => window.devicePixelRatio || 1;

  // Decode a reply (nsdrill/web/asked.py): the head, and the columns as arrays with a shape.
  function unpack(buffer) {
    const size = new DataView(buffer).getUint32(0, true);
    const head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, size)));
    const columns = {};
    for (const [name, { at, shape }] of Object.entries(head.columns)) {
      const count = shape.reduce((a, b) => a * b, 1);
      columns[name] = new Float32Array(buffer, 4 + size + 4 * at, count);
      columns[name].shape = shape;
    }
    return { head, columns };
  }

  // A new element with properties, attributes and listeners (names that begin with "on").
  function make(tag, properties = {}, ...children) {
    const node = document.createElement(tag);
    for (const [name, value] of Object.entries(properties)) {
      if (name === "class") node.className = value;
      else if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
      else if (name in node && name !== "list") node[name] = value;
      else node.setAttribute(name, value);
    }
    node.append(...children);
    return node;
  }

  // A number as text with `count` significant digits.
  function digits(value, count = 4) {
    if (!Number.isFinite(value)) return "–";
    if (value !== 0 && (Math.abs(value) >= 1e6 || Math.abs(value) < 1e-4)) return value.toExponential(count - 1);
    return String(Number(value.toPrecision(count)));
  }

  const amount = (value, unit, count) => `${digits(value, count)}${unit ? ` ${unit}` : ""}`;
  // The value number `i` of an axis `d`: with its unit, or the word of an axis of words.
  const valueOf = (d, i, count) => (d.texts ? d.texts[i] : amount(d.values[i], d.unit, count));
  // The ticks of an axis of words.
  const wordTicks = (d) => (d.texts ? { splits: () => [...d.values], values: () => d.texts, grid: { show: false } } : {});

  function limits(...arrays) {
    let low = Infinity, high = -Infinity;
    for (const array of arrays)
      for (const value of array)
        if (Number.isFinite(value)) {
          if (value < low) low = value;
          if (value > high) high = value;
        }
    return low <= high ? [low, high] : [0, 1];
  }

  // Whether values differ only by rounding, relative to their size or to one unit that is shown.
  const isConstant = (low, high) => high - low <= 1e-9 * Math.max(1, Math.abs(low), Math.abs(high));

  function padded([low, high], part = 0.05) {
    // A range below a thousandth of the values is widened: its last digits do not matter.
    const largest = Math.max(Math.abs(low), Math.abs(high));
    const room = isConstant(low, high) ? Math.max(0.02 * largest, 1e-3) : Math.max((high - low) * part, largest * 5e-4);
    return [low - room, high + room];
  }

  // The number of decimals of values that are a step apart; 7 for more than 6.
  function decimals(step) {
    let count = 0;
    while (count < 7 && Math.abs(step * 10 ** count - Math.round(step * 10 ** count)) > 1e-6 * step * 10 ** count) count += 1;
    return count;
  }

  // Ticks of a small axis: a round step of which at least three, or `least`, lie on the axis.
  function fewTicks(low, high, least = 3) {
    const power = 10 ** Math.floor(Math.log10((high - low) / (least + 0.2)));
    for (const part of [10, 5, 4, 3, 2.5, 2, 1, 0.5]) {
      const step = part * power, first = Math.ceil(low / step - 1e-9), count = Math.floor(high / step + 1e-9) - first + 1;
      if (count >= least) return Array.from({ length: count }, (_, k) => Number(((first + k) * step).toPrecision(12)));
    }
    return [low, high];
  }

  // A chart with axes. `o.x`, `o.y`: the ranges, read at every update; `o.draw(context, X, Y, plot)` draws in pixels of the
  // canvas; `o.over` draws on an overlay above it, which is cheap to redraw.
  function chart(box, o) {
    box.classList.add("chart");
    const overlay = make("canvas", { class: "over" });
    let ready = false;
    const data = () => [[o.x[0], o.x[1]], [o.y[0], o.y[1]]];
    const axis = (label, size, more) => ({
      label, size, labelSize: 16, labelGap: 0, gap: 3, font: FONT, labelFont: FONT, stroke: INK,
      grid: { stroke: GRID, width: 1 }, ticks: { stroke: "#999", width: 1, size: 4 }, ...more,
    });
    const ticks = (u, splits, which, space, step) => {
      const count = decimals(splits.length > 1 ? splits[1] - splits[0] : step);
      const texts = splits.map((value) => (value == null ? "" : count > 6 ? digits(value, 4) : value.toFixed(count)));
      if (!o.narrow || which || texts.length < 2) return texts;
      // below a small plane only as many as do not meet
      const width = u.bbox.width / devicePixelRatio || u.width, { min, max } = u.scales.x;
      const apart = width * Math.abs(splits[1] - splits[0]) / (max - min), longest = Math.max(...texts.map((text) => text.length));
      const every = Math.max(1, Math.ceil((DIGIT * longest + 8) / apart));
      return texts.map((text, k) => (k % every ? "" : text));
    };
    const numbers = (log) => (log ? {} : { values: ticks });
    const plot = new uPlot(
      {
        width: Math.max(120, box.clientWidth), height: o.height, legend: { show: false }, padding: [o.title ? 17 : 6, 18, o.bare ? 4 : 0, 0],
        cursor: {
          points: { show: false }, drag: { x: o.zoom !== false, y: false }, x: o.cross !== false, y: o.cross !== false,
          ...(o.sync ? { sync: { key: o.sync, scales: ["x", null] } } : {}),
        },
        scales: {
          x: { time: false, distr: o.log ? 3 : 1, range: (u, a, b) => (a == null || a === b ? o.x : [a, b]) },
          y: { range: () => o.y },
        },
        series: [{}, { points: { show: false }, paths: () => null }],
        axes: [
          axis(o.bare ? null : o.xlabel, o.bare ? 4 : 26, { space: 60, ...(o.bare ? { values: () => [] } : { ...numbers(o.log), ...(o.narrow ? { splits: (u, which, a, b) => fewTicks(a, b, 2) } : {}), ...o.xticks }) }),
          axis(o.bareY ? null : o.ylabel, o.bareY ? 8 : o.yticks && o.yticks.values ? 110 : o.ylabel ? 58 : 46, {
            space: 26, ...numbers(false), ...(o.low ? { splits: () => fewTicks(...o.y), font: font(10) } : {}), ...o.yticks, ...(o.bareY ? { values: () => [] } : {}),
          }),
        ],
        hooks: { draw: [draw], setSize: [fit], ready: [(u) => { fit(u); if (ready) over(); }] },
      },
      data(), box,
    );
    ready = true;
    const X = (value) => plot.valToPos(value, "x", true), Y = (value) => plot.valToPos(value, "y", true);
    function clipped(context, u, work) {
      const { left, top, width, height } = u.bbox;
      context.save();
      context.beginPath();
      context.rect(left, top, width, height);
      context.clip();
      work();
      context.restore();
    }
    function contents(c, u) { // all but the axes, in pixels of the canvas
      clipped(c, u, () => o.draw(c, (value) => u.valToPos(value, "x", true), (value) => u.valToPos(value, "y", true), u));
      if (!o.title) return;
      c.save();
      c.font = font(11 * ratio());
      c.fillStyle = INK;
      c.textAlign = "left";
      c.textBaseline = "alphabetic";
      c.fillText(o.title, u.bbox.left, u.bbox.top - 5 * ratio());
      c.restore();
    }
    function draw(u) {
      contents(u.ctx, u);
      box.dataset.ticks = (u.axes[1]._values || []).filter(Boolean).length; // for tests
      if (ready) over();
    }
    function fit(u) {
      const canvas = u.root.querySelector("canvas");
      overlay.width = canvas.width;
      overlay.height = canvas.height;
      overlay.style.width = canvas.style.width;
      overlay.style.height = canvas.style.height;
    }
    function over() {
      const context = overlay.getContext("2d");
      context.clearRect(0, 0, overlay.width, overlay.height);
      if (o.over) clipped(context, plot, () => o.over(context, X, Y, plot));
    }
    const self = {
      plot, over, X, Y,
      // For a picture: the size in pixels of the page, and the whole chart drawn on a context at its origin.
      size: () => [plot.width, plot.height],
      paint(c) {
        c.save();
        c.scale(1 / ratio(), 1 / ratio());
        axes(c, plot, o);
        contents(c, plot);
        if (o.over) clipped(c, plot, () => o.over(c, X, Y, plot));
        c.restore();
      },
      update() { plot.setData(data(), true); },
      resize() { if (box.clientWidth) plot.setSize({ width: Math.max(120, box.clientWidth), height: o.height }); },
      end() { observer.disconnect(); plot.destroy(); box.replaceChildren(); },
    };
    plot.root.append(overlay);
    let width = box.clientWidth;
    const observer = new ResizeObserver(() => {
      if (box.clientWidth && Math.abs(box.clientWidth - width) > 1) {
        width = box.clientWidth;
        self.resize();
      }
    });
    observer.observe(box);
    // A click that is not the end of a zoom.
    let pressed = null;
    plot.over.addEventListener("mousedown", (event) => { pressed = [event.clientX, event.clientY]; });
    plot.over.addEventListener("click", (event) => {
      if (o.click && pressed && Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) < 5)
        o.click(event.offsetX, event.offsetY, plot);
    });
    plot.over.addEventListener("mousemove", (event) => o.move && o.move(event.offsetX, event.offsetY, plot));
    plot.over.addEventListener("mouseleave", () => o.leave && o.leave());
    return self;
  }

  // Grid, ticks and labels as uPlot draws them on its canvas.
  function axes(c, u, o) {
    const dpr = ratio(), { left, top, width, height } = u.bbox, bottom = top + height;
    c.lineWidth = dpr;
    c.setLineDash([]);
    for (const [axis, scale] of [[u.axes[0], "x"], [u.axes[1], "y"]]) {
      const along = scale === "x", size = axis === u.axes[1] && o.low ? 10 : 11;
      c.font = font(size * dpr);
      c.textAlign = along ? "center" : "right";
      c.textBaseline = along ? "top" : "middle";
      (axis._splits || []).forEach((value, k) => {
        if (value == null) return;
        const at = u.valToPos(value, scale, true);
        if (along ? at < left - 1 || at > left + width + 1 : at < top - 1 || at > bottom + 1) return;
        const line = (colour, x0, y0, x1, y1) => {
          c.strokeStyle = colour;
          c.beginPath();
          c.moveTo(x0, y0);
          c.lineTo(x1, y1);
          c.stroke();
        };
        if (axis.grid.show !== false) along ? line(GRID, at, top, at, bottom) : line(GRID, left, at, left + width, at);
        along ? line("#999", at, bottom, at, bottom + 4 * dpr) : line("#999", left - 4 * dpr, at, left, at);
        c.fillStyle = INK;
        const words = String((axis._values || [])[k] ?? "");
        if (words) along ? c.fillText(words, at, bottom + 7 * dpr) : c.fillText(words, left - 7 * dpr, at);
      });
      c.font = FONT.replace("11", String(11 * dpr));
      c.textAlign = "center";
      c.fillStyle = INK;
      if (along && o.xlabel && !o.bare) c.fillText(o.xlabel, left + width / 2, bottom + 26 * dpr);
      if (!along && o.ylabel && !o.bareY) {
        c.save();
        c.translate(8 * dpr, top + height / 2);
        c.rotate(-Math.PI / 2);
        c.fillText(o.ylabel, 0, 0);
        c.restore();
      }
    }
  }

  // The outline of one marker around the origin as the path of a context.
  function outline(c, marker, size) {
    const r = size / 2, up = -Math.PI / 2;
    c.beginPath();
    const polygon = (n, angle0, radius, inner) => {
      for (let i = 0; i < n; i++) {
        const angle = angle0 + (2 * Math.PI * i) / n, reach = inner && i % 2 ? inner : radius;
        if (i) c.lineTo(reach * Math.cos(angle), reach * Math.sin(angle));
        else c.moveTo(reach * Math.cos(angle), reach * Math.sin(angle));
      }
      c.closePath();
    };
    const turned = { "^": up, v: -up, "<": Math.PI, ">": 0 };
    if (marker in turned) polygon(3, turned[marker], r * 1.15);
    else if (marker === "s") c.rect(-r * 0.85, -r * 0.85, r * 1.7, r * 1.7);
    else if (marker === "p") polygon(5, up, r * 1.1);
    else if (marker === "D") polygon(4, up, r * 1.1);
    else if (marker === "*") polygon(10, up, r * 1.3, r * 0.55);
    else if (marker === "P" || marker === "X" || marker === "x") {
      const a = r * (marker === "x" ? 0.18 : 0.38), b = r * 1.05, turn = marker === "P" ? 0 : Math.PI / 4;
      [[-a, -b], [a, -b], [a, -a], [b, -a], [b, a], [a, a], [a, b], [-a, b], [-a, a], [-b, a], [-b, -a], [-a, -a]].forEach(([x, y], i) => {
        const place = [x * Math.cos(turn) - y * Math.sin(turn), x * Math.sin(turn) + y * Math.cos(turn)];
        if (i) c.lineTo(...place);
        else c.moveTo(...place);
      });
      c.closePath();
    } else c.arc(0, 0, r * 0.95, 0, 2 * Math.PI);
  }

  // The picture of one marker, drawn once.
  const sprites = new Map();
  function sprite(marker, colour, filled, size) {
    const key = [marker, colour, filled, size].join();
    if (sprites.has(key)) return sprites.get(key);
    const full = Math.ceil(size * 1.5) + 2, canvas = make("canvas", { width: full, height: full });
    const c = canvas.getContext("2d");
    c.translate(full / 2, full / 2);
    c.fillStyle = c.strokeStyle = colour;
    c.lineWidth = Math.max(1, size / 6);
    outline(c, marker, size);
    if (filled) c.fill();
    else c.stroke();
    sprites.set(key, canvas);
    return canvas;
  }

  // A marker at a place. A context of vectors keeps markers as such.
  function mark(c, marker, colour, filled, size, x, y) {
    if (c.mark) { c.mark(marker, colour, filled, size, x, y); return; }
    const image = sprite(marker, colour, filled, size);
    c.drawImage(image, Math.round(x - image.width / 2), Math.round(y - image.height / 2));
  }

  // An entry of a legend: words after a drawing of 28 by 28 pixels. With `toggle` it is a button that switches what it names.
  function entry(words, draw, toggle) {
    const canvas = draw && make("canvas", { class: "swatch", width: 28, height: 28 });
    if (draw) {
      draw(canvas.getContext("2d"));
      canvas.paint = draw;
    }
    const parts = [...(draw ? [canvas] : []), words];
    if (!toggle) return make("li", {}, ...parts);
    const button = make("button", { type: "button", class: "toggle", "aria-pressed": "true", title: "Show or hide" }, ...parts);
    button.addEventListener("click", () => {
      const on = button.getAttribute("aria-pressed") !== "true";
      button.setAttribute("aria-pressed", String(on));
      toggle(on);
    });
    return make("li", {}, button);
  }
  const swatch = (marker, colour, words, filled = true, toggle = null) => entry(words, (c) => mark(c, marker, colour, filled, 16, 14, 14), toggle);
  const dash = (colour, words, dashes = [], toggle = null) =>
    entry(words, (c) => {
      c.strokeStyle = colour;
      c.lineWidth = 3;
      c.setLineDash(dashes);
      c.beginPath();
      c.moveTo(0, 14);
      c.lineTo(28, 14);
      c.stroke();
      c.setLineDash([]);
    }, toggle);

  // Peaks along an axis. `d`: head and columns of a diagram (nsdrill/web/diagrams.py). `o`: `visible` procedures, `live`
  // rings [[x, [values]]], `chosen` [procedure, point], and the listeners `move` and `pick`.
  function scatter(box, d, o) {
    const [P, N, K] = d.values.shape, xs = d.x.values;
    const visible = o.visible || Array(P).fill(true), hidden = o.hidden || new Set();
    let count = 0;
    for (const value of d.values) if (Number.isFinite(value)) count++;
    const open = (p) => d.procedures[p] === "down" && P > 1, small = (p) => d.procedures[p] === "same" && P > 1;
    const curve = d.curves && { x: d["curve x"], y: d["curve y"], unstable: d["curve unstable"] };
    let range = curve ? (N ? limits(d.values, curve.y) : limits(curve.y)) : limits(d.values);
    for (const line of d.lines || [])
      if (line.y[1] <= range[1] + 1.5 * (range[1] - range[0])) range = limits(range, line.y);
    const frame = {
      x: d.edges || padded(limits(xs)), y: padded(range), xlabel: d.x.label, ylabel: d.y.label, log: d.x.log, bare: o.bare, xticks: wordTicks(d.x),
      height: o.height || 260, sync: o.sync, cross: false,
      draw(c, X, Y, u) {
        const dpr = ratio();
        c.fillStyle = "#FFF3B8";
        for (const [a, b] of d.hysteresis || []) c.fillRect(X(a), u.bbox.top, X(b) - X(a), u.bbox.height);
        c.strokeStyle = REFERENCE;
        c.lineWidth = dpr;
        for (const line of d.lines || []) {
          c.setLineDash(isWall(line) ? [] : [5 * dpr, 3 * dpr]);
          c.beginPath();
          c.moveTo(X(xs[0]), Y(line.y[0]));
          c.lineTo(X(xs[N - 1]), Y(line.y[1]));
          c.stroke();
        }
        c.setLineDash([]);
        for (let p = 0; d.joined && p < P; p++) {
          c.strokeStyle = o.responses[d.outcome[p * N]].colour;
          c.beginPath();
          for (let i = 0; i < N; i++) c[i ? "lineTo" : "moveTo"](X(xs[i]), Y(d.values[p * N + i]));
          c.stroke();
        }
        const spacing = u.bbox.width / Math.max(N, 1);
        const size = Math.round(Math.min(Math.max(spacing * 0.9, 3.2 * dpr), 7 * dpr));
        for (let code = 0; code < o.responses.length; code++)
          for (let p = 0; p < P; p++) {
            if (!visible[p]) continue;
            const style = o.responses[code], many = count > MAX_MARKERS;
            c.fillStyle = style.colour;
            const dot = Math.max(1, Math.round(size / 2.2));
            for (let i = 0; i < N; i++) {
              if (d.outcome[p * N + i] !== code) continue;
              const x = X(xs[i]), begin = (p * N + i) * K;
              if (x < u.bbox.left - size || x > u.bbox.left + u.bbox.width + size) continue;
              if (d.constant && d.constant[p * N + i]) {
                const y = Y(d.values[begin]);
                c.fillRect(x - size * 0.8, y - dpr / 2, size * 1.6, Math.max(1, dpr));
                continue;
              }
              for (let k = 0; k < K; k++) {
                const value = d.values[begin + k];
                if (!(value === value)) continue;
                if (many) c.fillRect(Math.round(x - dot / 2), Math.round(Y(value) - dot / 2), dot, dot);
                else mark(c, style.marker, style.colour, !open(p), small(p) ? 0.55 * size : size, x, Y(value));
              }
            }
          }
        c.strokeStyle = "#000";
        c.lineWidth = dpr;
        for (let p = 0; p < P; p++)
          for (let i = 0; i < N; i++)
            if (d.outcome[p * N + i] <= -2 && visible[p]) {
              const x = X(xs[i]), y = u.bbox.top + u.bbox.height - 6 * dpr, r = 3 * dpr;
              c.beginPath();
              if (d.outcome[p * N + i] === -3) {
                c.moveTo(x - r, y); c.lineTo(x + r, y);
              } else {
                c.moveTo(x - r, y - r); c.lineTo(x + r, y + r);
                c.moveTo(x + r, y - r); c.lineTo(x - r, y + r);
              }
              c.stroke();
            }
        if (curve) branches(c, X, Y, u);
      },
      over(c, X, Y, u) {
        const dpr = ratio();
        if (o.chosen) {
          const x = X(o.chosen[0] < 0 ? o.chosen[1] : xs[o.chosen[1]]);
          c.strokeStyle = "#000";
          c.lineWidth = 1.5 * dpr;
          c.setLineDash([2 * dpr, 2 * dpr]);
          c.beginPath();
          c.moveTo(x, u.bbox.top);
          c.lineTo(x, u.bbox.top + u.bbox.height);
          c.stroke();
          c.setLineDash([]);
        }
        for (const [x, values] of o.live || []) {
          c.strokeStyle = "#000";
          c.lineWidth = 1.4 * dpr;
          for (const value of values) {
            c.beginPath();
            c.arc(X(x), Y(value), 4 * dpr, 0, 2 * Math.PI);
            c.stroke();
          }
        }
      },
      move(px, py, u) { o.move && o.move(nearest(px, py, u)); },
      click(px, py, u) { const hit = nearest(px, py, u); if (hit) o.pick(hit); },
    };
    // Branches: solid where stable, dashed where not, dotted where that is not decided, in the colour of their kind; a marker at each special point.
    function branches(c, X, Y, u) {
      const dpr = ratio();
      let first = 0;
      d.curves.sizes.forEach((size, branch) => {
        if (shownKind(branch)) {
          c.strokeStyle = d.curves.kinds[d.curves.kind[branch]].colour;
          for (const kind of ["stable", "unstable", OPEN]) {
            c.lineWidth = (kind === "unstable" ? 1.2 : 1.8) * dpr;
            c.setLineDash(DASHES[kind].map((one) => one * dpr));
            c.beginPath();
            let pen = false; // a segment is one line: its dashes continue from point to point
            for (let i = first; i + 1 < first + size; i++) {
              if (stabilityOf(curve.unstable[i], curve.unstable[i + 1]) === kind) {
                if (!pen) c.moveTo(X(curve.x[i]), Y(curve.y[i]));
                c.lineTo(X(curve.x[i + 1]), Y(curve.y[i + 1]));
                pen = true;
              } else pen = false;
            }
            c.stroke();
          }
        }
        first += size;
      });
      c.setLineDash([]);
      for (const [i, which] of d.curves.special) {
        const style = d.curves.marks[which];
        if (!shownKind(branchOf(d, i)) || hidden.has(style.name)) continue;
        mark(c, style.marker, "#fff", true, 11 * dpr, X(curve.x[i]), Y(curve.y[i]));
        mark(c, style.marker, style.colour, true, 8 * dpr, X(curve.x[i]), Y(curve.y[i]));
      }
    }
    function shownKind(branch) { return !hidden.has(d.curves.kinds[d.curves.kind[branch]].name); }
    // The peak nearest to a position in the plot; where none is near, the nearest point along the axis.
    function nearest(px, py, u) {
      let best = null, least = Infinity, column = null, gap = Infinity;
      for (let i = 0; i < N; i++) {
        const dx = u.valToPos(xs[i], "x") - px;
        if (Math.abs(dx) < gap) { gap = Math.abs(dx); column = i; }
        if (Math.abs(dx) > 14) continue;
        for (let p = 0; p < P; p++) {
          if (!visible[p] || d.outcome[p * N + i] < 0) continue;
          for (let k = 0; k < K; k++) {
            const value = d.values[(p * N + i) * K + k];
            if (!(value === value)) continue;
            const dy = u.valToPos(value, "y") - py, far = dx * dx + dy * dy;
            if (far < least) { least = far; best = { p, i, value }; }
          }
        }
      }
      if (curve)
        for (let i = 0; i < curve.x.length; i++) {
          if (!shownKind(branchOf(d, i))) continue;
          const dx = u.valToPos(curve.x[i], "x") - px, dy = u.valToPos(curve.y[i], "y") - py, far = dx * dx + dy * dy;
          if (far < (N ? 100 : Infinity) && far <= least) { least = far; best = { curve: i, value: curve.y[i], at: curve.x[i] }; }
        }
      if (best) return best;
      if (column === null) return null;
      let p = visible.indexOf(true);
      return p < 0 ? null : { p, i: column, value: d.values[(p * N + column) * K] };
    }
    const base = chart(box, frame);
    return {
      ...base,
      choose(p, i) { o.chosen = [p, i]; base.over(); },
      show(list) { list.forEach((on, p) => { visible[p] = on; }); base.plot.redraw(); },
      redraw() { base.plot.redraw(); },
      live(rings) { o.live = rings; base.over(); },
    };
  }

  // The branch of a point of the curves; its branch, stability and label in words.
  function branchOf(d, i) {
    let first = 0, number = 0;
    while (i >= first + d.curves.sizes[number]) first += d.curves.sizes[number++];
    return number;
  }
  // The stability of a piece of a branch between points with so many unstable directions, -1 where that is not decided.
  const OPEN = "stability not decided", DASHES = { stable: [], unstable: [4, 3], [OPEN]: [1.5, 2.5] };
  function stabilityOf(before, after) {
    return before > 0 || after > 0 ? "unstable" : before < 0 || after < 0 ? OPEN : "stable";
  }
  function branchWords(d, i) {
    const number = branchOf(d, i), special = d.curves.special.find(([at]) => at === i), count = d["curve unstable"][i];
    const stability = count < 0 ? OPEN : count ? `unstable in ${count} direction${count > 1 ? "s" : ""}` : "stable";
    return `branch ${number}, ${d.curves.kinds[d.curves.kind[number]].name}, ${stability}${special ? `: ${d.curves.marks[special[1]].name}` : ""}`;
  }

  // The legend of diagrams `all` of one sweep. With `hidden`, a set of names, the kinds of branches and of special points are
  // switched on and off by it; `redraw` is called then. The words are those of the `meta` of the page.
  function legendOf(all, { responses, unknown }, hidden, redraw) {
    const d = all[0], codes = new Set(all.flatMap((one) => [...one.outcome]));
    if (!d) return [];
    const items = responses.filter((_, code) => codes.has(code)).map((style) => swatch(style.marker, style.colour, style.name));
    if (d.procedures.includes("down") && d.procedures.length > 1)
      items.push(...d.ways.map((way, p) => swatch("o", REFERENCE, ...(d.procedures[p] === "down" ? [`${way}: open`, false] : [`${way}: ${d.procedures[p] === "same" ? "small" : "filled"}`]))));
    if (d.hysteresis.length) items.push(swatch("s", DIFFERS, `${d.ways.filter((_, p) => d.procedures[p] !== "same").join(" and ")} differ in response`));
    if (d.curves) {
      const toggle = (name) => hidden && ((on) => { hidden[on ? "delete" : "add"](name); redraw(); });
      for (const kind of d.curves.kinds) items.push(dash(kind.colour, kind.name, [], toggle(kind.name)));
      for (const style of d.curves.marks) items.push(swatch(style.marker, style.colour, style.name, true, toggle(style.name)));
      items.push(dash("#000", "stable"), dash("#000", "unstable", [6, 4]));
      if (all.some((one) => one["curve unstable"]?.some((count) => count < 0))) items.push(dash("#000", OPEN, DASHES[OPEN]));
    }
    for (const line of new Map(all.flatMap((one) => one.lines || []).map((one) => [one.words, one])).values())
      items.push(dash(REFERENCE, line.words, isWall(line) ? [] : [8, 4]));
    for (const words of [d.note, d.inferred]) if (words) items.push(make("li", {}, words));
    if (codes.has(-1)) items.push(make("li", {}, `blank: ${unknown[-1]}`));
    if (codes.has(-2)) items.push(swatch("X", "#000", unknown[-2]));
    if (codes.has(-3)) items.push(dash("#000", unknown[-3]));
    return items;
  }

  // The legend of maps: the classes that occur, or five values of the colour map.
  function mapLegendOf(d, { unknown }) {
    const values = new Set(d.values);
    const items = d.classes
      ? d.classes.filter((_, code) => values.has(code)).map((style) => (style.stripes ? entry(style.name, (c) => {
        mark(c, "s", style.colour, true, 16, 14, 14);
        striped(c, style.stripes, 7, 7, 14, 14, 6);
      }) : swatch("s", style.colour, style.name)))
      : [0, 0.25, 0.5, 0.75, 1].map((part) => swatch("s", colourOf(d, d.limits[0] + part * (d.limits[1] - d.limits[0])), amount(d.limits[0] + part * (d.limits[1] - d.limits[0]), d.colour.unit, 3)));
    if (d.outcome.includes(-1)) items.push(make("li", {}, `blank: ${unknown[-1]}`));
    if (d.outcome.includes(-2)) items.push(swatch("X", "#000", unknown[-2]));
    if (d.outcome.includes(-3)) items.push(swatch("X", "#000", unknown[-3]));
    if (d.inferred) items.push(make("li", {}, d.inferred));
    if (d.silent) items.push(swatch("s", d.silent.colour, d.silent.name));
    if (d.open && d.open.some((one) => one > 0))
      items.push(entry(d.open_words, (c) => {
        mark(c, "s", "#fff", true, 16, 14, 14);
        striped(c, "#000", 7, 7, 14, 14, 6);
      }));
    return items;
  }

  // Classes or values over two axes. Values have the colours of the `scale` of a map, by default viridis; those of differences go
  // from violet over white to orange.
  const VIRIDIS = ["#440154", "#46327e", "#365c8d", "#277f8e", "#1fa187", "#4ac16d", "#a0da39", "#fde725"];
  const DIFFERENCES = ["#2d004b", "#8073ac", "#d8daeb", "#f7f7f7", "#fee0b6", "#e08214", "#7f3b08"];
  function shade(scale, part) {
    const at = Math.min(Math.max(part, 0), 1) * (scale.length - 1), i = Math.min(Math.floor(at), scale.length - 2), f = at - i;
    const rgb = (hex, k) => parseInt(hex.slice(1 + 2 * k, 3 + 2 * k), 16);
    return `rgb(${[0, 1, 2].map((k) => Math.round(rgb(scale[i], k) * (1 - f) + rgb(scale[i + 1], k) * f)).join()})`;
  }
  // Stripes over a cell.
  function striped(c, colour, left, top, width, height, apart) {
    c.save();
    c.beginPath();
    c.rect(left, top, width, height);
    c.clip();
    c.strokeStyle = colour;
    c.lineWidth = apart / 2.5;
    c.setLineDash([]);
    c.beginPath();
    for (let at = Math.floor((left - top - height) / apart) * apart; at < left + width - top; at += apart) {
      c.moveTo(at + top, top);
      c.lineTo(at + top + height, top + height);
    }
    c.stroke();
    c.restore();
  }
  function colourOf(d, value) {
    if (!(value === value)) return null;
    if (d.classes) return d.classes[value] ? d.classes[value].colour : null;
    const [low, high] = d.limits;
    return shade(d.scale || VIRIDIS, (value - low) / (high - low || 1));
  }

  // The lines of reference of a diagram are dashed, but for the wall of the hole.
  const isWall = (line) => line.words.startsWith("wall");

  // Where two procedures of a map differ: of classes yes or no, of numbers the second less the first.
  function difference(d, a, b) {
    const n = d.values.length / d.procedures.length, values = new Float32Array(n), outcome = new Float32Array(n);
    let largest = 0;
    for (let k = 0; k < n; k++) {
      const [one, two] = [a, b].map((p) => (d.outcome[p * n + k] < 0 ? NaN : d.values[p * n + k]));
      values[k] = d.classes ? (one === one && two === two ? Number(one !== two) : NaN) : two - one;
      if (Math.abs(values[k]) > largest) largest = Math.abs(values[k]);
    }
    values.shape = outcome.shape = [1, ...d.values.shape.slice(1)];
    const classes = d.classes && [{ name: "no difference", colour: "#EDEDED" }, { name: "they differ", colour: DIFFERS }];
    return { ...d, values, outcome, procedures: [d.classes ? `where ${d.ways[a]} and ${d.ways[b]} differ` : `${d.ways[b]} less ${d.ways[a]}`], classes, limits: [-largest, largest], scale: DIFFERENCES, silent: null };
  }

  // A map of the panel `o.panel` of `d`; a line goes around the cells where `o.safe` [ny, nx] is 1.
  function cells(box, d, o) {
    const [, ny, nx] = d.values.shape, xe = d.x_edges, ye = d.y_edges, p = o.panel || 0;
    const frame = {
      x: [xe[0], xe[nx]], y: [ye[0], ye[ny]], xlabel: d.x.label, ylabel: d.y.label, log: d.x.log, height: o.height || 460,
      xticks: wordTicks(d.x), yticks: wordTicks(d.y), title: o.title, bareY: o.bareY,
      cross: false, zoom: true,
      draw(c, X, Y) {
        for (let j = 0; j < ny; j++)
          for (let i = 0; i < nx; i++) {
            const at = (p * ny + j) * nx + i, colour = colourOf(d, d.values[at]);
            const left = Math.floor(X(xe[i])), top = Math.floor(Y(ye[j + 1]));
            const width = Math.ceil(X(xe[i + 1])) - left, height = Math.ceil(Y(ye[j])) - top;
            if (colour) {
              c.fillStyle = colour;
              c.fillRect(left, top, width, height);
              if (d.classes && d.classes[d.values[at]].stripes) striped(c, d.classes[d.values[at]].stripes, left, top, width, height, 7 * ratio());
              if (d.open && d.open[at]) striped(c, "#000", left, top, width, height, 7 * ratio());
            } else if (d.silent && d.outcome[at] >= 0) { // the bit is stalled, and the value says nothing
              c.fillStyle = d.silent.colour;
              c.fillRect(left, top, width, height);
            } else if (d.outcome[at] <= -2) {
              c.strokeStyle = "#000";
              c.lineWidth = 1;
              c.beginPath();
              c.moveTo(left, top); c.lineTo(left + width, top + height);
              c.moveTo(left + width, top); c.lineTo(left, top + height);
              c.stroke();
            }
          }
        if (!o.safe) return;
        for (const [colour, wide] of [["#fff", 4.5], ["#000", 2]]) {
          c.strokeStyle = colour;
          c.lineWidth = wide * ratio();
          c.setLineDash([]);
          c.beginPath();
          for (let j = 0; j < ny; j++)
            for (let i = 0; i < nx; i++) {
              if (i + 1 < nx && o.safe[j * nx + i] !== o.safe[j * nx + i + 1]) { c.moveTo(X(xe[i + 1]), Y(ye[j])); c.lineTo(X(xe[i + 1]), Y(ye[j + 1])); }
              if (j + 1 < ny && o.safe[j * nx + i] !== o.safe[(j + 1) * nx + i]) { c.moveTo(X(xe[i]), Y(ye[j + 1])); c.lineTo(X(xe[i + 1]), Y(ye[j + 1])); }
            }
          c.stroke();
        }
      },
      over(c, X, Y) {
        if (!o.chosen) return;
        const [i, j] = o.chosen, dpr = ratio();
        for (const [colour, width] of [["#fff", 4], ["#000", 1.6]]) {
          c.strokeStyle = colour;
          c.lineWidth = width * dpr;
          c.strokeRect(X(xe[i]), Y(ye[j + 1]), X(xe[i + 1]) - X(xe[i]), Y(ye[j]) - Y(ye[j + 1]));
        }
      },
      move(px, py, u) { o.move && o.move(cell(px, py, u)); },
      click(px, py, u) { const hit = cell(px, py, u); if (hit) o.pick(hit); },
    };
    const place = (values, value) => {
      for (let i = 0; i + 1 < values.length; i++) if (value >= values[i] && value <= values[i + 1]) return i;
      return -1;
    };
    function cell(px, py, u) {
      const i = place(xe, u.posToVal(px, "x")), j = place(ye, u.posToVal(py, "y"));
      return i < 0 || j < 0 ? null : { p, i, j, value: d.values[(p * ny + j) * nx + i], outcome: d.outcome[(p * ny + j) * nx + i] };
    }
    const base = chart(box, frame);
    return { ...base, choose(i, j) { o.chosen = [i, j]; base.over(); } };
  }

  // A time series: the least and greatest value of each pixel column where samples are closer than pixels.
  function timeSeries(c, X, Y, time, values, u, colour) {
    const dpr = ratio(), n = time.length, left = u.bbox.left, right = left + u.bbox.width;
    c.strokeStyle = colour;
    c.lineWidth = dpr;
    c.lineJoin = "round";
    c.beginPath();
    const a = u.scales.x.min, b = u.scales.x.max, step = n > 1 ? (time[n - 1] - time[0]) / (n - 1) : 1;
    const first = Math.max(0, Math.floor((a - time[0]) / step) - 1), last = Math.min(n - 1, Math.ceil((b - time[0]) / step) + 1);
    if (last - first < 2 * (right - left)) {
      let pen = false;
      for (let i = first; i <= last; i++) {
        if (!(values[i] === values[i])) { pen = false; continue; }
        if (pen) c.lineTo(X(time[i]), Y(values[i]));
        else c.moveTo(X(time[i]), Y(values[i]));
        pen = true;
      }
    } else {
      let column = -1, low = Infinity, high = -Infinity, before = NaN;
      const flush = () => {
        if (low > high) return;
        c.moveTo(column + 0.5, Y(low) + 0.5);
        c.lineTo(column + 0.5, Y(high) - 0.5);
      };
      for (let i = first; i <= last; i++) {
        const pixel = Math.round(X(time[i]));
        if (pixel !== column) { // starting from the last value of the column before: the line has no gaps
          flush();
          column = pixel;
          low = before === before ? before : Infinity;
          high = before === before ? before : -Infinity;
        }
        before = values[i];
        if (before < low) low = before;
        if (before > high) high = before;
      }
      flush();
    }
    c.stroke();
  }

  // A line through samples, broken at NaN.
  function path(c, X, Y, xs, ys, colour, width) {
    c.strokeStyle = colour;
    c.lineWidth = width * ratio();
    c.lineJoin = "round";
    c.beginPath();
    let pen = false;
    for (let i = 0; i < xs.length; i++) {
      if (!(xs[i] === xs[i] && ys[i] === ys[i])) { pen = false; continue; }
      if (pen) c.lineTo(X(xs[i]), Y(ys[i]));
      else c.moveTo(X(xs[i]), Y(ys[i]));
      pen = true;
    }
    c.stroke();
  }

  // The returns to a Poincaré section, as points in planes.
  function section(box, reply) {
    box.replaceChildren(make("p", { class: "read" }, reply.head.words));
    const home = make("div", { class: "planes" });
    box.append(home);
    for (const [across, up] of reply.head.planes) {
      const xs = reply.columns[across.name], ys = reply.columns[up.name], place = make("div");
      home.append(place);
      const range = (values) => {
        const [low, high] = limits(values), middle = (low + high) / 2, half = Math.max((high - low) * 0.55, 0.01 * Math.max(Math.abs(low), Math.abs(high)), isConstant(low, high) ? 1e-3 : 0);
        return [middle - half, middle + half];
      };
      chart(place, {
        x: range(xs), y: range(ys), xlabel: across.label, ylabel: up.label, height: 190, zoom: false, cross: false,
        draw(c, X, Y) {
          c.fillStyle = BLUE;
          for (let i = 0; i < xs.length; i++)
            if (xs[i] === xs[i]) {
              c.beginPath();
              c.arc(X(xs[i]), Y(ys[i]), 2 * ratio(), 0, 2 * Math.PI);
              c.fill();
            }
        },
      });
    }
  }

  // The last local maxima of samples, as the peaks of a diagram.
  function peaks(values, limit = 64) {
    const maxima = [];
    for (let i = values.length - 2; i > 0 && maxima.length < limit; i--)
      if (values[i] > values[i - 1] && values[i] >= values[i + 1]) maxima.push(values[i]);
    return maxima;
  }

  return {
    FAMILY, font, INK, BLUE, VERMILLION, REFERENCE, ratio, branchWords, branchOf, unpack, make, digits, decimals, amount, valueOf, limits, padded,
    chart, scatter, cells, difference, dash, legendOf, mapLegendOf, section, outline, peaks, timeSeries, path, fewTicks,
  };
})();
