"use strict";
// Draws the figures of a report from the JSON in it. Loads nothing.
const data = JSON.parse(document.getElementById("data").textContent);
const repeat = data.paired ? "seed" : "trial";
const at = (id) => document.getElementById(id);
const colour = (index) => `var(--p${index % 6})`;
const escaped = (text) => String(text).replace(/[&<>"]/g, (sign) => `&#${sign.charCodeAt(0)};`);
// No line ends within an option, as at its hyphens.
const unbroken = (text) => text.replace(/--[a-z][\w-]*/g, '<span class="option">$&</span>');
const tidy = (x) => String(Number(x.toPrecision(6)));

// Axes

function ticks(low, high, count) {
  const rough = (high - low) / count;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 2.5, 5, 10].map((n) => n * power).find((n) => n >= rough);
  const values = [];
  for (let x = Math.ceil(low / step) * step; x <= high + step * 1e-9; x += step) values.push(x);
  return values;
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

function put(container, width, height, drawn, name) {
  container.innerHTML = `<svg viewBox="0 0 ${width} ${height}" role="img" aria-label="${escaped(name)}">${drawn}</svg>`;
}

const recorded = (values) => values.filter((value) => value !== null && value !== undefined);

// The comparison: one drawing of several, each dot of which is a run

function showView() {
  document.querySelectorAll("#comparison .view").forEach((view, i) => { view.hidden = i !== at("views").selectedIndex; });
}

function titleDots() {
  for (const dot of document.querySelectorAll("#comparison .dot")) {
    const { condition } = dot.closest("[data-condition]").dataset, { seed } = dot.dataset;
    const mark = dot.closest(".view").querySelector(`[data-condition="${condition}"] > title`).textContent;
    const title = document.createElementNS(dot.namespaceURI, "title");
    title.textContent = `${mark.slice(0, mark.lastIndexOf(": "))}, ${repeat} ${data.seeds[seed] ?? seed}: ${tidy(data.conditions[condition].p[seed])}`;
    dot.append(title);
  }
}

// On a phone the words are folded and decided questions stand first, if there are some.
if (matchMedia("(max-width: 40rem)").matches) {
  document.querySelector(".words").open = false;
  const only = document.querySelector(".questions input");
  if (only) only.checked = document.querySelector(".questions td.word:not(.open)") !== null;
}

// One question: paired slopes, delivery curves, and one run

let chosen = { question: null, arms: [], seed: 0 };

function choose(question, seed) {
  const details = data.questions[question];
  chosen = { question, arms: details.arms, seed: seed ?? 0 };
  at("question").querySelector("h2").textContent = details.head;
  at("question").querySelector("p").textContent = details.text;
  showQuestion();
}

function chooseCondition(condition, seed) {
  // A question about this condition, of the table that is shown, has something to compare it with.
  const table = at("views").selectedOptions[0].textContent.slice("P: ".length);
  const about = [(entry) => entry.arms[1][2] === condition, (entry) => entry.arms.some((arm) => arm[2] === condition)];
  const candidates = about.flatMap((fits) => [
    data.questions.findIndex((entry) => entry.table === table && fits(entry)), data.questions.findIndex(fits)]);
  choose(candidates.find((question) => question >= 0), seed);
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
  const container = at("slopes"), width = Math.max(280, container.clientWidth), height = 220;
  const samples = chosen.arms.map((arm) => data.conditions[arm[2]].p);
  const box = { left: 42, right: width - 12, top: 20, bottom: height - 24, low: 0, high: Math.max(...recorded(samples.flat()), 1) * 1.05 };
  let [drawn, y] = axes(box, "performance P");
  const x = (i) => box.left + 30 + (i * (box.right - box.left - 60)) / (samples.length - 1);
  chosen.arms.forEach((arm, i) => {
    drawn += `<text x="${x(i)}" y="${height - 6}" text-anchor="middle">${escaped(arm[0])}</text>`;
  });
  const means = samples.map((p) => recorded(p).reduce((sum, value) => sum + value, 0) / Math.max(1, recorded(p).length));
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
  put(container, width, height, drawn, `P ${repeat} by ${repeat}`);
}

function timesOf(gaps) {
  let time = 0;
  return gaps.map((gap) => (time += gap));
}

function drawCurves() {
  const container = at("curves"), width = Math.max(280, container.clientWidth), height = 220;
  const curves = chosen.arms.map((arm) => data.conditions[arm[2]].curves.map((gaps) => gaps && timesOf(gaps)));
  container.parentElement.hidden = !curves.flat().some(Boolean);  // no times were recorded
  if (container.parentElement.hidden) return;
  const end = Math.max(...chosen.arms.map((arm) => data.conditions[arm[2]].end));
  const most = Math.max(1, ...curves.flat().filter(Boolean).map((times) => times.length));
  const box = { left: 42, right: width - 12, top: 20, bottom: height - 24, low: 0, high: most * 1.05 };
  let [drawn, y] = axes(box, "deliveries");
  const x = (time) => box.left + (time / end) * (box.right - box.left);
  for (const tick of ticks(0, end, 5)) drawn += `<text x="${x(tick)}" y="${height - 6}" text-anchor="middle" class="soft">${tidy(tick)}${tick ? "" : " s"}</text>`;
  const line = (points) => points.map(([time, count]) => `${x(time).toFixed(1)},${y(count).toFixed(1)}`).join(" ");
  const single = (i, k) => {
    const times = curves[i][k];
    if (!times) return "";
    const steps = [[0, 0], ...times.flatMap((time, count) => [[time, count], [time, count + 1]]), [end, times.length]];
    return `<polyline class="thin${k === chosen.seed ? " chosen" : ""}" points="${line(steps)}" stroke="${colour(i)}" data-seed="${k}"><title>seed ${data.seeds[k]}</title></polyline>`;
  };
  const mean = (runs) => {
    const all = runs.filter(Boolean).flat().sort((a, b) => a - b), n = runs.filter(Boolean).length;
    return n ? line([[0, 0], ...all.map((time, count) => [time, (count + 1) / n]), [end, all.length / n]]) : "";
  };
  // Seed by seed in turn, those of the chosen seed above them and the means last: no condition hides another.
  const seeds = [...Array(Math.max(...curves.map((runs) => runs.length))).keys()].filter((k) => k !== chosen.seed);
  for (const k of [...seeds, chosen.seed]) drawn += curves.map((_, i) => single(i, k)).join("");
  const means = curves.map(mean);
  drawn += means.map((points) => `<polyline class="halo" points="${points}"/>`).join("");
  drawn += means.map((points, i) => `<polyline class="mean" points="${points}" stroke="${colour(i)}" stroke-dasharray="${["none", "9 5", "3 3"][i]}"/>`).join("");
  put(container, width, height, drawn, "deliveries over time");
}

function showRun() {
  const seed = data.seeds[chosen.seed], container = at("run");
  container.hidden = !data.paired;  // unpaired trials have nothing in common but their place
  const isPlayed = Object.values(data.conditions).some((condition) => condition.command);  // not recorded
  const withoutCommand = isPlayed ? ". No command plays this run." : "";
  const runs = chosen.arms.map(([symbol, name, condition]) => {
    const { p, command } = data.conditions[condition];
    const shown = command ? `<code>${unbroken(`${escaped(command)} --seed ${seed}`)}</code>` : withoutCommand;
    return `${escaped(symbol)}, ${escaped(name)}: P = ${p[chosen.seed] ?? "no run"}${shown}`;
  });
  container.innerHTML = `<b>Seed ${seed}</b><br>${runs[1]}${runs[0] === runs[1] ? "" : `<br>${runs[0]}`}`;
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
  const target = event.target.closest("[data-question], [data-condition], [data-seed], .sortable thead th");
  if (!target) return;
  const { question, seed } = target.dataset, condition = target.closest("[data-condition]")?.dataset.condition;
  if (target.matches("th")) sort(target);
  else if (question !== undefined || condition !== undefined) {
    if (question !== undefined) choose(Number(question), seed && Number(seed));
    else chooseCondition(Number(condition), seed && Number(seed));
    at("question").scrollIntoView({ block: "nearest" });
  } else {
    chosen.seed = Number(seed);
    showQuestion();
  }
});

at("views").addEventListener("change", showView);
showView();
titleDots();
choose(0);
let width = innerWidth;
addEventListener("resize", () => { if (innerWidth !== width) { width = innerWidth; showQuestion(); } });
// On paper nothing can be unfolded: the warnings belong to the answer.
addEventListener("beforeprint", () => { for (const warning of document.querySelectorAll(".warnings")) warning.open = true; });
// A link to a folded chapter unfolds it.
const unfold = () => { const chapter = at(location.hash.slice(1)); if (chapter && chapter.matches("details")) chapter.open = true; };
addEventListener("hashchange", unfold);
unfold();
