/* A turnable view of scans as points, in WebGL. Positions come as 16 bits in the box of each scan
   and are moved by the scan's pose; the middle of the scene is taken off in double precision. */
"use strict";

function decoded(text, Type) {
  const letters = atob(text), bytes = new Uint8Array(letters.length);
  for (let k = 0; k < letters.length; k++) bytes[k] = letters.charCodeAt(k);
  return new Type(bytes.buffer);
}

function multiply(a, b) {  // 4x4, row by row
  const found = new Array(16).fill(0);
  for (let i = 0; i < 4; i++)
    for (let j = 0; j < 4; j++)
      for (let k = 0; k < 4; k++) found[4 * i + j] += a[4 * i + k] * b[4 * k + j];
  return found;
}

function transposed(a) {
  return a.map((_, k) => a[4 * (k % 4) + Math.floor(k / 4)]);
}

function rgb(text) {
  return [1, 3, 5].map((k) => parseInt(text.slice(k, k + 2), 16) / 255);
}

function sampled(from, cells, most) {  // a few points of a scan, without those far astray
  const [low, high] = from.inner, found = [], step = Math.max(1, Math.ceil(from.count / most));
  for (let k = 0; k < from.count; k += step) {
    const p = [0, 1, 2].map((axis) => from.low[axis] + from.side * cells[3 * k + axis] / 65535);
    if (p.every((v, axis) => Math.abs(2 * v - low[axis] - high[axis]) <= 1.5 * (high[axis] - low[axis]))) found.push(p);
  }
  return found.length ? found : from.inner;
}

const VERTEX = `
attribute vec3 place; attribute vec3 normal; attribute vec3 own; attribute float residual;
uniform mat4 whole; uniform mat4 turn; uniform vec3 low; uniform float side; uniform float size;
uniform int mode; uniform vec3 colour; uniform float dim;
varying vec3 shown;
vec3 ramp(float t) {
  vec3 a = vec3(0.27, 0.45, 0.85), b = vec3(0.25, 0.75, 0.70);
  vec3 c = vec3(0.98, 0.85, 0.25), d = vec3(0.88, 0.15, 0.12);
  if (t < 0.33) return mix(a, b, t / 0.33);
  if (t < 0.66) return mix(b, c, (t - 0.33) / 0.33);
  return mix(c, d, (t - 0.66) / 0.34);
}
void main() {
  gl_Position = whole * vec4(low + side * place, 1.0);
  gl_PointSize = size;
  vec3 base = colour;
  if (mode == 1) base = residual > 254.5 ? vec3(0.45) : ramp(residual / 254.0);
  if (mode == 2) base = own;
  float lit = 1.0;
  if (mode != 3 && dot(normal, normal) > 0.1)
    lit = 0.4 + 0.6 * abs(normalize((turn * vec4(normal, 0.0)).xyz).z);
  shown = mode == 3 ? colour : mix(base * lit, vec3(0.16, 0.18, 0.22), dim);
}`;
const FRAGMENT = `
precision mediump float; varying vec3 shown;
void main() { gl_FragColor = vec4(shown, 1.0); }`;

function createViewer(canvas, data, onPick, onFail) {
  const options = { antialias: true, preserveDrawingBuffer: true };
  const gl = canvas.getContext("webgl", options);
  if (!gl) { onFail("This browser draws no WebGL: the tables below say the same in numbers."); return null; }
  const program = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) { onFail(gl.getProgramInfoLog(program)); return null; }
  gl.useProgram(program);
  const at = (name) => gl.getUniformLocation(program, name);
  const uniform = Object.fromEntries(
    ["whole", "turn", "low", "side", "size", "mode", "colour", "dim"].map((name) => [name, at(name)]));
  const attribute = Object.fromEntries(
    ["place", "normal", "own", "residual"].map((name) => [name, gl.getAttribLocation(program, name)]));

  const names = Object.keys(data.scans);
  const scans = {};
  const buffer = (array) => {
    const made = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, made);
    gl.bufferData(gl.ARRAY_BUFFER, array, gl.STATIC_DRAW);
    return made;
  };
  names.forEach((name, number) => {
    const from = data.scans[name], cells = decoded(from.points, Uint16Array);
    scans[name] = {
      number, count: from.count, low: from.low, side: from.side, sample: sampled(from, cells, Math.max(60, Math.min(1000, 2e4 / names.length))), colour: rgb(from.colour),
      grade: rgb(from.grade), visible: true,
      place: buffer(cells),
      normal: buffer(decoded(from.normals, Int8Array)),
      residual: buffer(decoded(from.residuals, Uint8Array)),
      own: from.colours ? buffer(decoded(from.colours, Uint8Array)) : null,
    };
  });

  const state = { scene: null, sample: [], centre: [0, 0, 0], scale: 1, yaw: 0.45, pitch: 0.3, distance: 2.7,
    pan: [0, 0], mode: "scan", chosen: null, size: 2 };

  function show(scene) {
    state.scene = scene;
    const points = [];
    for (const item of scene.items)
      for (const p of scans[item.scan] ? scans[item.scan].sample : [])
        points.push([0, 1, 2].map((k) => item.pose[4 * k] * p[0] + item.pose[4 * k + 1] * p[1] + item.pose[4 * k + 2] * p[2] + item.pose[4 * k + 3]));
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    for (const p of points)
      for (let k = 0; k < 3; k++) { low[k] = Math.min(low[k], p[k]); high[k] = Math.max(high[k], p[k]); }
    state.centre = points.length ? low.map((v, k) => (v + high[k]) / 2) : [0, 0, 0];
    state.scale = 2.5 / Math.max(Math.hypot(...high.map((v, k) => v - low[k])) || 0, 1e-300);
    state.sample = points.map((p) => p.map((v, k) => (v - state.centre[k]) * state.scale));
    reset();
  }

  function reset() {
    Object.assign(state, { yaw: 0.45, pitch: 0.3, distance: 2.7, pan: [0, 0] });
    const { turn, f, wide } = camera();
    const seen = state.sample.map((p) => [0, 1, 2].map((k) => turn[4 * k] * p[0] + turn[4 * k + 1] * p[1] + turn[4 * k + 2] * p[2]));
    for (let round = 0; seen.length && round < 4; round++) {
      // As near as all that is sampled is seen, then its middle in the middle.
      state.distance = Math.max(...[0, 1].map((k) => seen.reduce((far, p) => Math.max(far, p[2] + Math.abs(p[k] + state.pan[k]) * f / (k ? 0.9 : 0.9 * wide)), 0.05)));
      for (const k of [0, 1]) {
        let [low, high] = [Infinity, -Infinity];
        for (const p of seen) {
          const v = (p[k] + state.pan[k]) / (state.distance - p[2]);
          low = Math.min(low, v); high = Math.max(high, v);
        }
        state.pan[k] -= (low + high) / 2 * state.distance;
      }
    }
    draw();
  }

  function camera() {
    const [cy, sy, cp, sp] = [Math.cos(state.yaw), Math.sin(state.yaw), Math.cos(state.pitch), Math.sin(state.pitch)];
    // data.upright turns the model so that +z is up and -y towards the viewer.
    const around = [cy, sy, 0, 0, -sy * sp, cy * sp, cp, 0, sy * cp, -cy * cp, sp, 0, 0, 0, 0, 1];
    const turn = multiply(around, data.upright);
    const move = [1, 0, 0, state.pan[0], 0, 1, 0, state.pan[1], 0, 0, 1, -state.distance, 0, 0, 0, 1];
    const f = 1 / Math.tan(0.35), near = 0.02, far = 60;
    const wide = canvas.clientWidth / Math.max(canvas.clientHeight, 1) || 1;
    const lens = [f / wide, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), 2 * far * near / (near - far), 0, 0, -1, 0];
    return { turn, f, wide, all: multiply(lens, multiply(move, turn)) };
  }

  function connect(name, from, length, type, normalised) {
    if (attribute[name] < 0) return;
    if (!from) {
      gl.disableVertexAttribArray(attribute[name]);
      gl.vertexAttrib3f(attribute[name], 0.6, 0.6, 0.6);
      return;
    }
    gl.bindBuffer(gl.ARRAY_BUFFER, from);
    gl.enableVertexAttribArray(attribute[name]);
    gl.vertexAttribPointer(attribute[name], length, type, normalised, 0, 0);
  }

  function paint(picking) {
    const ratio = window.devicePixelRatio || 1;
    const wide = Math.round(canvas.clientWidth * ratio), high = Math.round(canvas.clientHeight * ratio);
    if (canvas.width !== wide || canvas.height !== high) { canvas.width = wide; canvas.height = high; }
    gl.viewport(0, 0, canvas.width, canvas.height);
    const ground = picking ? [0, 0, 0] : [0.067, 0.082, 0.11];
    gl.clearColor(...ground, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    if (!state.scene) return;
    const view = camera();
    for (const item of state.scene.items) {
      const scan = scans[item.scan];
      if (!scan || !scan.visible) continue;
      const pose = item.pose.slice();
      for (let k = 0; k < 3; k++) {
        for (let j = 0; j < 3; j++) pose[4 * k + j] *= state.scale;
        pose[4 * k + 3] = (pose[4 * k + 3] - state.centre[k]) * state.scale;
      }
      // The corner of the box is moved in double precision, too: its frame may be far away.
      const corner = [0, 1, 2].map((k) => pose[4 * k] * scan.low[0] + pose[4 * k + 1] * scan.low[1] + pose[4 * k + 2] * scan.low[2] + pose[4 * k + 3]);
      for (let k = 0; k < 3; k++) pose[4 * k + 3] = corner[k];
      gl.uniformMatrix4fv(uniform.whole, false, transposed(multiply(view.all, pose)));
      gl.uniformMatrix4fv(uniform.turn, false, transposed(multiply(view.turn, pose)));
      gl.uniform3f(uniform.low, 0, 0, 0);
      gl.uniform1f(uniform.side, scan.side);
      gl.uniform1f(uniform.size, picking ? Math.max(state.size, 5) : state.size * ratio);
      const mode = picking ? 3 : state.mode === "residual" ? 1 : state.mode === "own" && scan.own ? 2 : 0;
      gl.uniform1i(uniform.mode, mode);
      const id = scan.number + 1;
      const colour = picking ? [(id & 255) / 255, ((id >> 8) & 255) / 255, 0.5] : state.mode === "confidence" ? scan.grade : state.mode === "own" ? [0.6, 0.6, 0.6] : scan.colour;
      gl.uniform3f(uniform.colour, ...colour);
      gl.uniform1f(uniform.dim, state.chosen && state.chosen !== item.scan ? 0.75 : 0);
      connect("place", scan.place, 3, gl.UNSIGNED_SHORT, true);
      connect("normal", scan.normal, 3, gl.BYTE, true);
      connect("residual", scan.residual, 1, gl.UNSIGNED_BYTE, false);
      connect("own", scan.own, 3, gl.UNSIGNED_BYTE, true);
      gl.drawArrays(gl.POINTS, 0, scan.count);
    }
  }

  let waiting = false;
  function draw() {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => { waiting = false; paint(false); });
  }

  function pick(x, y) {
    paint(true);
    const ratio = canvas.width / canvas.clientWidth, half = 4, across = 2 * half + 1;
    const pixels = new Uint8Array(4 * across * across);
    gl.readPixels(Math.round(x * ratio) - half, canvas.height - Math.round(y * ratio) - half, across, across, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    let best = null, nearest = Infinity;
    for (let k = 0; k < across * across; k++) {
      const id = pixels[4 * k] + 256 * pixels[4 * k + 1];
      if (!id || pixels[4 * k + 2] < 100) continue;
      const apart = Math.hypot(k % across - half, Math.floor(k / across) - half);
      if (apart < nearest) { nearest = apart; best = names[id - 1]; }
    }
    paint(false);
    return best;
  }

  const pointers = new Map();
  let moved = 0;
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, [event.clientX, event.clientY]);
    moved = 0;
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = pointers.get(event.pointerId);
    if (!before) return;
    const [dx, dy] = [event.clientX - before[0], event.clientY - before[1]];
    if (pointers.size === 2) {
      const [a, b] = [...pointers.values()];
      const gap = Math.hypot(a[0] - b[0], a[1] - b[1]);
      pointers.set(event.pointerId, [event.clientX, event.clientY]);
      const [c, d] = [...pointers.values()];
      zoom(gap / Math.max(Math.hypot(c[0] - d[0], c[1] - d[1]), 1));
      return;
    }
    pointers.set(event.pointerId, [event.clientX, event.clientY]);
    moved += Math.abs(dx) + Math.abs(dy);
    if (event.shiftKey || event.buttons === 2) pan(dx, dy); else turn(dx, dy);
  });
  const release = (event) => {
    if (pointers.delete(event.pointerId) && moved < 4 && event.type === "pointerup") {
      const box = canvas.getBoundingClientRect();
      onPick(pick(event.clientX - box.left, event.clientY - box.top));
    }
  };
  canvas.addEventListener("pointerup", release);
  canvas.addEventListener("pointercancel", release);
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => { event.preventDefault(); zoom(Math.exp(event.deltaY * 0.001)); }, { passive: false });
  canvas.addEventListener("keydown", (event) => {
    const step = 24;
    const keys = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, -step], ArrowDown: [0, step] };
    if (keys[event.key]) (event.shiftKey ? pan : turn)(...keys[event.key]);
    else if (event.key === "+" || event.key === "=") zoom(0.85);
    else if (event.key === "-") zoom(1.18);
    else if (event.key === "r" || event.key === "0") reset();
    else return;
    event.preventDefault();
  });
  window.addEventListener("resize", draw);
  window.addEventListener("beforeprint", () => paint(false));

  function turn(dx, dy) {
    state.yaw -= dx * 0.008;
    state.pitch = Math.max(-1.57, Math.min(1.57, state.pitch + dy * 0.008));
    draw();
  }
  function pan(dx, dy) {
    const step = state.distance * 0.73 / Math.max(canvas.clientHeight, 1);
    state.pan = [state.pan[0] + dx * step, state.pan[1] - dy * step];
    draw();
  }
  function zoom(factor) {
    state.distance = Math.max(0.05, Math.min(40, state.distance * factor));
    draw();
  }

  return {
    show, reset, draw, zoom,
    colourBy(mode) { state.mode = mode; draw(); },
    choose(name) { state.chosen = name; draw(); },
    visible(name, on) { if (scans[name]) scans[name].visible = on; draw(); },
    pointSize(size) { state.size = size; draw(); },
  };
}
