"use strict";
// The view of a plan in three dimensions, drawn with WebGL 2: solids, lines and dots of layers that
// go on and off; tags with numbers and names above them. Postures are on a slider; `rows` are those
// of the table of poses. Returns what the page may ask of it: to be drawn anew, or on paper.
const VIEW_SHADERS = {
  solid: [`
    uniform mat4 camera, world; in vec3 at; out vec3 place;
    void main() { vec4 moved = world * vec4(at, 1.0); place = moved.xyz; gl_Position = camera * moved; }`, `
    uniform vec3 colour, light; in vec3 place; out vec4 shade;
    void main() { vec3 normal = normalize(cross(dFdx(place), dFdy(place)));
      shade = vec4(colour * mix(0.45, 1.0, 0.5 + 0.5 * dot(normal, light)), 1.0); }`],
  line: [`
    uniform mat4 camera; uniform vec2 size; uniform float width; in vec3 a, b; in vec2 corner;
    void main() { vec4 p = camera * vec4(a, 1.0), q = camera * vec4(b, 1.0);
      if (min(p.w, q.w) < 0.01) { gl_Position = vec4(2.0, 2.0, 2.0, 1.0); return; }
      vec2 along = (q.xy / q.w - p.xy / p.w) * size + vec2(1e-6);
      vec4 r = mix(p, q, corner.x);
      r.xy += corner.y * width * r.w * normalize(vec2(-along.y, along.x)) / size;
      r.z -= 2e-4 * r.w; gl_Position = r; }`, `
    uniform vec3 colour; out vec4 shade; void main() { shade = vec4(colour, 1.0); }`],
  dot: [`
    uniform mat4 camera; uniform float width; in vec3 at, tint; out vec3 colour;
    void main() { gl_Position = camera * vec4(at, 1.0); gl_PointSize = width; colour = tint; }`, `
    in vec3 colour; out vec4 shade;
    void main() { if (length(gl_PointCoord - 0.5) > 0.5) discard; shade = vec4(colour, 1.0); }`],
};
const FIELD_OF_VIEW = Math.PI / 4; // As in _views.py.

function showView(plan, rows) {
  const view = document.getElementById("view");
  const [canvas, tags] = view.querySelectorAll("canvas");
  const slider = document.getElementById("posture");
  const shown = document.getElementById("shown");
  const hint = document.getElementById("hint");
  const gl = canvas.getContext("webgl2", { antialias: true });
  if (!gl) {
    view.replaceChildren("This browser draws no view in three dimensions (WebGL 2 is off); the tables and the flat map say the same.");
    return { draw() {}, still() {} };
  }
  const add = (a, b, k = 1) => a.map((x, i) => x + k * b[i]);
  const dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0);
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const unit = (a) => a.map((x) => x / (Math.hypot(...a) || 1));
  const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer;
  const numbers = (text) => new Float32Array(bytes(text));
  const triples = (flat) => Array.from({ length: flat.length / 3 }, (_, i) => [...flat.subarray(3 * i, 3 * i + 3)]);
  const times = (a, b) => Float32Array.from({ length: 16 }, (_, k) => [0, 1, 2, 3].reduce((sum, i) => sum + a[4 * i + k % 4] * b[4 * (k >> 2) + i], 0));

  // --- what is drawn ---------------------------------------------------------------------------
  const programs = Object.fromEntries(Object.entries(VIEW_SHADERS).map(([name, sources]) => {
    const program = gl.createProgram();
    sources.forEach((source, i) => {
      const shader = gl.createShader(i ? gl.FRAGMENT_SHADER : gl.VERTEX_SHADER);
      gl.shaderSource(shader, `#version 300 es\nprecision highp float;${source}`);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    });
    gl.linkProgram(program);
    const at = (uniform) => gl.getUniformLocation(program, uniform);
    return [name, { program, at: Object.fromEntries(["camera", "world", "colour", "light", "size", "width"].map((each) => [each, at(each)])) }];
  }));
  const buffer = (data, kind = gl.ARRAY_BUFFER) => {
    const made = gl.createBuffer();
    gl.bindBuffer(kind, made);
    gl.bufferData(kind, data, gl.STATIC_DRAW);
    return made;
  };
  function feed(name, variable, made, size, { stride = 0, offset = 0, each = 0, type = gl.FLOAT, scaled = false } = {}) {
    const place = gl.getAttribLocation(programs[name].program, variable);
    gl.bindBuffer(gl.ARRAY_BUFFER, made);
    gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, size, type, scaled, stride, offset);
    gl.vertexAttribDivisor(place, each);
  }
  const corners = buffer(new Float32Array([0, -1, 0, 1, 1, -1, 1, 1]));
  const makers = {
    paint({ vertices, faces, ...rest }) {
      const array = gl.createVertexArray();
      gl.bindVertexArray(array);
      feed("solid", "at", buffer(numbers(vertices)), 3);
      const indices = new Uint32Array(bytes(faces));
      buffer(indices, gl.ELEMENT_ARRAY_BUFFER);
      return { ...rest, array, count: indices.length };
    },
    strokes({ ends, ...rest }) {
      const array = gl.createVertexArray();
      const made = buffer(numbers(ends));
      gl.bindVertexArray(array);
      feed("line", "corner", corners, 2);
      feed("line", "a", made, 3, { stride: 24, each: 1 });
      feed("line", "b", made, 3, { stride: 24, offset: 12, each: 1 });
      return { ...rest, array, made, count: numbers(ends).length / 6 };
    },
    dots({ at, colours, ...rest }) {
      const array = gl.createVertexArray();
      gl.bindVertexArray(array);
      feed("dot", "at", buffer(numbers(at)), 3);
      feed("dot", "tint", buffer(new Uint8Array(bytes(colours))), 3, { type: gl.UNSIGNED_BYTE, scaled: true });
      const places = triples(numbers(at));
      return { ...rest, array, places, count: places.length };
    },
    tags: ({ at, normals, ...rest }) => ({ ...rest, places: triples(numbers(at)), normals: normals && triples(numbers(normals)) }),
  };
  const layers = plan.layers.map((layer) => ({ ...layer, parts: layer.parts.map((part) => ({ kind: part.kind, ...makers[part.kind](part) })) }));
  const places = numbers(plan.places);
  const sights = numbers(plan.sight);
  const bodies = places.length / 16 / plan.postures.length;
  const sight = makers.strokes({ ends: plan.sight, colour: layers.find((each) => each.sight)?.colour, width: 2.5 });
  const still = Float32Array.from({ length: 16 }, (_, k) => Number(k % 5 === 0));

  // --- from where it is seen: always above the floor -------------------------------------------
  const up = unit(plan.up);
  const east = unit(Math.abs(up[0]) < 0.9 ? cross(up, cross([1, 0, 0], up)) : cross(up, cross([0, 1, 0], up)));
  const north = cross(up, east);
  const place = { centre: [0, 0, 0], turn: 0, rise: 0.5, distance: 1 };
  const lowest = 0.05; // Angle above the horizon, in rad.
  function settle() {
    place.rise = Math.min(1.55, Math.max(lowest, place.rise));
    place.distance = Math.min(200, Math.max(0.1, place.distance));
    place.centre = add(place.centre, up, Math.max(0, plan.floor - dot(place.centre, up)));
    draw();
  }
  const outward = () => add(up.map((x) => x * Math.sin(place.rise)), add(east.map((x) => x * Math.cos(place.turn)), north, Math.sin(place.turn)), Math.cos(place.rise));
  function look({ centre, eye }) {
    const away = add(eye, centre, -1);
    const height = dot(away, up) / Math.hypot(...away);
    Object.assign(place, { centre, turn: Math.atan2(dot(away, north), dot(away, east)), rise: Math.asin(height), distance: Math.hypot(...away) });
    settle();
  }
  // On an upright screen the same field of view is narrower: step back.
  const back = (width, height) => Math.max(1, 1.5 * height / width);
  function cameraFor(width, height) {
    const ahead = outward(), far = place.distance * back(width, height);
    const eye = add(place.centre, ahead, far);
    const right = unit(cross(up, ahead)), top = cross(ahead, right);
    const near = far / 200, away = far * 20, f = 1 / Math.tan(FIELD_OF_VIEW / 2);
    const seen = new Float32Array([right[0], top[0], ahead[0], 0, right[1], top[1], ahead[1], 0, right[2], top[2], ahead[2], 0, -dot(right, eye), -dot(top, eye), -dot(ahead, eye), 1]);
    const lens = new Float32Array([f * height / width, 0, 0, 0, 0, f, 0, 0, 0, 0, (away + near) / (near - away), -1, 0, 0, 2 * away * near / (near - away), 0]);
    return { matrix: times(lens, seen), eye };
  }
  function onScreen({ matrix: m }, p, width, height) {
    const [x, y, , w] = [0, 1, 2, 3].map((i) => m[i] * p[0] + m[4 + i] * p[1] + m[8 + i] * p[2] + m[12 + i]);
    return w > 0 ? [(0.5 + 0.5 * x / w) * width, (0.5 - 0.5 * y / w) * height, w] : [-1e9, -1e9, w];
  }

  // --- drawing ---------------------------------------------------------------------------------
  const paper = { "--ink": "#1b1b1b", "--muted": "#595959", "--card": "#ffffff", "--strong": "#8c8c8c", "--tooling": "#c3ccd6", "--fixture": "#eeeae2" };
  const scheme = (name, onPaper) => name.startsWith("--") ? (onPaper ? paper[name] : getComputedStyle(document.documentElement).getPropertyValue(name).trim()) : name;
  const rgb = (colour) => [1, 3, 5].map((k) => parseInt(colour.slice(k, k + 2), 16) / 255);
  const posture = () => Number(slider.value);

  function paintAll(width, height, ratio, onPaper) {
    const colour = (name) => rgb(scheme(name, onPaper));
    const camera = cameraFor(width, height);
    [canvas.width, canvas.height] = [width * ratio, height * ratio];
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(...colour("--card"), 1);
    gl.enable(gl.DEPTH_TEST);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    Object.values(programs).forEach(({ program, at }) => {
      gl.useProgram(program);
      gl.uniformMatrix4fv(at.camera, false, camera.matrix);
      gl.uniform2f(at.size, width, height);
      gl.uniform3fv(at.light, plan.light);
    });
    const drawn = {
      paint({ array, count, part, colour: name }) {
        const { program, at } = programs.solid;
        gl.useProgram(program);
        const first = 16 * (posture() * bodies + part);
        gl.uniformMatrix4fv(at.world, false, part < 0 ? still : places.subarray(first, first + 16));
        gl.uniform3fv(at.colour, colour(name));
        gl.bindVertexArray(array);
        gl.drawElements(gl.TRIANGLES, count, gl.UNSIGNED_INT, 0);
      },
      strokes({ array, count, colour: name, width: thick }) {
        const { program, at } = programs.line;
        gl.useProgram(program);
        gl.uniform1f(at.width, thick);
        gl.uniform3fv(at.colour, colour(name));
        gl.bindVertexArray(array);
        gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, count);
      },
      dots({ array, count }) {
        const { program, at } = programs.dot;
        gl.useProgram(program);
        gl.uniform1f(at.width, 4.5 * ratio);
        gl.bindVertexArray(array);
        gl.drawArrays(gl.POINTS, 0, count);
      },
      tags() {},
    };
    const visible = layers.filter((layer) => layer.shown);
    visible.forEach((layer) => layer.parts.forEach((part) => drawn[part.kind](part)));
    const line = sights.subarray(6 * posture(), 6 * posture() + 6);
    if (visible.some((layer) => layer.sight) && !line.some(Number.isNaN)) {
      gl.bindBuffer(gl.ARRAY_BUFFER, sight.made);
      gl.bufferSubData(gl.ARRAY_BUFFER, 0, line);
      drawn.strokes({ ...sight, count: 1 });
    }
    writeTags(camera, width, height, ratio, onPaper, visible);
  }

  // Numbers and names above the picture; those on the far side of the surface are pale.
  let written = [];
  function writeTags(camera, width, height, ratio, onPaper, visible) {
    [tags.width, tags.height] = [width * ratio, height * ratio];
    const pen = tags.getContext("2d");
    pen.scale(ratio, ratio);
    pen.textAlign = "center";
    pen.textBaseline = "middle";
    written = visible.flatMap((layer) => layer.parts.filter((part) => part.kind === "tags").flatMap((part) => part.places.map((at, i) => {
      const far = part.normals && dot(part.normals[i], add(camera.eye, at, -1)) < 0;
      return { far, part, i, text: part.texts[i], hint: part.hints[i], at: onScreen(camera, at, width, height), pose: part.normals ? Number(part.texts[i]) : null };
    })));
    const size = width < 600 ? 9 : 12;
    written.sort((a, b) => b.at[2] - a.at[2]).forEach(({ far, part, text, at: [x, y], pose }) => {
      pen.globalAlpha = far ? 0.25 : 1;
      pen.font = `${pose === null ? 600 : 500} ${size}px system-ui, sans-serif`;
      pen.strokeStyle = scheme(part.colour, onPaper);
      pen.fillStyle = scheme("--card", onPaper);
      pen.lineWidth = 2;
      pen.beginPath();
      if (pose === null) pen.roundRect(x - pen.measureText(text).width / 2 - 5, y - size * 0.85, pen.measureText(text).width + 10, size * 1.7, 3);
      else pen.arc(x, y, size * 0.85, 0, 7);
      pen.fill();
      pen.stroke();
      if (pose !== null && pose + 1 === posture()) {
        pen.fillStyle = pen.strokeStyle;
        pen.fill();
        pen.fillStyle = "#ffffff";
      } else pen.fillStyle = scheme("--ink", onPaper);
      pen.fillText(text, x, y + 0.5);
    });
    pen.globalAlpha = 1;
  }

  let waiting = false;
  function draw() {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(drawNow);
  }
  function drawNow() {
    waiting = false;
    const { clientWidth, clientHeight } = view;
    if (clientWidth) paintAll(clientWidth, clientHeight, Math.min(2, devicePixelRatio || 1), false);
  }

  // --- what a reader does ----------------------------------------------------------------------
  function show(number) {
    slider.value = number;
    shown.textContent = plan.postures[posture()];
    slider.setAttribute("aria-valuetext", shown.textContent);
    rows.forEach((row, i) => row.toggleAttribute("aria-current", i + 1 === posture()));
    draw();
  }
  const turn = (sideways, upwards) => {
    place.turn -= sideways;
    place.rise += upwards;
    settle();
  };
  const zoom = (factor) => {
    place.distance *= factor;
    settle();
  };
  function shift(x, y) {
    const right = unit(cross(up, outward())), top = cross(outward(), right);
    const scale = 2 * Math.tan(FIELD_OF_VIEW / 2) * place.distance * back(view.clientWidth, view.clientHeight) / view.clientHeight;
    place.centre = add(add(place.centre, right, -x * scale), top, y * scale);
    settle();
  }

  function pointed(event) {
    const { left, top, width, height } = view.getBoundingClientRect();
    const [x, y] = [event.clientX - left, event.clientY - top];
    const near = ([a, b]) => Math.hypot(a - x, b - y);
    const tag = written.findLast((each) => near(each.at) < 12);
    if (tag) return { ...tag, x, y, width };
    const camera = cameraFor(width, height);
    const dots = layers.filter((layer) => layer.shown).flatMap((layer) => layer.parts.filter((part) => part.kind === "dots" && part.hints.length));
    const found = dots.flatMap((part) => part.places.map((at, i) => ({ at: onScreen(camera, at, width, height), hint: part.hints[i] })))
      .filter((each) => near(each.at) < 5).sort((a, b) => a.at[2] - b.at[2])[0];
    return found && { ...found, pose: null, x, y, width };
  }
  function tell(found) {
    hint.hidden = !found;
    view.style.cursor = found && found.pose !== null ? "pointer" : "";
    if (!found) return;
    hint.textContent = found.hint;
    hint.style.left = `${Math.max(0, Math.min(found.x + 14, found.width - 260))}px`;
    hint.style.top = `${found.y + 14}px`;
  }

  let grip = null;
  view.addEventListener("pointerdown", (event) => {
    grip = { x: event.clientX, y: event.clientY, moved: 0, pans: event.button === 2 || event.shiftKey };
    view.setPointerCapture(event.pointerId);
    tell(null);
  });
  view.addEventListener("pointermove", (event) => {
    if (!grip) return tell(pointed(event));
    const [x, y] = [event.clientX - grip.x, event.clientY - grip.y];
    Object.assign(grip, { x: event.clientX, y: event.clientY, moved: grip.moved + Math.abs(x) + Math.abs(y) });
    if (grip.pans) shift(x, y);
    else turn(0.007 * x, 0.007 * y);
  });
  view.addEventListener("pointerup", (event) => {
    const found = grip && grip.moved < 4 ? pointed(event) : null;
    grip = null;
    tell(found);
    if (found && found.pose !== null) show(found.pose + 1);
  });
  view.addEventListener("pointercancel", () => { grip = null; });
  view.addEventListener("pointerleave", () => tell(null));
  view.addEventListener("contextmenu", (event) => event.preventDefault());
  // A page that is scrolled must not get stuck here: the wheel turns the view once it is chosen.
  view.addEventListener("wheel", (event) => {
    if (document.activeElement !== view && !event.ctrlKey) return;
    event.preventDefault();
    zoom(Math.exp(0.001 * event.deltaY));
  }, { passive: false });
  view.addEventListener("keydown", (event) => {
    const step = 0.1;
    const moves = {
      ArrowLeft: () => turn(-step, 0), ArrowRight: () => turn(step, 0), ArrowUp: () => turn(0, step), ArrowDown: () => turn(0, -step),
      "+": () => zoom(0.85), "-": () => zoom(1.18), Home: () => look(plan.cameras[0]),
    };
    const pans = { ArrowLeft: () => shift(30, 0), ArrowRight: () => shift(-30, 0), ArrowUp: () => shift(0, 30), ArrowDown: () => shift(0, -30) };
    const move = (event.shiftKey && pans[event.key]) || moves[event.key];
    if (!move) return;
    event.preventDefault();
    move();
  });
  slider.addEventListener("input", () => show(slider.value));
  document.getElementById("previous").addEventListener("click", () => show(posture() - 1));
  document.getElementById("next").addEventListener("click", () => show(posture() + 1));
  rows.forEach((row, i) => row.querySelector("button")?.addEventListener("click", () => {
    show(i + 1);
    view.scrollIntoView({ block: "nearest" });
  }));
  const button = (text, label, act) => {
    const made = document.createElement("button");
    made.type = "button";
    made.textContent = text;
    if (label) made.setAttribute("aria-label", label);
    made.addEventListener("click", act);
    document.getElementById("cameras").append(made);
  };
  plan.cameras.forEach((camera) => button(camera.name, "", () => look(camera)));
  const words = document.getElementById("cameras").dataset;
  button("+", words.nearer, () => zoom(0.8));
  button("\u2212", words.farther, () => zoom(1.25));
  layers.forEach((layer) => {
    const box = document.createElement("input");
    box.type = "checkbox";
    box.checked = layer.shown;
    box.addEventListener("change", () => { layer.shown = box.checked; draw(); });
    const swatch = document.createElement("i");
    swatch.style.background = layer.colour.startsWith("--") ? `var(${layer.colour})` : layer.colour;
    const line = document.createElement("label");
    line.append(box, swatch, layer.label);
    document.getElementById("layers").append(line);
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  new ResizeObserver(draw).observe(view);
  show(slider.value);
  look(plan.cameras[0]);
  drawNow();

  // Paper has no depth to turn: it gets a picture, always in the light colours.
  function onPaper(target) {
    const [width, height] = [1100, 620];
    paintAll(width, height, 1, true);
    [target.width, target.height] = [width, height];
    const pen = target.getContext("2d");
    pen.drawImage(canvas, 0, 0);
    pen.drawImage(tags, 0, 0);
    drawNow();
  }
  return {
    draw, drawNow, still: onPaper, floor: plan.floor, layers: () => layers.filter((layer) => layer.shown).length,
    eyeHeight: () => dot(add(place.centre, outward(), place.distance), up),
  };
}
