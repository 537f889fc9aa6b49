"use strict";
// A page to print: every drawing is drawn first at the width of paper, kept as vectors, and only then at the width of the
// window. On paper the vectors stand in place of the canvases (report.css), whatever the window was; their words are text.
(() => {
  const N = window.nsdrill;
  if (!N.outline) { document.body.classList.remove("paper"); return; } // charts that are not painted as vectors
  const figures = new Map(); // the charts of each drawing, from the top
  const keep = (box, figure) => {
    const place = box.closest(".drawing");
    if (place) figures.set(place, [...(figures.get(place) || []), figure]);
    return figure;
  };
  for (const name of ["scatter", "cells", "motion"]) {
    const draw = N[name];
    N[name] = (box, ...rest) => keep(box, draw(box, ...rest));
  }
  document.addEventListener("DOMContentLoaded", async () => {
    for (const [place, charts] of figures) {
      const legend = place.querySelector(".legend"), motion = charts.find((one) => one.parts);
      const columns = motion ? [motion.parts()] : [[...charts, ...(legend ? N.legendBoxes(legend, place.clientWidth) : [])]];
      const picture = N.make("img", { class: "printed", alt: place.getAttribute("aria-label") });
      picture.src = URL.createObjectURL(await N.picture(columns, "", [], "svg"));
      place.append(picture);
      place.classList.add("printable");
    }
    document.body.classList.remove("paper");
  });
})();
