"use strict";
// The view of a plan in three dimensions: postures on a slider, layers, cameras. `rows` are those
// of the table of poses; what is done when one is chosen belongs to the page.
function showView({ figure, layers, cameras, postures }, rows) {
  const view = document.getElementById("view");
  const slider = document.getElementById("posture");
  const shown = document.getElementById("shown");
  const at_once = { mode: "immediate", frame: { duration: 0, redraw: true }, transition: { duration: 0 } };

  function show(number) {
    slider.value = number;
    shown.textContent = postures[slider.value];
    slider.setAttribute("aria-valuetext", shown.textContent);
    rows.forEach((row, i) => row.toggleAttribute("aria-current", i + 1 === Number(slider.value)));
    return Plotly.animate(view, [slider.value], at_once);
  }

  function addLayer({ label, colour, traces, shown }) {
    const box = document.createElement("input");
    box.type = "checkbox";
    box.checked = shown;
    box.addEventListener("change", () => Plotly.restyle(view, { visible: box.checked }, traces));
    const swatch = document.createElement("i");
    swatch.style.background = colour;
    const line = document.createElement("label");
    line.append(box, swatch, label);
    document.getElementById("layers").append(line);
  }

  // On an upright screen the same field of view is narrower: step back.
  function fitted(camera) {
    const back = Math.max(1, 1.4 * view.clientHeight / view.clientWidth);
    const { center, eye } = camera;
    const far = (axis) => center[axis] + back * (eye[axis] - center[axis]);
    return { ...camera, eye: { x: far("x"), y: far("y"), z: far("z") } };
  }

  function addCamera([name, camera]) {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = name;
    button.addEventListener("click", () => Plotly.relayout(view, { "scene.camera": fitted(camera) }));
    document.getElementById("cameras").append(button);
  }

  // On a small screen full-size numbers would hide the tooling.
  if (view.clientWidth < 600) {
    const poses = figure.data.find(({ name }) => name === "poses");
    poses.marker.size = 9;
    poses.textfont.size = 7;
  }
  layers.forEach(addLayer);
  Object.entries(cameras).forEach(addCamera);
  figure.layout.scene.camera = fitted(figure.layout.scene.camera);
  const config = { responsive: true, displaylogo: false, modeBarButtons: [["toImage", "zoom3d", "pan3d", "orbitRotation", "tableRotation", "resetCameraDefault3d"]] };
  return Plotly.newPlot(view, { ...figure, config }).then(() => {
    slider.addEventListener("input", () => show(slider.value));
    document.getElementById("previous").addEventListener("click", () => show(Number(slider.value) - 1));
    document.getElementById("next").addEventListener("click", () => show(Number(slider.value) + 1));
    rows.forEach((row, i) => row.querySelector("button")?.addEventListener("click", () => {
      show(i + 1);
      view.scrollIntoView({ block: "nearest" });
    }));
    view.on("plotly_click", ({ points: [point] }) => {
      if (point.data.name === "poses") show(point.customdata + 1);
    });
    return show(slider.value);
  });
}
