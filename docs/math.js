// Formulas stand in the pages as fenced blocks of the language `math`, which GitHub shows by itself. Here KaTeX does; where
// it cannot be fetched, the TeX source stays readable.
const base = "https://cdn.jsdelivr.net/npm/katex@0.16.11/dist/";
const style = document.createElement("link");
style.rel = "stylesheet";
style.href = base + "katex.min.css";
document.head.appendChild(style);
const script = document.createElement("script");
script.src = base + "katex.min.js";
script.onload = () => {
  for (const block of document.querySelectorAll("code.language-math")) {
    const shown = document.createElement("div");
    katex.render(block.textContent, shown, { displayMode: true, throwOnError: false });
    block.closest("pre").replaceWith(shown);
  }
};
document.head.appendChild(script);
