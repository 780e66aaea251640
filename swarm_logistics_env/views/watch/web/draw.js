"use strict";

// Draws an arena: what stands still on a sheet of its own, robots from pictures made once.

const ACTIVITIES = { searching: "SEARCHING", shuffling: "SHUFFLING", delivering: "DELIVERING" };
const TIMER_STEPS = 8, NOBODY = -1, MARGIN = 4, LATE = "!", LOW_CHARGE = 30;
const sheets = new Map();
let colours = {}, sprites = new Map();

function prepared(canvas) {
  const ratio = window.devicePixelRatio || 1;
  const { clientWidth: width, clientHeight: height } = canvas;
  const [across, down] = [Math.max(1, Math.round(width * ratio)), Math.max(1, Math.round(height * ratio))];
  if (canvas.width !== across || canvas.height !== down) [canvas.width, canvas.height] = [across, down];
  const pen = canvas.getContext("2d");
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, width, height);
  return { pen, width, height, ratio };
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

function item(pen, x, y, half, isRequested) {
  const edge = Math.max(1, 0.2 * half);
  pen.fillStyle = isRequested ? colours.INK : colours.ITEM_EDGE;
  pen.fillRect(x - half, y - half, 2 * half, 2 * half);
  pen.fillStyle = isRequested ? colours.REQUESTED : colours.ITEM;
  pen.fillRect(x - half + edge, y - half + edge, 2 * (half - edge), 2 * (half - edge));
}

// As a column on a plan: a failed robot's mark is dark, with a letter.
function obstacle(pen, x, y, radius) {
  const arm = (radius - 1) * Math.SQRT1_2;
  disc(pen, x, y, radius, colours.INK);
  disc(pen, x, y, radius - 1.5, colours.OBSTACLE);
  line(pen, [[x - arm, y - arm], [x + arm, y + arm]], 1.5, colours.INK);
  line(pen, [[x - arm, y + arm], [x + arm, y - arm]], 1.5, colours.INK);
}

function body(pen, x, y, radius, colour, isFaulty) {
  const nose = 1.45 * radius + 1, edge = radius * (isFaulty ? 0.3 : 0.13) + 0.4;
  pen.fillStyle = colours.INK;
  pen.beginPath();
  pen.moveTo(x + nose, y);
  pen.lineTo(x + 0.5 * radius, y - 0.6 * radius - 0.5);
  pen.lineTo(x + 0.5 * radius, y + 0.6 * radius + 0.5);
  pen.fill();
  disc(pen, x, y, radius, colours.INK);
  disc(pen, x, y, radius - edge, colour);
}

// About a robot by the number of its kind: nothing, a ring, a square, a diamond, then anew.
function kindOutline(pen, x, y, radius, kind) {
  const reach = 1.45 * radius + 2, width = Math.max(1.2, 0.16 * radius), shape = kind % 4;
  if (shape === 1) ring(pen, x, y, reach, width, colours.INK);
  if (shape < 2) return;
  const arm = 1.3 * reach, turn = shape === 2 ? Math.PI / 4 : 0;
  pen.lineJoin = "miter";
  line(pen, [0, 1, 2, 3, 4, 5].map((side) => [x + arm * Math.cos(turn + (side * Math.PI) / 2), y + arm * Math.sin(turn + (side * Math.PI) / 2)]), width, colours.INK);
}

function halo(pen, x, y, radius, age) {
  const strength = 1 - age, reach = radius * (1.5 + strength);
  const glow = pen.createRadialGradient(x, y, radius, x, y, reach);
  pen.globalAlpha = 0.25 + 0.4 * strength;
  glow.addColorStop(0, colours.TIMER);
  glow.addColorStop(1, `${colours.TIMER}00`);
  disc(pen, x, y, reach, glow);
  pen.globalAlpha = 1;
}

function badge(pen, x, y, height, text) {
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
}

// A plate with a bolt; crossed out where it charges nobody.
function station(pen, x, y, half, works) {
  pen.fillStyle = colours.INK;
  pen.beginPath();
  pen.roundRect(x - half, y - half, 2 * half, 2 * half, 0.4 * half);
  pen.fill();
  pen.fillStyle = colours.FLOOR;
  pen.beginPath();
  pen.roundRect(x - half + 1.5, y - half + 1.5, 2 * half - 3, 2 * half - 3, 0.3 * half);
  pen.fill();
  pen.fillStyle = works ? colours.BEAM : colours.ITEM_EDGE;
  pen.beginPath();
  for (const [across, down] of [[0.2, -0.75], [-0.5, 0.15], [-0.05, 0.15], [-0.2, 0.75], [0.5, -0.15], [0.05, -0.15]]) pen.lineTo(x + half * across, y + half * down);
  pen.fill();
  if (!works) line(pen, [[x - half + 2, y - half + 2], [x + half - 2, y + half - 2]], 1.5, colours.INK);
}

// How full a battery is, in percent; little has a colour of its own.
function chargeBar(pen, x, y, radius, percent) {
  const wide = Math.max(8, 2 * radius), high = Math.max(4, 0.45 * radius), top = y + 1.25 * radius;
  pen.fillStyle = colours.INK;
  pen.fillRect(x - wide / 2, top, wide, high);
  pen.fillStyle = colours.FLOOR;
  pen.fillRect(x - wide / 2 + 1, top + 1, wide - 2, high - 2);
  pen.fillStyle = percent >= LOW_CHARGE ? colours.TIMER : colours.REQUESTED;
  pen.fillRect(x - wide / 2 + 1, top + 1, ((wide - 2) * percent) / 100, high - 2);
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

function target(pen, x, y, radius) {
  const width = 0.8 + 0.1 * radius, outer = radius + 4 * width;
  for (const [extra, colour] of [[2, colours.FLOOR], [0, colours.REQUESTED]]) {
    ring(pen, x, y, radius, width + extra, colour);
    for (const [across, down] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
      line(pen, [[x + radius * across, y + radius * down], [x + outer * across, y + outer * down]], width + extra, colour);
    }
  }
}

// A picture that is drawn once: half its side in CSS pixels, and how to draw it around (half, half).
function sprite(name, half, ratio, draw) {
  const key = `${name} ${half.toFixed(2)} ${ratio}`;
  if (!sprites.has(key)) {
    const sheet = document.createElement("canvas");
    sheet.width = sheet.height = Math.ceil(2 * half * ratio);
    const pen = sheet.getContext("2d");
    pen.scale(ratio, ratio);
    draw(pen, half);
    sprites.set(key, sheet);
  }
  return sprites.get(key);
}

function placeOf(canvas, scenario) {
  const { clientWidth: width, clientHeight: height } = canvas;
  const scale = Math.max(1, Math.min((width - 2 * MARGIN) / scenario.warehouse_width, (height - 2 * MARGIN) / scenario.warehouse_height));
  const [across, down] = [scale * scenario.warehouse_width, scale * scenario.warehouse_height];
  return { scale, left: (width - across) / 2, bottom: down + MARGIN, across, down };
}

// Floor, delivery area, obstacles and stored items: drawn anew only when one of them changes.
function floorOf(canvas, now, number, ratio) {
  const { scenario, obstacles } = now, items = now[`items${number}`];
  const parts = [scenario, obstacles, items, colours, canvas.clientWidth, canvas.clientHeight, ratio];
  const cached = sheets.get(number);
  if (cached && cached.parts.every((part, nth) => part === parts[nth])) return cached.sheet;
  const sheet = cached?.sheet ?? document.createElement("canvas");
  [sheet.width, sheet.height] = [canvas.width, canvas.height];
  const pen = sheet.getContext("2d"), { scale, left, bottom, across, down } = placeOf(canvas, scenario), top = bottom - down;
  const at = ([x, y]) => [left + (scale * x) / 1000, bottom - (scale * y) / 1000];
  pen.scale(ratio, ratio);
  pen.fillStyle = colours.INK;
  pen.fillRect(left - 3, top - 3, across + 6, down + 6);
  pen.fillStyle = colours.FLOOR;
  pen.fillRect(left, top, across, down);
  pen.beginPath();
  pen.rect(left, top, across, down);
  pen.clip();
  if (fixed.plan) planAreas(pen, fixed.plan, at);
  for (let x = 1; x < scenario.warehouse_width; x++) line(pen, [at([1000 * x, 0]), at([1000 * x, 1000 * scenario.warehouse_height])], 1, colours.FLOOR_LINE);
  for (let y = 1; y < scenario.warehouse_height; y++) line(pen, [at([0, 1000 * y]), at([1000 * scenario.warehouse_width, 1000 * y])], 1, colours.FLOOR_LINE);
  if (fixed.plan) docksAndSolids(pen, fixed.plan, at);
  else deliveryArea(pen, left + across - scale * scenario.delivery_width, top, left + across, bottom);
  for (const centre of obstacles) obstacle(pen, ...at(centre), Math.max(4, scale * scenario.obstacle_radius));
  for (const position of items) item(pen, ...at(position), Math.max(2, 0.8 * scale * scenario.item_radius), false);
  sheets.set(number, { sheet, parts });
  return sheet;
}

function deliveryArea(pen, left, top, right, bottom) {
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
  pen.font = "600 14px system-ui, sans-serif";
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.fillStyle = colours.DELIVERY_WORD;
  if (right - left > 30) pen.fillText("DELIVERY", 0, 0);
  pen.restore();
}

// Where each robot is between two frames: [x, y, heading] in mm and mrad, or null if absent.
function posesBetween(now, next, share, number) {
  const [from, to] = [now[`poses${number}`], next[`poses${number}`]];
  const poses = [];
  for (let robot = 0; 3 * robot < from.length; robot++) {
    const at = 3 * robot;
    if (from[at] === null) { poses.push(null); continue; }
    const portion = to.length === from.length && to[at] !== null ? share : 0;
    const turn = ((((to[at + 2] - from[at + 2]) / 1000 + Math.PI) % (2 * Math.PI)) + 2 * Math.PI) % (2 * Math.PI) - Math.PI;
    poses.push([from[at] + portion * (to[at] - from[at]), from[at + 1] + portion * (to[at + 1] - from[at + 1]), from[at + 2] / 1000 + (portion ? portion * turn : 0)]);
  }
  return poses;
}

function drawArena(canvas, number, now, next, share, options) {
  const { pen, width, height, ratio } = prepared(canvas);
  const { scenario } = now, robots = now[`robots${number}`], requested = now[`requested${number}`];
  const { scale, left, bottom } = placeOf(canvas, scenario);
  const at = ([x, y]) => [left + (scale * x) / 1000, bottom - (scale * y) / 1000];
  const kinds = now[`kinds${number}`] ?? [];  // a recording of a former version has none
  const radii = fixed.radii ?? [scenario.robot_radius];  // as of `kinds`
  const radiusOf = (robot) => Math.max(3.5, scale * radii[kinds[robot] ?? 0]);
  const radius = Math.max(3.5, scale * Math.max(...radii)), half = Math.max(2, 0.8 * scale * scenario.item_radius);
  const poses = posesBetween(now, next, share, number);
  const stamp = (name, x, y, size, draw) => {
    const picture = sprite(name, size, ratio, draw);
    pen.drawImage(picture, x - size, y - size, picture.width / ratio, picture.height / ratio);
  };
  pen.drawImage(floorOf(canvas, now, number, ratio), 0, 0, width, height);
  for (const [x, y, works] of now[`stations${number}`] ?? []) station(pen, ...at([x, y]), Math.max(5, 1.3 * radius), works);
  for (const trail of options.trails) {
    for (let nth = 1; nth < trail.length; nth++) {
      pen.globalAlpha = nth / trail.length;
      line(pen, [at(trail[nth - 1]), at(trail[nth])], 1.5, colours.TRAIL);
    }
  }
  pen.globalAlpha = 1;
  poses.forEach((pose, robot) => {
    const age = pose && robots[robot] ? robots[robot][1] : null;
    if (age === null) return;
    const near = radiusOf(robot);
    stamp(`halo ${age}`, ...at(pose), 2.6 * near, (ink, mid) => halo(ink, mid, mid, near, age / TIMER_STEPS));
  });
  poses.forEach((pose, robot) => {
    const leader = pose && robots[robot] && robots[robot][3] !== NOBODY ? poses[robots[robot][3]] : null;
    const isCarrier = requested.some(([, , carrier]) => carrier === robot);
    if (leader && (isCarrier || options.links)) arrow(pen, at(pose), at(leader), radiusOf(robots[robot][3]), isCarrier ? Math.max(2, radius / 3.5) : 1, colours.LINK);
  });
  const watched = options.selected && poses[options.selected.robot];
  if (watched && number === 0) drawBeams(pen, options.selected, watched, at, scale);
  poses.forEach((pose, robot) => {
    if (!pose || !robots[robot]) return;
    const [activity, , mark] = robots[robot], radius = radiusOf(robot), size = 1.6 * radius + 3;
    const picture = sprite(`${activity} ${mark !== ""}`, size, ratio, (ink, mid) => {
      body(ink, mid, mid, radius, colours[ACTIVITIES[activity]], mark !== "");
      if (activity === "shuffling") item(ink, mid, mid, Math.max(1.5, 0.45 * radius), false);
    });
    const [x, y] = at(pose);
    if (kinds[robot]) kindOutline(pen, x, y, radius, kinds[robot]);
    pen.translate(x, y);
    pen.rotate(-pose[2]);
    pen.drawImage(picture, -size, -size, picture.width / ratio, picture.height / ratio);
    pen.rotate(pose[2]);
    pen.translate(-x, -y);
  });
  if (watched) selection(pen, ...at(watched), radiusOf(options.selected.robot));
  const late = new Set(now[`late${number}`]);  // a recording of a former version has none
  for (const [index, request] of requested.entries()) {
    const isCarried = request[2] !== NOBODY && poses[request[2]];
    const [x, y] = at(isCarried ? poses[request[2]] : request);
    target(pen, x, y, 1.9 * radius + 1);
    item(pen, x, y, isCarried ? 0.5 * radius : 1.4 * half, true);
    const [, , , letter, hue] = request, high = Math.max(15, 1.3 * radius), away = 1.3 * radius + high / 2;
    if (late.has(index)) badge(pen, Math.max(x - away, high / 2), Math.max(y - away, high / 2), high, LATE);
    if (letter) dockBadge(pen, Math.min(x + away, width - high / 2), Math.min(y + away, height - high / 2), high, letter, hue);
  }
  const charge = now[`charge${number}`] ?? [];  // as of `late`
  poses.forEach((pose, robot) => {
    if (pose && charge.length) chargeBar(pen, ...at(pose), radiusOf(robot), charge[robot]);
  });
  const tall = Math.max(13, 1.2 * radius);
  poses.forEach((pose, robot) => {
    const mark = pose && robots[robot] ? robots[robot][2] : "";
    if (mark === "") return;
    const [x, y] = at(pose), away = 0.8 * radiusOf(robot) + 0.3 * tall, size = tall * (0.8 + 0.4 * mark.length), rim = tall * (0.3 + 0.3 * mark.length);
    const beside = x + away + rim - 0.6 * tall;  // a wide badge begins where a narrow one does, or it would cover its robot
    stamp(`badge ${mark}`, Math.min(beside, width - rim), Math.max(y - away, 0.6 * tall), size, (ink, mid) => badge(ink, mid, mid, tall, mark));
  });
}

function selection(pen, x, y, radius) {
  ring(pen, x, y, 1.6 * radius + 2, 2.5, colours.INK);
}

function drawBeams(pen, selected, pose, at, scale) {
  const [x, y] = at(pose), colour = colours.BEAM;
  selected.beams.forEach((reach, beam) => {
    const angle = pose[2] + (2 * Math.PI * beam) / selected.beams.length;
    const end = [x + scale * reach * Math.cos(angle), y - scale * reach * Math.sin(angle)];
    line(pen, [[x, y], end], 1, colour);
    if (reach < selected.reach) disc(pen, ...end, 3, colour);
  });
  if (selected.view > 0) ring(pen, x, y, scale * selected.view, 1.5, colour);
}
