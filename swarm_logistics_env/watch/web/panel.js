"use strict";

// Draws the panels: deliveries over time, what a robot senses.

function drawStrip(canvas, now, time, end, curves) {
  const { pen, width, height } = prepared(canvas), [left, right, bottom, top] = [30, width - 16, height - 20, 6];
  const counts = [0, 1].map((number) => now[`deliveries${number}`]);
  const most = [5, 10, 20, 50, 100, 200, 500, 1000, 1e4, 1e5].find((limit) => Math.max(...counts.map((times) => times.length)) <= limit);
  const at = (moment, count) => [left + (right - left) * Math.min(1, moment / end), bottom - ((bottom - top) * count) / most];
  pen.font = "12px system-ui, sans-serif";
  pen.fillStyle = colours.FLOOR;
  pen.fillRect(left, top, right - left, bottom - top);
  pen.textBaseline = "middle";
  for (let nth = 0; nth <= 4; nth++) {
    const moment = (nth / 4) * end;
    line(pen, [at(moment, 0), at(moment, most)], 1, colours.FLOOR_LINE);
    pen.fillStyle = colours.INK;
    pen.textAlign = nth === 4 ? "right" : "center";
    pen.fillText(`${+moment.toPrecision(4)} s`, at(moment, 0)[0] + (nth === 4 ? 12 : 0), bottom + 11);
  }
  pen.textAlign = "right";
  for (const count of [0, most]) pen.fillText(count, left - 4, at(0, count)[1] + (count ? 4 : -2));
  // Thin over thick: where two runs are the same, both are seen.
  counts.forEach((times, number) => {
    const [colour, thickness] = curves[number], steps = [at(0, 0)];
    times.forEach((moment, nth) => steps.push(at(moment, nth), at(moment, nth + 1)));
    steps.push(at(Math.max(time, times.at(-1) ?? 0), times.length));
    line(pen, steps, thickness, colours[colour]);
  });
  drawEvents(pen, now.events.filter(([moment]) => moment <= time + 1e-6), at, most, top);
  line(pen, [at(time, 0), at(time, most)], 1, colours.INK);
  pen.strokeStyle = colours.INK;
  pen.strokeRect(left, top, right - left, bottom - top);
}

function drawEvents(pen, events, at, most, top) {
  const marks = new Map();
  for (const [moment, , label] of events) {
    const key = `${Math.round(at(moment, 0)[0])} ${label}`;
    marks.set(key, { moment, label, count: (marks.get(key)?.count ?? 0) + 1 });
  }
  let last = -1000, row = 0;
  for (const { moment, label, count } of [...marks.values()].sort((a, b) => a.moment - b.moment)) {
    const [x] = at(moment, 0);
    line(pen, [at(moment, 0), at(moment, most)], 1, colours.INK);
    row = x - last < 26 ? (row + 1) % 4 : 0;
    last = x;
    badge(pen, x, top + 10 + 17 * row, 15, count > 1 ? `${label} ×${count}` : label);
  }
}

// A row for each part of the observation: its name and a bar for each of its values.
function drawSenses(canvas, parts) {
  const tall = 17, wanted = `${parts.length * tall + 4}px`;
  if (canvas.style.height !== wanted) canvas.style.height = wanted;
  const { pen, width } = prepared(canvas), left = 165;
  pen.font = "12px system-ui, sans-serif";
  pen.textBaseline = "middle";
  pen.textAlign = "left";
  parts.forEach(([name, unit, values], nth) => {
    const mid = tall * nth + tall / 2, room = width - left - 4;
    pen.fillStyle = colours.INK;
    pen.fillText(unit === "flag" || unit === "1" ? name : `${name} [${unit}]`, 0, mid, left - 8);
    if (unit === "flag") {
      values.forEach((value, place) => {
        if (value > 0.5) disc(pen, left + 7 + 13 * place, mid, 4.5, colours.DELIVERING);
        ring(pen, left + 7 + 13 * place, mid, 4.5, 1, colours.ITEM_EDGE);
      });
      return;
    }
    const largest = Math.max(1, ...values.map(Math.abs)), isSigned = values.some((value) => value < 0);
    const zero = isSigned ? mid : mid + tall / 2 - 2, reach = isSigned ? tall / 2 - 1 : tall - 3;
    const each = Math.min(16, room / Math.max(1, values.length));
    line(pen, [[left, zero], [left + Math.max(each * values.length, 16), zero]], 1, colours.ITEM_EDGE);
    pen.fillStyle = colours.SHUFFLING;
    values.forEach((value, place) => {
      const high = (reach * value) / largest;
      pen.fillRect(left + each * place + 1, Math.min(zero, zero - high), Math.max(1, each - 2), Math.abs(high));
    });
  });
}
