"use strict";

// Tells in words what a robot senses: its observation, whose names are in the titles of the lines.

function range(values) {
  const [least, most] = [Math.min(...values), Math.max(...values)].map((value) => +value.toFixed(1));
  return least === most ? `${least}` : `${least} to ${most}`;
}

// How far and where something is, from its components forward and left.
function whereabouts(forward, left, unit = "m") {
  const turn = Math.round((Math.atan2(left, forward) * 180) / Math.PI), length = `${Math.hypot(forward, left).toFixed(1)} ${unit}`;
  if (Math.abs(turn) < 5) return `${length} ahead`;
  if (Math.abs(turn) > 175) return `${length} to the back`;
  return `${length}, ${Math.abs(turn)}° ${turn > 0 ? "left" : "right"}`;
}

function alongBeams(reaches, reach) {
  const least = Math.min(...reaches), angle = (2 * Math.PI * reaches.indexOf(least)) / reaches.length;
  return least < reach - 0.005 ? whereabouts(least * Math.cos(angle), least * Math.sin(angle)) : `none within ${reach.toFixed(1)} m`;
}

// How many things there are whose flag is set, and where the nearest is: they are sorted so.
function things(flags, forward, left) {
  const present = [...flags.keys()].filter((nth) => flags[nth] > 0.5), [first] = present;
  if (!present.length) return "none";
  return `${present.length}, ${present.length > 1 ? "nearest " : ""}${whereabouts(forward[first], left[first])}`;
}

function sees(row, reach) {
  const items = (flags) => things(flags, row.item_x, row.item_y);
  return [
    [`beams to robots: ${alongBeams(row.range_robots, reach)}`, "range_robots"],
    [`beams to walls: ${alongBeams(row.range_walls, reach)}`, "range_walls"],
    [`beams to items: ${alongBeams(row.range_items, reach)}`, "range_items"],
    [`items: ${items(row.item_present)}`, "item_present, item_x, item_y"],
    [`requested items: ${items(row.item_requested)}`, "item_requested, item_x, item_y"],
    [`items put down lately: ${items(row.item_recently_held)}`, "item_recently_held, item_x, item_y"],
    [`robots: ${things(row.neighbour_present, row.neighbour_x, row.neighbour_y)}`, "neighbour_present, neighbour_x, neighbour_y"],
    ...(row.charge ? [[`stations: ${things(row.station_present, row.station_x, row.station_y)}`, "station_present, station_x, station_y"]] : []),
  ];
}

function hears(row) {
  const timers = row.neighbour_timer.filter((_, nth) => row.neighbour_timer_heard[nth] > 0.5);
  const sender = whereabouts(row.lowest_timer_x[0], row.lowest_timer_y[0]);
  const lowest = row.lowest_timer_present[0] > 0.5 ? `${range(row.lowest_timer)} s, ${sender}` : "none";
  const lines = [
    [`timers: ${timers.length ? `${timers.length}, ${range(timers)} s` : "none"}`, "neighbour_timer_heard, neighbour_timer"],
    [`lowest: ${lowest}`, "lowest_timer_present, lowest_timer, lowest_timer_x, lowest_timer_y"],
  ];
  if (row.neighbour_message) lines.push([`messages: ${range(row.neighbour_message)}`, "neighbour_message"]);
  return lines;
}

function holds(row) {
  const load = row.carrying_requested[0] > 0.5 ? "a requested item" : "an item that is not requested";
  return [[row.carrying[0] > 0.5 ? load : "nothing", "carrying, carrying_requested"]];
}

function does(row) {
  const [forward, left] = row.velocity, turn = Math.round((row.turn_rate[0] * 180) / Math.PI);
  const away = row.timer_runs[0] > 0.5 ? `left the delivery area ${range(row.timer)} s ago` : "is outside, its timer silent";
  return [
    [Math.hypot(forward, left) < 0.05 ? "stands" : `drives ${whereabouts(forward, left, "m/s")}`, "velocity"],
    [turn ? `turns ${Math.abs(turn)}°/s ${turn > 0 ? "left" : "right"}` : "does not turn", "turn_rate"],
    [row.contact[0] > 0.5 ? "touches something" : "touches nothing", "contact"],
    ...(row.charge ? [[`has ${Math.round(100 * row.charge[0])} % of its battery${row.charging[0] > 0.5 ? ", and charges" : ""}`, "charge, charging"]] : []),
    [row.in_delivery_area[0] > 0.5 ? "is in the delivery area" : away, "in_delivery_area, timer_runs, timer"],
  ];
}

function showSenses(container, { row, reach }) {
  const groups = [["sees", sees(row, reach)], ["hears", hears(row)], ["holds", holds(row)], ["does", does(row)]];
  container.replaceChildren(...groups.map(([name, lines]) => {
    const group = document.createElement("div"), heading = document.createElement("dt");
    heading.textContent = name;
    group.append(heading, ...lines.map(([words, names]) => {
      const entry = document.createElement("dd");
      entry.textContent = words;
      entry.title = names;
      return entry;
    }));
    return group;
  }));
}
