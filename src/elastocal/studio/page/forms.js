// Fields for what people change most in a cell file, and the file itself.

import { $, ask, attempt, element, say, state } from "./studio.js";

const CASES = ["normal", "north", "south", "east", "west"];

// What is in a field and not in the file is marked, and what was refused is marked as wrong: it was
// not saved. What was typed elsewhere outlives a change of the file.
const changed = (field) => field.value !== field.defaultValue;
const fieldsOf = (form) => [...form.elements].filter((each) => each.matches("input:not([type=checkbox]), textarea"));

function mark(field, wrong = false) {
  field.classList.toggle("unsaved", changed(field));
  field.title = changed(field) ? `not saved: the file has ${field.defaultValue.length > 60 ? "another text" : field.defaultValue || "nothing"}` : "";
  if (wrong) field.setAttribute("aria-invalid", "true");
  else field.removeAttribute("aria-invalid");
}

function put(field, value) {
  if (!changed(field)) field.value = value;
  field.defaultValue = value;
  mark(field);
}

async function save(form, edit) {
  const fields = fieldsOf(form);
  await attempt(async () => {
    const before = fields.map((each) => each.defaultValue);
    for (const each of fields) each.defaultValue = each.value;
    try {
      const answer = await ask("edit", edit);
      fields.forEach((each) => mark(each));
      say(answer.changed ? "Written to the cell file, which passes check." : "Nothing was changed.", true);
    } catch (error) {
      fields.forEach((each, k) => { each.defaultValue = before[k]; mark(each, changed(each)); });
      throw error;
    }
  }, (text, beside) => {
    say(`Not saved: ${text}`, false, beside);
    fields.find((each) => each.matches("[aria-invalid]"))?.focus({ preventScroll: true });
  });
}

function station({ name, position, range }) {
  const box = element("fieldset", "", { className: "station" }), six = element("div", "", { className: "six" });
  const field = (label, key, value, half) => {
    const made = element("label", label, { className: half ? "half" : "" });
    made.append(element("input", "", { name: key, defaultValue: value, required: true }));
    return made;
  };
  const name_field = field("Name", "name", name);
  name_field.style.gridColumn = "1 / -1";
  const remove = element("button", `Remove ${name}`, { type: "button" });
  remove.addEventListener("click", () => box.remove());
  six.append(name_field, ...position.map((text, k) => field(`${"xyz"[k]} in base`, `p${k}`, text)),
    ...range.map((text, k) => field(["Nearest", "Farthest"][k], `r${k}`, text, true)), remove);
  box.append(six);
  return box;
}

export function showForms(cell) {
  const { loads, region, polygon, stations } = cell.form;
  for (const key of ["fx", "fy", "fz", "level"]) put($("loads").elements[key], loads[key]);
  const legend = $("load-cases").firstElementChild;
  $("load-cases").replaceChildren(legend, ...CASES.map((name) => {
    const label = element("label", "", { className: "tick" });
    label.append(element("input", "", { type: "checkbox", name: "case", value: name, checked: loads.cases.includes(name) }), ` ${name}`);
    return label;
  }));
  $("region-note").textContent = polygon ? "The region is a polygon, or has a frame of its own: change it in the text below."
    : region ? "A box in the frame of the tooling's mesh." : "No region: the whole surface, which these corners of a box in the frame of the mesh enclose.";
  for (let k = 0; k < 3; k++) {
    put($("region").elements[`min${k}`], (region || cell.bounds).min[k]);
    put($("region").elements[`max${k}`], (region || cell.bounds).max[k]);
  }
  for (const field of $("region").elements) field.disabled = polygon;
  if (!fieldsOf($("stations")).some(changed)) $("station-rows").replaceChildren(...stations.map(station));
  put($("text"), cell.text);
}

export function openForms() {
  for (const name of ["loads", "region", "stations", "yaml"]) $(name).addEventListener("input", ({ target }) => { if (target.matches("input:not([type=checkbox]), textarea")) mark(target); });
  $("loads").addEventListener("submit", (event) => {
    event.preventDefault();
    const fields = event.target.elements;
    const cases = [...event.target.querySelectorAll("[name=case]:checked")].map((each) => each.value);
    // In the order of the file, new ones behind.
    const before = state.cell.form.loads.cases.filter((name) => cases.includes(name));
    const loads = { cases: [...before, ...cases.filter((name) => !before.includes(name))] };
    for (const key of ["fx", "fy", "fz", "level"]) loads[key] = fields[key].value.trim();
    save(event.target, { loads });
  });
  $("region").addEventListener("submit", (event) => {
    event.preventDefault();
    const corner = (name) => [0, 1, 2].map((k) => event.target.elements[`${name}${k}`].value.trim());
    save(event.target, { region: { min: corner("min"), max: corner("max") } });
  });
  $("whole").addEventListener("click", () => save($("region"), { whole_surface: true }));
  $("add-station").addEventListener("click", () => {
    const count = $("station-rows").children.length + 1;
    $("station-rows").append(station({ name: `station_${count}`, position: ["2 m", "-3 m", "1.5 m"], range: ["1 m", "15 m"] }));
    for (const field of $("station-rows").lastElementChild.querySelectorAll("input")) {
      field.setAttribute("value", "");
      mark(field);
    }
    $("station-rows").lastElementChild.querySelector("input").focus();
  });
  $("stations").addEventListener("submit", (event) => {
    event.preventDefault();
    const stations = [...$("station-rows").children].map((box) => {
      const value = (name) => box.querySelector(`[name=${name}]`).value.trim();
      return { name: value("name"), position: [0, 1, 2].map((k) => value(`p${k}`)), range: [value("r0"), value("r1")] };
    });
    save(event.target, { stations });
  });
  $("yaml").addEventListener("submit", (event) => { event.preventDefault(); save(event.target, { text: $("text").value }); });
  $("reload").addEventListener("click", () => attempt(async () => { $("text").value = $("text").defaultValue; await ask("reload"); say("Loaded anew.", true); }));
}
