// The page of a run: one cursor in simulated time; everything shown is what was so then. Live, the cursor follows the run.

import { Run, count, latest, weight } from "./run.js";
import { drawBoxes, element, makeCard, showCard } from "./cards.js";
import { MapView } from "./map.js";
import { drawHeights } from "./timeline.js";

const $ = (id) => document.getElementById(id);
let run, map, live = false, playing = false, time = 0, dirty = true, frameAt = 0, ended = false;
const samples = [];
let truthAt = null, truthBusy = false;

async function start() {
  run = new Run(await (await fetch("run.json")).json());
  document.title = `${run.facts.scenario}, seed ${run.facts.seed}`;
  $("title").textContent = document.title;
  $("title").title = run.facts.description;
  map = new MapView($("map"), run, () => { dirty = true; });
  map.onplace = showPlace;
  map.onspot = openSpot;
  $("vehicles").classList.toggle("many", run.vehicles.size > 2);
  const longest = Math.max(...[...run.vehicles.keys()].map((name) => name.length));
  $("events").style.setProperty("--who", `${Math.min(12, longest) + 1}ch`);
  for (const vehicle of run.vehicles.values()) $("vehicles").append(makeCard(vehicle, followVehicle, openFrame));
  listen();
  loadPicture();
  follow();
  requestAnimationFrame(tick);
}

// Server-sent events; a browser takes them up again by itself after a break.
function follow() {
  const source = new EventSource("stream");
  let first = true;
  source.onmessage = (message) => {
    run.add(JSON.parse(message.data));
    if (first) { first = false; setLive(!run.over); time = run.end; }
    samples.push([performance.now() / 1000, run.end]);
    while (samples.length > 24) samples.shift();
    if (run.over) showOver();
    if (!map.touched) map.fitted = false;
    showEvents(); showHeights(); showState();
    dirty = true;
  };
  source.addEventListener("end", () => { source.close(); ended = true; setLive(false); showState(); });
  source.onerror = () => { if (!ended) $("state").textContent = "no connection"; };
}

function loadPicture() {
  if (!run.facts.world.outline_m.length) return;
  const picture = new Image();
  picture.onload = () => { map.picture = picture; dirty = true; };
  picture.src = "map.jpg";
}

function tick(now) {
  const step = Math.min(0.25, (now - frameAt) / 1000);
  frameAt = now;
  if (live) {
    const next = time + (run.end - time) * Math.min(1, step * 5);
    if (Math.abs(next - time) > 0.001) { time = next; dirty = true; }
  } else if (playing) {
    seek(time + step * Number($("rate").value));
    if (time >= run.end) setPlaying(false);
  }
  if (dirty) { dirty = false; show(); }
  requestAnimationFrame(tick);
}

function show() {
  map.time = time;
  map.draw();
  $("slider").max = Math.max(1, run.end).toFixed(1);
  $("slider").value = time;
  $("slider").setAttribute("aria-valuetext", `${time.toFixed(1)} seconds`);
  $("clock").textContent = clock(time);
  $("end").textContent = clock(run.end);
  for (const vehicle of run.vehicles.values()) showCard(vehicle, run, time);
  markEvents();
  askTruth();
}

const clock = (seconds) => (seconds < 600 ? `${seconds.toFixed(1)} s` : `${Math.floor(seconds / 60)}:${String(Math.floor(seconds % 60)).padStart(2, "0")} min`);

// Where things truly are: asked for once a second, as some of them move.
async function askTruth() {
  const at = Math.floor(time);
  if (truthBusy || truthAt === at) return;
  truthBusy = true;
  try {
    const truth = await (await fetch(`world.json?t=${at}`)).json();
    truthAt = at;
    map.truth = truth;
    dirty = true;
  } catch { truthAt = at; } finally { truthBusy = false; }
}

/* Events */

let listed = [];

function showEvents() {
  const filter = $("event-filter").value;
  const wanted = run.events.filter((event) => passes(event, filter));
  if (listed.length && wanted.length >= listed.length && listed.every(({ event }, i) => event === wanted[i])) {
    for (const event of wanted.slice(listed.length)) addEvent(event);
  } else {
    listed = []; $("events").replaceChildren();
    for (const event of wanted) addEvent(event);
  }
}

function passes(event, filter) {
  const grade = weight(event);
  return filter === "all" || (filter === "brief" && event.event !== "phase") || (filter === "finds" && event.picture) || (filter === "bad" && (grade === "bad" || grade === "warn"));
}

function addEvent(event) {
  const item = document.createElement("li"), button = document.createElement("button");
  item.className = weight(event);
  const plain = ["text", "statustext", "px4"].includes(event.event);
  button.append(cell("time", `${event.time_s.toFixed(1)} s`), cell("who", event.vehicle), cell("what", ""));
  if (!plain) button.lastChild.append(cell("kind", event.event.replaceAll("_", " ")), event.text ? "  " : "");
  button.lastChild.append(event.text ?? "");
  const place = run.vehicles.get(event.vehicle)?.place;
  if (place !== undefined) item.style.setProperty("--colour", `var(--v${place % 8})`);
  button.onclick = () => { pause(); seek(event.time_s); if (event.picture) openEvent(event); };
  item.append(button);
  $("events").append(item);
  listed.push({ event, item });
}

function cell(name, text) {
  const made = document.createElement("span");
  made.className = name;
  made.textContent = text;
  return made;
}

let marked = -1;

// Those after the cursor are pale; the last one before it is in sight.
function markEvents() {
  const now = count(listed.map(({ event }) => [event.time_s]), time + 1e-6) - 1;
  listed.forEach(({ item }, i) => { item.classList.toggle("later", i > now); item.classList.toggle("now", i === now); });
  const list = $("events");
  if (now !== marked && listed[now] && !list.matches(":hover")) {
    const item = listed[now].item, top = item.offsetTop - list.offsetTop;
    list.scrollTop = Math.max(0, top - list.clientHeight + item.offsetHeight * 1.6);
  }
  marked = now;
}

const stepEvent = (by) => {
  const now = count(listed.map(({ event }) => [event.time_s]), time + 1e-6) - 1;
  const to = listed[by > 0 ? now + 1 : listed[now]?.event.time_s < time - 0.05 ? now : now - 1];
  if (to) { pause(); seek(to.event.time_s); }
};

/* What one clicks on */

function openSpot(spot) {
  if (spot.event) openEvent(spot.event);
  else if (spot.candidate) openDetail(`candidate: ${spot.candidate.label}`, spot.candidate);
  else openDetail(`truth: ${spot.thing.kind}`, spot.thing);
}

function openEvent(event) {
  const { time_s, vehicle, event: kind, text, picture, ...rest } = event;
  openDetail(`${time_s.toFixed(1)} s, ${vehicle}: ${kind.replaceAll("_", " ")}${text ? `, ${text}` : ""}`, rest, picture);
}

function openFrame(vehicle) {
  const frame = latest(vehicle.frames, time);
  if (!frame) return;
  const found = vehicle.looked.get(frame[0].toFixed(3)) ?? [];
  openDetail(`${vehicle.name}'s camera at ${frame[0].toFixed(1)} s`, {}, frame[1], (svg) => drawBoxes(svg, vehicle.camera, found));
}

function openDetail(title, fields, picture, draw) {
  const body = $("detail-body"), head = document.createElement("h2"), list = document.createElement("dl");
  head.textContent = title;
  for (const [key, value] of Object.entries(fields)) {
    const [name, shown] = [document.createElement("dt"), document.createElement("dd")];
    name.textContent = key.replaceAll("_", " ");
    shown.textContent = typeof value === "number" && !Number.isInteger(value) ? String(Number(value.toPrecision(9))) : String(value);
    list.append(name, shown);
  }
  body.replaceChildren(head);
  if (picture) {
    const figure = document.createElement("div"), image = document.createElement("img"), svg = element("svg", {});
    figure.className = "picture"; image.src = picture; image.alt = title;
    figure.append(image, svg);
    draw?.(svg);
    body.append(figure);
  }
  body.append(list);
  $("detail").showModal();
}

function showPlace(north, east) {
  if (north === undefined) { $("place").textContent = ""; return; }
  const [lat0, lon0] = run.facts.world.origin, radius = 6378137, degrees = 180 / Math.PI;
  const lat = lat0 + (north / radius) * degrees, lon = lon0 + (east / (radius * Math.cos(lat0 / degrees))) * degrees;
  $("place").textContent = `N ${north.toFixed(1)}  E ${east.toFixed(1)} m · ${lat.toFixed(6)}, ${lon.toFixed(6)}`;
}

/* Time */

function seek(to) { time = Math.min(Math.max(0, to), run.end); dirty = true; }
function pause() { setLive(false); setPlaying(false); }

function setPlaying(on) {
  playing = on;
  showPlay();
}

function showPlay() {
  const goes = playing || live;
  $("play").textContent = goes ? "❚❚" : "▶";
  $("play").setAttribute("aria-label", goes ? "Pause" : "Play");
}

function setLive(on) {
  live = on && !ended;
  if (live) setPlaying(false);
  $("live").hidden = ended || Boolean(run.over);
  $("live").classList.toggle("on", live);
  showPlay();
  showState();
}

function togglePlay() {
  if (live) { pause(); return; }
  if (!playing && time >= run.end - 0.05) seek(0);
  setPlaying(!playing);
}

function showState() {
  const going = !run.over && !ended;
  $("state").textContent = going ? "live" : run.over ? "finished" : "broken off";
  $("state").classList.toggle("live", going);
  const [from, to] = [samples[0], samples.at(-1)];
  const factor = going && from && to[0] - from[0] > 1 ? (to[1] - from[1]) / (to[0] - from[0]) : 0;
  $("speed-factor").textContent = factor > 0 ? `${factor.toFixed(1)} × real time` : "";
}

function showOver() {
  const { outcome, success, lines, colours } = run.over;
  $("outcome").hidden = false;
  $("outcome").textContent = outcome;
  $("outcome").title = [outcome, ...lines].join("\n");
  $("outcome").classList.toggle("success", success);
  $("report").hidden = false;
  Object.assign(map.colours, colours);
  setLive(false);
}

const showHeights = () => drawHeights($("heights"), run);

function followVehicle(name) {
  map.follow = map.follow === name ? null : name;
  map.touched = true;
  for (const vehicle of run.vehicles.values()) vehicle.card.name.setAttribute("aria-pressed", String(map.follow === vehicle.name));
  if (map.follow) map.scale = Math.max(map.scale, 6);
  dirty = true;
}

function setTheme(theme) {
  document.documentElement.dataset.theme = theme;
  dirty = true;
  showHeights();
}

function changeRate(by) {
  const select = $("rate");
  select.selectedIndex = Math.min(Math.max(0, select.selectedIndex + by), select.options.length - 1);
}

function listen() {
  const dark = matchMedia("(prefers-color-scheme: dark)");
  let theme = null;
  try { theme = localStorage.getItem("sitl-emu-theme"); } catch { /* no storage: the system's choice */ }
  setTheme(theme ?? (dark.matches ? "dark" : "light"));
  dark.addEventListener("change", () => setTheme(dark.matches ? "dark" : "light"));
  const toggleTheme = () => {
    const other = document.documentElement.dataset.theme === "dark" ? "light" : "dark";
    try { localStorage.setItem("sitl-emu-theme", other); } catch { /* for this page alone */ }
    setTheme(other);
  };
  for (const layer of ["ground", "truth", "routes", "candidates"]) {
    const box = $(`layer-${layer}`);
    map.layers[layer] = box.checked;
    box.onchange = () => { map.layers[layer] = box.checked; dirty = true; };
  }
  $("theme").onclick = toggleTheme;
  $("help").onclick = () => $("keys").showModal();
  $("fit").onclick = () => map.fit();
  $("zoom-in").onclick = () => map.zoom(1.5);
  $("zoom-out").onclick = () => map.zoom(1 / 1.5);
  $("play").onclick = togglePlay;
  $("live").onclick = () => setLive(!live);
  $("slider").oninput = () => { setLive(false); seek(Number($("slider").value)); };
  $("event-filter").onchange = () => { showEvents(); dirty = true; };
  for (const dialog of document.querySelectorAll("dialog")) {
    dialog.addEventListener("click", (event) => { if (event.target === dialog) dialog.close(); });
  }
  new ResizeObserver(showHeights).observe($("heights"));
  const keys = {
    " ": togglePlay, ",": () => { pause(); seek(time - 0.2); }, ".": () => { pause(); seek(time + 0.2); },
    "<": () => changeRate(-1), ">": () => changeRate(1), l: () => setLive(true), f: () => map.fit(),
    "+": () => map.zoom(1.5), "=": () => map.zoom(1.5), "-": () => map.zoom(1 / 1.5), n: () => stepEvent(1), p: () => stepEvent(-1),
    d: toggleTheme, "?": () => $("keys").showModal(), Home: () => { pause(); seek(0); }, End: () => { pause(); seek(run.end); },
  };
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || document.querySelector("dialog[open]") || event.target.matches("select")) return;
    if (event.key === " " && event.target.matches("button, input[type=checkbox]")) return;
    const arrow = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    const digit = /^[1-9]$/.test(event.key) ? [...run.vehicles.keys()][Number(event.key) - 1] : undefined;
    if (arrow) { setLive(false); seek(time + arrow * (event.shiftKey ? 30 : 5)); }
    else if (digit) followVehicle(digit);
    else if (keys[event.key]) keys[event.key]();
    else return;
    event.preventDefault();
  });
}

start().catch((error) => { $("state").textContent = `no run: ${error.message}`; });
