"use strict";

// The legend: every mark of an arena, drawn by what draws it there, and a sentence on each.

const MID = 11; // [px] half a picture's side

// A piece of floor plan that fills the picture.
function piece(kinds) {
  const at = ([x, y]) => [3 + (16 * x) / 1000, 19 - (16 * y) / 1000];
  const plan = { walls: [], racks: [], storage: [], start: [], docks: [], cell: 500, ...kinds };
  return (pen) => {
    planAreas(pen, plan, at);
    docksAndSolids(pen, plan, at);
    pen.strokeStyle = colours.ITEM_EDGE;
    pen.strokeRect(2.5, 2.5, 17, 17);
  };
}

function planEntries(plan) {
  const box = [0, 0, 1000, 1000], dock = { letter: "A", hue: plan.docks[0].hue, boxes: [box], letter_box: box };
  const entries = [
    ["docks", "dock", "A dock: a requested item that is brought here is delivered. Where a request names its dock, the item shows the letter.", piece({ docks: [dock] })],
    ["racks", "rack", "A rack: robots cannot pass.", piece({ racks: [box] })],
    ["walls", "wall", "A wall.", piece({ walls: [box] })],
    ["storage", "storage", "Items are stored here.", piece({ storage: [box] })],
    ["start", "start", "Robots start here.", piece({ start: [box] })],
  ];
  return entries.filter(([kind]) => plan[kind].length).map(([, ...entry]) => entry);
}

// Name, explanation and picture of each mark that this warehouse may show.
function legendEntries({ modes, plan, kinds }, now) {
  const { obstacles, scenario } = now;
  const robot = (name, load) => (pen) => {
    body(pen, 10, MID, 7, colours[name], false);
    if (load) item(pen, 10, MID, 3.2, name === "DELIVERING");
  };
  const marks = modes.filter(({ mark }) => mark).map(({ name, mark, meaning }) => `${mark}: ${name}, ${meaning}`);
  const entries = [
    ["searching", "A robot that carries nothing.", robot("SEARCHING", false)],
    ["shuffling", "A robot that carries an item that is not requested.", robot("SHUFFLING", true)],
    ["delivering", "A robot that carries a requested item.", robot("DELIVERING", true)],
    ["heading", "The nose of a robot shows where it heads.", robot("FLOOR", false)],
    ["timer", "Timer: the time since the robot left the delivery area, which it tells by radio. The halo fades meanwhile.", (pen) => { halo(pen, MID, MID, 4.4, 0); body(pen, MID, MID, 4, colours.SEARCHING, false); }],
    ["lowest timer heard", "Points to the neighbour whose timer is the lowest that the robot hears. With \"all links\", all robots show it.", (pen) => arrow(pen, [1, 19], [26, -6], 4, 2, colours.LINK)],
    ["failed", `A robot that fails. The mark names the failure mode:\n${marks.join("\n")}`, (pen) => badge(pen, MID, MID, 15, "4")],
    ["selected", "The robot that is inspected.", (pen) => selection(pen, MID, MID, 4)],
    ["its sensors", "The beams of the selected robot, with a dot where they meet something. The circle is how far it sees.", (pen) => drawBeams(pen, { beams: Array(8).fill(10), reach: 10, view: 6 }, [0, 0, 0], () => [MID, MID], 1)],
    ["item", "An item in store that is not requested.", (pen) => item(pen, MID, MID, 5.5, false)],
    ["requested item", "An item that has to be brought to the delivery area. The sight about it goes with it.", (pen) => { target(pen, MID, MID, 6.5); item(pen, MID, MID, 3.5, true); }],
  ];
  (kinds ?? []).forEach((name, kind) => entries.push([`kind ${name}`, `A robot of the kind ${name}, by what is about it.`, (pen) => { kindOutline(pen, MID, MID, 4, kind); body(pen, MID, MID, 4, colours.SEARCHING, false); }]));
  if (scenario.has_due_times) entries.push(["late", "What is asked for and overdue.", (pen) => badge(pen, MID, MID, 15, LATE)]);
  if (now.charge0?.length) entries.push(["charge", `How full a robot's battery is; orange below ${LOW_CHARGE} %. An empty robot stands.`, (pen) => chargeBar(pen, MID, -4, 9, 60)]);
  if (now.stations0?.length) entries.push(["station", "Charges a robot that stands on it. Crossed out: it charges nobody.", (pen) => station(pen, MID, MID, 8, true)]);
  if (obstacles.length) entries.push(["obstacle", "Nothing passes it.", (pen) => obstacle(pen, MID, MID, 8)]);
  if (plan) return [...entries, ...planEntries(plan)];
  return [...entries, ["delivery area", "A requested item that is brought here is delivered.", (pen) => deliveryArea(pen, 3, 3, 19, 19)]];
}

function showLegend(list, entries, explain) {
  list.replaceChildren(...entries.map(([name, about, draw]) => {
    const entry = document.createElement("li"), canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [4 * MID, 4 * MID];
    const pen = canvas.getContext("2d");
    pen.scale(2, 2);
    draw(pen);
    entry.append(canvas, name);
    entry.title = about;
    entry.addEventListener("click", () => explain(about.split("\n")[0]));
    return entry;
  }));
}
