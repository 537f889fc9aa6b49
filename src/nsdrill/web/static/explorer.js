"use strict";
// The explorer: the choices of the user, and the requests to the server, which gives all names, units, colours and ranges.
(() => {
  const N = window.nsdrill, { make, digits, amount, valueOf } = N;
  const $ = (id) => document.getElementById(id);
  const token = location.hash.slice(1);
  let meta = null, view = null, motion = null, charts = [], local = null;
  // The present point: its place in the sweep, the changed values, the changes that the server accepted, and the state that
  // the next motion starts from.
  const now = { place: null, changes: {}, accepted: {}, state: null, states: null, values: {}, reply: null };

  function banner(words) {
    $("banner").textContent = words || "";
    $("banner").hidden = !words;
  }

  let givingUp = null; // the signal for the requests that are made now

  // A banner tells of a request that takes longer than a moment. Where a string is run, its code may have to be compiled.
  let pending = 0, progressBanner = "";
  const PROGRESS = {
    meta: "Opening the file", diagram: "Reading the diagram", plane: "Reading the map", replay: "Running this point again",
    orbit: "Running the motion of this branch", live: "Running on", local: "Running the points around the present one",
    section: "Collecting the returns to the section", saved: "Writing the study",
  };
  const RUNNING = ["replay", "orbit", "live", "local", "section"];
  async function ask(name, request = {}) {
    const showProgress = (words) => {
      if ($("banner").textContent && $("banner").textContent !== progressBanner) return;
      progressBanner = words;
      banner(words);
    };
    const timers = [setTimeout(() => showProgress(`${PROGRESS[name]} …`), 1500)];
    if (RUNNING.includes(name))
      timers.push(setTimeout(() => showProgress(`${PROGRESS[name]} … If this kind of string has not been run on this machine before, its equations are compiled first, which takes a moment; the machine code is kept.`), 6000));
    pending += 1;
    try {
      return await send(name, request);
    } finally {
      timers.forEach(clearTimeout);
      pending -= 1;
      if (!pending && progressBanner && $("banner").textContent === progressBanner) banner("");
    }
  }

  async function send(name, request) {
    let response;
    try {
      response = await fetch(`/api/${name}`, {
        method: "POST", headers: { "X-Nsdrill-Token": token, "Content-Type": "application/json" }, body: JSON.stringify(request),
        signal: givingUp,
      });
    } catch (error) {
      if (error.name === "AbortError") throw error;
      throw new Error(`The explorer does not answer any more. Start it again: ${meta ? meta.command : "nsdrill view FILE"}`);
    }
    if (!response.ok) throw new Error((await response.json()).error);
    if (response.headers.get("Content-Type") === "application/json") return response.json();
    return N.unpack(await response.arrayBuffer());
  }

  // The server counts the page as open as long as this response lasts.
  async function keepAlive() {
    try {
      const response = await fetch("/api/alive", { headers: { "X-Nsdrill-Token": token } });
      if (!response.ok) return;
      const reader = response.body.getReader();
      while (!(await reader.read()).done);
    } catch { /* the banner below tells it */ }
    banner(`The explorer has stopped; what is drawn stays. Start it again: ${meta ? meta.command : "nsdrill view FILE"}`);
  }

  // Runs `work` once at a time; of the calls that come meanwhile only the newest runs next. The requests of a work that takes
  // longer than PATIENCE are then given up, which stops their runs; a shorter one is drawn, or nothing would be while a slider moves.
  const PATIENCE = 1000; // ms
  function latestOnly(work) {
    let busy = false, next = null, stop = null, begun = 0;
    return async function call(...values) {
      if (busy) {
        next = values;
        const late = stop;
        setTimeout(() => late.abort(), Math.max(0, begun + PATIENCE - performance.now()));
        return;
      }
      busy = true;
      stop = new AbortController();
      begun = performance.now();
      try {
        banner("");
        givingUp = stop.signal;
        const done = work(...values); // which makes its requests before it first waits
        givingUp = null;
        await done;
      } catch (error) {
        if (error.name !== "AbortError") banner(error.message);
      }
      busy = false;
      if (next) { const latest = next; next = null; call(...latest); }
    };
  }

  // ---- the diagram of the sweep

  const options = (select, list, chosen) =>
    select.replaceChildren(...list.map(([value, words]) => make("option", { value, selected: value === chosen }, words)));

  function addControls() {
    const c = meta.choices, several = c.axes.length > 1;
    if (!c.axes.length) return;
    $("sweep").hidden = false;
    const channels = [];
    if (several) channels.push(...c.labels.map((item) => [`map ${item.name}`, `Map: ${item.long}`]), ...c.features.map((item) => [`map ${item.name}`, `Map: ${item.words}`]));
    if (c.panels.length) channels.push(["all", "Peaks of all motions"], ...c.panels.map((item) => [`line ${item.name}`, item.words]));
    channels.push(...c.features.map((item) => [`line ${item.name}`, item.words]));
    const longest = [...c.axes].sort((a, b) => (a.texts ? 1 : 0) - (b.texts ? 1 : 0) || b.values.length - a.values.length).map((item) => item.name);
    const second = several ? c.axes.find((item) => item.name === longest[1]).values.length : 0;
    options($("channel"), channels, several && second > 3 ? "map response" : c.panels.length ? "all" : channels[0][0]);
    options($("along"), c.axes.map((item) => [item.name, item.words]), longest[0]);
    options($("against"), c.axes.map((item) => [item.name, item.words]), longest[1]);
    $("channel").addEventListener("change", redraw);
    for (const id of ["along", "against"])
      $(id).addEventListener("change", () => {
        if ($("along").value === $("against").value) {
          const other = c.axes.find((item) => item.name !== $(id).value).name;
          $(id === "along" ? "against" : "along").value = other;
        }
        redraw();
      });
    view = { held: {}, member: 0, visible: c.procedures.map(() => true), procedure: 0, chosen: null };
  }

  // The selection of procedures: one of a map, any of lines.
  function procedureControls() {
    const c = meta.choices;
    if (c.procedures.length < 2) return;
    $("procedures").replaceChildren(
      ...c.procedures.map((name, p) => {
        const tick = make("input", { type: view.map ? "radio" : "checkbox", name: "procedure", checked: view.map ? p === view.procedure : view.visible[p] });
        tick.addEventListener("change", () => {
          if (view.map) { view.procedure = p; redraw(); return; }
          view.visible[p] = tick.checked;
          for (const chart of charts) chart.show(view.visible);
        });
        return make("label", {}, tick, ` ${name} `);
      }),
    );
  }

  // Selects for the axes that the drawing does not show.
  function heldControls(free) {
    const c = meta.choices, home = $("held");
    home.replaceChildren();
    for (const axis of c.axes) {
      if (free.includes(axis.name)) continue;
      const select = make("select", {}, ...axis.values.map((value, i) => make("option", { value: i, selected: i === (view.held[axis.name] || 0) }, valueOf(axis, i))));
      select.addEventListener("change", () => { view.held[axis.name] = Number(select.value); redraw(); });
      home.append(make("label", {}, `${axis.words} `, select, " "));
    }
    if (c.members) {
      const { name, count } = c.members, field = make("input", { type: "number", min: 0, max: count - 1, value: view.member });
      field.addEventListener("change", () => { view.member = Math.min(Math.max(0, Math.round(Number(field.value) || 0)), count - 1); redraw(); });
      home.append(make("label", {}, `${name} `, field));
    }
  }

  const redraw = latestOnly(async () => {
    const [kind, name] = $("channel").value.split(" "), c = meta.choices, several = c.axes.length > 1;
    view.map = kind === "map";
    $("along-label").hidden = !several;
    $("against-label").hidden = !several || !view.map;
    const x = $("along").value, free = view.map ? [x, $("against").value] : [x];
    heldControls(free);
    procedureControls();
    const fixed = Object.fromEntries(Object.entries(view.held).filter(([axis]) => !free.includes(axis)));
    const common = { held: fixed, member: view.member, x };
    for (const chart of charts) chart.end();
    charts = [];
    $("diagram").replaceChildren();
    view.chosen = null;
    if (view.map) {
      const reply = await ask("plane", { ...common, y: $("against").value, colour: name });
      drawMap(reply);
    } else {
      const names = kind === "all" ? c.panels.map((item) => item.name) : [name];
      const replies = await Promise.all(names.map((y) => ask("diagram", { ...common, y })));
      drawLines(replies.map(({ head, columns }) => ({ ...head, ...columns })));
    }
  });

  function placeOf(d, p, i) {
    const place = [...d.place];
    place[0] = p;
    place[d.dimension] = i;
    return place;
  }

  const word = (code) => (code === -1 ? "not run yet" : code === -2 ? "failed" : meta.responses[code].name);

  function drawLines(all) {
    view.all = all;
    const codes = new Set();
    all.forEach((d, number) => {
      const box = make("div");
      $("diagram").append(box);
      charts.push(
        N.scatter(box, d, {
          responses: meta.responses, visible: [...view.visible], height: all.length > 1 ? (number === all.length - 1 ? 222 : 190) : 430,
          bare: number < all.length - 1, sync: "sweep", move: (hit) => hit && showPoint(d, hit),
          pick: (hit) => ("curve" in hit ? pickBranch(d, hit) : pick(d, hit.p, hit.i)),
        }),
      );
      for (const code of d.outcome) codes.add(code);
    });
    const d = all[0];
    const items = meta.responses.filter((_, code) => codes.has(code))
      .map((style) => make("li", {}, N.swatch(style.marker, style.colour), style.name));
    if (d.procedures.includes("down") && d.procedures.length > 1)
      items.push(make("li", {}, N.swatch("o", "#4D4D4D"), "up: filled"), make("li", {}, N.swatch("o", "#4D4D4D", false), "down: open"));
    if (d.hysteresis.length) items.push(make("li", {}, N.swatch("s", "#E8D47A"), "up and down differ"));
    if (codes.has(-2)) items.push(make("li", {}, N.swatch("X", "#000"), "failed"));
    if (d.curves) items.push(make("li", {}, "black line: branch, solid where stable, dashed where not"));
    items.push(...all.flatMap(N.lineEntries));
    if (d.note) items.push(make("li", {}, d.note));
    $("legend").replaceChildren(...items);
    view.count = d.x.values.length;
    showLivePeaks();
  }

  function showPoint(d, { p, i, value, curve, at }) {
    if (curve !== undefined) {
      $("hover").replaceChildren(
        make("span", { class: "name" }, `${d.x.words} ${amount(at, d.x.unit, 6)}: ${N.branchWords(d, curve)}`),
        make("br"), `${d.y.words} ${amount(value, d.y.unit)}`,
      );
      return;
    }
    const code = d.outcome[p * d.x.values.length + i];
    const head = [
      make("span", { class: "name" }, `${d.x.words} ${valueOf(d.x, i, 5)}${d.procedures.length > 1 ? `, ${d.procedures[p]}` : ""}: ${word(code)}`),
      make("br"), Number.isFinite(value) ? `${d.y.words} ${amount(value, d.y.unit)}` : "",
    ];
    if (d.hover) {
      const count = d.hover.length && d.hover_quantities ? d.hover_quantities.length : 0;
      const texts = [];
      for (let k = 0; k < count; k++) {
        const number = d.hover[(p * d.x.values.length + i) * count + k], quantity = d.hover_quantities[k];
        if (Number.isFinite(number)) texts.push(`${quantity.words} ${amount(number, quantity.unit, 3)}`);
      }
      head.push(make("br"), texts.join(" · "));
    }
    $("hover").replaceChildren(...head);
  }

  function drawMap({ head, columns }) {
    const d = { ...head, ...columns };
    view.all = [d];
    const showCell = (hit) => {
      if (!hit) return;
      const shown = hit.outcome < 0 ? word(hit.outcome) : d.classes ? (d.classes[hit.value] || {}).name || "–" : amount(hit.value, d.colour.unit);
      $("hover").replaceChildren(
        make("span", { class: "name" }, `${d.x.words} ${valueOf(d.x, hit.i, 5)}, ${d.y.words} ${valueOf(d.y, hit.j, 5)}${d.procedures.length > 1 ? `, ${d.procedures[hit.p]}` : ""}`),
        make("br"), `${d.colour.words}: ${shown}`,
      );
    };
    const cells = N.cells($("diagram"), d, {
      procedure: view.procedure, height: 480, move: showCell,
      pick: (hit) => { cells.choose(hit.i, hit.j); view.chosen = [hit.i, hit.j]; run(mapPlace(d, hit.i, hit.j)); },
    });
    charts = [{ ...cells, show() {}, live() {} }];
    const values = new Set(d.values);
    $("legend").replaceChildren(
      ...(d.classes
        ? d.classes.filter((_, code) => values.has(code)).map((style) => make("li", {}, N.swatch("s", style.colour), style.name))
        : [0, 0.25, 0.5, 0.75, 1].map((part) => make("li", {}, N.swatch("s", `rgb(${N.viridis(part).join()})`), amount(d.limits[0] + part * (d.limits[1] - d.limits[0]), d.colour.unit, 3)))),
    );
    view.showCell = (i, j) => showCell({ p: view.procedure, i, j, value: d.values[(view.procedure * d.y.values.length + j) * d.x.values.length + i], outcome: d.outcome[(view.procedure * d.y.values.length + j) * d.x.values.length + i] });
  }

  function mapPlace(d, i, j) {
    const place = [...d.place];
    place[0] = view.procedure;
    place[d.x.dimension] = i;
    place[d.y.dimension] = j;
    return place;
  }

  function pickBranch(d, hit) {
    for (const chart of charts) chart.choose(-1, hit.at);
    view.chosen = null;
    view.point = hit.curve;
    follow(d, hit.curve);
  }

  function choose(p, i) {
    view.chosen = [p, i];
    for (const chart of charts) chart.choose(p, i);
  }

  function pick(d, p, i) {
    choose(p, i);
    run(placeOf(d, p, i));
  }

  // Keyboard: left and right move along the axis, up and down to another procedure or along the other axis.
  $("diagram").addEventListener("keydown", (event) => {
    if (!view || !view.all) return;
    if (!view.all[0].x.values.length) { moveAlongBranch(event); return; }
    const steps = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    const d = view.all[0], n = d.x.values.length, clip = (value, count) => Math.min(Math.max(value, 0), count - 1);
    const far = event.shiftKey ? 10 : 1;
    if (steps) {
      event.preventDefault();
      if (view.map) {
        const [i, j] = view.chosen || [Math.floor(n / 2), Math.floor(d.y.values.length / 2)];
        view.chosen = [clip(i + far * steps[0], n), clip(j + far * steps[1], d.y.values.length)];
        charts[0].choose(...view.chosen);
        view.showCell(...view.chosen);
      } else {
        const shown = d.procedures.map((_, p) => p).filter((p) => view.visible[p]); // the arrow up selects the procedure before
        if (!shown.length) return;
        const [p, i] = view.chosen || [shown[0], Math.floor(n / 2)];
        choose(shown[clip(Math.max(shown.indexOf(p), 0) - steps[1], shown.length)], clip(i + far * steps[0], n));
        const [q, k] = view.chosen, K = d.values.shape[2];
        showPoint(d, { p: q, i: k, value: d.values[(q * n + k) * K] });
      }
    } else if ((event.key === "Enter" || event.key === " ") && view.chosen) {
      event.preventDefault();
      run(view.map ? mapPlace(d, ...view.chosen) : placeOf(d, ...view.chosen));
    }
  });

  // Keyboard on branches alone: left and right move along a branch, up and down to the nearest point of another one.
  function moveAlongBranch(event) {
    const d = view.all[0], sizes = d.curves.sizes, firsts = sizes.map((_, b) => sizes.slice(0, b).reduce((a, n) => a + n, 0));
    const branchOf = (point) => firsts.filter((first) => first <= point).length - 1, clip = (v, low, high) => Math.min(Math.max(v, low), high);
    const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key], other = { ArrowUp: -1, ArrowDown: 1 }[event.key];
    if (step || other) {
      event.preventDefault();
      const xs = d["curve x"], start = view.point === undefined, current = start ? Math.floor(sizes[0] / 2) : view.point, b = branchOf(current);
      const forward = xs[firsts[b]] <= xs[firsts[b] + sizes[b] - 1] ? 1 : -1; // the right arrow moves to the right, except beyond folds
      if (start) view.point = current;
      else if (step) view.point = clip(current + step * forward * (event.shiftKey ? 10 : 1), firsts[b], firsts[b] + sizes[b] - 1);
      else {
        const next = clip(b + other, 0, sizes.length - 1);
        let best = firsts[next];
        for (let i = best; i < firsts[next] + sizes[next]; i++) if (Math.abs(xs[i] - xs[current]) < Math.abs(xs[best] - xs[current])) best = i;
        view.point = best;
      }
      for (const chart of charts) chart.choose(-1, xs[view.point]);
      charts.forEach((chart, k) => chart.live([[xs[view.point], [view.all[k]["curve y"][view.point]]]]));
      showPoint(d, { curve: view.point, value: d["curve y"][view.point], at: xs[view.point] });
    } else if ((event.key === "Enter" || event.key === " ") && view.point !== undefined) {
      event.preventDefault();
      follow(d, view.point);
    }
  }

  // ---- the motion

  const seconds = () => Number($("seconds").value);

  const run = latestOnly(async (place) => {
    const reply = await ask("replay", { place, seconds: seconds() });
    now.place = place;
    now.changes = {};
    now.accepted = {};
    showMotion(reply);
  });

  // The motion of a point of a branch; the sliders start from it.
  const follow = latestOnly(async (d, point) => {
    const reply = await ask("orbit", { point });
    now.place = d.place;
    now.changes = { ...reply.head.changes };
    now.accepted = { ...now.changes };
    showMotion(reply);
  });

  // A change that the server refuses is undone, or the server would refuse all later ones with it.
  const move = latestOnly(async (request = {}) => {
    const changes = { ...now.changes };
    let reply;
    try {
      reply = await ask("live", {
        place: now.place, changes, state: now.state, states: now.states, seconds: Math.min(seconds(), 200), ...request,
      });
    } catch (error) {
      if (error.name === "AbortError") throw error; // the newest change runs next, with these
      for (const [key, value] of Object.entries(changes))
        if (now.changes[key] === value && now.accepted[key] !== value) {
          if (key in now.accepted) now.changes[key] = now.accepted[key];
          else delete now.changes[key];
        }
      updateSliders();
      throw error;
    }
    now.accepted = changes;
    showMotion(reply);
  });

  function showMotion(reply) {
    now.reply = reply;
    now.state = reply.head.state;
    now.states = reply.head.states;
    now.values = reply.head.values;
    motion.show(reply);
    const h = reply.head, which = $("which");
    const name = h.from ? h.from.map(([a, b]) => `${a} ${b}`).join(", ") : meta.usual.map((key) => slider(key)).filter(Boolean).map((item) => `${item.words} ${item.choices ? now.values[item.key] : amount(now.values[item.key] / item.scale, item.unit, 5)}`).join(", ");
    which.replaceChildren(make("span", { class: "name" }, name), make("span", { class: "labels" }, h.labels.join(", ")));
    if (h.begins === "stored")
      which.append(
        make("span", { class: h.same_bits ? "bits" : "bits not", id: "bits" }, h.same_bits ? "Run again: it ends in the stored state, bit for bit." : `Run again: it does not end in the stored state. What differs: ${h.differing.join("; ") || "nothing that the file records"}.`),
      );
    else which.append(make("span", { class: "bits", id: "bits" }, h.begins));
    if (h.ended) which.append(make("span", { class: "labels ended" }, `It ended early: ${h.ended}.`));
    $("command").replaceChildren(...(h.command ? ["The same from the command line: ", make("code", {}, h.command)] : []));
    $("features").replaceChildren(...h.features.map(([a, b]) => make("tr", {}, make("td", {}, a), make("td", { class: "number" }, b))));
    $("features-box").hidden = !h.features.length;
    $("section-box").hidden = !h.place || !meta.drawn.section.length || h.ended !== "";
    if ($("section-box").open && h.place) section();
    $("again").disabled = false;
    $("onward").disabled = $("local-run").disabled = $("save-study").disabled = !now.state;
    updateSliders();
    showLivePeaks();
  }

  const section = latestOnly(async () => N.section($("section"), await ask("section", { place: now.place })));
  $("section-box").addEventListener("toggle", () => { if ($("section-box").open && now.place) section(); });

  // The peaks of the present motion, as rings in the diagram.
  function showLivePeaks() {
    if (!view || !view.all || view.map || !now.reply || now.reply.head.begins === "stored") {
      for (const chart of charts) chart.live([]);
      return;
    }
    view.all.forEach((d, number) => {
      const panel = meta.choices.panels.find((item) => item.name === d.y.name);
      const samples = panel && now.reply.columns[panel.trace], x = now.values[d.x.key];
      charts[number].live(samples && x != null ? [[x / d.x.scale, N.peaks(samples, 24)]] : []);
    });
  }

  // ---- sliders

  const slider = (key) => meta.sliders.find((item) => item.key === key);
  const rows = new Map();

  // The select of a word of the study. The code for another word is compiled when it is first chosen.
  function addChoice(key, quantity, id) {
    const select = make("select", { id });
    options(select, quantity.choices.map((word) => [word, word.replaceAll("_", " ")]), quantity.value);
    const node = make("div", { class: "slider" }, make("label", { htmlFor: id, title: quantity.meaning }, quantity.words), select);
    select.addEventListener("change", () => { now.changes[key] = select.value; move(); });
    rows.set(key, { node, select, quantity });
    $("sliders").append(node);
    updateSliders();
  }

  function addSlider(key) {
    const quantity = slider(key);
    if (!quantity || rows.has(key)) return;
    const id = `s-${key.replaceAll(".", "-")}`;
    if (quantity.choices) { addChoice(key, quantity, id); return; }
    const range = make("input", { type: "range", id, min: quantity.low, max: quantity.high, step: quantity.whole ? 1 : "any", value: quantity.value });
    const text = make("input", { type: "text", "aria-label": `${quantity.words}, a number with its unit`, spellcheck: false });
    const label = make("label", { htmlFor: id, title: quantity.meaning }, quantity.words);
    const node = make("div", { class: "slider" }, label, range, text);
    range.addEventListener("input", () => {
      now.changes[key] = Number(range.value);
      text.value = amount(range.value / quantity.scale, quantity.unit, 4);
      range.setAttribute("aria-valuetext", text.value);
      node.classList.add("changed");
      move();
    });
    text.addEventListener("change", () => {
      const typed = text.value.trim();
      if (!typed) return;
      const isNumber = /^[-+]?[\d.]+(e[-+]?\d+)?$/i.test(typed);
      now.changes[key] = isNumber ? Number(typed) * quantity.scale : typed;
      move();
    });
    rows.set(key, { node, range, text, quantity });
    $("sliders").append(node);
    updateSliders();
  }

  function updateSliders() {
    for (const [key, { node, range, text, select, quantity }] of rows) {
      const value = now.values[key] ?? quantity.value;
      node.classList.toggle("changed", key in now.changes);
      if (select) { select.value = value; continue; }
      if (value < Number(range.min)) range.min = value;
      if (value > Number(range.max)) range.max = value;
      if (document.activeElement !== range) range.value = value;
      if (document.activeElement !== text) text.value = amount(value / quantity.scale, quantity.unit, 5);
      range.setAttribute("aria-valuetext", text.value);
    }
  }

  // ---- a diagram around the present point

  const runLocal = latestOnly(async (key) => {
    $("local-run").textContent = "Running …";
    try {
      const reply = await ask("local", { place: now.place, changes: now.changes, state: now.state, states: now.states, key });
      drawLocal(key, reply);
    } finally {
      $("local-run").textContent = "Draw diagram";
    }
  });

  function drawLocal(key, { head, columns }) {
    $("local").hidden = false;
    if (local) for (const chart of local.charts) chart.end();
    $("local-diagram").replaceChildren();
    $("local-title").textContent = `${head.x.words} around ${amount(head.centre, head.x.unit)}: ${head.x.values.length} points, each from the present state, after ${head.settle} s observed for ${head.observe} s`;
    const from = { place: now.place, changes: { ...now.changes } };
    local = { charts: [], chosen: null, head };
    const all = head.panels.map((panel) => ({
      ...head, y: panel, values: columns[panel.name], constant: columns[`${panel.name} constant`], outcome: columns.outcome,
    }));
    local.all = all;
    local.pick = (i) => {
      local.chosen = i;
      for (const chart of local.charts) chart.choose(0, i);
      now.place = from.place;
      now.changes = { ...from.changes, [key]: head.exact[i] };
      move({ state: head.state, states: head.states, settle: head.settle, observe: head.observe });
    };
    local.showPoint = (i, value, d = all[0]) => {
      $("local-hover").textContent = `${head.x.words} ${amount(head.x.values[i], head.x.unit, 5)}: ${word(d.outcome[i])}${Number.isFinite(value) ? `, ${d.y.words} ${amount(value, d.y.unit)}` : ""}`;
    };
    all.forEach((d, number) => {
      const box = make("div");
      $("local-diagram").append(box);
      local.charts.push(
        N.scatter(box, d, {
          responses: meta.responses, height: number === all.length - 1 ? 182 : 150, bare: number < all.length - 1, sync: "local",
          move: (hit) => hit && local.showPoint(hit.i, hit.value, d), pick: (hit) => local.pick(hit.i),
        }),
      );
    });
    local.showPoint(Math.floor(head.x.values.length / 2), NaN);
  }
  $("local-diagram").addEventListener("keydown", (event) => {
    if (!local) return;
    const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key], n = local.head.x.values.length;
    if (step) {
      event.preventDefault();
      local.chosen = Math.min(Math.max((local.chosen ?? Math.floor(n / 2)) + step, 0), n - 1);
      for (const chart of local.charts) chart.choose(0, local.chosen);
      local.showPoint(local.chosen, NaN);
    } else if (event.key === "Enter" && local.chosen !== null) {
      event.preventDefault();
      local.pick(local.chosen);
    }
  });

  // ---- saving: as a download of the browser

  function download(name, blob) {
    const url = URL.createObjectURL(blob), link = make("a", { href: url, download: name });
    document.body.append(link);
    link.click();
    link.remove();
    setTimeout(() => URL.revokeObjectURL(url), 10000);
  }
  $("save-study").addEventListener("click", latestOnly(async () => {
    const { text, name } = await ask("saved", { place: now.place, changes: now.changes, state: now.state, states: now.states });
    download(name, new Blob([text], { type: "application/yaml" }));
  }));
  $("save-picture").addEventListener("click", () => {
    const lines = [meta.about, $("which").textContent && [...$("which").children].slice(0, 2).map((item) => item.textContent).join(": ")].filter(Boolean);
    N.picture([$("sweep"), $("point"), $("local")].filter((item) => !item.hidden), meta.title, lines).toBlob((blob) => download("nsdrill.png", blob));
  });

  // ---- the beginning

  async function begin() {
    if (!token) {
      banner("The address lacks its token, the part after #. Open the address that nsdrill view printed.");
      return;
    }
    meta = await ask("meta");
    keepAlive();
    document.title = `${meta.title} – nsdrill`;
    $("title").textContent = meta.title;
    meta.about = [meta.file, meta.model, ...(meta.points ? [`${meta.points} points`] : []), ...meta.overrides].join(" · ");
    $("about").textContent = meta.about;
    options($("seconds"), [...new Set([meta.seconds, 60, 200, meta.longest])].filter((item) => item <= meta.longest || item === meta.seconds).sort((a, b) => a - b).map((item) => [String(item), item === meta.longest ? `all ${digits(item)} s` : `last ${digits(item)} s`]), String(meta.seconds));
    motion = N.motion($("motion"), meta.drawn);
    for (const key of meta.usual) addSlider(key);
    const others = meta.sliders.filter((item) => !meta.usual.includes(item.key));
    options($("more"), [["", "choose …"], ...others.map((item) => [item.key, item.words])], "");
    $("more").addEventListener("change", () => { addSlider($("more").value); $("more").value = ""; });
    options($("around"), meta.sliders.filter((item) => !item.choices && !item.whole).map((item) => [item.key, item.words]), meta.usual[0]);
    const along = meta.choices && meta.choices.axes.length && slider(meta.choices.axes[0].key);
    if (along && !along.choices && !along.whole) $("around").value = along.key;
    $("seconds").addEventListener("change", () => (now.place && now.reply.head.begins === "stored" ? run(now.place) : now.state && move()));
    $("again").addEventListener("click", () => { now.changes = {}; now.accepted = {}; if (now.place) run(now.place); else move({ state: null }); });
    $("onward").addEventListener("click", () => move());
    $("local-run").addEventListener("click", () => runLocal($("around").value));
    $("which").textContent = "No point is chosen yet.";
    if (meta.choices && meta.choices.axes.length) {
      if (meta.kind === "branches") {
        $("hover").textContent = "Point at a branch; click a point of it to run its motion.";
        $("diagram").setAttribute("aria-label", "Branches. Left and right arrows go along a branch, up and down to another, Enter runs the point.");
      }
      addControls();
      await redraw();
    } else {
      document.querySelector("main").classList.add("alone");
      if (meta.choices) run(Array(meta.choices.dimensions).fill(0));
      else move({ state: null });
    }
    document.body.dataset.ready = "1";
  }
  begin().catch((error) => banner(error.message));
})();
