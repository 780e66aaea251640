"use strict";

// Draws the panels: deliveries over time, what a robot senses.

const LEFT = 46, RIGHT = 12, TOP = 4, BOTTOM = 34; // [px] about the chart
const ROUND = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 1e4, 2e4, 5e4, 1e5];
const NAMES = 142, BARS = 66; // [px] a row of the inspector: name, bars, numbers

function momentAt(x, width, end) {
  return (end * Math.max(0, x - LEFT)) / (width - LEFT - RIGHT);
}

function drawStrip(canvas, now, curves, end) {
  const { pen, width, height } = prepared(canvas), [right, bottom] = [width - RIGHT, height - BOTTOM];
  const counts = [0, 1].map((number) => now[`deliveries${number}`]);
  const most = Math.max(4, ...counts.map((times) => times.length)), { time } = now;
  const at = (moment, count) => [LEFT + ((right - LEFT) * Math.min(end, moment)) / end, bottom - ((bottom - TOP) * count) / most];
  const [everyMoment, everyCount] = [ROUND.find((step) => end / step <= 6), ROUND.find((step) => most / step <= 4)];
  pen.font = "12px system-ui, sans-serif";
  pen.fillStyle = colours.FLOOR;
  pen.fillRect(LEFT, TOP, right - LEFT, bottom - TOP);
  pen.fillStyle = colours.INK;
  pen.textBaseline = "middle";
  pen.textAlign = "center";
  for (let moment = 0; moment <= end; moment += everyMoment) {
    line(pen, [at(moment, 0), at(moment, most)], 1, colours.FLOOR_LINE);
    pen.fillText(moment, at(moment, 0)[0], bottom + 9);
  }
  pen.fillText("time [s]", (LEFT + right) / 2, bottom + 25);
  pen.textAlign = "right";
  for (let count = 0; count <= most; count += everyCount) {
    line(pen, [at(0, count), at(end, count)], 1, colours.FLOOR_LINE);
    pen.fillText(count, LEFT - 5, Math.max(TOP + 6, at(0, count)[1]));
  }
  pen.textAlign = "center";
  pen.rotate(-Math.PI / 2);
  pen.fillText("items delivered", -(TOP + bottom) / 2, 8);
  pen.rotate(Math.PI / 2);
  // Thin over thick: where two runs are the same, both are seen.
  counts.forEach((times, number) => {
    const [colour, thickness] = curves[number], steps = [at(0, 0)];
    times.forEach((moment, nth) => steps.push(at(moment, nth), at(moment, nth + 1)));
    steps.push(at(Math.max(time, times.at(-1) ?? 0), times.length));
    line(pen, steps, thickness, colours[colour]);
  });
  drawEvents(pen, now.events.filter(([moment]) => moment <= time + 1e-6), at, most);
  line(pen, [at(time, 0), at(time, most)], 1, colours.INK);
  line(pen, [at(0, most), at(0, 0), at(end, 0)], 1, colours.INK);
}

function drawEvents(pen, events, at, most) {
  const marks = new Map();
  for (const [moment, , label] of events) {
    const key = `${Math.round(at(moment, 0)[0])} ${label}`;
    marks.set(key, { moment, label, count: (marks.get(key)?.count ?? 0) + 1 });
  }
  let last = -1000, row = 0;
  for (const { moment } of marks.values()) line(pen, [at(moment, 0), at(moment, most)], 1, colours.INK);
  for (const { moment, label, count } of [...marks.values()].sort((a, b) => a.moment - b.moment)) {
    const [x] = at(moment, 0);
    row = x - last < 26 ? (row + 1) % 4 : 0;
    last = x;
    badge(pen, Math.max(x, LEFT + 22), TOP + 10 + 17 * row, 15, count > 1 ? `${label} ×${count}` : label);
  }
}

// A row for each part of the observation: its name, a bar or a dot for each value, and numbers.
function drawSenses(canvas, parts) {
  const tall = 13, nColumns = Math.max(1, Math.floor(canvas.clientWidth / 290)), nRows = Math.ceil(parts.length / nColumns);
  canvas.style.height = `${nRows * tall}px`;
  const { pen, width } = prepared(canvas);
  pen.font = "12px system-ui, sans-serif";
  pen.textBaseline = "middle";
  parts.forEach(([name, unit, values, limit], nth) => {
    const left = (Math.floor(nth / nRows) * width) / nColumns, mid = tall * (nth % nRows) + tall / 2;
    pen.fillStyle = colours.INK;
    pen.fillText(name, left, mid, NAMES - 4);
    pen.fillText(numbers(unit, values), left + NAMES + BARS + 8, mid, width / nColumns - NAMES - BARS - 16);
    if (unit === "flag") drawFlags(pen, values, left + NAMES, mid);
    else drawBars(pen, values, limit, left + NAMES, mid, tall - 2);
  });
}

function numbers(unit, values) {
  if (unit === "flag") return values.length > 1 ? `${values.filter((value) => value > 0.5).length} of ${values.length}` : values[0] > 0.5 ? "yes" : "no";
  const [least, most] = [Math.min(...values), Math.max(...values)].map((value) => +value.toFixed(1));
  const text = values.length < 3 ? values.join(", ") : least === most ? least : `${least} to ${most}`;
  return unit === "1" ? text : `${text} ${unit}`;
}

function drawFlags(pen, values, left, mid) {
  values.forEach((value, nth) => {
    const x = left + 4 + nth * 8;
    if (value > 0.5) disc(pen, x, mid, 3, colours.INK);
    else ring(pen, x, mid, 2.5, 1, colours.ITEM_EDGE);
  });
}

function drawBars(pen, values, limit, left, mid, tall) {
  const isSigned = values.some((value) => value < 0), zero = isSigned ? mid : mid + tall / 2, reach = isSigned ? tall / 2 : tall;
  const step = Math.min(8, BARS / values.length);
  line(pen, [[left, zero], [left + step * values.length, zero]], 1, colours.ITEM_EDGE);
  pen.fillStyle = colours.BEAM;
  values.forEach((value, nth) => {
    const high = (reach * value) / limit;
    pen.fillRect(left + step * nth, Math.min(zero, zero - high), step - 1, Math.abs(high));
  });
}
