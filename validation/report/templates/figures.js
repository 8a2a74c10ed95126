"use strict";
// Figures, made in Python, are put on the page; and one looks into the room's.

for (const source of document.querySelectorAll("[data-figure]")) {
  const stage = document.getElementById(source.dataset.figure);
  stage.replaceChildren();
  Plotly.newPlot(stage, JSON.parse(source.textContent)).then(() => {
    if (stage._fullLayout.scene) lookInto(stage);
  });
}

function lookInto(stage) {
  const points = stage._fullData.filter((trace) => trace.customdata);
  const traces = points.map((trace) => trace.index);
  const box = document.getElementById("near-walls");
  const buttons = Array.from(document.querySelectorAll("[data-points]"));

  // Points that turn their back to the viewer are left out. Plotly's camera is in units of the
  // aspect's box around the room's middle.
  function leaveOut() {
    const scene = stage._fullLayout.scene;
    const eye = ["x", "y", "z"].map((axis) => {
      const [low, high] = scene[`${axis}axis`].range;
      return (low + high) / 2 + scene.camera.eye[axis] * (high - low) / scene.aspectratio[axis];
    });
    const x = points.map((trace) => trace.x.map((at, i) => {
      const [nx, ny, nz] = trace.customdata[i];
      const faces = nx * (eye[0] - at) + ny * (eye[1] - trace.y[i]) + nz * (eye[2] - trace.z[i]);
      return box.checked || faces > 0 || (nx === 0 && ny === 0 && nz === 0) ? at : NaN;
    }));
    Plotly.restyle(stage, { x }, traces);
  }
  leaveOut();
  box.addEventListener("change", leaveOut);
  stage.on("plotly_relayout", (change) => { if (change["scene.camera"]) leaveOut(); });

  buttons.forEach((button, shown) => {
    button.disabled = shown >= points.length;
    button.addEventListener("click", () => {
      buttons.forEach((other) => other.setAttribute("aria-pressed", other === button));
      Plotly.restyle(stage, { visible: traces.map((_, i) => i === shown || "legendonly") }, traces);
    });
  });

  // The wheel scrolls the page until the room is clicked: a picture must not trap the reader.
  let entered = false;
  stage.addEventListener("pointerdown", () => { entered = true; }, true);
  stage.addEventListener("pointerleave", (event) => { entered = entered && event.buttons > 0; });
  stage.addEventListener("wheel", (event) => { if (!entered) event.stopPropagation(); }, { capture: true, passive: true });
}
