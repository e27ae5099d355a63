"use strict";
(() => {
  const { variants, charts } = JSON.parse(document.getElementById("data").textContent);
  const shown = variants.map(() => true);
  const log = document.getElementById("log");
  const config = { responsive: true, displaylogo: false, modeBarButtons: [["toImage", "zoom2d", "pan2d", "autoScale2d", "resetScale2d"]] };
  const least = 6; // Width of a box in pixels below which the chart scrolls sideways.

  const chosen = (id) => charts[id][document.getElementById(`${id}-choice`).value];
  const isAxis = (name) => /^[xy]axis/.test(name);

  // Every size has its label where there is room.
  function fitted(layout, width) {
    const last = layout.xaxis.range[1] - 0.5;
    const step = [1, 2, 5, 10, 20, 50, 100].find((each) => each * (width - 70) / last >= 22) ?? last;
    const axes = Object.keys(layout).filter(isAxis).map((name) => [name, { ...layout[name], ...(name[0] === "x" ? { dtick: step, tick0: step === 1 ? 1 : step } : {}) }]);
    return { ...layout, ...Object.fromEntries(axes), width: undefined };
  }

  function scaled(layout, id) {
    if (id !== "errors") return layout;
    const axes = Object.keys(layout).filter((name) => name.startsWith("yaxis")).map((name) => {
      const axis = layout[name];
      const wanted = log.checked ? "log" : "linear";
      if (axis.type === wanted) return [name, axis];
      const { range, tickvals, ticktext, ...rest } = axis;
      return [name, { ...rest, type: wanted, autorange: true, rangemode: wanted === "linear" ? "tozero" : "normal" }];
    });
    return { ...layout, ...Object.fromEntries(axes) };
  }

  function swatch({ colour, fill }) {
    const square = document.createElement("i");
    square.style.background = fill;
    square.style.borderColor = colour;
    return square;
  }

  // The numbers behind one size, a line a variant.
  function tell(id) {
    const slider = document.getElementById(`${id}-size`);
    const n = Number(slider.value);
    const lines = variants.map((variant, number) => {
      const traces = chosen(id).figure.data.filter(({ meta, text, x }) => meta === number && text && x.includes(n));
      const line = document.createElement("p");
      const said = traces.map(({ text, x }) => text[x.indexOf(n)].trim()).join("; ");
      line.append(swatch(variant), `${variant.name}: ${said}`);
      return traces.length && shown[number] ? line : "";
    });
    const head = document.createElement("p");
    head.append(`With ${n} training pose${n === 1 ? "" : "s"}, medians:`);
    document.getElementById(`${id}-told`).replaceChildren(head, ...lines);
    slider.setAttribute("aria-valuetext", head.textContent);
  }

  function draw(id) {
    tell(id);
    const view = document.getElementById(id);
    const { figure, told } = chosen(id);
    const last = figure.layout.xaxis.range[1] - 0.5;
    view.style.minWidth = `${Math.min(4000, 70 + least * last * variants.length)}px`;
    view.setAttribute("aria-label", told);
    const data = figure.data.map((trace) => ({ ...trace, visible: shown[trace.meta] }));
    return Plotly.react(view, data, fitted(scaled(figure.layout, id), view.clientWidth), config);
  }

  const drawAll = () => Promise.all(Object.keys(charts).map(draw));

  variants.forEach(({ name, colour, fill }, number) => {
    const box = document.createElement("input");
    box.type = "checkbox";
    box.checked = true;
    box.addEventListener("change", () => { shown[number] = box.checked; drawAll(); });
    const line = document.createElement("label");
    line.append(box, swatch({ colour, fill }), name);
    document.getElementById("variants").append(line);
  });
  Object.entries(charts).forEach(([id, views]) => {
    const choice = document.getElementById(`${id}-choice`);
    views.forEach(({ name }, number) => choice.append(new Option(name, number)));
    choice.value = Math.max(0, views.findIndex(({ determined }) => determined !== false));
    choice.addEventListener("change", () => draw(id));
    document.getElementById(`${id}-size`).addEventListener("input", () => tell(id));
  });
  log.checked = charts.errors[0].figure.layout.yaxis.type === "log";
  log.addEventListener("change", () => draw("errors"));
  drawAll().then(() => {
    Object.keys(charts).forEach((id) => document.getElementById(id).on("plotly_hover", ({ points: [point] }) => {
      document.getElementById(`${id}-size`).value = Math.round(point.x);
      tell(id);
    }));
    document.documentElement.dataset.ready = "yes";
  });
})();
