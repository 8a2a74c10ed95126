"use strict";
// The room in 3D. Points that turn their back to the viewer are left out, so that one looks in.

const MINT = "#35f0b0";  // found lights: a hue that neither colour map has
const WHITE = "#ffffff";  // true lights
const QUIET = "#8b95a1";
const Z_STOPS = ["#69b7ff", "#3f78b5", "#6a7078", "#b5742a", "#ffae42"];

function unpack(text, Kind) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  return new Kind(bytes.buffer);
}

function columns(flat, keep) {
  const [x, y, z] = [[], [], []];
  for (let i = 0; i < flat.length / 3; i++) {
    if (keep && !keep(i)) continue;
    x.push(flat[3 * i]); y.push(flat[3 * i + 1]); z.push(flat[3 * i + 2]);
  }
  return { x, y, z };
}

function scale(stops) {
  return stops.map((stop, index) => [index / (stops.length - 1), stop]);
}

function drawRoom(stage) {
  const room = JSON.parse(document.getElementById("room-data").textContent);
  const points = unpack(room.points, Float32Array);
  const normals = unpack(room.normals, Float32Array);
  const values = {
    brightness: unpack(room.brightness, Float32Array),
    residual: unpack(room.residual, Float32Array),
  };
  const size = room.low.map((low, axis) => room.high[axis] - low);
  const largest = Math.max(...size);
  const middle = room.low.map((low, axis) => low + size[axis] / 2);
  const aspect = size.map((side) => side / largest);
  const zooms = Math.hypot(...aspect);
  let eye = [-0.49, -0.92, 0.54].map((part) => part * zooms);
  let colour = "brightness";
  let all = false;

  // plotly's camera is in units of the aspect's box around the room's middle.
  function faces(i) {
    const n = [normals[3 * i], normals[3 * i + 1], normals[3 * i + 2]];
    if (all || (n[0] === 0 && n[1] === 0 && n[2] === 0)) return true;
    return n.reduce((sum, part, axis) => sum
      + part * (middle[axis] + eye[axis] * largest - points[3 * i + axis]), 0) > 0;
  }

  function colouring() {
    const bar = { thickness: 10, len: 0.7, x: 1, xpad: 4, outlinewidth: 0, tickfont: { color: QUIET, size: 11 },
      title: { font: { color: QUIET, size: 11 }, side: "right" } };
    if (colour === "residual") {
      const end = room.residual_limit;
      bar.title.text = "residual in standard errors";
      return { cmin: -end, cmax: end, colorscale: scale(Z_STOPS), colorbar: bar };
    }
    const [low, high] = room.brightness_ends;
    const marks = [];
    for (let power = Math.floor(low); power <= Math.ceil(high); power++) {
      for (const step of high - low > 1.5 ? [1] : [1, 2, 5]) {
        const at = power + Math.log10(step);
        if (at >= low && at <= high) marks.push(at);
      }
    }
    bar.title.text = "B in W·sr⁻¹·m⁻²";
    bar.tickvals = marks;
    bar.ticktext = marks.map((at) => Number((10 ** at).toPrecision(1)).toString());
    return { cmin: low, cmax: high, colorscale: scale(room.brightness_stops), colorbar: bar };
  }

  function pointTrace() {
    const shades = [];
    const hover = [];
    for (let i = 0; i < points.length / 3; i++) {
      if (!faces(i)) continue;
      shades.push(values[colour][i]);
      const z = Number.isFinite(values.residual[i]) ? values.residual[i].toFixed(2) : "–";
      hover.push(`B ${(10 ** values.brightness[i]).toPrecision(3)}<br>z ${z}`);
    }
    return { type: "scatter3d", mode: "markers", ...columns(points, faces), text: hover, hoverinfo: "text",
      marker: { size: points.length > 15000 ? 2.5 : 3.2, color: shades, ...colouring() } };
  }

  function lights(list, marker) {
    return { type: "scatter3d", mode: "markers", x: list.map((l) => l.at[0]), y: list.map((l) => l.at[1]),
      z: list.map((l) => l.at[2]), text: list.map((l) => l.text), hoverinfo: "text", marker };
  }

  function still() {
    const corners = unpack(room.vertices, Float32Array);
    const triangles = columns(unpack(room.faces, Int32Array));
    const edges = unpack(room.edges, Float32Array);
    const lines = { x: [], y: [], z: [] };
    for (let i = 0; i < edges.length; i += 6) {
      lines.x.push(edges[i], edges[i + 3], null);
      lines.y.push(edges[i + 1], edges[i + 4], null);
      lines.z.push(edges[i + 2], edges[i + 5], null);
    }
    const links = { x: [], y: [], z: [] };
    for (const [t, f] of room.lights.pairs) {
      const [from, to] = [room.lights.true[t].at, room.lights.found[f].at];
      ["x", "y", "z"].forEach((axis, k) => links[axis].push(from[k], to[k], null));
    }
    const pick = (list, key, want) => list.filter((light) => light[key] === want);
    return [
      { type: "mesh3d", ...columns(corners), i: triangles.x, j: triangles.y, k: triangles.z,
        color: "#aab4c0", opacity: 0.06, hoverinfo: "skip", flatshading: true },
      { type: "scatter3d", mode: "lines", ...lines, line: { color: "#5d6875", width: 2 }, hoverinfo: "skip" },
      { type: "scatter3d", mode: "lines", ...links, line: { color: MINT, width: 4 }, hoverinfo: "skip" },
      lights(pick(room.lights.found, "ghost", false), { symbol: "circle", size: 7, color: MINT }),
      lights(pick(room.lights.found, "ghost", true), { symbol: "diamond", size: 8, color: MINT }),
      lights(pick(room.lights.true, "missed", false), { symbol: "circle-open", size: 15, color: WHITE, line: { width: 3, color: WHITE } }),
      lights(pick(room.lights.true, "missed", true), { symbol: "square-open", size: 14, color: WHITE, line: { width: 3, color: WHITE } }),
    ];
  }

  const fixed = still();
  const axis = (k, name) => ({ title: { text: `${name} in m`, font: { size: 11 } }, range: [room.low[k], room.high[k]],
    showbackground: false, showgrid: false, zeroline: false, showspikes: false, color: QUIET, nticks: 5, tickfont: { size: 10 } });
  const layout = { margin: { l: 0, r: 0, t: 0, b: 0 }, paper_bgcolor: "rgba(0,0,0,0)", showlegend: false,
    hoverlabel: { font: { family: "system-ui, sans-serif", size: 12 } }, uirevision: "kept",
    scene: { xaxis: axis(0, "x"), yaxis: axis(1, "y"), zaxis: axis(2, "z"), aspectmode: "manual", dragmode: "turntable",
      aspectratio: { x: aspect[0], y: aspect[1], z: aspect[2] }, uirevision: "kept",
      camera: { eye: { x: eye[0], y: eye[1], z: eye[2] }, center: { x: 0, y: 0, z: -0.09 } } } };
  // Buttons are named one by one and no server is given: plotly's own set offers to upload the data.
  const config = { displaylogo: false, responsive: true, plotlyServerURL: "",
    modeBarButtons: [["toImage", "zoom3d", "pan3d", "tableRotation", "resetCameraDefault3d"]] };
  const redraw = () => Plotly.react(stage, [...fixed, pointTrace()], layout, config);

  stage.replaceChildren();
  redraw().then(() => {
    stage.on("plotly_relayout", (change) => {
      const camera = change["scene.camera"];
      if (!camera) return;
      layout.scene.camera = camera;
      eye = [camera.eye.x, camera.eye.y, camera.eye.z];
      if (!all) redraw();
    });
  });
  document.querySelectorAll("[data-colour]").forEach((button, _, buttons) => button.addEventListener("click", () => {
    colour = button.dataset.colour;
    buttons.forEach((other) => other.setAttribute("aria-pressed", other === button));
    redraw();
  }));
  document.getElementById("near-walls").addEventListener("change", (event) => { all = event.target.checked; redraw(); });

  // The wheel scrolls the page until the room is clicked: a picture must not trap the reader.
  let entered = false;
  stage.addEventListener("pointerdown", () => { entered = true; }, true);
  stage.addEventListener("pointerleave", (event) => { entered = entered && event.buttons > 0; });
  stage.addEventListener("wheel", (event) => { if (!entered) event.stopPropagation(); }, { capture: true, passive: true });
}

const stage = document.getElementById("room");
if (stage) drawRoom(stage);
