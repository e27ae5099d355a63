// The page of the studio: asks the server, shows what it answers. Figures and their units come as
// texts; what is computed here is only where a pointer points.

import { openForms, showForms } from "./forms.js";
import { openRuns, showFolders, showWork } from "./runs.js";

export const $ = (id) => document.getElementById(id);
export const state = { cell: null, posture: null, chosen: null };
const ENLARGED = 200;

export class Refusal extends Error {}

export async function ask(action, message = {}) {
  let response;
  try {
    response = await fetch(action, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(message) });
  } catch {
    throw new Refusal("the studio does not answer: is it still running?");
  }
  if (response.ok) return response.json();
  const kind = response.headers.get("Content-Type") || "";
  throw new Refusal(kind.includes("json") ? (await response.json()).refusal : (await response.text()).trim());
}

// Where the page has a box, a message names the box and not the option of the command line.
function onPage(text) {
  for (const label of document.querySelectorAll("[data-option]")) {
    const { option } = label.dataset, box = `\u201c${label.textContent.trim()}\u201d`;
    text = text.replaceAll(`leave ${option} out`, `do not tick ${box}`).replaceAll(`give ${option}`, `tick ${box}`)
      .replaceAll(`\`${option}\``, box).replaceAll(option, box);
  }
  return text;
}

// What is said stands beside the button that asked for it, and stays in sight; without one, on top.
export function say(text, good = false, beside = origin) {
  // What was begun in a part that is hidden now is said on top.
  const message = $("message"), part = beside?.closest("[role=tabpanel]"), row = part && !part.hidden && (beside.closest(".row, .buttons") || beside);
  if (row) row.after(message);
  else $("work").after(message);
  message.hidden = !text;
  message.textContent = onPage(text);
  message.classList.toggle("good", good);
  // The button first: what sticks to an edge is in sight already, and would hide it.
  if (text) (row || message).scrollIntoView({ block: "nearest" });
}

// The button that was used last.
export let origin = null;
document.addEventListener("click", (event) => {
  origin = event.target.closest?.("button") || null;
  // What was said of the last thing that was done goes with the next one.
  say("", false, null);
}, true);

// Runs something that may be refused, and says why, beside the button that asked for it.
export async function attempt(work, refused = (text, beside) => say(text, false, beside)) {
  const beside = origin;
  try {
    return await work();
  } catch (error) {
    if (!(error instanceof Refusal)) throw error;
    refused(error.message, beside);
    return undefined;
  }
}

export function element(tag, text = "", more = {}) {
  const made = Object.assign(document.createElement(tag), more);
  made.textContent = text;
  return made;
}

export function fill(list, rows) { // a definition list
  list.replaceChildren(...rows.flatMap(([name, text, kind]) => [element("dt", name), element("dd", text, { className: kind || "" })]));
}

export const view = $("view").shown = new Viewer($("view"), { eager: true });
new ResizeObserver(() => { view.top = $("cameras").offsetTop + $("cameras").offsetHeight + 6; view.draw(); }).observe($("cameras"));

// Only the newest wish counts: while one is asked, later ones replace each other.
let waiting = null, asking = false;
export async function move(action, message) {
  waiting = { action, message };
  if (asking) return;
  asking = true;
  try {
    while (waiting) {
      const wish = waiting;
      waiting = null;
      // What was done in the view is refused there.
      const inView = (text) => { $("refusal").textContent = onPage(text); };
      const answer = await attempt(() => ask(wish.action, wish.message), wish.message.position && !wish.message.orientation || wish.action === "press" ? inView : undefined);
      if (answer && !waiting) showPosture(answer.posture);
      if (answer?.posture.refusal && wish.message.orientation) say(answer.posture.refusal);
    }
  } finally {
    asking = false;
    document.documentElement.dataset.moved = String(1 + Number(document.documentElement.dataset.moved || 0));
  }
}

export function showPosture(posture) {
  state.posture = posture;
  view.handle = [3, 7, 11].map((k) => posture.tcp[k]);
  view.place(posture.places);
  $("refusal").textContent = posture.refusal;
  $("moved").textContent = posture.note;
  showJoints(posture.joints);
  fill($("tool"), [["Position in base", posture.position], ["a, b, c", posture.orientation], ["Tooling", posture.surface]]);
  for (const [k, text] of posture.position.replace(" mm", "").split(", ").entries()) $("place").elements["xyz"[k]].placeholder = text;
  for (const [k, text] of posture.orientation.split(", ").entries()) $("place").elements["abc"[k]].placeholder = text.replace("°", "");
  fill($("stiffness"), posture.stiffness.map((each) => [`Stiffness ${each.name}`, each.text]));
  fill($("sight"), posture.sight.length ? posture.sight.map((each) => [each.station, each.text, each.sees ? "good" : "bad"]) : [["Stations", "none in this cell"]]);
  $("checks").replaceChildren(...posture.checks.map((each) => {
    const row = element("tr");
    row.append(element("td", each.name.replaceAll("_", " ")), element("td", `${each.passes ? "✓" : "✗"} ${each.margin}`, { className: each.passes ? "good" : "bad" }), element("td", each.passes ? "" : each.advice));
    return row;
  }));
  showCases(posture);
  drawSight(posture);
}

function showJoints(joints) {
  const rows = $("joints").children;
  joints.forEach((joint, k) => {
    const [, slider, value, margin] = rows[k].children;
    if (document.activeElement !== slider || !slider.matches(":active")) slider.value = joint.value;
    slider.setAttribute("aria-valuetext", joint.text);
    value.textContent = joint.text;
    margin.textContent = `${joint.margin} left`;
    margin.className = joint.passes ? "margin" : "margin bad";
  });
}

function along({ parts, intervals }) { // with intervals a line an axis
  if (!intervals.length) return element("td", parts.join(", "));
  const cell = element("td");
  cell.append(...parts.map((part, k) => element("div", `${"xyz"[k]} ${part} (${intervals[k]})`)));
  return cell;
}

function showCases(posture) {
  const cases = posture.cases;
  if (!cases.some((each) => each.name === state.chosen)) state.chosen = (cases.find((each) => each.name === "normal") || cases[0]).name;
  $("cases").replaceChildren(...cases.map((each) => {
    const row = element("tr"), name = element("td"), button = element("button", each.name, { type: "button", title: `${each.force} in tcp` });
    button.setAttribute("aria-pressed", String(each.name === state.chosen));
    row.setAttribute("aria-selected", String(each.name === state.chosen));
    button.addEventListener("click", () => { state.chosen = each.name; showCases(state.posture); [...$("cases").querySelectorAll("button")].find((b) => b.textContent === each.name).focus(); });
    name.append(button);
    row.append(name, element("td", each.size), along(each));
    if (each.caveat) row.lastElementChild.append(element("span", `; ${each.caveat}`, { className: "bad" }));
    return row;
  }));
  const from = view.handle, { deflection } = cases.find((each) => each.name === state.chosen);
  view.set("deflection", { kind: "arrow", from, to: from.map((x, k) => x + ENLARGED * deflection[k]), colour: "--arrow" });
}

function drawSight({ marker, sight }) {
  const lines = (sees, colour, width) => ({ kind: "strokes", ends: sight.filter((each) => each.sees === sees).map(({ position }) => [marker, position]), colour, width });
  view.set("sight", ...(marker ? [lines(true, "--sight", 2.5), lines(false, "--bad", 1), { kind: "dots", at: [marker], colour: "--sight", width: 9 }] : []));
}

function buildJoints(joints) {
  $("joints").replaceChildren(...joints.map((joint, k) => {
    const row = element("div", "", { className: "joint" }), id = `joint-${k}`;
    const slider = element("input", "", { type: "range", id, min: joint.low, max: joint.high, step: joint.turns ? 0.002 : 0.005 });
    slider.addEventListener("input", () => {
      const q = [...state.posture.q];
      q[k] = Number(slider.value);
      move("posture", { q });
    });
    const label = element("label", joint.name);
    label.htmlFor = id;
    row.append(label, slider, element("output"), element("output", "", { className: "margin" }));
    return row;
  }));
}

async function load(first = false) {
  const cell = await attempt(() => ask("scene"));
  if (!cell) return;
  const q = !first && state.posture && state.cell.joints.length === cell.joints.length ? state.posture.q : null;
  state.cell = cell;
  document.title = `${cell.name} · elastocal studio`;
  $("name").textContent = `${cell.name}: ${cell.robot}`;
  $("file").textContent = cell.file;
  $("springs").textContent = `By ${cell.springs}.`;
  buildJoints(cell.joints);
  view.show(cell.scene, first);
  view.cameras($("cameras"));
  showForms(cell);
  showPosture(cell.posture);
  if (q) await move("posture", { q });
}

function openTabs() {
  const tabs = [...$("tabs").children];
  const choose = (tab) => {
    for (const each of tabs) {
      const chosen = each === tab;
      each.setAttribute("aria-selected", String(chosen));
      each.tabIndex = chosen ? 0 : -1;
      $(each.getAttribute("aria-controls")).hidden = !chosen;
    }
    if (["tab-plan", "tab-run"].includes(tab.id)) showFolders();
  };
  tabs.forEach((tab, k) => {
    tab.addEventListener("click", () => choose(tab));
    tab.addEventListener("keydown", (event) => {
      const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      if (!step) return;
      const next = tabs[(k + step + tabs.length) % tabs.length];
      choose(next);
      next.focus();
    });
  });
}

function openPosture() {
  view.onDrag = (position) => move("place", { q: state.posture.q, position });
  view.onPress = ({ origin, direction }) => move("press", { q: state.posture.q, origin, direction });
  $("go-home").addEventListener("click", () => move("posture", { q: state.cell.home }));
  $("set-home").addEventListener("click", () => attempt(async () => {
    const { changed } = await ask("edit", { home: state.posture.q });
    say(changed ? "HOME is written to the cell file." : "That is HOME already.", true);
  }));
  $("place").addEventListener("submit", (event) => {
    event.preventDefault();
    const read = (name) => Number((event.target.elements[name].value.trim() || event.target.elements[name].placeholder).replace(",", "."));
    const position = [..."xyz"].map((name) => read(name) / 1e3), orientation = [..."abc"].map((name) => read(name) * Math.PI / 180);
    if (![...position, ...orientation].every(Number.isFinite)) { say("Places are numbers, in mm and degrees."); return; }
    move("place", { q: state.posture.q, position, orientation });
    event.target.reset();
  });
}

function listen() {
  const news = new EventSource("news");
  news.addEventListener("open", () => { $("link").textContent = ""; });
  news.addEventListener("error", () => { $("link").textContent = "The studio does not answer."; });
  news.addEventListener("message", (event) => {
    const told = JSON.parse(event.data);
    if (state.cell && told.cell !== state.cell.number) load();
    showWork(told.work);
  });
}

openTabs();
openPosture();
openForms();
openRuns();
await load(true);
if (!view.gl) say("This browser draws no WebGL 2: the figures are there, the view is not.");
listen();
document.documentElement.dataset.ready = "yes";
