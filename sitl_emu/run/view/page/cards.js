// A card for each vehicle: its state as its telemetry had it, and its camera's newest kept frame with what was detected.

import { latest, poseAt } from "./run.js";

const FIELDS = [
  ["alt_home_m", "altitude", (v) => `${v.toFixed(1).replace("-0.0", "0.0")} m`], ["speed_m_s", "speed", (v) => `${v.toFixed(1)} m/s`],
  ["climb_m_s", "climb", (v) => `${v.toFixed(1).replace("-0.0", "0.0")} m/s`], ["battery", "battery", String],
  ["gps", "GPS", String, "wide"], ["heading_deg", "heading", (v) => `${v.toFixed(0)}°`], ["link", "link", String],
  ["item", "mission item", String],
];
const SILENT_S = 3;

export function makeCard(vehicle, onName, onFrame) {
  const card = document.createElement("article");
  card.className = "card";
  card.style.setProperty("--colour", `var(--v${vehicle.place % 8})`);
  card.innerHTML = `<div class="card-head"><button class="name" aria-pressed="false"></button>
    <span class="quiet model"></span><span class="mode"></span><span class="pill"></span></div>
    <div class="phase"></div><div class="battery" hidden><i></i></div><dl class="values"></dl>
    <button class="camera" hidden aria-label="Enlarge the picture"><img alt=""><svg></svg><time></time></button>`;
  const part = (name) => card.querySelector(name);
  part(".name").textContent = vehicle.name;
  part(".name").title = "Follow it on the map";
  part(".name").onclick = () => onName(vehicle.name);
  part(".model").textContent = vehicle.model;
  vehicle.card = { card, name: part(".name"), mode: part(".mode"), armed: part(".pill"), phase: part(".phase"),
    battery: part(".battery"), values: {}, camera: part(".camera"), image: part("img"), boxes: part("svg"), taken: part("time") };
  for (const [key, name, , width] of FIELDS) {
    const cell = document.createElement("div");
    if (width) cell.className = width;
    cell.dataset.field = key;
    cell.innerHTML = `<dt>${name}</dt><dd>–</dd>`;
    part(".values").append(cell);
    vehicle.card.values[key] = cell.lastChild;
  }
  part(".camera").onclick = () => onFrame(vehicle);
  return card;
}

export function showCard(vehicle, run, time) {
  const { card } = vehicle, state = latest(vehicle.state, time)?.[1] ?? {}, pose = poseAt(vehicle.track, time);
  const armed = state.armed ?? armedByEvents(run, vehicle.name, time);
  put(card.mode, state.mode ? state.mode.replaceAll("_", " ") : "");
  put(card.armed, armed === undefined ? "" : armed ? "armed" : "disarmed");
  card.armed.hidden = armed === undefined;
  card.armed.classList.toggle("armed", Boolean(armed));
  put(card.phase, latest(vehicle.phases, time)?.[1] ?? "");
  const values = { ...state, battery: battery(state), gps: gps(state), link: link(state, time) };
  values.alt_home_m ??= pose && time > 0 ? pose[3] : undefined;
  values.speed_m_s ??= pose ? pose[5] : undefined;
  for (const [key, , words] of FIELDS) {
    const cell = card.values[key], value = values[key];
    put(cell, value === undefined || value === null ? "–" : words(value));
    if (cell.title !== cell.textContent) cell.title = cell.textContent;
  }
  card.values.link.classList.toggle("old", time - (state.heard_s ?? time) > SILENT_S);
  card.battery.hidden = state.battery_percent === undefined || state.battery_percent === null;
  card.battery.firstChild.style.width = `${state.battery_percent ?? 0}%`;
  card.battery.firstChild.className = state.battery_percent < 10 ? "empty" : state.battery_percent < 25 ? "low" : "";
  showFrame(vehicle, time);
}

function put(element, text) { if (element.textContent !== text) element.textContent = text; }

const battery = (s) => (s.battery_percent === undefined || s.battery_percent === null ? undefined : `${s.battery_percent} %${s.battery_v ? `, ${s.battery_v.toFixed(1)} V` : ""}`);
const gps = (s) => (s.gps ? `${s.gps}${Number.isInteger(s.satellites) ? `, ${s.satellites} sat.` : ""}${s.gps_sigma_m ? `, ±${s.gps_sigma_m.toFixed(1)} m` : ""}` : undefined);

function link(state, time) {
  if (state.heard_s === undefined) return undefined;
  const silent = time - state.heard_s;
  return silent > SILENT_S ? `silent ${silent.toFixed(0)} s` : "heard";
}

// Of a vehicle without telemetry in the folder, an autopilot of somebody else's.
function armedByEvents(run, name, time) {
  let armed;
  for (const event of run.events) {
    if (event.time_s > time) break;
    if (event.vehicle === name && (event.event === "armed" || event.event === "disarmed")) armed = event.event === "armed";
  }
  return armed;
}

function showFrame(vehicle, time) {
  const { card } = vehicle, frame = latest(vehicle.frames, time);
  card.camera.hidden = !frame;
  if (!frame) return;
  const age = time - frame[0];
  put(card.taken, age > 1.5 ? `${frame[0].toFixed(1)} s, ${age.toFixed(0)} s old` : `${frame[0].toFixed(1)} s`);
  const found = vehicle.looked.get(frame[0].toFixed(3));
  if (card.shown === frame[1] && card.shownBoxes === found) return;
  if (card.shown !== frame[1]) card.image.src = frame[1];
  [card.shown, card.shownBoxes] = [frame[1], found];
  drawBoxes(card.boxes, vehicle.camera, found ?? []);
}

// Boxes of detections, in the pixels of the whole picture.
export function drawBoxes(svg, size, found) {
  const [width, height] = size ?? [640, 480];
  svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  svg.replaceChildren(...found.flatMap(([label, score, x, y, w, h]) => {
    const box = element("rect", { x: x - w / 2, y: y - h / 2, width: w, height: h });
    const words = `${label} ${score.toFixed(2)}`, left = Math.min(x - w / 2, width - words.length * width / 58);
    const text = element("text", { x: Math.max(2, left), y: Math.max(width / 28, y - h / 2 - width / 120), "font-size": width / 32 });
    text.textContent = words;
    return [box, text];
  }));
}

export function element(name, attributes) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  return made;
}
