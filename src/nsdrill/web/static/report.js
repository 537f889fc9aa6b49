"use strict";
// Draws the diagrams of a report from the bodies in its page.
(() => {
  const N = window.nsdrill, { make, amount } = N;

  function body(number) {
    const text = atob(document.getElementById(`body${number}`).textContent), bytes = new Uint8Array(text.length);
    for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
    const { head, columns } = N.unpack(bytes.buffer);
    return { head, columns };
  }

  let count = 0;
  for (const place of document.querySelectorAll(".drawing")) {
    const drawing = JSON.parse(place.dataset.draw), replies = drawing.bodies.map(body);
    const word = (code) => (code === -1 ? "not run" : code === -2 ? "failed" : code === -3 ? "not known: a run before it in its chain failed" : drawing.responses[code].name);
    const text = make("p", { class: "hover" }), legend = make("ul", { class: "legend" });
    count += 1;
    if (drawing.kind === "motion") {
      N.motion(place, drawing.drawn, { sync: `motion${count}`, planeHeight: 200 }).show(replies[0]);
    } else if (drawing.kind === "map") {
      const d = { ...replies[0].head, ...replies[0].columns }, box = make("div");
      place.append(box, legend, text);
      N.cells(box, d, {
        panel: drawing.procedure, height: 420, pick() {},
        move(hit) {
          if (!hit) return;
          const shown = hit.outcome < 0 ? word(hit.outcome) : d.classes ? (d.classes[hit.value] || {}).name || "–" : `${d.colour.words} ${amount(hit.value, d.colour.unit, 3)}`;
          text.textContent = `${d.x.words} ${amount(d.x.values[hit.i], d.x.unit, 5)}, ${d.y.words} ${amount(d.y.values[hit.j], d.y.unit, 5)}: ${shown}`;
        },
      });
      legend.append(...N.mapLegendOf(d));
    } else {
      const all = replies.map(({ head, columns }) => ({ ...head, ...columns }));
      all.forEach((d, number) => {
        const box = make("div");
        place.append(box);
        N.scatter(box, d, {
          responses: drawing.responses, height: number === all.length - 1 ? 222 : 190, bare: number < all.length - 1, sync: `sweep${count}`,
          pick() {},
          move(hit) {
            if (!hit) return;
            if ("curve" in hit) {
              text.replaceChildren(
                make("span", { class: "name" }, `${d.x.words} ${amount(hit.at, d.x.unit, 6)}: ${N.branchWords(d, hit.curve)}`),
                make("br"), `${d.y.words} ${amount(hit.value, d.y.unit)}`,
              );
              return;
            }
            const n = d.x.values.length, f = d.hover_quantities.length;
            const numbers = d.hover_quantities.map((quantity, k) => [quantity, d.hover[(hit.p * n + hit.i) * f + k]]).filter(([, value]) => Number.isFinite(value));
            text.replaceChildren(
              make("span", { class: "name" }, `${d.x.words} ${amount(d.x.values[hit.i], d.x.unit, 5)}${d.procedures.length > 1 ? `, ${d.ways[hit.p]}` : ""}: ${word(d.outcome[hit.p * n + hit.i])}`),
              make("br"), Number.isFinite(hit.value) ? `${d.y.words} ${amount(hit.value, d.y.unit)}` : "",
              make("br"), numbers.map(([quantity, value]) => `${quantity.words} ${amount(value, quantity.unit, 3)}`).join(" · "),
            );
          },
        });
      });
      legend.append(...N.legendOf(all, drawing.responses));
      place.append(legend, text);
    }
  }
  document.body.dataset.ready = "1";
})();
