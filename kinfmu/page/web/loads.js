// Symbols of loads, as the scene has them: springs, dampers, forces and torques; the direction of gravity.

import { css, edgeOf, GREY } from "./colours.js";
import { distance } from "./geometry.js";
import { number } from "./numbers.js";
import { BUTTONS } from "./view.js";

const OF_LOADS = { light: [126, 34, 206], dark: [216, 150, 255] };
const PULL = 34; // [px] of the arrow of gravity

export function loads(painter) {
    const { theme, pen, size } = painter;
    const ink = painter.isGhost ? edgeOf(GREY, theme) : css(OF_LOADS[theme.isDark ? "dark" : "light"]);
    for (const load of painter.linkage.data.loads) {
        const found = baseOf(painter, load);
        if (!found) continue;
        const { at, along: [x, y], length, text } = found;
        const all = [];
        for (const { points, area, solid } of load.strips) {
            const line = points.map(([part, own, detail, across]) => {
                const ahead = Math.min(Math.max(part * length + own * painter.view.scale, 0), length) + 1.3 * size * detail;
                const side = 1.3 * size * across;
                return [at[0] + ahead * x + side * y, at[1] + ahead * y - side * x];
            });
            pen.line(line, { width: solid ? 0.5 : 1.8, colour: ink, closed: Boolean(area), fill: area ? (solid ? ink : theme.paper) : null });
            line.slice(1).forEach((p, k) => painter.cover(line[k], p, 3));
            all.push(...line);
        }
        const middle = [0, 1].map((axis) => all.reduce((sum, p) => sum + p[axis], 0) / all.length);
        const along = (part) => [middle[0] + part * length * x, middle[1] + part * length * y];
        painter.name(text, [middle, along(-0.2), along(0.2), all[0]], ink, 14, 1);
    }
}

// Return where a load is, in pixels: { at, along, length, text }; null for one without a direction.
function baseOf({ linkage, dot }, { name, text, points, frame, axes, force, angle, sense }) {
    const places = points.map((point) => dot(linkage.point(point)));
    if (places.length > 1) {
        const [at, end] = places;
        const length = distance(at, end);
        return length ? { at, along: [0, 1].map((axis) => (end[axis] - at[axis]) / length), length, text } : null;
    }
    const set = (key, value) => linkage.bound.get(`loads.${name}.${key}`) ?? value;
    const pose = (body) => (body && linkage.body(body) >= 0 ? linkage.bodyPose(linkage.body(body)) : [0, 0, 0]);
    let turn = pose(axes || frame)[2];
    if (force) {
        const [x, y] = [set("x", force[0]), set("y", force[1])];
        if (!x && !y) return null;
        turn += Math.atan2(y, x);
        text = `${name} = ${number(Math.hypot(x, y))} N`;
    } else if (angle !== undefined) {
        turn += set("angle", angle) + (sense < 0 ? Math.PI : 0);
    }
    return { at: places[0] || dot(pose(frame)), along: [Math.cos(turn), -Math.sin(turn)], length: 0, text };
}

// Draw the direction of gravity in the upper right corner, if nothing is there.
export function gravity(painter) {
    const { linkage, pen, theme, view, boxes, lines } = painter;
    if (!linkage.data.gravity) return;
    const [x, y] = linkage.data.gravity.map((value, k) => linkage.bound.get(`gravity.${"xy"[k]}`) ?? value);
    const size = Math.hypot(x, y);
    const [cx, cy] = [view.width - 34, BUTTONS + 34];
    const box = [cx - 24, cy - 24, cx + 24, cy + 24];
    if (!size || !boxes.isFree(box) || !lines.isFree(box)) return;
    const at = (part, side) => [cx + (part * PULL * x) / size + (side * y) / size, cy - (part * PULL * y) / size + (side * x) / size];
    pen.line([at(-0.5, 0), at(0.3, 0)], { width: 1.6, colour: theme.quiet });
    pen.line([at(0.5, 0), at(0.25, 3), at(0.25, -3)], { width: 1, colour: theme.quiet, fill: theme.quiet, closed: true });
    const [tx, ty] = at(0, y < 0 ? -12 : 12);
    pen.text(tx, ty, "g", { colour: theme.quiet, size: 13, align: "center", italic: true });
    boxes.add(box);
}
