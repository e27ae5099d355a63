"use strict";
// Draws a scene in three dimensions with WebGL 2: solids, lines and dots, and on a canvas above them
// tags, arrows and the handle. A page gives it a scene (scene.py), places of the robot's parts, and
// layers of its own; it computes nothing of the robot, only how a camera sees what is placed.
const SHADERS = {
  paint: [`
    uniform mat4 camera, world; in vec3 at; out vec3 place;
    void main() { vec4 moved = world * vec4(at, 1.0); place = moved.xyz; gl_Position = camera * moved; }`, `
    uniform vec3 colour, light; in vec3 place; out vec4 shade;
    void main() { vec3 normal = normalize(cross(dFdx(place), dFdy(place)));
      shade = vec4(colour * mix(0.45, 1.0, 0.5 + 0.5 * dot(normal, light)), 1.0); }`],
  strokes: [`
    uniform mat4 camera; uniform vec2 size; uniform float width; in vec3 a, b; in vec2 corner;
    void main() { vec4 p = camera * vec4(a, 1.0), q = camera * vec4(b, 1.0);
      // A line that begins behind the camera is cut in front of it.
      if (p.w < 0.01) p = mix(q, p, (q.w - 0.01) / (q.w - p.w));
      if (q.w < 0.01) q = mix(p, q, (p.w - 0.01) / (p.w - q.w));
      vec2 along = (q.xy / q.w - p.xy / p.w) * size + vec2(1e-6);
      vec4 r = mix(p, q, corner.x);
      r.xy += corner.y * width * r.w * normalize(vec2(-along.y, along.x)) / size;
      r.z -= 2e-4 * r.w; gl_Position = r; }`, `
    uniform vec3 colour; out vec4 shade; void main() { shade = vec4(colour, 1.0); }`],
  dots: [`
    uniform mat4 camera; uniform float width; in vec3 at, tint; out vec3 colour;
    void main() { gl_Position = camera * vec4(at, 1.0); gl_Position.z -= 4e-4 * gl_Position.w; gl_PointSize = width; colour = tint; }`, `
    in vec3 colour; out vec4 shade;
    void main() { if (length(gl_PointCoord - 0.5) > 0.5) discard; shade = vec4(colour, 1.0); }`],
};
const FIELD_OF_VIEW = Math.PI / 4; // As in scene.py.
const LOWEST = 0.05; // Angle of the camera above the horizon, in rad.
const HANDLE = 22; // Within so many pixels of the handle a drag moves it.
const NONE = Float32Array.from({ length: 16 }, (_, k) => Number(k % 5 === 0));

const add = (a, b, k = 1) => a.map((x, i) => x + k * b[i]);
const dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0);
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => a.map((x) => x / (Math.hypot(...a) || 1));
const times = (a, b) => Float32Array.from({ length: 16 }, (_, k) => [0, 1, 2, 3].reduce((sum, i) => sum + a[4 * i + k % 4] * b[4 * (k >> 2) + i], 0));
const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer;
// Numbers come packed from Python, or as arrays from the page itself.
const numbers = (given) => typeof given === "string" ? new Float32Array(bytes(given)) : given instanceof Float32Array ? given : Float32Array.from(given.flat(2));
const triples = (given) => { const flat = numbers(given); return Array.from({ length: flat.length / 3 }, (_, i) => [...flat.subarray(3 * i, 3 * i + 3)]); };

class Viewer {
  // What a page wants to know: a posture's tag was chosen, the handle was dragged, a line of sight was
  // pressed along; `handle` is a place that can be dragged. `eager`: the wheel zooms unasked. `top`:
  // height in pixels of what the page lays over the view.
  onPick = () => {};
  onDrag = () => {};
  onPress = () => {};
  handle = null;
  layers = [];
  top = 0;
  #places = NONE;
  #view = { centre: [0, 0, 0], turn: 0, rise: 0.5, distance: 1 };
  #written = [];
  #waiting = false;

  constructor(host, { eager = false } = {}) {
    this.host = host;
    this.eager = eager;
    [this.canvas, this.above, this.hint] = ["canvas", "canvas", "div"].map((tag) => document.createElement(tag));
    this.gl = this.canvas.getContext("webgl2", { antialias: true });
    if (!this.gl) {
      host.replaceChildren("This browser draws no view in three dimensions (WebGL 2 is off); the figures on this page say the same.");
      return;
    }
    this.hint.className = "pointed";
    this.hint.hidden = true;
    host.replaceChildren(this.canvas, this.above, this.hint);
    this.programs = Object.fromEntries(Object.entries(SHADERS).map(([name, sources]) => [name, this.#program(sources)]));
    this.corners = this.#buffer(new Float32Array([0, -1, 0, 1, 1, -1, 1, 1]));
    this.#listen();
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
    new ResizeObserver(() => this.draw()).observe(host);
  }

  // --- what is drawn ---------------------------------------------------------------------------
  show(scene, looked = true) {
    const own = this.layers.filter((layer) => layer.own);
    this.layers.filter((layer) => !layer.own).forEach((layer) => layer.parts.forEach((part) => this.#free(part)));
    const up = unit(scene.up);
    const east = unit(Math.abs(up[0]) < 0.9 ? cross(up, cross([1, 0, 0], up)) : cross(up, cross([0, 1, 0], up)));
    Object.assign(this, { scene, up, east, north: cross(up, east) });
    this.layers = [...scene.layers.map((layer) => ({ ...layer, parts: this.#made(layer.parts) })), ...own];
    const bodies = scene.layers.flatMap((layer) => layer.parts).filter((part) => part.part >= 0).length;
    const all = numbers(scene.places), size = 16 * bodies;
    this.postures = Array.from({ length: all.length / size }, (_, k) => all.subarray(k * size, (k + 1) * size));
    this.place(this.postures[0]);
    if (looked) this.look(scene.cameras[0]);
  }

  // The robot's parts, by their transforms.
  place(places) { this.#places = numbers(places); this.draw(); }

  // Other parts for a layer; one that no scene has is the page's own, and outlives a change of scene.
  set(name, ...parts) {
    if (!this.gl) return;
    let layer = this.layers.find((each) => each.name === name);
    if (!layer) this.layers.push(layer = { name, own: true, shown: true, parts: [] });
    layer.parts.forEach((part) => this.#free(part));
    layer.parts = this.#made(parts);
    this.draw();
  }

  #made(parts) { return this.gl ? parts.map((part) => ({ hints: [], ...part, ...this.#makers[part.kind]?.(part) })) : []; }

  #makers = {
    paint: ({ vertices, faces }) => this.#array("paint", (feed) => {
      const indices = new Uint32Array(bytes(faces));
      feed("at", this.#buffer(numbers(vertices)), 3);
      return { count: indices.length, more: this.#buffer(indices, this.gl.ELEMENT_ARRAY_BUFFER) };
    }),
    strokes: ({ ends }) => this.#array("strokes", (feed) => {
      const flat = numbers(ends), made = this.#buffer(flat);
      feed("corner", this.corners, 2);
      feed("a", made, 3, { stride: 24, each: 1 });
      feed("b", made, 3, { stride: 24, offset: 12, each: 1 });
      return { count: flat.length / 6 };
    }),
    dots: ({ at, colours }) => this.#array("dots", (feed) => {
      const places = triples(at);
      feed("at", this.#buffer(numbers(at)), 3);
      if (colours) feed("tint", this.#buffer(new Uint8Array(bytes(colours))), 3, { type: this.gl.UNSIGNED_BYTE, scaled: true });
      return { places, count: places.length };
    }),
    tags: ({ at, normals }) => ({ places: triples(at), normals: normals && triples(normals) }),
  };

  #array(name, fill) {
    const { gl } = this, array = gl.createVertexArray(), buffers = new Set();
    gl.bindVertexArray(array);
    const made = fill((variable, buffer, size, { stride = 0, offset = 0, each = 0, type = gl.FLOAT, scaled = false } = {}) => {
      const place = gl.getAttribLocation(this.programs[name].program, variable);
      buffers.add(buffer);
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, size, type, scaled, stride, offset);
      gl.vertexAttribDivisor(place, each);
    });
    gl.bindVertexArray(null);
    return { ...made, array, buffers: [...buffers, made.more] };
  }

  #free({ array, buffers = [] }) {
    if (array) this.gl.deleteVertexArray(array);
    buffers.filter((each) => each && each !== this.corners).forEach((each) => this.gl.deleteBuffer(each));
  }

  #buffer(data, kind = this.gl.ARRAY_BUFFER) {
    const made = this.gl.createBuffer();
    this.gl.bindBuffer(kind, made);
    this.gl.bufferData(kind, data, this.gl.STATIC_DRAW);
    return made;
  }

  #program(sources) {
    const { gl } = this, program = gl.createProgram();
    sources.forEach((source, i) => {
      const shader = gl.createShader(i ? gl.FRAGMENT_SHADER : gl.VERTEX_SHADER);
      gl.shaderSource(shader, `#version 300 es\nprecision highp float;${source}`);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    });
    gl.linkProgram(program);
    return { program, at: Object.fromEntries(["camera", "world", "colour", "light", "size", "width"].map((each) => [each, gl.getUniformLocation(program, each)])) };
  }

  // --- from where it is seen: always above the floor -------------------------------------------
  look({ centre, eye }) {
    const { up, east, north } = this, away = add(eye, centre, -1), far = Math.hypot(...away);
    Object.assign(this.#view, { centre, turn: Math.atan2(dot(away, north), dot(away, east)), rise: Math.asin(dot(away, up) / far), distance: far });
    this.#settle();
  }
  turn(sideways, upwards) {
    this.#view.turn -= sideways;
    this.#view.rise += upwards;
    this.#settle();
  }
  zoom(factor) {
    this.#view.distance *= factor;
    this.#settle();
  }
  pan(x, y) {
    const { right, top, far } = this.#camera(), scale = 2 * Math.tan(FIELD_OF_VIEW / 2) * far / this.host.clientHeight;
    this.#view.centre = add(add(this.#view.centre, right, -x * scale), top, y * scale);
    this.#settle();
  }
  #settle() {
    const view = this.#view;
    view.rise = Math.min(1.55, Math.max(LOWEST, view.rise));
    view.distance = Math.min(200, Math.max(0.1, view.distance));
    view.centre = add(view.centre, this.up, Math.max(0, this.scene.floor - dot(view.centre, this.up)));
    this.draw();
  }
  #camera(width = this.host.clientWidth, height = this.host.clientHeight) {
    const { centre, turn, rise, distance } = this.#view, { up, east, north } = this;
    const ahead = add(up.map((x) => x * Math.sin(rise)), add(east.map((x) => x * Math.cos(turn)), north, Math.sin(turn)), Math.cos(rise));
    // On an upright screen the same field of view is narrower: step back.
    const far = distance * Math.max(1, 1.5 * height / width), eye = add(centre, ahead, far);
    const right = unit(cross(up, ahead)), top = cross(ahead, right);
    const near = far / 200, away = far * 20, f = 1 / Math.tan(FIELD_OF_VIEW / 2);
    const seen = new Float32Array([right[0], top[0], ahead[0], 0, right[1], top[1], ahead[1], 0, right[2], top[2], ahead[2], 0, -dot(right, eye), -dot(top, eye), -dot(ahead, eye), 1]);
    const lens = new Float32Array([f * height / width, 0, 0, 0, 0, f, 0, 0, 0, 0, (away + near) / (near - away), -1, 0, 0, 2 * away * near / (near - away), 0]);
    return { matrix: times(lens, seen), eye, right, top, ahead, far, width, height };
  }
  // Where a point is in the picture, in pixels, and how far ahead; nowhere from behind the camera.
  project(point, { matrix: m, width, height } = this.#camera()) {
    const [x, y, , w] = [0, 1, 2, 3].map((i) => m[i] * point[0] + m[4 + i] * point[1] + m[8 + i] * point[2] + m[12 + i]);
    return w > 0 ? [(0.5 + 0.5 * x / w) * width, (0.5 - 0.5 * y / w) * height, w] : [-1e9, -1e9, w];
  }
  ray(x, y) {
    const { eye, right, top, ahead, width, height } = this.#camera(), slope = Math.tan(FIELD_OF_VIEW / 2);
    const across = (2 * x / width - 1) * slope * width / height, high = (1 - 2 * y / height) * slope;
    return { origin: eye, direction: unit(add(add(ahead.map((each) => -each), right, across), top, high)), ahead };
  }
  eyeHeight() { return dot(this.#camera().eye, this.up); }

  // --- drawing ---------------------------------------------------------------------------------
  draw() {
    if (!this.gl || this.#waiting) return;
    this.#waiting = true;
    requestAnimationFrame(() => this.drawNow());
  }
  drawNow() {
    this.#waiting = false;
    const { clientWidth, clientHeight } = this.host;
    if (clientWidth && this.scene) this.#paint(clientWidth, clientHeight, Math.min(2, devicePixelRatio || 1));
  }

  #paint(width, height, ratio, ground = "--card") {
    const { gl, canvas } = this, camera = this.#camera(width, height);
    const style = getComputedStyle(document.documentElement);
    const colour = (name) => name.startsWith("--") ? style.getPropertyValue(name).trim() : name;
    const rgb = (name) => [1, 3, 5].map((k) => parseInt(colour(name).slice(k, k + 2), 16) / 255);
    [canvas.width, canvas.height] = [width * ratio, height * ratio];
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(...rgb(ground), 1);
    gl.enable(gl.DEPTH_TEST);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const drawn = {
      paint: ({ count, part }, at) => {
        gl.uniformMatrix4fv(at.world, false, part >= 0 ? this.#places.subarray(16 * part, 16 * part + 16) : NONE);
        gl.drawElements(gl.TRIANGLES, count, gl.UNSIGNED_INT, 0);
      },
      strokes: ({ count }) => gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, count),
      dots: ({ count, colours, colour: name }) => {
        if (!colours) gl.vertexAttrib3f(gl.getAttribLocation(this.programs.dots.program, "tint"), ...rgb(name));
        gl.drawArrays(gl.POINTS, 0, count);
      },
    };
    const parts = this.layers.filter((layer) => layer.shown).flatMap((layer) => layer.parts);
    for (const part of parts.filter((each) => each.array)) {
      const { program, at } = this.programs[part.kind];
      gl.useProgram(program);
      gl.uniformMatrix4fv(at.camera, false, camera.matrix);
      gl.uniform2f(at.size, width, height);
      gl.uniform1f(at.width, part.kind === "dots" ? (part.width || 4.5) * ratio : part.width);
      gl.uniform3fv(at.light, this.scene.light);
      if (part.colour) gl.uniform3fv(at.colour, rgb(part.colour));
      gl.bindVertexArray(part.array);
      drawn[part.kind](part, at);
    }
    gl.bindVertexArray(null);
    [this.above.width, this.above.height] = [width * ratio, height * ratio];
    const pen = this.above.getContext("2d");
    pen.scale(ratio, ratio);
    this.#write(pen, camera, parts, colour);
  }

  // Where a name can be read whose place the border, or what a page lays over the top, would cut.
  #legible([x, y], half, size, { width, height }) {
    if (x < -half || x > width + half || y < -size || y > height + size) return [x, y];
    return [Math.min(Math.max(x, half), width - half), Math.min(Math.max(y, this.top + size), height - size)];
  }

  // What nothing hides. Tags of poses on the far side of the surface are pale.
  #write(pen, camera, parts, colour) {
    const size = camera.width < 600 ? 9 : 12;
    [pen.textAlign, pen.textBaseline, pen.lineWidth] = ["center", "middle", 2];
    this.#written = parts.filter((part) => part.kind === "tags").flatMap((part) => part.places.map((at, i) => ({
      part, text: part.texts[i], hint: part.hints[i] ?? "", at: this.project(at, camera), pose: part.poses || part.normals ? Number(part.texts[i]) : null,
      far: part.normals && dot(part.normals[i], add(camera.eye, at, -1)) < 0,
    })));
    for (const { far, part, text, at, pose } of this.#written.sort((a, b) => b.at[2] - a.at[2])) {
      pen.globalAlpha = far ? 0.25 : 1;
      pen.font = `${pose === null ? 600 : 500} ${size}px system-ui, sans-serif`;
      const [x, y] = pose === null ? this.#legible(at, pen.measureText(text).width / 2 + 7, size, camera) : at;
      pen.strokeStyle = colour(part.colour);
      pen.fillStyle = colour("--card");
      pen.beginPath();
      if (pose === null) pen.roundRect(x - pen.measureText(text).width / 2 - 5, y - size * 0.85, pen.measureText(text).width + 10, size * 1.7, 3);
      else pen.arc(x, y, size * 0.85, 0, 7);
      pen.fill();
      pen.stroke();
      pen.fillStyle = colour("--ink");
      if (pose !== null && pose === this.chosen) {
        pen.fillStyle = pen.strokeStyle;
        pen.fill();
        pen.fillStyle = "#ffffff";
      }
      pen.fillText(text, x, y + 0.5);
    }
    pen.globalAlpha = 1;
    for (const { from, to, colour: name } of parts.filter((part) => part.kind === "arrow")) {
      const [[x, y, near], [u, v, far]] = [this.project(from, camera), this.project(to, camera)], long = Math.hypot(u - x, v - y);
      if (near <= 0 || far <= 0 || long < 1) continue;
      const head = Math.min(16, 0.5 * long), [a, b] = [(u - x) / long, (v - y) / long];
      pen.strokeStyle = pen.fillStyle = colour(name);
      pen.lineWidth = 4;
      pen.beginPath();
      pen.moveTo(x, y);
      pen.lineTo(u - head * a, v - head * b);
      pen.stroke();
      pen.beginPath();
      pen.moveTo(u, v);
      pen.lineTo(u - head * (a - 0.5 * b), v - head * (b + 0.5 * a));
      pen.lineTo(u - head * (a + 0.5 * b), v - head * (b - 0.5 * a));
      pen.fill();
    }
    if (!this.handle) return;
    const [x, y] = this.project(this.handle, camera);
    pen.strokeStyle = colour("--accent");
    pen.lineWidth = 2.5;
    pen.beginPath();
    pen.arc(x, y, 11, 0, 7);
    pen.stroke();
  }

  // Paper has no depth to turn: it gets a picture, always in the light colours.
  still(target) {
    const [width, height] = [1100, 620], root = document.documentElement;
    root.classList.add("light");
    this.#paint(width, height, 1, "#ffffff");
    root.classList.remove("light");
    [target.width, target.height] = [width, height];
    for (const canvas of [this.canvas, this.above]) target.getContext("2d").drawImage(canvas, 0, 0);
    this.drawNow();
  }

  // --- what a reader does ----------------------------------------------------------------------
  #pointed([x, y]) {
    const near = ({ at }) => Math.hypot(at[0] - x, at[1] - y);
    const tag = this.#written.findLast((each) => near(each) < 12);
    if (tag) return tag;
    const camera = this.#camera();
    return this.layers.filter((layer) => layer.shown).flatMap((layer) => layer.parts.filter((part) => part.kind === "dots" && part.hints.length))
      .flatMap((part) => part.places.map((at, i) => ({ at: this.project(at, camera), hint: part.hints[i], pose: null })))
      .filter((each) => near(each) < 5).sort((a, b) => a.at[2] - b.at[2])[0];
  }
  #tell(found, [x, y] = [0, 0]) {
    this.hint.hidden = !found?.hint;
    this.host.style.cursor = found && found.pose !== null ? "pointer" : "";
    this.hint.textContent = found?.hint;
    this.hint.style.left = `${Math.max(0, Math.min(x + 14, this.host.clientWidth - 260))}px`;
    this.hint.style.top = `${Math.max(0, Math.min(y + 14, this.host.clientHeight - this.hint.offsetHeight))}px`;
  }

  #listen() {
    const { host } = this, held = new Map();
    let moved = 0, apart = 0, grip = null;
    const place = (event) => {
      const { left, top } = host.getBoundingClientRect();
      return [event.clientX - left - host.clientLeft, event.clientY - top - host.clientTop];
    };
    const release = (event) => { held.delete(event.pointerId); grip = null; apart = 0; };
    host.addEventListener("pointerdown", (event) => {
      host.setPointerCapture(event.pointerId);
      const [x, y] = place(event), at = this.handle && this.project(this.handle);
      held.set(event.pointerId, { x, y, pans: event.button !== 0 || event.shiftKey });
      const near = at && Math.hypot(at[0] - x, at[1] - y) < HANDLE && held.size === 1 && event.button === 0 && !event.shiftKey;
      grip = near ? { off: [at[0] - x, at[1] - y], depth: at[2] } : null;
      moved = 0;
      this.#tell(null);
    });
    host.addEventListener("pointermove", (event) => {
      const [x, y] = place(event), before = held.get(event.pointerId);
      if (!before) return this.#tell(this.#pointed([x, y]), [x, y]);
      const [dx, dy] = [x - before.x, y - before.y];
      Object.assign(before, { x, y });
      moved += Math.abs(dx) + Math.abs(dy);
      if (grip) {
        const { origin, direction, ahead } = this.ray(x + grip.off[0], y + grip.off[1]);
        this.onDrag(add(origin, direction, -grip.depth / dot(direction, ahead)));
      } else if (held.size === 2) {
        const [a, b] = [...held.values()], now = Math.hypot(a.x - b.x, a.y - b.y);
        if (apart) this.zoom(apart / now);
        apart = now;
        this.pan(dx / 2, dy / 2);
      } else if (before.pans) this.pan(dx, dy);
      else this.turn(0.007 * dx, 0.007 * dy);
    });
    host.addEventListener("pointerup", (event) => {
      const found = held.has(event.pointerId) && moved < 4 ? this.#pointed(place(event)) : null;
      release(event);
      this.#tell(found, place(event));
      if (found && found.pose !== null) this.onPick(found.pose);
    });
    host.addEventListener("pointercancel", release);
    host.addEventListener("pointerleave", () => this.#tell(null));
    host.addEventListener("contextmenu", (event) => event.preventDefault());
    host.addEventListener("dblclick", (event) => { const { origin, direction } = this.ray(...place(event)); this.onPress({ origin, direction }); });
    // A page that is scrolled must not get stuck here: the wheel turns the view once it is chosen.
    host.addEventListener("wheel", (event) => {
      if (!this.eager && document.activeElement !== host && !event.ctrlKey) return;
      event.preventDefault();
      this.zoom(Math.exp(0.001 * event.deltaY));
    }, { passive: false });
    host.addEventListener("keydown", (event) => {
      const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
      if (way && event.shiftKey) this.pan(-30 * way[0], 30 * way[1]);
      else if (way) this.turn(0.1 * way[0], 0.1 * way[1]);
      else if (event.key === "+" || event.key === "-") this.zoom(event.key === "+" ? 0.85 : 1.18);
      else if (event.key === "Home") this.look(this.scene.cameras[0]);
      else return;
      event.preventDefault();
    });
  }

  // Buttons for the scene's cameras, and to come nearer and go back.
  cameras(bar) {
    if (!this.gl) return;
    const button = (text, label, act) => {
      const made = Object.assign(document.createElement("button"), { type: "button", textContent: text });
      if (label) made.setAttribute("aria-label", label);
      made.addEventListener("click", act);
      bar.append(made);
    };
    bar.querySelectorAll("button").forEach((each) => each.remove());
    this.scene.cameras.forEach((camera) => button(camera.name, "", () => this.look(camera)));
    button("+", bar.dataset.nearer, () => this.zoom(0.8));
    button("\u2212", bar.dataset.farther, () => this.zoom(1.25));
  }

  // A switch for each layer.
  switches(list) {
    if (!this.gl) return;
    this.layers.forEach((layer) => {
      const [box, swatch, line] = ["input", "i", "label"].map((tag) => document.createElement(tag));
      Object.assign(box, { type: "checkbox", checked: layer.shown });
      box.addEventListener("change", () => { layer.shown = box.checked; this.draw(); });
      swatch.style.background = layer.colour.startsWith("--") ? `var(${layer.colour})` : layer.colour;
      line.append(box, swatch, layer.label);
      list.append(line);
    });
  }
}
