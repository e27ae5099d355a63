{
  const data = JSON.parse(document.getElementById("data").textContent);
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const ready = () => { document.documentElement.dataset.ready = "yes"; };

  // Details that a reader folded are still part of the document on paper, but for long ones.
  addEventListener("beforeprint", () => document.querySelectorAll("details:not(.long)").forEach((each) => {
    each.dataset.was = each.open;
    each.open = true;
  }));
  addEventListener("afterprint", () => document.querySelectorAll("details[data-was]").forEach((each) => {
    each.open = each.dataset.was === "true";
  }));

  function palette() {
    const { ink, card, wall, line } = dark.matches
      ? { ink: "#e8e8e4", card: "#1d2023", wall: "#25292d", line: "#4a5056" }
      : { ink: "#1b1b1b", card: "#ffffff", wall: "#f7f7f5", line: "#dcdcdc" };
    const axis = (name) => ({ [`scene.${name}axis.backgroundcolor`]: wall, [`scene.${name}axis.gridcolor`]: line, [`scene.${name}axis.color`]: ink });
    return { paper_bgcolor: card, "font.color": ink, "hoverlabel.bgcolor": card, "hoverlabel.font.color": ink, ...axis("x"), ...axis("y"), ...axis("z") };
  }

  function put(target, [key, ...rest], value) {
    if (!rest.length) target[key] = value;
    else put(target[key] ??= {}, rest, value);
  }

  // Paper has no depth to turn: it gets a picture, always in the light colours.
  function keepStill(figure) {
    const still = document.getElementById("still");
    const plain = { data: figure.data, layout: figure.layout, config: {} };
    return Plotly.toImage(plain, { format: "png", width: 1100, height: 620 }).then((source) => {
      still.src = source;
      still.hidden = false;
    });
  }

  if (data.poses) {
    const view = document.getElementById("view");
    const figure = structuredClone(data.poses.figure);
    const first = figure.frames[1] ?? figure.frames[0];
    (first.traces ?? []).forEach((place, k) => Object.assign(figure.data[place], first.data[k]));
    const rows = document.querySelectorAll("#pose-table tbody tr");
    // In its colours from the start: drawing it twice takes a second where there is no graphics card.
    Object.entries(palette()).forEach(([path, value]) => put(data.poses.figure.layout, path.split("."), value));
    showView(data.poses, rows)
      .then(() => { dark.addEventListener("change", () => Plotly.relayout(view, palette())); })
      .then(() => keepStill(figure))
      .then(ready);
  } else {
    ready();
  }
}
