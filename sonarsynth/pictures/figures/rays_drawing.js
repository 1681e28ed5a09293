// Rays in space and in a vertical section, drawn on two canvases. Numbers: the element `rays-data`, SI units.
"use strict";
const data = JSON.parse(document.getElementById("rays-data").textContent);
const byId = (id) => document.getElementById(id);
const INK = "#222222", PALE = "#8a8a8a", SURFACE = "74,144,194", BOTTOM = "140,109,70";
const MARKED = new Set(["surface", "bottom", "turning point", "target", "facet"]);

// ---- what is there: the box of everything, rays cut finely enough to be sorted by depth, what is switched on
const weight = (ray) => ray.event.filter((e) => MARKED.has(e)).length + (ray.family === "fan" ? 1e6 : 0);
const wayOf = (ray) => (ray.family !== "fan" ? ray.name : ray.coefficient === null ? "fan" : "fan, sent on");
const rays = data.rays.map((ray) => ({ ...ray, way: wayOf(ray) }));
rays.sort((a, b) => weight(b) - weight(a));  // those with fewer vertices last, on top
const box = boxOf([...rays.flatMap((r) => r.position), ...data.targets.flatMap((t) => t.vertices),
                   ...Object.values(data.places)]);
box.low[2] = -data.bottom;
box.high[2] = 0;
const across = Math.max(box.high[0] - box.low[0], box.high[1] - box.low[1]);
const size = Math.max(across, data.bottom);
for (const axis of [0, 1]) {
  const missing = Math.max(0, 0.15 * size - (box.high[axis] - box.low[axis])) / 2 + 0.04 * size;
  box.low[axis] -= missing;
  box.high[axis] += missing;
}
const middle = [0, 1, 2].map((a) => 0.5 * (box.low[a] + box.high[a]));
const shown = { family: new Set(rays.map((r) => r.family)), way: new Set(data.rays.map(wayOf)) };
const plainStretch = Math.max(1, Math.round(across / data.bottom / 4));
const view = { turn: 0, tilt: 0, scale: 1, shift: [0, 0], stretch: plainStretch };
let hovered = null;

function boxOf(points) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (const p of points) {
    for (let a = 0; a < 3; a++) {
      low[a] = Math.min(low[a], p[a]);
      high[a] = Math.max(high[a], p[a]);
    }
  }
  return { low, high };
}

function pieces(points, longest) {
  const cut = [points[0]];
  for (let i = 1; i < points.length; i++) {
    const a = points[i - 1], b = points[i];
    const n = Math.max(1, Math.ceil(Math.hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]) / longest));
    for (let k = 1; k <= n; k++) cut.push(a.map((v, axis) => v + (b[axis] - v) * (k / n)));
  }
  return cut;
}
for (const ray of rays) ray.fine = pieces(ray.position, size / 60);

function visible(ray) {
  return shown.family.has(ray.family) && shown.way.has(ray.way);
}

// ---- drawing on a canvas of the size that it has on the screen

function sheet(id) {
  const canvas = byId(id), scale = window.devicePixelRatio || 1;
  const width = canvas.clientWidth, height = canvas.clientHeight;
  if (canvas.width !== Math.round(width * scale) || canvas.height !== Math.round(height * scale)) {
    canvas.width = Math.round(width * scale);
    canvas.height = Math.round(height * scale);
  }
  const pen = canvas.getContext("2d");
  pen.setTransform(scale, 0, 0, scale, 0, 0);
  pen.clearRect(0, 0, width, height);
  pen.font = "12px system-ui, sans-serif";
  return { pen, width, height };
}

function path(pen, points) {
  pen.beginPath();
  points.forEach((p, i) => (i ? pen.lineTo(p[0], p[1]) : pen.moveTo(p[0], p[1])));
}

function dot(pen, p, size, colour) {
  pen.beginPath();
  pen.arc(p[0], p[1], size, 0, 2 * Math.PI);
  pen.fillStyle = colour;
  pen.fill();
}

function strokeOf(pen, ray) {
  pen.strokeStyle = ray.colour;
  pen.lineWidth = ray === hovered ? 3.2 : ray.family === "fan" ? 1.0 : 1.5;
  pen.setLineDash(ray.flags.includes("hidden by a target") ? [2, 4] : []);
}

// ---- in space: seen from far away; `eye` gives (right, down, nearness) in pixels

function turned(v) {
  const [ct, st, ci, si] = [Math.cos(view.turn), Math.sin(view.turn), Math.cos(view.tilt), Math.sin(view.tilt)];
  const right = v[0] * ct + v[1] * st, away = v[1] * ct - v[0] * st;
  return [right, v[2] * ci + away * si, v[2] * si - away * ci];
}

function eye(width, height) {
  const { scale, shift, stretch } = view;
  return (p) => {
    const [right, up, near] = turned([p[0] - middle[0], p[1] - middle[1], (p[2] - middle[2]) * stretch]);
    return [width / 2 + shift[0] + scale * right, height / 2 + shift[1] - scale * up, scale * near];
  };
}

function fit(width, height) {
  Object.assign(view, { scale: 1, shift: [0, 0] });
  const corners = [];
  for (const x of [box.low[0], box.high[0]]) {
    for (const y of [box.low[1], box.high[1]]) for (const z of [-data.bottom, 0]) corners.push(eye(0, 0)([x, y, z]));
  }
  const reach = boxOf(corners), [w, h] = [0, 1].map((a) => reach.high[a] - reach.low[a]);
  view.scale = 0.94 * Math.min(width / w, height / h);
}

function plate(pen, see, z, colour) {
  const [x0, y0] = box.low, [x1, y1] = box.high;
  path(pen, [[x0, y0, z], [x1, y0, z], [x1, y1, z], [x0, y1, z]].map(see));
  pen.closePath();
  pen.setLineDash([]);
  pen.fillStyle = `rgba(${colour},0.10)`;
  pen.fill();
  pen.strokeStyle = `rgba(${colour},0.35)`;
  pen.lineWidth = 1;
  pen.stroke();
  for (const axis of [0, 1]) {
    for (const at of ticks(box.low[axis], box.high[axis], 8)) {
      const ends = axis ? [[x0, at, z], [x1, at, z]] : [[at, y0, z], [at, y1, z]];
      path(pen, ends.map(see));
      pen.strokeStyle = `rgba(${colour},0.18)`;
      pen.stroke();
    }
  }
}

function facets(see) {
  const things = [];
  for (const target of data.targets) {
    const seen = target.vertices.map(see);
    for (const face of target.faces) {
      const [a, b, c] = face.map((i) => seen[i]);
      const u = [b[0] - a[0], b[1] - a[1], b[2] - a[2]], v = [c[0] - a[0], c[1] - a[1], c[2] - a[2]];
      const n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
      const lit = Math.abs(-0.3 * n[0] - 0.55 * n[1] + 0.78 * n[2]) / (Math.hypot(n[0], n[1], n[2]) || 1);
      const grey = Math.round(95 + 125 * lit);
      things.push({ near: (a[2] + b[2] + c[2]) / 3, face: [a, b, c], colour: `rgb(${grey},${grey},${grey})` });
    }
  }
  return things;
}

function strokes(see) {
  const things = [];
  for (const ray of rays) {
    ray.onSpace = [];
    if (!visible(ray)) continue;
    ray.onSpace = ray.fine.map(see);
    for (let i = 1; i < ray.onSpace.length; i++) {
      const a = ray.onSpace[i - 1], b = ray.onSpace[i];
      things.push({ near: (a[2] + b[2]) / 2, ray, line: [a, b] });
    }
    if (ray.family === "fan") continue;
    ray.position.forEach((p, i) => {
      if (MARKED.has(ray.event[i])) things.push({ near: see(p)[2] + 1, ray, dot: see(p) });
    });
  }
  return things;
}

function drawSpace() {
  const { pen, width, height } = sheet("space");
  const see = eye(width, height), fromAbove = view.tilt >= 0;
  plate(pen, see, fromAbove ? -data.bottom : 0, fromAbove ? BOTTOM : SURFACE);
  const things = [...facets(see), ...strokes(see)].sort((a, b) => a.near - b.near);
  pen.lineJoin = "round";
  for (const thing of things) {
    if (thing.face) {
      path(pen, thing.face);
      pen.closePath();
      pen.setLineDash([]);
      pen.lineWidth = 0.6;
      pen.fillStyle = pen.strokeStyle = thing.colour;
      pen.fill();
      pen.stroke();
    } else if (thing.line) {
      strokeOf(pen, thing.ray);
      path(pen, thing.line);
      pen.stroke();
    } else {
      dot(pen, thing.dot, 2.6, thing.ray.colour);
    }
  }
  plate(pen, see, fromAbove ? 0 : -data.bottom, fromAbove ? SURFACE : BOTTOM);
  pen.setLineDash([]);
  for (const [name, place] of Object.entries(data.places)) {
    const p = see(place);
    dot(pen, p, 4, INK);
    pen.fillText(name, p[0] + 7, p[1] - 5);
  }
  for (const [name, arm] of [["E", [34, 0, 0]], ["N", [0, 34, 0]], ["up", [0, 0, 34]]]) {
    const [right, up] = turned(arm);
    path(pen, [[52, height - 48], [52 + right, height - 48 - up]]);
    pen.strokeStyle = PALE;
    pen.lineWidth = 1.2;
    pen.stroke();
    pen.fillText(name, 54 + right, height - 50 - up);
  }
}

// ---- in a vertical section, with the profile beside it

function ticks(low, high, count) {
  const raw = (high - low) / count || 1, ten = 10 ** Math.floor(Math.log10(raw));
  const step = ten * ([1, 2, 5].find((k) => k * ten >= raw) || 10);
  const first = Math.ceil(low / step - 1e-9), made = [];
  for (let k = first; k * step <= high + 1e-9 * step; k++) made.push(k * step);
  return made;
}

function axes(pen, frame, xs, ys, name) {
  const [x0, y0, x1, y1] = frame;
  const kx = (x1 - x0) / (xs[1] - xs[0]), ky = (y1 - y0) / (ys[1] - ys[0]);
  const at = (p) => [x0 + (p[0] - xs[0]) * kx, y1 - (p[1] - ys[0]) * ky];
  pen.setLineDash([]);
  pen.lineWidth = 1;
  pen.strokeStyle = "#dddddd";
  pen.fillStyle = INK;
  pen.textAlign = "center";
  for (const x of ticks(xs[0], xs[1], Math.max(3, (x1 - x0) / 70))) {
    path(pen, [at([x, ys[0]]), at([x, ys[1]])]);
    pen.stroke();
    pen.fillText(plain(x), at([x, 0])[0], y1 + 14);
  }
  pen.textAlign = "right";
  for (const y of ticks(ys[0], ys[1], (y1 - y0) / 35)) {
    path(pen, [at([xs[0], y]), at([xs[1], y])]);
    pen.stroke();
    pen.fillText(plain(y), x0 - 5, at([0, y])[1] + 4);
  }
  pen.textAlign = "left";
  pen.fillText(name, x0 + 4, y0 - 5);
  pen.strokeStyle = PALE;
  pen.strokeRect(x0, y0, x1 - x0, y1 - y0);
  return at;
}

function plain(x) {
  return String(Number(x.toPrecision(6)));
}

function drawSection() {
  const { pen, width, height } = sheet("section");
  const along = (p) => [p[0] * Math.cos(data.bearing) + p[1] * Math.sin(data.bearing), p[2]];
  const reach = boxOf([...rays.filter(visible).flatMap((r) => r.position), ...Object.values(data.places),
                       ...data.targets.flatMap((t) => t.vertices)].map((p) => [...along(p), 0]));
  const margin = 0.04 * (reach.high[0] - reach.low[0]) || 1, zs = [-1.06 * data.bottom, 0.06 * data.bottom];
  const speeds = data.profile.speed, spare = 0.1 * (Math.max(...speeds) - Math.min(...speeds)) || 1;
  const left = axes(pen, [60, 22, 200, height - 24], [Math.min(...speeds) - spare, Math.max(...speeds) + spare], zs,
                    "sound speed (m/s), z (m)");
  path(pen, speeds.map((c, i) => left([c, -data.profile.depth[i]])));
  pen.strokeStyle = INK;
  pen.lineWidth = 1.5;
  pen.stroke();
  const towards = Math.round(((90 - (data.bearing * 180) / Math.PI) % 360 + 360) % 360);
  const at = axes(pen, [262, 22, width - 16, height - 24], [reach.low[0] - margin, reach.high[0] + margin], zs,
                  `distance towards ${towards} deg (m)`);
  for (const [z, colour] of [[0, SURFACE], [-data.bottom, BOTTOM]]) {
    path(pen, [at([reach.low[0] - margin, z]), at([reach.high[0] + margin, z])]);
    pen.strokeStyle = `rgb(${colour})`;
    pen.lineWidth = 2;
    pen.stroke();
  }
  pen.fillStyle = "#c8c8c8";
  for (const target of data.targets) {
    const flat = target.vertices.map((v) => at(along(v)));
    pen.beginPath();
    for (const [i, j, k] of target.faces) {
      const [a, b, c] = [flat[i], flat[j], flat[k]];
      const left = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0;  // all turn alike: none cancels
      [a, left ? b : c, left ? c : b].forEach((p, n) => (n ? pen.lineTo(p[0], p[1]) : pen.moveTo(p[0], p[1])));
      pen.closePath();
    }
    pen.fill();
  }
  for (const ray of rays) {
    ray.onSection = visible(ray) ? ray.position.map((p) => at(along(p))) : [];
    if (!ray.onSection.length) continue;
    strokeOf(pen, ray);
    path(pen, ray.onSection);
    pen.stroke();
    if (ray.family === "fan") continue;
    ray.onSection.forEach((p, i) => MARKED.has(ray.event[i]) && dot(pen, p, 2.6, ray.colour));
  }
  pen.setLineDash([]);
  for (const [name, place] of Object.entries(data.places)) {
    dot(pen, at(along(place)), 4, INK);
    pen.fillText(name, at(along(place))[0] + 7, at(along(place))[1] - 5);
  }
}
