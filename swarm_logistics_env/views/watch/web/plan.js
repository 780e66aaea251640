"use strict";

// Draws a floor plan: areas below the floor's lines, docks, walls and racks above them.

const BAY = 1000, SLATS = 4, LEAST_GAP = 5; // [mm] from post to post of a rack; slats; [px] between them

// Left, top, width and height [px] of a box [mm]; boxes that touch have no gap between them.
function rectOf([lowX, lowY, highX, highY], at) {
  const [left, bottom] = at([lowX, lowY]).map(Math.round), [right, top] = at([highX, highY]).map(Math.round);
  return [left, top, right - left, bottom - top];
}

function fillAll(pen, rects, colour, extra = 0, away = 0) {
  pen.fillStyle = colour;
  for (const [x, y, width, height] of rects) pen.fillRect(x - extra + away, y - extra + away, width + 2 * extra, height + 2 * extra);
}

function cellOf(plan, at) {
  return at([plan.cell, 0])[0] - at([0, 0])[0];
}

function planAreas(pen, plan, at) {
  fillAll(pen, plan.storage.map((box) => rectOf(box, at)), colours.STORAGE);
  fillAll(pen, plan.start.map((box) => rectOf(box, at)), colours.START);
  const arm = Math.max(1, Math.round(0.12 * cellOf(plan, at)));
  for (const [lowX, lowY, highX, highY] of plan.start) {
    for (let x = lowX + plan.cell / 2; x < highX; x += plan.cell) {
      for (let y = lowY + plan.cell / 2; y < highY; y += plan.cell) {
        const [column, row] = at([x, y]);
        fillAll(pen, [[column - arm, row - 0.5, 2 * arm, 1], [column - 0.5, row - arm, 1, 2 * arm]], colours.START_CROSS);
      }
    }
  }
}

function docksAndSolids(pen, plan, at) {
  const cell = cellOf(plan, at), edge = Math.max(1, Math.round(0.07 * cell)), reach = Math.max(1, Math.round(0.16 * cell));
  for (const dock of plan.docks) drawDock(pen, dock, at, cell);
  const [walls, racks] = [plan.walls, plan.racks].map((boxes) => boxes.map((box) => rectOf(box, at)));
  fillAll(pen, [...walls, ...racks], colours.SHADOW, 0, reach);
  for (const rack of racks) drawRack(pen, rack, edge, (cell * BAY) / plan.cell);
  // All edges first, so that none is left where two boxes of a wall meet.
  fillAll(pen, walls, colours.INK, edge);
  fillAll(pen, walls, colours.WALL);
}

function drawDock(pen, { letter, hue, boxes, letter_box }, at, cell) {
  const rects = boxes.map((box) => rectOf(box, at)), gap = Math.max(8, 0.35 * cell);
  pen.globalAlpha = 0.16;
  fillAll(pen, rects, colours[hue]);
  for (const [x, y, width, height] of rects) {
    pen.save();
    pen.beginPath();
    pen.rect(x, y, width, height);
    pen.clip();
    // The same lines in all boxes, so that they go on from one to the next.
    for (let nth = Math.floor((x + y) / gap); nth * gap < x + y + width + height; nth++) {
      line(pen, [[nth * gap - y, y], [nth * gap - y - height, y + height]], Math.max(1, gap / 10), colours[hue]);
    }
    pen.restore();
  }
  pen.globalAlpha = 1;
  const [x, y, width, height] = rectOf(letter_box, at);
  pen.font = `700 ${Math.min(0.8 * Math.min(width, height), 90)}px system-ui, sans-serif`;
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.fillStyle = colours[hue];
  pen.fillText(letter, x + width / 2, y + height / 2);
}

function drawRack(pen, [x, y, width, height], edge, bay) {
  fillAll(pen, [[x, y, width, height]], colours.RACK_EDGE);
  fillAll(pen, [[x, y, width, height]], colours.RACK, -edge);
  const isUpright = height > width, length = Math.max(width, height) - 2 * edge;
  const nBays = Math.max(1, Math.round(length / bay)), nSlats = Math.min(SLATS, Math.floor(length / nBays / LEAST_GAP)) || 1;
  for (let nth = 1; nth < nBays * nSlats; nth++) {
    const away = Math.round((nth * (length + edge)) / (nBays * nSlats));
    const slat = isUpright ? [x + edge, y + away, width - 2 * edge, edge] : [x + away, y + edge, edge, height - 2 * edge];
    fillAll(pen, [slat], nth % nSlats ? colours.RACK_SLAT : colours.RACK_EDGE);
  }
}

function dockBadge(pen, x, y, height, letter, hue) {
  disc(pen, x, y, height / 2 + 1, colours.FLOOR);
  disc(pen, x, y, height / 2, colours[hue]);
  pen.font = `700 ${0.75 * height}px system-ui, sans-serif`;
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.fillStyle = colours.FLOOR;
  pen.fillText(letter, x, y + 0.05 * height);
}
