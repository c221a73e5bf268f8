import { weight } from "./run.js";

// Heights of all vehicles over time, and a tick for what happened: the slider's ground.
export function drawHeights(canvas, run) {
  const box = canvas.getBoundingClientRect(), ratio = window.devicePixelRatio || 1;
  if (!box.width) return;
  [canvas.width, canvas.height] = [Math.round(box.width * ratio), Math.round(box.height * ratio)];
  const pen = canvas.getContext("2d"), style = getComputedStyle(document.documentElement), ink = (name) => style.getPropertyValue(name).trim();
  pen.scale(ratio, ratio);
  const end = Math.max(1, run.end), x = (at) => (at / end) * box.width, base = box.height - 3;
  const top = Math.max(5, ...[...run.vehicles.values()].map((vehicle) => vehicle.track.reduce((most, row) => Math.max(most, row[3]), 0)));
  pen.fillStyle = ink("--paper"); pen.fillRect(0, 0, box.width, box.height);
  for (const [grade, name] of [["find", "--accent"], ["warn", "--warn"], ["bad", "--bad"]]) { // the worst on top
    pen.fillStyle = ink(name);
    for (const event of run.events) {
      if (weight(event) === grade) pen.fillRect(x(event.time_s) - 0.75, 0, 1.5, grade === "find" ? 8 : box.height);
    }
  }
  for (const vehicle of run.vehicles.values()) {
    pen.strokeStyle = ink(`--v${vehicle.place % 8}`); pen.lineWidth = 1.4; pen.beginPath();
    const sparse = Math.max(1, Math.floor(vehicle.track.length / (2 * box.width)));
    for (let i = 0; i < vehicle.track.length; i += sparse) {
      const row = vehicle.track[i], y = base - (Math.max(0, row[3]) / top) * (box.height - 14);
      if (i) pen.lineTo(x(row[0]), y); else pen.moveTo(x(row[0]), y);
    }
    pen.stroke();
  }
}
