"use strict";
// A picture of a page: its charts, motions and legends set next to each other, as an image or as vectors.
(() => {
  const N = window.nsdrill, { make, font, INK, ratio, outline } = N;

  // A context that writes SVG: as much of the interface of a canvas context as the drawings use.
  class Vector {
    constructor() {
      this.pieces = [];
      this.definitions = [];
      this.symbols = new Map();
      this.state = { m: [1, 0, 0, 1, 0, 0], fillStyle: "#000", strokeStyle: "#000", lineWidth: 1, dash: [], font: font(11), textAlign: "left", textBaseline: "alphabetic", clip: null };
      this.kept = [];
      this.open = null; // the clip of the group that is open
      this.measuring = document.createElement("canvas").getContext("2d");
    }
    save() { this.kept.push({ ...this.state, m: [...this.state.m] }); }
    restore() { this.state = this.kept.pop(); }
    transform(a, b, c, d, e, f) {
      const m = this.state.m;
      this.state.m = [m[0] * a + m[2] * b, m[1] * a + m[3] * b, m[0] * c + m[2] * d, m[1] * c + m[3] * d, m[0] * e + m[2] * f + m[4], m[1] * e + m[3] * f + m[5]];
    }
    translate(x, y) { this.transform(1, 0, 0, 1, x, y); }
    scale(x, y) { this.transform(x, 0, 0, y, 0, 0); }
    rotate(angle) { this.transform(Math.cos(angle), Math.sin(angle), -Math.sin(angle), Math.cos(angle), 0, 0); }
    at(x, y) {
      const m = this.state.m;
      return `${short(m[0] * x + m[2] * y + m[4])} ${short(m[1] * x + m[3] * y + m[5])}`;
    }
    get factor() { return Math.hypot(this.state.m[0], this.state.m[1]); }
    beginPath() { this.way = ""; }
    moveTo(x, y) { this.way += `M${this.at(x, y)}`; }
    lineTo(x, y) { this.way += `${this.way ? "L" : "M"}${this.at(x, y)}`; }
    closePath() { this.way += "Z"; }
    rect(x, y, w, h) {
      this.moveTo(x, y);
      this.lineTo(x + w, y);
      this.lineTo(x + w, y + h);
      this.lineTo(x, y + h);
      this.closePath();
    }
    arc(x, y, r) { // whole circles only
      const radius = short(r * this.factor);
      this.way += `M${this.at(x - r, y)}A${radius} ${radius} 0 1 0 ${this.at(x + r, y)}A${radius} ${radius} 0 1 0 ${this.at(x - r, y)}Z`;
    }
    clip() {
      const id = `c${this.definitions.length}`;
      this.definitions.push(`<clipPath id="${id}"><path d="${this.way}"/></clipPath>`);
      this.state.clip = id;
    }
    add(piece) {
      this.clipBy(this.state.clip);
      this.pieces.push(piece);
    }
    clipBy(id) {
      if (id === this.open) return;
      if (this.open) this.pieces.push("</g>");
      if (id) this.pieces.push(`<g clip-path="url(#${id})">`);
      this.open = id;
    }
    fill() { if (this.way) this.add(`<path d="${this.way}" fill="${this.state.fillStyle}"/>`); }
    stroke() {
      if (!this.way) return;
      const s = this.state, dashes = s.dash.length ? ` stroke-dasharray="${s.dash.map((one) => short(one * this.factor)).join(" ")}"` : "";
      this.add(`<path d="${this.way}" fill="none" stroke="${s.strokeStyle}" stroke-width="${short(s.lineWidth * this.factor)}" stroke-linejoin="round"${dashes}/>`);
    }
    fillRect(x, y, w, h) { this.beginPath(); this.rect(x, y, w, h); this.fill(); }
    strokeRect(x, y, w, h) { this.beginPath(); this.rect(x, y, w, h); this.stroke(); }
    setLineDash(dash) { this.state.dash = dash; }
    measureText(words) { this.measuring.font = this.state.font; return this.measuring.measureText(words); }
    fillText(words, x, y) {
      const s = this.state, size = parseFloat(s.font.replace(/^bold /, "")) * this.factor, angle = Math.atan2(s.m[1], s.m[0]) * (180 / Math.PI);
      const lower = { alphabetic: 0, top: 0.8, middle: 0.35 }[s.textBaseline] * size, place = this.at(x, y).split(" ");
      this.add(`<text transform="translate(${place.join(" ")})${angle ? ` rotate(${short(angle)})` : ""}" y="${short(lower)}" font-size="${short(size)}"${s.font.startsWith("bold") ? ' font-weight="bold"' : ""} text-anchor="${{ left: "start", center: "middle", right: "end" }[s.textAlign]}" fill="${s.fillStyle}">${escaped(words)}</text>`);
    }
    // A marker, defined once.
    mark(marker, colour, filled, size, x, y) {
      const key = [marker, colour, filled, short(size * this.factor)].join();
      if (!this.symbols.has(key)) {
        const one = new Vector();
        outline(one, marker, size * this.factor);
        const id = `m${this.symbols.size}`, look = filled ? `fill="${colour}"` : `fill="none" stroke="${colour}" stroke-width="${short(Math.max(1, size / 6) * this.factor)}"`;
        this.symbols.set(key, id);
        this.definitions.push(`<path id="${id}" d="${one.way}" ${look}/>`);
      }
      const [left, top] = this.at(x, y).split(" ");
      this.add(`<use href="#${this.symbols.get(key)}" x="${left}" y="${top}"/>`);
    }
    text(width, height) {
      this.clipBy(null);
      return `<svg xmlns="http://www.w3.org/2000/svg" width="${width}" height="${height}" viewBox="0 0 ${width} ${height}" font-family="${escaped(N.FAMILY)}">\n<rect width="100%" height="100%" fill="#fff"/>\n<defs>${this.definitions.join("\n")}</defs>\n${this.pieces.join("\n")}\n</svg>\n`;
    }
  }
  for (const name of ["fillStyle", "strokeStyle", "lineWidth", "font", "textAlign", "textBaseline"])
    Object.defineProperty(Vector.prototype, name, { get() { return this.state[name]; }, set(value) { this.state[name] = value; } });
  const short = (value) => Number(value.toFixed(2));
  const escaped = (words) => String(words).replace(/&/g, "&amp;").replace(/</g, "&lt;").replace(/"/g, "&quot;");

  // Boxes: each has a size in pixels of the page and paints itself at the origin.
  const GAP = 8;
  function stack(boxes, across) {
    const sizes = boxes.map((one) => one.size());
    const along = sizes.reduce((sum, size) => sum + size[across ? 0 : 1] + GAP, -GAP), aside = Math.max(0, ...sizes.map((size) => size[across ? 1 : 0]));
    return {
      size: () => (across ? [Math.max(0, along), aside] : [aside, Math.max(0, along)]),
      paint(c) {
        let at = 0;
        boxes.forEach((one, k) => {
          c.save();
          c.translate(across ? at : 0, across ? 0 : at);
          one.paint(c);
          c.restore();
          at += sizes[k][across ? 0 : 1] + GAP;
        });
      },
    };
  }
  // Columns in rows in columns ...: an array is a row where its depth is even, a column where it is odd.
  const nested = (boxes, across = true) => (Array.isArray(boxes) ? stack(boxes.filter((one) => !Array.isArray(one) || one.length).map((one) => nested(one, !across)), across) : boxes);

  function words(line, size, weight = "") {
    const c = document.createElement("canvas").getContext("2d");
    c.font = font(size, weight);
    const wide = c.measureText(line).width;
    return {
      size: () => [wide, size * 1.3],
      paint(to) {
        to.fillStyle = INK;
        to.textAlign = "left";
        to.textBaseline = "alphabetic";
        to.font = font(size, weight);
        to.fillText(line, 0, size);
      },
    };
  }

  // A line broken where it is wider than `width`.
  function paragraph(line, width, size, weight) {
    const lines = [];
    for (const word of line.split(" ")) {
      const longer = lines.length ? `${lines[lines.length - 1]} ${word}` : word;
      if (lines.length && words(longer, size, weight).size()[0] <= width) lines[lines.length - 1] = longer;
      else lines.push(word);
    }
    return lines.map((one) => words(one, size, weight));
  }

  // The entries of a legend in lines of at most `width`.
  function legend(list, width) {
    const rows = [];
    let wide = 0;
    for (const item of list.querySelectorAll("li")) {
      if (item.querySelector("[aria-pressed='false']")) continue;
      const swatch = item.querySelector("canvas"), text = words(item.textContent, 11.5);
      const box = {
        size: () => [text.size()[0] + (swatch ? 17 : 0) + 8, 15],
        paint(c) {
          if (swatch && swatch.paint) {
            c.save();
            c.scale(13 / 28, 13 / 28);
            swatch.paint(c);
            c.restore();
          }
          c.translate(swatch ? 17 : 0, 0);
          text.paint(c);
        },
      };
      if (!rows.length || wide + box.size()[0] > width) { rows.push([]); wide = 0; }
      rows[rows.length - 1].push(box);
      wide += box.size()[0] + GAP;
    }
    return rows;
  }

  // The picture of `columns` (boxes, nested) under a title and further lines; `as` "svg" or "png". Gives a Blob.
  N.picture = async function picture(columns, title, lines, as) {
    const body = nested(columns), wide = Math.max(420, body.size()[0]);
    const whole = nested([...paragraph(title, wide, 15, "bold "), ...lines.flatMap((line) => paragraph(line, wide, 12)), body], false);
    const [width, height] = whole.size().map((one) => Math.ceil(one + 2 * GAP));
    const placed = { paint(c) { c.translate(GAP, GAP); whole.paint(c); } };
    if (as === "svg") {
      const c = new Vector();
      placed.paint(c);
      return new Blob([c.text(width, height)], { type: "image/svg+xml" });
    }
    const dpr = Math.max(2, ratio()), canvas = make("canvas", { width: width * dpr, height: height * dpr }), c = canvas.getContext("2d");
    c.fillStyle = "#fff";
    c.fillRect(0, 0, canvas.width, canvas.height);
    c.scale(dpr, dpr);
    c.mark = (marker, colour, filled, size, x, y) => { // sharp at every resolution
      c.save();
      c.translate(x, y);
      outline(c, marker, size);
      c.fillStyle = c.strokeStyle = colour;
      c.lineWidth = Math.max(1, size / 6);
      if (filled) c.fill();
      else c.stroke();
      c.restore();
    };
    placed.paint(c);
    return new Promise((done) => canvas.toBlob(done));
  };
  Object.assign(N, { Vector, legendBoxes: legend });
})();
