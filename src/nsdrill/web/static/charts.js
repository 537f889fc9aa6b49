"use strict";
// The charts of the explorer and of the report. uPlot draws the axes, the zoom and the cursor. The data are drawn here:
// samples closer than a pixel are drawn as the least and greatest value of each pixel column.
window.nsdrill = (() => {
  const FONT = '11px "DejaVu Sans", Verdana, sans-serif';
  const INK = "#1b1b1b", GRID = "#e8e8e8", BLUE = "#0072B2", VERMILLION = "#D55E00", REFERENCE = "#4D4D4D";
  const MAX_MARKERS = 20000; // above, markers are drawn as squares
  const ratio = () => window.devicePixelRatio || 1;

  // Decode a reply (nsdrill/web/packet.py): the head, and the columns as arrays with a shape.
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
      const count = decimals(step);
      return splits.map((value) => (value == null ? "" : count > 6 ? digits(value, 4) : value.toFixed(count)));
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
          axis(o.bare ? null : o.xlabel, o.bare ? 4 : 26, { space: 60, ...(o.bare ? { values: () => [] } : { ...numbers(o.log), ...o.xticks }) }),
          axis(o.ylabel, o.yticks && o.yticks.values ? 110 : 58, { space: 26, ...numbers(false), ...o.yticks }),
        ],
        hooks: { draw: [draw], setSize: [fit], ready: [(u) => { fit(u); if (ready) over(); }] },
      },
      data(), box,
    );
    ready = true;
    const X = (value) => plot.valToPos(value, "x", true), Y = (value) => plot.valToPos(value, "y", true);
    function clipped(context, work) {
      const { left, top, width, height } = plot.bbox;
      context.save();
      context.beginPath();
      context.rect(left, top, width, height);
      context.clip();
      work();
      context.restore();
    }
    function draw(u) {
      const at = (value) => u.valToPos(value, "x", true), up = (value) => u.valToPos(value, "y", true);
      const { left, top, width, height } = u.bbox;
      u.ctx.save();
      u.ctx.beginPath();
      u.ctx.rect(left, top, width, height);
      u.ctx.clip();
      o.draw(u.ctx, at, up, u);
      u.ctx.restore();
      if (o.title) {
        u.ctx.save();
        u.ctx.font = `${11 * ratio()}px "DejaVu Sans", Verdana, sans-serif`;
        u.ctx.fillStyle = INK;
        u.ctx.textAlign = "left";
        u.ctx.textBaseline = "alphabetic";
        u.ctx.fillText(o.title, left, top - 5 * ratio());
        u.ctx.restore();
      }
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
      if (o.over) clipped(context, () => o.over(context, X, Y, plot));
    }
    const self = {
      plot, over, X, Y,
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

  // The picture of one marker, drawn once.
  const sprites = new Map();
  function sprite(marker, colour, filled, size) {
    const key = [marker, colour, filled, size].join();
    if (sprites.has(key)) return sprites.get(key);
    const full = Math.ceil(size * 1.5) + 2, canvas = make("canvas", { width: full, height: full });
    const c = canvas.getContext("2d"), r = size / 2;
    c.translate(full / 2, full / 2);
    c.fillStyle = c.strokeStyle = colour;
    c.lineWidth = Math.max(1, size / 6);
    c.beginPath();
    const polygon = (n, angle0, radius, inner) => {
      for (let i = 0; i < n; i++) {
        const angle = angle0 + (2 * Math.PI * i) / n, reach = inner && i % 2 ? inner : radius;
        c.lineTo(reach * Math.cos(angle), reach * Math.sin(angle));
      }
      c.closePath();
    };
    const up = -Math.PI / 2;
    if (marker === "^") polygon(3, up, r * 1.15);
    else if (marker === "s") c.rect(-r * 0.85, -r * 0.85, r * 1.7, r * 1.7);
    else if (marker === "p") polygon(5, up, r * 1.1);
    else if (marker === "D") polygon(4, up, r * 1.1);
    else if (marker === "*") polygon(10, up, r * 1.3, r * 0.55);
    else if (marker === "P" || marker === "X") {
      c.rotate(marker === "X" ? Math.PI / 4 : 0);
      const a = r * 0.38, b = r * 1.05;
      for (const [x, y] of [[-a, -b], [a, -b], [a, -a], [b, -a], [b, a], [a, a], [a, b], [-a, b], [-a, a], [-b, a], [-b, -a], [-a, -a]])
        c.lineTo(x, y);
      c.closePath();
    } else c.arc(0, 0, r * 0.95, 0, 2 * Math.PI);
    if (filled) c.fill();
    else c.stroke();
    sprites.set(key, canvas);
    return canvas;
  }

  function swatch(marker, colour, filled = true) {
    const canvas = make("canvas", { class: "swatch", width: 28, height: 28 });
    const image = sprite(marker, colour, filled, 16);
    canvas.getContext("2d").drawImage(image, (28 - image.width) / 2, (28 - image.height) / 2);
    return canvas;
  }

  // Peaks along an axis. `d`: head and columns of a diagram (nsdrill/web/diagrams.py). `o`: `visible` procedures, `live`
  // rings [[x, [values]]], `chosen` [procedure, point], and the listeners `move` and `pick`.
  function scatter(box, d, o) {
    const [P, N, K] = d.values.shape, xs = d.x.values;
    const visible = o.visible || Array(P).fill(true);
    let count = 0;
    for (const value of d.values) if (Number.isFinite(value)) count++;
    const open = (p) => d.procedures[p] === "down" && P > 1;
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
          c.setLineDash(line.words === "rotary speed" ? [5 * dpr, 3 * dpr] : []);
          c.beginPath();
          c.moveTo(X(xs[0]), Y(line.y[0]));
          c.lineTo(X(xs[N - 1]), Y(line.y[1]));
          c.stroke();
        }
        c.setLineDash([]);
        const spacing = u.bbox.width / Math.max(N, 1);
        const size = Math.round(Math.min(Math.max(spacing * 0.9, 3.2 * dpr), 7 * dpr));
        for (let code = 0; code < o.responses.length; code++)
          for (let p = 0; p < P; p++) {
            if (!visible[p]) continue;
            const style = o.responses[code], many = count > MAX_MARKERS;
            const marker = sprite(style.marker, style.colour, !open(p), size), half = marker.width / 2;
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
                else c.drawImage(marker, Math.round(x - half), Math.round(Y(value) - half));
              }
            }
          }
        c.strokeStyle = "#000";
        c.lineWidth = dpr;
        for (let p = 0; p < P; p++)
          for (let i = 0; i < N; i++)
            if (d.outcome[p * N + i] === -2 && visible[p]) {
              const x = X(xs[i]), y = u.bbox.top + u.bbox.height - 6 * dpr, r = 3 * dpr;
              c.beginPath();
              c.moveTo(x - r, y - r); c.lineTo(x + r, y + r);
              c.moveTo(x + r, y - r); c.lineTo(x - r, y + r);
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
    // Branches: solid where stable, dashed where not; circles and words at the special points.
    function branches(c, X, Y, u) {
      const dpr = ratio();
      let first = 0;
      c.strokeStyle = "#000";
      for (const size of d.curves.sizes) {
        for (const stable of [true, false]) {
          c.lineWidth = (stable ? 1.8 : 1.2) * dpr;
          c.setLineDash(stable ? [] : [4 * dpr, 3 * dpr]);
          c.beginPath();
          let pen = false; // a segment is one line: its dashes continue from point to point
          for (let i = first; i + 1 < first + size; i++) {
            if ((curve.unstable[i] === 0 && curve.unstable[i + 1] === 0) === stable) {
              if (!pen) c.moveTo(X(curve.x[i]), Y(curve.y[i]));
              c.lineTo(X(curve.x[i + 1]), Y(curve.y[i + 1]));
              pen = true;
            } else pen = false;
          }
          c.stroke();
        }
        first += size;
      }
      c.setLineDash([]);
      c.font = `bold ${10 * dpr}px "DejaVu Sans", Verdana, sans-serif`;
      c.textAlign = "left";
      const written = []; // places of words, which cover no other word and no point
      const points = d.curves.special.map(([i]) => [X(curve.x[i]), Y(curve.y[i])]);
      for (const [i, words] of d.curves.special) {
        c.fillStyle = "#fff";
        c.strokeStyle = "#000";
        c.lineWidth = 1.4 * dpr;
        c.beginPath();
        c.arc(X(curve.x[i]), Y(curve.y[i]), 3.6 * dpr, 0, 2 * Math.PI);
        c.fill();
        c.stroke();
        const place = [X(curve.x[i]), Y(curve.y[i])];
        const wide = c.measureText(words).width, high = 11 * dpr, near = 6 * dpr;
        const box = [[1, -1], [1, 1], [-1, -1], [-1, 1]]
          .map(([across, up]) => [place[0] + (across > 0 ? near : -near - wide), place[1] + (up < 0 ? -near - high + 2 * dpr : near - 2 * dpr)])
          .find(([x, y]) =>
            x > u.bbox.left && x + wide < u.bbox.left + u.bbox.width && y > u.bbox.top && y + high < u.bbox.top + u.bbox.height &&
            !written.some(([a, b, w]) => x < a + w + near && a < x + wide + near && Math.abs(y - b) < high + dpr) &&
            !points.some(([a, b]) => a > x - 3 * dpr && a < x + wide + 3 * dpr && b > y - 3 * dpr && b < y + high + 3 * dpr));
        if (!box) continue; // no room: the words are shown at the pointer
        written.push([...box, wide]);
        c.lineWidth = 3 * dpr;
        c.strokeStyle = "rgba(255, 255, 255, 0.85)";
        c.strokeText(words, box[0], box[1] + 0.85 * high);
        c.fillStyle = "#000";
        c.fillText(words, box[0], box[1] + 0.85 * high);
      }
    }
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
      live(rings) { o.live = rings; base.over(); },
    };
  }

  // The branch and the stability of a point of the curves, in words.
  function branchWords(d, i) {
    let first = 0, number = 0;
    while (i >= first + d.curves.sizes[number]) first += d.curves.sizes[number++];
    const special = d.curves.special.find(([at]) => at === i), count = d["curve unstable"][i];
    const stability = count ? `unstable in ${count} direction${count > 1 ? "s" : ""}` : "stable";
    return `branch ${number}, ${d.curves.names[number]}, ${stability}${special ? `: ${special[1]}` : ""}`;
  }

  // The legend entries for the reference lines of a diagram.
  function lineEntries(d) {
    return (d.lines || []).map((line) => {
      const canvas = make("canvas", { class: "swatch", width: 28, height: 28 }), c = canvas.getContext("2d");
      c.strokeStyle = REFERENCE;
      c.lineWidth = 2;
      c.setLineDash(line.words === "rotary speed" ? [8, 4] : []);
      c.beginPath();
      c.moveTo(0, 14);
      c.lineTo(28, 14);
      c.stroke();
      return make("li", {}, canvas, line.words);
    });
  }

  // Classes or values over two axes; the colour map is viridis.
  const VIRIDIS = ["#440154", "#46327e", "#365c8d", "#277f8e", "#1fa187", "#4ac16d", "#a0da39", "#fde725"];
  function viridis(part) {
    const at = Math.min(Math.max(part, 0), 1) * (VIRIDIS.length - 1), i = Math.min(Math.floor(at), VIRIDIS.length - 2), f = at - i;
    const rgb = (hex, k) => parseInt(hex.slice(1 + 2 * k, 3 + 2 * k), 16);
    return [0, 1, 2].map((k) => Math.round(rgb(VIRIDIS[i], k) * (1 - f) + rgb(VIRIDIS[i + 1], k) * f));
  }
  function colourOf(d, value) {
    if (!(value === value)) return null;
    if (d.classes) return d.classes[value] ? d.classes[value].colour : null;
    const [low, high] = d.limits;
    return `rgb(${viridis((value - low) / (high - low || 1)).join()})`;
  }
  function cells(box, d, o) {
    const [, ny, nx] = d.values.shape, xe = d.x_edges, ye = d.y_edges, p = o.procedure;
    const frame = {
      x: [xe[0], xe[nx]], y: [ye[0], ye[ny]], xlabel: d.x.label, ylabel: d.y.label, log: d.x.log, height: o.height || 460,
      xticks: wordTicks(d.x), yticks: wordTicks(d.y),
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
            } else if (d.outcome[at] === -2) {
              c.strokeStyle = "#000";
              c.lineWidth = 1;
              c.beginPath();
              c.moveTo(left, top); c.lineTo(left + width, top + height);
              c.moveTo(left + width, top); c.lineTo(left, top + height);
              c.stroke();
            }
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

  // The motion of a point: the collar in its hole to scale, phase planes, time histories. `show` replaces the motion.
  function motion(box, drawn, o = {}) {
    const row = make("div", { class: drawn.orbit ? "orbitrow" : "orbitrow bare" }), read = make("p", { class: "read" });
    const orbit = make("div", { class: "orbit" }), planes = make("div", { class: "planes" }), histories = make("div");
    const canvas = make("canvas", { role: "img", "aria-label": "The collar in the hole, to scale" });
    const play = make("button", { type: "button", title: "Animate the collar" }, "Play");
    const slide = make("input", { type: "range", min: 0, max: 1, step: "any", value: 1, "aria-label": "Time" });
    const clock = make("output", {}, "");
    orbit.append(canvas);
    if (drawn.orbit) row.append(orbit);
    row.append(planes);
    box.append(make("div", { class: "player" }, play, slide, clock), row, read, histories);
    let m = null, charts = {}, background = null, at = 0, playing = null;

    const channelOf = (name) => m.head.channels.find((channel) => channel.name === name);
    const column = (name) => m.columns[name];

    // Orbit and planes show the last 20 s of the motion: more revolutions cannot be distinguished.
    function firstShown() {
      const n = m.head.samples, shown = Math.round(20 / (m.head.interval || 1));
      return Math.max(0, n - shown);
    }

    function index(time) {
      const n = m.head.samples;
      return Math.min(n - 1, Math.max(0, Math.round((time - m.head.begin) / (m.head.interval || 1))));
    }

    function drawBackground() {
      const size = Math.round(Math.max(160, Math.min(orbit.clientWidth || 320, 420)) * ratio());
      canvas.width = canvas.height = size;
      const [hole, collar] = m.head.hole, scale = (0.485 * size) / hole, dpr = ratio();
      background = make("canvas", { width: size, height: size });
      const c = background.getContext("2d");
      c.fillStyle = "#f3efe6";
      c.fillRect(0, 0, size, size);
      c.translate(size / 2, size / 2);
      c.beginPath();
      c.arc(0, 0, hole * scale, 0, 2 * Math.PI);
      c.fillStyle = "#fff";
      c.fill();
      c.lineWidth = 1.5 * dpr;
      c.strokeStyle = REFERENCE;
      c.stroke();
      c.setLineDash([3 * dpr, 3 * dpr]);
      c.lineWidth = dpr;
      c.beginPath();
      c.arc(0, 0, (hole - collar) * scale, 0, 2 * Math.PI);
      c.strokeStyle = "#999";
      c.stroke();
      c.setLineDash([]);
      const begin = firstShown(), xs = column("x").subarray(begin), ys = column("y").subarray(begin);
      const X = (value) => value * scale, Y = (value) => -value * scale;
      path(c, X, Y, xs, ys, BLUE, 0.8);
      const wall = column("wall_force");
      if (wall) {
        const touching = wall.subarray(begin);
        path(c, X, Y, xs.map((value, i) => (touching[i] > 0 ? value : NaN)), ys, VERMILLION, 1.4);
      }
      c.fillStyle = INK;
      c.font = `${11 * dpr}px "DejaVu Sans", Verdana, sans-serif`;
      const unit = channelOf("x").unit, nice = [1, 2, 5, 10, 20, 50, 100, 200, 500].filter((v) => v < hole * 0.7).pop() || digits(hole / 3, 1);
      c.strokeStyle = INK;
      c.lineWidth = 2 * dpr;
      c.beginPath();
      c.moveTo(-size / 2 + 8 * dpr, size / 2 - 8 * dpr);
      c.lineTo(-size / 2 + 8 * dpr + nice * scale, size / 2 - 8 * dpr);
      c.stroke();
      c.fillText(`${nice} ${unit}`, -size / 2 + 8 * dpr, size / 2 - 13 * dpr);
      canvas.dataset.hole = hole * scale;
      canvas.dataset.collar = collar * scale;
    }

    function frameAt(time) {
      at = time;
      const i = index(time);
      slide.value = m.head.samples > 1 ? i / (m.head.samples - 1) : 1;
      clock.textContent = `${digits(column("time")[i], 5)} s`;
      if (!drawn.orbit || !m.head.hole || !column("x")) return;
      const c = canvas.getContext("2d"), size = canvas.width, [hole, collar] = m.head.hole, scale = (0.485 * size) / hole;
      const dpr = ratio(), x = size / 2 + column("x")[i] * scale, y = size / 2 - column("y")[i] * scale;
      c.drawImage(background, 0, 0);
      c.beginPath();
      c.arc(x, y, collar * scale, 0, 2 * Math.PI);
      c.fillStyle = "rgba(90, 100, 110, 0.28)";
      c.fill();
      c.strokeStyle = INK;
      c.lineWidth = 1.5 * dpr;
      c.stroke();
      const angle = column("bit angle");
      if (angle) { // a line that rotates with the bit
        c.beginPath();
        c.moveTo(x, y);
        c.lineTo(x + collar * scale * Math.cos(angle[i]), y - collar * scale * Math.sin(angle[i]));
        c.stroke();
      }
      c.beginPath();
      c.arc(x, y, 2.5 * dpr, 0, 2 * Math.PI);
      c.fillStyle = INK;
      c.fill();
    }

    function stop() {
      if (playing) cancelAnimationFrame(playing);
      playing = null;
      play.textContent = "Play";
    }
    play.addEventListener("click", () => {
      if (playing) return stop();
      play.textContent = "Pause";
      const begin = m.head.begin + firstShown() * m.head.interval, end = m.head.begin + (m.head.samples - 1) * m.head.interval;
      let before = null, time = at >= end - 0.05 ? begin : at;
      const tick = (now) => {
        if (before !== null) time += (now - before) / 1000;
        before = now;
        if (time >= end) time = begin;
        frameAt(time);
        drawOverlays();
        playing = requestAnimationFrame(tick);
      };
      playing = requestAnimationFrame(tick);
    });
    slide.addEventListener("input", () => {
      if (!m) return;
      stop();
      frameAt(m.head.begin + slide.value * (m.head.samples - 1) * m.head.interval);
      drawOverlays();
      showValues();
    });
    function drawOverlays() { for (const c of Object.values(charts)) c.over(); }
    function showValues() {
      const i = index(at);
      const texts = drawn.histories.filter((name) => column(name)).map((name) => {
        const channel = channelOf(name);
        return `${channel.words} ${amount(column(name)[i], channel.unit)}`;
      });
      read.textContent = `At ${digits(column("time")[i], 6)} s: ${texts.join(", ")}`;
    }

    function history(name, last) {
      const channel = channelOf(name), values = column(name);
      const span = [m.head.begin, m.head.begin + (m.head.samples - 1) * m.head.interval];
      const frame = {
        x: span[1] > span[0] ? span : [span[0], span[0] + 1], y: padded(limits(values), 0.08), xlabel: "Time [s]",
        ylabel: null, height: last ? 118 : 84, bare: !last, sync: o.sync || "motion", cross: false,
        title: channel.label,
        draw(c, X, Y, u) { timeSeries(c, X, Y, column("time"), column(name), u, BLUE); },
        over(c, X, Y, u) {
          c.strokeStyle = INK;
          c.lineWidth = ratio();
          c.beginPath();
          c.moveTo(X(at), u.bbox.top);
          c.lineTo(X(at), u.bbox.top + u.bbox.height);
          c.stroke();
        },
        move(px, py, u) { if (!playing) { frameAt(u.posToVal(px, "x")); drawOverlays(); showValues(); } },
      };
      return frame;
    }

    function plane(across, up) {
      const a = channelOf(across), b = channelOf(up);
      return {
        x: padded(limits(column(across).subarray(firstShown()))), y: padded(limits(column(up).subarray(firstShown()))),
        xlabel: a.label, ylabel: b.label, height: o.planeHeight || 150, zoom: false, cross: false,
        draw(c, X, Y) {
          const begin = firstShown();
          path(c, X, Y, column(across).subarray(begin), column(up).subarray(begin), BLUE, 0.7);
        },
        over(c, X, Y) {
          const i = index(at), x = column(across)[i], y = column(up)[i];
          c.fillStyle = VERMILLION;
          c.beginPath();
          c.arc(X(x), Y(y), 3.5 * ratio(), 0, 2 * Math.PI);
          c.fill();
        },
      };
    }

    // Add or update a chart: between motions only ranges and data change.
    function put(key, home, frame) {
      if (charts[key]) {
        Object.assign(charts[key].frame, { x: frame.x, y: frame.y });
        charts[key].update();
        return;
      }
      const place = make("div");
      home.append(place);
      charts[key] = Object.assign(chart(place, frame), { frame });
    }

    function show(reply) {
      stop();
      m = reply;
      if (!m.head.samples) { read.textContent = "There is nothing to draw."; return; }
      at = m.head.begin + (m.head.samples - 1) * m.head.interval;
      if (drawn.orbit && m.head.hole && column("x")) drawBackground();
      const names = drawn.histories.filter((name) => column(name));
      names.forEach((name, i) => put(`h ${name}`, histories, history(name, i === names.length - 1)));
      for (const [across, up] of drawn.planes)
        if (column(across) && column(up)) put(`p ${across}`, planes, plane(across, up));
      frameAt(at);
      drawOverlays();
      read.textContent = "Point at a history for its numbers; drag to zoom, double-click for all.";
    }
    new ResizeObserver(() => { if (m && drawn.orbit && m.head.hole && column("x")) { drawBackground(); frameAt(at); } }).observe(orbit);
    return { show, stop, get reply() { return m; } };
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

  // The drawings and legends of the parts of a page as one picture, without the controls between them.
  function picture(parts, title, lines) {
    const dpr = ratio(), gap = 8 * dpr, drawn = [], font = (size, bold) => `${bold ? "bold " : ""}${size * dpr}px "DejaVu Sans", Verdana, sans-serif`;
    const measure = make("canvas").getContext("2d");
    let left = gap, bottom = 0;
    const top = (30 + 18 * lines.length) * dpr;
    for (const part of parts) {
      const box = part.getBoundingClientRect(), items = [];
      for (const element of part.querySelectorAll("canvas, .legend li, #legend li, #local-title")) {
        const rect = element.getBoundingClientRect();
        if (!rect.width || !rect.height || (element.localName === "canvas" && (!element.width || element.className === "swatch"))) continue;
        items.push({ element, x: (rect.left - box.left) * dpr, y: rect.top * dpr, w: rect.width * dpr, h: rect.height * dpr });
      }
      if (!items.length) continue;
      items.sort((a, b) => a.y - b.y);
      let end = items[0].y, shift = items[0].y - top, wide = 0; // in the page, and the distance by which the next items move up
      for (const item of items) {
        if (item.y > end + gap) shift += item.y - end - gap;
        end = Math.max(end, item.y + item.h);
        drawn.push({ ...item, x: item.x + left, y: item.y - shift });
        wide = Math.max(wide, item.x + item.w);
        bottom = Math.max(bottom, item.y + item.h - shift);
      }
      left += wide + 2 * gap;
    }
    measure.font = font(12);
    const width = Math.max(left, ...lines.map((line) => measure.measureText(line).width + 2 * gap));
    const canvas = make("canvas", { width: Math.ceil(width), height: Math.ceil(bottom + gap) }), c = canvas.getContext("2d");
    c.fillStyle = "#fff";
    c.fillRect(0, 0, canvas.width, canvas.height);
    c.fillStyle = INK;
    c.font = font(14, true);
    c.fillText(title, gap, 18 * dpr);
    c.font = font(12);
    lines.forEach((line, i) => c.fillText(line, gap, (38 + 18 * i) * dpr));
    for (const { element, x, y, w, h } of drawn) {
      if (element.localName === "canvas") {
        c.drawImage(element, x, y, w, h);
        continue;
      }
      const swatchCanvas = element.querySelector("canvas");
      const size = swatchCanvas ? 12 * dpr : 0;
      if (swatchCanvas) c.drawImage(swatchCanvas, x, y + (h - size) / 2, size, size);
      c.fillText(element.textContent, x + size + (swatchCanvas ? 4 * dpr : 0), y + h * 0.75);
    }
    return canvas;
  }

  return { branchWords, lineEntries, unpack, make, digits, decimals, amount, valueOf, limits, chart, scatter, cells, colourOf, viridis, motion, section, swatch, peaks, picture };
})();
