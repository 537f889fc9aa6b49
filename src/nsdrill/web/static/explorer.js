"use strict";
// The explorer: what is chosen, and what is asked of the server. Every name, unit, colour and range comes from there.
(() => {
  const N = window.nsdrill, { make, digits, amount, valueOf } = N;
  const $ = (id) => document.getElementById(id);
  const token = location.hash.slice(1);
  let meta = null, view = null, motion = null, charts = [], local = null;
  // The present point: where it began, what was changed, and the state from which to go on.
  const now = { place: null, changes: {}, kept: {}, state: null, states: null, values: {}, reply: null };

  function banner(words) {
    $("banner").textContent = words || "";
    $("banner").hidden = !words;
  }

  // What takes longer than a moment is said. Of what runs a string, the reason may be that its code is compiled first.
  let waiting = 0, waited = "";
  const DOING = {
    meta: "Opening the file", diagram: "Reading the diagram", plane: "Reading the map", replay: "Running this point again",
    orbit: "Running the motion of this branch", live: "Running on", local: "Running the points around the present one",
    section: "Collecting the returns to the section", saved: "Writing the study",
  };
  const RUNS = ["replay", "orbit", "live", "local", "section"];
  async function ask(name, question = {}) {
    const say = (words) => {
      if ($("banner").textContent && $("banner").textContent !== waited) return;
      waited = words;
      banner(words);
    };
    const patience = [setTimeout(() => say(`${DOING[name]} …`), 1500)];
    if (RUNS.includes(name))
      patience.push(setTimeout(() => say(`${DOING[name]} … If this kind of string has not been run on this machine before, its equations are compiled first, which can take two minutes; the machine code is kept.`), 6000));
    waiting += 1;
    try {
      return await asked(name, question);
    } finally {
      patience.forEach(clearTimeout);
      waiting -= 1;
      if (!waiting && waited && $("banner").textContent === waited) banner("");
    }
  }

  async function asked(name, question) {
    let answer;
    try {
      answer = await fetch(`/api/${name}`, {
        method: "POST", headers: { "X-Nsdrill-Token": token, "Content-Type": "application/json" }, body: JSON.stringify(question),
      });
    } catch {
      throw new Error(`The explorer does not answer any more. Start it again: ${meta ? meta.command : "nsdrill view FILE"}`);
    }
    if (!answer.ok) throw new Error((await answer.json()).error);
    if (answer.headers.get("Content-Type") === "application/json") return answer.json();
    return N.unpack(await answer.arrayBuffer());
  }

  // As long as this answer lasts, the explorer knows that the page is there.
  async function alive() {
    try {
      const answer = await fetch("/api/alive", { headers: { "X-Nsdrill-Token": token } });
      if (!answer.ok) return;
      const reader = answer.body.getReader();
      while (!(await reader.read()).done);
    } catch { /* said below */ }
    banner(`The explorer has stopped; what is drawn stays. Start it again: ${meta ? meta.command : "nsdrill view FILE"}`);
  }

  // One question of a kind at a time; of those that come meanwhile the newest.
  function inTurn(work) {
    let busy = false, next = null;
    return async function call(...values) {
      if (busy) { next = values; return; }
      busy = true;
      try {
        banner("");
        await work(...values);
      } catch (error) {
        banner(error.message);
      }
      busy = false;
      if (next) { const again = next; next = null; call(...again); }
    };
  }

  // ---- the diagram of the sweep

  const options = (select, list, chosen) =>
    select.replaceChildren(...list.map(([value, words]) => make("option", { value, selected: value === chosen }, words)));

  function controls() {
    const c = meta.choices, several = c.axes.length > 1;
    if (!c.axes.length) return;
    $("sweep").hidden = false;
    const channels = [];
    if (several) channels.push(...c.labels.map((one) => [`map ${one.name}`, `Map: ${one.long}`]), ...c.features.map((one) => [`map ${one.name}`, `Map: ${one.words}`]));
    if (c.panels.length) channels.push(["all", "Peaks of all motions"], ...c.panels.map((one) => [`line ${one.name}`, one.words]));
    channels.push(...c.features.map((one) => [`line ${one.name}`, one.words]));
    const longest = [...c.axes].sort((a, b) => (a.texts ? 1 : 0) - (b.texts ? 1 : 0) || b.values.length - a.values.length).map((one) => one.name);
    const second = several ? c.axes.find((one) => one.name === longest[1]).values.length : 0;
    options($("channel"), channels, several && second > 3 ? "map response" : c.panels.length ? "all" : channels[0][0]);
    options($("along"), c.axes.map((one) => [one.name, one.words]), longest[0]);
    options($("against"), c.axes.map((one) => [one.name, one.words]), longest[1]);
    $("channel").addEventListener("change", redraw);
    for (const id of ["along", "against"])
      $(id).addEventListener("change", () => {
        if ($("along").value === $("against").value) {
          const other = c.axes.find((one) => one.name !== $(id).value).name;
          $(id === "along" ? "against" : "along").value = other;
        }
        redraw();
      });
    view = { held: {}, member: 0, visible: c.procedures.map(() => true), procedure: 0, chosen: null };
  }

  // Of a map one procedure is drawn, of lines any.
  function procedures() {
    const c = meta.choices;
    if (c.procedures.length < 2) return;
    $("procedures").replaceChildren(
      ...c.procedures.map((name, p) => {
        const tick = make("input", { type: view.map ? "radio" : "checkbox", name: "procedure", checked: view.map ? p === view.procedure : view.visible[p] });
        tick.addEventListener("change", () => {
          if (view.map) { view.procedure = p; redraw(); return; }
          view.visible[p] = tick.checked;
          for (const one of charts) one.show(view.visible);
        });
        return make("label", {}, tick, ` ${name} `);
      }),
    );
  }

  // Selects for the axes that a drawing does not run along.
  function held(free) {
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

  const redraw = inTurn(async () => {
    const [kind, name] = $("channel").value.split(" "), c = meta.choices, several = c.axes.length > 1;
    view.map = kind === "map";
    $("along-label").hidden = !several;
    $("against-label").hidden = !several || !view.map;
    const x = $("along").value, free = view.map ? [x, $("against").value] : [x];
    held(free);
    procedures();
    const fixed = Object.fromEntries(Object.entries(view.held).filter(([axis]) => !free.includes(axis)));
    const common = { held: fixed, member: view.member, x };
    for (const one of charts) one.end();
    charts = [];
    $("diagram").replaceChildren();
    view.chosen = null;
    if (view.map) {
      const reply = await ask("plane", { ...common, y: $("against").value, colour: name });
      map(reply);
    } else {
      const names = kind === "all" ? c.panels.map((one) => one.name) : [name];
      const replies = await Promise.all(names.map((y) => ask("diagram", { ...common, y })));
      lines(replies.map(({ head, columns }) => ({ ...head, ...columns })));
    }
  });

  function placeOf(d, p, i) {
    const place = [...d.place];
    place[0] = p;
    place[d.dimension] = i;
    return place;
  }

  const word = (code) => (code === -1 ? "not run yet" : code === -2 ? "failed" : meta.responses[code].name);

  function lines(all) {
    view.all = all;
    const seen = new Set();
    all.forEach((d, number) => {
      const box = make("div");
      $("diagram").append(box);
      charts.push(
        N.scatter(box, d, {
          responses: meta.responses, visible: [...view.visible], height: all.length > 1 ? (number === all.length - 1 ? 222 : 190) : 430,
          bare: number < all.length - 1, sync: "sweep", move: (hit) => hit && hover(d, hit),
          pick: (hit) => ("curve" in hit ? orbit(d, hit) : pick(d, hit.p, hit.i)),
        }),
      );
      for (const code of d.outcome) seen.add(code);
    });
    const d = all[0];
    const items = meta.responses.map((one, code) => [one, code]).filter(([, code]) => seen.has(code))
      .map(([one]) => make("li", {}, N.swatch(one.marker, one.colour), one.name));
    if (d.procedures.includes("down") && d.procedures.length > 1)
      items.push(make("li", {}, N.swatch("o", "#4D4D4D"), "up: filled"), make("li", {}, N.swatch("o", "#4D4D4D", false), "down: open"));
    if (d.hysteresis.length) items.push(make("li", {}, N.swatch("s", "#E8D47A"), "up and down differ"));
    if (seen.has(-2)) items.push(make("li", {}, N.swatch("X", "#000"), "failed"));
    if (d.curves) items.push(make("li", {}, "black line: branch, solid where stable, dashed where not"));
    items.push(...all.flatMap(N.lineEntries));
    if (d.note) items.push(make("li", {}, d.note));
    $("legend").replaceChildren(...items);
    view.count = d.x.values.length;
    live();
  }

  function hover(d, { p, i, value, curve, at }) {
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
    if (d.told) {
      const count = d.told.length && d.head_told ? d.head_told.length : 0;
      const said = [];
      for (let k = 0; k < count; k++) {
        const number = d.told[(p * d.x.values.length + i) * count + k], one = d.head_told[k];
        if (Number.isFinite(number)) said.push(`${one.words} ${amount(number, one.unit, 3)}`);
      }
      head.push(make("br"), said.join(" · "));
    }
    $("hover").replaceChildren(...head);
  }

  function map({ head, columns }) {
    const d = { ...head, ...columns };
    view.all = [d];
    const say = (hit) => {
      if (!hit) return;
      const shown = hit.outcome < 0 ? word(hit.outcome) : d.classes ? (d.classes[hit.value] || {}).name || "–" : amount(hit.value, d.colour.unit);
      $("hover").replaceChildren(
        make("span", { class: "name" }, `${d.x.words} ${valueOf(d.x, hit.i, 5)}, ${d.y.words} ${valueOf(d.y, hit.j, 5)}${d.procedures.length > 1 ? `, ${d.procedures[hit.p]}` : ""}`),
        make("br"), `${d.colour.words}: ${shown}`,
      );
    };
    const made = N.cells($("diagram"), d, {
      procedure: view.procedure, height: 480, move: say,
      pick: (hit) => { made.choose(hit.i, hit.j); view.chosen = [hit.i, hit.j]; run(mapPlace(d, hit.i, hit.j)); },
    });
    charts = [{ ...made, show() {}, live() {} }];
    const values = new Set(d.values);
    $("legend").replaceChildren(
      ...(d.classes
        ? d.classes.filter((_, code) => values.has(code)).map((one) => make("li", {}, N.swatch("s", one.colour), one.name))
        : [0, 0.25, 0.5, 0.75, 1].map((part) => make("li", {}, N.swatch("s", `rgb(${N.mix(part).join()})`), amount(d.limits[0] + part * (d.limits[1] - d.limits[0]), d.colour.unit, 3)))),
    );
    view.say = (i, j) => say({ p: view.procedure, i, j, value: d.values[(view.procedure * d.y.values.length + j) * d.x.values.length + i], outcome: d.outcome[(view.procedure * d.y.values.length + j) * d.x.values.length + i] });
  }

  function mapPlace(d, i, j) {
    const place = [...d.place];
    place[0] = view.procedure;
    place[d.x.dimension] = i;
    place[d.y.dimension] = j;
    return place;
  }

  function orbit(d, hit) {
    for (const one of charts) one.choose(-1, hit.at);
    view.chosen = null;
    view.point = hit.curve;
    follow(d, hit.curve);
  }

  function choose(p, i) {
    view.chosen = [p, i];
    for (const one of charts) one.choose(p, i);
  }

  function pick(d, p, i) {
    choose(p, i);
    run(placeOf(d, p, i));
  }

  // With the keyboard: left and right along the axis, up and down the procedure or the other axis.
  $("diagram").addEventListener("keydown", (event) => {
    if (!view || !view.all) return;
    if (!view.all[0].x.values.length) { along(event); return; }
    const steps = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    const d = view.all[0], n = d.x.values.length, clip = (value, count) => Math.min(Math.max(value, 0), count - 1);
    const far = event.shiftKey ? 10 : 1;
    if (steps) {
      event.preventDefault();
      if (view.map) {
        const [i, j] = view.chosen || [Math.floor(n / 2), Math.floor(d.y.values.length / 2)];
        view.chosen = [clip(i + far * steps[0], n), clip(j + far * steps[1], d.y.values.length)];
        charts[0].choose(...view.chosen);
        view.say(...view.chosen);
      } else {
        const shown = d.procedures.map((_, p) => p).filter((p) => view.visible[p]); // the arrow up goes to the one before: "up"
        if (!shown.length) return;
        const [p, i] = view.chosen || [shown[0], Math.floor(n / 2)];
        choose(shown[clip(Math.max(shown.indexOf(p), 0) - steps[1], shown.length)], clip(i + far * steps[0], n));
        const [q, k] = view.chosen, K = d.values.shape[2];
        hover(d, { p: q, i: k, value: d.values[(q * n + k) * K] });
      }
    } else if ((event.key === "Enter" || event.key === " ") && view.chosen) {
      event.preventDefault();
      run(view.map ? mapPlace(d, ...view.chosen) : placeOf(d, ...view.chosen));
    }
  });

  // Of branches alone: left and right along a branch, up and down to the next one, at its point nearest to this one.
  function along(event) {
    const d = view.all[0], sizes = d.curves.sizes, firsts = sizes.map((_, b) => sizes.slice(0, b).reduce((a, n) => a + n, 0));
    const branchOf = (point) => firsts.filter((first) => first <= point).length - 1, clip = (v, low, high) => Math.min(Math.max(v, low), high);
    const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key], other = { ArrowUp: -1, ArrowDown: 1 }[event.key];
    if (step || other) {
      event.preventDefault();
      const xs = d["curve x"], start = view.point === undefined, now_ = start ? Math.floor(sizes[0] / 2) : view.point, b = branchOf(now_);
      const forward = xs[firsts[b]] <= xs[firsts[b] + sizes[b] - 1] ? 1 : -1; // the arrow to the right goes to the right, folds aside
      if (start) view.point = now_;
      else if (step) view.point = clip(now_ + step * forward * (event.shiftKey ? 10 : 1), firsts[b], firsts[b] + sizes[b] - 1);
      else {
        const next = clip(b + other, 0, sizes.length - 1);
        let best = firsts[next];
        for (let i = best; i < firsts[next] + sizes[next]; i++) if (Math.abs(xs[i] - xs[now_]) < Math.abs(xs[best] - xs[now_])) best = i;
        view.point = best;
      }
      for (const one of charts) one.choose(-1, xs[view.point]);
      charts.forEach((one, k) => one.live([[xs[view.point], [view.all[k]["curve y"][view.point]]]]));
      hover(d, { curve: view.point, value: d["curve y"][view.point], at: xs[view.point] });
    } else if ((event.key === "Enter" || event.key === " ") && view.point !== undefined) {
      event.preventDefault();
      follow(d, view.point);
    }
  }

  // ---- the motion

  const seconds = () => Number($("seconds").value);

  const run = inTurn(async (place) => {
    const reply = await ask("replay", { place, seconds: seconds() });
    now.place = place;
    now.changes = {};
    now.kept = {};
    present(reply);
  });

  // The motion of a point of a branch; sliders go on from it.
  const follow = inTurn(async (d, point) => {
    const reply = await ask("orbit", { point });
    now.place = d.place;
    now.changes = { ...reply.head.changes };
    now.kept = { ...now.changes };
    present(reply);
  });

  // A change that is refused is taken back, or all that come after it would be refused with it.
  const move = inTurn(async (question = {}) => {
    const asked = { ...now.changes };
    let reply;
    try {
      reply = await ask("live", {
        place: now.place, changes: asked, state: now.state, states: now.states, seconds: Math.min(seconds(), 200), ...question,
      });
    } catch (error) {
      for (const [key, value] of Object.entries(asked))
        if (now.changes[key] === value && now.kept[key] !== value) {
          if (key in now.kept) now.changes[key] = now.kept[key];
          else delete now.changes[key];
        }
      sliders();
      throw error;
    }
    now.kept = asked;
    present(reply);
  });

  function present(reply) {
    now.reply = reply;
    now.state = reply.head.state;
    now.states = reply.head.states;
    now.values = reply.head.values;
    motion.show(reply);
    const h = reply.head, which = $("which");
    const name = h.from ? h.from.map(([a, b]) => `${a} ${b}`).join(", ") : meta.usual.map((key) => slider(key)).filter(Boolean).map((one) => `${one.words} ${one.choices ? now.values[one.key] : amount(now.values[one.key] / one.scale, one.unit, 5)}`).join(", ");
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
    sliders();
    live();
  }

  const section = inTurn(async () => N.section($("section"), await ask("section", { place: now.place })));
  $("section-box").addEventListener("toggle", () => { if ($("section-box").open && now.place) section(); });

  // The peaks of the present motion, as rings in the diagram: where the hand has taken the string.
  function live() {
    if (!view || !view.all || view.map || !now.reply || now.reply.head.begins === "stored") {
      for (const one of charts) one.live([]);
      return;
    }
    view.all.forEach((d, number) => {
      const panel = meta.choices.panels.find((one) => one.name === d.y.name);
      const samples = panel && now.reply.columns[panel.trace], x = now.values[d.x.key];
      charts[number].live(samples && x != null ? [[x / d.x.scale, N.peaks(samples, 24)]] : []);
    });
  }

  // ---- sliders

  const slider = (key) => meta.sliders.find((one) => one.key === key);
  const rows = new Map();

  // A word of the study: one of its choices. What is compiled for it is made when it is first chosen.
  function choice(key, one, id) {
    const select = make("select", { id });
    options(select, one.choices.map((word) => [word, word.replaceAll("_", " ")]), one.value);
    const node = make("div", { class: "slider" }, make("label", { htmlFor: id, title: one.meaning }, one.words), select);
    select.addEventListener("change", () => { now.changes[key] = select.value; move(); });
    rows.set(key, { node, select, one });
    $("sliders").append(node);
    sliders();
  }

  function row(key) {
    const one = slider(key);
    if (!one || rows.has(key)) return;
    const id = `s-${key.replaceAll(".", "-")}`;
    if (one.choices) { choice(key, one, id); return; }
    const range = make("input", { type: "range", id, min: one.low, max: one.high, step: one.whole ? 1 : "any", value: one.value });
    const text = make("input", { type: "text", "aria-label": `${one.words}, a number with its unit`, spellcheck: false });
    const label = make("label", { htmlFor: id, title: one.meaning }, one.words);
    const node = make("div", { class: "slider" }, label, range, text);
    range.addEventListener("input", () => {
      now.changes[key] = Number(range.value);
      text.value = amount(range.value / one.scale, one.unit, 4);
      range.setAttribute("aria-valuetext", text.value);
      node.classList.add("changed");
      move();
    });
    text.addEventListener("change", () => {
      const typed = text.value.trim();
      if (!typed) return;
      const bare = /^[-+]?[\d.]+(e[-+]?\d+)?$/i.test(typed);
      now.changes[key] = bare ? Number(typed) * one.scale : typed;
      move();
    });
    rows.set(key, { node, range, text, one });
    $("sliders").append(node);
    sliders();
  }

  function sliders() {
    for (const [key, { node, range, text, select, one }] of rows) {
      const value = now.values[key] ?? one.value;
      node.classList.toggle("changed", key in now.changes);
      if (select) { select.value = value; continue; }
      if (value < Number(range.min)) range.min = value;
      if (value > Number(range.max)) range.max = value;
      if (document.activeElement !== range) range.value = value;
      if (document.activeElement !== text) text.value = amount(value / one.scale, one.unit, 5);
      range.setAttribute("aria-valuetext", text.value);
    }
  }

  // ---- a diagram around the present point

  const around = inTurn(async (key) => {
    $("local-run").textContent = "Running …";
    try {
      const reply = await ask("local", { place: now.place, changes: now.changes, state: now.state, states: now.states, key });
      draw(key, reply);
    } finally {
      $("local-run").textContent = "Draw diagram";
    }
  });

  function draw(key, { head, columns }) {
    $("local").hidden = false;
    if (local) for (const one of local.charts) one.end();
    $("local-diagram").replaceChildren();
    $("local-title").textContent = `${head.x.words} around ${amount(head.centre, head.x.unit)}: ${head.x.values.length} points, each from the present state, after ${head.settle} s observed for ${head.observe} s`;
    const from = { place: now.place, changes: { ...now.changes } };
    local = { charts: [], chosen: null, head };
    const all = head.panels.map((panel) => ({
      ...head, y: panel, values: columns[panel.name], still: columns[`${panel.name} still`], outcome: columns.outcome,
    }));
    local.all = all;
    local.pick = (i) => {
      local.chosen = i;
      for (const one of local.charts) one.choose(0, i);
      now.place = from.place;
      now.changes = { ...from.changes, [key]: head.exact[i] };
      move({ state: head.state, states: head.states, settle: head.settle, observe: head.observe });
    };
    local.say = (i, value, d = all[0]) => {
      $("local-hover").textContent = `${head.x.words} ${amount(head.x.values[i], head.x.unit, 5)}: ${word(d.outcome[i])}${Number.isFinite(value) ? `, ${d.y.words} ${amount(value, d.y.unit)}` : ""}`;
    };
    all.forEach((d, number) => {
      const box = make("div");
      $("local-diagram").append(box);
      local.charts.push(
        N.scatter(box, d, {
          responses: meta.responses, height: number === all.length - 1 ? 182 : 150, bare: number < all.length - 1, sync: "local",
          move: (hit) => hit && local.say(hit.i, hit.value, d), pick: (hit) => local.pick(hit.i),
        }),
      );
    });
    local.say(Math.floor(head.x.values.length / 2), NaN);
  }
  $("local-diagram").addEventListener("keydown", (event) => {
    if (!local) return;
    const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key], n = local.head.x.values.length;
    if (step) {
      event.preventDefault();
      local.chosen = Math.min(Math.max((local.chosen ?? Math.floor(n / 2)) + step, 0), n - 1);
      for (const one of local.charts) one.choose(0, local.chosen);
      local.say(local.chosen, NaN);
    } else if (event.key === "Enter" && local.chosen !== null) {
      event.preventDefault();
      local.pick(local.chosen);
    }
  });

  // ---- saving: the browser keeps the file, under a name of its own choice

  function offer(name, blob) {
    const url = URL.createObjectURL(blob), link = make("a", { href: url, download: name });
    document.body.append(link);
    link.click();
    link.remove();
    setTimeout(() => URL.revokeObjectURL(url), 10000);
  }
  $("save-study").addEventListener("click", inTurn(async () => {
    const { text, name } = await ask("saved", { place: now.place, changes: now.changes, state: now.state, states: now.states });
    offer(name, new Blob([text], { type: "application/yaml" }));
  }));
  $("save-picture").addEventListener("click", () => {
    const lines = [meta.about, $("which").textContent && [...$("which").children].slice(0, 2).map((one) => one.textContent).join(": ")].filter(Boolean);
    N.picture([$("sweep"), $("point"), $("local")].filter((one) => !one.hidden), meta.title, lines).toBlob((blob) => offer("nsdrill.png", blob));
  });

  // ---- the beginning

  async function begin() {
    if (!token) {
      banner("The address lacks its token, the part after #. Open the address that nsdrill view printed.");
      return;
    }
    meta = await ask("meta");
    alive();
    document.title = `${meta.title} – nsdrill`;
    $("title").textContent = meta.title;
    meta.about = [meta.file, meta.model, ...(meta.points ? [`${meta.points} points`] : []), ...meta.overrides].join(" · ");
    $("about").textContent = meta.about;
    options($("seconds"), [...new Set([meta.seconds, 60, 200, meta.longest])].filter((one) => one <= meta.longest || one === meta.seconds).sort((a, b) => a - b).map((one) => [String(one), one === meta.longest ? `all ${digits(one)} s` : `last ${digits(one)} s`]), String(meta.seconds));
    motion = N.motion($("motion"), meta.drawn);
    for (const key of meta.usual) row(key);
    const others = meta.sliders.filter((one) => !meta.usual.includes(one.key));
    options($("more"), [["", "choose …"], ...others.map((one) => [one.key, one.words])], "");
    $("more").addEventListener("change", () => { row($("more").value); $("more").value = ""; });
    options($("around"), meta.sliders.filter((one) => !one.choices && !one.whole).map((one) => [one.key, one.words]), meta.usual[0]);
    const along = meta.choices && meta.choices.axes.length && slider(meta.choices.axes[0].key);
    if (along && !along.choices && !along.whole) $("around").value = along.key;
    $("seconds").addEventListener("change", () => (now.place && now.reply.head.begins === "stored" ? run(now.place) : now.state && move()));
    $("again").addEventListener("click", () => { now.changes = {}; now.kept = {}; if (now.place) run(now.place); else move({ state: null }); });
    $("onward").addEventListener("click", () => move());
    $("local-run").addEventListener("click", () => around($("around").value));
    $("which").textContent = "No point is chosen yet.";
    if (meta.choices && meta.choices.axes.length) {
      if (meta.kind === "branches") {
        $("hover").textContent = "Point at a branch; click a point of it to run its motion.";
        $("diagram").setAttribute("aria-label", "Branches. Left and right arrows go along a branch, up and down to another, Enter runs the point.");
      }
      controls();
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
