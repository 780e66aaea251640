"use strict";
// Draws the figures of a report from the JSON in it. Loads nothing.
const data = JSON.parse(document.getElementById("data").textContent);
const repeat = data.paired ? "seed" : "trial";
const at = (id) => document.getElementById(id);
const MARKS = [
  (x, y) => `M${x - 4},${y}a4,4 0 1,0 8,0a4,4 0 1,0 -8,0`,
  (x, y) => `M${x - 3.6},${y - 3.6}h7.2v7.2h-7.2z`,
  (x, y) => `M${x},${y - 5}l4.6,8.4h-9.2z`,
  (x, y) => `M${x},${y - 5}l5,5l-5,5l-5,-5z`,
  (x, y) => `M${x},${y + 5}l4.6,-8.4h-9.2z`,
  (x, y) => `M${x - 1.7},${y - 5}h3.4v3.3h3.3v3.4h-3.3v3.3h-3.4v-3.3h-3.3v-3.4h3.3z`,
];
const colour = (place) => `var(--p${place % 6})`;
const escaped = (text) => String(text).replace(/[&<>"]/g, (sign) => `&#${sign.charCodeAt(0)};`);
const tidy = (x) => String(Number(x.toPrecision(6)));

// Axes

function ticks(low, high, count) {
  const rough = (high - low) / count;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 2.5, 5, 10].map((n) => n * power).find((n) => n >= rough);
  const found = [];
  for (let x = Math.ceil(low / step) * step; x <= high + step * 1e-9; x += step) found.push(x);
  return found;
}

function axes(box, yLabel) {
  const { left, right, top, bottom, low, high } = box;
  const y = (value) => bottom - ((value - low) / (high - low)) * (bottom - top);
  let drawn = "";
  for (const tick of ticks(low, high, 5)) {
    drawn += `<line class="grid" x1="${left}" x2="${right}" y1="${y(tick)}" y2="${y(tick)}"/>`;
    drawn += `<text x="${left - 6}" y="${y(tick) + 4}" text-anchor="end" class="soft">${tidy(tick)}</text>`;
  }
  drawn += `<text x="${left}" y="${top - 8}" class="soft">${escaped(yLabel)}</text>`;
  return [drawn, y];
}

function put(place, width, height, drawn, name) {
  place.innerHTML = `<svg viewBox="0 0 ${width} ${height}" role="img" aria-label="${escaped(name)}">${drawn}</svg>`;
}

const known = (values) => values.filter((value) => value !== null && value !== undefined);

// The comparison: every policy over the same categories, on one axis; P also seed by seed

function dotsOf(point) {
  return point.condition === undefined ? [] : data.conditions[point.condition].p;
}

function rangeOf(view) {
  const values = known(view.points.flatMap((point) => [point.value, point.published]));
  if (!view.thresholds.length) {
    const all = known(view.points.flatMap((point) => [point.value, point.high, ...dotsOf(point)]));
    return [0, Math.max(...all.filter((x) => x < 1e8), 1) * 1.04];
  }
  let low = Math.min(...values, 0), high = Math.max(...values, 0);
  const reach = Math.max(high - low, 0.5);
  const ends = known(view.points.flatMap((point) => [point.low, point.high]));
  low = Math.max(low - reach, Math.min(low, ...ends));
  high = Math.min(high + reach, Math.max(high, ...ends));
  const margin = 0.06 * (high - low);
  return [low - margin, high + margin];
}

function drawComparison() {
  const view = data.views[at("views").value], place = at("comparison");
  const width = Math.max(300, place.clientWidth);
  const [low, high] = rangeOf(view);
  const n = view.categories.length, left = 46, right = width - 6, top = 22;
  const step = (right - left) / n;
  const longest = Math.max(...view.categories.map((name) => name.length)) * 6.6;
  const turned = longest > step - 4;
  const base = width > 560 ? Math.min(500, Math.max(330, innerHeight - 360)) : 205;
  const bottom = base - (turned ? Math.min(78, 16 + longest * 0.72) : 24);
  const box = { left, right, top, bottom, low, high };
  let [drawn, y] = axes(box, view.y);
  for (const threshold of view.thresholds) {
    if (threshold > low && threshold < high) {
      drawn += `<line class="threshold" x1="${left}" x2="${right}" y1="${y(threshold)}" y2="${y(threshold)}"/>`;
    }
  }
  view.categories.forEach((name, i) => {
    const x = left + (i + 0.5) * step;
    drawn += turned
      ? `<text transform="translate(${x + 4},${bottom + 14}) rotate(-45)" text-anchor="end">${escaped(name)}</text>`
      : `<text x="${x}" y="${bottom + 18}" text-anchor="middle">${escaped(name)}</text>`;
  });
  const shown = data.policies.filter((policy) => view.points.some((point) => point.policy === policy));
  const spread = Math.min(step * 0.8, 26 * shown.length);
  const inside = (value) => Math.min(high, Math.max(low, value));
  for (const point of view.points) {
    const i = shown.indexOf(point.policy), c = data.policies.indexOf(point.policy);
    const x = left + (point.at + 0.5) * step + spread * ((i + 0.5) / shown.length - 0.5);
    const room = Math.min(9, spread / shown.length / 2.6);
    const target = point.question === undefined ? `data-condition="${point.condition}"` : `data-question="${point.question}"`;
    dotsOf(point).forEach((value, k) => {
      if (value === null || value < low || value > high) return;
      // Spread out by the golden ratio: beside each other, and the same at every drawing.
      const shift = room * (((k * 0.618034) % 1) * 2 - 1);
      drawn += `<circle class="dot" cx="${x + shift}" cy="${y(value)}" r="2.6" fill="${colour(c)}" ${target} data-seed="${k}"><title>${escaped(point.policy)}, ${escaped(view.categories[point.at])}, ${repeat} ${data.seeds[k] ?? k}: ${tidy(value)}</title></circle>`;
    });
    if (point.value === null) continue;
    if (point.low !== null && point.high !== null) {
      drawn += `<line x1="${x}" x2="${x}" y1="${y(inside(point.low))}" y2="${y(inside(point.high))}" stroke="${colour(c)}" stroke-width="2"/>`;
    }
    const interval = point.low === null ? "" : ` [${tidy(point.low)}, ${tidy(point.high)}]`;
    drawn += `<path d="${MARKS[c % 6](x, y(inside(point.value)))}" fill="${colour(c)}" stroke="var(--paper)" ${target}><title>${escaped(point.policy)}, ${escaped(view.categories[point.at])}: ${tidy(point.value)}${interval}</title></path>`;
  }
  const crosses = view.points.filter((point) => point.published !== null && point.policy === shown[0]);
  for (const point of crosses) {
    const x = left + (point.at + 0.5) * step, level = y(inside(point.published));
    drawn += `<path d="M${x - 4},${level - 4}l8,8m0,-8l-8,8" stroke="var(--ink)" stroke-width="1.6"><title>published: ${point.published}</title></path>`;
  }
  put(place, width, base, drawn, view.name);
  at("policies").innerHTML = shown.map((policy) => {
    const c = data.policies.indexOf(policy);
    return `<span><svg width="12" height="12" viewBox="-6 -6 12 12" style="display:inline"><path d="${MARKS[c % 6](0, 0)}" fill="${colour(c)}"/></svg> ${escaped(policy)}</span>`;
  }).join("") + `<span>bar: ${escaped(view.level)} interval</span>${view.thresholds.length ? "" : `<span>dot: one ${repeat}, click it</span>`}` + (crosses.length ? "<span>×: published</span>" : "");
}

// One question: paired slopes, delivery curves, and one run

let chosen = { question: null, arms: [], seed: 0 };

function choose(question, seed) {
  const asked = data.questions[question];
  chosen = { question, arms: asked.arms, seed: seed ?? 0 };
  at("question").querySelector("h2").textContent = asked.head;
  at("question").querySelector("p").textContent = asked.text;
  showQuestion();
}

function chooseCondition(condition, seed) {
  // A question about this condition, of the table that is shown, has something to compare it with.
  const here = data.views[at("views").value].name.slice("P: ".length);
  const about = [(one) => one.arms[1][2] === condition, (one) => one.arms.some((arm) => arm[2] === condition)];
  const found = about.flatMap((fits) => [
    data.questions.findIndex((one) => one.table === here && fits(one)), data.questions.findIndex(fits)]);
  choose(found.find((question) => question >= 0), seed);
}

function showQuestion() {
  at("question").hidden = false;
  for (const sign of document.querySelectorAll(".answer tr[data-question]")) {
    sign.classList.toggle("chosen", Number(sign.dataset.question) === chosen.question);
  }
  drawSlopes();
  drawCurves();
  at("arms").innerHTML = chosen.arms.map(([symbol, name], i) =>
    `<span><b style="color:${colour(i)}">●</b> ${escaped(symbol)}: ${escaped(name)}</span>`).join("")
    + (data.paired ? "<span>thin: one seed, click it; bold: mean</span>" : "<span>dot: one trial; bold: mean</span>");
  showRun();
}

function drawSlopes() {
  const place = at("slopes"), width = Math.max(280, place.clientWidth), height = 220;
  const samples = chosen.arms.map((arm) => data.conditions[arm[2]].p);
  const box = { left: 42, right: width - 12, top: 20, bottom: height - 24, low: 0, high: Math.max(...known(samples.flat()), 1) * 1.05 };
  let [drawn, y] = axes(box, "performance P");
  const x = (i) => box.left + 30 + (i * (box.right - box.left - 60)) / (samples.length - 1);
  chosen.arms.forEach((arm, i) => {
    drawn += `<text x="${x(i)}" y="${height - 6}" text-anchor="middle">${escaped(arm[0])}</text>`;
  });
  const means = samples.map((p) => known(p).reduce((sum, one) => sum + one, 0) / Math.max(1, known(p).length));
  for (let k = 0; k < samples[0].length; k++) {
    const points = samples.map((p, i) => (p[k] === null || p[k] === undefined ? null : `${x(i)},${y(p[k])}`));
    const marked = k === chosen.seed ? " chosen" : "";
    if (data.paired && points.every(Boolean)) {
      drawn += `<polyline class="thin${marked}" points="${points.join(" ")}" stroke="var(--ink)" data-seed="${k}"><title>seed ${data.seeds[k]}</title></polyline>`;
    }
    points.forEach((point, i) => {
      if (point) drawn += `<circle class="dot${marked}" cx="${x(i)}" cy="${y(samples[i][k])}" r="4" fill="${colour(i)}" data-seed="${k}"><title>${repeat} ${data.seeds[k]}: ${samples[i][k]}</title></circle>`;
    });
  }
  drawn += `<polyline fill="none" points="${means.map((p, i) => `${x(i)},${y(p)}`).join(" ")}" stroke="var(--ink)" stroke-width="3.5"/>`;
  put(place, width, height, drawn, `P ${repeat} by ${repeat}`);
}

function timesOf(gaps) {
  let time = 0;
  return gaps.map((gap) => (time += gap));
}

function drawCurves() {
  const place = at("curves"), width = Math.max(280, place.clientWidth), height = 220;
  const curves = chosen.arms.map((arm) => data.conditions[arm[2]].curves.map((gaps) => gaps && timesOf(gaps)));
  place.parentElement.hidden = !curves.flat().some(Boolean);  // no times were recorded
  if (place.parentElement.hidden) return;
  const end = Math.max(...chosen.arms.map((arm) => data.conditions[arm[2]].end));
  const most = Math.max(1, ...curves.flat().filter(Boolean).map((times) => times.length));
  const box = { left: 42, right: width - 12, top: 20, bottom: height - 24, low: 0, high: most * 1.05 };
  let [drawn, y] = axes(box, "deliveries");
  const x = (time) => box.left + (time / end) * (box.right - box.left);
  for (const tick of ticks(0, end, 5)) drawn += `<text x="${x(tick)}" y="${height - 6}" text-anchor="middle" class="soft">${tidy(tick)}${tick ? "" : " s"}</text>`;
  const line = (points) => points.map(([time, count]) => `${x(time).toFixed(1)},${y(count).toFixed(1)}`).join(" ");
  curves.forEach((runs, i) => {
    runs.forEach((times, k) => {
      if (!times) return;
      const steps = [[0, 0], ...times.flatMap((time, count) => [[time, count], [time, count + 1]]), [end, times.length]];
      drawn += `<polyline class="thin${k === chosen.seed ? " chosen" : ""}" points="${line(steps)}" stroke="${colour(i)}" data-seed="${k}"><title>seed ${data.seeds[k]}</title></polyline>`;
    });
    const all = runs.filter(Boolean).flat().sort((a, b) => a - b), n = runs.filter(Boolean).length;
    if (n) drawn += `<polyline fill="none" points="${line([[0, 0], ...all.map((time, count) => [time, (count + 1) / n]), [end, all.length / n]])}" stroke="${colour(i)}" stroke-width="3"/>`;
  });
  put(place, width, height, drawn, "deliveries over time");
}

function showRun() {
  const seed = data.seeds[chosen.seed], place = at("run");
  place.hidden = !data.paired;  // unpaired trials have nothing in common but their place
  const runs = chosen.arms.map(([symbol, name, condition]) => {
    const { p, command } = data.conditions[condition];
    const shown = command ? `<code>${escaped(command)} --seed ${seed}</code>` : ". No command plays this run.";
    return `${escaped(symbol)}, ${escaped(name)}: P = ${p[chosen.seed] ?? "no run"}${shown}`;
  });
  place.innerHTML = `<b>Seed ${seed}</b><br>${runs[1]}${runs[0] === runs[1] ? "" : `<br>${runs[0]}`}`;
}

// Tables sort by the first number of a cell, or by its text

function sort(head) {
  const table = head.closest("table"), column = head.cellIndex, body = table.tBodies[0];
  const down = head.getAttribute("aria-sort") === "ascending";
  for (const other of table.querySelectorAll("th")) other.removeAttribute("aria-sort");
  head.setAttribute("aria-sort", down ? "descending" : "ascending");
  const key = (row) => row.cells[column].textContent;
  const value = (text) => parseFloat(text.replace("∞", "1e99").match(/-?\d+(\.\d+)?(e\d+)?/) ?? "");
  const rows = [...body.rows].sort((a, b) => {
    const [x, y] = [value(key(a)), value(key(b))];
    return isNaN(x) || isNaN(y) ? isNaN(x) - isNaN(y) || key(a).localeCompare(key(b)) : x - y;
  });
  body.append(...(down ? rows.reverse() : rows));
}

document.addEventListener("click", (event) => {
  const one = event.target.closest("[data-question], [data-condition], [data-seed], .sortable thead th");
  if (!one) return;
  const { question, condition, seed } = one.dataset;
  if (one.matches("th")) sort(one);
  else if (question !== undefined || condition !== undefined) {
    if (question !== undefined) choose(Number(question), seed && Number(seed));
    else chooseCondition(Number(condition), seed && Number(seed));
    at("question").scrollIntoView({ block: "nearest" });
  } else {
    chosen.seed = Number(seed);
    showQuestion();
  }
});

function options(select, names) {
  select.innerHTML = names.map((name, i) => `<option value="${i}">${escaped(name)}</option>`).join("");
  select.hidden = names.length < 2;
}

options(at("views"), data.views.map((view) => view.name));
at("views").addEventListener("change", drawComparison);
drawComparison();
choose(0);
function draw() {
  drawComparison();
  showQuestion();
}
let width = innerWidth;
addEventListener("resize", () => { if (innerWidth !== width) { width = innerWidth; draw(); } });
// On paper nothing can be unfolded: the warnings belong to the answer.
addEventListener("beforeprint", () => { for (const one of document.querySelectorAll(".warnings")) one.open = true; });
// A link to a folded chapter unfolds it.
const unfold = () => { const found = at(location.hash.slice(1)); if (found && found.matches("details")) found.open = true; };
addEventListener("hashchange", unfold);
unfold();
