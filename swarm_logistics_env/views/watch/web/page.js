"use strict";

// Plays frames, from the server or from a recording in the page, and sends orders to the server.

const LAG = 0.15; // [s] behind the newest frame, so that there is a next one to move to
const MOST_POSES = 1e5, LEAST_FRAMES = 20; // robots times frames that are kept, and frames whatever the robots
const TRAIL = 2.5; // [s] of a run
const KEYS = [
  [" ", "space", "pause, or go on", () => pause()],
  ["ArrowLeft", "left arrow", "back in what was played", () => goTo(playhead - skip())],
  ["ArrowRight", "right arrow", "forth; from its end one step", () => forth()],
  ["Home", "Home", "to the beginning", () => goTo(0)],
  ["End", "End", "to the end", () => goTo(Infinity)],
  ["+", "+", "faster", () => faster(1)],
  ["-", "-", "slower", () => faster(-1)],
  ["n", "n", "next seed", () => order({ do: "next" })],
  ["0", "0", "this seed again", () => order({ do: "again" })],
  ["f", "f", "what a fault costs", () => order({ do: "show" })],
  ["m", "m", "next failure mode", () => nextMode(1)],
  ["M", "M", "failure mode before", () => nextMode(-1)],
  ["s", "s", "select the next robot", () => selectNext()],
  ["b", "b", "break the selected robot", () => order({ do: "break" })],
  ["r", "r", "repair the selected robot", () => order({ do: "repair" })],
  ["Escape", "Esc", "select no robot", () => order({ do: "select", robot: null })],
  ["]", "]", "swarm + 1", () => resize(1)],
  ["[", "[", "swarm - 1", () => resize(-1)],
  ["w", "w", "delivery area wider", () => widen(0.25)],
  ["W", "W", "delivery area narrower", () => widen(-0.25)],
  ["t", "t", "trails", () => element("trails").click()],
  ["l", "l", "links of all robots", () => element("links").click()],
  ["h", "h", "this help", () => help()],
  [null, "click, tap", "select a robot: what it senses", null],
  [null, "right click, shift click, long press", "break it in the chosen mode, or repair it", null],
];
const element = (id) => document.getElementById(id);
const dark = matchMedia("(prefers-color-scheme: dark)"), touched = matchMedia("(pointer: coarse)");
const recorded = element("recording");
let fixed = null, latest = null, frames = [], socket = null, retries = 0;
let playhead = 0, before = 0, drawn = null, shown = null, problem = { text: "", until: 0 };
let marked = null; // tells which events the timeline shows
let isBehind = false, isHeld = false; // whether the past is shown, and whether the timeline's handle is held
const rate = { frames: 0, since: 0 }; // drawn frames, for measurements

// Frames from the server

function connect() {
  socket = new WebSocket(new URL("live", location.href.replace(/^http/, "ws")));
  socket.onmessage = ({ data }) => receive(JSON.parse(data));
  socket.onopen = () => { retries = 0; frames = []; latest = null; };
  socket.onclose = async () => {
    const refusal = await fetch("live").then((answer) => answer.status === 503 && answer.text(), () => "");
    tell(refusal || "The server has gone. Start swarm-logistics watch again and open the address that it prints.", "lost");
    setTimeout(connect, Math.min(2000, 250 * 2 ** retries++));
  };
}

function tell(text, kind) {
  if (element("state").textContent === text) return;
  element("state").textContent = text;
  element("state").hidden = !text;
  for (const name of ["lost", "failed"]) document.body.classList.toggle(name, kind === name);
  layOut();
}

function receive(message) {
  if (message.past) {
    message.past.forEach(take);
    goTo(Infinity);
  } else if (message.problem) {
    say(message.problem);
  } else {
    const wasPlaying = latest && !latest.over;
    take(message);
    if (wasPlaying && latest.over) say("The episode is over: take the next seed, or this one again.");
    showWords();
    const { failure } = latest;
    tell(failure && `The policy has failed: ${failure}. Choose another one, or begin again.`, failure && "failed");
  }
}

function say(text) {
  problem = { text, until: Date.now() + 8000 };
  setTimeout(showWords, 8000);
  showWords();
}

function take(change) {
  const next = { ...latest, ...change };
  if (latest && next.episode !== latest.episode) [frames, isBehind] = [[], false];
  if (!frames.length) playhead = next.time;
  if (frames.length && frames.at(-1).time === next.time) frames[frames.length - 1] = next;
  else frames.push(next);
  latest = next;
  if (change.fixed) begin(change.fixed);
  // Memory is bounded: of a long run every second frame goes, but of the newest, which are played.
  if (frames.length * next.poses0.length > 3 * MOST_POSES && frames.length > 2 * LEAST_FRAMES) {
    frames = frames.filter((_, nth) => nth % 2 === 0 || nth >= frames.length - LEAST_FRAMES);
  }
}

// Orders are for the present, but for those that change nothing of the run.
function order(what) {
  if (!socket || socket.readyState !== WebSocket.OPEN) return;
  if (!["pause", "speed", "select", "choose"].includes(what.do)) goTo(Infinity);
  socket.send(JSON.stringify(what));
}

// Frames on the screen

function animate(moment) {
  requestAnimationFrame(animate);
  const passed = Math.min(0.1, (moment - before) / 1000);
  before = moment;
  rate.frames++;
  if (!latest) return;
  const last = frames.at(-1).time, pace = latest.paused || isHeld ? 0 : latest.speed;
  playhead += passed * pace;
  if (playhead >= last - LAG * pace && !isHeld) isBehind = false;
  const isFollowing = !recorded && !isBehind;
  if (isFollowing) playhead += (last - LAG * pace - playhead) * Math.min(1, 4 * passed);
  if (isFollowing && latest.paused && last - playhead < 0.01) playhead = last; // it would come ever nearer
  playhead = Math.max(frames[0].time, Math.min(last, playhead));
  const nth = Math.max(0, frameAt(playhead)), now = frames[nth], next = frames[nth + 1] ?? now;
  const share = next === now ? 0 : (playhead - now.time) / (next.time - now.time);
  shown = { now, next, share };
  for (const number of [0, 1]) {
    const trails = element("trails").checked ? trailsUntil(nth, number) : [];
    drawArena(element(`arena${number}`), number, now, next, share, { trails, links: element("links").checked, selected: now.selected });
  }
  if (now !== drawn) showNow(now);
  showMoment();
  if (recorded && playhead === last && !isHeld && !latest.paused) pause();
}

// Arenas as large as the window allows: side by side, or one above the other where they are larger so.
function layOut() {
  if (!latest) return;
  const { warehouse_width: across, warehouse_height: down } = latest.scenario, arenas = element("arenas"), gap = 8;
  const top = arenas.getBoundingClientRect().top + scrollY, head = element("arena0").offsetTop - arenas.offsetTop + 2 * MARGIN;
  const wide = arenas.clientWidth, high = Math.max(240, innerHeight - top - 2 * gap - 2 - parseFloat(getComputedStyle(element("below")).minHeight));
  const scaleOf = (width, height) => Math.min((width - 2 * MARGIN) / across, (height - head) / down);
  const sideBySide = scaleOf((wide - gap) / 2, high), stacked = scaleOf(wide, (high - gap) / 2);
  arenas.classList.toggle("stacked", stacked > sideBySide);
  for (const number of [0, 1]) element(`arena${number}`).style.height = `${Math.max(sideBySide, stacked) * down + 2 * MARGIN}px`;
  drawn = marked = null;
}

function frameAt(time) {
  let [low, high] = [0, frames.length - 1];
  while (low < high) {
    const middle = Math.ceil((low + high) / 2);
    if (frames[middle].time <= time) low = middle; else high = middle - 1;
  }
  return low;
}

function trailsUntil(nth, number) {
  const first = Math.min(frameAt(frames[nth].time - TRAIL), Math.max(0, nth - 1));
  const past = frames.slice(first, nth + 1).map((frame) => frame[`poses${number}`]);
  return Array.from({ length: past[0].length / 3 }, (_, robot) =>
    past.filter((poses) => poses[3 * robot] !== null).map((poses) => [poses[3 * robot], poses[3 * robot + 1]]));
}

function showNow(now) {
  drawn = now;
  element("clock").textContent = `${now.time.toFixed(1)} s`;
  drawTimeline(element("played"), frames[0].time, latest, fixed.curves, endOfStrip());
  element("senses").hidden = !now.selected;
  if (now.selected) showSenses(element("senses"), now.selected);
  drawStrip(element("strip"), now, fixed.curves, endOfStrip());
  const total = now.scenario.restock ? "" : ` of ${now.scenario.n_items}`;
  for (const number of [0, 1]) {
    const { has_orders, has_due_times } = now.scenario;
    const waiting = has_orders ? `, ${now[`waiting${number}`]} wait` : "";
    const late = has_due_times ? `, ${now[`late${number}`].length} late` : "";
    element(`delivered${number}`).textContent = `${now[`deliveries${number}`].length}${total} delivered${waiting}${late}`;
  }
}

// The handle of the timeline, and the marks of events above it.
function showMoment() {
  const handle = element("moment"), end = endOfStrip(), events = latest.events.filter(([moment]) => moment <= latest.time + 1e-6);
  const marks = `${latest.episode} ${events.length} ${end}`;
  if (marked !== marks) {
    marked = marks;
    handle.max = end;
    showEvents(element("events"), events, end, (moment, words) => { goTo(moment); say(words); });
  }
  handle.value = playhead;
  handle.setAttribute("aria-valuetext", `${playhead.toFixed(1)} s`);
  element("now").disabled = !isBehind;
}

// Shows a moment of what was played, the nearest one that there is.
function goTo(moment) {
  if (!frames.length) return;
  const last = frames.at(-1).time;
  playhead = Math.max(frames[0].time, Math.min(last, moment));
  isBehind = playhead < last;
  showWords();
}

function skip() {
  return endOfStrip() / 50;
}

function forth() {
  if (isBehind || recorded) goTo(playhead + skip());
  else order({ do: "step" });
}

// The time at the right end of chart and timeline [s].
function endOfStrip() {
  const { duration } = latest.scenario;
  return recorded ? frames.at(-1).time : Math.min(duration, ROUND.find((end) => end >= Math.max(50, latest.time)) ?? duration);
}

// Words and panels

function showWords() {
  if (!latest) return;
  const { scenario, selected } = latest;
  document.title = `${latest.policy}, seed ${latest.seed}`;
  element("pause").textContent = latest.paused ? "play" : "pause";
  for (const id of ["pause", "step"]) element(id).disabled = !recorded && Boolean(latest.failure);
  element("speed").value = latest.speed;
  element("mode").value = latest.mode;
  element("policy").value = latest.policy;
  element("against").value = latest.against ?? "";
  element("note").textContent = Date.now() < problem.until ? problem.text : latest.note ?? "";
  for (const name of ["n_robots", "delivery_width"]) {
    if (document.activeElement !== element(name)) element(name).value = scenario[name];
  }
  const { meaning } = fixed.modes.find(({ name }) => name === latest.mode);
  const present = selected ? `It is ${selected.kind ? `of the kind ${selected.kind}, ` : ""}${selected.activity} and ${selected.modes.length ? `fails: ${selected.modes.join(", ")}` : "sound"}. ` : "";
  const does = isBehind ? "The past is shown; break and repair act on the present. " : present;
  element("meaning").textContent = `${does}${latest.mode}: ${meaning}.`;
  element("robot").textContent = selected ? `Robot ${selected.robot}` : `${touched.matches ? "Tap" : "Click"} a robot`;
  element("break").disabled = !selected || latest.over || selected.modes.includes(latest.mode);
  element("repair").disabled = !selected || latest.over || !selected.modes.length;
  element("indicators").hidden = Boolean(selected);
}

function paint() {
  if (!latest) return;
  colours = { ...fixed.colours[dark.matches ? "dark" : "light"] };
  sprites = new Map();
  for (const [name, colour] of Object.entries(colours)) document.documentElement.style.setProperty(`--${name}`, colour);
  showLegend(element("legend"), legendEntries(fixed, latest), say);
  fixed.curves.forEach(([name], number) => { element(`swatch${number}`).style.background = colours[name]; });
  layOut();
  showWords();
}

// Controls

function fill(list, entries) {
  list.replaceChildren(...entries.map(([value, text]) => new Option(text, value)));
}

function begin(message) {
  fixed = message;
  element("delivery_width").disabled = Boolean(fixed.plan);
  element("delivery_width").title = fixed.plan ? "The floor plan has the docks." : "";
  fill(element("speed"), fixed.speeds.map((speed) => [speed, `${speed}×`]));
  fill(element("mode"), fixed.modes.map(({ name, mark }) => [name, mark ? `${name} (${mark})` : name]));
  fill(element("policy"), fixed.choices.map((name) => [name, name]));
  fill(element("against"), [["", "the same, no faults"], ...fixed.choices.map((name) => [name, `against ${name}`])]);
  paint();
}

function pause() {
  if (!recorded) return order({ do: "pause" });
  latest.paused = !latest.paused;
  if (!latest.paused && playhead === frames.at(-1).time) playhead = 0;
  showWords();
}

function setSpeed(speed) {
  if (recorded) { latest.speed = speed; element("speed").value = speed; } else order({ do: "speed", speed });
}

function faster(by) {
  const speeds = fixed.speeds, now = speeds.indexOf(latest.speed);
  setSpeed(speeds[Math.max(0, Math.min(speeds.length - 1, now + by))]);
}

function nextMode(by) {
  const names = fixed.modes.map(({ name }) => name), now = names.indexOf(latest.mode);
  order({ do: "choose", mode: names[(now + by + names.length) % names.length] });
}

function resize(by) {
  order({ do: "resize", n_robots: latest.scenario.n_robots + by });
}

function selectNext() {
  const poses = posesBetween(shown.now, shown.now, 0, 0), last = latest.selected?.robot ?? -1;
  const present = [...poses.keys()].filter((robot) => poses[robot]);
  order({ do: "select", robot: present.find((robot) => robot > last) ?? present[0] });
}

function widen(by) {
  order({ do: "widen", width: latest.scenario.delivery_width + by });
}

function help() {
  if (element("help").open) element("help").close();
  else element("help").showModal();
}

function robotAt(event, number) {
  const canvas = element(`arena${number}`), { left, top } = canvas.getBoundingClientRect(), floor = placeOf(canvas, latest.scenario);
  const x = (event.clientX - left - floor.left) / floor.scale, y = (floor.bottom - (event.clientY - top)) / floor.scale;
  let nearest = null, least = Math.max(2 * latest.scenario.robot_radius, 22 / floor.scale);
  posesBetween(shown.now, shown.next, shown.share, number).forEach((pose, robot) => {
    const away = pose ? Math.hypot(pose[0] / 1000 - x, pose[1] / 1000 - y) : Infinity;
    if (away <= least) [nearest, least] = [robot, away];
  });
  return nearest;
}

function listen() {
  for (const number of [0, 1]) {
    const canvas = element(`arena${number}`);
    canvas.addEventListener("click", (event) => {
      if (!shown) return;
      const robot = robotAt(event, number);
      order(event.shiftKey && robot !== null ? { do: "toggle", robot } : { do: "select", robot });
    });
    canvas.addEventListener("contextmenu", (event) => {
      event.preventDefault();
      const robot = shown && robotAt(event, number);
      if (robot !== null) order({ do: "toggle", robot });
    });
  }
  for (const name of ["step", "again", "next", "show", "break", "repair"]) element(name).addEventListener("click", () => order({ do: name }));
  element("pause").addEventListener("click", pause);
  element("now").addEventListener("click", () => goTo(Infinity));
  element("moment").addEventListener("input", ({ target }) => goTo(Number(target.value)));
  element("moment").addEventListener("pointerdown", () => { isHeld = true; });
  for (const name of ["pointerup", "pointercancel"]) addEventListener(name, () => { isHeld = false; });
  element("speed").addEventListener("change", (event) => setSpeed(Number(event.target.value)));
  element("mode").addEventListener("change", (event) => order({ do: "choose", mode: event.target.value }));
  for (const name of ["policy", "against"]) {
    element(name).addEventListener("change", () => order({ do: "compare", policy: element("policy").value, against: element("against").value || null }));
  }
  const onNumber = (name, act) => element(name).addEventListener("change", ({ target }) => target.value && act(target.valueAsNumber));
  onNumber("n_robots", (count) => order({ do: "resize", n_robots: Math.round(count) }));
  onNumber("delivery_width", (width) => order({ do: "widen", width }));
  element("help_button").addEventListener("click", help);
  element("help").addEventListener("click", () => element("help").close());
  for (const [, label, meaning] of KEYS) {
    const row = element("keys").insertRow();
    for (const text of [label, meaning]) row.insertCell().textContent = text;
  }
  dark.addEventListener("change", paint);
  addEventListener("resize", () => { layOut(); showWords(); });
  document.addEventListener("keydown", press);
  // After a click with the mouse, keys mean the session again, not the button.
  document.addEventListener("click", (event) => {
    const focused = document.activeElement;
    if (event.detail > 0 && focused?.matches("button, [type=range]")) focused.blur();
  });
}

function press(event) {
  const tag = event.target.tagName;
  if (!latest || event.ctrlKey || event.metaKey || event.altKey || tag === "SELECT") return;
  if (tag === "INPUT" && event.target.type === "number") return;
  if (event.key === " " && (tag === "BUTTON" || tag === "INPUT")) return; // space is that button's
  const command = KEYS.find(([name]) => name === event.key);
  if (!command || (element("help").open && event.key === "Escape")) return;
  event.preventDefault();
  command[3]();
}

async function replay() {
  document.body.classList.add("recorded");
  const packed = Uint8Array.from(atob(recorded.textContent), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const { past } = await new Response(stream).json();
  past.forEach(take);
  for (const id of ["policy", "against"]) element(id).disabled = true;
  goTo(0);
  showWords();
  tell("");
}

listen();
requestAnimationFrame(animate);
if (recorded) replay();
else connect();
