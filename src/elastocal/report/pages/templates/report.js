{
  const data = JSON.parse(document.getElementById("data").textContent);
  const sections = [...document.querySelectorAll("details.section")];
  const links = new Map([...document.querySelectorAll("nav a")].map((each) => [each.hash.slice(1), each]));
  let view = null;

  // The view costs a second where there is no graphics card: it is made when it is first seen.
  function showScene() {
    if (!view && data.layers) view = showPostures(data);
  }
  const seen = (section) => section.open && section.querySelector("#view");

  function goTo(id) {
    const target = id ? document.getElementById(id) : null;
    if (target instanceof HTMLDetailsElement) target.open = true;
    target?.scrollIntoView();
    target?.focus({ preventScroll: true });
  }
  addEventListener("hashchange", () => goTo(location.hash.slice(1)));
  links.forEach((link, id) => link.addEventListener("click", () => { if (location.hash === link.hash) goTo(id); }));
  sections.forEach((section) => section.addEventListener("toggle", () => { if (seen(section)) showScene(); }));
  document.getElementById("unfold").addEventListener("click", () => sections.forEach((each) => { each.open = true; }));
  document.getElementById("fold").addEventListener("click", () => sections.forEach((each) => { each.open = false; }));
  addEventListener("beforeprint", () => {
    // Details in a section that is printed are printed too, but for long ones.
    document.querySelectorAll("details.section[open] details:not(.long)").forEach((each) => {
      each.dataset.was = each.open;
      each.open = true;
    });
    if (!sections.some(seen)) return;
    showScene();
    view?.still(document.getElementById("still"));
  });
  addEventListener("afterprint", () => document.querySelectorAll("details[data-was]").forEach((each) => {
    each.open = each.dataset.was === "true";
    delete each.dataset.was;
  }));

  // The contents show where the reader is.
  const places = new IntersectionObserver((entries) => entries.forEach(({ target, isIntersecting }) => {
    links.get(target.id || "verdict")?.toggleAttribute("aria-current", isIntersecting);
  }), { rootMargin: "0px 0px -60% 0px" });
  [document.querySelector(".certificate"), ...sections].forEach((each) => places.observe(each));
  goTo(location.hash.slice(1));
  document.documentElement.dataset.ready = "yes";
}
