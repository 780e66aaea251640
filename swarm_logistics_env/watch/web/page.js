"use strict";

const ACTIVITIES = { searching: "SEARCHING", shuffling: "SHUFFLING", delivering: "DELIVERING" };
const [STORED, NOBODY] = [0, -1];
const element = (id) => document.getElementById(id);
const options = { trails: false, links: false };
let fixed = null, view = null, place = null, isLost = false, problem = { text: "", until: 0 };

// Talking to the command

async function order(what) {
  try {
    const answer = await fetch("order", {
      method: "POST",
      headers: { "Content-Type": "application/json" },
      body: JSON.stringify(what),
    });
    if (!answer.ok) {
      problem = { text: (await answer.json()).problem, until: Date.now() + 5000 };
      showWords();
    }
  } catch {
    isLost = true;
  }
}

async function follow() {
  for (let version = 0; ;) {
    try {
      const answer = await fetch(`moving?after=${version}${options.trails ? "&trails=1" : ""}`);
      if (!answer.ok) throw new Error(answer.statusText);
      const next = await answer.json();
      isLost = false;
      if (next.version === version && !(options.trails && !view.trails.length)) continue;
      version = next.version;
      view = next;
      requestAnimationFrame(show);
    } catch {
      isLost = true;
      if (view) showWords();
      await new Promise((wait) => setTimeout(wait, 1000));
      version = 0;
    }
  }
}

// Drawing

function prepared(canvas) {
  const ratio = window.devicePixelRatio || 1;
  const { width, height } = canvas.getBoundingClientRect();
  const [across, down] = [Math.max(1, Math.round(width * ratio)), Math.max(1, Math.round(height * ratio))];
  if (canvas.width !== across || canvas.height !== down) {
    canvas.width = across;
    canvas.height = down;
  }
  const pen = canvas.getContext("2d");
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, width, height);
  return { pen, width, height };
}

function disc(pen, x, y, radius, colour) {
  pen.fillStyle = colour;
  pen.beginPath();
  pen.arc(x, y, radius, 0, 2 * Math.PI);
  pen.fill();
}

function ring(pen, x, y, radius, width, colour) {
  pen.strokeStyle = colour;
  pen.lineWidth = width;
  pen.beginPath();
  pen.arc(x, y, radius, 0, 2 * Math.PI);
  pen.stroke();
}

function line(pen, points, width, colour) {
  pen.strokeStyle = colour;
  pen.lineWidth = width;
  pen.beginPath();
  points.forEach(([x, y], nth) => (nth ? pen.lineTo(x, y) : pen.moveTo(x, y)));
  pen.stroke();
}

function arrow(pen, [x0, y0], [x1, y1], radius, width, colour) {
  const length = Math.hypot(x1 - x0, y1 - y0), head = 4 + 2.5 * width, gap = radius + 2;
  if (length <= 2 * gap + head) return;
  const [x, y] = [(x1 - x0) / length, (y1 - y0) / length];
  const tip = [x1 - gap * x, y1 - gap * y], base = [tip[0] - head * x, tip[1] - head * y];
  line(pen, [[x0, y0], base], width, colour);
  pen.fillStyle = colour;
  pen.beginPath();
  pen.moveTo(...tip);
  pen.lineTo(base[0] - 0.45 * head * y, base[1] + 0.45 * head * x);
  pen.lineTo(base[0] + 0.45 * head * y, base[1] - 0.45 * head * x);
  pen.fill();
}

function item(pen, x, y, half, isRequested, colours) {
  const edge = Math.max(1, 0.2 * half);
  pen.fillStyle = isRequested ? colours.INK : colours.ITEM_EDGE;
  pen.fillRect(x - half, y - half, 2 * half, 2 * half);
  pen.fillStyle = isRequested ? colours.REQUESTED : colours.ITEM;
  pen.fillRect(x - half + edge, y - half + edge, 2 * (half - edge), 2 * (half - edge));
}

function halo(pen, x, y, radius, age, colour) {
  const strength = 1 - age, reach = radius * (1.5 + strength);
  const glow = pen.createRadialGradient(x, y, radius, x, y, reach);
  pen.globalAlpha = 0.25 + 0.4 * strength;
  glow.addColorStop(0, colour);
  glow.addColorStop(1, `${colour}00`);
  disc(pen, x, y, reach, glow);
  pen.globalAlpha = 1;
}

function body(pen, x, y, radius, heading, colour, isFaulty, colours) {
  const nose = 1.45 * radius + 1, edge = radius * (isFaulty ? 0.3 : 0.13) + 0.4;
  const at = (along, across) => [
    x + along * Math.cos(heading) - across * Math.sin(heading),
    y - along * Math.sin(heading) - across * Math.cos(heading),
  ];
  pen.fillStyle = colours.INK;
  pen.beginPath();
  pen.moveTo(...at(nose, 0));
  pen.lineTo(...at(0.5 * radius, 0.6 * radius + 0.5));
  pen.lineTo(...at(0.5 * radius, -0.6 * radius - 0.5));
  pen.fill();
  disc(pen, x, y, radius, colours.INK);
  disc(pen, x, y, radius - edge, colour);
}

function badge(pen, x, y, height, text, colours) {
  pen.font = `600 ${0.85 * height}px system-ui, sans-serif`;
  const width = Math.max(height, pen.measureText(text).width + 0.6 * height);
  pen.beginPath();
  pen.roundRect(x - width / 2, y - height / 2, width, height, height / 2);
  pen.fillStyle = colours.INK;
  pen.strokeStyle = colours.FLOOR;
  pen.lineWidth = 2;
  pen.stroke();
  pen.fill();
  pen.fillStyle = colours.FLOOR;
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.fillText(text, x, y + 0.05 * height);
  return width;
}

function target(pen, x, y, radius, colours) {
  const width = 0.8 + 0.1 * radius, outer = radius + 4 * width;
  for (const [extra, colour] of [[2, colours.FLOOR], [0, colours.REQUESTED]]) {
    ring(pen, x, y, radius, width + extra, colour);
    for (const [across, down] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
      line(pen, [[x + radius * across, y + radius * down], [x + outer * across, y + outer * down]], width + extra, colour);
    }
  }
}

function showWarehouse() {
  const { pen, width, height } = prepared(element("warehouse"));
  const { scenario, robots, items } = view, colours = fixed.colours;
  const margin = 10;
  const scale = Math.max(1, Math.min((width - 2 * margin) / scenario.warehouse_width, (height - 2 * margin) / scenario.warehouse_height));
  const [across, down] = [scale * scenario.warehouse_width, scale * scenario.warehouse_height];
  place = { scale, left: (width - across) / 2, bottom: (height + down) / 2 };
  const { left, bottom } = place, top = bottom - down;
  const at = ([x, y]) => [left + scale * x, bottom - scale * y];
  const radius = Math.max(3.5, scale * scenario.robot_radius);
  const half = Math.max(2, 0.8 * scale * scenario.item_radius);

  pen.fillStyle = colours.INK;
  pen.fillRect(left - 4, top - 4, across + 8, down + 8);
  pen.fillStyle = colours.FLOOR;
  pen.fillRect(left, top, across, down);
  pen.save();
  pen.beginPath();
  pen.rect(left, top, across, down);
  pen.clip();
  for (let metre = 1; metre < scenario.warehouse_width; metre++) line(pen, [at([metre, 0]), at([metre, scenario.warehouse_height])], 1, colours.FLOOR_LINE);
  for (let metre = 1; metre < scenario.warehouse_height; metre++) line(pen, [at([0, metre]), at([scenario.warehouse_width, metre])], 1, colours.FLOOR_LINE);
  showDeliveryArea(pen, left + scale * (scenario.warehouse_width - scenario.delivery_width), top, left + across, bottom);
  if (options.trails) {
    for (const trail of view.trails) {
      for (let nth = 1; nth < trail.length; nth++) {
        const [before, after] = [trail[nth - 1], trail[nth]];
        pen.globalAlpha = nth / trail.length;
        if (before && after) line(pen, [at(before), at(after)], 1, colours.TRAIL);
      }
    }
    pen.globalAlpha = 1;
  }
  for (const obstacle of view.obstacles) {
    disc(pen, ...at(obstacle), scale * scenario.obstacle_radius, colours.INK);
    disc(pen, ...at(obstacle), scale * scenario.obstacle_radius - 2, colours.OBSTACLE);
  }
  for (const robot of robots) if (robot && robot[4] !== null) halo(pen, ...at(robot), radius, robot[4], colours.TIMER);
  items.forEach((one) => { if (one[2] === STORED) item(pen, ...at(one), half, false, colours); });
  robots.forEach((robot, number) => {
    const leader = robot && robot[6] !== NOBODY ? robots[robot[6]] : null;
    const isCarrier = number === view.carrier;
    if (leader && (isCarrier || options.links)) arrow(pen, at(robot), at(leader), radius, isCarrier ? Math.max(2, radius / 3.5) : 1, colours.LINK);
  });
  const selected = view.selected, watched = selected && robots[selected.robot];
  if (watched) showBeams(pen, selected, watched, at);
  pen.restore();
  for (const robot of robots) {
    if (!robot) continue;
    const [x, y] = at(robot);
    body(pen, x, y, radius, robot[2], colours[ACTIVITIES[robot[3]]], robot[5] !== "", colours);
    if (robot[3] === "shuffling") item(pen, x, y, Math.max(1.5, 0.45 * radius), false, colours);
  }
  if (watched) ring(pen, ...at(watched), 1.6 * radius + 2, 2, colours.INK);
  if (view.requested !== NOBODY) {
    const [x, y] = at(items[view.requested]);
    target(pen, x, y, 1.9 * radius + 1, colours);
    item(pen, x, y, view.carrier !== NOBODY ? 0.5 * radius : 1.4 * half, true, colours);
  }
  const tall = Math.max(12, 1.2 * radius);
  for (const robot of robots) {
    if (!robot || robot[5] === "") continue;
    const [x, y] = at(robot), away = 0.8 * radius + 0.3 * tall;
    badge(pen, x + away, y - away, tall, robot[5], colours);
  }
}

function showDeliveryArea(pen, left, top, right, bottom) {
  const colours = fixed.colours;
  pen.save();
  pen.beginPath();
  pen.rect(left, top, right - left, bottom - top);
  pen.clip();
  pen.fillStyle = colours.DELIVERY_AREA;
  pen.fillRect(left, top, right - left, bottom - top);
  for (let x = left - (bottom - top); x < right; x += 14) line(pen, [[x, bottom], [x + bottom - top, top]], 1.5, colours.DELIVERY_HATCH);
  line(pen, [[left, top], [left, bottom]], 3, colours.DELIVERY_WORD);
  pen.translate((left + right) / 2, (top + bottom) / 2);
  pen.rotate(-Math.PI / 2);
  pen.font = "600 15px system-ui, sans-serif";
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.fillStyle = colours.DELIVERY_WORD;
  if (right - left > 30) pen.fillText("DELIVERY", 0, 0);
  pen.restore();
}

function showBeams(pen, selected, robot, at) {
  const [x, y] = at(robot), colour = fixed.colours.BEAM;
  selected.beams.forEach((reach, beam) => {
    const angle = robot[2] + (2 * Math.PI * beam) / selected.beams.length;
    const end = [x + place.scale * reach * Math.cos(angle), y - place.scale * reach * Math.sin(angle)];
    line(pen, [[x, y], end], 1, colour);
    if (reach < selected.reach) disc(pen, ...end, 3, colour);
  });
  if (selected.view > 0) ring(pen, x, y, place.scale * selected.view, 1.5, colour);
}

function showStrip() {
  const { pen, width, height } = prepared(element("strip")), colours = fixed.colours;
  pen.font = "13px system-ui, sans-serif";
  const names = curveNames(pen, width), [left, right, bottom] = [34, width - 24, height - 22];
  const top = names[names.length - 1].y + 14;
  const most = view.curves.reduce((least, curve) => {
    let limit = least;
    for (let nth = 0; limit < curve.times.length; nth++) limit *= [2, 2, 2.5][nth % 3];
    return limit;
  }, 5);
  const at = (time, count) => [left + (right - left) * Math.min(1, time / view.scenario.duration), bottom - ((bottom - top) * count) / most];
  pen.fillStyle = colours.FLOOR;
  pen.fillRect(left, top, right - left, bottom - top);
  pen.textBaseline = "middle";
  for (let nth = 0; nth <= 4; nth++) {
    const time = (nth / 4) * view.scenario.duration;
    line(pen, [at(time, 0), at(time, most)], 1, colours.FLOOR_LINE);
    pen.fillStyle = colours.INK;
    pen.textAlign = "center";
    pen.fillText(`${+time.toPrecision(4)} s`, at(time, 0)[0], bottom + 12);
  }
  pen.textAlign = "right";
  for (const count of [0, most]) pen.fillText(count, left - 5, at(0, count)[1]);
  pen.textAlign = "left";
  for (const { text, style, x, y } of names) {
    const [colour, thickness] = fixed.curves[style];
    line(pen, [[x, y], [x + 26, y]], thickness + 1, colour);
    pen.fillStyle = colours.INK;
    pen.fillText(text, x + 32, y);
  }
  // Thin over thick: where two runs are the same, both are seen.
  for (const curve of [...view.curves].sort((a, b) => fixed.curves[b.style][1] - fixed.curves[a.style][1])) {
    const [colour, thickness] = fixed.curves[curve.style], steps = [at(0, 0)];
    curve.times.forEach((time, nth) => steps.push(at(time, nth), at(time, nth + 1)));
    steps.push(at(curve.until, curve.times.length));
    line(pen, steps, thickness, colour);
  }
  showEvents(pen, at, most, top);
  pen.strokeStyle = colours.INK;
  pen.lineWidth = 1;
  pen.strokeRect(left, top, right - left, bottom - top);
}

function curveNames(pen, width) {
  let x = 34, y = 12;
  return view.curves.map(({ name, times, style }, nth) => {
    const text = `${name}: ${times.length} delivered`, end = x + 32 + pen.measureText(text).width;
    if (nth && end > width) [x, y] = [34, y + 17];
    const place = { text, style, x, y };
    x += 32 + pen.measureText(text).width + 28;
    return place;
  });
}

function showEvents(pen, at, most, top) {
  const marks = new Map();
  for (const [time, , label] of view.events) {
    const key = `${Math.round(at(time, 0)[0])} ${label}`;
    marks.set(key, { time, label, count: (marks.get(key)?.count ?? 0) + 1 });
  }
  let last = -1000, row = 0;
  for (const { time, label, count } of [...marks.values()].sort((a, b) => a.time - b.time)) {
    const [x] = at(time, 0);
    line(pen, [at(time, 0), at(time, most)], 1, fixed.colours.INK);
    row = x - last < 26 ? (row + 1) % 4 : 0;
    last = x;
    badge(pen, x, top + 10 + 17 * row, 15, count > 1 ? `${label} ×${count}` : label, fixed.colours);
  }
}

// Words

function showWords() {
  const { scenario, selected } = view;
  element("title").textContent = `${fixed.title}, seed ${view.seed}`;
  let pace = `${view.paused ? "paused" : "playing"} at ${view.speed} times real time`;
  if (view.over) pace = "over: next seed, or this one again";
  element("pace").textContent = isLost ? "The command has ended, or does not answer." : pace;
  element("pause").textContent = view.paused ? "go on" : "pause";
  const total = scenario.restock ? "" : ` of ${scenario.n_items}`;
  const request = view.requested === NOBODY ? "all delivered" : `requested: item ${view.requested}`;
  element("score").textContent = `time ${view.time.toFixed(1)} s · N = ${scenario.n_robots} · P = ${view.curves[0].times.length}${total} · ${request}`;
  element("note").textContent = Date.now() < problem.until ? problem.text : view.note;
  for (const name of ["n_robots", "delivery_width"]) {
    if (document.activeElement !== element(name)) element(name).value = scenario[name];
  }
  for (const button of element("modes").children) button.setAttribute("aria-pressed", button.value === view.mode);
  const mode = fixed.modes.find(({ name }) => name === view.mode);
  element("meaning").textContent = `${mode.name}: ${mode.meaning}`;
  element("robot_buttons").hidden = !selected;
  element("break").textContent = `break: ${view.mode}`;
  element("robot").textContent = selected
    ? `Robot ${selected.robot}: ${selected.activity}, ${selected.modes.join(" ") || "sound"}`
    : "Click a robot to see what it senses.";
  fill(element("row"), selected ? selected.row : []);
}

function fill(table, rows) {
  while (table.rows.length > rows.length) table.deleteRow(-1);
  rows.forEach((words, nth) => {
    const row = table.rows[nth] ?? table.insertRow();
    words.forEach((text, column) => {
      const cell = row.cells[column] ?? row.insertCell();
      if (cell.textContent !== text) cell.textContent = text;
    });
  });
}

function show() {
  if (!view) return;
  showWarehouse();
  showStrip();
  showWords();
}

function showLegend() {
  const colours = fixed.colours;
  const entries = [
    ["searching", (pen) => body(pen, 11, 11, 7, 0, colours.SEARCHING, false, colours)],
    ["shuffling", (pen) => { body(pen, 11, 11, 7, 0, colours.SHUFFLING, false, colours); item(pen, 11, 11, 3, false, colours); }],
    ["delivering", (pen) => { body(pen, 11, 11, 7, 0, colours.DELIVERING, false, colours); item(pen, 11, 11, 3.5, true, colours); }],
    ["requested item", (pen) => item(pen, 11, 11, 6.5, true, colours)],
    ["timer", (pen) => { halo(pen, 11, 11, 4.4, 0, colours.TIMER); body(pen, 11, 11, 4, 0, colours.SEARCHING, false, colours); }],
    ["failed, by mode", (pen) => badge(pen, 11, 11, 15, "4", colours)],
  ];
  for (const [name, draw] of entries) {
    const entry = document.createElement("li"), canvas = document.createElement("canvas");
    entry.append(canvas, name);
    element("legend").append(entry);
    draw(prepared(canvas).pen);
  }
}

// Keys and clicks

function robotAt(event) {
  const { left, top } = element("warehouse").getBoundingClientRect();
  const x = (event.clientX - left - place.left) / place.scale, y = (place.bottom - (event.clientY - top)) / place.scale;
  let nearest = null, least = Math.max(2 * view.scenario.robot_radius, 10 / place.scale);
  view.robots.forEach((robot, number) => {
    const away = robot ? Math.hypot(robot[0] - x, robot[1] - y) : Infinity;
    if (away <= least) [nearest, least] = [number, away];
  });
  return nearest;
}

function listen() {
  element("warehouse").addEventListener("click", (event) => {
    if (!view) return;
    const robot = robotAt(event);
    order(event.shiftKey && robot !== null ? { do: "toggle", robot } : { do: "select", robot });
  });
  element("warehouse").addEventListener("contextmenu", (event) => {
    event.preventDefault();
    const robot = view && robotAt(event);
    if (robot !== null) order({ do: "toggle", robot });
  });
  for (const button of document.querySelectorAll("button[data-key]")) {
    button.addEventListener("click", () => order({ do: "press", key: button.dataset.key }));
  }
  element("n_robots").addEventListener("change", (event) => order({ do: "resize", n_robots: Math.round(event.target.valueAsNumber) }));
  element("delivery_width").addEventListener("change", (event) => order({ do: "widen", width: event.target.valueAsNumber }));
  for (const name of ["trails", "links"]) {
    element(name).addEventListener("change", (event) => { options[name] = event.target.checked; show(); });
  }
  element("help_button").addEventListener("click", help);
  element("help").addEventListener("click", () => element("help").close());
  window.addEventListener("resize", () => requestAnimationFrame(show));
  document.addEventListener("keydown", press);
  // After a click with the mouse, keys mean the session again, not the button.
  document.addEventListener("click", (event) => {
    const held = document.activeElement;
    if (event.detail > 0 && held && held.type !== "number") held.blur();
  });
}

function help() {
  if (element("help").open) element("help").close();
  else element("help").showModal();
}

function press(event) {
  const tag = event.target.tagName, key = event.key;
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  if (tag === "INPUT" && event.target.type === "number") return;
  // Space on a button is that button's.
  if (key === " " && (tag === "BUTTON" || tag === "INPUT")) return;
  if (!fixed.keys.some(({ name }) => name === key)) return;
  if (element("help").open && key === "Escape") return;
  event.preventDefault();
  const own = Object.entries(fixed.view_keys).find(([, name]) => name === key);
  if (!own) order({ do: "press", key });
  else if (own[0] === "help") help();
  else element(own[0]).click();
}

async function begin() {
  fixed = await (await fetch("fixed")).json();
  for (const { name, mark, meaning } of fixed.modes) {
    const button = document.createElement("button"), sign = document.createElement("span");
    [button.value, button.title, button.textContent] = [name, meaning, name];
    [sign.className, sign.textContent] = ["mark", mark || "–"];
    button.append(sign);
    button.addEventListener("click", () => order({ do: "choose", mode: name }));
    element("modes").append(button);
  }
  fill(element("keys"), [...fixed.keys.map(({ label, meaning }) => [label, meaning]), ...fixed.mouse]);
  showLegend();
  listen();
  follow();
}

begin();
