{
  const data = JSON.parse(document.getElementById("data").textContent);
  showView(data, document.querySelectorAll("tbody tr")).then(() => { document.documentElement.dataset.ready = "yes"; });
}
