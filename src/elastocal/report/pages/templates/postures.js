// The postures of a plan on a slider, in its table of poses and in the view; returns the viewer.
function showPostures(data) {
  const host = document.getElementById("view"), viewer = new Viewer(host);
  const slider = document.getElementById("posture"), shown = document.getElementById("shown");
  const rows = document.querySelectorAll("#pose-table tbody tr");
  const sights = numbers(data.sight);
  const posture = () => Number(slider.value);
  function show(number) {
    slider.value = number;
    shown.textContent = data.postures[posture()];
    slider.setAttribute("aria-valuetext", shown.textContent);
    rows.forEach((row, i) => row.toggleAttribute("aria-current", i + 1 === posture()));
    const sight = sights.subarray(6 * posture(), 6 * posture() + 6);
    viewer.chosen = posture() - 1;
    viewer.place(viewer.postures[posture()]);
    viewer.set("sight", ...(sight.some(Number.isNaN) ? [] : [{ kind: "strokes", ends: sight, colour: "--sight", width: 2.5 }]));
  }
  viewer.show(data);
  viewer.cameras(document.getElementById("cameras"));
  viewer.switches(document.getElementById("layers"));
  viewer.onPick = (pose) => show(pose + 1);
  slider.addEventListener("input", () => show(slider.value));
  document.getElementById("previous").addEventListener("click", () => show(posture() - 1));
  document.getElementById("next").addEventListener("click", () => show(posture() + 1));
  rows.forEach((row, i) => row.querySelector("button")?.addEventListener("click", () => {
    show(i + 1);
    host.scrollIntoView({ block: "nearest" });
  }));
  show(slider.value);
  viewer.drawNow();
  return host.shown = viewer;
}
