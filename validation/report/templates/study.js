"use strict";
// The curve of a study. A dashed line belongs to the line before it and has its colour.

const COLOURS = ["#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9"];

function drawCurve(stage) {
  const curve = JSON.parse(document.getElementById("curve-data").textContent);
  const style = getComputedStyle(document.documentElement);
  const own = (name) => style.getPropertyValue(name).trim();
  let next = -1;
  const traces = curve.lines.map((line) => {
    if (line.kind !== "dash") next += 1;
    const color = COLOURS[Math.max(next, 0) % COLOURS.length];
    if (line.kind === "bar") return { type: "bar", name: line.name, x: line.x, y: line.y, marker: { color, opacity: 0.6 } };
    const dashed = line.kind === "dash";
    return { type: "scatter", mode: line.kind === "smooth" ? "lines" : "lines+markers", name: line.name, x: line.x, y: line.y, connectgaps: false,
      line: { color, width: dashed ? 1.5 : 2, dash: dashed ? "dash" : "solid" }, marker: { color, size: dashed ? 4 : 7 },
      error_y: line.error ? { type: "data", array: line.error, color, thickness: 1.2, width: 3 } : undefined };
  });
  const values = [...new Set(curve.lines.flatMap((line) => line.x))].sort((a, b) => a - b);
  const few = values.length <= 12;
  const axis = (title) => ({ title: { text: title, font: { size: 13 } }, color: own("--soft"), gridcolor: own("--line"),
    zeroline: false, linecolor: own("--line"), automargin: true });
  const layout = {
    margin: { l: 60, r: 20, t: 10, b: 50 }, paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
    font: { family: "system-ui, sans-serif", size: 13, color: own("--ink") }, bargap: 0.04,
    modebar: { bgcolor: "rgba(0,0,0,0)", color: own("--soft"), activecolor: own("--accent") },
    legend: { orientation: "h", y: 1.02, yanchor: "bottom", x: 0 }, hovermode: "closest",
    xaxis: { ...axis(curve.x), type: curve.log_x ? "log" : "linear",
      ...(few ? { tickmode: "array", tickvals: values, ticktext: values.map(String) } : {}) },
    yaxis: { ...axis(curve.y), rangemode: "tozero" },
    shapes: curve.levels.map(([y]) => ({ type: "line", xref: "paper", x0: 0, x1: 1, y0: y, y1: y,
      line: { color: own("--soft"), width: 1, dash: "dot" } })),
    annotations: curve.levels.map(([y, text]) => ({ xref: "paper", x: 1, xanchor: "right", y, yanchor: "bottom", text,
      showarrow: false, font: { size: 12, color: own("--soft") } })),
  };
  // Buttons are named one by one and no server is given: plotly's own set offers to upload the data.
  const config = { displaylogo: false, responsive: true, plotlyServerURL: "",
    modeBarButtons: [["toImage", "zoom2d", "pan2d", "resetScale2d"]] };
  stage.replaceChildren();
  Plotly.newPlot(stage, traces, layout, config);
}

const stage = document.getElementById("curve");
if (stage) drawCurve(stage);
