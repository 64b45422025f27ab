"use strict";
const byId = (id) => document.getElementById(id);
const put = (id, text) => { byId(id).textContent = text; };
let shown = 0;
let ended = false;

function clock(seconds) {
  const s = Math.max(0, Math.round(seconds));
  const two = (n) => String(n).padStart(2, "0");
  if (s < 60) return `${s} s`;
  if (s < 3600) return `${Math.floor(s / 60)}:${two(s % 60)} min`;
  return `${Math.floor(s / 3600)}:${two(Math.floor(s / 60) % 60)} h`;
}

const percent = (x) => `${(100 * x).toPrecision(3)} %`;

function describe(state) {
  const seconds = state.seconds + (state.done ? 0 : state.age_s);
  const left = state.left_s === null ? null : Math.max(0, state.left_s - state.age_s);
  const planned = state.planned === null ? "" : ` of ${state.planned}`;
  put("integrator", state.integrator);
  put("pass", `${state.pass}${planned}`);
  put("of", state.picture === 0 ? "nothing yet" : `after pass ${state.picture}`);
  put("time", clock(seconds));
  put("left", state.done ? "none" : left === null ? "not known" : clock(left));
  put("rays", state.pass === 0 ? "–" : `${(state.rays_per_s / 1e6).toPrecision(3)} million/s`);
  put("error", state.error === null ? (state.integrator === "whitted" ? "no estimate for whitted" : "not known yet")
    : `${percent(state.error)} of the mean${state.integrator === "path" ? ", noise" : ""}`);
  put("status", state.done ? `Finished after pass ${state.pass}.`
    : state.pass === 0 ? `Pass 1 under way for ${clock(seconds)}.`
    : state.age_s > 5 ? `Rendering; the last news is ${clock(state.age_s)} old.` : "Rendering.");
  const share = byId("share");
  if (state.done) share.value = 1;
  else if (left !== null && seconds + left > 0) share.value = seconds / (seconds + left);
  else share.removeAttribute("value");
}

function line(parent, name, attributes, text) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  if (text !== undefined) element.textContent = text;
  parent.append(element);
}

// Whole powers of ten that enclose all values.
function decades(values) {
  const low = Math.floor(Math.log10(Math.min(...values)) + 1e-9);
  const high = Math.ceil(Math.log10(Math.max(...values)) - 1e-9);
  return [low, Math.max(high, low + 1)];
}

function plot(history) {
  const svg = byId("plot");
  svg.replaceChildren();
  const points = history.filter(([pass, error]) => pass > 0 && error > 0);
  byId("curve").hidden = points.length === 0;
  if (points.length === 0) return;
  const [x0, x1] = decades(points.map(([pass]) => pass));
  const [y0, y1] = decades(points.map(([, error]) => 100 * error));
  const x = (pass) => 52 + 298 * (Math.log10(pass) - x0) / (x1 - x0);
  const y = (error) => 190 - 180 * (Math.log10(100 * error) - y0) / (y1 - y0);
  for (let power = x0; power <= x1; power++) {
    const at = x(10 ** power);
    line(svg, "line", { x1: at, x2: at, y1: 10, y2: 190 });
    line(svg, "text", { x: at, y: 208, "text-anchor": power === x1 ? "end" : "middle" }, String(10 ** power));
  }
  for (let power = y0; power <= y1; power++) {
    const at = y(10 ** power / 100);
    line(svg, "line", { x1: 52, x2: 350, y1: at, y2: at });
    const text = power < -3 ? `1e${power}` : String(Number((10 ** power).toPrecision(1)));
    line(svg, "text", { x: 46, y: at + 4, "text-anchor": "end" }, `${text} %`);
  }
  line(svg, "polyline", { points: points.map(([pass, error]) => `${x(pass)},${y(error)}`).join(" ") });
  const [pass, error] = points[points.length - 1];
  line(svg, "circle", { cx: x(pass), cy: y(error), r: 3.5 });
}

async function picture(state) {
  if (state.picture === shown) return;
  const next = new Image();
  next.alt = "The picture so far";
  next.src = `/picture.png?pass=${state.picture}`;
  await next.decode();
  // A small film is enlarged as squares, a large one is not.
  next.style.imageRendering = next.naturalWidth < 300 ? "pixelated" : "auto";
  byId("frame").querySelector("img")?.remove();
  byId("frame").append(next);
  byId("empty").hidden = true;
  shown = state.picture;
}

async function look() {
  try {
    const answer = await fetch("/state.json", { signal: AbortSignal.timeout(5000) });
    const state = await answer.json();
    describe(state);
    plot(state.history);
    await picture(state);
    ended = state.done;
  } catch {
    put("status", "The render has ended, or cannot be reached. This is its last picture.");
  }
  if (!ended) setTimeout(look, 1000);
}
look();
