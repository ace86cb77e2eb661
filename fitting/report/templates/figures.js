"use strict";
// Draws the figures in the style sheet's colours, and again when the reader's scheme changes.
(function () {
  const drawings = JSON.parse(document.getElementById("drawings").textContent);
  const root = document.documentElement;
  const named = /^var\((--[a-z0-9-]+)\)$/;

  function dressed(node, style) {
    if (typeof node === "string") {
      const found = named.exec(node);
      return found ? style.getPropertyValue(found[1]).trim() : node;
    }
    if (Array.isArray(node)) return node.map((item) => dressed(item, style));
    if (node === null || typeof node !== "object") return node;
    const copy = {};
    for (const key of Object.keys(node)) copy[key] = dressed(node[key], style);
    return copy;
  }

  function draw() {
    const style = getComputedStyle(root);
    return Promise.all(
      drawings.map((drawing) =>
        Plotly.react(
          document.getElementById("plot-" + drawing.key),
          dressed(drawing.data, style),
          dressed(drawing.layout, style),
          { displayModeBar: false, responsive: true, showTips: false }
        )
      )
    );
  }

  function redraw() {
    root.dataset.drawn = "no";
    draw().then(() => { root.dataset.drawn = "yes"; });
  }

  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  // Print is always light; the sheet's colours are those of paper by then.
  addEventListener("beforeprint", redraw);
  addEventListener("afterprint", redraw);
  redraw();
})();
