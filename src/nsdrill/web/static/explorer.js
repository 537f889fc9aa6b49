"use strict";
// The explorer: the choices of the user, and the requests to the server, which gives all names, units, colours and ranges.
(() => {
  const N = window.nsdrill, { make, digits, amount, valueOf } = N;
  const $ = (id) => document.getElementById(id);
  let meta = null, view = null, motion = null, charts = [], pinned = null;
  // The present point: its place in the sweep, the changed values, the changes that the server accepted, and the state that
  // the next motion starts from.
  const now = { place: null, changes: {}, accepted: {}, state: null, states: null, values: {}, reply: null, request: null };

  // The part of the address after #: the token of the explorer where it was printed, and what is shown (writeLink). The token is
  // kept by the browser for this explorer, so that an address can be copied without it.
  const STORED = "nsdrill-token";
  const fragment = location.hash.slice(1), given = /^[^=&]+(?=&|$)/.exec(fragment)?.[0] || "";
  const linked = new URLSearchParams(given ? fragment.slice(given.length + 1) : fragment);
  let isKept = true;
  const stored = (work) => { try { return work(localStorage); } catch { isKept = false; return null; } }; // a frame may not keep anything
  const token = given || stored((store) => store.getItem(STORED)) || "";
  addEventListener("hashchange", () => location.reload());

  // Write what is shown into the address, soon: while a slider moves, browsers refuse to do that at every step.
  let linkTimer = 0;
  function writeLink() {
    clearTimeout(linkTimer);
    linkTimer = setTimeout(writeLinkNow, 250);
  }
  function writeLinkNow() {
    const shown = new URLSearchParams();
    if (view) {
      shown.set("show", $("channel").value);
      if (!$("along-label").hidden) shown.set("x", $("along").value);
      if (!$("against-label").hidden) shown.set("y", $("against").value);
      if (Object.keys(view.held).length) shown.set("held", JSON.stringify(view.held));
      if (view.member) shown.set("member", view.member);
      if (view.procedure) shown.set("procedure", view.procedure);
      if (view.hidden.size) shown.set("hidden", JSON.stringify([...view.hidden]));
    }
    if ($("seconds").value !== String(meta.seconds)) shown.set("seconds", $("seconds").value);
    if (now.request) shown.set("run", JSON.stringify(now.request));
    history.replaceState(null, "", `#${isKept ? "" : `${token}&`}${shown}`);
  }

  const { banner, ask, keepAlive, latestOnly } = N.asking(token, $("banner"), () => (meta ? meta.command : "nsdrill view FILE"));

  // ---- the diagram of the sweep

  const options = (select, list, chosen) =>
    select.replaceChildren(...list.map(([value, words]) => make("option", { value, selected: value === chosen }, words)));

  function linkedData(name, otherwise) {
    try { return JSON.parse(linked.get(name)) || otherwise; } catch { return otherwise; }
  }

  function addControls() {
    const c = meta.choices, several = c.axes.length > 1;
    $("sweep").hidden = false;
    const channels = [];
    channels.push(...c.areas.map((item) => [`area ${item.name}`, item.words]));
    if (several) channels.push(...c.labels.map((item) => [`map ${item.name}`, `Map: ${item.long}`]), ...c.features.map((item) => [`map ${item.name}`, `Map: ${item.words}`]));
    if (c.axes.length) {
      if (c.panels.length) channels.push(["all", "Peaks of all motions"], ...c.panels.map((item) => [`line ${item.name}`, item.words]));
      channels.push(...c.features.map((item) => [`line ${item.name}`, item.words]));
    }
    const longest = [...c.axes].sort((a, b) => (a.texts ? 1 : 0) - (b.texts ? 1 : 0) || b.values.length - a.values.length).map((item) => item.name);
    const second = several ? c.axes.find((item) => item.name === longest[1]).values.length : 0;
    const first = channels.some(([value]) => value === linked.get("show")) ? linked.get("show") : c.areas.length ? channels[0][0] : several && second > 3 ? "map response" : c.panels.length ? "all" : channels[0][0];
    options($("channel"), channels, first);
    const usual = /^(area|map) /.test(first) ? c.map_axes : longest;
    options($("along"), c.axes.map((item) => [item.name, item.words]), linked.get("x") || usual[0]);
    options($("against"), c.axes.map((item) => [item.name, item.words]), linked.get("y") || usual[1]);
    $("channel").addEventListener("change", redraw);
    for (const id of ["along", "against"])
      $(id).addEventListener("change", () => {
        if ($("along").value === $("against").value) {
          const other = c.axes.find((item) => item.name !== $(id).value).name;
          $(id === "along" ? "against" : "along").value = other;
        }
        redraw();
      });
    view = {
      held: linkedData("held", {}), member: Number(linked.get("member") || 0), visible: c.procedures.map(() => true),
      procedure: Math.min(Number(linked.get("procedure") || 0), c.procedures.length - 1), chosen: null, hidden: new Set(linkedData("hidden", [])),
    };
  }

  // The selection of procedures: one of a map, any of lines.
  function procedureControls() {
    const c = meta.choices;
    $("procedures").replaceChildren();
    if (c.procedures.length < 2 || view.kind === "area probability") return;
    $("procedures").append(
      ...(view.map ? ["A click here runs"] : []),
      ...c.ways.map((name, p) => {
        const tick = make("input", { type: view.map ? "radio" : "checkbox", name: "procedure", checked: view.map ? p === view.procedure : view.visible[p] });
        tick.addEventListener("change", () => {
          if (view.map) { view.procedure = p; writeLink(); return; }
          view.visible[p] = tick.checked;
          for (const chart of charts) chart.show(view.visible);
        });
        return make("label", {}, tick, ` ${name} `);
      }),
    );
  }

  // Selects for the axes that the drawing does not show.
  function heldControls(free, byItself) {
    const c = meta.choices, home = $("held");
    home.replaceChildren();
    for (const axis of c.axes) {
      if (free.includes(axis.name)) continue;
      const select = make("select", {}, ...axis.values.map((value, i) => make("option", { value: i, selected: i === (view.held[axis.name] || 0) }, valueOf(axis, i))));
      select.addEventListener("change", () => { view.held[axis.name] = Number(select.value); redraw(); });
      home.append(make("label", {}, `${axis.words} `, select, " "));
    }
    if (c.members && !byItself) {
      const { name, count } = c.members, field = make("input", { type: "number", min: 0, max: count - 1, value: view.member });
      field.addEventListener("change", () => { view.member = Math.min(Math.max(0, Math.round(Number(field.value) || 0)), count - 1); redraw(); });
      home.append(make("label", {}, `${name} `, field));
    }
  }

  // The answer of a window, and its warnings: their words in capitals, and all on request.
  function tellAnswer({ answer, lines = [], warnings }) {
    if (!answer) return;
    const names = warnings.map((text) => text.match(/^[A-Z -]*(?![a-z])/)[0].trim());
    const told = make("details", {}, make("summary", {}, names.join(" · ")), make("ul", {}, ...warnings.map((text) => make("li", {}, text))));
    const beside = make("ul", {}, ...lines.map((text) => make("li", {}, text)));
    $("answer").replaceChildren(make("p", {}, answer), ...(lines.length ? [beside] : []), ...(warnings.length ? [told] : []));
    $("answer").hidden = false;
  }

  const redraw = latestOnly(async () => {
    const [kind, name] = $("channel").value.split(" "), c = meta.choices, several = c.axes.length > 1;
    const x = $("along").value, y = $("against").value;
    view.kind = $("channel").value;
    view.map = kind === "map" || kind === "area";
    const byItself = kind === "area"; // an area knows its axes
    const free = kind === "map" ? [x, y] : [x];
    const fixed = () => Object.fromEntries(Object.entries(view.held).filter(([axis]) => !free.includes(axis)));
    for (const chart of charts) chart.end();
    charts = [];
    $("diagram").replaceChildren();
    view.chosen = null;
    let panels = null, all = null;
    $("answer").hidden = true;
    if (byItself) {
      const area = joined(await ask("area", { name, held: view.held }));
      tellAnswer(area);
      if (!area.x_edges) all = [area];
      else {
        free.splice(0, 2, area.x.name, area.y.name);
        panels = area.procedures.map((words, p) => ({ d: area.scales ? { ...area, scale: area.scales[p] } : area, panel: p, procedure: null, title: words || area.title, safe: area.safe }));
        if (name === "window") {
          const d = joined(await ask("plane", { held: fixed(), member: view.member, x: area.x.name, y: area.y.name, colour: "response" }));
          panels.push(...planesOf(d, "Responses").map((one) => ({ ...one, safe: area.safe })));
        }
      }
    } else if (view.map) {
      const d = joined(await ask("plane", { held: fixed(), member: view.member, x, y, colour: name })), [up, down] = ["up", "down"].map((one) => d.procedures.indexOf(one));
      panels = planesOf(d, d.colour.words);
      if (up >= 0 && down >= 0) {
        const differing = N.difference(d, up, down);
        panels.push({ d: differing, panel: 0, procedure: null, title: differing.procedures[0] });
      }
    } else {
      const names = kind === "all" ? c.panels.map((item) => item.name) : [name];
      all = (await Promise.all(names.map((one) => ask("diagram", { held: fixed(), member: view.member, x, y: one })))).map(joined);
    }
    view.map = panels !== null;
    $("along-label").hidden = !several || byItself;
    $("against-label").hidden = $("along-label").hidden || !view.map;
    heldControls(free, byItself);
    procedureControls();
    document.querySelector("main").classList.toggle("wide", view.map && panels.length > 1);
    if (panels) drawMaps(panels);
    else drawLines(all);
    markPlace();
    writeLink();
  });
  const joined = ({ head, columns }) => ({ ...head, ...columns });
  const planesOf = (d, words) => d.ways.map((way, p) => ({ d, panel: p, procedure: p, title: `${words}${d.ways.length > 1 ? `, ${way}` : ""}` }));

  function placeOf(d, p, i) {
    const place = [...d.place];
    place[0] = d.joined ? view.procedure : p; // the lines of probabilities are no procedures
    place[d.dimension] = i;
    return place;
  }

  const word = (code) => meta.unknown[code] ?? meta.responses[code].name;

  function drawLines(all) {
    view.all = all;
    $("diagram").style.gridTemplateColumns = "";
    all.forEach((d, number) => {
      const box = make("div");
      $("diagram").append(box);
      charts.push(
        N.scatter(box, d, {
          responses: meta.responses, visible: d.procedures.map((_, p) => view.visible[p] ?? true), hidden: view.hidden, height: all.length > 1 ? (number === all.length - 1 ? 222 : 190) : 430,
          bare: number < all.length - 1, sync: "sweep", move: (hit) => hit && showPoint(d, hit),
          pick: (hit) => ("curve" in hit ? pickBranch(d, hit) : pick(d, hit.p, hit.i)),
        }),
      );
    });
    const d = all[0];
    $("legend").replaceChildren(...N.legendOf(all, meta, view.hidden, () => { for (const chart of charts) chart.redraw(); writeLink(); }));
    $("hover").textContent = meta.kind === "branches" ? "Point at a branch; click a point of it to run its motion." : "Point at the diagram for numbers; click a point to run it again.";
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
      make("span", { class: "name" }, `${d.x.words} ${valueOf(d.x, i, 5)}${d.procedures.length > 1 ? `, ${(d.ways ?? d.procedures)[p]}` : ""}: ${word(code)}`),
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

  // Maps next to each other: a click in one runs the point in its procedure, or in the chosen one.
  function drawMaps(panels) {
    view.all = panels.map((one) => one.d);
    view.panels = panels;
    view.showCell = (i, j) => {
      const d = panels[0].d, at = j * d.x.values.length + i, cells = d.x.values.length * d.y.values.length;
      const texts = panels.map(({ d: one, panel, title }) => {
        const value = one.values[panel * cells + at], outcome = one.outcome[panel * cells + at];
        return `${title}: ${outcome < 0 ? word(outcome) : one.classes ? (one.classes[value] || {}).name || "–" : one.silent && !Number.isFinite(value) ? one.silent.name : amount(value, one.colour.unit)}`;
      });
      $("hover").replaceChildren(make("span", { class: "name" }, `${d.x.words} ${valueOf(d.x, i, 5)}, ${d.y.words} ${valueOf(d.y, j, 5)}`), make("br"), texts.join(" · "));
    };
    const several = panels.length > 1;
    panels.forEach(({ d, panel, procedure, title, safe }, number) => {
      const box = make("div");
      $("diagram").append(box);
      const cells = N.cells(box, d, {
        panel, title, safe, bareY: number > 0 && several && !narrow.matches, height: several ? 250 : 450,
        move: (hit) => hit && view.showCell(hit.i, hit.j), pick: (hit) => pickCell(hit.i, hit.j, procedure),
      });
      charts.push({ ...cells, show() {}, live() {} });
    });
    // the first one has the numbers of the axis
    $("diagram").style.gridTemplateColumns = several && !narrow.matches ? `minmax(0, calc(${100 / panels.length}% + ${Math.round(54 * (1 - 1 / panels.length))}px)) repeat(${panels.length - 1}, minmax(0, 1fr))` : "";
    // of classes every one once; of values those of each colour scale, after what has them
    const keyOf = ({ d }) => (d.classes ? "" : JSON.stringify([d.scale, d.limits])), scales = new Map(panels.filter(({ d }) => !d.classes).map((one) => [keyOf(one), one]));
    const classes = new Map([...new Set(view.all)].filter((d) => d.classes).flatMap((d) => N.mapLegendOf(d, meta)).map((item) => [item.textContent, item]));
    const ofScales = [...scales].flatMap(([key, one]) => [...(scales.size > 1 ? [make("li", {}, `${panels.filter((other) => keyOf(other) === key).map((other) => other.title).join(", ")}:`)] : []), ...N.mapLegendOf(one.d, meta)]);
    $("legend").replaceChildren(...classes.values(), ...ofScales, ...(panels.some(({ safe }) => safe && safe.includes(0) && safe.includes(1)) ? [N.dash("#000", view.kind === "area probability" ? "border of 90 % safe" : "border of the operating window")] : []));
    $("hover").textContent = "Point at a map for numbers; click a cell to run it again.";
  }
  const narrow = matchMedia("(max-width: 860px)");

  function pickCell(i, j, procedure = null) {
    view.chosen = [i, j];
    for (const chart of charts) chart.choose(i, j);
    view.showCell(i, j);
    run(mapPlace(view.all[0], i, j, procedure ?? view.procedure));
  }

  function mapPlace(d, i, j, procedure) {
    const place = [...d.place];
    place[0] = procedure;
    place[d.x.dimension] += i * (d.x.step || 1);
    place[d.y.dimension] += j * (d.y.step || 1);
    return place;
  }

  // The cell of a place in the maps that are drawn.
  function cellOf(place) {
    const { x, y } = view.all[0], step = x.step || 1;
    const i = x.dimension === y.dimension ? Math.floor(place[x.dimension] / step) : place[x.dimension];
    return [i, x.dimension === y.dimension ? place[y.dimension] % step : place[y.dimension]];
  }

  // Mark the present point of the sweep, or of a branch, in what is drawn.
  function markPlace() {
    if (!view || !view.all) return;
    const [name, { point }] = now.request || ["", {}], xs = view.all[0]["curve x"];
    if (name === "orbit" && xs) {
      Object.assign(view, { point, chosen: null });
      for (const chart of charts) chart.choose(-1, xs[point]);
    }
    if (!now.place || meta.kind !== "results" || name === "orbit") return;
    const d = view.all[0], free = [0, d.dimension, d.x.dimension, d.y.dimension];
    if (!d.place || d.place.some((at, k) => !free.includes(k) && at !== now.place[k])) return; // it lies elsewhere
    if (view.map) view.chosen = cellOf(now.place);
    else view.chosen = [now.place[0], now.place[d.dimension]];
    if (view.chosen) for (const chart of charts) chart.choose(...view.chosen);
    if (view.map && view.chosen) view.showCell(...view.chosen);
  }

  // The point to begin with: the one that is recommended, the most probable one, or that in the middle.
  function chooseFirst() {
    const d = view.all[0];
    if (view.map) {
      const [nx, ny] = [d.x.values.length, d.y.values.length];
      let best = d.recommended || [Math.floor(nx / 2), Math.floor(ny / 2)];
      if (!d.recommended && view.kind === "area probability") {
        const greatest = d.values.subarray(0, nx * ny).reduce((a, value, k, all) => (value > all[a] ? k : a), 0);
        best = [greatest % nx, Math.floor(greatest / nx)];
      }
      return pickCell(...best);
    }
    if (!d.x.values.length) return pickBranch(d, { curve: Math.floor(d.curves.sizes[0] / 2), at: d["curve x"][Math.floor(d.curves.sizes[0] / 2)] });
    if (!d.place) return undefined;
    const n = d.x.values.length, middle = Math.floor(n / 2);
    const nearest = [...Array(n).keys()].sort((a, b) => Math.abs(a - middle) - Math.abs(b - middle)).find((i) => d.outcome[i] >= 0);
    return nearest === undefined ? undefined : pick(d, 0, nearest);
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
        for (const chart of charts) chart.choose(...view.chosen);
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
      if (view.map) pickCell(...view.chosen);
      else run(placeOf(d, ...view.chosen));
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

  // What a request for a motion does to the present point: the point of a file, that of a branch, or from where it is.
  const POINTS = {
    replay: ({ place }) => ({ place, changes: {} }),
    orbit: (request, reply) => ({ place: view.all ? view.all[0].place : null, changes: { ...reply.head.changes } }),
    live: ({ place, changes }) => ({ place, changes: { ...changes } }),
  };

  // Ask for a motion and show it. The motion before is kept for Undo, of one movement of a slider (`stroke`) only once.
  async function runMotion(name, request, stroke = null) {
    const reply = await ask(name, request);
    if (now.reply && !(stroke && stroke.kept)) {
      past.push({ ...now });
      past.splice(0, past.length - MOST_PAST);
      if (stroke) stroke.kept = true;
    }
    const { place, changes } = POINTS[name](request, reply);
    Object.assign(now, { place, changes, accepted: { ...changes }, request: [name, request] });
    showMotion(reply);
  }
  const past = [], MOST_PAST = 50;

  const run = latestOnly((place) => runMotion("replay", { place, seconds: seconds() }));

  // The motion of a point of a branch; the sliders start from it.
  const follow = latestOnly((d, point) => runMotion("orbit", { point }));

  const undo = latestOnly(async () => {
    const before = past.pop();
    if (!before) return;
    Object.assign(now, before);
    showMotion(now.reply);
    markPlace();
  });

  // A change that the server refuses is undone, or the server would refuse all later ones with it.
  const move = latestOnly(async (request = {}, stroke = null) => {
    const changes = { ...now.changes };
    try {
      await runMotion("live", {
        place: now.place, changes, state: now.state, states: now.states, seconds: Math.min(seconds(), 200), ...request,
      }, stroke);
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
  });

  // Run from a start that was clicked in the hole or in a phase plane: the present state with these values, as shown.
  function startAt(values) {
    if (!now.state) return;
    const state = [...now.state], channels = now.reply.head.channels;
    for (const [name, value] of Object.entries(values)) {
      const place = now.states.indexOf(name), channel = channels.find((one) => one.name === name);
      if (place < 0) {
        banner(`${channel ? channel.words : name} is no state of this string, so no start can be chosen here. Click the hole or another plane.`);
        return;
      }
      state[place] = value * channel.scale;
    }
    move({ state, states: now.states, chosen: true });
  }

  function showMotion(reply) {
    now.reply = reply;
    now.state = reply.head.state;
    now.states = reply.head.states;
    now.values = reply.head.values;
    motion.show(reply, pinned);
    if (pinned) pinned.view.show(pinned, reply);
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
    $("again").disabled = $("pin").disabled = $("save-trace").disabled = false;
    $("undo").disabled = !past.length;
    document.body.dataset.moved = "1";
    writeLink();
    $("onward").disabled = $("save-study").disabled = !now.state;
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
    let stroke = null; // one movement of the slider
    range.addEventListener("change", () => { stroke = null; });
    range.addEventListener("input", () => {
      stroke ??= {};
      now.changes[key] = Number(range.value);
      text.value = amount(range.value / quantity.scale, quantity.unit, 4);
      range.setAttribute("aria-valuetext", text.value);
      node.classList.add("changed");
      move({}, stroke);
    });
    text.addEventListener("change", () => {
      const typed = text.value.trim();
      if (!typed) return;
      const isNumber = /^[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$/i.test(typed);
      if (isNumber && quantity.unit) { // a bare number has the unit of its field, which is written behind it
        text.value = `${typed} ${quantity.unit}`;
        text.classList.add("completed");
        setTimeout(() => text.classList.remove("completed"), 2500);
      }
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
  const nameOf = (ending) => `${meta.file.replace(/\.\w+$/, "")}.${ending}`;
  for (const as of ["png", "svg"])
    $(`save-${as}`).addEventListener("click", async () => {
      const wide = document.querySelector("main.wide") !== null;
      const legend = charts.length ? N.legendBoxes($("legend"), $("diagram").clientWidth) : [];
      const left = [...(wide ? [charts] : charts), ...legend];
      const right = pinned ? [[pinned.view.parts(), motion.parts()]] : wide ? [motion.parts().flatMap((row, k) => (k ? [row.flat()] : row))] : motion.parts();
      const lines = [meta.about, ...[...document.querySelectorAll("#answer:not([hidden]) :is(p, summary)")].map((item) => item.textContent), pinned && `Left: ${$("pinned-which").textContent}`, $("which").textContent && [...$("which").children].slice(0, 2).map((item) => item.textContent).join(": ")].filter(Boolean);
      download(nameOf(as), await N.picture(wide ? [[...left, [right]]] : [left, right], meta.title, lines, as));
    });

  // The samples of the motion as they are shown: names and units over each column.
  $("save-trace").addEventListener("click", () => {
    const { head, columns } = now.reply, cell = (value) => (value === value ? String(Number(value.toPrecision(7))) : "nan");
    const heads = ["time [s]", ...head.channels.map((one) => `${one.name} [${one.unit || 1}]`)], series = [columns.time, ...head.channels.map((one) => columns[one.name])];
    const rows = Array.from({ length: head.samples }, (_, i) => series.map((values) => cell(values[i])).join(","));
    download(nameOf("csv"), new Blob([`${[heads.map((one) => (one.includes(",") ? `"${one}"` : one)).join(","), ...rows].join("\n")}\n`], { type: "text/csv" }));
  });

  $("link").addEventListener("click", async () => {
    writeLinkNow();
    try {
      await navigator.clipboard.writeText(location.href);
      $("link").textContent = "Copied";
      setTimeout(() => { $("link").textContent = "Copy link"; }, 2000);
    } catch {
      banner(`The browser does not let the page copy. The address of this view: ${location.href}`);
    }
  });

  $("undo").addEventListener("click", () => undo());
  addEventListener("keydown", (event) => {
    if ((event.ctrlKey || event.metaKey) && event.key === "z" && !event.target.matches("input[type=text]") && !$("undo").disabled) {
      event.preventDefault();
      undo();
    }
  });

  // Keep the shown motion beside the next ones, or let it go.
  $("pin").addEventListener("click", () => {
    pinned = pinned ? null : { ...now.reply };
    $("pinned").hidden = !pinned;
    $("motions").classList.toggle("two", pinned !== null);
    $("pin").textContent = pinned ? "Unpin" : "Pin";
    $("pin").setAttribute("aria-pressed", String(pinned !== null));
    $("pinned-motion").replaceChildren();
    if (pinned) {
      $("pinned-which").textContent = [...$("which").children].slice(0, 2).map((item) => item.textContent).join(": ");
      pinned.view = N.motion($("pinned-motion"), meta.drawn, { sync: "pinned", historyHeight: 70 });
      pinned.view.show(pinned);
    }
    motion.show(now.reply, pinned);
  });

  // ---- the beginning

  async function begin() {
    if (!token) {
      banner("The address lacks its token, the part after #. Open the address that nsdrill view printed.");
      return;
    }
    meta = await ask("meta");
    stored((store) => store.setItem(STORED, token));
    keepAlive();
    document.title = `${meta.title} – nsdrill`;
    $("title").textContent = meta.title;
    meta.about = [...(meta.edited ? [meta.edited] : []), meta.file, meta.model, ...(meta.points ? [`${meta.points} points`] : []), ...meta.overrides].join(" · ");
    $("about").textContent = meta.about;
    options($("seconds"), [...new Set([meta.seconds, 60, 200, meta.longest])].filter((item) => item <= meta.longest || item === meta.seconds).sort((a, b) => a - b).map((item) => [String(item), item === meta.longest ? `all ${digits(item)} s` : `last ${digits(item)} s`]), String(meta.seconds));
    if (linked.get("seconds") && [...$("seconds").options].some((item) => item.value === linked.get("seconds"))) $("seconds").value = linked.get("seconds");
    motion = N.motion($("motion"), meta.drawn, { start: startAt, historyHeight: 70 });
    for (const key of meta.usual) addSlider(key);
    const others = meta.sliders.filter((item) => !meta.usual.includes(item.key));
    options($("more"), [["", "choose …"], ...others.map((item) => [item.key, item.words])], "");
    $("more").addEventListener("change", () => { addSlider($("more").value); $("more").value = ""; });
    $("seconds").addEventListener("change", () => (now.place && now.reply.head.begins === "stored" ? run(now.place) : now.state && move()));
    $("again").addEventListener("click", () => {
      now.changes = {};
      if (now.place && meta.kind === "results") run(now.place);
      else move({ state: null });
    });
    $("onward").addEventListener("click", () => move());
    const c = meta.choices, isDrawn = c && (c.axes.length > 0 || c.areas.length > 0);
    document.querySelector("main").classList.toggle("alone", !isDrawn);
    if (isDrawn) {
      if (meta.kind === "branches") $("diagram").setAttribute("aria-label", "Branches. Left and right arrows go along a branch, up and down to another, Enter runs the point.");
      addControls();
      await redraw();
    }
    document.body.dataset.ready = "1";
    const [name, request] = linkedData("run", []);
    if (name in POINTS && request) await runLinked(name, request);
    else if (isDrawn) chooseFirst();
    else if (c) run(Array(c.dimensions).fill(0));
    else move({ state: null });
  }

  // The motion of an address, with its point marked in the diagram.
  const runLinked = latestOnly(async (name, request) => {
    for (const key of Object.keys(request.changes || {})) addSlider(key);
    await runMotion(name, request);
    markPlace();
  });
  begin().catch((error) => banner(error.message));
})();
