// Planning, comparing, and runs: begun here, done elsewhere, watched here.

import { $, ask, attempt, element, fill, move, say, showPosture, state, view } from "./studio.js";

const REFUSED = ["#7b3294", "#c2571a", "#8c8c8c", "#b8860b", "#a6324a", "#3b6ea8", "#6b6b2f", "#555555"];
const KINDS = { plan: "Planning", compare: "Comparing", survey: "Trying points", watch: "Watching the devices", run: "Run" };
const ORIGINS = { plan: "#plan-form button", compare: "#compare", survey: "#survey", watch: "#watch", run: "#run-form > button" };
let seen = "", curves = null, record = null;

export function showWork(work) {
  const busy = work.state === "busy";
  $("work").hidden = !busy;
  $("work-kind").textContent = KINDS[work.kind] || "";
  $("work-stage").textContent = work.total > 1 ? `${work.stage}: ${work.done} of ${work.total}` : work.live?.devices ? "" : work.stage;
  $("work-stop").textContent = work.kind === "run" ? "Stop: release, retract, stand still" : "Stop";
  $("work-bar").hidden = work.kind === "watch"; // it has no end
  $("work-bar").value = work.total ? work.done / work.total : 0;
  for (const id of ["survey", "compare", "watch"]) $(id).disabled = busy;
  for (const id of ["plan-form", "run-form"]) $(id).querySelector("button").disabled = busy;
  $("live").hidden = !(busy && work.kind === "run");
  if (busy && work.kind === "run") showLive(work.live);
  const now = `${work.kind} ${work.state}`, before = seen;
  seen = now;
  document.documentElement.dataset.work = now;
  const begins = busy && before !== now;
  if (begins && work.kind === "run") curves = { force: [], slip: [], name: "" };
  if (begins && work.kind === "watch") $("devices").replaceChildren();
  if (work.kind === "watch") showDevices(work.live);
  if (before && before !== now && !busy) ended(work);
}

function ended({ kind, state: how, result, message }) {
  const tell = (text, good) => say(text, good, document.querySelector(ORIGINS[kind]));
  if (how === "failed") tell(`${KINDS[kind]}: ${message}`, false);
  else if (how === "stopped" && kind !== "run") tell(`${KINDS[kind]} was stopped.`, true);
  else if (kind === "survey") showSurvey(result);
  else if (kind === "compare") showTechniques(result);
  else if (kind === "plan") { showFolders().then(() => openPlan(result.folder)); tell("The plan is made.", true); }
  else if (kind === "run") {
    const { figures, interrupted } = result;
    const poses = `${figures.committed} of ${figures.poses} poses committed`;
    // What was stopped is there to be gone on with: the next start does that.
    $("run-form").elements.resume.checked = interrupted;
    tell(interrupted ? `The run was stopped: ${poses}, the arm is ${figures.arm}. Start goes on with it.` : `The run is ${figures.state}: ${poses}, the arm is ${figures.arm}.`, true);
    if (figures.arm === "at HOME") move("posture", { q: state.cell.home });
    showFolders().then(() => openRecord(result.folder));
  }
}

function showDevices({ columns, devices }) {
  if (!devices) return;
  $("devices").replaceChildren(...devices.flatMap(({ device, wrong, cells }) => {
    const figures = element("dl");
    fill(figures, columns.map((column, k) => [column, cells[k]]).filter(([, text]) => text));
    return [element("h3", `${wrong ? "\u2717" : "\u2713"} ${device}`, { className: wrong ? "bad" : "" }), figures];
  }));
}

function showSurvey({ points, refused, summary }) {
  const names = [...new Set(refused)].sort();
  const colours = Object.fromEntries(names.map((name, k) => [name, name ? REFUSED[k % REFUSED.length] : "#009e73"]));
  $("survey-legend").replaceChildren(...names.map((name) => {
    const row = element("li"), dot = element("i");
    dot.style.background = colours[name];
    row.append(dot, `${name ? `refused by ${name}` : "a pose can be had"} (${refused.filter((each) => each === name).length})`);
    return row;
  }));
  view.set("survey", ...names.map((name) => ({ kind: "dots", at: points.filter((_, k) => refused[k] === name), colour: colours[name], width: 7 })));
  $("survey-text").textContent = summary;
}

function showTechniques({ rows, candidates, own }) {
  $("techniques").hidden = false;
  $("techniques").tBodies[0].replaceChildren(...rows.map((each) => {
    const row = element("tr"), cells = each.refusal ? ["", each.refusal, "", ""] : [each.poses, each.covering_radius, each.o1, each.seconds];
    row.append(element("td", each.technique === own ? `${each.technique} (the cell's)` : each.technique), ...cells.map((text) => element("td", text)));
    return row;
  }));
  $("compare-text").textContent = `From ${candidates} candidates, as many poses as the cell's own technique takes. The covering radius is that of the worst-covered candidate; O1 is the larger, the more the readings say of the springs.`;
}

export async function showFolders() {
  const found = await attempt(() => ask("folders"));
  if (!found) return;
  const options = (select, names, open) => {
    const kept = select.value;
    select.replaceChildren(...(names.length ? names : [["", "none yet"]]).map(([name, text]) => element("option", text, { value: name })));
    if (open) open.disabled = !names.length;
    if (names.some(([name]) => name === kept)) select.value = kept;
  };
  const plans = found.plans.map((name) => [name, name]);
  options($("plans"), plans, $("open-plan"));
  options($("run-plan"), plans);
  options($("runs"), found.runs.map(({ folder, state: text }) => [folder, `${folder}: ${text}`]), $("open-run"));
  const { real, armed } = state.cell;
  $("rig").textContent = !real ? "All devices of this cell are simulated, or simulators on this machine: nothing real moves."
    : armed ? "The cell names real devices, and the studio is armed: the arm WILL MOVE." : "The cell names real devices. Nothing moves: the studio was started without --arm.";
  $("confirm-label").hidden = !real;
  $("rate-label").hidden = real;
}

async function openPlan(folder) {
  const plan = await attempt(() => ask("poses", { folder }));
  if (!plan) return;
  $("plans").value = folder;
  $("plan-text").textContent = plan.summary;
  $("findings").replaceChildren(...plan.findings.map((text) => element("li", text)));
  // The tried points make way for the poses, and their colours with them.
  view.set("survey");
  $("survey-legend").replaceChildren();
  view.set("poses", { kind: "tags", poses: true, at: plan.poses.map((pose) => pose.position), texts: plan.poses.map((pose) => String(pose.id)), hints: plan.poses.map((pose) => `pose ${pose.id}, seen by ${pose.station}`), colour: "--region" });
  $("poses").replaceChildren(...plan.poses.map((pose) => {
    const button = element("button", String(pose.id), { type: "button", title: `seen by ${pose.station}`, ariaLabel: `Pose ${pose.id} of the plan` });
    button.setAttribute("aria-pressed", "false");
    button.addEventListener("click", () => {
      for (const each of $("poses").children) each.setAttribute("aria-pressed", String(each === button));
      view.chosen = pose.id;
      move("posture", { q: pose.q });
    });
    return button;
  }));
  view.onPick = (pose) => $("poses").children[plan.poses.findIndex((each) => each.id === pose)].click();
}

function showLive(live) {
  $("asked").hidden = !live.asked;
  $("asked-text").textContent = live.asked || "";
  $("answer").value = live.question || "";
  if (live.warnings) say(live.warnings.join(" · "), false, null);
  if (live.time === undefined) return;
  const marker = live.marker ? `${live.marker.map((x) => (1e3 * x).toFixed(2)).join(", ")} mm, in ${live.station}` : "not seen";
  fill($("live-figures"), [
    ["Pose", live.pose === null ? "on the way to HOME" : `${live.pose} (${live.number} of ${live.count}), attempt ${live.attempt}`],
    ["Step", live.step], ["Next", live.next], ["Force", `${live.force.toFixed(0)} N`], ["Slip", `${(1e3 * live.slip).toFixed(3)} mm`],
    ["Marker", marker], ["Left", live.left], ["Clock", `${live.time.toFixed(1)} s`],
  ]);
  const last = curves.force[curves.force.length - 1];
  if (last && last[0] === live.time) return;
  curves.force.push([live.time, live.force]);
  curves.slip.push([live.time, 1e3 * live.slip]);
  for (const each of [curves.force, curves.slip]) while (each.length > 600) each.shift();
  chart("The run", "Force in N", curves.force, "Slip in mm", curves.slip);
  if (live.q.length) follow(live.q);
}

let following = false;
async function follow(q) { // the arm as the controller says it, without stopping to wait
  if (following) return;
  following = true;
  try {
    const answer = await ask("posture", { q }).catch(() => null);
    if (answer) showPosture(answer.posture);
  } finally {
    following = false;
  }
}

async function openRecord(folder) {
  record = await attempt(() => ask("record", { folder }));
  if (!record) return;
  $("runs").value = folder;
  $("record").hidden = false;
  $("record-state").textContent = `${record.folder}: ${record.state}`;
  $("record-lines").replaceChildren(...[...record.lines, ...record.last].map((line) => element("li", line)));
  $("record-poses").replaceChildren(...record.poses.map(({ pose, text }) => {
    const button = element("button", String(pose), { type: "button", title: text, ariaLabel: `Pose ${pose} of ${folder}` });
    button.setAttribute("aria-pressed", "false");
    button.addEventListener("click", () => openPose(folder, pose, button));
    return button;
  }));
  if (record.live) {
    if (record.q) follow(record.q);
    setTimeout(() => { if (record && record.folder === folder && !$("run").hidden) openRecord(folder); }, 2000);
  }
}

async function openPose(folder, pose, button) {
  const streams = await attempt(() => ask("record", { folder, pose }));
  if (!streams) return;
  for (const each of $("record-poses").children) each.setAttribute("aria-pressed", String(each === button));
  const pairs = ({ time, value }, scale) => time.map((t, k) => [t, scale * value[k]]);
  const shown = (now) => chart(`Pose ${pose} of ${folder}`, "Force against the unloaded reference, in N", pairs(streams.force, 1),
    "Travel of the marker, in mm", pairs(streams.marker, 1e3), streams.windows, now);
  const play = $("play");
  $("play-label").hidden = !streams.time.length;
  play.max = streams.time.length - 1;
  play.value = 0;
  play.oninput = () => {
    const k = Number(play.value);
    const within = streams.windows.find(({ start, end }) => start <= streams.time[k] && streams.time[k] <= end);
    $("play-text").textContent = `At ${streams.time[k].toFixed(1)} s: ${within ? `${within.name}, ${within.status}` : "between the readings"}`;
    play.setAttribute("aria-valuetext", $("play-text").textContent);
    shown(streams.time[k]);
    follow(streams.q[k]);
  };
  shown(null);
  if (streams.q.length) play.oninput();
}

let charted = null;
const chartAnew = () => charted && chart(...charted);

// Of a run there is no time to choose.
const ofTheRun = (points) => points === curves?.force;

function chart(title, first, force, second, slip, windows = [], now = null) {
  charted = [title, first, force, second, slip, windows, now];
  $("charts").hidden = false;
  $("charts-title").textContent = title;
  if (ofTheRun(force)) $("play-label").hidden = true;
  plot($("force-chart"), first, force, "region", windows, now);
  plot($("slip-chart"), second, slip, "arrow", windows, now);
}

function plot(canvas, label, points, name, windows, now) {
  const dense = devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight, pen = canvas.getContext("2d");
  canvas.width = width * dense;
  canvas.height = height * dense;
  pen.scale(dense, dense);
  const colour = (each) => getComputedStyle(document.documentElement).getPropertyValue(`--${each}`).trim();
  pen.font = "12px system-ui, sans-serif";
  pen.fillStyle = colour("ink");
  pen.fillText(label, 4, 12);
  if (!points.length) { pen.fillText("no samples", 50, height / 2); return; }
  const [left, top, right, bottom] = [52, 22, width - 8, height - 20];
  const start = points[0][0], end = Math.max(points[points.length - 1][0], start + 1e-3);
  const most = Math.max(...points.map(([, value]) => value), 1e-3);
  const x = (t) => left + (right - left) * (t - start) / (end - start), y = (value) => bottom - (bottom - top) * value / most;
  pen.fillStyle = colour("soft");
  for (const each of windows) pen.fillRect(x(each.start), top, Math.max(1, x(each.end) - x(each.start)), bottom - top);
  pen.strokeStyle = colour("line");
  pen.strokeRect(left, top, right - left, bottom - top);
  pen.fillStyle = colour("muted");
  pen.fillText(most < 100 ? most.toPrecision(3) : most.toFixed(0), 4, top + 8);
  pen.fillText("0", 4, bottom);
  pen.fillText(`${Math.round(start)} s`, left, height - 5);
  pen.textAlign = "right";
  pen.fillText(`${end.toFixed(0)} s`, right, height - 5);
  pen.textAlign = "left";
  pen.strokeStyle = colour(name);
  pen.lineWidth = 1.5;
  pen.beginPath();
  points.forEach(([t, value], k) => (k ? pen.lineTo(x(t), y(value)) : pen.moveTo(x(t), y(value))));
  pen.stroke();
  if (now !== null) {
    pen.strokeStyle = colour("ink");
    pen.beginPath();
    pen.moveTo(x(now), top);
    pen.lineTo(x(now), bottom);
    pen.stroke();
  }
  canvas.setAttribute("aria-label", `${label}: from ${Math.round(start)} s to ${end.toFixed(0)} s, at most ${most.toPrecision(3)}`);
}

export function openRuns() {
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", chartAnew);
  new ResizeObserver(chartAnew).observe($("charts"));
  const begin = (action, message = {}) => attempt(() => ask(action, message));
  $("survey").addEventListener("click", () => begin("survey"));
  $("compare").addEventListener("click", () => begin("compare"));
  $("watch").addEventListener("click", () => begin("watch"));
  $("work-stop").addEventListener("click", () => begin("stop"));
  $("answer").addEventListener("click", () => begin("answer", { question: Number($("answer").value) }));
  $("plan-form").addEventListener("submit", (event) => {
    event.preventDefault();
    const { folder, replace } = event.target.elements;
    begin("plan", { folder: folder.value.trim(), replace: replace.checked });
  });
  $("open-plan").addEventListener("click", () => $("plans").value && openPlan($("plans").value));
  $("open-run").addEventListener("click", () => $("runs").value && openRecord($("runs").value));
  $("run-form").addEventListener("submit", (event) => {
    event.preventDefault();
    const { plan, folder, resume, confirmed, rate } = event.target.elements;
    if (!plan.value) { say("Plan first."); return; }
    begin("run", { plan: plan.value, folder: folder.value.trim(), resume: resume.checked, confirmed: confirmed.checked, cell: state.cell.sha256, rate: Number(rate.value) });
  });
}
