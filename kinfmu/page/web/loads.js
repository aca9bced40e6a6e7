// Symbols of loads, as the scene has them: springs, dampers, forces and torques; the direction of gravity.

import { valueOf } from "./cams.js";
import { LOOK, tint } from "./pen.js";
import { distance, symbol } from "./geometry.js";
import { number } from "./numbers.js";
import { BUTTONS } from "./view.js";

const PULL = 34; // [px] of the arrow of gravity

export function loads(painter) {
    const { theme, pen, size } = painter;
    for (const load of painter.linkage.data.loads) {
        const found = baseOf(painter, load);
        if (!found) continue;
        const { along: [x, y], length, text, flips } = found;
        const ink = painter.isGhost ? theme.quiet : tint("own", load.colour, theme);
        const all = [];
        for (const { points, stroke } of load.strips) {
            const line = symbol(found, points, painter.view.scale, size, flips);
            const [row] = LOOK.strokes[stroke];
            pen.line(line, { ...painter.look(row, load.colour), closed: Boolean(row.fill) });
            painter.names.coverAll(line, 3);
            line.slice(1).forEach((b, k) => painter.symbols.push({ table: "loads", name: load.name, ends: [line[k], b] }));
            all.push(...line);
        }
        const middle = [0, 1].map((axis) => all.reduce((sum, p) => sum + p[axis], 0) / all.length);
        const along = (part) => [middle[0] + part * length * x, middle[1] + part * length * y];
        painter.name(text, [middle, along(-0.2), along(0.2), all[0]], ink, 14, 1);
    }
}

// Return where a load is, in pixels: { at, along, length, text, flips }; null for one without a direction.
function baseOf({ linkage, dot }, load) {
    const { name, type, points, frame, axes, isAgainst, unit } = load;
    const places = points.map((point) => dot(linkage.point(point)));
    const set = numbersOf(linkage, load);
    if (Object.values(set).includes(undefined)) return null;
    const { x, y, angle, level } = set;
    const isTurned = level !== undefined && level * load.level.value < 0; // the other way than in the file
    const text = level === undefined ? load.text : `${name} = ${number(Math.abs(level))} ${unit}`;
    if (places.length > 1) {
        const [at, end] = places;
        const length = distance(at, end);
        const along = [0, 1].map((axis) => (end[axis] - at[axis]) / length);
        return length ? { at, along, length, text, flips: [isTurned ? -1 : 1, 1] } : null;
    }
    const body = linkage.body(frame);
    const pose = body < 0 ? [0, 0, 0] : linkage.bodyPose(body);
    const turned = axes ? linkage.body(axes) : body;
    let turn = turned < 0 ? 0 : linkage.bodyPose(turned)[2];
    const flips = [1, type === "torque" && isTurned ? -1 : 1];
    const base = { at: places[0] || dot(pose), length: 0, flips, text };
    if (x !== undefined) {
        if (!x && !y) return null;
        turn += Math.atan2(y, x);
        base.text = `${name} = ${number(Math.hypot(x, y))} N`;
    } else if (angle !== undefined) {
        turn += angle + (isAgainst !== isTurned ? Math.PI : 0);
    }
    return { ...base, along: [Math.cos(turn), -Math.sin(turn)] };
}

// Return the numbers of a load as set, by key; undefined where an expression of changed parameters gives one.
function numbersOf(linkage, load) {
    const own = `${load.name}.level`; // where it is a constant of a law, not a plain number of the file
    const level = linkage.bound.has(own) ? own : `loads.${load.name}.law.level`;
    const keys = ["x", "y", "angle", "level"].filter((key) => load[key]);
    return Object.fromEntries(keys.map((key) => [key, valueOf(linkage, key === "level" ? level : `loads.${load.name}.${key}`, load[key])]));
}

// Return in words which loads cannot be drawn with the values as set.
export function loadsLeftOut(linkage) {
    return linkage.data.loads.filter((load) => Object.values(numbersOf(linkage, load)).includes(undefined)).map(({ name }) => `the load ${name}, whose numbers are changed`);
}

// Draw the direction of gravity in the upper right corner, if nothing is there.
export function gravity(painter) {
    const { linkage, pen, theme, view, names } = painter;
    if (!linkage.data.gravity) return;
    const [x, y] = linkage.data.gravity.map((value, k) => linkage.bound.get(`gravity.${"xy"[k]}`) ?? value);
    const size = Math.hypot(x, y);
    const [cx, cy] = [view.width - 34, BUTTONS + 34];
    const box = [cx - 24, cy - 24, cx + 24, cy + 24];
    if (!size || !names.isFree(box)) return;
    const at = (part, side) => [cx + (part * PULL * x) / size + (side * y) / size, cy - (part * PULL * y) / size + (side * x) / size];
    pen.line([at(-0.5, 0), at(0.3, 0)], { width: 1.6, colour: theme.quiet });
    pen.line([at(0.5, 0), at(0.25, 3), at(0.25, -3)], { width: 1, colour: theme.quiet, fill: theme.quiet, closed: true });
    const [tx, ty] = at(0, y < 0 ? -12 : 12);
    pen.text(tx, ty, "g", { colour: theme.quiet, size: 13, align: "center", italic: true });
    names.boxes.add(box);
}
