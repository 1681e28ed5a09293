// A browser of two canvases and no screen: runs the program of a page, moves the mouse over it, and says what it drew.
"use strict";
const html = require("fs").readFileSync(process.argv[2], "utf8");
const [, json, program] = html.match(/<script id="rays-data"[^>]*>([\s\S]*?)<\/script>\s*<script>([\s\S]*?)<\/script>/);

function canvas(width, height) {
  const count = { stroke: 0, fill: 0, text: [] };
  const check = (...numbers) => {
    if (!numbers.every(Number.isFinite)) throw new Error("a coordinate that is not finite: " + numbers);
  };
  const pen = {
    setTransform: check, beginPath() {}, closePath() {}, moveTo: check, lineTo: check, arc: check, strokeRect: check,
    clearRect: () => Object.assign(count, { stroke: 0, fill: 0, text: [] }),
    setLineDash() {},
    stroke: () => (count.stroke += 1),
    fill: () => (count.fill += 1),
    fillText: (text, x, y) => (check(x, y), count.text.push(text)),
  };
  return { clientWidth: width, clientHeight: height, getContext: () => pen, setPointerCapture() {}, count };
}

function element() {
  return { style: {}, children: [], append(...more) { this.children.push(...more); } };
}

const there = { "rays-data": { textContent: json }, space: canvas(900, 500), section: canvas(900, 260) };
for (const id of ["note", "controls", "title", "about"]) there[id] = element();
globalThis.window = { innerWidth: 900, innerHeight: 800, requestAnimationFrame: (draw) => draw() };
globalThis.document = { getElementById: (id) => there[id], createElement: element };
new Function(program)();

const { space, section, note, controls } = there;
const drawn = () => [space.count.stroke, section.count.stroke];
const said = new Set();
for (const [canvas, wide, high] of [[space, 900, 500], [section, 900, 260]]) {
  for (let x = 0; x < wide; x += 9) {
    for (let y = 0; y < high; y += 20) {
      canvas.onpointermove({ offsetX: x, offsetY: y, clientX: x, clientY: y });
      if (note.style.display === "block") said.add(note.textContent);
    }
  }
}
const all = drawn();
const places = [...space.count.text, ...section.count.text];
space.onpointerdown({ clientX: 0, clientY: 0, pointerId: 1 });
for (let i = 0; i < 50; i++) space.onpointermove({ clientX: 17 * i, clientY: 40 * (i % 3), shiftKey: i % 7 === 0 });
space.onpointerup();
space.onwheel({ preventDefault() {}, deltaY: -500, offsetX: 100, offsetY: 400 });
space.ondblclick();
const back = drawn();
const boxes = controls.children.filter((label) => label.children[0].onchange);
boxes.forEach((label) => {
  label.children[0].checked = false;
  label.children[0].onchange();
});
console.log(JSON.stringify({
  title: there.title.textContent, about: there.about.textContent, said: [...said], places, all, back, none: drawn(),
  boxes: boxes.map((label) => label.children.filter((c) => typeof c === "string")[0]),
}));
