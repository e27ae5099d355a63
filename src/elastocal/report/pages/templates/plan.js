// The page is painted first: drawing the view takes a second where there is no graphics card.
requestAnimationFrame(() => setTimeout(() => {
  const view = showPostures(JSON.parse(document.getElementById("data").textContent));
  addEventListener("beforeprint", () => view.still(document.getElementById("still")));
  document.documentElement.dataset.ready = "yes";
}));
