"use strict";

// Draws deliveries over time: the chart, and the timeline.

const LEFT = 46, RIGHT = 18, TOP = 4, BOTTOM = 20; // [px] about the chart
const ROUND = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 1e4, 2e4, 5e4, 1e5];
const TICK = 46; // [px] the room of a time below the chart
const HANDLE = 7, MARK = 42; // [px] of the timeline: half its handle; the room of a mark

function drawStrip(canvas, now, curves, end) {
  const { pen, width, height } = prepared(canvas), [right, bottom] = [width - RIGHT, height - BOTTOM];
  const counts = [0, 1].map((number) => now[`deliveries${number}`]);
  const most = Math.max(4, ...counts.map((times) => times.length)), { time } = now;
  const at = (moment, count) => [LEFT + ((right - LEFT) * Math.min(end, moment)) / end, bottom - ((bottom - TOP) * count) / most];
  const [everyMoment, everyCount] = [ROUND.find((step) => (TICK * end) / step <= right - LEFT), ROUND.find((step) => most / step <= 4)];
  pen.font = "12px system-ui, sans-serif";
  pen.fillStyle = colours.FLOOR;
  pen.fillRect(LEFT, TOP, right - LEFT, bottom - TOP);
  pen.fillStyle = colours.INK;
  pen.textBaseline = "middle";
  pen.textAlign = "center";
  for (let moment = 0; moment <= end; moment += everyMoment) {
    line(pen, [at(moment, 0), at(moment, most)], 1, colours.FLOOR_LINE);
    pen.fillText(`${moment} s`, at(moment, 0)[0], bottom + 10);
  }
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
  for (const [moment] of now.events.filter(([when]) => when <= time + 1e-6)) line(pen, [at(moment, 0), at(moment, most)], 1, colours.ITEM_EDGE);
  line(pen, [at(time, 0), at(time, most)], 1, colours.INK);
  line(pen, [at(0, most), at(0, 0), at(end, 0)], 1, colours.INK);
}

// What was played, and in it a tick for each delivery: those of the run above those beside it.
function drawTimeline(canvas, first, latest, curves, end) {
  const { pen, width, height } = prepared(canvas), at = (moment) => HANDLE + ((width - 2 * HANDLE) * moment) / end;
  pen.fillStyle = colours.FLOOR;
  pen.fillRect(at(first), 0, at(latest.time) - at(first), height);
  pen.strokeStyle = colours.ITEM_EDGE;
  pen.lineWidth = 1;
  pen.strokeRect(HANDLE, 0.5, width - 2 * HANDLE, height - 1);
  curves.forEach(([colour], number) => {
    const top = number ? height / 2 + 1 : 2, bottom = number ? height - 2 : height / 2 - 1;
    for (const moment of latest[`deliveries${number}`]) line(pen, [[at(moment), top], [at(moment), bottom]], 1.5, colours[colour]);
  });
}

// A button for each event, or for several that are near each other.
function showEvents(container, events, end, act) {
  const marks = [];
  for (const [moment, label, words] of [...events].sort((a, b) => a[0] - b[0])) {
    if (!marks.length || moment - marks.at(-1).moment > (MARK * end) / container.clientWidth) marks.push({ moment, labels: [], words: [] });
    marks.at(-1).labels.push(label);
    marks.at(-1).words.push(words);
  }
  container.replaceChildren(...marks.map(({ moment, labels, words }) => {
    const button = document.createElement("button"), about = `${moment.toFixed(1)} s: ${words.join("; ")}`;
    button.textContent = [...new Set(labels)].map((label) => {
      const count = labels.filter((text) => text === label).length;
      return count > 1 ? `${label} ×${count}` : label;
    }).join(" ");
    button.title = about;
    button.style.left = `clamp(.7rem, ${(100 * moment) / end}%, 100% - .7rem)`;
    button.addEventListener("click", () => act(moment, about));
    return button;
  }));
}
