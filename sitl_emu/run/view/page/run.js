// What the page knows of a run: rows as the server tells them (rows.py), by vehicle, and what was so at a time.

export class Run {
  constructor(facts) {
    this.facts = facts;
    this.vehicles = new Map(facts.vehicles.map((each, place) => [each.name, {
      ...each, place, track: [], state: [], route: [], home: [], frames: [], candidates: [], looked: new Map(), phases: [],
    }]));
    this.events = [];
    this.finds = [];
    this.over = null;
    this.end = 0;
  }

  // Take in what is new; rows of a vehicle come in the order of their times.
  add(rows) {
    for (const part of ["track", "route", "home", "frames", "candidates"]) {
      for (const [name, added] of Object.entries(rows[part] ?? {})) this.vehicles.get(name)?.[part].push(...added);
    }
    for (const [name, added] of Object.entries(rows.state ?? {})) {
      const states = this.vehicles.get(name)?.state ?? [];
      for (const [time, fields] of added) states.push([time, { ...states.at(-1)?.[1], ...fields }]);
    }
    for (const [name, added] of Object.entries(rows.looked ?? {})) {
      for (const [time, found] of added) this.vehicles.get(name)?.looked.set(time.toFixed(3), found);
    }
    for (const event of rows.events ?? []) this.#addEvent(event);
    if (rows.over) this.over = rows.over;
    for (const vehicle of this.vehicles.values()) this.end = Math.max(this.end, vehicle.track.at(-1)?.[0] ?? 0);
  }

  // Events of different files may come out of order by a moment: each goes where its time puts it.
  #addEvent(event) {
    let at = this.events.length;
    while (at > 0 && this.events[at - 1].time_s > event.time_s) at -= 1;
    this.events.splice(at, 0, event);
    this.end = Math.max(this.end, event.time_s);
    if (event.event === "phase") this.vehicles.get(event.vehicle)?.phases.push([event.time_s, event.text ?? ""]);
    if (event.north_m !== undefined) this.finds.push(event);
  }
}

// The number of rows [time, …] up to a time, by bisection.
export function count(rows, time) {
  let low = 0, high = rows.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (rows[middle][0] <= time) low = middle + 1; else high = middle;
  }
  return low;
}

export const latest = (rows, time) => rows[count(rows, time) - 1];

// Where a vehicle is at a time, between two rows of its track.
export function poseAt(track, time) {
  const at = count(track, time);
  if (at === 0) return track[0];
  const before = track[at - 1], after = track[at];
  if (!after || after[0] - before[0] > 2) return before;
  const share = (time - before[0]) / (after[0] - before[0]);
  const turn = ((after[4] - before[4] + 540) % 360) - 180;
  const mixed = before.map((value, i) => value + share * (after[i] - value));
  mixed[4] = before[4] + share * turn;
  return mixed;
}

// Missions have words of their own: what sounds like trouble is shown as trouble.
const BAD = /crash|fail|lost|fault$/;

// How much an event matters: "bad", "warn", "find" (it has a picture), or "".
export function weight(event) {
  const severity = event.severity ?? "";
  if (BAD.test(event.event)) return "bad";
  if (["emergency", "alert", "critical", "error"].includes(severity)) return "bad";
  if (["touched", "yielded", "autopilot shut down", "autopilot rebooted"].includes(event.event) || severity === "warning") return "warn";
  return event.picture ? "find" : "";
}
