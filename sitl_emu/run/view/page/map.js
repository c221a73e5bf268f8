// The map: metres north and east of the world's origin, north up. Draws what it is handed, and tells where one clicks.

import { count, latest, poseAt } from "./run.js";

const AREAS = { water: "#3f8fd8", fire: "#f4641e", grass: "#8dbb4a", crop: "#b6a23a", canopy: "#2e7d32" };
const REACH_PX = 14;

export class MapView {
  constructor(canvas, run, changed) {
    Object.assign(this, { canvas, run, changed, time: 0, follow: null, layers: {}, truth: {}, picture: null, colours: {} });
    this.scale = 4; this.north = 0; this.east = 0;
    this.fitted = false;
    this.spots = [];
    this.fingers = new Map();
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.#listen();
  }

  resize() {
    const box = this.canvas.getBoundingClientRect(), ratio = window.devicePixelRatio || 1;
    [this.width, this.height] = [box.width, box.height];
    [this.canvas.width, this.canvas.height] = [Math.round(box.width * ratio), Math.round(box.height * ratio)];
    this.ratio = ratio;
    if (!this.touched) this.fitted = false;
    this.changed();
  }

  // All that is of interest, with a margin.
  fit() {
    const places = [...this.run.facts.world.outline_m];
    for (const vehicle of this.run.vehicles.values()) {
      for (const row of vehicle.track) places.push([row[1], row[2]]);
      for (const row of vehicle.home) places.push([row[1], row[2]]);
    }
    if (!places.length) places.push([-20, -20], [20, 20]);
    const n = places.map((p) => p[0]), e = places.map((p) => p[1]);
    const [south, north] = [low(n), high(n)], [west, east] = [low(e), high(e)];
    this.north = (south + north) / 2; this.east = (west + east) / 2;
    this.scale = Math.min(60, 0.88 * Math.min(this.height / Math.max(20, north - south), this.width / Math.max(20, east - west)));
    this.fitted = true; this.touched = false; this.follow = null;
    this.changed();
  }

  zoom(factor, x = this.width / 2, y = this.height / 2) {
    const [n, e] = this.ground(x, y);
    this.scale = Math.min(400, Math.max(0.02, this.scale * factor));
    this.north = n + (y - this.height / 2) / this.scale;
    this.east = e - (x - this.width / 2) / this.scale;
    this.touched = true;
    this.changed();
  }

  goTo(north, east) { Object.assign(this, { north, east, touched: true, scale: Math.max(this.scale, 8) }); this.changed(); }
  x(east) { return this.width / 2 + (east - this.east) * this.scale; }
  y(north) { return this.height / 2 - (north - this.north) * this.scale; }
  ground(x, y) { return [this.north - (y - this.height / 2) / this.scale, this.east + (x - this.width / 2) / this.scale]; }

  // The find nearest to a place on the canvas.
  spotAt(x, y) {
    let best = null, away = REACH_PX;
    for (const spot of this.spots) {
      const d = Math.hypot(spot.x - x, spot.y - y);
      if (d <= away) { best = spot; away = d; }
    }
    return best;
  }

  draw() {
    if (!this.width) return;
    if (!this.fitted) { this.fit(); }
    const pen = this.pen = this.canvas.getContext("2d"), style = getComputedStyle(document.documentElement);
    this.ink = (name) => style.getPropertyValue(name).trim();
    pen.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    pen.fillStyle = this.ink("--map");
    pen.fillRect(0, 0, this.width, this.height);
    this.spots = [];
    this.#followVehicle();
    this.#ground();
    this.#areas();
    if (this.layers.truth) this.#truth();
    for (const vehicle of this.run.vehicles.values()) if (this.layers.routes) this.#route(vehicle);
    for (const vehicle of this.run.vehicles.values()) this.#track(vehicle);
    for (const vehicle of this.run.vehicles.values()) if (this.layers.candidates) this.#candidates(vehicle);
    this.#marks();
    this.#finds();
    for (const vehicle of this.run.vehicles.values()) this.#vehicle(vehicle);
    this.#scaleBar();
  }

  #followVehicle() {
    const pose = this.follow && poseAt(this.run.vehicles.get(this.follow).track, this.time);
    if (pose) [this.north, this.east] = [pose[1], pose[2]];
  }

  #ground() {
    const { pen } = this, outline = this.run.facts.world.outline_m;
    const step = niceStep(90 / this.scale);
    const [north, west] = this.ground(0, 0), [south, east] = this.ground(this.width, this.height);
    pen.strokeStyle = this.ink("--grid"); pen.lineWidth = 1; pen.beginPath();
    for (let n = Math.ceil(south / step) * step; n < north; n += step) { pen.moveTo(0, this.y(n)); pen.lineTo(this.width, this.y(n)); }
    for (let e = Math.ceil(west / step) * step; e < east; e += step) { pen.moveTo(this.x(e), 0); pen.lineTo(this.x(e), this.height); }
    pen.stroke();
    if (!outline.length) return;
    const n = outline.map((p) => p[0]), e = outline.map((p) => p[1]);
    if (this.picture && this.layers.ground) {
      const dark = document.documentElement.dataset.theme === "dark";
      pen.globalAlpha = dark ? 0.62 : 0.85;
      pen.imageSmoothingQuality = "high";
      pen.drawImage(this.picture, this.x(low(e)), this.y(high(n)), (high(e) - low(e)) * this.scale, (high(n) - low(n)) * this.scale);
      pen.globalAlpha = 1;
    }
    pen.strokeStyle = this.ink("--quiet"); pen.lineWidth = 1;
    this.#path(outline, true); pen.stroke();
  }

  #areas() {
    const { pen } = this;
    for (const area of this.truth.areas ?? []) {
      if (this.picture && this.layers.ground && area.kind !== "fire") continue; // the picture shows it better
      pen.fillStyle = AREAS[area.kind] ?? "#888";
      pen.globalAlpha = 0.45;
      this.#path(area.outline_m, true);
      for (const island of area.islands_m ?? []) this.#path(island, true, false);
      pen.fill("evenodd");
      pen.globalAlpha = 1;
    }
  }

  #truth() {
    const { pen } = this;
    pen.lineWidth = 1.5;
    for (const thing of this.truth.objects ?? []) {
      const x = this.x(thing.east_m), y = this.y(thing.north_m), r = thing.target ? 7 : 4.5;
      pen.strokeStyle = this.#labelColour(thing.kind);
      pen.beginPath();
      if (thing.target) { pen.moveTo(x, y - r); pen.lineTo(x + r, y); pen.lineTo(x, y + r); pen.lineTo(x - r, y); pen.closePath(); } else pen.rect(x - r, y - r, 2 * r, 2 * r);
      this.#halo(4, "rgba(255, 255, 255, .75)"); pen.stroke();
      this.spots.push({ x, y, thing });
    }
    for (const body of this.truth.loose ?? []) {
      const [n, e] = body.place_m, r = 4;
      pen.strokeStyle = this.ink("--quiet");
      pen.strokeRect(this.x(e) - r, this.y(n) - r, 2 * r, 2 * r);
    }
  }

  #route(vehicle) {
    const { pen } = this, home = latest(vehicle.home, this.time), colour = this.ink(`--v${vehicle.place % 8}`);
    const route = latest(vehicle.route, this.time)?.[1] ?? [];
    pen.strokeStyle = pen.fillStyle = colour;
    if (route.length) {
      pen.lineWidth = 1.2; pen.setLineDash([5, 5]);
      this.#path(route); this.#halo(3); pen.stroke(); pen.setLineDash([]);
      for (const point of route) { pen.beginPath(); pen.arc(this.x(point[1]), this.y(point[0]), 2.4, 0, 7); pen.fill(); }
    }
    if (home) this.#letter("H", this.x(home[2]), this.y(home[1]), colour);
  }

  #track(vehicle) {
    const { pen } = this, colour = this.ink(`--v${vehicle.place % 8}`), here = count(vehicle.track, this.time);
    if (!vehicle.track.length) return;
    pen.strokeStyle = colour; pen.lineJoin = "round";
    pen.globalAlpha = 0.3; pen.lineWidth = 1.2;
    this.#path(vehicle.track, false, true, 1, Math.max(0, here - 1)); pen.stroke();
    pen.globalAlpha = 1; pen.lineWidth = 2;
    this.#path(vehicle.track, false, true, 1, 0, here);
    const pose = poseAt(vehicle.track, this.time);
    if (here) pen.lineTo(this.x(pose[2]), this.y(pose[1]));
    this.#halo(4); pen.stroke();
  }

  #candidates(vehicle) {
    const row = latest(vehicle.candidates, this.time), { pen } = this;
    if (!row || this.time - row[0] > 3) return;
    for (const [label, score, north, east, sigma, sightings] of row[1]) {
      const x = this.x(east), y = this.y(north), r = Math.max(5, (sigma ?? 0) * this.scale);
      pen.strokeStyle = this.#labelColour(label); pen.lineWidth = 1.6; pen.setLineDash([3, 3]);
      pen.beginPath(); pen.arc(x, y, Math.min(r, 40), 0, 7); this.#halo(4, "rgba(255, 255, 255, .75)"); pen.stroke(); pen.setLineDash([]);
      this.spots.push({ x, y, candidate: { label, score, north, east, sigma, sightings, vehicle: vehicle.name } });
    }
  }

  // What missions mark, once the run is over.
  #marks() {
    const { pen } = this, over = this.run.over;
    if (!over || this.time < this.run.end) return;
    for (const [places, , colour] of this.layers.routes ? over.ways : []) {
      pen.strokeStyle = colour; pen.lineWidth = 1.2; pen.setLineDash([4, 4]);
      this.#path(places); this.#halo(3); pen.stroke(); pen.setLineDash([]);
    }
    for (const [north, east, , colour] of over.marks) {
      const x = this.x(east), y = this.y(north);
      pen.strokeStyle = colour; pen.lineWidth = 2;
      pen.beginPath(); pen.moveTo(x - 5, y - 5); pen.lineTo(x + 5, y + 5); pen.moveTo(x - 5, y + 5); pen.lineTo(x + 5, y - 5); pen.stroke();
    }
  }

  #finds() {
    const { pen } = this;
    for (const event of this.run.finds) {
      if (event.time_s > this.time) continue;
      const x = this.x(event.east_m), y = this.y(event.north_m), colour = this.#labelColour(event.label);
      if (!event.picture) {
        pen.fillStyle = colour; pen.beginPath(); pen.arc(x, y, 2.5, 0, 7); pen.fill();
        continue;
      }
      if (event.sigma_m) {
        pen.strokeStyle = pen.fillStyle = colour; pen.lineWidth = 1.2;
        pen.beginPath(); pen.arc(x, y, event.sigma_m * this.scale, 0, 7);
        pen.globalAlpha = 0.18; pen.fill(); pen.globalAlpha = 1; pen.stroke();
      }
      pen.fillStyle = colour; pen.strokeStyle = this.ink("--card"); pen.lineWidth = 2;
      pen.beginPath(); pen.arc(x, y, 6, 0, 7); pen.fill(); pen.stroke();
      const name = `${event.vehicle} ${event.label ?? event.event}`;
      if (!this.spots.some((spot) => spot.event?.label === event.label && Math.hypot(spot.x - x, spot.y - y) < 30)) {
        this.#text(event.label ?? name, x + 9, y + 4);
      }
      this.spots.push({ x, y, event });
    }
  }

  #vehicle(vehicle) {
    const { pen } = this, pose = poseAt(vehicle.track, this.time);
    if (!pose) return;
    const x = this.x(pose[2]), y = this.y(pose[1]);
    pen.save(); pen.translate(x, y); pen.rotate((pose[4] * Math.PI) / 180);
    pen.beginPath(); pen.moveTo(0, -11); pen.lineTo(7.5, 9); pen.lineTo(0, 5); pen.lineTo(-7.5, 9); pen.closePath();
    pen.fillStyle = this.ink(`--v${vehicle.place % 8}`); pen.strokeStyle = this.ink("--card"); pen.lineWidth = 2.5; pen.lineJoin = "round";
    pen.stroke(); pen.fill(); pen.restore();
    const height = latest(vehicle.state, this.time)?.[1].alt_home_m;
    this.#text(height === undefined ? vehicle.name : `${vehicle.name}  ${Math.round(height) + 0} m`, x + 12, y - 8, true);
  }

  #scaleBar() {
    const { pen } = this, metres = niceStep(70 / this.scale), width = metres * this.scale, x = 12, y = this.height - 12;
    pen.strokeStyle = pen.fillStyle = this.ink("--ink"); pen.lineWidth = 1.5;
    pen.beginPath(); pen.moveTo(x, y - 5); pen.lineTo(x, y); pen.lineTo(x + width, y); pen.lineTo(x + width, y - 5); this.#halo(4); pen.stroke();
    this.#text(metres >= 1000 ? `${metres / 1000} km` : `${metres} m`, x + width + 6, y + 1);
  }

  // A line of [.., north, east, ..] rows, of which `at` is the place of north.
  #path(rows, closed = false, fresh = true, at = 0, from = 0, to = rows.length) {
    const { pen } = this;
    if (fresh) pen.beginPath();
    const sparse = Math.max(1, Math.floor((to - from) / 4000));
    for (let i = from; i < to; i += sparse) {
      const [x, y] = [this.x(rows[i][at + 1]), this.y(rows[i][at])];
      if (i === from) pen.moveTo(x, y); else pen.lineTo(x, y);
    }
    if (closed) pen.closePath();
  }

  // Beneath a line, so that it is seen on any ground.
  #halo(width, colour = this.ink("--veil")) {
    const { pen } = this, [stroke, was] = [pen.strokeStyle, pen.lineWidth], dash = pen.getLineDash();
    pen.strokeStyle = colour; pen.lineWidth = width; pen.setLineDash([]); pen.stroke();
    pen.strokeStyle = stroke; pen.lineWidth = was; pen.setLineDash(dash);
  }

  #text(text, x, y, strong = false) {
    const { pen } = this;
    pen.font = `${strong ? "600 " : ""}12px system-ui, "DejaVu Sans", sans-serif`;
    pen.lineWidth = 3.5; pen.lineJoin = "round"; pen.strokeStyle = this.ink("--veil"); pen.strokeText(text, x, y);
    pen.fillStyle = this.ink("--ink"); pen.fillText(text, x, y);
  }

  #letter(letter, x, y, colour) {
    const { pen } = this;
    pen.fillStyle = this.ink("--card"); pen.strokeStyle = colour; pen.lineWidth = 2;
    pen.beginPath(); pen.arc(x, y, 8, 0, 7); pen.fill(); pen.stroke();
    pen.fillStyle = colour; pen.font = "700 11px system-ui, sans-serif"; pen.textAlign = "center"; pen.textBaseline = "middle";
    pen.fillText(letter, x, y + 0.5); pen.textAlign = "start"; pen.textBaseline = "alphabetic";
  }

  // A mission's own colour of a label, where it names one; else one that the label's letters give.
  #labelColour(label = "") {
    if (!this.colours[label]) {
      let sum = 7;
      for (const letter of label) sum = (sum * 31 + letter.charCodeAt(0)) % 360;
      this.colours[label] = this.run.over?.colours?.[label] ?? `hsl(${sum} 85% 42%)`;
    }
    return this.colours[label];
  }

  #listen() {
    const { canvas, fingers } = this;
    const at = (event) => { const box = canvas.getBoundingClientRect(); return [event.clientX - box.left, event.clientY - box.top]; };
    canvas.addEventListener("wheel", (event) => { event.preventDefault(); this.zoom(Math.exp(-event.deltaY * 0.0015), ...at(event)); }, { passive: false });
    canvas.addEventListener("pointerdown", (event) => { canvas.setPointerCapture(event.pointerId); fingers.set(event.pointerId, at(event)); this.moved = 0; });
    canvas.addEventListener("pointermove", (event) => {
      const [x, y] = at(event), before = fingers.get(event.pointerId);
      this.onplace?.(...this.ground(x, y));
      if (!before) { canvas.classList.toggle("point", Boolean(this.spotAt(x, y))); return; }
      const others = [...fingers].filter(([id]) => id !== event.pointerId).map(([, place]) => place);
      this.moved += Math.hypot(x - before[0], y - before[1]);
      if (others.length) {
        const [ox, oy] = others[0];
        this.zoom(Math.hypot(x - ox, y - oy) / Math.max(1, Math.hypot(before[0] - ox, before[1] - oy)), (x + ox) / 2, (y + oy) / 2);
      } else if (this.moved > 4) {
        this.north += (y - before[1]) / this.scale; this.east -= (x - before[0]) / this.scale;
        this.touched = true; this.follow = null; canvas.classList.add("drag");
      }
      fingers.set(event.pointerId, [x, y]);
      this.changed();
    });
    for (const kind of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(kind, (event) => {
        fingers.delete(event.pointerId); canvas.classList.remove("drag");
        const spot = kind === "pointerup" && this.moved <= 4 ? this.spotAt(...at(event)) : null;
        if (spot) this.onspot?.(spot);
      });
    }
    canvas.addEventListener("pointerleave", () => this.onplace?.());
  }
}

const low = (values) => values.reduce((a, b) => Math.min(a, b), Infinity);
const high = (values) => values.reduce((a, b) => Math.max(a, b), -Infinity);

// 1, 2 or 5 times a power of ten, at least so much.
function niceStep(least) {
  const power = 10 ** Math.floor(Math.log10(least));
  return [1, 2, 5, 10].map((factor) => factor * power).find((step) => step >= least * 0.999);
}
