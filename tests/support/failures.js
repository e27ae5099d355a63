// Collects what goes wrong in the page; stands before everything else in it.
window.failures = [];
addEventListener("error", (event) => failures.push(`error: ${event.message ?? event.target}`), true);
addEventListener("unhandledrejection", (event) => failures.push(`rejected: ${event.reason}`));
addEventListener("securitypolicyviolation", (event) => failures.push(`refused: ${event.blockedURI}`));
for (const kind of ["error", "warn"]) {
  const said = console[kind];
  console[kind] = (...words) => { failures.push(`${kind}: ${words.join(" ")}`); said(...words); };
}
