// What people do with the page: turn, zoom, point at a ray, switch families on and off.

const asked = new Set();

function draw(...what) {
  const waiting = asked.size > 0;
  what.forEach((one) => asked.add(one));
  if (waiting) return;
  window.requestAnimationFrame(() => {
    const wanted = [...asked];
    asked.clear();
    wanted.forEach((one) => one());
  });
}

function distance(p, a, b) {
  const u = [b[0] - a[0], b[1] - a[1]], length = u[0] * u[0] + u[1] * u[1];
  const part = length ? Math.min(1, Math.max(0, ((p[0] - a[0]) * u[0] + (p[1] - a[1]) * u[1]) / length)) : 0;
  return Math.hypot(p[0] - a[0] - part * u[0], p[1] - a[1] - part * u[1]);
}

function nearest(p, where) {
  let found = null, least = 7;
  for (const ray of rays) {
    const line = ray[where] || [];
    for (let i = 1; i < line.length; i++) {
      const away = distance(p, line[i - 1], line[i]);
      if (away < least) [found, least] = [ray, away];
    }
  }
  return found;
}

function said(ray) {
  const number = (x, scale, digits, unit) => (x === null ? "-" : (x * scale).toFixed(digits) + " " + unit);
  const deg = (x) => number(x, 180 / Math.PI, 2, "deg");
  const lines = [
    `${ray.name}: ${ray.family}, ${ray.vertices}`,
    `time ${number(ray.travel_time, 1e3, 4, "ms")}   length ${number(ray.path_length, 1, 3, "m")}`,
    `launch ${deg(ray.launch_elevation)}   arrival ${deg(ray.arrival_elevation)}   (of travel, up positive)`,
  ];
  if (ray.transmission_loss !== null) {
    lines.push(`loss ${number(ray.transmission_loss, 1, 1, "dB")}   level ${number(ray.level, 1, 1, "dB re 1 uPa")}`);
  }
  if (ray.coefficient !== null) lines.push(`coefficient ${ray.coefficient.toFixed(3)}`);
  ray.position.forEach((p, i) => {
    if (MARKED.has(ray.event[i]) && lines.length < 16) {
      const when = number(ray.time[i], 1e3, 4, "ms");
      lines.push(`${ray.event[i]}: at depth ${plain(-p[2])} m, ${when}, then ${deg(ray.elevation[i])}`);
    }
  });
  return lines.concat(ray.flags).join("\n");
}

function point(event, where) {
  const before = hovered;
  hovered = nearest([event.offsetX, event.offsetY], where);
  const note = byId("note");
  note.style.display = hovered ? "block" : "none";
  if (hovered) {
    note.textContent = said(hovered);
    note.style.left = Math.min(event.clientX + 14, window.innerWidth - 430) + "px";
    note.style.top = Math.min(event.clientY + 12, window.innerHeight - 150) + "px";
  }
  if (hovered !== before) draw(drawSpace, drawSection);
}

function reset() {
  Object.assign(view, { turn: data.bearing + 0.4, tilt: 0.35 });
  fit(byId("space").clientWidth, byId("space").clientHeight);
  draw(drawSpace);
}

function tickBox(group, name, text, colour) {
  const label = document.createElement("label"), tick = document.createElement("input");
  tick.type = "checkbox";
  tick.checked = true;
  tick.onchange = () => {
    shown[group][tick.checked ? "add" : "delete"](name);
    draw(drawSpace, drawSection);
  };
  label.append(tick);
  if (colour) {
    const line = document.createElement("i");
    line.style.background = colour;
    label.append(line);
  }
  label.append(text);
  byId("controls").append(label);
}

function start() {
  byId("title").textContent = document.title = data.title;
  const thinned = data.targets.filter((t) => t.faces.length < t.facets);
  const notes = thinned.map((t) => `${t.faces.length} of ${t.facets} facets of ${t.name} drawn`);
  byId("about").textContent = [`frame ${data.frame}`, `${rays.length} rays`, ...notes].join(", ");
  for (const family of Object.keys(data.colours)) {
    if (shown.family.has(family)) tickBox("family", family, family, data.colours[family]);
  }
  if (shown.way.size > 1) for (const way of [...shown.way]) tickBox("way", way, way, "");
  const label = document.createElement("label"), slider = document.createElement("input");
  Object.assign(slider, { type: "range", min: 1, max: Math.max(10, 3 * plainStretch), step: 0.5, value: view.stretch });
  slider.oninput = () => {
    view.stretch = Number(slider.value);
    draw(drawSpace);
  };
  label.append("vertical exaggeration ", slider);
  byId("controls").append(label);
  const canvas = byId("space");
  let held = null;
  canvas.onpointerdown = (event) => {
    held = [event.clientX, event.clientY];
    canvas.setPointerCapture(event.pointerId);
  };
  canvas.onpointerup = canvas.onpointercancel = () => (held = null);
  canvas.onpointermove = (event) => {
    if (!held) return point(event, "onSpace");
    const dx = event.clientX - held[0], dy = event.clientY - held[1];
    held = [event.clientX, event.clientY];
    if (event.shiftKey) view.shift = [view.shift[0] + dx, view.shift[1] + dy];
    else {
      view.turn -= dx * 0.008;
      view.tilt = Math.max(-1.57, Math.min(1.57, view.tilt + dy * 0.008));
    }
    return draw(drawSpace);
  };
  canvas.onwheel = (event) => {
    event.preventDefault();
    const factor = Math.exp(-0.0015 * event.deltaY), centre = [canvas.clientWidth / 2, canvas.clientHeight / 2];
    const at = [event.offsetX - centre[0], event.offsetY - centre[1]];
    view.shift = view.shift.map((s, a) => at[a] + (s - at[a]) * factor);
    view.scale *= factor;
    draw(drawSpace);
  };
  canvas.ondblclick = reset;
  byId("section").onpointermove = (event) => point(event, "onSection");
  canvas.onpointerleave = byId("section").onpointerleave = () => (byId("note").style.display = "none");
  window.onresize = () => draw(drawSpace, drawSection);
  reset();
  draw(drawSection);
}

start();
