// Draws the cell with WebGL 2: bodies where the server says they stand, lines, points, labels.
// Nothing of the robot is computed here: only how a camera sees what has been placed.

const BODY = [`#version 300 es
uniform mat4 camera, place; in vec3 corner; out vec3 world;
void main() { vec4 p = place * vec4(corner, 1.0); world = p.xyz; gl_Position = camera * p; }`,
`#version 300 es
precision highp float; uniform vec3 colour, eye; in vec3 world; out vec4 shown;
void main() {
  vec3 n = normalize(cross(dFdx(world), dFdy(world)));
  vec3 towards = normalize(eye - world);
  if (dot(n, towards) < 0.0) n = -n;
  float light = 0.42 + 0.38 * max(dot(n, normalize(vec3(0.35, -0.45, 0.82))), 0.0) + 0.2 * dot(n, towards);
  shown = vec4(colour * light, 1.0);
}`];
const LINE = [`#version 300 es
uniform mat4 camera; uniform vec2 size; uniform float width; in vec3 start, end; in vec2 side;
void main() {
  vec4 a = camera * vec4(start, 1.0), b = camera * vec4(end, 1.0);
  float near = 0.01;
  if (a.w < near) a = mix(b, a, (b.w - near) / (b.w - a.w));
  if (b.w < near) b = mix(a, b, (a.w - near) / (a.w - b.w));
  vec2 along = (b.xy / b.w - a.xy / a.w) * size;
  along = length(along) > 1e-6 ? normalize(along) : vec2(1.0, 0.0);
  vec4 p = side.x < 0.5 ? a : b;
  p.xy += vec2(-along.y, along.x) * side.y * width / size * p.w;
  p.z -= 2e-4 * p.w;
  gl_Position = p;
}`,
`#version 300 es
precision highp float; uniform vec3 colour; out vec4 shown; void main() { shown = vec4(colour, 1.0); }`];
const POINT = [`#version 300 es
uniform mat4 camera; uniform float width; in vec3 corner;
void main() { gl_Position = camera * vec4(corner, 1.0); gl_Position.z -= 6e-4 * gl_Position.w; gl_PointSize = width; }`,
`#version 300 es
precision highp float; uniform vec3 colour; out vec4 shown;
void main() { if (length(gl_PointCoord - 0.5) > 0.5) discard; shown = vec4(colour, 1.0); }`];

const minus = (a, b) => a.map((x, i) => x - b[i]);
const plus = (a, b, f = 1) => a.map((x, i) => x + f * b[i]);
const dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0);
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => { const n = Math.hypot(...a) || 1; return a.map((x) => x / n); };
const STILL = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
const NEAREST = 0.3, FARTHEST = 40, HANDLE = 22;
export const CAMERAS = { Work: [-0.95, 0.42, 1.0], Cell: [-0.8, 0.5, 1.9], Side: [-1.571, 0.12, 1.35], Top: [-1.571, 1.5, 1.5] };

function decoded(text, kind) {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  return new kind(bytes.buffer);
}

function columns(rows) { // WebGL wants matrices column by column
  return Float32Array.from({ length: 16 }, (_, k) => rows[4 * (k % 4) + (k >> 2)]);
}

export class View {
  constructor(canvas, labels) {
    this.canvas = canvas;
    this.labels = labels;
    this.gl = canvas.getContext("webgl2", { antialias: true, alpha: true, preserveDrawingBuffer: true });
    this.bodies = [];
    this.sets = new Map();
    this.names = [];
    this.tool = null;
    this.onDrag = this.onPress = () => {};
    this.look = { target: [0, 0, 1], distance: 6, azimuth: -0.9, elevation: 0.45 };
    if (!this.gl) return;
    this.programs = { body: this.#program(BODY), line: this.#program(LINE), point: this.#program(POINT) };
    this.sides = this.#buffer(new Float32Array([0, -1, 1, -1, 0, 1, 1, 1]));
    this.#listen();
    new ResizeObserver(() => this.draw()).observe(canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
  }

  show(scene) {
    this.scene = scene;
    if (!this.gl) return;
    for (const body of this.bodies) this.gl.deleteVertexArray(body.array);
    this.bodies = scene.bodies.map((body) => this.#body(body));
  }

  place(places) { // of the moving bodies, in their order
    let next = 0;
    for (const body of this.bodies) if (body.moves) body.place = columns(places[next++]);
    this.draw();
  }

  lines(name, points, colour, width = 2) { this.sets.set(name, { kind: "line", points, colour, width }); this.draw(); }
  points(name, points, colour, width = 7) { this.sets.set(name, { kind: "point", points, colour, width }); this.draw(); }
  clear(prefix) { for (const name of [...this.sets.keys()]) if (name.startsWith(prefix)) this.sets.delete(name); this.draw(); }
  label(names) { this.names = names; this.draw(); }

  camera(name) {
    const [azimuth, elevation, far] = CAMERAS[name], { low, high } = this.scene;
    const size = Math.hypot(...minus(high, low));
    this.look = { target: low.map((x, i) => (x + high[i]) / 2), distance: Math.max(2, far * size * 1.15), azimuth, elevation };
    this.draw();
  }

  draw() {
    if (!this.gl || this.waiting) return;
    this.waiting = requestAnimationFrame(() => { this.waiting = 0; this.#draw(); });
  }

  #eye() {
    const { target, distance, azimuth, elevation } = this.look, c = Math.cos(elevation);
    return plus(target, [Math.cos(azimuth) * c, Math.sin(azimuth) * c, Math.sin(elevation)], distance);
  }

  #frame() {
    const eye = this.#eye(), back = unit(minus(eye, this.look.target));
    const right = unit(cross([0, 0, 1], back)), up = cross(back, right);
    return { eye, back, right, up, slope: Math.tan(0.35), ratio: this.canvas.clientWidth / Math.max(1, this.canvas.clientHeight) };
  }

  #matrix({ eye, back, right, up, slope, ratio }) {
    const near = 0.02 * this.look.distance, far = 60, x = 1 / (slope * ratio), y = 1 / slope;
    const z = (far + near) / (near - far), w = (2 * far * near) / (near - far);
    const d = [dot(right, eye), dot(up, eye), dot(back, eye)];
    return new Float32Array([0, 1, 2].flatMap((i) => [x * right[i], y * up[i], z * back[i], -back[i]])
      .concat([-x * d[0], -y * d[1], -z * d[2] + w, d[2]]));
  }

  project(point) { // to pixels; null behind the camera
    const f = this.#frame(), r = minus(point, f.eye), depth = -dot(r, f.back);
    if (depth < 0.01) return null;
    const x = dot(r, f.right) / (depth * f.slope * f.ratio), y = dot(r, f.up) / (depth * f.slope);
    return [(x + 1) * 0.5 * this.canvas.clientWidth, (1 - y) * 0.5 * this.canvas.clientHeight, depth];
  }

  ray(px, py) {
    const f = this.#frame();
    const x = (2 * px / this.canvas.clientWidth - 1) * f.slope * f.ratio, y = (1 - 2 * py / this.canvas.clientHeight) * f.slope;
    return { origin: f.eye, direction: unit(plus(plus(minus([0, 0, 0], f.back), f.right, x), f.up, y)) };
  }

  #draw() {
    const { gl, canvas } = this, dense = devicePixelRatio || 1;
    const size = [Math.round(canvas.clientWidth * dense), Math.round(canvas.clientHeight * dense)];
    if (!size[0] || !size[1]) return;
    if (canvas.width !== size[0] || canvas.height !== size[1]) [canvas.width, canvas.height] = size;
    const style = getComputedStyle(document.documentElement);
    const colour = (name) => {
      const hex = name.startsWith("#") ? name : style.getPropertyValue(`--${name}`).trim();
      return [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16) / 255);
    };
    const frame = this.#frame(), matrix = this.#matrix(frame);
    gl.viewport(0, 0, ...size);
    gl.clearColor(...colour("sky"), 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    let use = this.#use("body", matrix);
    gl.uniform3fv(use.eye, frame.eye);
    for (const body of this.bodies) {
      gl.uniformMatrix4fv(use.place, false, body.place);
      gl.uniform3fv(use.colour, colour(body.role));
      gl.bindVertexArray(body.array);
      gl.drawElements(gl.TRIANGLES, body.count, gl.UNSIGNED_INT, 0);
    }
    gl.bindVertexArray(null);
    for (const { kind, points, colour: name, width } of this.sets.values()) {
      if (!points.length) continue;
      use = this.#use(kind, matrix);
      gl.uniform3fv(use.colour, colour(name));
      gl.uniform1f(use.width, width * dense);
      if (kind === "line") { gl.uniform2fv(use.size, size); this.#strokes(points); } else this.#dots(points);
    }
    this.#handle(colour);
    this.#write();
    canvas.dataset.drawn = String(1 + Number(canvas.dataset.drawn || 0));
  }

  #strokes(points) { // pairs of ends, a quad each
    const { gl } = this, program = this.programs.line.program;
    const data = this.#buffer(new Float32Array(points.flat()));
    gl.bindBuffer(gl.ARRAY_BUFFER, data);
    ["start", "end"].forEach((name, k) => {
      const place = gl.getAttribLocation(program, name);
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, 3, gl.FLOAT, false, 24, 12 * k);
      gl.vertexAttribDivisor(place, 1);
    });
    gl.bindBuffer(gl.ARRAY_BUFFER, this.sides);
    const side = gl.getAttribLocation(program, "side");
    gl.enableVertexAttribArray(side);
    gl.vertexAttribPointer(side, 2, gl.FLOAT, false, 0, 0);
    gl.vertexAttribDivisor(side, 0);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, points.length >> 1);
    this.#forget(data);
  }

  #dots(points) {
    const { gl } = this, data = this.#buffer(new Float32Array(points.flat()));
    const place = gl.getAttribLocation(this.programs.point.program, "corner");
    gl.bindBuffer(gl.ARRAY_BUFFER, data);
    gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, 3, gl.FLOAT, false, 0, 0);
    gl.drawArrays(gl.POINTS, 0, points.length);
    this.#forget(data);
  }

  #forget(data) {
    const { gl } = this;
    for (let k = 0; k < 4; k++) { gl.vertexAttribDivisor(k, 0); gl.disableVertexAttribArray(k); }
    gl.deleteBuffer(data);
  }

  #handle(colour) { // a ring at the tool that can be dragged
    if (!this.tool) return;
    const at = this.project(this.tool);
    if (!at) return;
    const { right, up, slope } = this.#frame(), r = 11 * 2 * at[2] * slope / this.canvas.clientHeight;
    const round = Array.from({ length: 25 }, (_, k) => plus(plus(this.tool, right, r * Math.cos(k * Math.PI / 12)), up, r * Math.sin(k * Math.PI / 12)));
    const use = this.#use("line", this.#matrix(this.#frame()));
    this.gl.disable(this.gl.DEPTH_TEST);
    this.gl.uniform3fv(use.colour, colour("accent"));
    this.gl.uniform1f(use.width, 2.5 * (devicePixelRatio || 1));
    this.gl.uniform2fv(use.size, [this.canvas.width, this.canvas.height]);
    this.#strokes(round.slice(1).flatMap((p, k) => [round[k], p]));
  }

  #write() {
    const texts = this.names.map(({ name, position }) => ({ name, at: this.project(position) }));
    while (this.labels.children.length < texts.length) this.labels.append(document.createElement("span"));
    while (this.labels.children.length > texts.length) this.labels.lastChild.remove();
    texts.forEach(({ name, at }, k) => {
      const span = this.labels.children[k];
      span.hidden = !at || at[0] < 0 || at[1] < 0 || at[0] > this.canvas.clientWidth || at[1] > this.canvas.clientHeight;
      span.textContent = name;
      if (at) { span.style.left = `${Math.max(at[0], 0.5 * span.offsetWidth + 2)}px`; span.style.top = `${at[1]}px`; }
    });
  }

  #listen() {
    const canvas = this.canvas, held = new Map();
    let tool = null, apart = 0;
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      held.set(event.pointerId, [event.offsetX, event.offsetY]);
      const at = this.tool && this.project(this.tool);
      const near = at && Math.hypot(at[0] - event.offsetX, at[1] - event.offsetY) < HANDLE;
      tool = near && held.size === 1 && !event.shiftKey && event.button === 0 ? { off: [at[0] - event.offsetX, at[1] - event.offsetY], depth: at[2] } : null;
    });
    const drop = (event) => { held.delete(event.pointerId); tool = null; apart = 0; };
    canvas.addEventListener("pointerup", drop);
    canvas.addEventListener("pointercancel", drop);
    canvas.addEventListener("pointermove", (event) => {
      const before = held.get(event.pointerId);
      if (!before) return;
      const [dx, dy] = [event.offsetX - before[0], event.offsetY - before[1]];
      held.set(event.pointerId, [event.offsetX, event.offsetY]);
      if (tool) {
        const { origin, direction } = this.ray(event.offsetX + tool.off[0], event.offsetY + tool.off[1]);
        this.onDrag(plus(origin, direction, tool.depth / -dot(direction, this.#frame().back)));
      } else if (held.size === 2) {
        const [a, b] = [...held.values()], now = Math.hypot(a[0] - b[0], a[1] - b[1]);
        if (apart) this.zoom(apart / now);
        apart = now;
        this.pan(dx / 2, dy / 2);
      } else if (event.shiftKey || event.buttons & 6) this.pan(dx, dy);
      else this.turn(-0.006 * dx, 0.006 * dy);
    });
    canvas.addEventListener("wheel", (event) => { event.preventDefault(); this.zoom(Math.exp(0.0012 * event.deltaY)); }, { passive: false });
    canvas.addEventListener("dblclick", (event) => this.onPress(this.ray(event.offsetX, event.offsetY)));
    canvas.addEventListener("keydown", (event) => {
      const keys = { ArrowLeft: () => this.turn(-0.08, 0), ArrowRight: () => this.turn(0.08, 0), ArrowUp: () => this.turn(0, 0.06), ArrowDown: () => this.turn(0, -0.06), "+": () => this.zoom(0.88), "-": () => this.zoom(1.14) };
      if (!keys[event.key]) return;
      event.preventDefault();
      keys[event.key]();
    });
  }

  turn(azimuth, elevation) {
    this.look.azimuth += azimuth;
    this.look.elevation = Math.min(1.55, Math.max(-0.05, this.look.elevation + elevation));
    this.draw();
  }

  zoom(factor) { this.look.distance = Math.min(FARTHEST, Math.max(NEAREST, this.look.distance * factor)); this.draw(); }

  pan(dx, dy) {
    const { right, up, slope } = this.#frame(), scale = 2 * this.look.distance * slope / this.canvas.clientHeight;
    this.look.target = plus(plus(this.look.target, right, -dx * scale), up, dy * scale);
    this.draw();
  }

  #use(name, matrix) {
    const { program, places } = this.programs[name];
    this.gl.useProgram(program);
    this.gl.uniformMatrix4fv(places.camera, false, matrix);
    return places;
  }

  #program([vertex, fragment]) {
    const { gl } = this, program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    const places = {};
    for (let k = 0; k < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); k++) {
      const { name } = gl.getActiveUniform(program, k);
      places[name] = gl.getUniformLocation(program, name);
    }
    return { program, places };
  }

  #buffer(data, kind = this.gl.ARRAY_BUFFER) {
    const buffer = this.gl.createBuffer();
    this.gl.bindBuffer(kind, buffer);
    this.gl.bufferData(kind, data, this.gl.STATIC_DRAW);
    return buffer;
  }

  #body(body) {
    const { gl } = this, array = gl.createVertexArray(), faces = decoded(body.faces, Uint32Array);
    gl.bindVertexArray(array);
    this.#buffer(decoded(body.vertices, Float32Array));
    const place = gl.getAttribLocation(this.programs.body.program, "corner");
    gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, 3, gl.FLOAT, false, 0, 0);
    this.#buffer(faces, gl.ELEMENT_ARRAY_BUFFER);
    gl.bindVertexArray(null);
    return { array, count: faces.length, moves: body.moves, role: body.role, place: columns(STILL) };
  }
}
