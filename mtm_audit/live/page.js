"use strict";
// Names come from outside, and go into the page as text alone.
const SVG = "http://www.w3.org/2000/svg";
// As in the picture.
const COLOURS = ["#ffbe00", "#46c8ff", "#5ae678", "#ff82dc", "#faf03c", "#ff783c", "#82ebeb", "#ffb4c8"];
const WIDTH = 640, HEIGHT = 320, LEFT = 44, RIGHT = 12, TOP = 12, BOTTOM = 30;
const colourOf = (number) => COLOURS[number % COLOURS.length];

function add(parent, name, attributes, text) {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  if (text !== undefined) element.textContent = text;
  parent.append(element);
  return element;
}

function drawCurve(state) {
  const svg = document.getElementById("curve");
  svg.replaceChildren();
  const values = state.points.flatMap((point) => [point.bits, ...Object.values(point.channels)]);
  const finite = values.filter((value) => value !== null);
  const top = Math.max(state.needed_bits * 1.5, ...finite) * 1.05;
  const end = Math.max(state.watched_s, 1);
  const x = (seconds) => LEFT + (WIDTH - LEFT - RIGHT) * seconds / end;
  const y = (bits) => HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * Math.min(Math.max(bits, 0), top) / top;
  add(svg, "path", {class: "axis", d: `M${LEFT},${TOP}V${y(0)}H${WIDTH - RIGHT}`});
  add(svg, "path", {class: "needed", d: `M${LEFT},${y(state.needed_bits)}H${WIDTH - RIGHT}`});
  add(svg, "text", {x: LEFT + 4, y: y(state.needed_bits) - 4}, `${state.needed_bits.toFixed(1)} bits are needed`);
  add(svg, "text", {x: 4, y: TOP + 10}, top.toFixed(0));
  add(svg, "text", {x: 4, y: y(0)}, "0 bits");
  add(svg, "text", {x: WIDTH - RIGHT, y: HEIGHT - 8, "text-anchor": "end"}, `${end.toFixed(0)} s`);
  const line = (pairs, colour) => {
    const known = pairs.filter(([, bits]) => bits !== null && bits !== undefined);
    const d = known.map(([seconds, bits], i) => `${i ? "L" : "M"}${x(seconds).toFixed(1)},${y(bits).toFixed(1)}`);
    if (known.length) add(svg, "path", {class: "line", stroke: colour, d: d.join("")});
    for (const [seconds, bits] of known) add(svg, "circle", {r: 2.5, fill: colour, cx: x(seconds), cy: y(bits)});
  };
  state.channels.forEach((name, i) => line(state.points.map((p) => [p.time_s, p.channels[name]]), colourOf(i)));
  line(state.points.map((p) => [p.time_s, p.bits]), "currentColor");
}

function drawTable(state) {
  const body = document.getElementById("channels");
  body.replaceChildren();
  const last = state.points.at(-1);
  const row = (colour, ...texts) => {
    const line = document.createElement("tr");
    const swatch = document.createElement("td");
    swatch.className = "swatch";
    const svg = add(swatch, "svg", {viewBox: "0 0 10 6"});
    add(svg, "rect", {width: 10, height: 6, fill: colour});
    line.append(swatch);
    for (const text of texts) {
      const cell = document.createElement("td");
      cell.textContent = text;
      line.append(cell);
    }
    body.append(line);
  };
  const number = (bits) => bits === undefined || bits === null ? "–" : bits.toFixed(1);
  state.channels.forEach((name, i) => row(colourOf(i), name, state.bodies[name] || "–", number(last?.channels[name])));
  row("currentColor", "together", "", number(last?.bits));
}

function drawPlan(state) {
  const svg = document.getElementById("plan");
  svg.replaceChildren();
  const known = Object.entries(state.places).filter(([, place]) => place[0] !== null && place[1] !== null);
  if (!known.length) return;
  const xs = known.map(([, place]) => place[0]), ys = known.map(([, place]) => place[1]);
  const size = Math.max(Math.max(...xs) - Math.min(...xs), Math.max(...ys) - Math.min(...ys), 1) * 1.4;
  const middle = (values) => (Math.max(...values) + Math.min(...values)) / 2;
  known.forEach(([name, place], i) => {
    const column = 200 + 300 * (place[0] - middle(xs)) / size, line = 150 - 300 * (place[1] - middle(ys)) / size;
    add(svg, "circle", {cx: column, cy: line, r: 4, fill: colourOf(i)});
    add(svg, "text", {x: column + 7, y: line + 4}, name);
  });
}

async function showPicture() {
  const picture = document.getElementById("picture"), plan = document.getElementById("plan");
  const answer = await fetch("picture");
  picture.classList.toggle("none", answer.status !== 200);
  plan.classList.toggle("none", answer.status === 200);
  if (answer.status !== 200) return;
  const bytes = new Uint8Array(await answer.arrayBuffer());
  let text = "";
  for (let i = 0; i < bytes.length; i += 8192) text += String.fromCharCode(...bytes.subarray(i, i + 8192));
  picture.src = "data:image/jpeg;base64," + btoa(text);
}

async function refresh() {
  try {
    const state = await (await fetch("state")).json();
    const answer = document.getElementById("answer");
    answer.textContent = state.answer;
    answer.className = state.stage;
    document.getElementById("facts").textContent =
      `${state.source}, key ${state.key_id}: ${state.watched_s.toFixed(1)} s watched, ${state.looks} looks, ` +
      `the last ${state.last_look}`;
    const notices = document.getElementById("notices");
    notices.replaceChildren(...state.notices.map((text) => {
      const item = document.createElement("li");
      item.textContent = text;
      return item;
    }));
    drawCurve(state);
    drawTable(state);
    drawPlan(state);
    await showPicture();
    if (state.stage !== "watching") return;
  } catch {
    document.getElementById("facts").textContent = "the watch is over, and this page with it";
    return;
  }
  setTimeout(refresh, 400);
}
refresh();
