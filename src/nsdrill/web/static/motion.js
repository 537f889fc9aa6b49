"use strict";
// The motion of a point: the collar in its hole to scale with the histories beside it, and phase planes.
(() => {
  const N = window.nsdrill, { make, digits, amount, limits, padded, chart, path, timeSeries, ratio, font, INK, BLUE, VERMILLION, REFERENCE } = N;
  const SHOWN = 20; // s that the hole and the planes show: more revolutions cannot be distinguished

  // `show` replaces the motion. `o.start`, if given, is called with {name: value} where the hole or a plane of states is clicked.
  N.motion = function motion(box, drawn, o = {}) {
    const row = make("div", { class: drawn.orbit ? "orbitrow" : "orbitrow bare" }), read = make("p", { class: "read" });
    const orbit = make("div", { class: "orbit" }), planes = make("div", { class: "planes" }), histories = make("div");
    const canvas = make("canvas", { role: "img", "aria-label": "The collar in the hole, to scale" });
    const play = make("button", { type: "button", title: "Animate the collar" }, "Play");
    const slide = make("input", { type: "range", min: 0, max: 1, step: "any", value: 1, "aria-label": "Time" });
    const clock = make("output", {}, "");
    const player = make("div", { class: "player" }, play, slide, clock);
    if (drawn.orbit) {
      orbit.append(canvas, player, read);
      row.append(orbit);
    } else box.append(player, read);
    row.append(histories);
    box.append(row, planes);
    let m = null, charts = {}, background = null, at = 0, playing = null, beside = null;

    const channelOf = (name) => m.head.channels.find((channel) => channel.name === name);
    const column = (name) => m.columns[name];

    const first = (reply) => Math.max(0, reply.head.samples - Math.round(SHOWN / (reply.head.interval || 1)));
    const firstShown = () => first(m);
    const recent = (reply, name) => reply.columns[name].subarray(first(reply));
    // The motion that is shown beside this one, whose ranges are the same.
    const both = () => [m, ...(beside && beside.head.samples ? [beside] : [])];

    function index(time) {
      const n = m.head.samples;
      return Math.min(n - 1, Math.max(0, Math.round((time - m.head.begin) / (m.head.interval || 1))));
    }

    // The scale [pixels per unit] of the hole in a square.
    const scaleOf = (size) => (0.485 * size) / m.head.hole[0];

    // The hole and the path in it, in a square of `size` pixels of which the page has `dpr` in one of its own.
    function paintHole(c, size, dpr) {
      const [hole, collar] = m.head.hole, scale = scaleOf(size);
      c.save();
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
      const xs = recent(m, "x"), ys = recent(m, "y"), X = (value) => value * scale, Y = (value) => -value * scale;
      path(c, X, Y, xs, ys, BLUE, 0.8);
      if (column("wall_force")) {
        const touching = recent(m, "wall_force");
        path(c, X, Y, xs.map((value, i) => (touching[i] > 0 ? value : NaN)), ys, VERMILLION, 1.4);
      }
      c.fillStyle = INK;
      c.font = font(11 * dpr);
      const unit = channelOf("x").unit, nice = [1, 2, 5, 10, 20, 50, 100, 200, 500].filter((v) => v < hole * 0.7).pop() || digits(hole / 3, 1);
      c.strokeStyle = INK;
      c.lineWidth = 2 * dpr;
      c.beginPath();
      c.moveTo(-size / 2 + 8 * dpr, size / 2 - 8 * dpr);
      c.lineTo(-size / 2 + 8 * dpr + nice * scale, size / 2 - 8 * dpr);
      c.stroke();
      c.textAlign = "left";
      c.textBaseline = "alphabetic";
      c.fillText(`${nice} ${unit}`, -size / 2 + 8 * dpr, size / 2 - 13 * dpr);
      c.restore();
    }

    // The collar at the shown time.
    function paintCollar(c, size, dpr) {
      const i = index(at), scale = scaleOf(size), collar = m.head.hole[1];
      const x = size / 2 + column("x")[i] * scale, y = size / 2 - column("y")[i] * scale;
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

    const hasHole = () => drawn.orbit && m && m.head.hole && column("x");
    const side = () => Math.max(160, Math.min(orbit.clientWidth || 320, 420));
    function drawBackground() {
      const size = Math.round(side() * ratio());
      canvas.width = canvas.height = size;
      background = make("canvas", { width: size, height: size });
      paintHole(background.getContext("2d"), size, ratio());
      canvas.dataset.hole = m.head.hole[0] * scaleOf(size);
      canvas.dataset.collar = m.head.hole[1] * scaleOf(size);
    }

    function frameAt(time) {
      at = time;
      const i = index(time);
      slide.value = m.head.samples > 1 ? i / (m.head.samples - 1) : 1;
      clock.textContent = `${digits(column("time")[i], 5)} s`;
      if (!hasHole()) return;
      const c = canvas.getContext("2d");
      c.drawImage(background, 0, 0);
      paintCollar(c, canvas.width, ratio());
    }
    canvas.addEventListener("click", (event) => {
      if (!o.start || !hasHole()) return;
      const box = canvas.getBoundingClientRect(), scale = scaleOf(box.width);
      o.start({ x: (event.clientX - box.left - box.width / 2) / scale, y: (box.top + box.height / 2 - event.clientY) / scale });
    });

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
      const channel = channelOf(name);
      const span = [m.head.begin, m.head.begin + (m.head.samples - 1) * m.head.interval];
      const [least, most] = limits(...both().map((reply) => reply.columns[name] || []));
      const range = most - least > 1e-9 * Math.max(1, Math.abs(most)) ? padded([least, most], 0.08) : [least - Math.max(1, 0.1 * Math.abs(least)), most + Math.max(1, 0.1 * Math.abs(most))];
      const frame = {
        x: span[1] > span[0] ? span : [span[0], span[0] + 1], y: range, xlabel: "Time [s]",
        ylabel: null, height: (o.historyHeight || 74) + (last ? 34 : 0), bare: !last, sync: o.sync || "motion", cross: false, low: true,
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
        x: padded(limits(...both().map((reply) => recent(reply, across)))), y: padded(limits(...both().map((reply) => recent(reply, up)))),
        xlabel: a.label, ylabel: b.label, height: 150, zoom: false, cross: false, low: true, narrow: true,
        draw(c, X, Y) {
          path(c, X, Y, recent(m, across), recent(m, up), BLUE, 0.7);
        },
        click(px, py, u) { if (o.start) o.start({ [across]: u.posToVal(px, "x"), [up]: u.posToVal(py, "y") }); },
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

    // Show a motion, in ranges that also hold those of a motion `other` beside it.
    function show(reply, other = null) {
      stop();
      m = reply;
      beside = other;
      if (!m.head.samples) { read.textContent = "There is nothing to draw."; return; }
      at = m.head.begin + (m.head.samples - 1) * m.head.interval;
      if (hasHole()) drawBackground();
      const names = drawn.histories.filter((name) => column(name));
      names.forEach((name, i) => put(`h ${name}`, histories, history(name, i === names.length - 1)));
      for (const [across, up] of drawn.planes)
        if (column(across) && column(up)) put(`p ${across}`, planes, plane(across, up));
      frameAt(at);
      drawOverlays();
      const states = o.start ? ` Click ${hasHole() ? "the hole or " : ""}a plane to run from there.` : "";
      read.textContent = `Point at a history for its numbers; drag to zoom, double-click for all.${states}`;
    }

    // The parts of a picture: the hole with the histories beside it, then the planes.
    function parts() {
      if (!m || !m.head.samples) return [];
      const size = side(), of = (key) => Object.entries(charts).filter(([name]) => name.startsWith(key)).map(([, one]) => one);
      const hole = hasHole() ? [[{ size: () => [size, size], paint: (c) => { paintHole(c, size, 1); paintCollar(c, size, 1); } }]] : [];
      return [[...hole, of("h ")], of("p ").map((one) => [one])];
    }
    new ResizeObserver(() => { if (hasHole()) { drawBackground(); frameAt(at); } }).observe(orbit);
    return { show, stop, parts, get reply() { return m; } };
  };
})();
