// The page is painted first: drawing the view takes a second where there is no graphics card.
requestAnimationFrame(() => setTimeout(() => {
  const view = showView(JSON.parse(document.getElementById("data").textContent), document.querySelectorAll("#pose-table tbody tr"));
  addEventListener("beforeprint", () => view.still(document.getElementById("still")));
  document.getElementById("view").shown = view;
  document.documentElement.dataset.ready = "yes";
}));
